"""Answers of many numbers: entries, and their values at points, held against those of the key.

An entry is a number, or an expression in symbols where the question has any. Entries of the key and of an
answer are worked out at the same points, one row of values for each: of a key without symbols there is one.
An answer is right if its values are those of the key within the tolerance, or become so by the symmetry of
what is asked: another order, sign or length.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import DocumentError, ExpressionError, ValueProblem, nearest, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.factors import factors
from rigidcli.grading.numbers import (
    NOISE,
    ROUNDING,
    margin,
    margins,
    narrowed,
    read_written,
    scale_of,
    unnamed,
)
from rigidcli.grading.outcome import Finding, Unreadable
from rigidcli.grading.question import Question, Tolerance
from rigidcli.grading.units import read_unit
from rigidcli.model.syntax import read_tree
from rigidcli.model.units import ANGLE, DIMENSIONLESS, Unit, parse_unit, split_quantity
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.language.expression import Expression, parse
from rigidcli.symbolic.language.tree import Node

POINTS = 5
"""Points at which entries with symbols are compared."""

TRIES = 50
"""Random points among which those are looked for where the key has values."""

LOW, HIGH = 0.3, 1.7
"""Between what sizes random values lie."""

SURELY = 10
"""A factor is one if it differs from 1 by more than so many tolerances."""

MOST_PLACES = 6
"""Wrong entries that are listed."""

Entry: TypeAlias = float | Expression
"""A number in SI units, or an expression in symbols."""

Point: TypeAlias = Mapping[str, float]
"""Values of symbols."""

Symmetry: TypeAlias = frozenset[Literal["order", "sign", "length"]]
"""What may be different in a right answer."""

TENSORS = (("tensor",), ("tensor_com",))
"""The last names of the paths of inertia tensors."""

CLOSING = {"[": "]", "{": "}", "(": ")"}


@dataclass(frozen=True, slots=True)
class Cell:
    """An entry as it was typed, and the name of its place."""

    answer: Tree
    place: str


Layout: TypeAlias = Callable[[Tree], Array]
"""What finds the cells in an answer: an array of them in the form that is asked. Raises Unreadable."""


class Reading(NamedTuple):
    """An entry, half of one in its last digit (0 of an expression), and whether it lacks a unit."""

    entry: Entry
    half: float
    bare: bool


# --- reading


def opened(answer: Tree) -> Tree:
    """The list or mapping in one text such as `[1, 2, 3] cm`; the unit behind it holds for all its entries.

    What is no such text stays as it is. Raises Unreadable.
    """
    text = unnamed(answer).strip() if isinstance(answer, str) else ""
    if text[:1] not in CLOSING or CLOSING[text[0]] not in text:
        return answer
    inside, _, unit = text.rpartition(CLOSING[text[0]])
    try:
        tree = read_tree(f"{{{inside[1:]}}}" if text[0] == "{" else f"[{inside[1:]}]", "", typed=True)
    except DocumentError as error:
        raise Unreadable("parse_error", f"read {shown(answer)}: {error.problems[0].message}") from None
    return _followed(tree, unit) if unit.strip() else tree


def _followed(tree: Tree, unit: str) -> Tree:
    """The same with a unit behind every entry."""
    if isinstance(tree, dict):
        return {name: _followed(entry, unit) for name, entry in tree.items()}
    if isinstance(tree, list):
        return [_followed(entry, unit) for entry in tree]
    return f"{tree} {unit}" if isinstance(tree, str) else tree


def read_entry(cell: Cell, unit: Unit | None, names: frozenset[str]) -> Reading:
    """A number, in this unit unless it has its own, or an expression. Raises Unreadable."""
    answer, place = cell.answer, cell.place
    if names and isinstance(answer, str) and not is_quantity(answer, names):
        try:
            expression = parse(answer)
        except ExpressionError as error:
            raise Unreadable("parse_error", f"read {shown(answer)}: {error.message}", place=place) from None
        unknown = sorted(expression.names - names)
        if unknown:
            near = nearest(unknown[0], sorted(names))
            hint = f", did you mean {shown(near)}?" if near else ""
            raise Unreadable("unknown_symbol", f"read {shown(unknown[0])}{hint}", place=place)
        if expression.names:
            return Reading(expression, 0.0, False)
    written = read_written(answer, place)
    scale = scale_of(written, unit, place)
    value = written.value * scale
    if not math.isfinite(value):
        raise Unreadable("not_a_finite_number", "it is beyond the range of numbers", place=place)
    return Reading(value, written.half_a_digit * scale, written.unit is None and value != 0)


def is_quantity(text: str, names: frozenset[str]) -> bool:
    """Whether a text is a number with a unit, and no expression in symbols of these names."""
    if split_quantity(text) is None:
        return False
    try:
        return not parse(text).names <= names
    except ExpressionError:
        return True


def read_entries(cells: Array, unit: Unit | None, names: frozenset[str]) -> list[Reading]:
    """The entries of cells. Raises Unreadable with all that cannot be read."""
    read, problems = list[Reading](), dict[Finding, None]()
    for cell in cells.flat:
        try:
            read.append(read_entry(cell, unit, names))
        except Unreadable as unreadable:
            problems[unreadable.finding] = None
    if problems:
        raise Unreadable.of(*problems)
    return read


def filled(entries: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Entries as an array of objects: an expression is no sequence."""
    array = np.empty(len(entries), dtype=object)
    array[:] = entries
    return array.reshape(shape)


