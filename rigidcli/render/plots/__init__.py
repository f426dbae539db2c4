"""Pictures of reports: files that are made with matplotlib, and charts of characters with plotext."""

from __future__ import annotations

from html import escape
from importlib import util
from pathlib import PurePath
from urllib.parse import quote

from rigidcli.errors import UsageError, printable
from rigidcli.report import Report

ENDINGS = ("png", "svg", "pdf")  # the endings of files that pictures can be written to
CHARACTERS = "-"  # the path that asks for a chart of characters in place of a file
# The libraries of the extra `show` by their use; `drawing` and `characters` are modules of this package.
LIBRARIES = {"drawing": "matplotlib", "characters": "plotext", "formulas": "latex2mathml"}


def require_ending(path: str) -> None:
    """Raise UsageError unless pictures can be written to files such as this path."""
    if PurePath(path).suffix.lower().removeprefix(".") not in ENDINGS:
        problem = f"`{path}` is no picture: expected a file .png, .svg or .pdf"
        raise UsageError(problem, hint="`--plot -` draws a chart of characters in the terminal")


def has_library(use: str) -> bool:
    """Whether the library for this use is installed."""
    return util.find_spec(LIBRARIES[use]) is not None


def require_library(use: str) -> None:
    """Raise UsageError unless the library for this use is installed."""
    if not has_library(use):
        raise UsageError(f"{LIBRARIES[use]} is not installed", hint="python -m pip install 'rigidcli[show]'")


def picture_file(report: Report, path: str, *, is_clear: bool = False) -> bytes:
    """The bytes of a file with this ending, with the picture of a report, on white ground unless it is clear.

    They are always the same. Raises UsageError without matplotlib.
    """
    require_library("drawing")
    from rigidcli.render.plots.drawing import drawn

    return drawn(report, PurePath(path).suffix.lower().removeprefix("."), is_clear=is_clear)


def inline_picture(report: Report) -> str:
    """The picture of a report as an element of HTML, with its title for readers who cannot see it."""
    svg = b" ".join(picture_file(report, "picture.svg", is_clear=True).split())
    source = quote(svg, safe=" !'()*+,/:;<=>?@[]{}|$")
    title = escape(printable(report.about(report.pictures[0].title)))
    return f'<img src="data:image/svg+xml,{source}" alt="{title}">'


def chart(report: Report, width: int | None) -> str:
    """The picture of a report as text of at most `width` columns. Raises UsageError without plotext."""
    require_library("characters")
    from rigidcli.render.plots.characters import drawn

    return drawn(report, width)
