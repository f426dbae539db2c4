"""Several FILES for people: their results side by side, and names that differ."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from rigidcli.render import Look
from rigidcli.render.values import is_exact, shown_fields, tidied
from rigidcli.report import Column, Field, Report, Table, Value

_Cells = dict[tuple[str, str], tuple[Value, str]]
"""Results in single cells, with their units: by the title of the result, and the name of the cell in it."""


def named(reports: Iterable[Report]) -> list[Report]:
    """The reports, of which those of several FILES with the same name have the FILE in it."""
    reports = list(reports)
    names = told_apart([(report.name, report.source) for report in reports])
    return [replace(report, name=name) for report, name in zip(reports, names, strict=True)]


def told_apart(names: Sequence[tuple[str, str]]) -> list[str]:
    """The names of reports; the FILE is added where another FILE has the same name."""
    sources = defaultdict[str, set[str]](set)
    for name, source in names:
        sources[name].add(source)
    return [f"{name} ({source})" if len(sources[name]) > 1 else name for name, source in names]


def compared(reports: Iterable[Report], look: Look) -> Iterator[Report]:
    """One report with a table, if there are any reports: a row a number or word, a column a report.

    Beside each report after the first stands the difference to the first in percent, where both are numbers.
    """
    reports = named(reports)
    if not reports:
        return
    first = reports[0]
    cells = [_cells(report, look) for report in reports]
    rows = list(dict.fromkeys(place for each in cells for place in each))
    units = [next(each[row][1] for each in cells if row in each) for row in rows]
    texts = [_label(*row, unit) for row, unit in zip(rows, units, strict=True)]
    columns = [Column("", texts, ("result",))]
    for report, each in zip(reports, cells, strict=True):
        values = [each.get(row, (None, ""))[0] for row in rows]
        columns.append(Column("", values, (report.name,)))
        if report is not first:
            pairs = zip(columns[1].values, values, strict=True)
            columns.append(Column("", [_percent(*pair) for pair in pairs], ("%",)))
    title = f"differences to {first.name} in percent"
    table = Table("", title, tuple(columns))
    name = ", ".join(report.name for report in reports)
    yield Report(first.schema, name, first.source, first.title, (), tables=(table,))


def _cells(report: Report, look: Look) -> _Cells:
    """The results of a report that people are shown, each number by itself."""
    cells: _Cells = {}
    for entry in shown_fields(report, look):
        for name, value in _entries(entry):
            cells[entry.title.strip(), name] = value, entry.unit
    return cells


def _entries(entry: Field) -> Iterator[tuple[str, Value]]:
    """The entries of a result by their columns in csv, or of a tensor without columns by their axes."""
    value = tidied(entry)
    if not isinstance(value, np.ndarray):
        is_cell = value is None or isinstance(value, str | bool | int | float) or is_exact(value)
        yield "", value if is_cell else entry.words
        return
    places = entry.cells or {
        "".join("xyz123456789"[step] for step in place): place
        for place in product(*map(range, value.shape))
        if place == tuple(sorted(place))
    }
    for name, place in places.items():
        yield name, value[place]


def is_number(value: Value) -> bool:
    """Whether a value is a float, or an exact number without symbols."""
    return (
        not value.names if is_exact(value) else isinstance(value, int | float) and not isinstance(value, bool)
    )


def _label(title: str, name: str, unit: str) -> str:
    return f"{title}{f', {name}' if name else ''}{f' ({unit})' if unit else ''}"


def _percent(first: Value, other: Value) -> Value:
    """The difference to the first in percent; None where one is no number, or the first is zero."""
    if not (is_number(first) and is_number(other)):
        return None
    first, other = (value.evaluate() if is_exact(value) else value for value in (first, other))
    return 0.0 if first == other else 100 * float(other - first) / abs(first) if first else None
