"""The eigen-problem I e = lambda e of an inertia tensor, and which answers solve it within a tolerance.

Moments that the tolerance cannot tell apart share their axes: every direction in the space that they span
is then as good as another, because |I e - lambda e| stays below the tolerance there. With symbols there is a
problem for each point at which they are given values, and what is right is so at every point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations, permutations
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.principal import EQUAL_MOMENTS, ZERO_MOMENT
from rigidcli.grading.numbers import NOISE, ROUNDING, margin
from rigidcli.grading.principal.pairs import Pairs
from rigidcli.grading.question import RELATIVE, Tolerance

NEARLY_EQUAL = 1e-2
"""Moments further apart, in units of the largest, have axes of their own, however wide the tolerance is."""

UNCERTAIN = 64 * float(np.finfo(np.float64).eps)
"""How far off (rad) rounding may put an axis, in units of the largest moment over the gap to the next."""

WIDEST = 0.05
"""The largest angle (rad) that is allowed to an axis where the question does not say so itself."""

Space: TypeAlias = tuple[int, ...]
"""Indices of moments that cannot be told apart; their axes span a line, a plane or everything."""

Places: TypeAlias = tuple[tuple[int, int], ...]
"""Which pair of an answer stands for which of the three solutions."""

ORDERS = tuple(permutations(range(3)))
"""All orders of three, the first of which leaves them as they are."""


@dataclass(frozen=True, slots=True, eq=False)
class Eigen:
    """The solutions for a `tensor` (3 by 3): `moments` (3, ascending), `axes` (rows, right-handed, unit).

    `allowed` (3) is how far each moment may be missed. `spaces` are the largest sets of moments that cannot
    be told apart; they may overlap. `members` (their number by 3) tells by 1 and 0 what is in them, and
    `angles` how far (rad) an axis may be from each.
    """

    tensor: Floats
    moments: Floats
    axes: Floats
    allowed: Floats
    spaces: tuple[Space, ...]
    members: Floats
    angles: Floats

    @property
    def isotropic(self) -> bool:
        """Whether every direction is an axis."""
        return len(self.spaces[0]) == 3


def default_angle(tolerance: Tolerance) -> float:
    """The angle (rad) that is left open by components as precise as the moments are to be.

    Components rounded to n decimal places turn an axis by at most sqrt(3)/2 10^-n.
    """
    figures, relative = tolerance.significant_figures, tolerance.relative
    if figures is None and relative is None:
        return RELATIVE
    rounded = 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures)
    return min(max(relative or 0.0, rounded, ROUNDING), WIDEST)


def solve(tensor: Floats, tolerance: Tolerance, angle: float) -> Eigen:
    """The solutions for a symmetric tensor (3 by 3, not zero); no body need have it."""
    scale = float(np.abs(tensor).max())
    values, vectors = np.linalg.eigh(tensor / scale)
    largest = float(np.abs(values).max())
    values[np.abs(values) < ZERO_MOMENT * largest] = 0.0
    moments, largest = values * scale, largest * scale
    sizes = [float(moment) if abs(moment) > NOISE * largest else largest for moment in moments]
    allowed = np.array([margin(size, tolerance) for size in sizes])
    spaces = _spaces(moments, allowed, largest)
    members = np.array([[float(k in space) for k in range(3)] for space in spaces])
    angles = np.array([max(angle, _uncertainty(moments, space, largest)) for space in spaces])
    axes = vectors.T * np.sign(np.linalg.det(vectors))
    return Eigen(tensor, moments, axes, allowed, spaces, members, angles)


def _spaces(moments: Floats, allowed: Floats, largest: float) -> tuple[Space, ...]:
    """The largest runs of moments of which each would be accepted for each other."""
    spaces: list[Space] = []
    for first, last in ((0, 2), (0, 1), (1, 2), (0, 0), (1, 1), (2, 2)):
        run = tuple(range(first, last + 1))
        near = min(float(allowed[first : last + 1].min()), NEARLY_EQUAL * largest)
        equal = moments[last] - moments[first] <= max(near, EQUAL_MOMENTS * largest)
        if equal and not any(set(run) <= set(space) for space in spaces):
            spaces.append(run)
    return tuple(spaces)


def _uncertainty(moments: Floats, space: Space, largest: float) -> float:
    """How far (rad) rounding may turn a space (J. Demmel, Applied Numerical Linear Algebra, section 5.2)."""
    gaps = [abs(float(moments[k] - moments[j])) for k in range(3) if k not in space for j in space]
    return UNCERTAIN * largest / min(gaps) if gaps else 0.0


def angles_off(eigen: Eigen, units: Floats) -> Floats:
    """The angle (rad) of unit vectors (rows) to each space (columns); pi/2 for one that is zero."""
    squares = (units @ eigen.axes.T) ** 2
    inside, outside = np.sqrt(squares @ eigen.members.T), np.sqrt(squares @ (1 - eigen.members.T))
    angles: Floats = np.where(inside > 0, np.arctan2(outside, inside), np.pi / 2)
    return angles


# --- an answer beside the solutions


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Which `moments` and `axes` of an answer are right for which solution (n by 3), and which is which.

    Solutions have the order that they have at the first point.
    """

    moments: Mask
    axes: Mask
    places: Places

    @property
    def complete(self) -> bool:
        """Whether there are three pairs, which are the three solutions."""
        return len(self.moments) == 3 and self._whole

    @property
    def crossed(self) -> bool:
        """Whether the moments are right, and the axes are right, but not together."""
        return not self._whole and _one_to_one(self.moments) and _one_to_one(self.axes)

    @property
    def miscounted(self) -> bool:
        """Whether each moment is told, and nothing but them, yet not as often as it should be."""
        told = bool(self.moments.any(axis=0).all() and self.moments.any(axis=1).all())
        return told and (len(self.moments) != 3 or not _one_to_one(self.moments))

    def is_misplaced(self, index: int) -> bool:
        """Whether the axis of a pair belongs to another moment, which no other pair has the axis of."""
        slot = dict(self.places).get(index)
        if slot is None or self.axes[index, slot] or not self.moments[index, slot]:
            return False
        others = [place for place in self.places if self.axes[place] and self.axes[index, place[1]]]
        return bool(self.axes[index].any()) and not others

    @property
    def _whole(self) -> bool:
        return all(self.moments[place] and self.axes[place] for place in self.places)


