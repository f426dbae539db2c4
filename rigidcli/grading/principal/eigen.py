"""The eigen-problem I e = lambda e of an inertia tensor, and which answers solve it within a tolerance.

Moments that the tolerance cannot tell apart share their axes: every direction in the space that they span
is then as good as another, because |I e - lambda e| stays below the tolerance there. With symbols there is a
problem for each of k points at which they are given values, and what is right is so at every point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.principal import EQUAL_MOMENTS
from rigidcli.grading.matching import assigned
from rigidcli.grading.numbers import NOISE, ROUNDING, margin
from rigidcli.grading.question import RELATIVE, Tolerance

NEARLY_EQUAL = 1e-2
"""Moments further apart, in units of the largest, have axes of their own, however wide the tolerance is."""

ZERO_MOMENT = 64 * float(np.finfo(np.float64).eps)
"""A moment below this, in units of the largest, is the rounding noise of a zero."""

UNCERTAIN = 64 * float(np.finfo(np.float64).eps)
"""How far off (rad) rounding may put an axis, in units of the largest moment over the gap to the next."""

WIDEST = 0.05
"""The largest angle (rad) that is allowed to an axis where the question does not say so itself."""

TIE = 1e-3
"""What a pair loses that stands n places from its solution, times n^2: the order decides between matches that
are equally good, and six pairs lose too little for anything else."""


@dataclass(frozen=True, slots=True, eq=False)
class Eigen:
    """The solutions for `tensors` (k by 3 by 3): `moments` (k by 3, ascending), `axes` (rows, right-handed).

    `allowed` (k by 3) is how far each moment may be missed. `same` (k by 3 by 3) tells which moments cannot
    be told apart; an axis may be `angles` (k by 3, rad) from the space that the axes to these span.
    """

    tensors: Floats
    moments: Floats
    axes: Floats
    allowed: Floats
    same: Mask
    angles: Floats

    @property
    def distinct(self) -> bool:
        """Whether each moment has an axis of its own at every point."""
        return bool((self.same == np.eye(3, dtype=bool)).all())

    @property
    def solution(self) -> Array:
        """The moments and axes at the first point, in rows (3 by 4)."""
        return np.column_stack([self.moments[0], self.axes[0]]).astype(object)

    @property
    def isotropic(self) -> Mask:
        """At which points (k) every direction is an axis."""
        return np.asarray(self.same.all(axis=(1, 2)))


@dataclass(frozen=True, eq=False)
class Answer:
    """Moments (k by n, kg m^2) and axes (k by n by 3) as typed; of axes alone there are no moments.

    `bare` are the places of moments that lack a unit which they need, and `entries` (n by 4, or 3) what was
    typed.
    """

    moments: Floats | None
    axes: Floats
    bare: tuple[int, ...] = ()
    entries: Array | None = None

    def __len__(self) -> int:
        return int(self.axes.shape[1])

    @cached_property
    def units(self) -> Floats:
        """Unit vectors along the axes (k by n by 3); zero where there is no direction or no value."""
        known = np.where(np.isfinite(self.axes).all(axis=2, keepdims=True), self.axes, 0.0)
        # First by the largest component, so that squares stay within floats.
        largest = np.abs(known).max(axis=2, keepdims=True, initial=0.0)
        shorter = known / np.where(largest > 0, largest, 1.0)
        norms = np.linalg.norm(shorter, axis=2, keepdims=True)
        units: Floats = shorter / np.where(norms > 0, norms, 1.0)
        return units


def default_angle(tolerance: Tolerance) -> float:
    """The angle (rad) that is left open by components as precise as the moments are to be.

    Components rounded to n decimal places turn an axis by at most sqrt(3)/2 10^-n.
    """
    figures, relative = tolerance.significant_figures, tolerance.relative
    if figures is None and relative is None:
        return RELATIVE
    rounded = 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures)
    return min(max(relative or 0.0, rounded, ROUNDING), WIDEST)


def solve(tensors: Floats, tolerance: Tolerance, angle: float) -> Eigen:
    """The solutions for symmetric tensors (k by 3 by 3, none zero); no body need have them.

    Rounding turns a space by about its own size over the gap to the next moment (J. Demmel, Applied Numerical
    Linear Algebra, section 5.2).
    """
    scales = np.abs(tensors).max(axis=(1, 2))[:, None]
    values, vectors = np.linalg.eigh(tensors / scales[..., None])
    largest = np.abs(values).max(axis=1, keepdims=True)
    values[np.abs(values) < ZERO_MOMENT * largest] = 0.0
    moments, largest = values * scales, largest * scales
    sizes = np.where(np.abs(moments) > NOISE * largest, moments, largest)
    allowed = np.array([[margin(size, tolerance) for size in row] for row in sizes.tolist()])
    near = np.clip(allowed, EQUAL_MOMENTS * largest, NEARLY_EQUAL * largest)
    gaps = np.abs(moments[:, :, None] - moments[:, None])
    same = gaps <= np.minimum(near[:, :, None], near[:, None])
    angles = np.maximum(angle, UNCERTAIN * largest / np.where(same, np.inf, gaps).min(axis=2))
    axes = vectors.swapaxes(1, 2) * np.sign(np.linalg.det(vectors))[:, None, None]
    return Eigen(tensors, moments, axes, allowed, same, angles)


# --- an answer beside the solutions


@dataclass(frozen=True, eq=False)
class Match:
    """Which `moments` and `axes` of an answer are right for which solution (k by n by 3).

    `places` (k by n) is the solution that each pair stands for, -1 for one that is too much.
    """

    moments: Mask
    axes: Mask
    places: np.ndarray

    @cached_property
    def right(self) -> Mask:
        """Which moments, and which axes, are right in their places at every point (2 by n)."""
        both, slots = np.array([self.moments, self.axes]), self.places[None, ..., None]
        found = np.take_along_axis(both, slots, axis=3) & (slots >= 0)
        return np.asarray(np.all(found, axis=(1, 3)))

    @cached_property
    def known(self) -> Mask:
        """Which moments, and which axes, are those of some solution at every point (2 by n)."""
        both = np.array([self.moments, self.axes])
        known: Mask = np.logical_and.reduce(np.logical_or.reduce(both, axis=3), axis=1)
        return known

    @property
    def complete(self) -> bool:
        """Whether there are three pairs, which are the three solutions."""
        return self.places.shape[1] == 3 and bool(self.right.all())

    @property
    def crossed(self) -> bool:
        """Whether the moments are right, and the axes are right, but not together."""
        return _one_to_one(self.moments) and _one_to_one(self.axes) and not self.right.all()

    @property
    def miscounted(self) -> bool:
        """Whether each moment is told, and nothing but them, yet not as often as it should be."""
        told = bool(self.known[0].all() and np.logical_or.reduce(self.moments, axis=1).all())
        return told and not (len(self.places[0]) == 3 and _one_to_one(self.moments))

    def is_misplaced(self, index: int) -> bool:
        """Whether the axis of a pair belongs to another moment, which no other pair has the axis of."""
        moment, axis = self.right[:, index]
        taken = self.places[0][self.right[1]]
        return bool(moment and not axis and self.known[1, index] and not self.axes[0, index, taken].any())


def are_moments(eigen: Eigen, moments: Floats) -> Mask:
    """Which moments (k by n) are right for which solution (k by n by 3)."""
    return np.asarray(np.abs(moments[..., None] - eigen.moments[:, None]) <= eigen.allowed[:, None])


def match(eigen: Eigen, answer: Answer) -> Match:
    """Pair an answer with the solutions at each point, so that as much as can be is right, and in order.

    Axes without moments stand for moments, too.
    """
    squares = (answer.units @ eigen.axes.swapaxes(1, 2)) ** 2
    inside, outside = np.sqrt(squares @ eigen.same), np.sqrt(squares @ ~eigen.same)
    off = np.where(inside > 0, np.arctan2(outside, inside), np.inf)
    axes = off <= eigen.angles[:, None] * (1 + ROUNDING)
    moments = axes if answer.moments is None else are_moments(eigen, answer.moments)
    worth = 1.0 * moments + axes + (moments & axes) / 8
    if answer.moments is not None:
        # Where every direction is an axis, one is worth nothing without its moment.
        worth[~moments & eigen.isotropic[:, None, None]] = 0
    worth -= TIE * np.subtract.outer(np.arange(len(answer)), np.arange(3)) ** 2
    return Match(moments, axes, np.array(list(map(assigned, worth))))


def _one_to_one(right: Mask) -> bool:
    """Whether each row of `right` (k by n by 3) has a column of its own at every point."""
    count = right.shape[1]
    return count <= 3 and all(each[range(count), assigned(each)].all() for each in right)
