"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from rigidcli.cli.failures import bad_parameter
from rigidcli.cli.output import check_path

if TYPE_CHECKING:
    from rigidcli.render.units import Units


def listed(files: Sequence[str]) -> tuple[list[str], list[str]]:
    """FILES, in which `@list.txt` stands for the names in it, and the lists that are read.

    Raises BadParameter.
    """
    from rigidcli.cli.lists import LIST, names_in

    with bad_parameter():
        names = [name for file in files for name in names_in(file)]
    return names, [file.removeprefix(LIST) for file in files if file.startswith(LIST)]


Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILE",
        help="Documents, robots, or bodies (.stl ...); `-` is standard input, `@files.txt` a list of names.",
    ),
]


def _check_settings(settings: list[str] | None) -> list[str]:
    from rigidcli.document.settings import split_setting

    with bad_parameter():
        for setting in settings or ():
            split_setting(setting)
    return settings or []


Settings = Annotated[
    list[str] | None,
    typer.Option(
        "-s",
        "--set",
        metavar="KEY=VALUE",
        callback=_check_settings,
        help="Override a value, such as body.mass=3; repeatable.",
    ),
]

Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No notes on standard error.")]

OutputPath = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="PATH", callback=check_path, help="Write to PATH, whole or not at all."
    ),
]

NoHeader = Annotated[bool, typer.Option("--no-header", help="CSV without the header row.")]

Exact = Annotated[
    bool,
    typer.Option("--exact", help="Exact arithmetic: decimals are rationals, parameters may stay symbols."),
]


def read_units_option(text: str | None) -> Units:
    """The units in `g,cm,deg`; refused where one is unknown."""
    if text is None:
        return {}
    from rigidcli.render.units import read_units

    with bad_parameter("--units"):
        return read_units(text)


def _split(text: str | None) -> list[str]:
    return [name.strip() for name in text.split(",")] if text else []


Samples = Annotated[int | None, typer.Option(metavar="N", help="Number of samples (default 1001).")]

Duration = Annotated[str | None, typer.Option(metavar="TIME", help='End of the motion, as in "5 min".')]

Columns = Annotated[
    str | None,
    typer.Option(metavar="NAMES", callback=_split, help="Columns of rows or samples, such as t,w1."),
]