def _one_to_one(right: Mask) -> bool:
    """Whether each row of `right` (n by 3) has a column of its own."""
    table = right.tolist()
    return any(all(map(list.__getitem__, table, slots)) for slots in permutations(range(3), len(table)))


def match(eigens: Sequence[Eigen], answers: Sequence[Pairs], *, ordered: bool = False) -> Match:
    """Pair an answer with the solutions, both at each point: as much as can be is right, at every point.

    An answer that is `ordered` keeps its order. Axes without moments stand for moments, too.
    """
    isotropic = all(eigen.isotropic for eigen in eigens)

    def joined(found: Mask, more: Mask) -> Mask:
        # What is right at both points; solutions may change their places from one to the other.
        if ordered or bool((found <= more).all()):
            return found & more
        options = [found & more[:, :, order] for order in ORDERS]
        return max(options, key=lambda option: (_best(_worth(option, isotropic), ordered)[1], option.sum()))

    found = reduce(joined, (_right(eigen, told) for eigen, told in zip(eigens, answers, strict=True)))
    return Match(found[0], found[1], _best(_worth(found, isotropic), ordered)[0])


def is_solved(eigens: Sequence[Eigen], answers: Sequence[Pairs]) -> bool:
    """Whether an answer is complete at every point; told soon where its moments alone are wrong."""
    return all(_is_solved(eigen, told) for eigen, told in zip(eigens, answers, strict=True))


def _is_solved(eigen: Eigen, told: Pairs) -> bool:
    if told.moments is None:
        # Where directions are free, axes by themselves tell little.
        return len(eigen.spaces) == 3 and match((eigen,), (told,)).complete
    return _one_to_one(_are_moments(eigen, told.moments)) and match((eigen,), (told,)).complete


def varying(eigens: Sequence[Eigen]) -> Mask:
    """Which moments of the first point are none at another, and which of its axes (2 by 3)."""
    first = eigens[0]
    moments = [_are_moments(eigen, first.moments).any(axis=1) for eigen in eigens]
    axes = [_are_axes(eigen, first.axes).any(axis=1) for eigen in eigens]
    varies: Mask = ~np.all([moments, axes], axis=1)
    return varies


def _right(eigen: Eigen, told: Pairs) -> Mask:
    """Which moments, and which axes, are right for which solution (2 by n by 3)."""
    axes = _are_axes(eigen, told.units)
    return np.array([axes if told.moments is None else _are_moments(eigen, told.moments), axes])


def _are_moments(eigen: Eigen, moments: Floats) -> Mask:
    right: Mask = np.abs(moments[:, None] - eigen.moments) <= eigen.allowed
    return right


def _are_axes(eigen: Eigen, units: Floats) -> Mask:
    near = angles_off(eigen, units) <= eigen.angles * (1 + ROUNDING)
    right: Mask = near @ eigen.members > 0
    return right


def _worth(right: Mask, isotropic: bool) -> np.ndarray:
    """How much of a pair (n by 3) is right, of moment and axis (2 by n by 3)."""
    worth: np.ndarray = right.sum(axis=0)
    if isotropic:
        # Where every direction is an axis, one is worth nothing without its moment.
        worth[~right[0]] = 0
    return worth


def _best(worth: np.ndarray, ordered: bool) -> tuple[Places, float]:
    """The places with the largest sum of `worth` (n by 3), in which a 2 counts a little more, and the sum."""
    count = len(worth)
    choose = combinations if ordered else permutations
    if count <= 3:
        every = [tuple(enumerate(slots)) for slots in choose(range(3), count)]
    else:
        every = [tuple(zip(chosen, range(3), strict=True)) for chosen in choose(range(count), 3)]
    table = worth.tolist()
    sums = [sum(table[i][k] + (table[i][k] == 2) / 8 for i, k in places) for places in every]
    best = max(range(len(every)), key=sums.__getitem__)
    return every[best], sums[best]
