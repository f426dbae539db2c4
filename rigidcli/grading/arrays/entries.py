"""Entries of answers that are many numbers: vectors, moments, matrices and tensors.

An entry is a number, or an expression in symbols where the question has any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ExpressionError, nearest, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import read_rounded
from rigidcli.grading.outcome import Unreadable
from rigidcli.model.units import Unit, is_unit, split_quantity
from rigidcli.symbolic.language.expression import Expression, parse

Entry: TypeAlias = float | Expression
"""A number in SI units, or an expression in symbols."""

Point: TypeAlias = Mapping[str, float]
"""Values of symbols."""


@dataclass(frozen=True, slots=True)
class Cell:
    """An entry as it was typed, and the name of its place."""

    answer: Tree
    place: str


Layout: TypeAlias = Callable[[Tree], Array]
"""What finds the cells in an answer: an array of them in the form that is asked. Raises Unreadable."""


def read_entry(cell: Cell, unit: Unit | None, names: frozenset[str]) -> tuple[Entry, float]:
    """A number with half of one in its last digit, or an expression (0 then). Raises Unreadable."""
    answer, place = cell.answer, cell.place
    if not names or not isinstance(answer, str):
        return read_rounded(answer, unit, place)
    if is_quantity(answer, names):
        return read_rounded(answer, unit, place)
    try:
        expression = parse(answer)
    except ExpressionError as error:
        raise Unreadable("parse_error", f"read {shown(answer)}: {error.message}", place=place) from None
    unknown = sorted(expression.names - names)
    if unknown:
        near = nearest(unknown[0], sorted(names))
        hint = f", did you mean {shown(near)}?" if near else ""
        raise Unreadable("unknown_symbol", f"read {shown(unknown[0])}{hint}", place=place)
    return (expression, 0.0) if expression.names else read_rounded(answer, unit, place)


def is_quantity(text: str, names: frozenset[str]) -> bool:
    """Whether a text is a number with a unit, and no expression in symbols of these names."""
    if split_quantity(text) is None:
        return False
    try:
        used = parse(text).names
    except ExpressionError:
        return True
    return not used <= names and all(map(is_unit, used))


def read_entries(cells: Array, unit: Unit | None, names: frozenset[str]) -> tuple[Array, Floats]:
    """The entries of cells (...), and half of one in the last digit of each (...). Raises Unreadable."""
    read = [read_entry(cell, unit, names) for cell in cells.flat]
    halves = np.array([half for _, half in read], dtype=np.float64)
    return filled([entry for entry, _ in read], cells.shape), halves.reshape(cells.shape)


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
