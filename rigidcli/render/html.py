"""Pages for a browser: pictures, results and formulas, the working and the document, all in one file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from rigidcli.language.text import latex_name
from rigidcli.render import Look
from rigidcli.render.latex import number, value
from rigidcli.render.plots import has_library, inline_picture, require_library
from rigidcli.render.table import number as plain_number
from rigidcli.render.values import cell_text, has_words, raised, shown_columns, shown_fields, worded
from rigidcli.render.web.mathml import formula, prose
from rigidcli.render.web.page import page, resource, script_element, script_of, text
from rigidcli.report import Column, Field, Report, Step, Table

# A number with or without a power of ten: all numbers of a column are in the font of the page.
_NUMBER = re.compile(r"(-?[0-9.]+)(?: \\times 10\^\{(-?\d+)\})?")
# The most numbers of a replay that change in time: 1.6 MB on a page; a result in a notebook takes 150 kB.
PAGE, NOTEBOOK = 300_000, 8_000
_NUMERIC = ' class="number"'  # the class of cells with numbers, and of the heads above them


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """One page: a section for each report, under a table of contents where there are several FILES.

    Raises UsageError without the libraries of the extra `show`.
    """
    for use in ("drawing", "formulas"):
        require_library(use)
    head = "h2" if look.several else "h1"
    # Only text is kept of a report: it may have a million samples.
    sections = [
        (report.heading, _section(report, look, head, f"result-{place}"))
        for place, report in enumerate(reports, 1)
    ]
    if sections:
        count = f"{len(sections)} result{'s' if len(sections) > 1 else ''}"
        title = count if look.several else sections[0][0]
        contents = _contents(title, [name for name, _ in sections]) if look.several else ""
        body = "".join((contents, *(section for _, section in sections)))
        style, scripts = _dress(body)
        scripts = [script_of("result.js"), *scripts]
        yield from page(title, ["<main>\n", body, "</main>\n"], scripts, [style])


def _contents(title: str, names: Iterable[str]) -> str:
    links = "".join(
        f'<li><a href="#result-{place}">{text(name)}</a></li>\n' for place, name in enumerate(names, 1)
    )
    return f'<h1>{title}</h1>\n<nav aria-label="Contents"><ol>\n{links}</ol></nav>\n'


def fragment(report: Report, look: Look) -> str:
    """The section of a report, with a style, for the page of another program, such as a notebook."""
    section = _section(report, look, "h2", "", is_cell=True)
    style, scripts = _dress(section)
    return f"<style>\n{style}</style>\n{section}{''.join(map(script_element, scripts))}"


def _dress(body: str) -> tuple[str, list[str]]:
    """The style and the scripts for the body of a page; replays share one script."""
    style = resource("result.css")
    if "class=rigidcli-replay>" not in body:
        return style, []
    from rigidcli.render.web.replay import player

    replays, script = player()
    return style + replays, [script]


def _section(report: Report, look: Look, head: str, anchor: str, *, is_cell: bool = False) -> str:
    name = f' id="{anchor}"' if anchor else ""
    figures = "".join(_figures(report, look, is_cell=is_cell))
    return "".join(
        [
            f'<section class="rigidcli"{name}>\n<{head}>{text(report.heading)}</{head}>\n',
            '<div class="front">\n',  # figures and results, side by side on a wide page
            figures and f'<div class="figures">\n{figures}</div>\n',
            f"<div>{''.join(_results_of(report, look))}</div>\n</div>\n",
            *_tables(report.tables, look),
            *_working(report.steps, look),
            *_notes(report),
            *_document(report),
            "</section>\n",
        ]
    )


def _figures(report: Report, look: Look, *, is_cell: bool) -> Iterator[str]:
    """The motion or the body in three dimensions, and the picture of the result, if matplotlib is there.

    In print, and where scripts may not run, the picture of a body stands for its view.
    """
    if report.motions:
        from rigidcli.render.web.replay import replay

        scenes = {_swept(each, look): each.scene for each in report.motions}
        yield replay(report.motions[0].scene, look, PAGE, scenes)
        return
    scene = report.scene
    rests = scene is None and not is_cell and any(first.kind == "body" for first in report.pictures[:1])
    if scene is not None or rests:
        from rigidcli.render.web.replay import replay, still

        # A notebook is saved with all cells, so that a result there has the first view only, and coarser.
        if scene is not None and is_cell:
            scene = replace(scene, stages=scene.stages[:1])
        yield replay(scene or still(report.pictures[0]), look, NOTEBOOK if is_cell or rests else PAGE)
    if report.pictures and has_library("drawing"):
        kind = " class=still" if rests else ""
        yield f"<figure{kind}>{inline_picture(report)}</figure>\n"


def _swept(report: Report, look: Look) -> str:
    """The values of the swept keys, as a reader sees them beside a slider."""
    return ", ".join(
        f"{entry.key} = {cell_text(entry.value, look.digits, plain_number)} {raised(entry.unit)}".rstrip()
        for entry in report.swept
    )


def _results_of(report: Report, look: Look) -> Iterator[str]:
    """The results; of a sweep those of each value. The script shows one value at a time if they differ."""
    each = ["".join(_results(one, look)) for one in report.motions]
    if len(set(each)) < 2:
        yield from each[:1] or (_results(report, look) if report.fields else ())
        return
    for place, one in enumerate(each):
        yield f"<div class=chosen{' hidden' if place else ''}>{one}</div>\n"


def _results(report: Report, look: Look) -> Iterator[str]:
    yield '<table class="results"><caption>Results</caption>\n'
    for entry in shown_fields(report, look):
        # The title of an equation may end with its left side, with which the formula begins.
        is_name = entry.title.isidentifier() and latex_name(entry.title) == entry.symbol
        title = formula(entry.symbol) if is_name else prose(entry.title.removesuffix(f": {entry.symbol} ="))
        # A symbol that is the title is not repeated.
        shown = replace(entry, symbol="") if title == formula(entry.symbol) else entry
        yield f'<tr><th scope="row">{title}</th><td>{_result(shown, look)}</td></tr>\n'
    yield "</table>\n"


def _result(entry: Field, look: Look) -> str:
    if entry.words or entry.value is None:
        return prose(entry.words or "not known")
    found = value(entry, look.digits)
    # A parameter without a value is shown as M, not as M = M.
    return formula(f"{entry.symbol} = {found}" if entry.symbol not in ("", found) else found)


def _tables(tables: Iterable[Table], look: Look) -> Iterator[str]:
    """Tables in boxes, which scroll if they are wider than the page."""
    for table in tables:
        if columns := shown_columns(table, look, number):
            yield f'<div class="wide" role="region" tabindex="0" aria-label="{text(table.title)}"><table>'
            yield f"<caption><span>{prose(table.title)}</span></caption>\n<thead><tr>"
            yield "".join(_head(column) for column, _ in columns)
            yield "</tr></thead>\n<tbody>\n"
            for row in zip(*(_cells(column, texts) for column, texts in columns), strict=True):
                yield f"<tr>{''.join(row)}</tr>\n"
            yield "</tbody></table></div>\n"


def _head(column: Column) -> str:
    name = formula(column.symbols[0]) if column.symbols else prose(column.cells[0])
    unit = f" ({text(raised(column.unit))})" if column.unit else ""
    return f'<th scope="col"{"" if has_words(column) else _NUMERIC}>{name}{unit}</th>'


def _cells(column: Column, texts: list[str]) -> Iterator[str]:
    for cell, is_word in worded(column, texts):
        if is_word:
            yield f"<td>{prose(cell)}</td>"
        elif number := _NUMBER.fullmatch(cell):
            ten = f" × 10<sup>{number[2]}</sup>" if number[2] else ""
            yield f"<td{_NUMERIC}>{number[1]}{ten}</td>".replace("-", "\N{MINUS SIGN}")
        else:
            yield f"<td{_NUMERIC}>{formula(cell)}</td>"


def _working(steps: Iterable[Step], look: Look) -> Iterator[str]:
    if steps:
        yield '<div class="working"><h3>The working</h3>\n<ol>\n'
        for step in steps:
            yield f"<li><h4>{prose(step.title)}</h4><p>{prose(step.sentence)}</p>\n"
            for entry in step.fields:
                title = "" if entry.symbol else f"{prose(entry.title)}: "
                yield f'<p class="formula">{title}{_result(entry, look)}</p>\n'
            yield from _tables(step.tables, look)
            yield "</li>\n"
        yield "</ol></div>\n"


def _notes(report: Report) -> Iterator[str]:
    if report.notes:
        items = "".join(f"<li>{text(note)}</li>" for note in report.notes)
        yield f'<aside aria-label="Notes"><h3>Notes</h3><ul>{items}</ul></aside>\n'


def _document(report: Report) -> Iterator[str]:
    if report.document:
        yield f"<details><summary>The document: {text(report.source)}</summary>\n"
        lines = "\n".join(map(text, report.document.splitlines()))
        yield f"<pre>{lines}</pre></details>\n"
