"""Values of results as text or cells: floats, exact numbers, vectors and matrices, for all renderers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.report import NOISE, Column, Field, Report, Table, Value, single_cells, yes_or_no

_PLAIN = (float, int, str, bool, type(None))
# A function that writes a number: a float with a number of digits, or an exact expression.
Notation: TypeAlias = Callable[[Value, int], str]


def is_exact(value: Value) -> bool:
    """Whether a value is an exact expression, or an array of them."""
    if isinstance(value, np.ndarray):
        return bool(value.dtype == object)
    return hasattr(type(value), "tree")


def has_letters(value: Value) -> bool:
    """Whether an entry of a value is an exact expression with symbols in it."""
    if isinstance(value, np.ndarray) and not is_exact(value):
        return False
    return any(is_exact(entry) and entry.names for entry in np.ravel(np.array(value, dtype=object)))


def plain(value: Value) -> Value:
    """`value` for json and csv, with exact numbers as text in the expression language."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [plain(entry) for entry in value]
    if isinstance(value, _PLAIN) or not is_exact(value):
        return value
    return [plain(entry) for entry in value] if isinstance(value, np.ndarray) else str(value)


def row_of(report: Report, names: Sequence[str] = ()) -> dict[str, tuple[Value, str]]:
    """The row of a report: cells with their units by the heads of the columns. Swept keys come first.

    If the row has some of the `names`, only these are kept, in their order.
    """
    row: dict[str, tuple[Value, str]] = {entry.key: (None, "") for entry in report.swept}
    row["name"] = report.name, ""
    for entry in (*report.fields, *report.swept):
        value, unit = entry.value, entry.unit
        for head, place in entry.cells.items():
            row[head] = (value if value is None or not place else value[place], unit)
    return {name: row[name] for name in names if name in row} or row


def data_columns(report: Report, look: Look) -> list[Column]:
    """The columns of the table of data, of one cell each; none where the report is a row of cells."""
    return [] if report.data is None or report.swept else single_cells(report.data, look.columns)


def shown_fields(report: Report, look: Look) -> list[Field]:
    """The results with a title; diagnostics and results without a value only in a verbose look."""
    every = [entry for entry in report.fields if entry.title]
    if look.verbose:
        return every
    return [entry for entry in every if not entry.diagnostic and (entry.words or entry.value is not None)]


def shown_columns(table: Table, look: Look, notation: Notation) -> list[tuple[Column, list[str]]]:
    """The columns that people see, of one cell each, with the texts of the cells.

    These are the columns that the look asks for, or all that are not hidden; a verbose look also has hidden
    columns of tables that are not records. A table of data is cut to eleven rows: the first, the last, and
    evenly chosen ones between. Columns with letters, and zeros beside them, have no unit: letters bring
    theirs.
    """
    length = len(table)
    if not length:
        return []
    asked = look.columns if table.data else ()
    count = min(length, 11) if table.data else length
    rows = [round(k * (length - 1) / max(1, count - 1)) for k in range(count)]
    tidied = replace(table, columns=tuple(map(without_noise, table.columns)))
    columns = [
        column
        for column in single_cells(tidied, asked)
        if asked or not column.hidden or (look.verbose and not table.records)
    ]
    if any(has_letters(column.values) for column in columns):
        columns = [
            replace(column, unit="")
            if has_letters(column.values) or all(value in (0, "") for value in column.values)
            else column
            for column in columns
        ]
    return [
        (column, [cell_text((column.words or column.values)[row], look.digits, notation) for row in rows])
        for column in columns
    ]


def has_words(column: Column) -> bool:
    """Whether people see words in the cells of a column, and no numbers."""
    return all(isinstance(value, str | bool | None) for value in column.words or column.values)


def worded(column: Column, texts: Sequence[str]) -> list[tuple[str, bool]]:
    """The texts of a column, each with whether it is a word: a column may mix words and numbers."""
    if isinstance(column.values, list) and len(column.values) == len(texts) and not has_words(column):
        return [(text, isinstance(value, str)) for text, value in zip(texts, column.values, strict=True)]
    return [(text, has_words(column)) for text in texts]


