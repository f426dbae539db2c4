"""Answers of many numbers: what vectors, moments, matrices and tensors have in common.

An entry is a number, or an expression in symbols where the question has any. Entries of the key and of an
answer are worked out at the same points, one row of values for each: of a key without symbols there is one.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, get_args

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ExpressionError, ValueProblem, nearest, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.numbers import LONGEST, NOISE, are_near, margin, read_number, read_unit, unit_of
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question, Tolerance
from rigidcli.model.units import Unit, split_quantity
from rigidcli.symbolic.expression import Expression, parse
from rigidcli.symbolic.tree import Node
from rigidcli.symbolic.writing import text

Entry: TypeAlias = float | Expression
"""A number in SI units, or an expression in symbols."""

Point: TypeAlias = Mapping[str, float]
"""Values of symbols."""

Read: TypeAlias = Callable[[Tree, Unit | None, frozenset[str]], Array]
"""A reader of answers: the array of entries, in that unit and with these symbols. Raises Unreadable."""

POINTS = 5
"""Points at which entries with symbols are compared."""

TRIES = 50
"""Random points among which those are looked for where the key has values."""

LOW, HIGH = 0.3, 1.7
"""Between what sizes random values lie."""

_TREES = get_args(Node)


@dataclass(frozen=True, slots=True, eq=False)
class Typed:
    """The entries of an answer at the points of its key: `values` (k, ...), and which `counts` (k, ...)."""

    values: Floats
    counts: Mask

    @property
    def rows(self) -> list[int]:
        """The points at which the answer counts as a whole."""
        return [k for k in range(len(self.values)) if k == 0 or self.counts[k].any()]

    def transposed(self) -> Typed:
        """The answer with rows and columns exchanged."""
        return Typed(self.values.swapaxes(1, 2), self.counts.swapaxes(1, 2))

    def times(self, factor: float) -> Typed:
        """The answer multiplied by a number."""
        with np.errstate(over="ignore"):
            return Typed(self.values * factor, self.counts)


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

    def typed(self, entries: Array) -> Typed:
        """The entries of an answer, worked out."""
        counts = np.ones((len(self.points), *np.shape(entries)), dtype=bool)
        holds = [isinstance(e, Expression) and not e.names.isdisjoint(self.given) for e in entries.flat]
        counts[self.known :] = np.reshape(holds, np.shape(entries))
        return Typed(worked(entries, self.points), counts)

    def read(self, answer: Tree, read: Read) -> Typed:
        """An answer, worked out. Raises Unreadable."""
        return self.typed(read(answer, self.unit, self.names))

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

    def differs(self, values: Floats) -> bool:
        """Whether these values (k, ...) can be told from the right ones."""
        return not self.same(exactly(values), self.values)


def exactly(values: Floats) -> Typed:
    """An answer that has these values (k, ...) at the points."""
    return Typed(values, np.ones(values.shape, dtype=bool))


# --- reading


def read_entry(answer: Tree, unit: Unit | None, names: frozenset[str], place: str) -> Entry:
    """A number or, where there are symbols, an expression in them. Raises Unreadable."""
    if not names or not isinstance(answer, str):
        return read_number(answer, unit, place)
    try:
        expression = parse(answer)
    except ExpressionError as error:
        if split_quantity(answer) is not None:
            return read_number(answer, unit, place)
        raise Unreadable("parse_error", f"read {shown(answer)}: {error.message}", place=place) from None
    unknown = sorted(expression.names - names)
    if unknown:
        near = nearest(unknown[0], sorted(names))
        hint = f", did you mean {shown(near)}?" if near else ""
        raise Unreadable("unknown_symbol", f"read {shown(unknown[0])}{hint}", place=place)
    return expression if expression.names else read_number(answer, unit, place)


def filled(entries: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Entries as an array of objects: an expression is no sequence."""
    array = np.empty(len(entries), dtype=object)
    array[:] = entries
    return array.reshape(shape)


def worked(entries: Array, points: Sequence[Point]) -> Floats:
    """The values of entries (...) at points (k): k by ...; NaN where there is none."""
    flat = list(np.asarray(entries, dtype=object).flat)
    rows = [[_value(entry, point) for entry in flat] for point in points]
    return np.array(rows, dtype=np.float64).reshape(len(points), *np.shape(entries))


def _value(entry: Entry, point: Point) -> float:
    if not isinstance(entry, Expression):
        return entry
    try:
        return entry.evaluate(point)
    except ExpressionError:
        return math.nan


# --- keys


