"""What answers of many numbers are compared with: values at points, and the symmetry that is left open."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit
from rigidcli.grading.arrays.entries import (
    Layout,
    Point,
    as_typed,
    filled,
    opened,
    read_entries,
    times,
    worked,
)
from rigidcli.grading.asked import Tree
from rigidcli.grading.factors import factors
from rigidcli.grading.matching import assigned
from rigidcli.grading.numbers import NOISE, ROUNDING, margin, margins, narrowed
from rigidcli.grading.question import Question, Tolerance
from rigidcli.language.expression import Expression
from rigidcli.language.tree import Node

SURELY = 10
"""A factor is one if it differs from 1 by more than so many tolerances."""

MOST_PLACES = 6
"""Wrong entries that are listed."""

Symmetry: TypeAlias = frozenset[Literal["order", "sign", "length"]]
"""What may be different in a right answer."""


def told(key: Reference) -> str:
    """The right answer, for those who may see it; symbols bring units of their own."""
    unit, scale = ("", 1.0) if key.unit is None or key.names else (key.unit.text, key.unit.scale)
    return f"expected {as_typed(times(key.entries, 1 / scale), '.6g')} {unit}".replace("'", "").rstrip()


def listed(mask: Mask, labels: Array) -> str:
    """Places of a mask in a message: the first few, and how many more."""
    names = list(dict.fromkeys(labels[mask].tolist()))
    more = len(names) - MOST_PLACES
    text = ("; " if any("," in name for name in names) else ", ").join(names[:MOST_PLACES])
    return text + (f" and {more} more" if more > 0 else "")


@dataclass(frozen=True, slots=True, eq=False)
class Typed:
    """The entries of an answer at the points of its key: `values` (k, ...), and which `counts` (k, ...).

    `halves` (...) are half of one in the last digit that was typed, 0 for an expression. `bare` tells whether
    an entry that is not zero lacks a unit. `entries` (...) are as they were typed, where they were.
    """

    values: Floats
    counts: Mask
    halves: Floats
    bare: bool = False
    entries: Array | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the entries."""
        return self.values.shape[1:]

    @property
    def rows(self) -> list[int]:
        """The points at which the answer counts as a whole."""
        return [k for k in range(len(self.values)) if k == 0 or self.counts[k].any()]


def exactly(values: Floats) -> Typed:
    """An answer that has these values (k, ...) at the points."""
    return Typed(values, np.ones(values.shape, dtype=bool), np.zeros(values.shape[1:]))


