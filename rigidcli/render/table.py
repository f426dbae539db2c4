"""Tables for people: a title, then one result under the other, then tables of several columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.terminal import Page, TextRow
from rigidcli.render.values import entries, is_exact, shown_columns, shown_fields
from rigidcli.report import Field, Report, Table, Value

# Letters of a title in a column: a longer one, such as a formula of the working, has a line of its own.
LONGEST_TITLE = 36


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A block for each report, with an empty line between them."""
    first = True
    for report in reports:
        head = printable(report.heading)
        yield ("" if first else "\n") + _block(head, "", shown_fields(report, look), report.tables, look)
        first = False
        for place, step in enumerate(report.steps, 1):
            yield "\n" + _block(f"{place}. {step.title}", step.sentence, step.fields, step.tables, look)


def _block(head: str, words: str, fields: Iterable[Field], tables: Iterable[Table], look: Look) -> str:
    page = Page(look.width, look.colour)
    page.line((printable(head), "bold"))
    if words:
        page.line((printable(words), ""))
    written = [(entry, *_value(entry, look.digits)) for entry in fields]
    # Among formulas, which have no units, the few units stand behind their numbers.
    measured = [value for _, value, unit in written if unit]
    has_column = 2 * len(measured) >= len(written) or any("\n" in value for value in measured)
    rows: list[TextRow] = []
    for entry, value, unit in written:
        if len(entry.title) > LONGEST_TITLE and "\n" not in value:
            page.rows(rows, room=24, joint=", ")
            page.line((entry.title, "bold"), (f" = {value} {unit}".rstrip(), ""))
            rows = []
            continue
        heads = ((entry.title, "bold"), (unit, ""))[: 1 + has_column]
        body = value if has_column else f"{value} {unit}".rstrip()
        rows.append(TextRow(heads, body, bool(entry.words)))
    page.rows(rows, room=24, joint=", ")
    for table in tables:
        if shown := shown_columns(table, look, number):
            page.line()
            page.line((table.title, "bold"))
            names = [f"{column.cells[0]}{column.unit and f' ({column.unit})'}" for column, _ in shown]
            page.columns([[name, *texts] for name, (_, texts) in zip(names, shown, strict=True)])
    return str(page)


def _value(entry: Field, digits: int) -> tuple[str, str]:
    if entry.words or entry.value is None:
        return entry.words or "not known", ""
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
    """A float with this number of digits, or an exact expression as a person would write it."""
    if not is_exact(value):
        return f"{value:.{digits}g}"
    from rigidcli.language.text import reading

    return reading(value.tree(digits))
