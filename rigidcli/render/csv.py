"""A row or a table of data for each report; a float is the shortest text that reads back the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import orjson

from rigidcli.errors import ComputationError
from rigidcli.render import Look
from rigidcli.render.values import data_columns, plain, row_of
from rigidcli.report import Column, Report, Value

ROWS_AT_ONCE = 50_000  # rows of a table that are written at a time: their text takes some 15 MB


class CsvPiece(NamedTuple):
    """The output for a report: the texts of a row by the heads, or the heads and columns of a table.

    Every row of the table begins with the text `start`.
    """

    row: dict[str, str]
    heads: Sequence[str] = ()
    columns: Sequence[Column] = ()
    start: str = ""


def piece(report: Report, look: Look) -> CsvPiece:
    """The row of a report, or its table of data."""
    columns = data_columns(report, look)
    row = {} if columns else row_of(report, look.columns)
    units = [(name, unit) for name, (_, unit) in row.items()] or [(one.cells[0], one.unit) for one in columns]
    heads = [f"{name} ({unit})" if unit and look.unit_header else name for name, unit in units]
    if not columns:
        return CsvPiece(dict(zip(heads, _cells([value for value, _ in row.values()]), strict=True)))
    if look.several:
        return CsvPiece({}, ["name", *heads], columns, _cells([report.name])[0] + ",")
    return CsvPiece({}, heads, columns)


def require_fit(piece: CsvPiece, first: CsvPiece) -> None:
    """Raise ComputationError for a row with results that have no column in the header of the `first` one."""
    if more := [head for head in piece.row if head not in first.row]:
        message = f"rows with {', '.join(f'`{head}`' for head in more)} are left out: the first row has none"
        hint = "csv has one header: begin with a value that has all columns, choose `--columns`, or use json"
        raise ComputationError(message, hint=hint)


def render(pieces: Iterable[CsvPiece], look: Look) -> Iterator[str]:
    """The rows, with a header before the first row and wherever the header changes; nulls are empty cells.

    Rows of reports share one header as long as no report has a result that the reports before it lack.
    """
    written: Sequence[str] = []
    in_rows = False
    for row, heads, columns, start in pieces:
        if columns:
            header, lines = heads, _table(columns, start)
        else:
            texts = dict.fromkeys(written, "") | row if in_rows and [*row] != written else row
            header, lines = [*texts], iter([",".join(texts.values()) + "\n"])
        in_rows = not columns
        is_new, written = header != written, header
        if look.header and is_new:
            yield ",".join(_cells(header)) + "\n" + next(lines)
        yield from lines


def _table(columns: Sequence[Column], start: str) -> Iterator[str]:
    """Rows of floats, many at a time, each with `start` before it; whole numbers may begin them."""
    whole = np.asarray(columns[0].values).dtype.kind == "i"
    for begin in range(0, len(columns[0].values), ROWS_AT_ONCE):
        parts = [column.values[begin : begin + ROWS_AT_ONCE] for column in columns]
        block = np.column_stack([np.empty((len(parts[0]), 0)), *parts[whole:]])
        # The brackets of the rows [[1,2],[3,4]] become the ends of lines.
        lines = orjson.dumps(block, option=orjson.OPT_SERIALIZE_NUMPY)[2:-2].decode().split("],[")
        if whole:
            places = np.asarray(parts[0]).tolist()  # whole numbers of numpy are slow to write
            lines = [f"{place},{line}".rstrip(",") for place, line in zip(places, lines, strict=True)]
        yield "".join(f"{start}{line}\n" for line in lines)


def _cells(values: Sequence[Value]) -> list[str]:
    """The texts of cells. One call writes all numbers, which takes a tenth of the time of single calls."""
    values = ["" if x is None else x if isinstance(x, float) else plain(x) for x in values]
    numbers = [value for value in values if not isinstance(value, str)]
    texts = iter(orjson.dumps(numbers, option=orjson.OPT_SERIALIZE_NUMPY)[1:-1].decode().split(","))
    return [_quoted(value) if isinstance(value, str) else next(texts) for value in values]


def _quoted(text: str) -> str:
    if text and any(mark in text for mark in ',"\r\n'):  # most columns of a study are empty
        return '"' + text.replace('"', '""') + '"'
    return text
