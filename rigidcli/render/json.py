"""One compact JSON object a report, one a line; floats in the shortest text that reads back the same."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import orjson

from rigidcli.core.many import Many
from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Report, Table, Value


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A line for each report, or each of its points in a sweep. Exact numbers are text; `units` is last."""
    for report in reports:
        head: dict[str, Value] = {"schema": report.schema, "name": report.name, "source": report.source}
        if report.swept:
            head["swept"] = {entry.key: plain(entry.value) for entry in report.swept}
        if look.columns:
            report = replace(report, tables=tuple(_asked(table, look) for table in report.tables))
        body = head | plain(report.tree()) | {"units": report.units}
        yield from _lines(body)


def _lines(body: Mapping[str, Value]) -> Iterator[str]:
    """The object on a line; one for each point of a sweep where some of its values are many."""
    columns: list[Sequence[str]] = []

    def hold_place(value: object) -> orjson.Fragment:
        if not isinstance(value, Many):
            raise TypeError
        columns.append(texts_at_points(value))
        return orjson.Fragment(_PLACE)

    text = orjson.dumps(body, hold_place, orjson.OPT_SERIALIZE_NUMPY).decode() + "\n"
    first, *others = text.split(_PLACE)
    if not columns:
        yield text
    for row in zip(*columns, strict=True):
        yield first + "".join(map(operator.add, row, others))


_PLACE = "\0"
"""What stands for a value that is many: no text in JSON has this character as it is."""


def texts_at_points(values: Many) -> list[str]:
    """Floats, or arrays of them, as JSON at each point of a sweep."""
    opened, closed = "[" * values.ndim, "]" * values.ndim
    text = orjson.dumps(np.ascontiguousarray(values.values), option=orjson.OPT_SERIALIZE_NUMPY).decode()
    inside = text.removeprefix("[" + opened).removesuffix(closed + "]")
    return [opened + each + closed for each in inside.split(f"{closed},{opened}")]


def _asked(table: Table, look: Look) -> Table:
    """The quantities of a table of data of which some column is asked for, whole."""
    if not table.data:
        return table
    asked = (column for column in table.columns if set(column.cells) & set(look.columns))
    return replace(table, columns=tuple(asked))
