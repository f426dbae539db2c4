"""The command `precess`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rigidcli
from rigidcli.cli.computing import computing

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report


@computing
def precess(document: Document) -> Report:
    """Precession: tops under gravity, free, tidal.

    Of a `top`, of a `body` with `motion.omega`, of a planet with a `tide`: whichever there are.
    """
    return rigidcli.precess(document)
