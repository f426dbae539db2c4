"""For people at a terminal: a title, then one result under the other."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rigidcli.render import Look
from rigidcli.render.values import Notation, entries, has_symbols
from rigidcli.report import Field, Report

UNLIMITED = 100_000
"""Width where there is no terminal: a file or pipe gets every result on its own lines, unbroken."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A block for each report, with an empty line between them."""
    first = True
    for report in reports:
        yield ("" if first else "\n") + _block(report, look)
        first = False


def _block(report: Report, look: Look) -> str:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bold" if look.colour else "")
    grid.add_column(no_wrap=True)
    grid.add_column()
    for entry in report.fields:
        if entry.title:
            shown, unit = _value(entry, look.digits)
            grid.add_row(Text(entry.title), Text(unit), Text(shown, no_wrap=not entry.words))
    target = io.StringIO()
    console = Console(
        file=target,
        width=look.width or UNLIMITED,
        force_terminal=look.colour,
        color_system="standard" if look.colour else None,
        legacy_windows=False,
    )
    console.print(Text(f"{printable(report.name)}: {report.title}", style="bold" if look.colour else ""))
    console.print(grid)
    return "".join(line.rstrip() + "\n" for line in target.getvalue().splitlines())


def printable(text: str) -> str:
    """`text` without what could steer a terminal: control characters and marks of direction are escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _value(entry: Field, digits: int) -> tuple[str, str]:
    """The value as lines of text, and its unit."""
    if entry.words:
        return entry.words, ""
    if entry.value is None:
        return "not known", ""
    factor, texts = entries(entry.value, digits, _NOTATION)
    unit = "" if has_symbols(entry.value) else entry.unit
    if isinstance(texts, str):
        return texts, unit
    if isinstance(texts[0], str):
        return " ".join(filter(None, [factor, f"({', '.join(texts)})"])), unit
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    rows = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in texts]
    if factor:
        rows = [
            f"{factor if index == len(rows) // 2 else '':{len(factor)}} [{row}]"
            for index, row in enumerate(rows)
        ]
    return "\n".join(rows), unit


def _floating(number: float, digits: int) -> str:
    return f"{number:.{digits}g}"


def _exact(number: object) -> str:
    from rigidcli.symbolic.exact import reading

    written: str = reading(number)
    return written


_NOTATION = Notation(_floating, _exact)
