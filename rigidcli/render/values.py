"""Values as text: what all renderers know of floats, exact numbers, vectors and matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.report import Cell, Field, Table, Value, cells
from rigidcli.symbolic.language.tree import Node

NOISE = 4 * float(np.finfo(np.float64).eps)
"""Entries of an array below this, in units of its largest, are shown to people as zero."""

_PLAIN = (float, int, str, bool, type(None))

Writer: TypeAlias = Callable[[Node], str]
"""One of `text`, `reading` and `latex` of `symbolic.language.text`."""


def is_exact(value: Value) -> bool:
    """Whether a value is an exact expression, or an array of them."""
    if isinstance(value, np.ndarray):
        return bool(value.dtype == object)
    return hasattr(type(value), "to_sympy")


def written(value: Value, write: Writer) -> str:
    """An exact expression in one of the ways to write it."""
    from rigidcli.symbolic.algebra.trees import to_tree

    return write(to_tree(value))


def plain(value: Value) -> Value:
    """`value` for json and csv: exact numbers as text in the expression language, all else as it is."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [plain(entry) for entry in value]
    if isinstance(value, _PLAIN) or not is_exact(value):
        return value
    return [plain(entry) for entry in value] if isinstance(value, np.ndarray) else str(value)


def has_symbols(value: Value) -> bool:
    """Whether an exact value depends on symbols, which then bring units of their own."""
    if not is_exact(value):
        return False
    return any(entry.names for entry in np.ravel(np.array(value, dtype=object)))


@dataclass(frozen=True, slots=True)
class Notation:
    """How one kind of output writes a float of so many digits, and an exact number."""

    floating: Callable[[float, int], str]
    exact: Callable[[Any], str]


MOST_ROWS = 11
"""Rows of a table of data that people are shown."""


def sampled(length: int) -> list[int]:
    """Some rows of a table of so many: the first, the last, and evenly between them."""
    shown = min(length, MOST_ROWS)
    return [round(k * (length - 1) / max(1, shown - 1)) for k in range(shown)]


def visible(table: Table, look: Look) -> list[Cell]:
    """The columns that people are shown: those that have a unit, or those they asked for."""
    if not len(table):
        return []
    asked = look.columns if table.data else ()
    return [cell for cell in cells(table, asked) if asked or cell.unit is not None]


def column_texts(cell: Cell, rows: Iterable[int], digits: int, notation: Notation) -> list[str]:
    """The values of a column in these rows, for people; rounding noise beside its largest is zero."""
    values = cell.values
    if isinstance(values, np.ndarray):
        values = np.where(np.abs(values) < NOISE * np.abs(cell.whole).max(), 0.0, values)
    return [_cell_text(values[row], digits, notation) for row in rows]


_TRUTH = {None: "-", True: "yes", False: "no"}


def _cell_text(value: Value, digits: int, notation: Notation) -> str:
    if value is None or isinstance(value, str | bool):
        return printable(value) if isinstance(value, str) else _TRUTH[value]
    return notation.exact(value) if is_exact(value) else notation.floating(float(value), digits)


def entries(entry: Field, digits: int, notation: Notation) -> tuple[str, Any]:
    """A common factor ("" for none), and the text of a number or, nested as it is, of an array."""
    value = entry.value
    if not isinstance(value, np.ndarray):
        return "", notation.exact(value) if is_exact(value) else notation.floating(float(value), digits)
    if is_exact(value):
        return _exact_entries(entry, notation)
    if not entry.counts:
        # Of a matrix, a small row or column is judged by itself: a slender body has a small moment.
        size = np.abs(value)
        scale = (
            np.minimum(*np.meshgrid(size.max(axis=0), size.max(axis=1))) if value.ndim == 2 else size.max()
        )
        value = np.where(size < NOISE * scale, 0.0, value)
    return "", _each(value, lambda number: notation.floating(float(number), digits))


def _exact_entries(entry: Field, notation: Notation) -> tuple[str, Any]:
    value = entry.value
    if value.ndim == 2:
        from rigidcli.symbolic.algebra.arithmetic import common_factor

        factor, rest = common_factor(value)
        # A factor in front is easier to read when it takes the symbols along, or leaves plain numbers.
        # Entries without one unit in common, as in A of z' = A z, have no symbols in common but by chance.
        plain_numbers = all(number.as_number is not None for number in rest.flat)
        if factor != 1 and (plain_numbers if not factor.names else entry.unit):
            return notation.exact(factor), _each(rest, notation.exact)
    return "", _each(value, notation.exact)


def _each(array: Any, write: Callable[[Any], str]) -> Any:
    return [_each(entry, write) if isinstance(entry, np.ndarray) else write(entry) for entry in array]
