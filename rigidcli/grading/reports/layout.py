"""Lines for people at a terminal: widths as they are seen, words broken at the edge, colours."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator

from rigidcli.grading.outcome import Verdict

NARROWEST = 30
"""Columns that a column of text must have, else it stands below its head."""

COLOURS: dict[Verdict, int] = {
    "correct": 32,
    "partial": 33,
    "incorrect": 31,
    "invalid": 31,
    "missing": 33,
}
"""ANSI codes: green, yellow, red."""

_BOLD = 1


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
    return next(_pieces(text, max(1, width - 3))) + "..."


def wrapped(text: str, width: int | None) -> Iterator[str]:
    """The lines of a text, broken at blanks, and within words that are longer than a line."""
    if width is None or columns(text) <= width:
        yield text
        return
    line = ""
    for word in text.split():
        if line and columns(line) + 1 + columns(word) <= width:
            line = f"{line} {word}"
            continue
        if line:
            yield line
        *whole, line = _pieces(word, width)
        yield from whole
    yield line


def _pieces(word: str, width: int) -> Iterator[str]:
    """A word in pieces that are no wider than a line."""
    start = taken = 0
    for place, char in enumerate(word):
        taken += _columns(char)
        if taken > width and place > start:
            yield word[start:place]
            start, taken = place, _columns(char)
    yield word[start:]


def beside(head: str, texts: list[str], width: int | None) -> Iterator[str]:
    """A head, and texts each from a new line: beside it, or below it where that leaves too little room."""
    indent = columns(head) + 2
    if width is not None and width - indent < NARROWEST:
        indent = 4
        yield from (f"  {line}" for line in wrapped(head.strip(), width - 2))
    elif not texts:
        yield head.rstrip()
    else:
        first, *texts = texts
        line, *others = wrapped(first, None if width is None else width - indent)
        yield f"{head}  {line}"
        yield from (" " * indent + line for line in others)
    for text in texts:
        for line in wrapped(text, None if width is None else max(1, width - indent)):
            yield " " * indent + line


def painted(line: str, place: int, verdict: Verdict) -> str:
    """A line with the verdict in its colour, if it stands at this place."""
    if not line.startswith(verdict, place):
        return line
    return line[:place] + _in_colour(verdict, COLOURS[verdict]) + line[place + len(verdict) :]


def bold(text: str) -> str:
    """A text in bold letters."""
    return _in_colour(text, _BOLD)


def _in_colour(text: str, code: int) -> str:
    return f"\x1b[{code}m{text}\x1b[0m"


def points(number: float) -> str:
    """A score for people: two decimals at most."""
    return f"{round(number, 2) or number:.12g}"
