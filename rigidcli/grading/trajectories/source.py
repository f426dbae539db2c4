"""Where the key of a trajectory is from: formulas of the time, a table, or the report on a document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.numbers import read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.trajectories.columns import read_columns
from rigidcli.model.parameters import read_name
from rigidcli.model.units import parse_unit
from rigidcli.report import Report, Table, cells
from rigidcli.symbolic import evaluation
from rigidcli.symbolic.expression import parse
from rigidcli.symbolic.tree import Name, Node

TIME = "t"

ANGLES = ("phi", "psi")
"""Columns of a motion that are angles without being listed; theta goes from 0 to pi and back."""

BY_DEFAULT = {"orbit": ("q", "p"), "trajectory": ("omega",)}
"""The columns of each table that are judged where the question lists none, by their keys."""

SECTIONS = {"orbit": "orbit", "trajectory": "motion"}
"""The sections of a document that these tables are from."""

LEAST_SAMPLES, MOST_SAMPLES = 16, 1_000_000
FORMULA_SAMPLES = 4001
"""Of formulas, from which sizes are told."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The right `columns` by name (n each) at `times` (n), which are ascending; perhaps by `formulas` of t.

    `families` are names of columns whose sizes can be compared; in those of `vectors`, small components are
    rounding noise. `other` has the columns of a second, coarser run (n each, by name, `t` among them). `laws`
    are what is conserved, by name, with `constants` for the names that are no columns. `remedy` tells how
    to get more samples.
    """

    times: Floats
    columns: Mapping[str, Floats]
    default: tuple[str, ...]
    families: tuple[tuple[str, ...], ...]
    remedy: str = ""
    vectors: bool = False
    angles: tuple[str, ...] = ()
    formulas: Mapping[str, Node] | None = None
    other: Mapping[str, Floats] | None = None
    laws: Mapping[str, Node] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)


def source_of(asked: Asked) -> Source:
    """The right trajectory of a question. Raises ValueProblem where there is none."""
    if asked.report is not None:
        return _of_report(asked, asked.report)
    if isinstance(asked.value, dict) and set(asked.value) == {"csv"}:
        return _of_table(asked.value["csv"])
    if isinstance(asked.value, dict) and set(asked.value) == {TIME, "columns"}:
        return _of_formulas(asked.value[TIME], asked.value["columns"])
    raise ValueProblem("expected `csv`, or `t: [start, stop, step]` and `columns`", path=("answer",))


def _of_table(text: Tree) -> Source:
    try:
        columns = read_columns(text if isinstance(text, str) else "")
    except Unreadable as unreadable:
        finding = unreadable.finding
        what = f"{finding.place}: {CODES[finding.code]}" if finding.place else CODES[finding.code]
        raise ValueProblem(what, path=("answer", "csv")) from None
    times = columns.pop(TIME, np.zeros(0))
    if len(times) < LEAST_SAMPLES or not (np.diff(times) > 0).all():
        raise ValueProblem(
            f"expected a column `t` of at least {LEAST_SAMPLES} ascending times", path=("answer", "csv")
        )
    names = tuple(columns)
    return Source(times, columns, names, (names,), remedy="give more rows, with more digits")


def _of_formulas(span: Tree, texts: Tree) -> Source:
    times = _times(span)
    if not isinstance(texts, dict) or not texts:
        raise ValueProblem("expected formulas of `t` by their names", path=("answer", "columns"))
    formulas, columns = {}, {}
    for name, text in texts.items():
        place = ("answer", "columns", name)
        try:
            name, expression = read_name(name), parse(str(text))
        except ValueProblem:
            raise ValueProblem("expected a name, and an expression", path=place) from None
        if not expression.names <= {TIME}:
            raise ValueProblem("expected a formula of `t` and numbers alone", path=place)
        formulas[name] = expression.root
        values = evaluation.array(expression.root, {TIME: times})
        columns[name] = np.broadcast_to(values, times.shape)
        if not np.isfinite(values).all():
            raise ValueProblem("has no finite real value at some of the times", path=place)
    names = tuple(columns)
    return Source(times, columns, names, (names,), formulas=formulas)


def _times(span: Tree) -> Floats:
    """At least so many times as `[start, stop, step]` tell."""
    place = ("answer", TIME)
    try:
        second = parse_unit("s")
        start, stop, step = (read_number(str(entry), second) for entry in span)
    except (Unreadable, TypeError, ValueError):
        raise ValueProblem("expected `[start, stop, step]`, three numbers", path=place) from None
    if not (start < stop and 0 < step <= stop - start and (stop - start) / step < MOST_SAMPLES):
        raise ValueProblem("expected a start before the stop, and a step between them", path=place)
    return np.linspace(start, stop, max(FORMULA_SAMPLES, round((stop - start) / step) + 1))


def _of_report(asked: Asked, report: Report) -> Source:
    table = _table(report, asked.path[1])
    columns = _columns(table)
    times = columns.pop(TIME)
    if len(times) < LEAST_SAMPLES:
        raise ValueProblem(f"expected at least {LEAST_SAMPLES} samples of the trajectory", path=("document",))
    keys = (".".join(asked.path[2:]),) if len(asked.path) > 2 else BY_DEFAULT[table.key]
    orbit = table.key == "orbit"
    document = asked.document
    return Source(
        times,
        columns,
        tuple(name for key in keys for name in _below(table, key)),
        tuple(_below(table, key) for key in ("q", "p")) if orbit else tuple(c.cells for c in table.columns),
        f"raise `{SECTIONS[table.key]}.samples`",
        vectors=not orbit,
        angles=() if orbit else tuple(name for name in ANGLES if name in columns),
        other=None if asked.second is None else _columns(_table(asked.second, table.key)),
        laws=_laws(report) if orbit else {},
        constants={name: float(value) for name, value in document.values.items()} if document else {},
    )


def _table(report: Report, key: str) -> Table:
    """The table of samples."""
    found = next((table for table in report.tables if table.key == key and key in BY_DEFAULT), None)
    if found is None:
        raise ValueProblem("this result is no trajectory", path=("ask",))
    return found


def _columns(table: Table) -> dict[str, Floats]:
    return {cell.name: np.asarray(cell.values, dtype=np.float64) for cell in cells(table)}


def _below(table: Table, key: str) -> tuple[str, ...]:
    """The names of the columns that are at a key, or below it; of `p.x` the column p_x."""
    return tuple(
        name
        for column in table.columns
        if column.key == key or column.key.startswith(f"{key}.")
        for name in column.cells
    )


def _laws(report: Report) -> dict[str, Node]:
    """What the study says is conserved: H where it has one form, and momenta."""
    tree = report.tree()
    trees = {name: Name(name) if name != "H" else tree["hamiltonian"] for name in tree["conserved"]}
    return {name: root for name, root in trees.items() if isinstance(root, get_args(Node))}
