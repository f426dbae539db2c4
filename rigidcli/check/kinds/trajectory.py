"""Trajectories: tables of columns in the time, each judged at its own times until it goes wrong.

Without `columns`, a question asks for the coordinates and momenta of an orbit, or for omega. Columns with the
usual names of angles (`theta1`, `phi`) are judged modulo a turn, and so are those that `angles` lists.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import ClassVar, TypeAlias

import numpy as np

from rigidcli.check.base import (
    Asked,
    Finding,
    Kind,
    Outcome,
    Reading,
    Tree,
    Unreadable,
    correct,
    earning,
    review,
)
from rigidcli.check.factors import common_factor
from rigidcli.check.numbers import margin, read_number, scale_in
from rigidcli.check.question import Question
from rigidcli.check.tables import TIME, Column, read_table
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.language import evaluation, tree
from rigidcli.language.expression import parse
from rigidcli.model.sampling import DEFAULT_TOLERANCE
from rigidcli.model.units import Unit, parse_unit
from rigidcli.report import single_cells

BY_DEFAULT = {"orbit": ("q", "p"), "trajectory": ("omega",)}
"""The columns of each table of results that are judged where the question lists none, by their keys."""

QUATERNION = ("q0", "q1", "q2", "q3")
"""The components of an orientation, whose common sign has no meaning."""

ANGLES = re.compile(r"(theta|phi|psi|alpha|beta|gamma)_?[0-9]*")
"""The usual names of angles."""

TURN = 2 * math.pi

LEAST_SAMPLES, MOST_SAMPLES = 11, 1_000_000
"""The fewest rows of a key, which leave gaps as long as an answer may have, and the most."""

FORMULA_SAMPLES = 4001
"""Rows that are worked out of formulas where these ask for fewer."""

GAP = 0.1
"""The longest gap between two rows of an answer, in units of the span."""

SHORT = 0.01
"""The part of the span that may be missing at the end: a last step often falls short of it."""

SAME_TIME = 1e-6
"""How far times that are the same may be apart, in units of the span: they may be typed with few digits."""

OFF = 0.25
"""The part of a margin by which interpolation may be off."""

SHOWN = 0.5
"""The part of the range of a column that the rows must show: of a swing, not only its returns."""

MAGNIFIED = 3
"""The digits that a motion may lose: an ordinary integration, with an error of 1e-6, is then off by 0.001."""

TOO_FAR = "the key has few rows, and those of the answer are at other times, too far apart to compare"


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right: the `columns` (m), as `values` (n by m) at ascending `times` (n).

    `margins` (m) are the errors that are allowed, `periods` (m) those of angles, infinite for other columns.
    Columns of an answer without a unit are in `units`. An integration loses so many digits as are `lost` by
    the last row. The `reference` has the columns at any time; a key of few rows has none. With a mistake, the
    columns of an answer stand in an `exchanged` order.
    """

    question: Question
    columns: tuple[str, ...]
    times: Floats
    values: Floats
    margins: Floats
    periods: Floats
    units: tuple[Unit | None, ...]
    reference: Callable[[Floats], Floats] | None = None
    exchanged: tuple[int, ...] = ()

    @property
    def span(self) -> float:
        """How long the motion is."""
        return float(self.times[-1] - self.times[0])

    @property
    def quaternion(self) -> list[int]:
        """The places of the components of an orientation, if all of them are judged."""
        places = [self.columns.index(name) for name in QUATERNION if name in self.columns]
        return places if len(places) == len(QUATERNION) else []


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an answer has: `times` (k), and the columns of the key (k by m), NaN where one is missing."""

    times: Floats
    values: Floats


class Trajectory(Kind):
    """A motion as a table in time."""

    name: ClassVar[str] = "trajectory"
    options: ClassVar[frozenset[str]] = frozenset({"columns", "angles"})

    def key(self, asked: Asked) -> Key:
        """The key of a trajectory. Raises ValueProblem for what is none, and for options that do not fit."""
        table = _of_report(asked) if asked.report is not None else _of_literal(asked.value)
        return _key(asked.question, *table, _horizon(asked))

    def read(self, key: Key, answer: Tree, folder: Path) -> Reading:
        """The table of an answer, in SI units. Raises Unreadable."""
        found = read_table(_text(answer), (TIME, *key.columns))
        if TIME not in found:
            raise Unreadable("missing_column", "there is no column of times", place=shown(TIME))
        second = parse_unit("s")
        times = _in_si(found[TIME], second)
        missing = np.full(len(times), np.nan)
        columns = [
            _in_si(found[name], unit) if name in found else missing
            for name, unit in zip(key.columns, key.units, strict=True)
        ]
        heads = ", ".join(name for name in (TIME, *key.columns) if name in found)
        read_as = f"{len(times)} rows of {heads}, t from {times[0]:.6g} to {times[-1]:.6g}"
        return Reading(Rows(times, np.column_stack(columns)), read_as)

    @np.errstate(all="ignore")
    def judge(self, key: Key, value: Rows) -> Outcome:
        """The outcome of an answer: each column earns the share of the time until which it is right."""
        later = np.diff(value.times) > 0
        if not later.all():
            row = int(np.argmin(later)) + 2
            return earning(
                0.0, Finding("wrong_order", shown(TIME), f"row {row} is not later than the one before")
            )
        values = value.values[:, key.exchanged] if key.exchanged else value.values
        there = np.asarray(~np.isnan(values).all(axis=0))
        missing = [Finding("missing_column", shown(key.columns[k])) for k in np.flatnonzero(~there)]
        seen = _compared(key, Rows(value.times, values))
        if isinstance(seen, str):
            return review(seen, *missing)
        times, own, expected = seen
        if not len(times):
            return earning(0.0, *missing, Finding("time_range_short"))
        off = np.abs(_wrapped(key, own - expected)) / key.margins
        until, complete = _reach(key, times if key.reference is None else value.times)
        wrong = np.asarray(there & (off > 1).any(axis=0))
        first = np.where(wrong, np.argmax(off > 1, axis=0), len(times))
        ends = np.array(
            [
                _end(times, row, until, key) if ok else key.times[0]
                for row, ok in zip(first, there, strict=True)
            ]
        )
        if complete and not wrong.any() and there.all():
            moved = np.ptp(expected, axis=0) >= SHOWN * np.ptp(key.values, axis=0)
            still = np.ptp(key.values, axis=0) <= key.margins
            return correct() if (moved | still).all() else review("its rows are too few to show the motion")
        share = _share(key, ends, there & ~wrong, complete)
        findings = [*missing, *self._said(key, times, own, expected, wrong, first, ends)]
        if not complete:
            detail = f"it is judged until t = {until:.4g} of {key.times[-1]:.4g}"
            findings.append(Finding("time_range_short", detail=detail))
        return earning(share, *findings)

    def _said(
        self, key: Key, times: Floats, own: Floats, expected: Floats, wrong: Mask, first: Floats, ends: Floats
    ) -> Iterator[Finding]:
        """What is said of wrong columns: a factor that all of them have, or until when they are right."""
        places = np.flatnonzero(wrong).tolist()
        codes = {_factor(key, k, own[:, k], expected[:, k]) for k in places}
        if len(codes) == 1 and (code := codes.pop()):
            yield Finding(code, _names(key, places))
            return
        for k in places:
            row = int(first[k])
            told = f"expected {key.columns[k]} = {expected[row, k]:.6g} at t = {times[row]:.6g}"
            if row == 0:
                yield Finding("wrong_initial_condition", shown(key.columns[k]), reference=told)
            else:
                until = f"it is right until t = {ends[k]:.4g}"
                yield Finding("outside_tolerance", shown(key.columns[k]), until, told)

    def typed(self, key: Key) -> Tree:
        """The rows of the key."""
        units = [1.0 if unit is None else unit.scale for unit in key.units]
        rows = np.column_stack([key.times, key.values / units]).tolist()
        lines = [",".join((TIME, *key.columns)), *(",".join(map(repr, row)) for row in rows)]
        return {"csv": "\n".join(lines)}


def _names(key: Key, places: Sequence[int]) -> str:
    return ", ".join(shown(key.columns[place]) for place in places)


def _text(answer: Tree) -> str:
    """The table of an answer. Raises Unreadable."""
    if isinstance(answer, dict) and len(answer) == 1 and isinstance(answer.get("csv"), str):
        return str(answer["csv"])
    if isinstance(answer, str) and "\n" in answer.strip():
        return answer
    hint = "expected `{file: orbit.csv}`, or `csv: |` and the table"
    raise Unreadable("wrong_shape", f"read {shown(answer)}, {hint}")


def _in_si(column: Column, unit: Unit | None) -> Floats:
    """The numbers of a column in SI units, without a unit of its own in `unit`. Raises Unreadable."""
    if column.unit is None:
        return column.values * (1.0 if unit is None else unit.scale)
    if unit is None:
        return column.values * column.unit.scale
    try:
        return column.values * scale_in(column.unit, unit.dimension)
    except ValueProblem as problem:
        raise Unreadable("unit_incompatible", problem.message, place=shown(column.name)) from None


# --- judging


def _wrapped(key: Key, differences: Floats) -> Floats:
    """Differences of the columns (k by m), those of angles to the nearest of their turns."""
    turns = np.isfinite(key.periods)
    own = np.where(turns, key.periods, 1.0)
    # Where the digits of a huge angle do not tell what is left of it, it stays as it is.
    turns = turns & (np.spacing(np.abs(differences)) <= OFF * key.margins)
    return np.where(turns, differences - own * np.round(differences / own), differences)


def _compared(key: Key, rows: Rows) -> tuple[Floats, Floats, Floats] | str:
    """Times (k), what an answer has there and what is expected (k by m), or why they cannot be compared."""
    start, stop, slack = key.times[0], key.times[-1], SAME_TIME * key.span
    if key.reference is not None:
        inside = (rows.times >= start - slack) & (rows.times <= stop + slack)
        times, own = rows.times[inside], rows.values[inside]
        expected = key.reference(np.clip(times, start, stop))
    else:
        near = np.abs(rows.times[:, None] - key.times).argmin(axis=0)
        met = np.abs(rows.times[near] - key.times) <= slack
        times, expected = key.times[met], key.values[met]
        own = rows.values[near[met]]
        if not met.all() and len(times) < LEAST_SAMPLES:
            between = _spline(rows.times, _smooth(np.nan_to_num(rows.values), key), key.margins)
            if between is None:
                return TOO_FAR
            covered = (key.times >= rows.times[0] - slack) & (key.times <= rows.times[-1] + slack)
            times, expected = key.times[covered], key.values[covered]
            own = np.where(np.isnan(rows.values).all(axis=0), np.nan, between(times))
    places = key.quaternion
    if places:
        sign = np.where((own[:, places] * expected[:, places]).sum(axis=1) < 0, -1.0, 1.0)
        own = own.copy()
        own[:, places] *= sign[:, None]
    return times, own, expected


def _reach(key: Key, times: Floats) -> tuple[float, bool]:
    """The time until which the rows of an answer follow each other closely, and whether that is the end."""
    start, stop = float(key.times[0]), float(key.times[-1])
    longest = max(GAP * key.span, float(np.diff(key.times).max())) + SAME_TIME * key.span
    own = times[(times >= start - longest) & (times <= stop + longest)]
    if not len(own) or own[0] > start + longest:
        return start, False
    gaps = np.flatnonzero(np.diff(own) > longest)
    end = float(own[gaps[0]] if len(gaps) else own[-1])
    step = float(np.median(np.diff(own))) if len(own) > 1 else 0.0
    complete = not len(gaps) and end >= stop - max(SHORT * key.span, step * (1 + SAME_TIME))
    return (stop if complete else max(start, end)), complete


def _end(times: Floats, row: int, until: float, key: Key) -> float:
    """The time until which a column is right that is wrong in this row first."""
    if row >= len(times):
        return until
    return min(until, float(times[row - 1])) if row else float(key.times[0])


def _share(key: Key, ends: Floats, right: Mask, complete: bool) -> float:
    """The mean part of the time until which the columns are right.

    Columns that do not move are right without any work: they count where they are wrong, or where none moves.
    """
    moving = np.ptp(key.values, axis=0) > key.margins
    counted = moving | ~right if moving.any() else np.ones(len(ends), dtype=bool)
    return float(((ends - key.times[0]) / key.span)[counted].mean())


def _factor(key: Key, place: int, own: Floats, expected: Floats) -> str | None:
    """The code of the one factor by which a column is wrong, told from its larger half."""
    large = np.abs(expected) >= np.abs(expected).max() / 2
    ratios = own[large] / expected[large]
    middle = float(np.median(ratios))
    slack = float(key.margins[place] / np.abs(expected).max())
    if (
        not math.isfinite(middle)
        or not (np.abs(own - middle * expected) <= abs(middle) * key.margins[place]).all()
    ):
        return None
    return common_factor(middle, key.units[place], (), slack)


# --- interpolation

Columns: TypeAlias = Callable[[Floats], Floats]
"""The columns (k by m) at any times (k)."""

DEGREES = (5, 3, 1)
"""Degrees of splines: the low ones are better where a motion is not smooth."""


def _spline(times: Floats, values: Floats, margins: Floats) -> Columns | None:
    """The spline through samples (n by m) that is sure to be near enough between them; None without one.

    Its error is estimated from every second sample, by which the others are missed by more.
    """
    from scipy.interpolate import make_interp_spline

    for degree in DEGREES:
        if degree < len(times[::2]):
            with suppress(np.linalg.LinAlgError):  # samples that are very near to each other
                half = make_interp_spline(times[::2], values[::2], degree)(times[1:-1:2])
                # Halving the step makes the error of a line four times smaller, and others even more.
                if (np.abs(half - values[1:-1:2]).max(axis=0, initial=0.0) <= 4 * OFF * margins).all():
                    found: Columns = make_interp_spline(times, values, degree)
                    return found
    return None


def _smooth(values: Floats, key: Key) -> Floats:
    """Columns (n by m) without the jumps of angles by a turn, and of orientations to the opposite sign."""
    values = values.copy()
    for place in np.flatnonzero(np.isfinite(key.periods)):
        values[:, place] = np.unwrap(values[:, place])
    places = key.quaternion
    if places:
        turned = (values[1:, places] * values[:-1, places]).sum(axis=1) < 0
        values[1:, places] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    return values


# --- keys

Table: TypeAlias = tuple[Floats, Mapping[str, Floats], Sequence[str], Mapping[str, Unit | None]]
"""Times (n), columns (n each) by name, the names that are judged by default, and units."""


@np.errstate(all="ignore")
def _key(
    question: Question,
    times: Floats,
    columns: Mapping[str, Floats],
    default: Sequence[str],
    units: Mapping[str, Unit | None],
    horizon: float,
) -> Key:
    """The key of a question. Raises ValueProblem for options that do not fit."""
    names = question.columns or tuple(default)
    for option, given in (("columns", question.columns), ("angles", question.angles)):
        for name in given:
            if name not in columns:
                hint = f"there are {', '.join(columns)}"
                raise ValueProblem(f"the key has no column {shown(name)}", path=(option,), hint=hint)
    if not names or len(set(names)) < len(names):
        raise ValueProblem("expected columns to judge, each once", path=("columns",))
    known = times <= times[0] + horizon * (times[-1] - times[0])
    if known.sum() < LEAST_SAMPLES:
        raise ValueProblem(f"expected a key of at least {LEAST_SAMPLES} rows")
    times, values = times[known], np.column_stack([columns[name] for name in names])[known]
    is_angle = [name in question.angles or ANGLES.fullmatch(name) is not None for name in names]
    periods = np.where(is_angle, TURN, np.inf)
    sizes = np.minimum(np.abs(values).max(axis=0), periods / 2)
    # A column that is zero but for rounding is measured by the largest of the others.
    sizes = np.where(sizes <= NOISE * sizes.max(), sizes.max() or 1.0, sizes)
    margins = np.array([margin(size, question.tolerance) for size in sizes.tolist()])
    if (margins >= periods / 4).any():
        raise ValueProblem("any angle is within this tolerance", path=("tolerance",))
    owned = tuple(units.get(name) for name in names)
    key = Key(question, names, times, values, margins, periods, owned)
    values = _smooth(values, key)
    return replace(key, values=values, reference=_spline(times, values, margins))


NOISE = 1e-9
"""The part of the largest column below which another one is zero but for rounding and integration."""


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


def _of_report(asked: Asked) -> Table:
    """The samples of a report, and the columns at the path that is asked. Raises ValueProblem."""
    assert asked.report is not None
    name = asked.path[1] if len(asked.path) > 1 else ""
    table = next((each for each in asked.report.tables if each.key == name and name in BY_DEFAULT), None)
    if table is None:
        raise ValueProblem("this result is no trajectory", path=("ask",))
    if asked.path[2:] == (TIME,):
        raise ValueProblem("the times are the student's own", path=("ask",))
    cells = single_cells(table)
    columns = {each.cells[0]: np.asarray(each.values, dtype=np.float64) for each in cells}
    units = {each.cells[0]: parse_unit(each.unit) if each.unit else None for each in cells}
    asks = (".".join(asked.path[2:]),) if len(asked.path) > 2 else BY_DEFAULT[name]
    default = [
        cell
        for each in table.columns
        for cell in each.cells
        if any(each.key == ask or each.key.startswith(f"{ask}.") for ask in asks)
    ]
    return columns.pop(TIME), columns, default, units


def _of_literal(value: Tree) -> Table:
    """A table, or formulas of the time. Raises ValueProblem."""
    if isinstance(value, dict) and set(value) == {TIME, "columns"}:
        return _of_formulas(value[TIME], value["columns"])
    try:
        found = read_table(_text(value))
    except Unreadable as unreadable:
        problem = unreadable.findings[0]
        raise ValueProblem(
            f"{problem.place}: {problem.detail}".removeprefix(": "), path=("answer",)
        ) from None
    if TIME not in found or not (np.diff(found[TIME].values) > 0).all():
        raise ValueProblem("expected a column `t` of ascending times", path=("answer",))
    units = {name: column.unit for name, column in found.items()}
    columns = {
        name: column.values * (column.unit.scale if column.unit else 1.0) for name, column in found.items()
    }
    return columns.pop(TIME), columns, tuple(columns), units


def _of_formulas(span: Tree, texts: Tree) -> Table:
    """The columns of formulas of `t`, at as many times as they ask for or more. Raises ValueProblem."""
    times = _times(span)
    if not isinstance(texts, dict) or not texts:
        raise ValueProblem("expected formulas of `t` by their names", path=("answer", "columns"))
    columns = {}
    for name, text in texts.items():
        place = ("answer", "columns", name)
        try:
            root = parse(str(text)).root
        except ExpressionError as error:
            raise ValueProblem(error.message, path=place) from None
        if not tree.names_in(root) <= {TIME} or name == TIME:
            raise ValueProblem("expected a formula of `t` and numbers alone", path=place)
        columns[str(name)] = np.broadcast_to(evaluation.array(root, {TIME: times}), times.shape)
        if not np.isfinite(columns[str(name)]).all():
            raise ValueProblem("has no finite real value at some of the times", path=place)
    return times, columns, tuple(columns), {}


def _times(span: Tree) -> Floats:
    """At least as many times as `[start, stop, step]` asks for. Raises ValueProblem."""
    place, second = ("answer", TIME), parse_unit("s")
    try:
        start, stop, step = (read_number(entry, second).value for entry in span)
    except (Unreadable, TypeError, ValueError):
        raise ValueProblem("expected `[start, stop, step]`, three numbers", path=place) from None
    if not (start < stop and 0 < step <= stop - start and (stop - start) / step < MOST_SAMPLES):
        raise ValueProblem("expected a start before the stop, and a step between them", path=place)
    return np.linspace(start, stop, max(FORMULA_SAMPLES, round((stop - start) / step) + 1))


# --- what mistakes make of a key


def exchanged(key: Key) -> Iterator[Key]:
    """The keys by which two columns of an answer stand under each other's names."""
    for one, other in combinations(range(len(key.columns)), 2):
        order = list(range(len(key.columns)))
        order[one], order[other] = other, one
        yield replace(key, exchanged=tuple(order))
