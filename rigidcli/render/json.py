"""A line with a JSON object for each report; a float is the shortest text that reads back the same."""

from __future__ import annotations

from dataclasses import replace

import orjson

from rigidcli.core.memory import BYTES_OF_ITS_TEXT, require
from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Report, Table, Value


def piece(report: Report, look: Look) -> str:
    """The line of a report. Exact numbers are text; `units` is last.

    Raises ComputationError where there is too little memory for the whole text.
    """
    for table in report.tables:
        require(len(table), sum(len(column.cells) for column in table.columns), BYTES_OF_ITS_TEXT)
    head: dict[str, Value] = {"schema": report.schema, "name": report.name, "source": report.source}
    if report.swept:
        head["swept"] = {entry.key: entry.value for entry in report.swept}
    if look.columns:
        report = replace(report, tables=tuple(_asked(table, look) for table in report.tables))
    body = head | report.tree | {"units": report.units}
    return orjson.dumps(body, default=plain, option=orjson.OPT_SERIALIZE_NUMPY).decode() + "\n"


def _asked(table: Table, look: Look) -> Table:
    """A table of data with the quantities that have at least one column in the look."""
    asked = (column for column in table.columns if {*column.cells} & {*look.columns})
    return replace(table, columns=tuple(asked)) if table.data else table
