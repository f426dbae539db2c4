"""Solutions of equations besides those of the motion: looked for where the equations are not linear.

By the method of Levenberg and Marquardt (J. Nocedal, S. Wright, Numerical Optimization, section 10.3) from
many points at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.equations.determinacy import Tried, floats
from rigidcli.grading.values import Points
from rigidcli.symbolic.language.evaluation import array
from rigidcli.symbolic.language.tree import Node

STARTS = 12
"""Of the search at each state."""

ROUNDS = 60
"""Of the search."""

STEP = 1e-6
"""Of a difference, in units of the size of what changes."""

LINEAR = 1e-8
"""Deviation from a straight line, in units of the values, that is rounding."""

SOLVED = 1e-12
"""Residuals below this, in units of the terms of the equations, are zero."""

APART = 1e-3
"""Solutions further apart than this, in units of their size, are two."""

FAR = 1e4
"""A solution beyond this, in units of that of the motion, is on its way to infinity."""

LARGEST = 1e100
"""Slopes are not steeper."""

STUCK = 1e6
"""A search that is damped by this has found no way down."""

ALONG = np.array([0.0, 1.0, 2.0, -3.0, 0.5])
"""Places on a line through the solution of the motion."""


def is_linear(
    equation: Tried, values: Mapping[str, Floats], unknown: Sequence[str], parameters: Mapping[str, Node]
) -> bool:
    """Whether an equation is linear in the unknown names together, about these values (n).

    `parameters` are those derived from others.
    """
    chance = np.random.default_rng(3)
    count = len(values[unknown[0]])
    shape = (len(ALONG), count)
    lines = dict(values)
    for name in unknown:
        slope = (np.abs(values[name]) + 0.1) * chance.uniform(0.5, 1.5, count)
        lines[name] = values[name] + np.outer(ALONG, slope * chance.choice([-1.0, 1.0], count))
    if equation.is_noisy:
        independent = lines.keys() - parameters.keys()
        points = {name: np.broadcast_to(lines[name], shape).ravel() for name in independent}
        value, _, lost = floats(Points(points, parameters, math.prod(shape)).at(equation.node))
        found = np.where(lost, math.nan, value).reshape(shape)
    else:
        used = {name: lines[name] for name in equation.names}
        found = np.broadcast_to(array(equation.node, used), shape)
    with np.errstate(all="ignore"):
        straight = found[0] + np.outer(ALONG, found[1] - found[0])
        off = np.abs(found - straight).max(axis=0)
        size = np.abs(found).max(axis=0)
    return bool((off <= LINEAR * size).all())


def others(
    equations: Sequence[Tried], values: Mapping[str, Floats], unknown: Sequence[str]
) -> tuple[int, int]:
    """How many searches led to the solution in `values` (n), and how many to others."""
    true = np.repeat(np.array([values[name] for name in unknown]).T, STARTS, axis=0)
    sizes = np.maximum(np.abs(true), 0.1 * np.abs(true).max(axis=1, keepdims=True)) + 1e-300
    fixed = {name: np.repeat(value, STARTS) for name, value in values.items()}

    def residuals(x: Floats) -> Floats:
        """Of unknown values (k, n, u), the residuals (k, n, m)."""
        point = fixed | {name: x[..., place] for place, name in enumerate(unknown)}
        rows = [array(each.node, {name: point[name] for name in each.names}) for each in equations]
        found: Floats = np.stack([np.broadcast_to(row, x.shape[:-1]) for row in rows], axis=-1)
        return found

    start = _starts(true, sizes)
    with np.errstate(all="ignore"):
        typical = np.abs(residuals(start[None])[0]).reshape(-1, STARTS, len(equations))
        typical = np.where(np.isfinite(typical), typical, 0.0)
        weights = 1 / np.repeat(np.maximum(np.median(typical, axis=1), 1e-300), STARTS, axis=0)
        x = _searched(lambda x: residuals(x) * weights, start, sizes)
        solved = np.abs(residuals(x[None])[0] * weights).max(axis=1) < SOLVED
        distance = np.abs((x - true) / sizes).max(axis=1)
    same = solved & (distance < APART)
    return int(same.sum()), int((solved & ~same & (distance < FAR)).sum())


def _starts(true: Floats, sizes: Floats) -> Floats:
    """Where the searches start: with signs turned, and at random."""
    chance = np.random.default_rng(5)
    starts = sizes * chance.uniform(-3, 3, true.shape)
    for turned in range(min(true.shape[1], STARTS // 2) + 1):
        own = slice(turned, None, STARTS)
        signs = np.ones(true.shape[1])
        signs[slice(None) if turned == 0 else turned - 1] = -1
        starts[own] = true[own] * signs + 0.01 * sizes[own]
    return starts


def _searched(residuals: Callable[[Floats], Floats], x: Floats, sizes: Floats) -> Floats:
    """Where the searches from x (n, u) end."""
    width = x.shape[1]
    steps = np.concatenate([np.zeros((1, width)), np.eye(width), -np.eye(width)])[:, None, :] * STEP * sizes
    damping = np.full(len(x), 1e-2)
    for _ in range(ROUNDS):
        found = residuals(x + steps)
        here = found[0]
        slopes = np.moveaxis((found[1 : width + 1] - found[width + 1 :]) / (2 * STEP), 0, -1)
        slopes = np.nan_to_num(slopes, nan=0.0, posinf=0.0, neginf=0.0).clip(-LARGEST, LARGEST)
        scale = np.abs(slopes).max(axis=(1, 2), keepdims=True) + 1 / LARGEST
        slopes = slopes / scale
        square = np.einsum("nmi,nmj->nij", slopes, slopes) + damping[:, None, None] * np.eye(width)
        force = np.einsum("nmi,nm->ni", slopes, np.nan_to_num(here, posinf=0.0, neginf=0.0))
        trial = x - np.linalg.solve(square, force[..., None])[..., 0] / scale[:, 0] * sizes
        before, after = (np.linalg.norm(r, axis=1) for r in (here, residuals(trial[None])[0]))
        better = after < before
        x = np.where(better[:, None], trial, x)
        damping = np.where(better, damping * 0.1, damping * 10).clip(1e-12, STUCK)
        if ((np.minimum(before, after) < SOLVED) | (damping >= STUCK)).all():
            break
    return x
