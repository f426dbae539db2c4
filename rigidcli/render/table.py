"""For people at a terminal: a title, then one result under the other."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.values import Notation, column_texts, entries, has_symbols, sampled, visible, written
from rigidcli.report import Cell, Field, Report, Table


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A block for each report, with an empty line between them."""
    first = True
    for report in reports:
        yield ("" if first else "\n") + _block(report, look)
        first = False


_Rows: TypeAlias = Sequence[tuple[Field, str, str]]
"""Results, each with its value as lines of text, and its unit."""


def _block(report: Report, look: Look) -> str:
    rows = [(entry, *_value(entry, look.digits)) for entry in report.fields if entry.title]
    head = f"{printable(report.name)}: {report.title}"
    if look.width is None:
        # A file or pipe gets every result on its own lines, unbroken, and need not wait for rich.
        written = "\n".join([head, *_columns(rows), *_plain_tables(report, look)])
    else:
        written = _on_terminal(head, rows, report, look, look.width)
    return "".join(line.rstrip() + "\n" for line in written.splitlines())


def _columns(rows: _Rows) -> Iterator[str]:
    """The rows as lines, values in a column of their own."""
    titles, units, _ = _widths(rows)
    for entry, value, unit in rows:
        first, *others = value.split("\n")
        yield f"{entry.title:{titles}}  {unit:{units}}  {first}"
        yield from (" " * (titles + units + 4) + line for line in others)


def _plain_tables(report: Report, look: Look) -> Iterator[str]:
    for table in report.tables:
        shown = visible(table, look)
        if shown:
            yield f"\n{table.title}"
            for lines in _grids(table, shown, look):
                yield from lines


def _on_terminal(head: str, rows: _Rows, report: Report, look: Look, width: int) -> str:
    """All of a report, in colours, and with words broken at the edge."""
    from rich.console import Console
    from rich.padding import Padding
    from rich.table import Table as Grid
    from rich.text import Text

    bold = "bold" if look.colour else ""
    target = io.StringIO()
    console = Console(
        file=target,
        width=width,
        force_terminal=look.colour,
        color_system="standard" if look.colour else None,
        legacy_windows=False,
    )
    console.print(Text(head, style=bold))
    if sum(_widths(rows)) + 4 <= width:
        grid = Grid.grid(padding=(0, 2))
        for entry, value, unit in rows:
            grid.add_row(Text(entry.title, style=bold), Text(unit), Text(value))
        console.print(grid)
    else:
        # Too narrow for columns: every value stands below its title, and only words are broken.
        for entry, value, unit in rows:
            console.print(Text(f"{entry.title}, {unit}" if unit else entry.title, style=bold))
            if entry.words:
                console.print(Padding(Text(value), (0, 0, 0, 2)))
            else:
                console.print(Text(textwrap.indent(value, "  ")), soft_wrap=True)
    for table in report.tables:
        shown = visible(table, look)
        if shown:
            console.print(Text(f"\n{table.title}", style=bold))
            for lines in _grids(table, shown, look):
                for number, line in enumerate(lines):
                    console.print(Text(line, style=bold if number == 0 else ""), soft_wrap=True)
    return target.getvalue()


def _grids(table: Table, columns: Sequence[Cell], look: Look) -> Iterator[list[str]]:
    """The table as lines: heads and rows, in as many grids as the width asks for.

    The first column begins each of them.
    """
    rows = sampled(len(table)) if table.data else range(len(table))
    texts = [
        [
            f"{cell.name} ({cell.unit})" if cell.unit else cell.name,
            *column_texts(cell, rows, look.digits, _NOTATION),
        ]
        for cell in columns
    ]
    padded = [[text.rjust(max(map(len, column))) for text in column] for column in texts]
    grid, width = padded[:1], len(padded[0][0])
    for column in padded[1:]:
        if look.width is not None and width + 2 + len(column[0]) > look.width and len(grid) > 1:
            yield ["  ".join(line) for line in zip(*grid, strict=True)]
            grid, width = padded[:1], len(padded[0][0])
        grid.append(column)
        width += 2 + len(column[0])
    yield ["  ".join(line) for line in zip(*grid, strict=True)]


def _widths(rows: _Rows) -> tuple[int, int, int]:
    """Of titles, units and values; words among these are left out, for they may be broken."""
    titles, units, values = (
        max((len(line) for text in column for line in text.split("\n")), default=0)
        for column in (
            [entry.title for entry, _, _ in rows],
            [unit for _, _, unit in rows],
            ["" if entry.words else value for entry, value, _ in rows],
        )
    )
    return titles, units, values


def _value(entry: Field, digits: int) -> tuple[str, str]:
    """The value as lines of text, and its unit."""
    if entry.words:
        return entry.words, ""
    if entry.value is None:
        return "not known", ""
    factor, texts = entries(entry, digits, _NOTATION)
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
    from rigidcli.symbolic.language.text import reading

    return written(number, reading)


_NOTATION = Notation(_floating, _exact)
