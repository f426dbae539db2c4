"""The command `new`."""

from __future__ import annotations

from enum import StrEnum
from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from rigidcli.cli.computing import OutputPath
from rigidcli.cli.output import Output, complain
from rigidcli.errors import Problem, UsageError


class Kind(StrEnum):
    """The starters; each is a file of that name in `rigidcli/starters`."""

    shape = "shape"
    points = "points"
    parts = "parts"
    tensor = "tensor"
    symbols = "symbols"
    motion = "motion"
    free = "free"
    driven = "driven"
    top = "top"
    planet = "planet"
    system = "system"
    assignment = "assignment"
    answers = "answers"


def new(
    kind: Annotated[Kind, typer.Argument(metavar="KIND", help=f"One of {', '.join(Kind)}.")] = Kind.shape,
    output: OutputPath = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file PATH.")] = False,
) -> None:
    """Print a commented document, assignment or answer file to start from."""
    if output is not None and Path(output).is_file() and not force:
        hint = "`--force` overwrites it"
        complain(str(Problem(output, "this file is there already, and is not overwritten", hint=hint)))
        raise typer.Exit(UsageError.exit_code)
    starter = resources.files("rigidcli").joinpath("starters", f"{kind}.yaml")
    with Output(output) as target:
        target.write(starter.read_text(encoding="utf-8"))
