"""Options that several commands share, and the readers of their values."""

# Annotations here are objects, not texts: commands are made of them.

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from rigidcli.cli.failures import bad_parameter
from rigidcli.cli.output import check_path
from rigidcli.errors import UsageError, shown

MORE = "More options"
"""The head of the help above the options that few users need."""


def listed(files: Sequence[str]) -> tuple[list[str], list[str]]:
    """FILES with the names in each `@list.txt` instead of the list, and the names of the lists.

    Raises BadParameter.
    """
    lists = [file.removeprefix("@") for file in files if file.startswith("@")]
    with bad_parameter():
        names = [name for file in files for name in (_names_in(file) if file.startswith("@") else [file])]
    return names, lists


def _names_in(file: str) -> list[str]:
    """The names in a list, one on a line; `@-` is standard input. Raises UsageError.

    Blanks round a name, empty lines and comments (#) are ignored; blanks within a name belong to it.
    """
    name = file.removeprefix("@")
    try:
        data = sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    except (OSError, ValueError, AttributeError) as error:  # a closed standard input is None
        reason = getattr(error, "strerror", None) or "no file has such a name"
        hint = f"it lists names of files, one on a line; a file of this name is `./{file}`"
        raise UsageError(f"`{file}` cannot be read: {reason}", hint=hint) from None
    lines = (os.fsdecode(line).strip() for line in data.removeprefix(b"\xef\xbb\xbf").splitlines())
    if not (names := [line for line in lines if line and not line.startswith("#")]):
        raise UsageError(f"`{file}` lists no files", hint="one name on a line")
    return names


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
    """The sweep of these texts; None without any. Raises BadParameter."""
    if not texts and not pair:
        return None
    from rigidcli.document import sweeps

    with bad_parameter("--sweep"):
        return sweeps.read_sweep(texts or (), pair)


def _read_jobs(text: str | None) -> int | str | None:
    """The number of processes, or the address of a scheduler. Raises BadParameter."""
    if text is None or (text.startswith(("tcp://", "tls://")) and text.rpartition(":")[2].isdecimal()):
        return text
    return whole(text, other=" (or the scheduler of a Dask cluster, as in `tcp://host:8786`)")


def whole(text: str, most: int = 1024, other: str = "") -> int:
    """The number from 1 to `most` that a text is; no machine has more cores. Raises BadParameter."""
    if text.isdecimal() and 1 <= int(text[:9]) <= most:
        return int(text)
    raise typer.BadParameter(f"read {shown(text)}, expected a number from 1 to {most}{other}")


def _option(help: str, *names: str, more: bool = False, **settings: Any) -> Any:
    """An option of typer; one that few users need stands under `More options`."""
    return typer.Option(*names, help=help, rich_help_panel=MORE if more else None, **settings)


Files = Annotated[
    list[str],
    typer.Argument(
        metavar="FILE",
        help="Documents, robots or bodies (.stl ...). `-` is standard input, `@files.txt` a list of names.",
    ),
]
OutputPath = Annotated[
    str | None,
    _option(
        "Write to PATH. After an error it is as it was before.",
        "-o",
        "--output",
        metavar="PATH",
        callback=check_path,
    ),
]
Settings = Annotated[
    list[str] | None,
    _option(
        "Set a value, such as body.mass=3. Repeat it for several.",
        *("-s", "--set"),
        metavar="KEY=VALUE",
        callback=_check_settings,
    ),
]
Sweeps = Annotated[
    list[str] | None,
    _option(
        "Make a row for each value: START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column. "
        "Two sweeps make a grid.",
        "--sweep",
        metavar="KEY=VALUES",
    ),
]
Pair = Annotated[bool, _option("Pair the values of several sweeps, instead of a grid.", "--zip", more=True)]
Jobs = Annotated[
    str | None,
    _option(
        "Number of processes (by default one for each core, if that saves time); or a Dask cluster "
        "that you trust, tcp://host:8786.",
        *("-j", "--jobs"),
        metavar="N|ADDRESS",
        callback=_read_jobs,
        more=True,
    ),
]
Compare = Annotated[
    bool,
    _option("Show the FILEs side by side, with differences to the first in percent.", "--compare", more=True),
]
Digits = Annotated[
    int,
    _option(
        "Significant digits in table, latex and html, 1 to 17.",
        metavar="N",
        parser=lambda text: whole(text, 17),
    ),
]
Exact = Annotated[
    bool, _option("Exact arithmetic: decimals become fractions, and parameters may stay letters.", "--exact")
]
UnitList = Annotated[
    str | None,
    _option(
        "Units in table, latex and html, such as g,cm,deg,rpm. json and csv keep SI units.",
        metavar="LIST",
    ),
]
UnitHeader = Annotated[bool, _option("Write units into the header of csv.", "--unit-header", more=True)]
NoHeader = Annotated[bool, _option("Write csv without its header.", "--no-header", more=True)]
Columns = Annotated[
    str | None,
    _option("Show only these columns, such as t,w1.", metavar="NAMES", callback=_split, more=True),
]
Verbose = Annotated[
    bool, _option("Also show residuals, drifts, trusted digits and the method.", "-v", "--verbose")
]
Steps = Annotated[bool, _option("Show the working, in table, latex and html.", "--steps")]
Standalone = Annotated[bool, _option("Write LaTeX that compiles by itself.", "--standalone", more=True)]
PlotPath = Annotated[
    str | None,
    _option(
        "Write a picture: .png, .svg or .pdf. `-` draws it in the terminal. It needs the extra `show`.",
        "--plot",
        metavar="PATH",
        callback=check_path,
    ),
]
Quiet = Annotated[bool, _option("Print no notes.", "-q", "--quiet")]


Samples = Annotated[int | None, _option("Number of samples (default 1001).", metavar="N")]
Duration = Annotated[str | None, _option('End of the motion, as in "5 min".', metavar="TIME")]


def format_option(formats: Any) -> Any:
    """The option that chooses one of the members of an enum of formats."""
    listed = ", ".join(formats)
    help = f"What to print: {listed}."
    return typer.Option("-f", "--format", metavar="FORMAT", help=help, case_sensitive=False)


def plot_kind(kinds: Iterable[str]) -> Any:
    """The option that chooses one of these kinds of pictures."""
    help = f"Choose the picture: {', '.join(kinds)}. By default it is the first that the result has."
    return Annotated[str | None, _option(help, "--plot-kind", metavar="NAME", more=True)]
