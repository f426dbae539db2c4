"""One row a report, with one header; floats in the shortest text that reads back the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import orjson

from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Report, Value


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """The header before the first row; what is not known is an empty cell."""
    header = look.header
    for report in reports:
        fields = [entry for entry in report.fields if entry.cells]
        row: dict[str, Value] = {"name": report.name}
        for entry in fields:
            row |= {column: _at(entry.value, place) for column, place in entry.cells.items()}
        lines = [list(row)] if header else []
        header = False
        yield "".join(",".join(map(_cell, line)) + "\n" for line in [*lines, list(row.values())])


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