def worked(entries: Array, points: Sequence[Point]) -> Floats:
    """The values of entries (...) at points (k): k by ...; NaN where there is none."""
    flat = list(np.asarray(entries, dtype=object).flat)
    rows = [[value_at(entry, point) for entry in flat] for point in points]
    return np.array(rows, dtype=np.float64).reshape(len(points), *np.shape(entries))


def value_at(entry: Entry, point: Point) -> float:
    """The value of an entry where the symbols have these values; NaN where there is none."""
    if not isinstance(entry, Expression):
        return entry
    try:
        return entry.evaluate(point)
    except ExpressionError:
        return math.nan


# --- writing


def as_typed(entries: Any, form: str = ".17g") -> Tree:
    """Entries (arrays of them) as a student types them, numbers with all digits or in another form."""
    if isinstance(entries, np.ndarray):
        return [as_typed(entry, form) for entry in entries]
    return entries.text if isinstance(entries, Expression) else f"{entries:{form}}"


def rewritten(tree: Tree, write: Callable[[str], str]) -> Tree:
    """The same with every entry written otherwise."""
    return [rewritten(entry, write) for entry in tree] if isinstance(tree, list) else write(tree)


def times(entries: Array, numbers: Any) -> Array:
    """Entries multiplied by numbers (one, or an array that is broadcast), one by one."""
    pairs = np.broadcast(entries, numbers)
    return filled([_times(entry, float(number)) for entry, number in pairs], pairs.shape)


def _times(entry: Entry, number: float) -> Entry:
    if number == 1 or not isinstance(entry, Expression):
        return entry if number == 1 else entry * number  # type: ignore[operator]
    return parse(f"{number!r}*({entry.text})") if number else 0.0


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


# --- comparing


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
        cells = layout(opened(answer))
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
        from scipy.optimize import linear_sum_assignment

        ranks = self._ranked(answer).argsort()
        far = np.abs(np.subtract.outer(np.arange(len(ranks)), ranks)) / (1 + len(ranks) ** 2)
        return np.asarray(linear_sum_assignment(far.T + ~self.fits(answer))[1])

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


# --- keys


def reference(asked: Asked, layout: Layout) -> Reference:
    """The key of a question, literal (laid out as answers are) or computed. Raises ValueProblem."""
    question, beside = asked.question, 0.0
    if question.tolerance.figures != "value":
        raise ValueProblem("written figures are judged of a number or a quantity", path=("tolerance",))
    if question.modulo is not None:
        raise ValueProblem("a period is for a number or a quantity", path=("modulo",))
    if asked.report is None:
        try:
            unit, entries = _literal(layout(opened(asked.value)), frozenset(question.symbols or ()))
        except Unreadable as unreadable:
            place, code = unreadable.finding.place, unreadable.finding.code
            raise ValueProblem(f"{place}: {CODES[code]}" if place else CODES[code]) from None
    else:
        unit, entries = parse_unit(asked.unit) if asked.unit else None, computed(asked.value)
        beside = size_beside(asked)
    points, given, known = _points(asked, entries)
    values, labels = worked(entries, points), labelled("entry", entries.shape)
    rest = (points, given, known, unit, question.tolerance, labels, beside)
    return Reference(question, asked.path, entries, values, *rest, derived=_derived(asked))


