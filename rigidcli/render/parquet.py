"""Tables in the format Parquet with the columns of csv, for long tables that programs read."""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import util
from typing import Any, NamedTuple

import numpy as np
import orjson

from rigidcli.errors import UsageError
from rigidcli.render import Look
from rigidcli.render.values import data_columns, plain, row_of
from rigidcli.report import Report, Value

ROWS_OF_PART = 65_536  # rows that are kept in memory and written together: 30 MB for 60 columns
# The kinds of columns; a mixture of kinds is turned into texts.
TRUTH, NUMBER, TEXT = "bool", "double", "string"


class ParquetPiece(NamedTuple):
    """Rows of a table: its columns (lists or arrays) and their units, by the heads of the columns."""

    rows: int
    columns: Mapping[str, Value]
    units: Mapping[str, str]


def piece(report: Report, look: Look) -> ParquetPiece:
    """The row of a report, or its table of data."""
    columns = data_columns(report, look)
    if not columns:
        row = row_of(report, look.columns)
        units = {name: unit for name, (_, unit) in row.items() if unit}
        return ParquetPiece(1, {name: [plain(value)] for name, (value, _) in row.items()}, units)
    count = len(columns[0].values)
    heads: dict[str, Value] = {"name": [report.name] * count} if look.several else {}
    values = {column.cells[0]: np.asarray(column.values, float) for column in columns}
    units = {column.cells[0]: column.unit for column in columns if column.unit}
    return ParquetPiece(count, heads | values, units)


def render(pieces: Iterable[ParquetPiece], look: Look) -> Iterator[bytes]:
    """One file with the rows of all reports, in parts. Raises UsageError without pyarrow.

    The rows wait in a temporary file until all are there, since the last row may turn a column into texts.
    """
    require_library()
    from pyarrow.parquet import ParquetWriter

    kinds, units, count = dict[str, str](), dict[str, str](), 0
    with tempfile.TemporaryFile() as waiting, tempfile.TemporaryFile() as file:
        for group in _groups(pieces):
            pickle.dump(group, waiting)
            kinds = joined(kinds, {name: kind(values) for name, values in group.columns.items()})
            units, count = {**group.units, **units}, count + 1
        if not count:
            return
        waiting.seek(0)
        empty = as_table(ParquetPiece(0, {}, units), kinds)
        with ParquetWriter(file, empty.schema, compression="zstd") as writer:
            for _ in range(count):
                group = pickle.load(waiting)  # noqa: S301 - it was written above
                writer.write_table(as_table(group._replace(units=units), kinds))
        file.seek(0)
        while part := file.read(2**20):
            yield part


def _groups(pieces: Iterable[ParquetPiece]) -> Iterator[ParquetPiece]:
    some, count = list[ParquetPiece](), 0
    for each in pieces:
        some.append(each)
        count += each.rows
        if count >= ROWS_OF_PART:
            yield together(some)
            some, count = [], 0
    if some:
        yield together(some)


def together(pieces: Sequence[ParquetPiece]) -> ParquetPiece:
    """The rows of several pieces, with None in the cells that a piece does not have."""
    heads = dict.fromkeys(name for each in pieces for name in each.columns)
    columns = dict[str, Value]()
    for name in heads:
        parts = [each.columns.get(name, [None] * each.rows) for each in pieces]
        arrays = all(isinstance(part, np.ndarray) for part in parts)
        columns[name] = np.concatenate(parts) if arrays else [value for part in parts for value in part]
    units = {name: unit for each in reversed(pieces) for name, unit in each.units.items()}
    return ParquetPiece(sum(each.rows for each in pieces), columns, units)


def kind(values: Value) -> str:
    """The kind of a column with these values; "" if all are None."""
    if isinstance(values, np.ndarray):
        return NUMBER
    types = {type(value) for value in values} - {type(None)}
    if not types:
        return ""
    if types <= {bool, np.bool_}:
        return TRUTH
    numbers = bool not in types and all(issubclass(each, int | float | np.number) for each in types)
    return NUMBER if numbers else TEXT


def joined(kinds: Mapping[str, str], others: Mapping[str, str]) -> dict[str, str]:
    """The kinds of the columns of several tables, in the order in which the columns first appear."""
    all_kinds = dict(kinds)
    for name, other in others.items():
        ours = all_kinds.get(name, "") or other
        all_kinds[name] = ours if other in ("", ours) else TEXT
    return all_kinds


def require_library() -> None:
    """Raise UsageError without pyarrow."""
    if util.find_spec("pyarrow") is None:
        raise UsageError("pyarrow is not installed", hint="python -m pip install 'rigidcli[parquet]'")


def as_table(piece: ParquetPiece, kinds: Mapping[str, str]) -> Any:
    """The rows as a table of pyarrow with columns of these kinds; without any value they count as numbers.

    Texts are made of all values in a column of texts.
    """
    import pyarrow as pa

    types = {TRUTH: pa.bool_(), NUMBER: pa.float64(), TEXT: pa.string(), "": pa.float64()}
    fields, columns = [], []
    for name, kind in kinds.items():
        cells = piece.columns.get(name, [None] * piece.rows)
        if kind == TEXT:
            cells = [None if value is None else _text(value) for value in cells]
        unit = {"unit": piece.units[name]} if name in piece.units else None
        fields.append(pa.field(name, types[kind], metadata=unit))
        columns.append(pa.array(cells, types[kind]))
    return pa.table(columns, schema=pa.schema(fields))


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    number = float(value) if kind([value]) == NUMBER else value
    return orjson.dumps(number, option=orjson.OPT_SERIALIZE_NUMPY).decode()
