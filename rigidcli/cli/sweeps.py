"""`--sweep`, `--zip` and `--jobs`: what is asked of a sweep, and what of it is told once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from rigidcli.cli.failures import bad_parameter
from rigidcli.render import PEOPLE, PROGRAMS, Format

if TYPE_CHECKING:
    from rigidcli.document.sweeps import Sweep

Sweeps = Annotated[
    list[str] | None,
    typer.Option(
        "--sweep",
        metavar="KEY=VALUES",
        help="A row for each value: START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column; "
        "two make a grid.",
    ),
]
Jobs = Annotated[
    str | None,
    typer.Option(
        "-j",
        "--jobs",
        metavar="N|ADDRESS",
        help="Processes, by default one a core where that pays; or a Dask cluster that you trust, "
        "tcp://host:8786.",
    ),
]
Pair = Annotated[bool, typer.Option("--zip", help="Pair the values of several --sweep, instead of a grid.")]


def asked(texts: list[str] | None, pair: bool) -> Sweep | None:
    """The sweep that is asked for, if one is. Raises BadParameter."""
    if not texts and not pair:
        return None
    from rigidcli.document.sweeps import read_sweep

    with bad_parameter("--sweep"):
        return read_sweep(texts or (), pair)


MANY = 500
"""Values or FILES from which on processes pay, of which each core gets one unless `--jobs` says otherwise."""


def hands(text: str | None, total: int, alone: bool) -> int | str:
    """How many processes work at so many answers, or the address of a cluster. Raises BadParameter.

    Where only this process has the standard input, it works `alone`.
    """
    from rigidcli.cli.plan import usable_cores

    given = named_hands(text)
    return 1 if alone else given or (usable_cores() if total >= MANY else 1)


def named_hands(text: str | None) -> int | str | None:
    """What stands after `--jobs`: so many processes, or the address of a cluster. Raises BadParameter."""
    from rigidcli.cli.plan import read_jobs

    with bad_parameter("--jobs"):
        return read_jobs(text)


MOST_SHOWN = 100_000
"""The most rows of a table for people, which is kept whole until its columns are known."""


def require_sweepable(format: Format, options: Mapping[str, bool], count: int) -> None:
    """Raise BadParameter where a sweep has no such output."""
    problem = next(
        (f"{name} is for one document, not for a sweep" for name in options if options[name]), None
    )
    if format in PROGRAMS:
        problem = f"a program in {format} is that of one document, not of a sweep"
    elif format in PEOPLE and count > MOST_SHOWN:
        problem = f"a table of {count:,} rows is too long to read: `-f csv` streams them"
    if problem:
        raise typer.BadParameter(problem, param_hint="'--sweep'")


class Known:
    """Notes that were told: at each value of a sweep they are mostly the same."""

    MOST = 1000
    """The most notes that are kept, which is more than anybody reads."""

    def __init__(self) -> None:
        self._told = set[str]()

    def new(self, notes: Sequence[str]) -> list[str]:
        """Those that were not told yet; none, when very many were."""
        new = [note for note in notes if note not in self._told]
        new = new[: self.MOST - len(self._told)]
        self._told.update(new)
        return new
