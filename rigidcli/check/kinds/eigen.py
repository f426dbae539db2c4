"""The eigenproblem I e = lambda e of an inertia tensor, and which pairs of an answer solve it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rigidcli.check.entries import Entry, Right, Ruler, Same, filled
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

PAIRS = ((0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, slots=True, eq=False)
class Eigen:
    """The `tensor` (3 by 3) of which an answer must have the axes, in floats (kg m^2) or trees.

    Of numbers there are `moments` (3, ascending), `axes` (rows), and which moments are `equal` (3 by 3).
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
    """The eigenproblem of a symmetric tensor, solved where it has numbers. Raises ValueProblem."""
    if ruler.names is not None:
        return Eigen(ruler, tensor, np.zeros(3), np.eye(3), np.eye(3, dtype=bool))
    numbers = np.asarray(tensor, dtype=float)
    scale = float(np.abs(numbers).max())
    if not scale:
        raise ValueProblem("a tensor of zeros has no axes of its own")
    moments, vectors = np.linalg.eigh(numbers / scale)
    largest = float(np.abs(moments).max())
    moments[np.abs(moments) < ZERO * largest] = 0.0
    near = max(ZERO, min(EQUAL, ruler.slack)) * largest
    equal = np.asarray(np.abs(moments[:, None] - moments) <= near)
    return Eigen(replace(ruler, largest=largest * scale), numbers, moments * scale, vectors.T, equal)


class Numbers:
    """Pairs of numbers beside the solutions of the eigenproblem."""

    def __init__(self, eigen: Eigen, pairs: Pairs) -> None:
        self.ruler, self.tensor, self.alone = eigen.ruler, eigen.tensor, not pairs.moments
        axes = np.array([self.ruler.numbers(axis)[:, 0] for axis in pairs.axes])
        with np.errstate(all="ignore"):
            axes = axes / np.abs(axes).max(axis=1, keepdims=True)  # so that squares stay within floats
            self.units = np.nan_to_num(axes / np.linalg.norm(axes, axis=1, keepdims=True))
        right: list[Right] = eigen.moments.tolist()
        self.moments = [[self.ruler.same(own, each) for each in right] for own in pairs.moments]
        self.partners = matched(self.ruler, pairs.moments, right)
        squares = (self.units @ eigen.axes.T) ** 2
        inside, outside = np.sqrt(squares @ eigen.equal), np.sqrt(squares @ np.logical_not(eigen.equal))
        self.axes = np.where(inside > 0, np.arctan2(outside, inside), math.pi) <= self.ruler.angle
        self.isotropic = bool(eigen.equal.all())

    def moment(self, k: int) -> Same:
        """Whether the moment of a pair is one of the body."""
        return not self.alone and self.partners[k] is not None

    def axis(self, k: int) -> Same:
        """Whether the axis of a pair is one of the body."""
        return bool(self.axes[k].any())

    def pair(self, k: int) -> Same:
        """Whether I e = lambda e."""
        both = [same for same, near in zip(self.moments[k], self.axes[k], strict=True) if near]
        return True in both or next((same for same in both if same), False)

    def independent(self, places: Sequence[int]) -> bool:
        """Whether axes span as many dimensions as they are."""
        least = np.linalg.svd(self.units[list(places)], compute_uv=False)[-1]
        return len(places) <= 3 and bool(least > min(2 * self.ruler.angle, INDEPENDENT))

    def orthogonal(self, places: Sequence[int]) -> bool:
        """Whether the last of some axes is at right angles to the others."""
        *others, last = self.units[list(places)]
        return all(abs(float(last @ other)) <= math.sin(2 * self.ruler.angle) for other in others)

    def rayleigh(self, k: int) -> Right:
        """The moment about an axis, e.I.e for a unit vector."""
        return float(self.units[k] @ self.tensor @ self.units[k])


class Trees:
    """The same for pairs of trees, for which each equation is one question."""

    def __init__(self, eigen: Eigen, pairs: Pairs) -> None:
        self.ruler, self.tensor, self.moments = eigen.ruler, eigen.tensor, pairs.moments
        self.axes = filled([each for axis in pairs.axes for each in axis], (len(pairs.axes), 3))

    @cached_property
    def isotropic(self) -> bool:
        """Whether every direction is an axis."""
        differences = [self.tensor[k, k] - self.tensor[0, 0] for k in (1, 2)]
        return self.ruler.vanish([*(self.tensor[i, j] for i, j in PAIRS), *differences]) is True

    def moment(self, k: int) -> Same:
        """Whether det(I - lambda) = 0."""
        if not self.moments:
            return False
        return self.ruler.vanish([_determinant(self.tensor - np.diag([self.moments[k]] * 3))])

    def axis(self, k: int) -> Same:
        """Whether e and I e are parallel."""
        own = self.axes[k]
        return self.ruler.vanish(own) is False and self.ruler.vanish(np.cross(self.tensor @ own, own))

    def pair(self, k: int) -> Same:
        """Whether I e = lambda e."""
        own = self.axes[k]
        return self.ruler.vanish(own) is False and self.ruler.vanish(
            self.tensor @ own - own * self.moments[k]
        )

    def independent(self, places: Sequence[int]) -> bool:
        """Whether a product of axes, of two or three, does not vanish."""
        rows = [self.axes[place] for place in places]
        if len(rows) == 2:
            return self.ruler.vanish(np.cross(*rows)) is not True
        return len(rows) < 2 or (
            len(rows) == 3 and self.ruler.vanish([_determinant(np.array(rows))]) is not True
        )

    def orthogonal(self, places: Sequence[int]) -> bool:
        """Whether the last of some axes is at right angles to the others."""
        *others, last = (self.axes[place] for place in places)
        return self.ruler.vanish([last @ other for other in others]) is not False

    def rayleigh(self, k: int) -> Right:
        """The moment about an axis, e.I.e/e.e."""
        own = self.axes[k]
        found: tree.Node = (own @ self.tensor @ own) / (own @ own)
        return found


def _determinant(rows: Array) -> tree.Node:
    found: tree.Node = rows[0] @ np.cross(rows[1], rows[2])
    return found
