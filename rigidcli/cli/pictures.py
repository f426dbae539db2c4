"""`--plot` and `--plot-kind`: the picture that is asked for, and where it goes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidcli.cli.failures import bad_parameter, complain
from rigidcli.cli.output import Output, check_path, require_apart, write_whole
from rigidcli.errors import UsageError
from rigidcli.render import Format

if TYPE_CHECKING:
    from rigidcli.report import Report

PlotPath = Annotated[
    str | None,
    typer.Option(
        "--plot",
        metavar="PATH",
        callback=check_path,
        help="Write a picture, .png, .svg or .pdf; `-` draws a chart of characters. Needs the extra `show`.",
    ),
]
PlotKind = Annotated[
    str | None, typer.Option("--plot-kind", metavar="NAME", help="Another picture than the first.")
]


def picture_kind(
    command: str,
    format: Format,
    path: str | None,
    kind: str | None,
    files: Sequence[str],
    output: str | None,
) -> str | None:
    """The kind of picture that is asked for, if one is; refused where it cannot be drawn or written."""
    if path is None and kind is None and format is not Format.html:
        return None
    from rigidcli.render.plots import CHARACTERS, require_ending, require_library, use_for
    from rigidcli.studies.pictures import ANY, BEST, require_kind

    with bad_parameter("--plot"):
        require_kind(command, kind or BEST)
        if path is None:
            if format is Format.html:
                return kind or ANY
            raise UsageError("`--plot-kind` chooses a picture", hint="say with `--plot` where it goes")
        require_ending(path)
        if len(files) > 1:
            raise UsageError("`--plot` draws one picture, of one FILE", hint="call it for each FILE")
        require_apart(path, files)
        if path != CHARACTERS and output is not None and Path(path).resolve() == Path(output).resolve():
            raise UsageError(f"`-o` writes the results to `{path}`", hint="give the picture another name")
        require_library(use_for(path))
    return kind or BEST


def write_picture(report: Report, path: str, width: int | None, target: Output | None) -> None:
    """Write the picture of a report to a file; a chart of characters to the target, or standard error."""
    from rigidcli.render.plots import CHARACTERS, chart, picture_file

    if path != CHARACTERS:
        write_whole(path, picture_file(report, path))
    elif target is not None:
        target.write(chart(report, width))
    else:
        complain(chart(report, None).rstrip("\n"))
