"""Text laid out in lines, rows and columns: for a terminal, at whose edge words wrap, or for a file.

This module alone loads rich, which knows terminals: where words wrap, how wide they are, and colours. A file
or a pipe does not wait for it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from math import inf
from typing import NamedTuple, TypeAlias

Part: TypeAlias = tuple[str, str]  # a text without line breaks, and its style: `bold`, a colour, or none
GAP = 2  # blanks between columns, and the indent of a body that stands below its heads


def cells(text: str) -> int:
    """The columns of a terminal that a text takes: two for wide characters, none for accents on others."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)


class TextRow(NamedTuple):
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
        if self._width is None:
            self._lines.append("".join(text for text, _ in parts))
            return
        from rich.console import Console
        from rich.text import Text

        target = io.StringIO()
        console = Console(
            file=target,
            width=self._width,
            force_terminal=self._colour,
            color_system="standard" if self._colour else None,
            legacy_windows=False,
        )
        console.print(Text.assemble(*parts))
        self._lines += target.getvalue().splitlines()

    def rows(self, rows: Sequence[TextRow], *, room: int = 0, joint: str = " " * GAP) -> None:
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

    def _write(self, parts: Sequence[Part]) -> None:
        """Write a line as it is; blanks at the ends of its parts have no style."""
        self._lines.append((" " * GAP).join(self._painted(*part) for part in parts))

    def _painted(self, text: str, style: str) -> str:
        word = text.rstrip()
        if not (self._colour and style and word):
            return text
        from rich.color import ColorSystem
        from rich.style import Style

        return Style.parse(style).render(word, color_system=ColorSystem.STANDARD) + text[len(word) :]


def _wrapped(text: str, width: int | None) -> list[str]:
    """The lines of a text, cut where they are wider than this: at blanks, or inside of long words."""
    lines = text.split("\n")
    if width is None or max(map(cells, lines)) <= width:
        return lines
    from rich.console import Console
    from rich.text import Text

    return [str(line).rstrip() for line in Text(text).wrap(Console(width=width), max(1, width))]
