"""Entries of answers that are many numbers: read as typed, worked out at points, and written.

An entry is a number, or an expression in symbols where the question has any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.document.syntax import read_tree
from rigidcli.errors import DocumentError, ExpressionError, nearest, shown
from rigidcli.fields.typed_numbers import split_quantity
from rigidcli.fields.units import Unit
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import read_written, scale_of, unnamed
from rigidcli.grading.outcome import Finding, Unreadable
from rigidcli.language.expression import Expression, parse

Entry: TypeAlias = float | Expression
"""A number in SI units, or an expression in symbols."""

Point: TypeAlias = Mapping[str, float]
"""Values of symbols."""

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
