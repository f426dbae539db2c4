"""Text laid out in lines, rows and columns: for a terminal, at whose edge words wrap, or for a file."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import inf
from typing import TypeAlias

Part: TypeAlias = tuple[str, str]
"""A text without line breaks, and its style: one of `STYLES`, or none."""

STYLES = {"bold": 1, "red": 31, "green": 32, "yellow": 33, "magenta": 35}
"""The styles of texts, with their parameters in the sequence SGR of ECMA-48."""

GAP = 2
"""Blanks between columns, and the indent of a body that stands below its heads."""


def cells(text: str) -> int:
    """The columns of a terminal that a text takes: two for wide characters, none for accents on others."""
    if text.isascii():
        return len(text)
    return sum(
        0 if unicodedata.category(c) in ("Mn", "Me", "Cf") else 1 + (unicodedata.east_asian_width(c) in "WF")
        for c in text
    )


@dataclass(frozen=True, slots=True)
class Row:
    """Heads, each in a column of its own, and the lines of a body beside them; words of `prose` may wrap."""

    heads: tuple[Part, ...]
    body: str
    prose: bool = True

    def width(self, room: int) -> int:
        """The columns that its body takes at least: words wrap, and need no more than `room`."""
        whole = max(map(cells, self.body.split("\n")))
        return min(room, whole) if self.prose else whole


class Page:
    """Lines of text: words wrap at the width of a terminal, if there is one, and numbers are never cut."""

    def __init__(self, width: int | None, colour: bool) -> None:
        self._width = width
        self._colour = colour
        self._lines: list[str] = []

    def __str__(self) -> str:
        return "".join(f"{line.rstrip()}\n" for line in self._lines)

    def line(self, *parts: Part) -> None:
        """Write a line, which wraps."""
        text = "".join(text for text, _ in parts)
        styles = [style for text, style in parts for _ in text]
        for start, end in _cuts(text, self._width):
            groups = groupby(range(start, end), styles.__getitem__)
            self._write([("".join(text[place] for place in places), style) for style, places in groups], "")

    def rows(self, rows: Sequence[Row], *, room: int = 0, joint: str = " " * GAP) -> None:
        """Write rows in columns; a body that does not fit, or has no `room` for prose, is below its heads.

        Heads of a body that stands below them are joined by `joint`.
        """
        columns = zip(*(row.heads for row in rows), strict=True)
        widths = [max(cells(text) for text, _ in column) for column in columns]
        left = None if self._width is None else self._width - sum(widths) - GAP * len(widths)
        for row in rows:
            if left is None or row.width(room) <= left:
                heads = row.heads
                for line in _wrapped(row.body, left):
                    padded = [
                        (text + " " * (width - cells(text)), style)
                        for (text, style), width in zip(heads, widths, strict=True)
                    ]
                    self._write([*padded, (line, "")])
                    heads = (("", ""),) * len(heads)
                continue
            first, *others = (part for part in row.heads if part[0])
            self.line(first, *(part for head in others for part in ((joint, ""), head)))
            indent = GAP + len(first[0]) - len(first[0].lstrip())
            body = _wrapped(row.body, (self._width or 0) - indent if row.prose else None)
            self._lines += [" " * indent + line for line in body if row.body]

    def columns(self, columns: Sequence[Sequence[str]]) -> None:
        """Write columns to the right, each under its first text, in as many grids as their widths ask for.

        The first column begins every grid.
        """
        widths = [max(map(cells, column)) for column in columns]
        first = 1
        while first < max(2, len(columns)):
            last, total = first + 1, sum(widths[:1] + widths[first : first + 1]) + GAP
            while last < len(columns) and total + GAP + widths[last] <= (self._width or inf):
                total, last = total + GAP + widths[last], last + 1
            grid = (0, *range(len(columns))[first:last])
            for number, row in enumerate(zip(*columns, strict=True)):
                style = "" if number else "bold"
                texts = [" " * (widths[k] - cells(row[k])) + row[k] for k in grid]
                self._write([(text, style) for text in texts])
            first = last

    def _write(self, parts: Sequence[Part], joint: str = " " * GAP) -> None:
        """Write a line as it is; blanks at the ends of its parts have no style."""
        painted = []
        for text, style in parts:
            word = text.rstrip()
            is_plain = not (self._colour and style and word)
            painted.append(text if is_plain else f"\x1b[{STYLES[style]}m{word}\x1b[0m{text[len(word) :]}")
        self._lines.append(joint.join(painted))


def _wrapped(text: str, width: int | None) -> list[str]:
    """The lines of a text, cut where they are wider than this."""
    return [line[start:end] for line in text.split("\n") for start, end in _cuts(line, width)]


def _cuts(line: str, width: int | None) -> Iterator[tuple[int, int]]:
    """Where pieces of a line no wider than this begin and end: at blanks, or inside of long words."""
    start = 0
    while width is not None and cells(line[start:]) > width:
        end = start + max(1, width)
        while end > start + 1 and cells(line[start:end]) > width:
            end -= 1
        blank = line.rfind(" ", start, end + 1)
        end = blank if line[start : max(start, blank)].strip() else end
        yield start, end
        start = end + len(line[end:]) - len(line[end:].lstrip(" "))
    yield start, len(line)
