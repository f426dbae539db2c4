"""The command `explain`."""

from __future__ import annotations

from typing import Annotated

import typer

from rigidcli.cli.failures import Failures
from rigidcli.cli.output import Output


def explain(
    path: Annotated[
        str | None,
        typer.Argument(
            metavar="PATH", help="A key, shape, unit, function, result or mistake.", show_default=False
        ),
    ] = None,
) -> None:
    """Tell what a key, shape, unit, function, result or mistake is.

    Example: rigidcli explain body.shape.cone
    """
    from rigidcli.reference.index import explain as page
    from rigidcli.reference.index import overview

    failures = Failures()
    with failures.of("explain"), Output(None) as target:
        target.write(overview() if path is None else page(path))
    raise typer.Exit(failures.code)
