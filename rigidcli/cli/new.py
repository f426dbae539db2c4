"""The command `new`."""

from __future__ import annotations

from enum import StrEnum
from importlib import resources
from typing import Annotated

import typer

from rigidcli.cli.computing import OutputPath
from rigidcli.cli.output import Output


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


def new(
    kind: Annotated[Kind, typer.Argument(metavar="KIND", help=f"One of {', '.join(Kind)}.")] = Kind.shape,
    output: OutputPath = None,
) -> None:
    """Print a commented document to start from."""
    starter = resources.files("rigidcli").joinpath("starters", f"{kind}.yaml")
    with Output(output) as target:
        target.write(starter.read_text(encoding="utf-8"))
