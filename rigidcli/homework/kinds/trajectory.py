"""Trajectories: tables of columns in the time, each judged at its own times until it goes wrong.

Without `columns`, a question asks for the coordinates and momenta of an orbit, or for omega. Columns with the
usual names of angles (`theta1`, `phi`) are judged modulo a turn, and so are those that `angles` lists.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import Ruler
from rigidcli.homework.lists import SECOND, TIME, TypedColumn, read_table, table_text, tabulated
from rigidcli.homework.mistakes import shared_factor
from rigidcli.report import single_cells

# The columns of each table of results that are judged where the question lists none, by their keys.
BY_DEFAULT = {"orbit": ("q", "p"), "trajectory": ("omega",)}
ANGLES = re.compile(r"(theta|phi|psi|alpha|beta|gamma)_?[0-9]*")  # the usual names of angles
QUATERNION = ["q0", "q1", "q2", "q3"]  # the components of an orientation, whose common sign has no meaning
LEAST_SAMPLES = 11

LONGEST_GAP, MOST_MISSING = 0.1, 0.01
"""The longest gap between two rows of an answer, and the time that may be missing at the end, as shares."""

# Times that differ by less than this share of the span are the same: they may be typed with few digits.
SAME_TIME = 1e-6
ZERO_COLUMN = 1e-9  # a column below this share of the largest one is zero, but for errors of integration


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryKey:
    """What is right: the `columns` (m), as `values` (n by m) at ascending `times` (n).

    `margins` (m) are the errors that are allowed, `periods` (m) those of angles, infinite for other columns.
    Columns of an answer without a unit are in `units`. `dense`: samples are close enough to interpolate.
    """

    columns: tuple[str, ...]
    times: Floats
    values: Floats
    margins: Floats
    periods: Floats
    units: tuple[Unit | None, ...]
    dense: bool

    @property
    def span(self) -> float:
        """How long the motion is."""
        return float(self.times[-1] - self.times[0])


class TrajectoryKind(AnswerKind):
    """A motion as a table in time. An answer is an array (k by 1 + m): times, and the columns of the key."""

    name = "trajectory"
    options = frozenset({"columns", "angles"})

    @np.errstate(all="ignore")
    def key(self, source: KeySource) -> TrajectoryKey:
        question = source.question
        table, default = _of_literal(source.value) if source.report is None else _of_report(source)
        columns = {name: each.in_si(SECOND if name == TIME else None) for name, each in table.items()}
        times = columns.pop(TIME)
        names = question.columns or tuple(default)
        for option, given in (("columns", question.columns), ("angles", question.angles)):
            for name in given:
                if name not in columns:
                    hint = f"there are {', '.join(columns)}"
                    raise ValueProblem(f"the key has no column {shown(name)}", path=(option,), hint=hint)
        if not names or len(set(names)) < len(names):
            raise ValueProblem("expected columns to judge, each once", path=("columns",))
        _require_predictable(source)
        if len(times) < LEAST_SAMPLES or not (np.diff(times) > 0).all():
            raise ValueProblem(f"expected a key of at least {LEAST_SAMPLES} rows at ascending times")
        is_angle = [name in question.angles or ANGLES.fullmatch(name) is not None for name in names]
        periods = np.where(is_angle, 2 * math.pi, np.inf)
        values = np.column_stack([columns[name] for name in names])
        values = np.where(np.isfinite(periods), np.unwrap(values, axis=0), values)
        sizes = np.minimum(np.abs(values).max(axis=0), periods / 2)
        sizes = np.where(sizes <= ZERO_COLUMN * sizes.max(), sizes.max() or 1.0, sizes)
        margins = np.array([Ruler(question.tolerance).margin(size) for size in sizes.tolist()])
        if (margins >= periods / 4).any():
            raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
        units = tuple(table[name].unit for name in names)
        off = np.abs(_between(times[::2], values[::2], times[1:-1:2]) - values[1:-1:2]).max(axis=0)
        # If every second row, interpolated, is within the margin, all rows are so surely.
        dense = bool((off <= margins).all())
        return TrajectoryKey(names, times, values, margins, periods, units, dense)

    def loaded(self, answer: Tree, text_of: Callable[[Tree], str]) -> Tree:
        """An answer with the text of the table in the place of its file. Raises Unreadable."""
        if not isinstance(answer, dict) or "file" not in answer:
            return answer
        others = {key: value for key, value in answer.items() if key != "file"}
        return others | {"csv": text_of(answer["file"])}

    def read(self, key: TrajectoryKey, answer: Tree) -> ReadAnswer:
        """The table of an answer, in SI units; a column that is missing is NaN. Raises Unreadable."""
        table = read_table(table_text(answer), (TIME, *key.columns))
        if TIME not in table:
            raise Unreadable("missing_column", "there is no column of times", place=shown(TIME))
        units = dict(zip((TIME, *key.columns), (SECOND, *key.units), strict=True))
        missing = np.full(len(table[TIME].values), np.nan)
        columns = [table[name].in_si(unit) if name in table else missing for name, unit in units.items()]
        rows = np.column_stack(columns)
        heads = ", ".join(name for name in units if name in table)
        count = "1 row" if len(rows) == 1 else f"{len(rows)} rows"
        return ReadAnswer(rows, f"{count} of {heads}, t from {rows[0, 0]:.6g} to {rows[-1, 0]:.6g}")

    @np.errstate(all="ignore")
    def judge(self, key: TrajectoryKey, value: Floats) -> Outcome:
        """The outcome of an answer: each column earns the share of the time until which it is right."""
        later = np.diff(value[:, 0]) > 0
        if not later.all():
            detail = f"row {np.argmin(later) + 2} is not later than the one before"
            return Outcome.earning(0.0, Finding("wrong_order", shown(TIME), detail))
        there = np.asarray(~np.isnan(value[:, 1:]).all(axis=0))
        missing = [Finding("missing_column", shown(key.columns[k])) for k in np.flatnonzero(~there)]
        times, own, expected = compared = _compared(key, value)
        if not key.dense and len(times) < LEAST_SAMPLES:
            why = "the key has few rows, and those of the answer are at other times"
            return Outcome.review(why, *missing)
        until, complete = _reach(key, value[:, 0] if key.dense else times)
        bad = np.abs(_wrapped(key, own - expected)) > key.margins
        wrong = np.asarray(there & bad.any(axis=0))
        ranges = np.ptp(key.values, axis=0)
        moving = ranges > key.margins
        if complete and there.all() and not wrong.any():
            seen = np.ptp(expected, axis=0) >= 0.5 * ranges  # of a swing, not only its returns
            if (seen | ~moving).all():
                return Outcome.correct()
            return Outcome.review("its rows are too few to show the motion")
        start = float(key.times[0])
        first = bad.argmax(axis=0) if len(bad) else np.zeros(len(there), dtype=int)
        ends = np.minimum(until, np.where(wrong, np.append(start, times)[first], until))
        ends = np.where(there, ends, start)
        # Columns that do not move are right without any work: they count where they are wrong.
        counted = moving | wrong | ~there | ~moving.any()
        findings = [*missing, *_said(key, *compared, wrong, first, ends)]
        if not complete:
            detail = f"it is judged until t = {until:.4g} of {key.times[-1]:.4g}"
            findings.append(Finding("time_range_short", detail=detail))
        return Outcome.earning(float((ends[counted] - start).mean() / key.span), *findings)

    def typed(self, key: TrajectoryKey) -> Tree:
        units = [1.0 if unit is None else unit.scale for unit in key.units]
        rows = np.column_stack([key.times, key.values / units]).tolist()
        lines = [(TIME, *key.columns), *(map(repr, row) for row in rows)]
        return {"csv": "\n".join(map(",".join, lines))}


# --- judging


def _compared(key: TrajectoryKey, rows: Floats) -> tuple[Floats, Floats, Floats]:
    """Times (k), what an answer has there, and what is expected (both k by m).

    The times are those of the answer that the key has, too. A quaternion has the sign that is nearer.
    """
    times, inside = rows[:, 0], np.clip(rows[:, 0], key.times[0], key.times[-1])
    nearest = inside if key.dense else key.times[np.abs(times[:, None] - key.times).argmin(axis=1)]
    met = np.abs(times - nearest) <= SAME_TIME * key.span
    times, own, expected = times[met], rows[met, 1:], _between(key.times, key.values, nearest[met])
    if set(QUATERNION) <= set(key.columns):
        places = [key.columns.index(name) for name in QUATERNION]
        sign = np.where((own[:, places] * expected[:, places]).sum(axis=1) < 0, -1.0, 1.0)
        own[:, places] *= sign[:, None]
    return times, own, expected


def _wrapped(key: TrajectoryKey, differences: Floats) -> Floats:
    """Differences of the columns (k by m), those of angles reduced to half a turn at most."""
    own = np.where(np.isfinite(key.periods), key.periods, 1.0)
    # Where the digits of a huge angle do not tell what is left of it, it stays as it is.
    turns = np.isfinite(key.periods) & (np.spacing(np.abs(differences)) <= key.margins / 4)
    return np.where(turns, differences - own * np.round(differences / own), differences)


def _reach(key: TrajectoryKey, times: Floats) -> tuple[float, bool]:
    """The time until which an answer has no gap in its rows, and whether that is the end of the key."""
    start, stop = float(key.times[0]), float(key.times[-1])
    longest = max(LONGEST_GAP * key.span, float(np.diff(key.times).max())) + SAME_TIME * key.span
    own = times[(times >= start - longest) & (times <= stop + longest)]
    if not len(own) or own[0] > start + longest:
        return start, False
    steps = np.diff(own)
    gaps = np.flatnonzero(steps > longest)
    end = float(own[gaps[0]] if len(gaps) else own[-1])
    last = float(np.median(steps)) * (1 + SAME_TIME) if len(steps) else 0.0
    complete = not len(gaps) and end >= stop - max(MOST_MISSING * key.span, last)
    return (stop if complete else max(start, end)), complete


def _said(
    key: TrajectoryKey, times: Floats, own: Floats, expected: Floats, wrong: Mask, first: Floats, ends: Floats
) -> Iterator[Finding]:
    """What is said of wrong columns: the factor that all of them have, or until when they are right."""
    places = np.flatnonzero(wrong).tolist()
    slack = key.margins / np.abs(expected).max(axis=0, initial=0.0)
    columns = ((own[:, [k]], expected[:, [k]], key.units[k], (), float(slack[k])) for k in places)
    codes = {shared_factor(*column) for column in columns}
    if len(codes) == 1 and (code := codes.pop()):
        yield Finding(code, ", ".join(shown(key.columns[k]) for k in places))
        return
    for k in places:
        name, row = key.columns[k], int(first[k])
        code, said = "outside_tolerance", f"it is right until t = {ends[k]:.4g}"
        if not row:
            code, said = "wrong_initial_condition", ""
        reference = f"expected {name} = {expected[row, k]:.6g} at t = {times[row]:.6g}"
        yield Finding(code, shown(name), said, reference)


# --- keys


def _between(times: Floats, values: Floats, at: Floats) -> Floats:
    """The columns (k by m) at any times (k): Hermite's cubic curves through samples (n by m)."""
    slopes = np.gradient(values, times, axis=0, edge_order=2)
    k = np.clip(np.searchsorted(times, at) - 1, 0, len(times) - 2)
    step = (times[k + 1] - times[k])[:, None]
    s = (at - times[k])[:, None] / step
    by_values = (1 - s) ** 2 * (1 + 2 * s) * values[k] + s**2 * (3 - 2 * s) * values[k + 1]
    return np.asarray(by_values + step * s * (1 - s) * ((1 - s) * slopes[k] - s * slopes[k + 1]))


