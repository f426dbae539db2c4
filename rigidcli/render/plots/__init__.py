"""Pictures of reports: files that are made with matplotlib, and charts of characters with plotext."""

from __future__ import annotations

from importlib import import_module, util
from pathlib import PurePath

from rigidcli.errors import UsageError
from rigidcli.report import Report

ENDINGS = ("png", "svg", "pdf")
"""The endings of files that pictures can be written to."""

CHARACTERS = "-"
"""What stands for a chart of characters in place of the path to a file."""

LIBRARIES = {"drawing": "matplotlib", "characters": "plotext"}
"""The modules of this package, and the library without which each is of no use."""


def require_ending(path: str) -> None:
    """Raise UsageError unless pictures can be written to files such as this path, or it is CHARACTERS."""
    ending = PurePath(path).suffix.lower().removeprefix(".")
    if path != CHARACTERS and ending not in ENDINGS:
        raise UsageError(
            f"`{path}` is no picture: expected a file .png, .svg or .pdf",
            hint="`-` draws a chart of characters in the terminal",
        )


def require_library(path: str) -> None:
    """Raise UsageError unless what draws for this path is installed."""
    library = LIBRARIES["characters" if path == CHARACTERS else "drawing"]
    if util.find_spec(library) is None:
        raise UsageError(f"{library} is not installed", hint="python -m pip install 'rigidcli[show]'")


def picture_file(report: Report, path: str) -> bytes:
    """The bytes of a file with this ending, with the picture of a report: always the same.

    Raises UsageError without matplotlib.
    """
    require_library(path)
    drawing = import_module("rigidcli.render.plots.drawing")
    data: bytes = drawing.drawn(report, PurePath(path).suffix.lower().removeprefix("."))
    return data


def chart(report: Report, width: int | None) -> str:
    """The picture of a report as text of at most so many columns. Raises UsageError without plotext."""
    require_library(CHARACTERS)
    characters = import_module("rigidcli.render.plots.characters")
    text: str = characters.drawn(report, width)
    return text
