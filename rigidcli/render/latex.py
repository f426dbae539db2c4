"""Fragments for a LaTeX document that loads amsmath: one `align*` a report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from rigidcli.errors import printable
from rigidcli.render import Look
from rigidcli.render.values import entries, is_exact, shown_columns, shown_fields, written
from rigidcli.report import Column, Field, Report, Table, Value

_SPECIAL = str.maketrans(
    {char: f"\\{char}" for char in "&%$#_{}"}
    | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}
    | {"<": r"\textless{}", ">": r"\textgreater{}", "[": "{[}"}
)

_SYMBOLS = {
    r"\blambda([123])\b": r"$\\lambda_\1$",
    r"\be([123])\b": r"$\\mathbf{e}_\1$",
    r"\bomega\b": r"$\\boldsymbol{\\omega}$",
}
"""The symbols that stand in the words of a result, spelled out as in a terminal, and how LaTeX has them."""


PREAMBLE = r"""\documentclass{article}
\usepackage[margin=2cm]{geometry}
\usepackage{amsmath}
\begin{document}
"""
"""What makes fragments a document that compiles by itself."""


def render(reports: Iterable[Report], look: Look) -> Iterator[str]:
    """A fragment for each report, its name in a comment above it; or a document of them."""
    begun = False
    for report in reports:
        if look.standalone and not begun:
            yield PREAMBLE
        begun = True
        yield f"% {printable(report.name)}: {report.title}\n"
        if report.fields:
            yield f"{formulas(report, look)}\n"
        yield from _tables(report.tables, look)
        for number, step in enumerate(report.steps if look.steps else (), 1):
            yield f"\\paragraph{{{number}. {_prose(step.title)}.}} {_prose(step.sentence)}\n"
            if step.fields:
                yield _aligned(step.fields, look) + "\n"
            yield from _tables(step.tables, look)
    if look.standalone and begun:
        yield "\\end{document}\n"


def _tables(tables: Iterable[Table], look: Look) -> Iterator[str]:
    for table in tables:
        if shown := shown_columns(table, look, _number):
            yield _table(table, shown)


def formulas(report: Report, look: Look) -> str:
    """The results of a report, one below the other, without its tables."""
    return _aligned(shown_fields(report, look), look)


def _aligned(fields: Iterable[Field], look: Look) -> str:
    rows = " \\\\\n".join(f"  {_row(entry, look.digits)}" for entry in fields)
    return f"\\begin{{align*}}\n{rows}\n\\end{{align*}}"


def _table(table: Table, columns: list[tuple[Column, list[str]]]) -> str:
    """A table in a `tabular`: heads with their units, then the rows."""
    heads = [
        (f"${column.symbols[0]}$" if column.symbols else _prose(column.cells[0]))
        + (f" ({_prose(column.unit)})" if column.unit else "")
        for column, _ in columns
    ]
    texts = [
        [_prose(text) if isinstance(column.values[0], str | bool) else f"${text}$" for text in told]
        for column, told in columns
    ]
    lines = [" & ".join(line) + r" \\" for line in zip(*texts, strict=True)]
    body = "\n".join(f"  {line}" for line in [" & ".join(heads) + r" \\ \hline", *lines])
    return (
        f"% {table.title}\n\\begin{{center}}\\begin{{tabular}}{{{'r' * len(columns)}}}\n{body}\n"
        "\\end{tabular}\\end{center}\n"
    )


def _row(entry: Field, digits: int) -> str:
    left = entry.symbol or rf"\text{{{entry.title}}}"
    if entry.words or entry.value is None:
        return rf"{left} &\colon \text{{{_prose(entry.words or 'not known')}}}"
    return f"{left} &= {value(entry, digits)}"


def value(entry: Field, digits: int) -> str:
    """A value with its unit, for math mode."""
    factor, texts, unit = entries(entry, digits, _number)
    if isinstance(texts, str):
        written = texts
    elif isinstance(texts[0], str):
        written = r"\left(" + r",\, ".join(texts) + r"\right)"
    else:
        # Fractions in rows without extra space would touch.
        apart = r" \\[1ex] " if any("frac" in cell for row in texts for cell in row) else r" \\ "
        rows = apart.join(" & ".join(row) for row in texts)
        written = rf"\begin{{pmatrix}}{rows}\end{{pmatrix}}"
    # The unit is in upright letters: `kg m^2/s` becomes kg\,m^2/s.
    upright = rf"\,\mathrm{{{unit}}}".replace(" ", r"\,") if unit else ""
    return f"{factor}{written}{upright}"


def _prose(words: str) -> str:
    """Words as LaTeX text, symbols of the field as symbols."""
    text = words.translate(_SPECIAL)
    for spelled, symbol in _SYMBOLS.items():
        text = re.sub(spelled, symbol, text)
    return text


def _number(number: Value, digits: int) -> str:
    if is_exact(number):
        from rigidcli.symbolic.language.text import latex

        return written(number, digits, latex)
    mantissa, e, exponent = f"{number:.{digits}g}".partition("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if e else mantissa