@dataclass(frozen=True, eq=False)
class Reference:
    """What answers are compared with.

    `entries` (...) are as they were made, each to be multiplied by its `number` (...), and `values` (k, ...)
    what they are at the `points`, in SI units of `unit`. The names in `given` have values that the document
    gives them. They have these at the first `known` points, and others at the rest, where only entries of an
    answer count that hold such a name. `labels` (...) name the entries. What is below rounding noise
    `beside` a number (SI) is zero. `mistaken` has codes with the values that come out under mistakes. Those
    names that are `derived` follow from others.
    """

    question: Question
    path: tuple[str, ...]
    entries: Array
    values: Floats
    points: tuple[Point, ...]
    given: frozenset[str]
    known: int
    unit: Unit | None
    tolerance: Tolerance
    labels: Array
    beside: float = 0.0
    symmetry: Symmetry = frozenset()
    numbers: Floats | float = 1.0
    mistaken: tuple[tuple[str, Floats], ...] = ()
    derived: Mapping[str, Node] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """The symbols that an answer may have."""
        return frozenset(self.points[0])

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the entries."""
        return self.values.shape[1:]

    @cached_property
    def allowed(self) -> Floats:
        """How far each value (k, ...) may be missed."""
        return margins(self.values, self.tolerance, self.beside)

    @cached_property
    def nonzero(self) -> Mask:
        """Which entries (...) are not zero, but for rounding."""
        size = np.abs(self.values)
        largest = size.max(axis=tuple(range(1, size.ndim)), keepdims=True, initial=self.beside)
        return np.asarray((size > NOISE * largest).any(axis=0))

    @property
    def varies(self) -> Mask:
        """Which entries (...) depend on symbols that have no value."""
        values = self.values[: self.known]
        return np.asarray(~(np.abs(values - values[0]) <= self.allowed[: self.known]).all(axis=0))

    @cached_property
    def slack(self) -> float:
        """The tolerance in units of the largest entry."""
        largest = float(np.abs(self.values[0]).max(initial=0.0))
        return margin(largest, self.tolerance) / largest if largest else 0.0

    @property
    def needs_unit(self) -> bool:
        """Whether numbers must have a unit: angles are pure numbers, and symbols bring units of their own."""
        pure = self.unit is None or self.unit.dimension in (DIMENSIONLESS, ANGLE)
        return self.question.unit == "required" and not pure and not self.names

    @property
    def factors(self) -> Iterator[tuple[str, float]]:
        """Codes, and the factors by which they make such entries wrong."""
        dimension = DIMENSIONLESS if self.unit is None else self.unit.dimension
        return factors(dimension, self.path, unknown=not self.path and self.unit is None)

    @property
    def least_change(self) -> float:
        """The relative change below which a factor is not told from any wrong numbers."""
        return SURELY * self.slack

    def read(self, answer: Tree, layout: Layout) -> Typed:
        """An answer, worked out. Raises Unreadable."""
        opened_answer = opened(answer)
        if self.shape == (1,) and not isinstance(opened_answer, list | dict):
            opened_answer = [opened_answer]  # one frequency, say, needs no brackets
        cells = layout(opened_answer)
        read = read_entries(cells, self.unit, self.names)
        entries = filled([each.entry for each in read], cells.shape)
        halves = np.array([each.half for each in read], dtype=np.float64).reshape(cells.shape)
        counts = np.ones((len(self.points), *cells.shape), dtype=bool)
        holds = [isinstance(e, Expression) and not e.names.isdisjoint(self.given) for e in entries.flat]
        counts[self.known :] = np.reshape(holds, cells.shape)
        return Typed(worked(entries, self.points), counts, halves, any(each.bare for each in read), entries)

    def agree(self, answer: Typed) -> Mask:
        """Which entries (...) of an answer are those in the same places here, within the tolerance."""
        with np.errstate(all="ignore"):
            near = np.abs(answer.values - self.values) <= self.allowed
        return np.asarray((near | ~answer.counts).all(axis=0))

    def holds(self, answer: Typed) -> bool:
        """Whether an answer is right, as far as the symmetry asks."""
        if answer.shape != self.shape:
            return False
        if "length" in self.symmetry:
            return all(self._is_along(answer.values[k], self.values[k]) for k in answer.rows)
        # Many keys are tried, and the first entry tells of most that they are not the one.
        first = abs(float(answer.values.flat[0]))
        if not any(abs(first - size) <= allowed for size, allowed in self._firsts):
            return False
        return bool(self.facing(answer).agree(answer).all())

    @cached_property
    def _firsts(self) -> list[tuple[float, float]]:
        """The sizes that the first entry may have, and how far each may be missed."""
        count = self.values[0].size if "order" in self.symmetry else 1
        sizes, allowed = (array[0].ravel()[:count].tolist() for array in (np.abs(self.values), self.allowed))
        return list(zip(sizes, allowed, strict=True))

    def _is_along(self, one: Floats, other: Floats) -> bool:
        angle = angle_between(one, other)
        return min(angle, math.pi - angle if "sign" in self.symmetry else angle) <= self.angle

    @cached_property
    def angle(self) -> float:
        """The angle (rad) by which a vector may be off: by which it turns if it changes by the tolerance."""
        shortest = min(length(row) for row in self.values)
        return self.tolerance.angle or (margin(shortest, self.tolerance) / shortest if shortest else 0.0)

    # --- changed keys

    def facing(self, answer: Typed, *, by_size: bool = False) -> Reference:
        """The same by its symmetry, as near to an answer of its shape as it can be.

        Entries of free order face those that are right, or those of the same rank `by_size`.
        """
        key = self
        if "length" in self.symmetry:
            with np.errstate(all="ignore"):
                ratios = [length(a) / length(b) for a, b in zip(answer.values, self.values, strict=True)]
            key = replace(key, values=self.values * np.reshape(ratios, (-1, *[1] * len(self.shape))))
        if "sign" in self.symmetry:
            opposite = key.times(-1)
            with np.errstate(all="ignore"):
                across = float((answer.values[0] * key.values[0]).sum()) < 0
            more = int(opposite.agree(answer).sum()) - int(key.agree(answer).sum())
            key = opposite if (more, across) > (0, False) else key
        if "order" in self.symmetry:
            order = key._ranked(answer) if by_size else key._matched(answer)
            key = key.arranged(lambda array: array[:, order])
        return key

    def _ranked(self, answer: Typed) -> Array:
        """The entries (n) that have the ranks of those of an answer, by their sizes."""
        ranks = np.abs(answer.values[0]).argsort(kind="stable").argsort()
        return np.asarray(np.abs(self.values[0]).argsort(kind="stable")[ranks])

    def _matched(self, answer: Typed) -> Array:
        """The entries (n) that belong to those of an answer: as many as can be are right, others by rank."""
        ranks = self._ranked(answer).argsort()
        far = np.abs(np.subtract.outer(np.arange(len(ranks)), ranks)) / (1 + len(ranks) ** 2)
        return assigned(self.fits(answer) - far.T)

    def fits(self, answer: Typed) -> Mask:
        """Which entries (m) of an answer are which here (n): m by n."""
        with np.errstate(all="ignore"):
            gaps = np.abs(answer.values[:, :, np.newaxis] - self.values[:, np.newaxis])
        near = (gaps <= self.allowed[:, np.newaxis]) | ~answer.counts[:, :, np.newaxis]
        return np.asarray(near.all(axis=0))

    def times(self, numbers: Any) -> Reference:
        """The same with entries so many times as large."""
        most = float(np.abs(numbers).max())
        with np.errstate(over="ignore"):
            return replace(
                self,
                values=self.values * numbers,
                numbers=self.numbers * np.asarray(numbers),
                tolerance=narrowed(self.tolerance, most),
                beside=self.beside * most,
            )

    def arranged(self, change: Callable[[Any], Any]) -> Reference:
        """The same with entries in other places: a change of arrays (k, ...)."""
        entries, numbers = self.entries, np.broadcast_to(self.numbers, self.entries.shape)
        places = change(np.arange(entries.size).reshape(1, *entries.shape))[0]
        return replace(
            self,
            entries=entries.ravel()[places],
            numbers=numbers.ravel()[places],
            values=change(self.values),
            labels=self.labels if places.shape == self.shape else places,
        )

    def valued(self, values: Floats) -> Reference:
        """The same with other values (k, ...), which are told as multiples of the entries where they are."""
        with np.errstate(all="ignore"):
            ratios = np.where(self.values == values, 1.0, values / self.values)
        if np.isfinite(ratios).all() and (np.abs(ratios - ratios[0]) <= ROUNDING).all():
            return replace(self, values=values, numbers=self.numbers * ratios[0])
        return replace(self, values=values, entries=values[0].astype(object), numbers=1.0)

    @property
    def written(self) -> Array | None:
        """The entries as they are to be typed; None where they are known at points only, or are infinite."""
        if not np.isfinite(self.values).all():
            return None
        if self.names and not any(isinstance(entry, Expression) for entry in self.entries.flat):
            return None
        return times(self.entries, self.numbers)


def length(vector: Floats) -> float:
    """The length of a vector of any size."""
    return math.hypot(*vector.tolist())


def angle_between(one: Floats, other: Floats) -> float:
    """The angle (0 to pi, rad) between two vectors of any size and dimension; NaN where one is zero.

    2 atan2(|u - v|, |u + v|) of the unit vectors is accurate at all angles (W. Kahan, How Futile are Mindless
    Assessments of Roundoff, section 12).
    """
    with np.errstate(all="ignore"):
        u, v = one / np.abs(one).max(), other / np.abs(other).max()
        u, v = u / length(u), v / length(v)
    return 2 * math.atan2(length(u - v), length(u + v))
