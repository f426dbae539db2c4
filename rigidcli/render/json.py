"""One compact JSON object a report, one a line; floats in the shortest text that reads back the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import orjson

from rigidcli.render import Look
from rigidcli.render.values import plain
from rigidcli.report import Report


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A line for each report; exact numbers are text in the expression language."""
    for report in reports:
        head = {"schema": report.schema, "name": report.name, "source": report.source}
        yield orjson.dumps(head | plain(report.tree()), option=orjson.OPT_SERIALIZE_NUMPY).decode() + "\n"
