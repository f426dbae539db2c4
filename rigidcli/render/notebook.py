"""A result as a fragment of HTML for notebooks, its formulas in LaTeX between dollar signs."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.latex import value
from rigidcli.render.table import number
from rigidcli.render.values import shown_columns, shown_fields
from rigidcli.report import Field, Report


def fragment(report: Report, look: Look) -> str:
    """Tables of results and samples under the name of the document, and the replay of its motion if there is
    a scene. All text in it is escaped."""
    return "\n".join(_lines(report, look))


def _lines(report: Report, look: Look) -> Iterator[str]:
    yield f"<table><caption>{escape(printable(report.name))}: {escape(report.title)}</caption>"
    for entry in shown_fields(report, look):
        yield f"<tr><th>{escape(entry.title)}</th><td>{_cell(entry, look)}</td></tr>"
    yield "</table>"
    for table in report.tables:
        if shown := shown_columns(table, look, number):
            heads = (
                f"{column.cells[0]} ({column.unit})" if column.unit else column.cells[0]
                for column, _ in shown
            )
            yield f"<table><caption>{escape(table.title)}</caption>"
            yield f"<tr>{''.join(f'<th>{escape(head)}</th>' for head in heads)}</tr>"
            for row in zip(*(texts for _, texts in shown), strict=True):
                yield f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>"
            yield "</table>"
    if report.scene is not None:
        from rigidcli.render.web.replay import replay

        yield replay(report.scene, look)


def _cell(entry: Field, look: Look) -> str:
    """The formula of a result, or its words."""
    if entry.words or entry.value is None:
        return escape(printable(entry.words or "not known"))
    symbol = f"{entry.symbol} = " if entry.symbol else ""
    return f"${escape(symbol + value(entry, look.digits))}$"
