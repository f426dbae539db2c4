"""Tables with the columns of csv in the format Parquet, which programs read fast and which may be long."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib import util
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import orjson

from rigidcli.errors import UsageError
from rigidcli.render import Look
from rigidcli.render.csv import row_of
from rigidcli.render.values import plain
from rigidcli.report import Report, Value, single_cells

ROWS = 65_536
"""Rows of a group, which is what is kept in memory: 30 MB for 60 columns."""

HIDDEN = ".rigidcli-"
"""How the names of folders begin in which files are made, and which readers of a folder pass over."""

PIECE = 2**20
"""Bytes of a file that are read at a time."""

NOTHING, TRUTH, NUMBER, TEXT = "nothing", "bool", "float64", "string"
"""What a column holds: no value yet, truth values, numbers, or texts, which also stand for what is mixed."""


class Kind(NamedTuple):
    """What a column holds, and its unit."""

    type: str
    unit: str

    def join(self, other: Kind) -> Kind:
        """What holds the values of both."""
        known = {self.type, other.type} - {NOTHING}
        return Kind(known.pop() if len(known) == 1 else TEXT if known else NOTHING, self.unit or other.unit)


Kinds = dict[str, Kind]
"""The columns of a table by their heads."""


def joined(kinds: Iterable[Mapping[str, Kind]]) -> Kinds:
    """The columns of several tables, in the order in which they are first met."""
    all_kinds: Kinds = {}
    for each in kinds:
        for name, kind in each.items():
            all_kinds[name] = all_kinds[name].join(kind) if name in all_kinds else kind
    return all_kinds


def require_library() -> None:
    """Raise UsageError unless pyarrow is installed."""
    if util.find_spec("pyarrow") is None:
        raise UsageError("pyarrow is not installed", hint="python -m pip install 'rigidcli[parquet]'")


def render(reports: Iterable[Report], look: Look) -> Iterator[bytes]:
    """One file with the rows of all reports, in pieces. Raises UsageError without pyarrow."""
    require_library()
    with tempfile.TemporaryDirectory(prefix=HIDDEN) as name:
        path = Path(name) / "table.parquet"
        with Rows(path, look) as rows:
            for report in reports:
                rows.add(report)
        if path.exists():
            with path.open("rb") as file:
                while piece := file.read(PIECE):
                    yield piece


@dataclass
class Rows:
    """A file of rows, written a group at a time; a context that ends it. Without rows there is no file.

    `kinds` are its columns so far, and `count` its rows. Where later groups have other columns, or other
    kinds of values in them, they go to a file of their own, and all become one in the end. All is written
    beside `path`, which has the whole file at once, or after an error none.
    """

    path: Path
    look: Look
    kinds: Kinds = field(default_factory=dict)
    count: int = 0
    _stage: ExitStack = field(default_factory=ExitStack)
    _files: list[Path] = field(default_factory=list)
    _folder: Path = Path()
    _written: Kinds = field(default_factory=dict)
    _writer: Any = None
    _blocks: list[_Block] = field(default_factory=list)
    _singles: list[dict[str, Value]] = field(default_factory=list)

    def add(self, report: Report) -> None:
        """Add the row of a report, or those of its table of data."""
        data = next((table for table in report.tables if table.data), None)
        if data is None or report.swept:
            chosen = row_of(report, self.look.columns)
            cells = {name: plain(value) for name, (value, _) in chosen.items()}
            self._join({name: Kind(_type(cells[name]), unit) for name, (_, unit) in chosen.items()})
            self._singles.append(cells)
            self._grow(1)
            return
        self._end_singles()
        columns = single_cells(data, self.look.columns)
        names = {"name": Kind(TEXT, "")} if self.look.several else {}
        self._join(names | {column.cells[0]: Kind(NUMBER, column.unit) for column in columns})
        for first in range(0, len(data), ROWS):
            values: dict[str, Value] = {
                column.cells[0]: np.asarray(column.values[first : first + ROWS], float) for column in columns
            }
            count = min(ROWS, len(data) - first)
            self._blocks.append(_Block(count, {name: [report.name] * count for name in names} | values))
            self._grow(count)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        with self._stage:
            if kind is None:
                self._flush()
            if self._writer is not None:
                self._writer.close()
            if kind is None and self._files:
                whole = self._files[0]
                if len(self._files) > 1:
                    whole = self._folder / "whole.parquet"
                    _merge(self._files, whole, self.kinds)
                whole.replace(self.path)

    def _join(self, kinds: Mapping[str, Kind]) -> None:
        for name, kind in kinds.items():
            known = self.kinds.get(name, kind)
            self.kinds[name] = kind if known == kind else known.join(kind)

    def _grow(self, count: int) -> None:
        self.count += count
        if len(self._singles) + sum(block.rows for block in self._blocks) >= ROWS:
            self._flush()

    def _end_singles(self) -> None:
        """Turn rows that came one by one into columns."""
        rows, self._singles = self._singles, []
        if rows:
            names = dict.fromkeys(name for row in rows for name in row)
            columns: dict[str, Value] = {name: [row.get(name) for row in rows] for name in names}
            self._blocks.append(_Block(len(rows), columns))

    def _flush(self) -> None:
        """Write what has come as a group."""
        self._end_singles()
        blocks, self._blocks = self._blocks, []
        if not blocks:
            return
        if self._writer is None or _stored(self._written) != _stored(self.kinds):
            if self._writer is not None:
                self._writer.close()
            if not self._files:
                stage = tempfile.TemporaryDirectory(prefix=HIDDEN, dir=self.path.parent)
                self._folder = Path(self._stage.enter_context(stage))
            self._files.append(self._folder / f"{len(self._files)}.parquet")
            self._written = dict(self.kinds)
            self._writer = _writer(self._files[-1], self.kinds)
        self._writer.write_table(_table(blocks, self.kinds), row_group_size=ROWS)


class _Block(NamedTuple):
    """So many rows as columns, each an array of numbers or a list of values; some columns may be missing."""

    rows: int
    columns: Mapping[str, Value]


def _merge(files: Iterable[Path], target: Path, kinds: Kinds) -> None:
    """Write the rows of some files to another one, with these columns, which hold all of theirs."""
    from pyarrow import parquet

    with _writer(target, kinds) as writer:
        for path in files:
            with parquet.ParquetFile(path) as file:
                for group in range(file.num_row_groups):
                    table = file.read_row_group(group)
                    columns = {name: table[name].to_pylist() for name in table.column_names}
                    block = _Block(table.num_rows, columns)
                    writer.write_table(_table([block], kinds), row_group_size=ROWS)


def recast(path: Path, kinds: Kinds) -> None:
    """Let a file that is there have these columns, which hold its own."""
    from pyarrow import parquet

    if path.exists() and not parquet.read_schema(path).equals(_schema(kinds), check_metadata=True):
        with tempfile.TemporaryDirectory(prefix=HIDDEN, dir=path.parent) as name:
            again = Path(name) / path.name
            _merge([path], again, kinds)
            again.replace(path)


def differ(kinds: Kinds, others: Kinds) -> bool:
    """Whether files with these columns are different ones."""
    return list(_stored(kinds).items()) != list(_stored(others).items())


def _stored(kinds: Kinds) -> Kinds:
    """The columns as files have them: those without any value are columns of numbers."""
    return {name: Kind(NUMBER, kind.unit) if kind.type == NOTHING else kind for name, kind in kinds.items()}


def described(kinds: Kinds) -> list[dict[str, str]]:
    """The columns for a manifest: name, type, and unit where there is one."""
    return [
        {"name": name, "type": kind.type, **({"unit": kind.unit} if kind.unit else {})}
        for name, kind in _stored(kinds).items()
    ]


def _schema(kinds: Kinds) -> Any:
    import pyarrow as pa

    return pa.schema(
        [
            pa.field(name, _arrow(kind.type), metadata={"unit": kind.unit.encode()} if kind.unit else None)
            for name, kind in _stored(kinds).items()
        ],
    )


def _arrow(type: str) -> Any:
    import pyarrow as pa

    return {TRUTH: pa.bool_(), NUMBER: pa.float64(), TEXT: pa.string()}[type]


def _writer(path: Path, kinds: Kinds) -> Any:
    from pyarrow import parquet

    return parquet.ParquetWriter(path, _schema(kinds), compression="zstd")


def _table(blocks: Iterable[_Block], kinds: Kinds) -> Any:
    """The rows of all blocks, with nothing in cells that they do not have."""
    import pyarrow as pa

    stored, blocks = _stored(kinds), list(blocks)
    return pa.table(
        [
            pa.chunked_array(
                [pa.array(_values(block, name, kind.type), _arrow(kind.type)) for block in blocks]
            )
            for name, kind in stored.items()
        ],
        schema=_schema(kinds),
    )


def _values(block: _Block, name: str, type: str) -> Value:
    """The cells of a column as its type has them."""
    values = block.columns.get(name)
    if values is None:
        return [None] * block.rows
    return [None if value is None else _text(value) for value in values] if type == TEXT else values


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    number = _type(value) == NUMBER
    return orjson.dumps(float(value) if number else value, option=orjson.OPT_SERIALIZE_NUMPY).decode()


def _type(value: Value) -> str:
    """What a column with this value holds."""
    if value is None:
        return NOTHING
    if isinstance(value, bool | np.bool_):
        return TRUTH
    return NUMBER if isinstance(value, int | float | np.number) else TEXT
