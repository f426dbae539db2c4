"""The command `validate`."""

from __future__ import annotations

import typer

from rigidcli.cli.computing import Exact, Files, Quiet, Settings
from rigidcli.cli.output import Failures, Output, complain
from rigidcli.errors import Problem, printable


def validate(files: Files, settings: Settings = None, exact: Exact = False, quiet: Quiet = False) -> None:
    """Read and validate only.

    Prints the names of the files that are valid.
    """
    from rigidcli.model.load import load

    failures = Failures()
    with Output(None) as target:
        for file in files:
            with failures.of(file):
                document = load(file, exact=exact, settings=settings or ())
                if not quiet:
                    for note in document.notes:
                        complain(str(Problem(document.source, f"note: {note}")))
                target.write(f"{printable(document.source)}: valid\n")
    raise typer.Exit(failures.code)
