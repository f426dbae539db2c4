"""The command `axes`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rigidcli.cli.computing import computing

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report


@computing
def axes(document: Document) -> Report:
    """Principal moments and axes, class of top; L, T and wobble at a given omega."""
    from rigidcli.studies.axes import run

    return run(document)
