"""The eigenproblem I e = lambda e of an inertia tensor, and which pairs of an answer solve it.

With symbols it is solved at a point, where they have values: what is wrong there is wrong. What is right
there, within the tolerance, is asked again in symbols.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.check.entries import EXACT, Entry, Ruler, Same, filled
from rigidcli.check.kinds.tensors import matched
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ValueProblem
from rigidcli.language import tree

EQUAL = 1e-3
"""Moments that differ by less, in units of the largest, are equal: three figures do not tell their axes."""

INDEPENDENT = 0.02
"""Axes whose smallest singular value is above this span the space, however wide the tolerance is."""

ZERO = 1e-12
"""A moment, or a difference of moments, below this in units of the largest is rounding noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Eigen:
    """The `tensor` (3 by 3) of which an answer must have the axes, in floats (kg m^2) or trees.

    It has `moments` (3, ascending), `axes` (rows), and it is known which moments are `equal` (3 by 3).
    """

    ruler: Ruler
    tensor: Array
    moments: Floats
    axes: Floats
    equal: Mask


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """The moments (n, or none at all) and the axes (n by 3) of an answer, as they were read."""

    moments: tuple[Entry, ...]
    axes: tuple[tuple[Entry, ...], ...]


def solved(ruler: Ruler, tensor: Array) -> Eigen:
    """The eigenproblem of a symmetric tensor with its solution. Raises ValueProblem for a tensor of zeros."""
    numbers = ruler.numbers(tensor.ravel().tolist())[:, 0].reshape(3, 3)
    scale = float(np.abs(numbers).max())
    if not scale:
        raise ValueProblem("a tensor of zeros has no axes of its own")
    moments, vectors = np.linalg.eigh(numbers / scale)
    largest = float(np.abs(moments).max())
    moments[np.abs(moments) < ZERO * largest] = 0.0
    near = max(ZERO, min(EQUAL, ruler.slack)) * largest
    equal = np.asarray(np.abs(moments[:, None] - moments) <= near)
    return Eigen(replace(ruler, largest=largest * scale), tensor, moments * scale, vectors.T, equal)


class Solver:
    """Pairs beside the solutions of the eigenproblem."""

    def __init__(self, eigen: Eigen, pairs: Pairs) -> None:
        self.eigen, self.ruler, self.pairs = eigen, eigen.ruler, pairs
        self.isotropic = bool(eigen.equal.all())
        axes = np.array([self.ruler.numbers(axis)[:, 0] for axis in pairs.axes])
        with np.errstate(all="ignore"):
            axes = axes / np.abs(axes).max(axis=1, keepdims=True)  # so that squares stay within floats
            self.units = np.nan_to_num(axes / np.linalg.norm(axes, axis=1, keepdims=True))
        right: list[float] = eigen.moments.tolist()
        self.moments = [[self._same(own, each) for each in right] for own in pairs.moments]
        self.partners = matched(self.moments)
        squares = (self.units @ eigen.axes.T) ** 2
        inside, outside = np.sqrt(squares @ eigen.equal), np.sqrt(squares @ np.logical_not(eigen.equal))
        self.axes = np.where(inside > 0, np.arctan2(outside, inside), math.pi) <= self.ruler.angle

    def _same(self, entry: Entry, moment: float) -> Same:
        if self.ruler.names is None:
            return self.ruler.same(entry, moment)
        allowed = self.ruler.slack * abs(moment) + EXACT * self.ruler.largest
        return abs(float(self.ruler.numbers([entry])[0, 0]) - moment) <= allowed

    @property
    def _tensor(self) -> Array:
        return _without_zeros(self.eigen.tensor.ravel().tolist()).reshape(3, 3)

    def moment(self, k: int) -> bool:
        """Whether the moment of a pair is one of the body, and not that of another pair."""
        return bool(self.pairs.moments) and self.partners[k] is not None

    def axis(self, k: int) -> Same:
        """Whether e and I e are parallel."""
        if not self.axes[k].any() or self.ruler.names is None:
            return bool(self.axes[k].any())
        own = _without_zeros(self.pairs.axes[k])
        return self.ruler.vanish(np.cross(self._tensor @ own, own))

    def pair(self, k: int) -> Same:
        """Whether I e = lambda e; without moments, whether e is an axis."""
        if not self.pairs.moments:
            return self.axis(k)
        both = [same for same, near in zip(self.moments[k], self.axes[k], strict=True) if near]
        found = True in both or next((same for same in both if same), False)
        if found is False or self.ruler.names is None:
            return found
        own = _without_zeros(self.pairs.axes[k])
        return self.ruler.vanish(self._tensor @ own - own * self.pairs.moments[k])

    def independent(self, places: Sequence[int]) -> bool:
        """Whether axes span as many dimensions as they are."""
        least = np.linalg.svd(self.units[list(places)], compute_uv=False)[-1]
        return len(places) <= 3 and bool(least > min(2 * self.ruler.angle, INDEPENDENT))

    def orthogonal(self, places: Sequence[int]) -> bool:
        """Whether the last of some axes is at right angles to the others."""
        *others, last = self.units[list(places)]
        return all(abs(float(last @ other)) <= math.sin(2 * self.ruler.angle) for other in others)

    def expected(self) -> Floats:
        """The moments about the axes, e.I.e/e.e (n by k), at all points."""
        axes = np.array([self.ruler.numbers(axis) for axis in self.pairs.axes])
        tensor = self.ruler.numbers(self.eigen.tensor.ravel().tolist()).reshape(3, 3, -1)
        with np.errstate(all="ignore"):
            above, below = np.einsum("kip,ijp,kjp->kp", axes, tensor, axes), (axes**2).sum(axis=1)
            return np.asarray(above / below)


def _without_zeros(trees: Sequence[Entry]) -> Array:
    """Trees with zeros that their arithmetic leaves out."""
    found = [tree.ZERO if isinstance(each, tree.Number) and each.value == 0 else each for each in trees]
    return filled(found, (len(found),))
