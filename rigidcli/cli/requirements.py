"""What a document and the report on it must have, that the answer can be given and written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rigidcli.errors import UsageError
from rigidcli.report import Report

if TYPE_CHECKING:
    from rigidcli.document.document import Document

NEEDS = {
    "inertia": ("body",),
    "axes": ("body",),
    "precess": ("top", "body", "tide"),
    "euler": ("body", "top"),
    "hamilton": ("system",),
}
"""The sections of a document of which each command needs one."""


def require_fitting(document: Document, command: str) -> None:
    """Raise DocumentError for a document that is for another command, which is named."""
    if any(getattr(document, section) is not None for section in NEEDS[command]):
        return
    for other, sections in NEEDS.items():
        for section in sections:
            if getattr(document, section) is not None:
                hint = f"this document has a `{section}`: `rigidcli {other} {document.source}`"
                raise document.refusal(f"missing: `{command}` needs it", NEEDS[command][0], hint=hint)


def require_columns(report: Report, names: Sequence[str], in_rows: Sequence[str] | None) -> None:
    """Raise UsageError unless what is written of the report has the columns of these names.

    Where `in_rows` is not None, reports of a sweep, whose keys it has, and those without data are rows.
    """
    if not names:
        return
    known = [name for table in report.tables if table.data for each in table.columns for name in each.cells]
    if in_rows or (in_rows is not None and not known):
        from rigidcli.render.csv import row_of

        known = [*in_rows, *row_of(report)]
    if not known:
        hint = "`-f csv` has results as a row, of which they can be chosen"
        raise UsageError("there are no samples here to choose columns of", hint=hint)
    for name in names:
        if name not in known:
            raise UsageError(f"`{name}` is no column here", hint=f"the columns are {', '.join(known)}")


def require_memory(report: Report) -> None:
    """Raise ComputationError unless there is enough for the whole text of the tables."""
    from rigidcli.core.memory import ITS_TEXT, require

    for table in report.tables:
        require(len(table), sum(len(column.cells) for column in table.columns), ITS_TEXT)
