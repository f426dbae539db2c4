"""The command `inertia`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rigidcli
from rigidcli.cli.computing import computing

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report


@computing
def inertia(document: Document) -> Report:
    """Mass, centre of mass, inertia tensor about a point."""
    return rigidcli.inertia(document)
