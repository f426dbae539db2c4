"""A line with a JSON object for each report; a float is the shortest text that reads back the same."""

from __future__ import annotations

from dataclasses import replace

import orjson

from rigidcli.core.memory import BYTES_OF_ITS_TEXT, require
from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Report, Value


def piece(report: Report, look: Look) -> str:
    """The line of a report. Exact numbers are text; `units` is last.

    Raises ComputationError where there is too little memory for the whole text.
    """
    for table in report.tables:
        require(len(table), sum(len(column.cells) for column in table.columns), BYTES_OF_ITS_TEXT)
    head: dict[str, Value] = {"schema": report.schema, "name": report.name, "source": report.source}
    if report.swept:
        head["swept"] = {entry.key: entry.value for entry in report.swept}
    if look.columns and (data := report.data) is not None:
        # The quantities that have at least one of the columns.
        asked = tuple(column for column in data.columns if {*column.cells} & {*look.columns})
        tables = (replace(data, columns=asked) if table is data else table for table in report.tables)
        report = replace(report, tables=tuple(tables))
    body = head | report.tree | {"units": report.units}
    return orjson.dumps(body, default=plain, option=orjson.OPT_SERIALIZE_NUMPY).decode() + "\n"
