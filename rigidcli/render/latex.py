"""Fragments for a LaTeX document that loads amsmath, with one `align*` for each report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.prose import typeset
from rigidcli.render.values import entries, is_exact, shown_columns, shown_fields, worded
from rigidcli.report import Column, Field, Report, Table, Value

_SPECIAL = str.maketrans(
    {char: f"\\{char}" for char in "&%$#_{}"}
    | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}
    | {"<": r"\textless{}", ">": r"\textgreater{}", "[": "{[}"}
)
_LONG = 50  # the most letters of a formula or words on one line, which then fits on a page
# A paragraph beside the equals sign, in which TeX breaks lines at blanks.
_LINES = r"\parbox[t]{{0.62\linewidth}}{{\raggedright {}}}"
# Width of a page of A4 with margins of 2 cm, of a letter of ten points, and between columns, in points.
_PAGE, _LETTER, _GAP = 482.0, 5.7, 12.0
# Commands and marks of LaTeX that take no width on the page.
_WIDTHLESS = re.compile(r"\\(?:(?:left|right|frac|mathrm|mathbf|text(?:superscript)?|d?dot)\b|,)|[{}$^_ ]")
_MOST_IN_PMATRIX = 10  # columns that a `pmatrix` has room for, unless the document sets MaxMatrixCols
# The beginning of a document that compiles by itself; `fit` shrinks formulas that are wider than a line.
PREAMBLE = r"""\documentclass{article}
\usepackage[margin=2cm]{geometry}
\usepackage{amsmath,graphicx}
\allowdisplaybreaks
\newcommand{\fit}[1]{\sbox0{#1}\ifdim\wd0>\linewidth\resizebox{\linewidth}{!}{\usebox0}\else\usebox0\fi}
\begin{document}
"""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A fragment for each report under a comment with the name; or a document of them."""
    begun = False
    for report in reports:
        if look.standalone and not begun:
            yield PREAMBLE
        begun = True
        title = printable(report.heading)
        yield f"\\section*{{{_prose(title)}}}\n" if look.standalone else f"% {title}\n"
        if report.fields:
            yield f"{formulas(report, look)}\n"
        yield from _tables(report.tables, look)
        for place, step in enumerate(report.steps, 1):
            yield f"\\paragraph{{{place}. {_prose(step.title)}.}} {_prose(step.sentence)}\n"
            if step.fields:
                yield _aligned(step.fields, look) + "\n"
            yield from _tables(step.tables, look)
    if look.standalone and begun:
        yield "\\end{document}\n"


def _tables(tables: Iterable[Table], look: Look) -> Iterator[str]:
    for table in tables:
        for columns in _pages([_column(*shown) for shown in shown_columns(table, look, number)]):
            yield _table(table, columns)


def formulas(report: Report, look: Look) -> str:
    """The results of a report, one below the other, without the tables."""
    return _aligned(shown_fields(report, look), look)


def _aligned(fields: Iterable[Field], look: Look) -> str:
    # A parameter without a value is its own result: no row says that M = M.
    every = [_row(entry, look) for entry in fields]
    rows = " \\\\\n".join(f"  {row}" for row in every if not _SAME.fullmatch(row))
    return f"\\begin{{align*}}\n{rows}\n\\end{{align*}}"


_SAME = re.compile(r"(.+) &= \1")


def _column(column: Column, texts: list[str]) -> list[str]:
    head = f"${column.symbols[0]}$" if column.symbols else _prose(column.cells[0])
    cells = [_prose(text) if is_word else f"${text}$" for text, is_word in worded(column, texts)]
    unit = f"${_upright(column.unit)}$" if "^" in column.unit else _escaped(column.unit)
    return [f"{head} ({unit})" if unit else head, *cells]


def _pages(columns: list[list[str]]) -> Iterator[list[list[str]]]:
    """The columns in groups as wide as a page; the first column begins every group."""
    widths = [_GAP + _LETTER * max(map(_letters, column)) for column in columns]
    page, used = columns[:1], sum(widths[:1])
    for column, width in zip(columns[1:], widths[1:], strict=True):
        if used + width > _PAGE and len(page) > 1:
            yield page
            page, used = columns[:1], widths[0]
        page = [*page, column]
        used += width
    if page:
        yield page


def _letters(latex: str) -> int:
    """The approximate width of typeset LaTeX in letters."""
    return len(re.sub(r"\\\w+", "x", _WIDTHLESS.sub("", latex.replace(r"\times", "xxx"))))


def _table(table: Table, columns: list[list[str]]) -> str:
    """A table in a `tabular`: heads, then the rows."""
    heads, *lines = (" & ".join(line) + r" \\" for line in zip(*columns, strict=True))
    body = "\n".join(f"  {line}" for line in [heads + r" \hline", *lines])
    return (
        f"% {table.title}\n\\begin{{center}}\\begin{{tabular}}{{{'r' * len(columns)}}}\n{body}\n"
        "\\end{tabular}\\end{center}\n"
    )


def _row(entry: Field, look: Look) -> str:
    left = entry.symbol or rf"\text{{{_prose(entry.title)}}}"
    if entry.words or entry.value is None:
        words = _prose(entry.words or "not known")
        written = _LINES.format(words) if _letters(words) > _LONG else rf"\text{{{words}}}"
        return rf"{left} &\colon {written}"
    written = value(entry, look.digits)
    if np.ndim(entry.value) != 2 or np.shape(entry.value)[1] > _MOST_IN_PMATRIX:
        written = _broken(written, look) if _letters(written) > _LONG else written
    return f"{left} &= {written}"


def _broken(latex: str, look: Look) -> str:
    """A long formula in lines, which are broken between the terms of a sum."""
    first, *others = pieces(latex)
    lines = [rf"$\displaystyle {line}$" for line in (first, *(f"{{}}{other}" for other in others))]
    return _LINES.format(" ".join(rf"\fit{{{line}}}" if look.standalone else line for line in lines))


def pieces(latex: str) -> list[str]:
    """The formula cut before every equals sign, plus or minus outside of brackets."""
    pieces, depth, start = [], 0, 0
    for token in re.finditer(r"\\(?:left|begin|right|end)\b|[{}]| (?=[-+=] )", latex):
        if token[0] in (r"\left", r"\begin", "{"):
            depth += 1
        elif token[0] != " ":
            depth -= 1
        elif depth == 0:
            pieces.append(latex[start : token.start()])
            start = token.end()
    return [*pieces, latex[start:]]


def value(entry: Field, digits: int) -> str:
    """A value with its unit, for math mode."""
    factor, texts, unit = entries(entry, digits, number)
    if isinstance(texts, str):
        written = texts
    elif isinstance(texts[0], str):
        written = r"\left(" + r",\, ".join(texts) + r"\right)"
    else:
        # Fractions in rows without extra space would touch.
        apart = r" \\[1ex] " if any("frac" in cell for row in texts for cell in row) else r" \\ "
        rows = apart.join(" & ".join(row) for row in texts)
        if len(texts[0]) > _MOST_IN_PMATRIX:
            columns = "c" * len(texts[0])
            written = rf"\left(\begin{{array}}{{{columns}}}{rows}\end{{array}}\right)"
        else:
            written = rf"\begin{{pmatrix}}{rows}\end{{pmatrix}}"
    upright = rf"\,{_upright(unit)}" if unit else ""
    factor = factor.removeprefix(r"1 \times ")
    return f"{factor}{written}{upright}"


def _upright(unit: str) -> str:
    r"""A unit in upright letters: `kg m^2/s` becomes kg\,m^2/s."""
    return rf"\mathrm{{{unit}}}".replace(" ", r"\,")


def _prose(words: str) -> str:
    """Words as LaTeX text, with the formulas among them in math mode.

    Letters beyond Latin-1, for which pdflatex needs further packages, are written by their numbers.
    """
    return "".join(f"${piece}$" if is_formula else _escaped(piece) for piece, is_formula in typeset(words))


def _escaped(words: str) -> str:
    plain = "".join(letter if ord(letter) < 0x100 else f"U+{ord(letter):04X}" for letter in words)
    return plain.translate(_SPECIAL)


def number(value: Value, digits: int) -> str:
    """A float with this number of digits, or an exact expression, for math mode."""
    if is_exact(value):
        from rigidcli.language.text import latex

        return latex(value.tree(digits))
    mantissa, e, exponent = f"{value:.{digits}g}".partition("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if e else mantissa
