"""Several reports as one table: columns of FILES with `--compare`, rows of values with `--sweep`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from operator import getitem

import numpy as np

from rigidcli.errors import UsageError
from rigidcli.render import Look
from rigidcli.render.table import number
from rigidcli.render.values import cell_text, is_exact, row_of, shown_fields, tidied
from rigidcli.report import Column, Field, Report, Table, Value


def named(reports: Iterable[Report]) -> list[Report]:
    """The reports; the FILE is added to a name that several FILES have."""
    reports = list(reports)
    names = _distinct([(report.name, report.source) for report in reports])
    return [replace(report, name=name) for report, name in zip(reports, names, strict=True)]


def _distinct(names: Sequence[tuple[str, str]]) -> list[str]:
    sources = defaultdict[str, set[str]](set)
    for name, source in names:
        sources[name].add(source)
    return [f"{name} ({source})" if len(sources[name]) > 1 else name for name, source in names]


def compared(reports: Iterable[Report], look: Look) -> Iterator[Report]:
    """One report with a table, if there are any reports: a row a number or word, a column a report.

    Beside each report after the first stands the difference to the first in percent, where both are numbers.
    Raises UsageError where a FILE has several results, such as the links of a robot.
    """
    reports = named(reports)
    if not reports:
        return
    first = reports[0]
    names = dict[str, str]()
    for report in reports:
        if names.setdefault(report.source, report.name) != report.name:
            hint = "`body: {robot: arm.urdf, link: forearm}` in a document is one of its links"
            raise UsageError(f"--compare: `{report.source}` has several results", hint=hint)
    shown = {entry.key for report in reports for entry in shown_fields(report, look)}
    results = [
        {
            (f"{entry.title.strip()}{cell and f', {cell}'}", entry.unit): value
            for entry in report.fields
            if entry.title and entry.key in shown
            for cell, value in _entries(entry)
        }
        for report in reports
    ]
    every = dict.fromkeys(row for result in results for row in result)
    # Zeros in all columns, such as products of inertia about common axes, tell nothing.
    rows = [row for row in every if any(_tells(result.get(row)) for result in results)]
    columns = [Column("", [f"{title}{unit and f' ({unit})'}" for title, unit in rows], ("result",))]
    for report, result in zip(reports, results, strict=True):
        values = [result.get(row) for row in rows]
        columns.append(Column("", values, (report.name,)))
        if report is not first:
            # The components of a direction have no difference in percent.
            sized = (unit or ", " not in title for title, unit in rows)
            pairs = zip(sized, columns[1].values, values, strict=True)
            columns.append(Column("", [_percent(*pair) if has else None for has, *pair in pairs], ("%",)))
    table = Table("", f"differences to {first.name} in percent", tuple(columns))
    name = ", ".join(report.name for report in reports)
    yield Report(first.schema, name, first.source, first.title, (), tables=(table,))


def _tells(value: Value) -> bool:
    """Whether a value is a word, a formula or a number other than zero."""
    return value is not None and (isinstance(value, str | bool) or bool(value != 0))


def _entries(entry: Field) -> Iterator[tuple[str, Value]]:
    """The entries of a result by their columns in csv, or of a tensor without columns by their axes."""
    value = tidied(entry)
    if not isinstance(value, np.ndarray):
        is_cell = isinstance(value, str | bool | int | float) or is_exact(value)
        yield "", value if is_cell else entry.words or None
        return
    is_square = value.shape[0] == value.shape[-1]
    axes = ("xyz123456789", "xyz") if is_square else ("12", "xyz")
    places = entry.cells or {
        "".join(map(getitem, axes, place)): place
        for place in product(*map(range, value.shape))
        if place == tuple(sorted(place)) or not is_square
    }
    for name, place in places.items():
        yield name, value[place]


def _percent(first: Value, other: Value) -> Value:
    """The difference to the first in percent; None where one is no number, or the first is zero."""
    for value in (first, other):
        if value.names if is_exact(value) else isinstance(value, bool) or not isinstance(value, int | float):
            return None
    first, other = (value.evaluate() if is_exact(value) else value for value in (first, other))
    return 0.0 if first == other else 100 * float(other - first) / abs(first) if first else None


def gathered(reports: Iterable[Report], look: Look, tell: Callable[[str], None]) -> Iterator[Report]:
    """One report with a table of all values of a sweep, if there are any reports; `tell` gets notes.

    Its columns are those that are asked for; or the keys that are swept, names where there are several, and
    the columns of csv that are not the same in all rows.
    """
    columns: dict[str, list[Value]] = {}
    units: dict[str, str] = {}
    results, sources, last = dict[str, None](), list[str](), None
    moving: list[Report] = []
    for last in reports:
        moving += [last] if last.scene is not None else []
        row = row_of(last)
        shown = (entry for entry in last.fields if look.verbose or not entry.diagnostic)
        results |= dict.fromkeys(head for entry in shown for head in entry.cells)
        for name, (_, unit) in row.items():
            columns.setdefault(name, [None] * len(sources))
            units.setdefault(name, unit)
        for name, column in columns.items():
            column.append(row.get(name, (None, ""))[0])
        sources.append(last.source)
    if last is None:
        return
    keys = [entry.key for entry in last.swept]
    names = columns["name"] = _distinct(list(zip(columns["name"], sources, strict=True)))
    fixed = [*keys, *(["name"] if len(set(names)) > 1 else [])]
    others = [name for name in columns if name in results and name not in (*keys, "name")]
    varied = [name for name in others if _varies(columns[name], look)]
    if not varied and not look.columns:
        tell(f"no result changes with {', '.join(keys)}; `-f csv` has them all")
    points = len(set(zip(*(map(str, columns[key]) for key in keys), strict=True)))
    table = Table(
        "",
        f"at {points:,} value{'s' * (points != 1)} of {', '.join(keys)}",
        tuple(
            Column("", columns[name], (name,), units[name])
            for name in dict.fromkeys(look.columns or [*fixed, *varied])
        ),
    )
    name = f"{names[0]}{' and others' if len(set(names)) > 1 else ''}"
    yield Report(last.schema, name, last.source, last.title, (), tables=(table,), motions=tuple(moving))


def _varies(values: list[Value], look: Look) -> bool:
    """Whether a column has different values in the digits that are shown, or any value in a single row."""
    if len(values) == 1:
        return values[0] is not None
    first = cell_text(values[0], look.digits, number)
    return any(value != values[0] and cell_text(value, look.digits, number) != first for value in values)
