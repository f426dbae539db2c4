"""Whether equations are true of a motion, and whether they determine it.

Equations are tried on states of the motion with small changes of every derivative: where they are true, and
their slopes in the derivatives have full rank, they can be solved for the motion. Slopes are scaled: that of
a derivative by its size, that of an equation by the sum of its terms so scaled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.equations.states import SINGULAR, Motion
from rigidcli.grading.expressions.formula import names_in, size_of
from rigidcli.grading.values import Estimate, Points
from rigidcli.symbolic.language.evaluation import array
from rigidcli.symbolic.language.tree import Node

STEP = 1e-3
"""Of a difference, in units of the size of what changes."""

PLACES = np.array([1.0, -1.0, 2.0, -2.0])
"""Of the values in a difference, in steps."""

WEIGHTS = np.array([8.0, -8.0, -1.0, 1.0]) / 12
"""Of these values in the slope: M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 25.3.6."""

NOISE = 1e-12
"""A rounding error below this, in units of the terms of the equation, leaves its slopes nine digits."""

FAINT = 1e-5
"""Columns of slopes are scaled to be at most 1, but not by more than the inverse of this."""

FEW = 5
"""States at which slopes are worked with 80 digits, where floats leave them open: it takes long."""

MOST_PRECISE = 300
"""Nodes of a tree for which that is done."""

ENOUGH = 1 / 3
"""Of the states, at which an equation must have values."""

CERTAIN = 2.0
"""A value beyond this many times the bound of its rounding error is not zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Stencil:
    """States (n) of a motion, and there every jet a little larger and smaller, and by twice as much.

    `values` are of shape (n), those of jets (1 + 4 J, n); `sizes` (J, n) are of the jets.
    """

    points: Points
    jets: tuple[str, ...]
    values: Mapping[str, Floats]
    sizes: Floats
    parameters: Mapping[str, Node]

    @property
    def shape(self) -> tuple[int, int]:
        """How many changes there are, and states."""
        return 1 + len(PLACES) * len(self.jets), self.points.count

    def at(self, node: Node, names: frozenset[str]) -> Floats:
        """The values of a tree that has these names (1 + 4 J, n)."""
        found = array(node, {name: self.values[name] for name in names})
        return np.broadcast_to(found, self.shape)

    def precisely_at(self, node: Node) -> Floats:
        """The same worked with 80 digits at a few states: zero where it may be, NaN where there is none."""
        whole: Floats = np.full(self.shape, math.nan)
        if size_of(node) > MOST_PRECISE:
            return whole
        few = (self.shape[0], min(FEW, self.shape[1]))
        independent = self.values.keys() - self.parameters.keys()
        values = {
            name: np.broadcast_to(self.values[name], self.shape)[:, :FEW].ravel() for name in independent
        }
        value, error, lost = floats(Points(values, self.parameters, math.prod(few)).at(node))
        found = np.where(lost, math.nan, np.where(np.abs(value) <= error, 0.0, value))
        whole[:, :FEW] = found.reshape(few)
        return whole


def stencil(motion: Motion, points: Points) -> Stencil:
    """The states of the points, and the small changes."""
    values = {name: value + np.zeros(points.count) for name, value in points.floats.items()}
    jets = motion.jets
    large = np.array([_size(values[name]) for name in jets]).reshape(len(jets), points.count)
    for place, name in enumerate(jets):
        rows = np.tile(values[name], (1 + len(PLACES) * len(jets), 1))
        own = slice(1 + len(PLACES) * place, 1 + len(PLACES) * (place + 1))
        rows[own] += np.outer(STEP * PLACES, large[place])
        values[name] = rows
    return Stencil(points, jets, values, large, motion.parameters)


def _size(values: Floats) -> Floats:
    typical = float(np.mean(np.abs(values))) or 1.0
    return np.maximum(np.abs(values), 0.1 * typical)


def floats(found: Estimate) -> tuple[Floats, Floats, Mask]:
    """Values and the bounds of their errors as floats, and where there are none, or only too small ones."""
    value, error = (np.asarray(part).astype(np.float64) for part in (found.value, found.error))
    too_small = (value == 0) & (found.value != 0)
    return value, error, found.undefined | found.doubtful | too_small | ~np.isfinite(value + error)


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """One equation, tried: its slopes (J, n) at the states, their `scale` (n), and its residual with errors.

    The slopes are scaled; `has_value` tells where there are any. In one that `is_noisy` terms cancel, so
    that floats do not tell slopes.
    """

    node: Node
    names: frozenset[str]
    residual: Estimate
    slopes: Floats
    scale: Floats
    has_value: Mask
    is_noisy: bool = False

    @property
    def is_flat(self) -> bool:
        """Whether nothing depends on any derivative."""
        return not np.any(self.scale[self.has_value] > 0)


def tried(node: Node, on: Stencil) -> Tried:
    """Try the equation whose residual has this tree.

    Where a rounding error could pass for a slope, slopes are worked with 80 digits.
    """
    names = names_in(node)
    residual = on.points.at(node)
    with np.errstate(all="ignore"):
        found = _tried(node, names, residual, on.at(node, names))
        known = found.has_value
        if not residual.doubtful[known].any() and (residual.error <= NOISE * found.scale)[known].all():
            return found
        return _tried(node, names, residual, on.precisely_at(node), is_noisy=True)


def _tried(
    node: Node, names: frozenset[str], residual: Estimate, found: Floats, *, is_noisy: bool = False
) -> Tried:
    slopes = np.einsum("i,jin->jn", WEIGHTS / STEP, found[1:].reshape(-1, len(PLACES), found.shape[1]))
    scale = np.abs(slopes).sum(axis=0)
    has_value = np.isfinite(found).all(axis=0) & np.isfinite(scale) & ~residual.undefined
    return Tried(node, names, residual, slopes, scale, has_value, is_noisy)


