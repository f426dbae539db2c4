"""Tables for people: a title, then one result under the other, then tables of several columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.terminal import GAP, Page, Row
from rigidcli.render.values import entries, is_exact, shown_columns, shown_fields, written
from rigidcli.report import Column, Field, Report, Table, Value

NARROWEST = 24
"""Columns of a terminal that words need beside their heads: three or four words a line."""

_Results: TypeAlias = Sequence[tuple[Field, str, str]]
"""Results, each with its value as lines of text, and its unit."""

_Tables: TypeAlias = Sequence[tuple[str, Sequence[Sequence[str]]]]
"""Tables, each by its title and its columns: a head, then the texts below it."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A block for each report, with an empty line between them."""
    first = True
    for report in reports:
        head = printable(report.heading)
        yield ("" if first else "\n") + _block(head, "", shown_fields(report, look), report.tables, look)
        first = False
        for place, step in enumerate(report.steps if look.steps else (), 1):
            yield "\n" + _block(f"{place}. {step.title}", step.sentence, step.fields, step.tables, look)


def _block(head: str, words: str, fields: Iterable[Field], tables: Iterable[Table], look: Look) -> str:
    """A head, words on what follows, if there are any, results, and tables."""
    results = [(entry, *_value(entry, look.digits)) for entry in fields]
    shown = [
        (table.title, [[_head(column), *texts] for column, texts in columns])
        for table in tables
        if (columns := shown_columns(table, look, number))
    ]
    heads = [printable(line) for line in (head, words) if line]
    if look.width is None:
        return _plain(heads, results, shown)
    return _on_terminal(heads, results, shown, look.width, look.colour)


def _head(column: Column) -> str:
    return f"{column.cells[0]} ({column.unit})" if column.unit else column.cells[0]


def _plain(heads: Sequence[str], results: _Results, tables: _Tables) -> str:
    """A block for a file or pipe: no line is broken, and nothing waits for rich to load."""
    lines = [*heads]
    titles = max((len(entry.title) for entry, _, _ in results), default=0)
    units = max((len(unit) for _, _, unit in results), default=0)
    for entry, value, unit in results:
        first, *others = value.split("\n")
        lines.append(f"{entry.title:{titles}}  {unit:{units}}  {first}")
        lines += [" " * (titles + units + 2 * GAP) + line for line in others]
    for title, columns in tables:
        widths = [max(map(len, column)) for column in columns]
        lines += ["", title]
        for row in zip(*columns, strict=True):
            lines.append("  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)))
    return "".join(line.rstrip() + "\n" for line in lines)


def _on_terminal(heads: Sequence[str], results: _Results, tables: _Tables, width: int, colour: bool) -> str:
    page = Page(width, colour)
    for head, style in zip(heads, ("bold", ""), strict=False):
        page.line((head, style))
    rows = [
        Row(((entry.title, "bold"), (unit, "")), value, bool(entry.words)) for entry, value, unit in results
    ]
    page.rows(rows, room=NARROWEST, joint=", ")
    for title, columns in tables:
        page.line()
        page.line((title, "bold"))
        page.columns(columns)
    return str(page)


def _value(entry: Field, digits: int) -> tuple[str, str]:
    """The value as lines of text, and its unit."""
    if entry.words:
        return entry.words, ""
    if entry.value is None:
        return "not known", ""
    factor, texts, unit = entries(entry, digits, number)
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


def number(value: Value, digits: int) -> str:
    """A float with so many digits, or an exact expression as a person would write it."""
    if not is_exact(value):
        return f"{value:.{digits}g}"
    from rigidcli.language.text import reading

    return written(value, digits, reading)
