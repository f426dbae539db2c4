"""The results of the studies: names in JSON, titles, symbols and units. The studies give the values.

`results.csv` has a row for each result, in the order in which they are shown. A result is added there, and
gets its value in its study. The columns are

    commands   the commands that have it
    key        the name in JSON
    title      the title in tables for people, which leave out results without a title
    symbol     the symbol in LaTeX; for a sample in time, the symbol of each column
    unit       the SI unit
    cells      the columns of CSV; behind a colon the place in an array: `I12:01` is the entry [0, 1]
    kind       `counts` for a vector whose small entries are no rounding; it has no column in the CSV of
               `precess`; `diagnostic` for results that people see with `-v` only
    means      the meaning, where the title does not say it

Where a row of CSV is a document and not a sample in time, only scalars have cells.
"""

from __future__ import annotations

import csv
from importlib import resources
from typing import Any

from rigidcli.report import Field, Value


def _read() -> dict[str, dict[str, Field]]:
    """The results of each command by their keys, still without values."""
    with resources.files("rigidcli.studies").joinpath("results.csv").open(encoding="utf-8") as table:
        _, *rows = csv.reader(table)
    results: dict[str, dict[str, Field]] = {}
    for commands, key, title, symbol, unit, cells, kind, means in rows:
        places = (cell.partition(":") for cell in cells.split())
        columns = {name: tuple(map(int, place)) for name, _, place in places}
        field = Field(
            key, None, title, symbol, unit, columns, "", "counts" in kind, "diagnostic" in kind, means
        )
        for command in commands.split():
            results.setdefault(command, {})[key] = field
    return results


_BY_KEY = _read()

RESULTS = {study: tuple(fields.values()) for study, fields in _BY_KEY.items()}
"""The results of each study, still without values, by the name of its command."""


def field_of(study: str, key: str, value: Value, /, words: str = "", **changes: Any) -> Field:
    """The field of a result by results.csv, with its value, words for it, and `changes` of the field."""
    field = _BY_KEY[study][key].with_value(value, words)
    for name, change in changes.items():
        setattr(field, name, change)
    return field


def celled(key: str, value: Value, title: str = "", symbol: str = "", **changes: Any) -> Field:
    """The field of a result whose key has a name of the document in it, which is its cell of CSV, too."""
    return Field(key, value, title, symbol, cells={key: ()}, **changes)
