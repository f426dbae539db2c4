"""One row a report, or its table of data; floats in the shortest text that reads back the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np
import orjson

from rigidcli.core.arithmetic import Floats
from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Column, Report, Value, single_cells

ROWS = 50_000
"""Rows of a table that are written at a time, which bounds the memory that the text takes."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """The header before the first row, and where it changes; what is not known is an empty cell.

    Rows of reports follow one header, as long as no report has a result that those before it lack.
    """
    written: list[str] = []
    in_rows = False
    for report in reports:
        data = next((table for table in report.tables if table.data), None)
        if data is None or report.swept:
            chosen = row_of(report, look.columns)
            row = {_head(name, unit, look): value for name, (value, unit) in chosen.items()}
            row = dict.fromkeys(written) | row if in_rows else row
            in_rows = True
            header, lines = list(row), iter([",".join(map(_cell, row.values())) + "\n"])
        else:
            in_rows = False
            columns = single_cells(data, look.columns)
            # Whole numbers, the place of a start, are the same for many rows.
            whole = columns[0] if getattr(columns[0].values, "dtype", np.dtype(float)).kind == "i" else None
            heads = [_head(column.cells[0], column.unit, look) for column in columns]
            header = [*(["name"] if look.several else []), *heads]
            name = _cell(report.name) + "," if look.several else ""
            lines = _rows(columns, name) if whole is None else _by_start(whole, columns[1:], name)
        is_new, written = header != written, header
        if look.header and is_new:
            yield ",".join(map(_cell, header)) + "\n" + next(lines)
        yield from lines


def row_of(report: Report, names: Sequence[str] = ()) -> dict[str, tuple[Value, str]]:
    """The cells of the row of a report and their units, by their heads: first, and once, what is swept.

    Where it has some of the `names`, only those, in that order.
    """
    row: dict[str, tuple[Value, str]] = {entry.key: (None, "") for entry in report.swept}
    row["name"] = report.name, ""
    for entry in (*report.fields, *report.swept):
        row |= {head: (_at(entry.value, place), entry.unit) for head, place in entry.cells.items()}
    return {name: row[name] for name in names if name in row} or row


def _head(name: str, unit: str, look: Look) -> str:
    return f"{name} ({unit})" if look.unit_header and unit else name


def _rows(columns: Sequence[Column], start: str) -> Iterator[str]:
    """Rows of floats, many at a time, each with `start` before it."""
    for first in range(0, len(columns[0].values), ROWS):
        yield _lines(np.column_stack([column.values[first : first + ROWS] for column in columns]), start)


def _lines(block: Floats, start: str) -> str:
    """A row of floats (n by k) a line, each with `start` before it."""
    text = orjson.dumps(block, option=orjson.OPT_SERIALIZE_NUMPY)
    # The brackets of the rows [[1,2],[3,4]] become the ends of lines.
    return start + text[2:-2].decode().replace("],[", "\n" + start) + "\n"


def _by_start(start: Column, columns: Sequence[Column], name: str) -> Iterator[str]:
    """Rows of floats that begin with a whole number, those of one number together."""
    for begin in range(0, len(start.values), ROWS):
        places = start.values[begin : begin + ROWS]
        ends = pairwise([0, *(np.flatnonzero(np.diff(places)) + 1).tolist(), len(places)])
        if not columns:
            yield "".join(f"{name}{place}\n" for place in places.tolist())
            continue
        block = np.column_stack([column.values[begin : begin + ROWS] for column in columns])
        yield "".join(_lines(block[first:last], f"{name}{places[first]},") for first, last in ends)


def _at(value: Value, place: tuple[int, ...]) -> Value:
    return value if value is None or not place else value[place]


def _cell(value: Value) -> str:
    value = plain(value)
    if value is None:
        return ""
    if not isinstance(value, str):
        return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY).decode()
    if any(mark in value for mark in ',"\r\n'):
        return '"' + value.replace('"', '""') + '"'
    return value
