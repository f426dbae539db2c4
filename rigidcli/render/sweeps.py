"""The reports of a sweep as one for people: a table with a row a value, of the columns that change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from rigidcli.render import Look
from rigidcli.render.compare import told_apart
from rigidcli.render.table import number
from rigidcli.render.terminal import GAP, cells
from rigidcli.render.values import plain, row_of
from rigidcli.report import Column, Report, Table, Value


def gathered(reports: Iterable[Report], look: Look, tell: Callable[[str], None]) -> Iterator[Report]:
    """One report with the table, if there are any; `tell` gets a note on how many columns do not fit in it.

    Its columns are those that are asked for; or the keys that are swept, names where there are several, and
    those of csv that are not the same in all rows, as far as the width of the terminal allows.
    """
    columns: dict[str, list[Value]] = {}
    units: dict[str, str] = {}
    last, count = None, 0
    keys: tuple[str, ...] = ()
    told, points, sources = set[str](), set[str](), list[str]()
    for last in reports:
        keys = tuple(entry.key for entry in last.swept)
        points.add(str([plain(entry.value) for entry in last.swept]))
        row = row_of(last)
        sources.append(last.source)
        told.update(
            head for entry in last.fields if look.verbose or not entry.diagnostic for head in entry.cells
        )
        for name, (_, unit) in row.items():
            columns.setdefault(name, [None] * count)
            units.setdefault(name, unit)
        for name, column in columns.items():
            column.append(row.get(name, _EMPTY)[0])
        count += 1
    if last is None:
        return
    columns["name"] = told_apart(list(zip(columns["name"], sources, strict=True)))
    fixed = [*keys, *(["name"] if len(set(columns["name"])) > 1 else [])]
    others = [name for name in columns if name in told and name not in (*keys, "name")]
    varied = [name for name in others if _varies(columns[name], look, count == 1)]
    if not varied and not look.columns:
        tell(f"no result changes with {', '.join(keys)}; `-f csv` has them all")
    shown = list(dict.fromkeys(look.columns)) or [*fixed, *varied]
    is_free = look.width is None or look.columns
    kept = len(shown) if is_free else max(len(fixed) + 1, _fitting(shown, columns, units, look))
    if kept < len(shown):
        tell(f"{len(shown) - kept} more columns change, for which the terminal is too narrow: see `-f csv`")
    table = Table(
        "",
        f"at {len(points):,} value{'s' * (len(points) != 1)} of {', '.join(keys)}",
        tuple(Column("", columns[name], (name,), units[name]) for name in shown[:kept]),
    )
    yield Report(last.schema, _name(columns["name"]), last.source, last.title, (), tables=(table,))


_EMPTY = (None, "")
"""A cell of a row that has no such result, and its unit."""


def _name(names: list[str]) -> str:
    return names[0] if len(set(names)) == 1 else f"{names[0]} and others"


def _text(value: Value, look: Look) -> str:
    return str(value) if value is None or isinstance(value, str | bool) else number(value, look.digits)


def _varies(values: list[Value], look: Look, is_alone: bool) -> bool:
    """Whether a column says different things, in the digits that are shown; or in its only row, anything."""
    if is_alone:
        return values[0] is not None
    first = _text(values[0], look)
    return any(value != values[0] and _text(value, look) != first for value in values)


def _fitting(names: list[str], columns: dict[str, list[Value]], units: dict[str, str], look: Look) -> int:
    """How many of the columns fit beside each other on the terminal."""
    total = -GAP
    for place, name in enumerate(names):
        head = f"{name} ({units[name]})" if units[name] else name
        total += GAP + max(cells(text) for text in [head, *(_text(value, look) for value in columns[name])])
        if total > (look.width or total):
            return place
    return len(names)
