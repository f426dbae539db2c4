"""The motions that answers are compared with: tables, formulas of the time, or the results of a document."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from rigidcli.check.base import Asked, Tree, Unreadable
from rigidcli.check.numbers import margin, read_number
from rigidcli.check.question import Question
from rigidcli.check.tables import SECOND, TIME, read_table
from rigidcli.core.arithmetic import Floats
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.language import evaluation, tree
from rigidcli.language.expression import parse
from rigidcli.report import single_cells

BY_DEFAULT = {"orbit": ("q", "p"), "trajectory": ("omega",)}
"""The columns of each table of results that are judged where the question lists none, by their keys."""

ANGLES = re.compile(r"(theta|phi|psi|alpha|beta|gamma)_?[0-9]*")
"""The usual names of angles."""

LEAST_SAMPLES, FORMULA_SAMPLES, MOST_SAMPLES = 11, 4001, 1_000_000
"""The fewest rows of a key, those that are worked out of formulas at least, and the most."""

OFF = 0.25
"""The part of a margin by which interpolation may be off."""

NOISE = 1e-9
"""A column below this, in units of the largest, is zero but for rounding and integration."""

MAGNIFIED = 3
"""The digits that a motion may lose: an ordinary integration, with an error of 1e-6, is then off by 0.001."""

Columns: TypeAlias = Callable[[Floats], Floats]
"""The columns (k by m) at any times (k)."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right: the `columns` (m), as `values` (n by m) at ascending `times` (n).

    `margins` (m) are the errors that are allowed, `periods` (m) those of angles, infinite for other columns.
    Columns of an answer without a unit are in `units`. The `reference` has the columns at any time; a key of
    few rows has none. With a mistake, the columns of an answer stand in the `order`.
    """

    columns: tuple[str, ...]
    times: Floats
    values: Floats
    margins: Floats
    periods: Floats
    units: tuple[Unit | None, ...]
    reference: Columns | None = None
    order: tuple[int, ...] = ()

    @property
    def start(self) -> float:
        """When the motion begins."""
        return float(self.times[0])

    @property
    def span(self) -> float:
        """How long it is."""
        return float(self.times[-1] - self.times[0])


def spline(times: Floats, values: Floats, margins: Floats) -> Columns | None:
    """The spline through samples (n by m) that is sure to be near enough between them; None without one.

    Its error is estimated from every second sample, by which the others are missed by more.
    """
    from scipy.interpolate import make_interp_spline

    for degree in (5, 3, 1):  # the low ones are better where a motion is not smooth
        if degree < len(times[::2]):
            with suppress(np.linalg.LinAlgError):  # samples that are very near to each other
                half = make_interp_spline(times[::2], values[::2], degree)(times[1:-1:2])
                # Halving the step makes the error of a line four times smaller, and others even more.
                if (np.abs(half - values[1:-1:2]).max(axis=0, initial=0.0) <= 4 * OFF * margins).all():
                    found: Columns = make_interp_spline(times, values, degree)
                    return found
    return None


def smooth(values: Floats, periods: Floats) -> Floats:
    """Columns (n by m) without the jumps of angles by a turn."""
    unwrapped = [
        np.unwrap(column) if turn < np.inf else column for column, turn in zip(values.T, periods, strict=True)
    ]
    return np.column_stack(unwrapped)


def text_of(answer: Tree) -> str:
    """The table of an answer. Raises Unreadable."""
    text = answer["csv"] if isinstance(answer, dict) and set(answer) == {"csv"} else answer
    if not isinstance(text, str) or "\n" not in text.strip():
        hint = "expected `{file: orbit.csv}`, or `csv: |` and the table"
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {hint}")
    return text


class Table(NamedTuple):
    """Times (n) and columns (n each) in SI units, the names that are judged by default, and units.

    `horizon` is the part of the span until which the motion can be predicted.
    """

    columns: dict[str, Floats]
    default: Sequence[str]
    units: Mapping[str, Unit | None]
    horizon: float = 1.0


def key_of(asked: Asked) -> Key:
    """The key of a trajectory. Raises ValueProblem for what is none, and for options that do not fit."""
    return _key(asked.question, _of_literal(asked.value) if asked.report is None else _of_report(asked))


@np.errstate(all="ignore")
def _key(question: Question, table: Table) -> Key:
    """The key of a question. Raises ValueProblem for options that do not fit."""
    times = table.columns.pop(TIME)
    names = question.columns or tuple(table.default)
    for option, given in (("columns", question.columns), ("angles", question.angles)):
        for name in given:
            if name not in table.columns:
                hint = f"there are {', '.join(table.columns)}"
                raise ValueProblem(f"the key has no column {shown(name)}", path=(option,), hint=hint)
    if not names or len(set(names)) < len(names):
        raise ValueProblem("expected columns to judge, each once", path=("columns",))
    known = times <= times[0] + table.horizon * (times[-1] - times[0])
    if known.sum() < LEAST_SAMPLES or not (np.diff(times) > 0).all():
        raise ValueProblem(f"expected a key of at least {LEAST_SAMPLES} rows at ascending times")
    times, values = times[known], np.column_stack([table.columns[name] for name in names])[known]
    is_angle = [name in question.angles or ANGLES.fullmatch(name) is not None for name in names]
    periods = np.where(is_angle, 2 * math.pi, np.inf)
    values = smooth(values, periods)
    sizes = np.minimum(np.abs(values).max(axis=0), periods / 2)
    sizes = np.where(sizes <= NOISE * sizes.max(), sizes.max() or 1.0, sizes)
    margins = np.array([margin(size, question.tolerance) for size in sizes.tolist()])
    if (margins >= periods / 4).any():
        raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
    units = tuple(table.units.get(name) for name in names)
    return Key(names, times, values, margins, periods, units, spline(times, values, margins))


def _of_report(asked: Asked) -> Table:
    """The samples of a report, and the columns at the path that is asked. Raises ValueProblem."""
    assert asked.report is not None
    name = asked.path[1] if len(asked.path) > 1 else ""
    table = next((each for each in asked.report.tables if each.key == name and name in BY_DEFAULT), None)
    if table is None or asked.path[2:] == (TIME,):
        raise ValueProblem("this result is no trajectory", path=("ask",))
    cells = {each.cells[0]: each for each in single_cells(table)}
    columns = {name: np.asarray(each.values, dtype=np.float64) for name, each in cells.items()}
    asks = (".".join(asked.path[2:]),) if len(asked.path) > 2 else BY_DEFAULT[name]
    keys = [f"{each.key}." for each in table.columns for _ in each.cells]
    default = [
        name
        for name, key in zip(cells, keys, strict=True)
        if key.startswith(tuple(f"{ask}." for ask in asks))
    ]
    units = {name: parse_unit(each.unit) if each.unit else None for name, each in cells.items()}
    return Table(columns, default, units, _horizon(asked))


def _horizon(asked: Asked) -> float:
    """The part of the span until which a motion can be predicted. Raises ValueProblem where that is unknown.

    In a chaotic motion digits are lost evenly; the report tells how many are left at the end.
    """
    results = {} if asked.report is None else asked.report.tree()
    digits = results.get("trusted_digits", results.get("orbit", {}).get("trusted_digits"))
    if digits is None:
        return 1.0
    if digits < 1:
        hint = "ask for a shorter time, or lower the tolerance of the orbit itself"
        raise ValueProblem("only a small part of this motion can be predicted", hint=hint)
    section = getattr(asked.document, "orbit", None) or getattr(asked.document, "motion", None)
    tolerance = float(getattr(section, "tolerance", None) or DEFAULT_TOLERANCE)
    return MAGNIFIED / max(MAGNIFIED, -math.log10(tolerance) - float(digits))


def _of_literal(value: Tree) -> Table:
    """A table, or formulas of the time. Raises ValueProblem."""
    if isinstance(value, dict) and set(value) == {TIME, "columns"}:
        return _of_formulas(value[TIME], value["columns"])
    found = read_table(text_of(value))
    if TIME not in found:
        raise ValueProblem("expected a column `t` of times", path=("answer",))
    columns = {name: column.in_si(None if name != TIME else SECOND) for name, column in found.items()}
    return Table(
        columns, [name for name in found if name != TIME], {name: each.unit for name, each in found.items()}
    )


def _of_formulas(span: Tree, texts: Tree) -> Table:
    """The columns of formulas of `t`, at as many times as they ask for or more. Raises ValueProblem."""
    columns = {TIME: _times(span)}
    for name, text in texts.items() if isinstance(texts, dict) else ():
        place = ("answer", "columns", name)
        try:
            root = parse(str(text)).root
        except ExpressionError as error:
            raise ValueProblem(error.message, path=place) from None
        if not tree.names_in(root) <= {TIME} or name == TIME:
            raise ValueProblem("expected a formula of `t` and numbers alone", path=place)
        columns[str(name)] = evaluation.array(root, {TIME: columns[TIME]}) + 0 * columns[TIME]
        if not np.isfinite(columns[str(name)]).all():
            raise ValueProblem("has no finite real value at some of the times", path=place)
    return Table(columns, list(columns)[1:], {})


def _times(span: Tree) -> Floats:
    """At least as many times as `[start, stop, step]` asks for. Raises ValueProblem."""
    try:
        start, stop, step = (read_number(entry, SECOND).value for entry in span)
    except (Unreadable, TypeError, ValueError):
        start, stop, step = 0.0, 0.0, 0.0
    if not (start < stop and 0 < step <= stop - start and (stop - start) / step < MOST_SAMPLES):
        hint = "write three numbers, the start before the stop, and a step that fits between"
        raise ValueProblem("expected `[start, stop, step]`", path=("answer", TIME), hint=hint)
    return np.linspace(start, stop, max(FORMULA_SAMPLES, round((stop - start) / step) + 1))
