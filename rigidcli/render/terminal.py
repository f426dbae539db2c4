"""Text for a terminal: lines, rows and columns laid out by rich, which this module alone loads."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

Part: TypeAlias = tuple[str, str]
"""A text without line breaks, and its style: `bold`, a colour, or none."""

GAP = 2
"""Blanks between columns, and by which a body that stands below its heads is indented."""


def cells(text: str) -> int:
    """The columns of a terminal that a text takes: two for wide characters, none for accents on others."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)


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
    """The text for a terminal of a given width, in which words wrap at the edge and numbers are never cut."""

    def __init__(self, width: int, colour: bool) -> None:
        self._width = width
        self._colour = colour
        self._target = io.StringIO()

    def __str__(self) -> str:
        return "".join(line.rstrip() + "\n" for line in self._target.getvalue().splitlines())

    def line(self, *parts: Part) -> None:
        """Write a line."""
        from rich.text import Text

        self._print(Text.assemble(*map(self._text, parts)))

    def rows(self, rows: Sequence[Row], *, room: int = 0, joint: str = " " * GAP) -> None:
        """Write rows in columns; a body that does not fit, or has no `room` for prose, is below its heads.

        Heads of a body that stands below them are joined by `joint`.
        """
        from rich.padding import Padding
        from rich.table import Table
        from rich.text import Text

        columns = zip(*(row.heads for row in rows), strict=True)
        widths = [max(cells(text) for text, _ in column) for column in columns]
        left = self._width - sum(widths) - GAP * len(widths)
        for fits, group in groupby(rows, lambda row: row.width(room) <= left):
            if fits:
                grid = Table.grid(padding=(0, GAP))
                for width in (*widths, max(1, left)):
                    grid.add_column(width=width)
                for row in group:
                    grid.add_row(*map(self._text, row.heads), Text(row.body))
                self._print(grid)
                continue
            for row in group:
                first, *others = (part for part in row.heads if part[0])
                self.line(first, *(part for head in others for part in ((joint, ""), head)))
                indent = GAP + len(first[0]) - len(first[0].lstrip())
                if row.prose and row.body:
                    self._print(Padding(Text(row.body), (0, 0, 0, indent)))
                elif row.body:
                    self._print(Text(textwrap.indent(row.body, " " * indent)), wrap=False)

    def columns(self, columns: Sequence[Sequence[str]]) -> None:
        """Write columns to the right, each under its first text, in as many grids as their widths ask for.

        The first column begins every grid.
        """
        from rich.table import Table

        widths = [max(map(cells, column)) + GAP for column in columns]
        first = 1
        while first < max(2, len(columns)):
            last, total = first + 1, sum(widths[:1] + widths[first : first + 1])
            while last < len(columns) and total + widths[last] - GAP <= self._width:
                total, last = total + widths[last], last + 1
            chosen = [columns[0], *columns[first:last]]
            grid = Table.grid(*("" for _ in chosen), padding=(0, GAP))
            for column in grid.columns:
                column.justify, column.no_wrap = "right", True
            for number, texts in enumerate(zip(*chosen, strict=True)):
                grid.add_row(*(self._text((text, "" if number else "bold")) for text in texts))
            self._print(grid, width=total)
            first = last

    def _text(self, part: Part) -> Text:
        from rich.text import Text

        text, style = part[0], part[1] if self._colour else ""
        word = text.rstrip()
        # Blanks after the word that align a column are in no style, so that a line can end without them.
        return Text(text, style=style) if word == text else Text.assemble((word, style), text[len(word) :])

    def _print(self, what: RenderableType, *, wrap: bool = True, width: int = 0) -> None:
        from rich.console import Console

        console = Console(
            file=self._target,
            width=max(width, self._width),
            force_terminal=self._colour,
            color_system="standard" if self._colour else None,
            legacy_windows=False,
        )
        console.print(what, soft_wrap=not wrap)