def _derived(asked: Asked) -> dict[str, Node]:
    """The parameters of a document that hang on others; in exact results also those that have a value."""
    known = {} if asked.document is None else asked.document.definitions
    return {
        name: definition.root
        for name, definition in known.items()
        if definition is not None and (definition.names or _is_exact(asked))
    }


def labelled(word: str, shape: tuple[int, ...]) -> Array:
    """The names of the places of entries (...)."""
    names = [
        f"row {place[0] + 1}, column {place[1] + 1}" if len(shape) == 2 else f"{word} {place[-1] + 1}"
        for place in np.ndindex(*shape)
    ]
    return filled(names, shape)


def _literal(cells: Array, names: frozenset[str]) -> tuple[Unit | None, Array]:
    """The unit of the first entry that has one, and the entries. Raises Unreadable."""
    units = (_unit_of(cell, names) for cell in cells.flat)
    unit = next((unit for unit in units if unit is not None), None)
    return unit, filled([each.entry for each in read_entries(cells, unit, names)], cells.shape)


def _unit_of(cell: Cell, names: frozenset[str]) -> Unit | None:
    """The unit of an entry of a literal key, if it has one. Raises Unreadable."""
    if names and isinstance(cell.answer, str) and not is_quantity(cell.answer, names):
        return None
    written = read_written(cell.answer, cell.place)
    return None if written.unit is None else read_unit(written.unit, place=cell.place)


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
    if not isinstance(value, Expr):
        raise ValueProblem("this result is not made of numbers")
    try:
        expression = parse(str(value))
        return expression if expression.names else expression.evaluate({})
    except ExpressionError:
        raise ValueProblem("this result is too long, or has no value, and cannot be compared") from None


def is_product(path: tuple[str, ...]) -> bool:
    """Whether a result is one product of inertia of a tensor of a document."""
    return path[-3:-2] in TENSORS and path[-2] != path[-1]


def size_beside(asked: Asked) -> float:
    """The size (SI) beside which what is asked may be rounding noise; 0 where none is known.

    It is that of the largest number of the array from which an entry is taken. A centre of mass is at the
    origin beside the radius of gyration.
    """
    if asked.report is None or not asked.path:
        return 0.0
    counted = {field.key for field in asked.report.fields if field.counts}
    found: Any = asked.report.tree()
    with suppress(TypeError, ValueError):  # where results are no numbers
        if "center_of_mass" in asked.path:
            return math.sqrt(np.abs(np.array(found["tensor"], dtype=float)).max() / float(found["mass"]))
        for k, step in enumerate(asked.path[1:], start=2):
            found = found[int(step)] if step.isdecimal() else found[step]
            if isinstance(found, list | np.ndarray) and ".".join(asked.path[1:k]) not in counted:
                return float(np.abs(np.array(found, dtype=float)).max(initial=0.0))
    return 0.0


# --- points


def _points(asked: Asked, entries: Array) -> tuple[tuple[Point, ...], frozenset[str], int]:
    """Where a key is worked out, the names with values from the document, and at how many points they are so.

    Other values are random, and follow from the key and the question's name. Raises ValueProblem where the
    key has hardly any values.
    """
    names = frozenset[str]().union(*(e.names for e in entries.flat if isinstance(e, Expression)))
    if not names:
        return ({},), frozenset(), 1
    seed = sha256("\n".join([asked.name, *map(str, entries.flat)]).encode(errors="replace")).digest()
    chance = random.Random(seed)  # noqa: S311 - nobody gains by foretelling it without the key
    if asked.document is None:
        points = _with_values(entries, lambda: _in_question(asked, chance))
        return points, frozenset(), len(points)
    values = {} if _is_exact(asked) else asked.document.values
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


def _is_exact(asked: Asked) -> bool:
    """Whether results are exact numbers, in which parameters with a value do not appear."""
    return asked.document is not None and asked.document.arithmetic.exact and asked.path[0] != "hamilton"


