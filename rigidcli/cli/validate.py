"""The command `validate`."""

from __future__ import annotations

import typer

from rigidcli.cli.computing import Exact, Files, Quiet, Settings, documents, tell_notes
from rigidcli.cli.output import Failures, Output
from rigidcli.errors import printable


def validate(files: Files, settings: Settings = None, exact: Exact = False, quiet: Quiet = False) -> None:
    """Read and validate only.

    Prints the names of the files that are valid.
    """
    failures = Failures()
    with Output(None) as target:
        for document in documents(files, failures, exact=exact, settings=settings or ()):
            tell_notes(document.source, document.notes, quiet)
            target.write(f"{printable(document.source)}: valid\n")
    raise typer.Exit(failures.code)