def is_true(equation: Tried, points: Points, tolerance: float) -> bool:
    """Whether the equation holds at all states where it has a value, and has one at enough of them."""
    known = equation.has_value
    if known.sum() < ENOUGH * len(known):
        return False
    allowed = tolerance * np.where(known, equation.scale, 0.0)
    value, error, lost = resolved(equation.node, equation.residual, points, allowed)
    seen = known & ~lost
    return bool(seen.sum() >= ENOUGH * len(known) and (value <= allowed + CERTAIN * error)[seen].all())


def resolved(node: Node, found: Estimate, points: Points, small: Floats) -> tuple[Floats, Floats, Mask]:
    """Absolute values of a tree, bounds of their errors, and where there are none.

    With 80 digits where a float may be zero but for rounding, and its error is not `small`.
    """
    value, error, lost = floats(found)
    with np.errstate(invalid="ignore"):
        unsure = found.doubtful | ((np.abs(value) <= CERTAIN * error) & (error > small))
    if unsure.any() and size_of(node) <= MOST_PRECISE:
        value, error, lost = floats(points.at(node))
    return np.abs(value), error, lost


def is_trivial(equation: Tried, elsewhere: Points) -> bool:
    """Whether the equation is true of everything; `elsewhere` has derivatives that are of no motion."""
    if not equation.is_flat:
        return False
    node = equation.node
    value, error, lost = resolved(node, elsewhere.at(node), elsewhere, np.zeros(elsewhere.count))
    return bool((value <= CERTAIN * error)[~lost].all())


def determines(motion: Motion, slopes: Floats, sizes: Floats) -> bool:
    """Whether equations with these slopes (m, J, n) determine the motion at all states (n).

    `sizes` (J, n) are those by which the slopes are scaled. Let the functions be given at an instant, with
    first derivatives where there are second ones. The equations determine the highest derivatives, if no
    change of these and of what is auxiliary (a, and its rate) satisfies them to first order; or, where
    first derivatives and a determine each other, if they can be solved for all first derivatives.
    """
    n, k = len(motion.functions), len(motion.auxiliary)
    by_state = np.moveaxis(slopes, -1, 0)
    top, rest, middle = np.split(by_state, [n, n + 2 * k], axis=2)
    determined = ranks(by_state[:, :, : n + 2 * k]) == ranks(rest) + n
    if determined.all():
        return True
    if k and len(motion.second) == n:
        first = ~(np.abs(top) > 0).any(axis=(0, 2))
        solved = ranks(np.concatenate([rest[:, first, :k], middle[:, first]], axis=2)) == n + k
        if solved.all():
            return True
    return all(
        determined[state] or _determines_later(motion, slopes[:, :, state], sizes[:, state])
        for state in range(slopes.shape[2])
    )


def _determines_later(motion: Motion, slopes: Floats, sizes: Floats) -> bool:
    """Whether equations with these slopes (m, J) do so at one state, once they are differentiated by time.

    Where they determine a, they say L (F_q' dq'' + F_a da') = 0 of its rate and of the highest derivatives,
    with the rows of L such that L F_q'' = L F_a' = 0.
    """
    n, k = len(motion.functions), len(motion.auxiliary)
    top, rate, state, middle = np.split(slopes, [n, n + k, n + 2 * k], axis=1)
    highest = np.hstack([top, rate])
    used = state[:, np.abs(state).max(axis=0, initial=0.0) > SINGULAR]
    if rank(np.hstack([highest, used])) < rank(highest) + used.shape[1]:
        return False
    of_top, of_rate, of_state, of_middle = np.split(sizes, [n, n + k, n + 2 * k])
    vectors, found, _ = np.linalg.svd(_balanced(highest[None])[0])
    left = vectors[:, int((found > SINGULAR).sum()) :].T
    places = [motion.functions.index(name) for name in motion.second]
    through = np.zeros((len(slopes), n))
    through[:, places] = middle * (of_top[places] / of_middle)
    both = np.vstack([highest, left @ np.hstack([through, state * (of_rate / of_state)])])
    return rank(both) == rank(both[:, n:]) + n


def ranks(matrices: Floats) -> NDArray[np.int64]:
    """The ranks of scaled matrices (n, m, k)."""
    if 0 in matrices.shape:
        return np.zeros(len(matrices), dtype=np.int64)
    found: NDArray[np.int64] = (np.linalg.svd(_balanced(matrices), compute_uv=False) > SINGULAR).sum(axis=1)
    return found


def _balanced(matrices: Floats) -> Floats:
    """The matrices (n, m, k) with columns of equal size: one term may be small in all equations."""
    largest = np.abs(matrices).max(axis=1, keepdims=True)
    balanced: Floats = matrices / np.maximum(largest, FAINT)
    return balanced


def rank(matrix: Floats) -> int:
    """The rank of a scaled matrix."""
    return int(ranks(matrix[None])[0])


def loose(slopes: Floats, names: Sequence[str]) -> list[str]:
    """The names (J) that equations with these slopes (m, J, n) leave open at some state."""
    open_: set[int] = set()
    for balanced in _balanced(np.moveaxis(slopes, -1, 0)):
        _, sizes, vectors = np.linalg.svd(balanced)
        free = vectors[int((sizes > SINGULAR).sum()) :]
        open_ |= set(np.flatnonzero(np.abs(free).max(axis=0, initial=0.0) > np.sqrt(SINGULAR)))
    return [name for place, name in enumerate(names) if place in open_]
