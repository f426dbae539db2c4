"""A table as text: a line with the names of columns, then a line of numbers for each row.

Cells are parted by commas, semicolons, tabs or blanks, whichever the line of names has first in this order;
quotation marks mean nothing. Empty lines, and lines with `#` before the names, are passed over; as numpy
writes it, the last of these may hold the names.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import shown
from rigidcli.grading.numbers import read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.trajectories.heads import TIME, places, read_head, split

MOST_CHARACTERS = 1_000_000
"""Of a table."""

MOST_EXPRESSIONS = 1_000
"""Cells that are no decimal numbers, but expressions such as `pi/6`."""

SEPARATORS = ",;\t"

# All that decimal numbers consist of: of such characters, float() accepts nothing else.
_DECIMALS = re.compile(r"[0-9eE+\-.\s]*")


def read_columns(
    text: str, wanted: Collection[str] | None = None, further: Collection[str] = (), *, in_si: bool = False
) -> dict[str, Floats]:
    """The columns of a table (n each) that are `wanted`, in any spelling, as far as it has them; or all.

    Those `further` ones are read that go by their own name. Of a unit in its head, the time is converted to
    seconds, and to be `in_si` units other columns are, too. Raises Unreadable.
    """
    if len(text) > MOST_CHARACTERS:
        raise Unreadable("too_large", f"expected at most {MOST_CHARACTERS:,} characters")
    numbers, lines = _lines(text)
    names, separator, begin = _header(lines)
    rows = [line.split(separator) for line in lines[begin:]]
    numbers = numbers[begin:]
    if not rows:
        raise Unreadable("wrong_shape", "there are no rows of numbers")
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != len(names):
            raise Unreadable(
                "wrong_shape", f"{len(row)} cells, expected {len(names)}", place=f"line {number}"
            )
    if wanted is None:
        wanted = dict.fromkeys(read_head(name).name for name in names)
    columns = {}
    for name, (place, head) in places(names, wanted, further).items():
        column = _column([row[place] for row in rows], name, numbers)
        columns[name] = column * head.scale(any_unit=in_si) if in_si or name == TIME else column
    return columns


def _lines(text: str) -> tuple[list[int], list[str]]:
    """The lines that are not empty, and their numbers."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    text = text.replace('"', "").replace("\N{MINUS SIGN}", "-")
    told = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    return [number for number, _ in told], [line for _, line in told]


def _header(lines: Sequence[str]) -> tuple[list[str], str | None, int]:
    """The names of columns, what parts cells (None for blanks), and the index of the first row."""
    begin = 0
    while begin < len(lines) and lines[begin].lstrip().startswith("#"):
        begin += 1
    if begin == len(lines):
        raise Unreadable("wrong_shape", "read an empty table, expected a line of names and lines of numbers")
    line = lines[begin]
    separator = next((each for each in SEPARATORS if each in line), None)
    names = split(line, separator)
    if not _DECIMALS.fullmatch("".join(names)):
        return names, separator, begin + 1
    above = split(lines[begin - 1].lstrip(" #"), separator) if begin else []
    if len(above) != len(names):
        raise Unreadable("missing_column", "the first line has no names of columns", place="t")
    return above, separator, begin


def _column(cells: list[str], name: str, numbers: Sequence[int]) -> Floats:
    if _DECIMALS.fullmatch("".join(cells)):
        try:
            values = np.array(list(map(float, cells)))
        except ValueError:
            pass  # such as `1e`: what follows says where
        else:
            if np.isfinite(values).all():
                return values
    return np.array(_one_by_one(cells, name, numbers))


def _one_by_one(cells: list[str], name: str, numbers: Sequence[int]) -> list[float]:
    """The same for cells of any kind; says which one cannot be read."""
    values, expressions = [], 0
    for cell, number in zip(cells, numbers, strict=True):
        place = f"line {number}, column {shown(name)}"
        written = read_written(cell.strip(), place)
        if written.unit is not None:
            raise Unreadable("not_a_number", f"read {shown(cell)}, expected no unit", place=place)
        expressions += not written.mantissa
        if expressions > MOST_EXPRESSIONS:
            raise Unreadable("too_large", f"expected at most {MOST_EXPRESSIONS:,} expressions", place=place)
        values.append(written.value)
    return values