def _of_report(source: KeySource) -> tuple[dict[str, TypedColumn], Sequence[str]]:
    """The columns of a report, and those at the path that is asked. Raises ValueProblem."""
    assert source.report is not None
    name = source.path[1] if len(source.path) > 1 else ""
    table = next((each for each in source.report.tables if each.key == name and name in BY_DEFAULT), None)
    if table is None or source.path[2:] == (TIME,):
        raise ValueProblem("this result is no trajectory", path=("ask",))
    asks = (".".join(source.path[2:]),) if len(source.path) > 2 else BY_DEFAULT[name]
    beginnings = tuple(f"{ask}." for ask in asks)
    columns, asked = dict[str, TypedColumn](), list[str]()
    for each in single_cells(table):
        unit = parse_unit(each.unit) if each.unit else None
        columns[each.cells[0]] = TypedColumn(each.cells[0], unit, np.array(each.values))
        asked += each.cells if f"{each.key}.".startswith(beginnings) else ()
    return columns, asked


def _require_predictable(source: KeySource) -> None:
    """Raise ValueProblem for a chaotic motion, whose end an ordinary integration gets wrong."""
    results = {} if source.report is None else source.report.tree
    digits = results.get("trusted_digits", results.get("orbit", {}).get("trusted_digits"))
    section = getattr(source.document, "orbit", None) or getattr(source.document, "motion", None)
    tolerance = float(getattr(section, "tolerance", None) or DEFAULT_TOLERANCE)
    if digits is not None and -math.log10(tolerance) - float(digits) > 3:
        # An ordinary integration, with an error of 1e-6, may be off by 0.001.
        hint = "ask for a shorter time, or lower the tolerance of the orbit itself"
        raise ValueProblem("only a part of this motion can be predicted", hint=hint)


def _of_literal(value: Tree) -> tuple[dict[str, TypedColumn], Sequence[str]]:
    """A table, or formulas of the time, and the columns beside the time. Raises ValueProblem."""
    if isinstance(value, dict) and set(value) == {TIME, "columns"}:
        columns = tabulated(value[TIME], value["columns"])
    else:
        columns = read_table(table_text(value))
    if TIME not in columns:
        raise ValueProblem("expected a column `t` of times", path=("answer",))
    return columns, [name for name in columns if name != TIME]
