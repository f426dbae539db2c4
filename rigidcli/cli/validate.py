"""The command `validate`."""

from __future__ import annotations

import typer

from rigidcli.cli.computing import Exact, Files, Quiet, Settings
from rigidcli.cli.output import Failures, Output, complain


def validate(files: Files, settings: Settings = None, exact: Exact = False, quiet: Quiet = False) -> None:
    """Read and validate only; print the names of the files that are valid."""
    from rigidcli.model.load import load

    failures = Failures()
    with Output(None) as target:
        for file in files:
            with failures.of(file):
                document = load(file, exact=exact, settings=settings or ())
                if not quiet:
                    for note in document.notes:
                        complain(f"{file}: note: {note}")
                target.write(f"{file}: valid\n")
    raise typer.Exit(failures.code)
