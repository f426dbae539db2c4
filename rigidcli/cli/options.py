"""Options that several commands share, and what is read from them."""

# Annotations here are objects, not texts: commands are made of them.

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from rigidcli.cli.failures import bad_parameter
from rigidcli.cli.output import check_path
from rigidcli.errors import UsageError, shown

MORE = "More options"
"""The head of the help under which the options stand that few users need."""

LIST = "@"
"""What begins the name of a list; `./@name` is a file whose own name begins so."""


def _names_in(file: str) -> list[str]:
    """The names in a list: one on a line, blanks within it included.

    Blanks round a name, empty lines and comments (#) are passed over. `@-` is standard input. Raises
    UsageError.
    """
    name = file.removeprefix(LIST)
    try:
        if name == "-" and sys.stdin is None:
            raise OSError
        data = sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no file has such a name"
        hint = f"it lists names of files, one on a line; a file of this name is `./{file}`"
        raise UsageError(f"`{file}` cannot be read: {reason}", hint=hint) from None
    lines = (os.fsdecode(line).strip() for line in data.removeprefix(b"\xef\xbb\xbf").splitlines())
    names = [line for line in lines if line and not line.startswith("#")]
    if not names:
        raise UsageError(f"`{file}` lists no files", hint="one name on a line")
    return names


def listed(files: Sequence[str]) -> tuple[list[str], list[str]]:
    """FILES, in which `@list.txt` stands for the names in it, and the lists that are read.

    Raises BadParameter.
    """
    lists = [file for file in files if file.startswith(LIST)]
    with bad_parameter():
        names = [name for file in files for name in (_names_in(file) if file in lists else [file])]
    return names, [file.removeprefix(LIST) for file in lists]


def _check_settings(settings: list[str] | None) -> list[str]:
    from rigidcli.document.draft import split_setting

    with bad_parameter():
        for setting in settings or ():
            split_setting(setting)
    return settings or []


def _split(text: str | None) -> list[str]:
    return [name.strip() for name in text.split(",")] if text else []


def read_units(text: str | None) -> Any:
    """The units in `g,cm,deg`. Raises BadParameter."""
    if text is None:
        return {}
    from rigidcli.render import units

    with bad_parameter("--units"):
        return units.read_units(text)


def read_sweep(texts: Sequence[str] | None, pair: bool) -> Any:
    """The sweep that is asked for, if one is. Raises BadParameter."""
    if not texts and not pair:
        return None
    from rigidcli.document import sweeps

    with bad_parameter("--sweep"):
        return sweeps.read_sweep(texts or (), pair)


MOST_JOBS = 1024
"""The most processes: more than any machine has cores for."""


def _read_jobs(text: str | None) -> int | str | None:
    """The number of processes, or the address of a scheduler. Raises BadParameter."""
    if text is None or (text.startswith(("tcp://", "tls://")) and text.rpartition(":")[2].isdecimal()):
        return text
    if text.isdecimal() and 1 <= int(text[:9]) <= MOST_JOBS:
        return int(text)
    problem = f"read {shown(text)}, expected a number of processes from 1 to {MOST_JOBS}"
    raise typer.BadParameter(f"{problem} (or the scheduler of a Dask cluster, as in `tcp://host:8786`)")


Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILE",
        help="Documents, robots, or bodies (.stl ...); `-` is standard input, `@files.txt` a list of names.",
    ),
]
OutputPath = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="PATH", callback=check_path, help="Write to PATH, whole or not at all."
    ),
]
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
Sweeps = Annotated[
    list[str] | None,
    typer.Option(
        "--sweep",
        metavar="KEY=VALUES",
        help="A row for each value: START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column; "
        "two make a grid.",
    ),
]
Pair = Annotated[
    bool,
    typer.Option(
        "--zip", rich_help_panel=MORE, help="Pair the values of several --sweep, instead of a grid."
    ),
]
Jobs = Annotated[
    str | None,
    typer.Option(
        "-j",
        "--jobs",
        metavar="N|ADDRESS",
        callback=_read_jobs,
        rich_help_panel=MORE,
        help="Processes, by default one a core where that pays; or a Dask cluster that you trust, "
        "tcp://host:8786.",
    ),
]
Compare = Annotated[
    bool,
    typer.Option(
        "--compare",
        rich_help_panel=MORE,
        help="FILEs side by side, with differences to the first in percent.",
    ),
]
Digits = Annotated[int, typer.Option(min=1, max=17, metavar="N", help="Significant digits for people.")]
Exact = Annotated[
    bool,
    typer.Option("--exact", help="Exact arithmetic: decimals are rationals, parameters may stay symbols."),
]
UnitList = Annotated[
    str | None,
    typer.Option(metavar="LIST", help="Units for people, such as g,cm,deg,rpm; json and csv stay SI."),
]
UnitHeader = Annotated[
    bool, typer.Option("--unit-header", rich_help_panel=MORE, help="CSV heads with units.")
]
NoHeader = Annotated[
    bool, typer.Option("--no-header", rich_help_panel=MORE, help="CSV without the header row.")
]
Columns = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        callback=_split,
        rich_help_panel=MORE,
        help="Columns of rows or samples, such as t,w1.",
    ),
]
Verbose = Annotated[
    bool, typer.Option("-v", "--verbose", help="Tell residuals, drifts, trusted digits, method, too.")
]
Steps = Annotated[bool, typer.Option("--steps", help="Show the working, to people.")]
Standalone = Annotated[
    bool, typer.Option("--standalone", rich_help_panel=MORE, help="LaTeX that compiles by itself.")
]
PlotPath = Annotated[
    str | None,
    typer.Option(
        "--plot",
        metavar="PATH",
        callback=check_path,
        help="Write a picture, .png, .svg or .pdf; `-` draws a chart of characters. Needs the extra `show`.",
    ),
]


def plot_kind(kinds: Sequence[str]) -> Any:
    """The option that chooses one of these kinds of pictures."""
    help = f"The picture: {', '.join(kinds)}; by default the first that there is something for."
    return Annotated[str | None, typer.Option("--plot-kind", metavar="NAME", rich_help_panel=MORE, help=help)]


Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No notes on standard error.")]

Samples = Annotated[int | None, typer.Option(metavar="N", help="Number of samples (default 1001).")]
Duration = Annotated[str | None, typer.Option(metavar="TIME", help='End of the motion, as in "5 min".')]
OF_MOTIONS = {"samples": Samples, "duration": Duration}
"""Options of the studies that follow a motion: they set values of its section."""