def without_noise(column: Column) -> Column:
    """The column; entries below its `noise` are zero."""
    values = column.values
    if isinstance(values, np.ndarray) and not is_exact(values):
        values = np.where(np.abs(values) < column.noise * np.abs(values).max(), 0.0, values)
    return replace(column, values=values)


def cell_text(value: Value, digits: int, notation: Notation) -> str:
    """The text of a cell for people: a word, a number, yes or no, or `-` where there is no value."""
    if value is None or isinstance(value, str | bool):
        return printable(value) if isinstance(value, str) else yes_or_no(value)
    return notation(value, digits)


def tidied(entry: Field) -> Value:
    """The value of a result; entries of an array that are rounding noise are zero."""
    value = entry.value
    if not isinstance(value, np.ndarray) or entry.counts or is_exact(value):
        return value
    # A small row or column of a matrix is judged by itself: a slender body has a small moment.
    size = np.abs(value)
    scale = np.minimum(*np.meshgrid(size.max(axis=0), size.max(axis=1))) if value.ndim == 2 else size.max()
    return np.where(size < NOISE * scale, 0.0, value)


def entries(entry: Field, digits: int, notation: Notation) -> tuple[str, Any, str]:
    """The common factor of a value ("" for none), its text (nested lists for an array), and its unit.

    A value with letters has no unit: the letters bring theirs.
    """
    if np.shape(entry.value) == (1,):  # a list of one number, such as that of the frequencies
        entry = replace(entry, value=entry.value[0])
    value, factor = entry.value, ""
    if is_exact(value):
        unit = "" if has_letters(value) else entry.unit
        numbers = np.ravel(np.array(value, dtype=object))
        is_plain = all(hasattr(number, "style") and not number.style.decimal for number in numbers)
        if np.ndim(value) == 2 and is_plain:
            from rigidcli.algebra.arithmetic import common_factor

            common, rest = common_factor(value)
            # A factor in front is easier to read when it takes the symbols along, or leaves plain numbers.
            # Entries without one unit in common, as in A of z' = A z, have symbols in common by chance only.
            plain = all(number.as_number is not None for number in rest.flat)
            if common != 1 and (entry.unit if common.names else plain):
                value, factor = rest, notation(common, digits)
        return factor, _texts(value, digits, notation), unit
    value = tidied(entry)
    if np.ndim(value) == 2 and not entry.counts and (power := _power_of_ten(value, digits)):
        return notation(10.0**power, digits), _texts(value / 10.0**power, digits, notation), entry.unit
    return "", _texts(value, digits, notation), entry.unit


def _power_of_ten(matrix: Any, digits: int) -> int:
    """The power of ten of the largest entry, if some entry needs a power of ten; else 0.

    It is 0 for more than 15 digits, which would show the rounding of the quotient.
    """
    is_plain = all("e" not in f"{entry:.{digits}g}" for entry in matrix.flat)
    return 0 if is_plain or digits > 15 else math.floor(math.log10(np.abs(matrix).max()))


def _texts(value: Value, digits: int, notation: Notation) -> Any:
    if isinstance(value, np.ndarray):
        return [_texts(entry, digits, notation) for entry in value]
    return notation(value, digits)


@cache
def _letters() -> tuple[re.Pattern[str], dict[str, str]]:
    """The pattern of names of Greek letters and of letters with numbers, and the letters by their names."""
    from rigidcli.language.tokens import GREEK_LETTERS  # which data do without

    letters = {name: letter for letter, name in reversed(GREEK_LETTERS.items())}
    return re.compile(rf"\b({'|'.join(GREEK_LETTERS.values())})(\d*)\b|\b([a-z])(\d+)\b"), letters


def lettered(text: str) -> str:
    """Plain text with Greek letters for their names, and numbers of symbols below the line: theta1 is θ₁."""
    pattern, letters = _letters()

    def written(name: re.Match[str]) -> str:
        below = (name[2] or name[4] or "").translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))
        return letters.get(name[1] or "", name[3] or "") + below

    return pattern.sub(written, text)


def raised(text: str) -> str:
    """A unit with its powers as raised digits."""
    digits = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return re.sub(r"\^(-?[0-9]+)", lambda power: power[1].translate(digits), text)
