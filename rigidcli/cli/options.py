"""Options that several commands share, and the readers of their values."""

# Annotations here are objects, not texts: commands are made of them.

import csv
import inspect
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, get_origin

import typer

from rigidcli.cli.output import bad_parameter
from rigidcli.errors import UsageError, shown

MORE = "More options"  # the head of the help above the options that few users need
_LINES = Path(__file__).with_name("options.csv").read_text("utf-8").splitlines()[1:]
# How options are spelled, whether few users need them, and their help.
OPTIONS = {key: row for key, *row in csv.reader(_LINES)}


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
    if not settings:
        return []
    from rigidcli.document.draft import split_setting

    with bad_parameter():
        for setting in settings:
            split_setting(setting)
    return settings


def split(text: str | None) -> list[str]:
    """The names between commas."""
    return [name.strip() for name in text.split(",")] if text else []


def read_units(text: str) -> Any:
    """The units in `g,cm,deg`. Raises BadParameter."""
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


def read_jobs(text: str | None) -> int | str | None:
    """The number of processes, or the address of a scheduler. Raises BadParameter."""
    if text is None or (text.startswith(("tcp://", "tls://")) and text.rpartition(":")[2].isdecimal()):
        return text
    return whole(text, other=" (or the scheduler of a Dask cluster, as in `tcp://host:8786`)")


def whole(text: str, most: int = 1024, other: str = "") -> int:
    """The number from 1 to `most` that a text is; no machine has more cores. Raises BadParameter."""
    if text.isdecimal() and 1 <= int(text[:9]) <= most:
        return int(text)
    raise typer.BadParameter(f"read {shown(text)}, expected a number from 1 to {most}{other}")


# --- commands and their options


def command(
    name: str, help: str, kind: Any, run: Callable[[Any], int], changed: Mapping[str, Any] | None = None
) -> Callable[..., None]:
    """A command whose options are the annotated fields of a `kind` of tuple; `run` returns the exit code.

    Fields that are `changed` have another type and default, or None where the command has no such option.
    """
    changed = changed or {}
    options = {
        key: changed.get(key, (type, kind._field_defaults.get(key, inspect.Parameter.empty)))
        for key, type in kind.__annotations__.items()
        if get_origin(type) is Annotated or key in changed
    }

    def function(**given: Any) -> None:
        raise typer.Exit(run(kind(**given)))

    function.__name__, function.__doc__ = name, help
    function.__signature__ = inspect.Signature(  # type: ignore[attr-defined]  # typer reads it
        [
            inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=option[1], annotation=option[0])
            for key, option in options.items()
            if option is not None
        ]
    )
    return function


def option(key: str, **settings: Any) -> Any:
    """The option in this row of options.csv; one that few users need stands under `More options`."""
    spelled, more, help = OPTIONS[key]
    names = [word for word in spelled.split() if word.startswith("-")]
    settings["metavar"] = next((word for word in spelled.split() if word not in names), None)
    return typer.Option(*names, help=help, rich_help_panel=MORE if more else None, **settings)


def format_option(formats: Any) -> Any:
    """The option that chooses one of the members of an enum of formats."""
    help = f"What to print: {', '.join(formats)}."
    return typer.Option("-f", "--format", metavar="FORMAT", help=help, case_sensitive=False)


FILES = "{}. `-` is standard input, `@files.txt` a list of names."  # the help of FILES, with what they may be
_ANY_FILES = FILES.format("Documents, robots or bodies (.stl ...)")
Files = Annotated[list[str], typer.Argument(metavar="FILE", help=_ANY_FILES)]
OutputPath = Annotated[str | None, option("output")]
Settings = Annotated[list[str] | None, option("settings", callback=_check_settings)]
Exact = Annotated[bool, option("exact")]
NoHeader = Annotated[bool, option("no_header")]
Quiet = Annotated[bool, option("quiet")]