def _in_document(
    asked: Asked, names: frozenset[str], given: Mapping[str, float], chance: random.Random
) -> Point:
    """Random values for the parameters of a document, and for what else a key has, but for those `given`.

    Parameters that hang on others follow them. In exact results those that have a value appear with it.
    """
    assert asked.document is not None
    definitions, fixed = asked.document.definitions, _is_exact(asked)
    point = {name: chance.uniform(LOW, HIGH) for name in sorted(names | definitions.keys())} | dict(given)
    for name, definition in definitions.items():
        if definition is not None and name not in given and (definition.names or fixed):
            point[name] = value_at(definition, point)
    return point


# --- mistakes


def worked_out(code: str) -> Callable[[Reference], Iterator[Reference]]:
    """What makes the keys whose values come out under this mistake, as far as they can be told apart."""

    def changes(key: Reference) -> Iterator[Reference]:
        for name, values in key.mistaken:
            if name == code and not key.holds(exactly(values)):
                yield key.valued(values)

    return changes


def opposite(key: Reference) -> Iterator[Reference]:
    """The key that points the other way."""
    yield key.times(-1)


def transposed(key: Reference) -> Iterator[Reference]:
    """The key with rows and columns exchanged."""
    yield key.arranged(lambda array: array.swapaxes(1, 2))


def moved_on(key: Reference) -> Iterator[Reference]:
    """The key with its components moved on by one."""
    yield key.arranged(lambda array: np.roll(array, 1, axis=1))


def permuted(key: Reference, answer: Typed) -> Iterator[Reference]:
    """The key with its components in the order of the answer."""
    if answer.shape == key.shape:
        yield replace(replace(key, symmetry=key.symmetry | {"order"}).facing(answer), symmetry=key.symmetry)


def one_sign(key: Reference) -> Iterator[tuple[Reference, str]]:
    """The keys with one sign wrong, and where that is; entries that mirror each other have one label."""
    for label in dict.fromkeys(key.labels[key.nonzero].tolist()[:MOST_PLACES]):
        yield key.times(np.where(key.labels == label, -1, 1)), label


def signs(key: Reference, answer: Typed) -> Iterator[tuple[Reference, str]]:
    """The key with the wrong signs of an answer that is right but for them, and where they are."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    right, wrong = facing.agree(answer), facing.times(-1).agree(answer) & facing.nonzero
    wrong &= ~right
    if wrong.any() and (right | wrong).all():
        every = wrong.sum() == facing.nonzero.sum() > 1
        yield facing.times(np.where(wrong, -1, 1)), "" if every else listed(wrong, key.labels)


def any_factor(key: Reference, answer: Typed) -> Iterator[Reference]:
    """The key times the factor that an answer has, where entries of different sizes tell that it is one."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    used = answer.counts & facing.nonzero & (facing.values != 0)
    with np.errstate(all="ignore"):
        ratios = answer.values[used] / facing.values[used]
        sizes = np.abs(key.values[0][key.nonzero])
    if (
        not ratios.size
        or not np.isfinite(ratios).all()
        or sizes.max() <= sizes.min() * (1 + key.least_change)
    ):
        return
    # The middle of the range is as near to all of them as a number can be.
    ratio, least = float(ratios.min() / 2 + ratios.max() / 2), key.least_change
    others = (factor for code, factor in key.factors if code != "constant_factor")
    if abs(abs(ratio) - 1) > least and not any(abs(ratio / other - 1) <= least for other in others):
        yield facing.times(ratio)


def rounded(key: Reference, answer: Typed) -> Iterator[tuple[Reference, str]]:
    """The key rounded to the digits of an answer, and the places where these are too few."""
    if answer.shape != key.shape:
        return
    facing = key.facing(answer, by_size=True)
    with np.errstate(all="ignore"):
        limits = answer.halves * (1 + ROUNDING) + NOISE * np.abs(facing.values)
        near = (answer.halves > 0) & (np.abs(answer.values - facing.values) <= limits)
    right = facing.agree(answer)
    short = ~right & (near | ~answer.counts).all(axis=0)
    if short.any() and (right | short).all():
        others = bool((right & facing.nonzero).any())
        yield facing.valued(answer.values), listed(short, key.labels) if others else ""
