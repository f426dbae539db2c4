"""Blocks of lines for people: rows beside their heads, in a file or pipe, and on a terminal through rich."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from rigidcli.grading.outcome import VERDICTS, Verdict
from rigidcli.grading.reports import Style
from rigidcli.render.terminal import GAP, Page, Part, Row

NARROWEST = 30
"""Columns that remarks must have beside their heads on a terminal; otherwise they stand below them."""

COLOURS: dict[Verdict, str] = {
    "correct": "green",
    "partial": "yellow",
    "incorrect": "red",
    "invalid": "red",
    "missing": "yellow",
}
"""The colours of verdicts on a terminal; `review` has that of the text."""

_VERDICT = max(map(len, VERDICTS))


def block(head: Sequence[Part], rows: Sequence[Row], style: Style) -> str:
    """A line, unless `head` is empty, and rows below it."""
    if style.width is not None:
        page = Page(style.width, style.colour)
        if head:
            page.line(*head)
        page.rows(rows, room=NARROWEST)
        return str(page)
    lines = ["".join(text for text, _ in head)] if head else []
    for row in rows:
        left = (" " * GAP).join(text for text, _ in row.heads)
        first, *others = row.body.split("\n")
        lines.append(f"{left}{' ' * GAP}{first}".rstrip())
        lines += (" " * (columns(left) + GAP) + line for line in others)
    return "".join(f"{line}\n" for line in lines)


def painted(verdict: Verdict) -> Part:
    """A verdict in its colour, as wide as the longest one."""
    return f"{verdict:{_VERDICT}}", COLOURS.get(verdict, "")


def columns(text: str) -> int:
    """The columns of a terminal that a text takes: two for wide characters, none for accents on others."""
    if text.isascii():
        return len(text)
    return sum(map(_columns, text))


def _columns(char: str) -> int:
    if unicodedata.combining(char) or unicodedata.category(char) in ("Mn", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(char) in "WF" else 1


def padded(text: str, width: int) -> str:
    """`text` with blanks after it."""
    return text + " " * (width - columns(text))


def shortened(text: str, width: int) -> str:
    """`text`, or as much of its beginning as there is room for."""
    if columns(text) <= width:
        return text
    end = taken = 0
    while taken + _columns(text[end]) <= width - 3:
        taken, end = taken + _columns(text[end]), end + 1
    return text[:end] + "..."


def points(number: float) -> str:
    """A score for people: two decimals at most."""
    return f"{round(number, 2) or number:.12g}"