def reference(asked: Asked, read: Read) -> Reference:
    """The key of a question, literal (by the reader of answers) or computed. Raises ValueProblem."""
    question = asked.question
    _require_fit(question)
    if asked.report is None:
        try:
            unit = _unit_in(asked.value)
            entries = read(asked.value, unit, frozenset(question.symbols or ()))
        except Unreadable as unreadable:
            place, code = unreadable.finding.place, unreadable.finding.code
            raise ValueProblem(f"{place}: {CODES[code]}" if place else CODES[code]) from None
    else:
        unit, entries = unit_of(asked.unit), computed(asked.value)
    points, given, known = _points(asked, entries)
    values = worked(entries, points)
    return Reference(entries, values, points, given, known, unit, question.tolerance)


def _require_fit(question: Question) -> None:
    if question.tolerance.figures != "value":
        raise ValueProblem("written figures are judged of a number or a quantity", path=("tolerance",))
    if question.modulo is not None:
        raise ValueProblem("a period is for a number or a quantity", path=("modulo",))


def computed(value: Any) -> Array:
    """The entries of a result: an array of floats, exact numbers or trees. Raises ValueProblem."""
    array = np.asarray(value, dtype=object)
    return filled([_entry(entry) for entry in array.flat], array.shape)


def _entry(value: Any) -> Entry:
    if isinstance(value, float | int | np.number) and not isinstance(value, bool):
        number = float(value)
        if not math.isfinite(number):
            raise ValueProblem("this result is not finite")
        return number
    if isinstance(value, _TREES):
        written = text(value)
    elif hasattr(type(value), "free_symbols"):
        from rigidcli.symbolic.exact import text as exact_text

        written = exact_text(value)
    else:
        raise ValueProblem("this result is not made of numbers")
    try:
        expression = parse(written)
        return expression if expression.names else expression.evaluate({})
    except ExpressionError:
        raise ValueProblem("this result is too long, or has no value, and cannot be compared") from None


def _is_exact(value: Any) -> bool:
    """Whether results are exact numbers, in which parameters with a value do not appear."""
    return any(hasattr(type(entry), "free_symbols") for entry in np.asarray(value, dtype=object).flat)


def _unit_in(tree: Tree) -> Unit | None:
    """The unit of a literal key: that of its first entry which has one. Raises Unreadable."""
    if isinstance(tree, dict | list):
        units = map(_unit_in, tree.values() if isinstance(tree, dict) else tree)
        return next((unit for unit in units if unit is not None), None)
    if not isinstance(tree, str) or len(tree) > LONGEST or (quantity := split_quantity(tree)) is None:
        return None
    return read_unit(quantity[1])


# --- symbols


def _points(asked: Asked, entries: Array) -> tuple[tuple[Point, ...], frozenset[str], int]:
    """Where a key is worked out, the names with values from the document, and at how many points they are so.

    Other values are random, and always the same. Raises ValueProblem where the key has hardly any values.
    """
    names = frozenset[str]().union(*(e.names for e in entries.flat if isinstance(e, Expression)))
    if not names:
        return ({},), frozenset(), 1
    chance = random.Random(1)  # noqa: S311 - a probe needs no secrecy
    if asked.document is None:
        points = _with_values(entries, lambda: _in_question(asked, chance))
        return points, frozenset(), len(points)
    values = {} if _is_exact(asked.value) else asked.document.values
    given = {name: float(value) for name, value in values.items()}
    free = _with_values(entries, lambda: _in_document(asked, names, {}, chance))
    if names.isdisjoint(given):
        return free, frozenset(), len(free)
    known = _with_values(entries, lambda: _in_document(asked, names, given, chance))
    if names <= given.keys():
        known = known[:1]
    return (*known, *free), frozenset(given), len(known)


def _with_values(entries: Array, draw: Callable[[], Point]) -> tuple[Point, ...]:
    """Points at which all entries have values."""
    found: list[Point] = []
    for _ in range(TRIES):
        point = draw()
        if np.isfinite(worked(entries, [point])).all():
            found.append(point)
        if len(found) == POINTS:
            return tuple(found)
    raise ValueProblem("this has no value for most values of its symbols")


def _in_question(asked: Asked, chance: random.Random) -> Point:
    """Random values for the symbols of a question."""
    return {
        name: chance.uniform(LOW, HIGH) * (1 if sign == "positive" else chance.choice((-1, 1)))
        for name, sign in (asked.question.symbols or {}).items()
    }


def _in_document(
    asked: Asked, names: frozenset[str], given: Mapping[str, float], chance: random.Random
) -> Point:
    """Random values for the parameters of a document, and for what else a key has, but for those `given`.

    Parameters that hang on others follow them. In exact results those that have a value appear with it.
    """
    assert asked.document is not None
    definitions, fixed = asked.document.definitions, _is_exact(asked.value)
    point = {name: chance.uniform(LOW, HIGH) for name in sorted(names | definitions.keys())} | dict(given)
    for name, definition in definitions.items():
        if definition is not None and name not in given and (definition.names or fixed):
            point[name] = _value(definition, point)
    return point
