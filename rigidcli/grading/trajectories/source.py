"""Where the key of a trajectory is from: formulas of the time, a table, or the report on a document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.document.parameters import read_name
from rigidcli.errors import ValueProblem
from rigidcli.fields.units import parse_unit
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.factors import TURN
from rigidcli.grading.numbers import read_number
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.trajectories.tables import TIME, read_columns
from rigidcli.language import evaluation
from rigidcli.language.expression import parse
from rigidcli.language.tree import Name, Node, Sum
from rigidcli.report import Report, Table, single_cells

ANGLES = ("phi", "psi")
"""Columns of a motion that are angles without being listed; theta goes from 0 to pi and back."""

BY_DEFAULT = {"orbit": ("q", "p"), "trajectory": ("omega",)}
"""The columns of each table that are judged where the question lists none, by their keys."""

SECTIONS = {"orbit": "orbit", "trajectory": "motion"}
"""The sections of a document that these tables are from."""

LEAST_SAMPLES, MOST_SAMPLES = 11, 1_000_000
"""Of a table, and of formulas; fewer would leave longer gaps than an answer may have."""

FORMULA_SAMPLES = 4001
"""Of formulas, from which sizes are told."""

SHIFTS = (0.5, 1.7, 2.9, 4.1, 5.3)
"""By which an angle is changed to see that a function depends on it at all (rad)."""

NOTHING, SOMETHING = 1e-6, 1e-9
"""A turn changes nothing below the first part of what these do, and they nothing below that of all terms."""

MOST_STATES = 50
"""States at which this is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The right `columns` by name (n each) at `times` (n), which are ascending; perhaps by `formulas` of t.

    Where a question lists none, the `default` ones are judged, and `known` ones if they are handed in.
    `families` are names of columns whose sizes can be compared; in those of `vectors`, small components are
    rounding noise; `sizes` are those of others that are not told by their values. `angles` are such by their
    meaning, `turning` coordinates by the equations alone; `modular` are the columns that a `modulo` is of
    without a list of angles. `rates` are angular velocities.
    """

    times: Floats
    columns: Mapping[str, Floats]
    default: tuple[str, ...]
    families: tuple[tuple[str, ...], ...]
    known: tuple[str, ...] = ()
    vectors: bool = False
    sizes: Mapping[str, float] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    turning: tuple[str, ...] = ()
    modular: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    remedy: str = ""
    """How to get more samples, where there can be more."""
    formulas: Mapping[str, Node] | None = None
    other: Mapping[str, Floats] | None = None
    """The columns of a second, coarser run (n each, by name, `t` among them)."""
    in_si: bool = False
    """Whether they are in SI units."""
    laws: Mapping[str, Node] = field(default_factory=dict)
    """What is conserved, by name."""
    constants: Mapping[str, float] = field(default_factory=dict)
    """The values of names that are no columns."""


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
    return Source(times, columns, names, (names,), modular=names)


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
    return Source(times, columns, names, (names,), modular=names, formulas=formulas)


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
    if asked.path[2:] == (TIME,):
        raise ValueProblem("the times are the student's own", path=("ask",))
    table, columns = _table(report, asked.path[1])
    times = columns.pop(TIME)
    if len(times) < LEAST_SAMPLES:
        raise ValueProblem(f"expected at least {LEAST_SAMPLES} samples of the trajectory", path=("document",))
    keys = (".".join(asked.path[2:]),) if len(asked.path) > 2 else BY_DEFAULT[table.key]
    default = tuple(name for key in keys for name in _below(table, key))
    constants = {} if asked.document is None else asked.document.values
    angles = tuple(name for name in ANGLES if name in columns)
    source = Source(
        times,
        columns,
        default,
        tuple(column.cells for column in table.columns),
        () if len(asked.path) > 2 else tuple(name for name in columns if name not in default),
        vectors=True,
        angles=angles,
        modular=angles,
        rates=_below(table, "omega"),
        remedy=f"raise `{SECTIONS[table.key]}.samples`",
        other=None if asked.second is None else _table(asked.second, table.key)[1],
        in_si=True,
        constants={name: float(value) for name, value in constants.items()},
    )
    return _orbit(source, table, report) if table.key == "orbit" else source


def _orbit(source: Source, table: Table, report: Report) -> Source:
    """An orbit: with what it conserves, and the angles among its coordinates."""
    tree = report.tree()
    coordinates = _below(table, "q")
    energy = None if tree.get("hamiltonian") is None else to_tree(tree["hamiltonian"])
    laws: dict[str, Node] = {name: Name(name) for name in tree["conserved"] if name != "H"}
    if energy is not None and "H" in tree["conserved"]:
        laws["H"] = energy
    orbit = replace(
        source,
        families=(coordinates, _below(table, "p")),
        vectors=False,
        angles=(),
        modular=coordinates,
        laws=laws,
    )
    known: dict[str, float | Floats] = {**source.constants, **source.columns, TIME: source.times}
    if energy is None or not names_in(energy) <= known.keys():
        return orbit
    turning = _angles(energy, coordinates, source.times, known)
    return replace(orbit, sizes={"H": size_of_terms(energy, known)}, turning=turning)


def _table(report: Report, key: str) -> tuple[Table, dict[str, Floats]]:
    """The table of samples, and its columns by name."""
    found = next((table for table in report.tables if table.key == key and key in BY_DEFAULT), None)
    if found is None:
        raise ValueProblem("this result is no trajectory", path=("ask",))
    cells = single_cells(found)
    return found, {cell.cells[0]: np.asarray(cell.values, dtype=np.float64) for cell in cells}


def _below(table: Table, key: str) -> tuple[str, ...]:
    """The names of the columns that are at a key, or below it; of `p.x` the column p_x."""
    return tuple(
        name
        for column in table.columns
        if column.key == key or column.key.startswith(f"{key}.")
        for name in column.cells
    )


def size_of_terms(root: Node, values: Mapping[str, float | Floats]) -> float:
    """The largest sum of the sizes of the terms of a function."""
    terms = root.terms if isinstance(root, Sum) else (root,)
    return float(np.max(sum(np.abs(evaluation.array(term, values)) for term in terms)))


def _angles(
    root: Node, coordinates: tuple[str, ...], times: Floats, values: Mapping[str, float | Floats]
) -> tuple[str, ...]:
    """The coordinates on which a function depends, and which it does not tell from those a turn further.

    It is tried along a trajectory, in which names have one value, or one for each of the times (n).
    """
    names = names_in(root)
    some = np.linspace(0, len(times) - 1, MOST_STATES).astype(int)
    known = {name: np.broadcast_to(values[name], times.shape)[some] for name in names}
    middle = evaluation.array(root, known)

    def change(name: str, shifts: tuple[float, ...]) -> float:
        changed = [evaluation.array(root, {**known, name: known[name] + shift}) for shift in shifts]
        return float(np.max([np.abs(each - middle) for each in changed]))

    found, least = [], SOMETHING * size_of_terms(root, known)
    for name in coordinates:
        most = change(name, SHIFTS) if name in names else 0.0
        if least < most < np.inf and change(name, (TURN, -TURN)) <= NOTHING * most:
            found.append(name)
    return tuple(found)
