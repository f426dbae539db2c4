"""The results of the studies: their names in JSON, and what people see of them. Values are for the studies.

`results.csv` has a row for each result, in the order in which they are shown. A result is added there, and
gets its value in its study. The columns are

    commands   the commands that tell it
    key        its name in JSON
    title      what people see before it; a result without a title is not in their tables
    symbol     its symbol in LaTeX; of a sample in time, the symbol of each column
    unit       its SI unit
    cells      its columns of CSV; behind a colon the place in an array, I12 stands at [0, 1] as `I12:01`
    kind       `counts` for a vector each of whose entries counts by itself, and then has no column in the
               CSV of `precess`; `diagnostic` for what people see only when they ask for more
    means      what it is, beyond its title

Where a row of CSV is a document and not a sample in time, only scalars have cells.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from importlib import resources
from typing import Any

from rigidcli.report import Field, Value


def _read() -> Iterator[tuple[str, Field]]:
    """The rows of the table, each for one command."""
    with resources.files("rigidcli.studies").joinpath("results.csv").open(encoding="utf-8") as table:
        _, *rows = csv.reader(table)
    for commands, key, title, symbol, unit, cells, kind, means in rows:
        places = (cell.partition(":") for cell in cells.split())
        columns = {name: tuple(map(int, place)) for name, _, place in places}
        kinds = kind.split()
        field = Field(
            key, None, title, symbol, unit, columns, "", "counts" in kinds, "diagnostic" in kinds, means
        )
        for command in commands.split():
            yield command, field


_ROWS = tuple(_read())

RESULTS = {
    study: tuple(field for command, field in _ROWS if command == study)
    for study in dict.fromkeys(command for command, _ in _ROWS)
}
"""The results of each study, still without values, by the name of its command."""

_BY_KEY = {(study, field.key): field for study, fields in RESULTS.items() for field in reversed(fields)}


def told(study: str, key: str, value: Value, /, words: str = "", **changes: Any) -> Field:
    """The result of a study with its value, words for it, and what else is different about it this time."""
    field = _BY_KEY[study, key].with_value(value, words)
    for name, change in changes.items():
        setattr(field, name, change)
    return field
