"""The command `axes`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rigidcli
from rigidcli.cli.computing import computing

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report


@computing
def axes(document: Document) -> Report:
    """Principal moments and axes; motion at a given omega.

    With `motion.omega` also L, T, the angle between omega and L, and whether the body wobbles.
    """
    return rigidcli.axes(document)
