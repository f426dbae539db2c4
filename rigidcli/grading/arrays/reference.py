"""What answers of many numbers are compared with, and how.

Entries of the key and of an answer are worked out at the same points, one row of values for each: of a key
without symbols there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.grading.arrays.entries import Layout, Point, read_entries, worked
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import NOISE, ROUNDING, are_near, margin
from rigidcli.grading.question import Tolerance
from rigidcli.model.units import Unit
from rigidcli.symbolic.language.expression import Expression


@dataclass(frozen=True, slots=True, eq=False)
class Typed:
    """The entries of an answer at the points of its key: `values` (k, ...), and which `counts` (k, ...).

    `halves` (k, ...) are half of one in the last digit that was typed, 0 for an expression.
    """

    values: Floats
    counts: Mask
    halves: Floats

    @property
    def rows(self) -> list[int]:
        """The points at which the answer counts as a whole."""
        return [k for k in range(len(self.values)) if k == 0 or self.counts[k].any()]

    def each(self, change: Callable[[Array], Array]) -> Typed:
        """The answer with its entries in other places."""
        return Typed(change(self.values), change(self.counts), change(self.halves))

    def transposed(self) -> Typed:
        """The answer with rows and columns exchanged."""
        return self.each(lambda array: array.swapaxes(1, 2))

    def times(self, factor: float) -> Typed:
        """The answer multiplied by a number."""
        with np.errstate(over="ignore"):
            return Typed(self.values * factor, self.counts, self.halves * abs(factor))


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """What answers are compared with.

    `entries` (...) are as they were made, and `values` (k, ...) what they are at the `points`, in SI units of
    `unit`. The names in `given` have values that the document gives them. They have these at the first
    `known` points, and others at the rest, where only entries of an answer count that hold such a name.
    """

    entries: Array
    values: Floats
    points: tuple[Point, ...]
    given: frozenset[str]
    known: int
    unit: Unit | None
    tolerance: Tolerance

    @property
    def names(self) -> frozenset[str]:
        """The symbols that an answer may have."""
        return frozenset(self.points[0])

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the entries."""
        return self.values.shape[1:]

    @property
    def nonzero(self) -> Mask:
        """Which entries (...) are not zero, but for rounding."""
        size = np.abs(self.values)
        largest = size.reshape(len(size), -1).max(axis=1, initial=0.0)
        mask: Mask = (size > NOISE * largest.reshape(-1, *[1] * len(self.shape))).any(axis=0)
        return mask

    @property
    def varies(self) -> Mask:
        """Which entries (...) depend on symbols that have no value."""
        values = self.values[: self.known]
        mask: Mask = ~self.agree(exactly(np.broadcast_to(values[0], values.shape)), values)
        return mask

    @property
    def slack(self) -> float:
        """The tolerance in units of the largest entry."""
        largest = float(np.abs(self.values[0]).max(initial=0.0))
        return margin(largest, self.tolerance) / largest if largest else 0.0

    def read(self, answer: Tree, layout: Layout) -> Typed:
        """An answer, worked out. Raises Unreadable."""
        entries, halves = read_entries(layout(answer), self.unit, self.names)
        counts = np.ones((len(self.points), *entries.shape), dtype=bool)
        holds = [isinstance(e, Expression) and not e.names.isdisjoint(self.given) for e in entries.flat]
        counts[self.known :] = np.reshape(holds, entries.shape)
        return Typed(worked(entries, self.points), counts, np.broadcast_to(halves, counts.shape))

    def agree(self, answer: Typed, values: Floats) -> Mask:
        """Which entries (...) of the answer are these values (k, ...), within the tolerance."""
        near: Mask = np.all(list(self._near(answer, values)), axis=0)
        return near

    def same(self, answer: Typed, values: Floats) -> bool:
        """Whether the whole answer is these values (k, ...)."""
        return all(near.all() for near in self._near(answer, values))

    def _near(self, answer: Typed, values: Floats) -> Iterator[Mask]:
        """Which entries (...) are right, or do not count, at one point after the other."""
        for mine, own, counts in zip(answer.values, values, answer.counts, strict=True):
            with np.errstate(all="ignore"):
                yield are_near(mine, own, self.tolerance) | ~counts

    def rounded(self, answer: Typed, values: Floats) -> Mask:
        """Which entries (...) are these values (k, ...) to the digits that were typed."""
        with np.errstate(all="ignore"):
            limits = answer.halves * (1 + ROUNDING) + NOISE * np.abs(values)
            gaps = np.abs(answer.values - values)
        short = (answer.halves > 0) & (gaps <= limits)
        mask: Mask = np.all(short | ~answer.counts, axis=0)
        return mask

    def differs(self, values: Floats) -> bool:
        """Whether these values (k, ...) can be told from the right ones."""
        return not self.same(exactly(values), self.values)


def exactly(values: Floats) -> Typed:
    """An answer that has these values (k, ...) at the points."""
    return Typed(values, np.ones(values.shape, dtype=bool), np.zeros(values.shape))
