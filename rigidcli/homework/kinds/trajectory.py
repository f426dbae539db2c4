"""Trajectories: tables of columns in the time, each judged at its own times until it goes wrong.

Without `columns`, a question asks for the coordinates and momenta of an orbit, or for omega. Columns with the
usual names of angles (`theta1`, `phi`) are judged modulo a turn, and so are those that `angles` lists.

Commas, semicolons, tabs or blanks separate the cells of a table; where commas do not, numbers may have
decimal commas. A head may have a unit: `t`, `Time (s)`, `t [ms]`, `theta/rad`. Empty lines, and lines with
`#` before the heads, are passed over; as numpy writes a table, the last of these has the heads.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.document.parameters import TIME
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import Ruler
from rigidcli.homework.mistakes import shared_factor
from rigidcli.homework.numbers import read_numbers, read_units, scale_in
from rigidcli.language import tree
from rigidcli.language.expression import array, parse
from rigidcli.language.latex import plain
from rigidcli.report import single_cells

SECOND = parse_unit("s")
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
        table = _read_table(_table_text(answer), (TIME, *key.columns))
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
    half = key.periods / 2
    turned = np.remainder(differences + half, key.periods) - half
    return np.where(np.isfinite(key.periods), turned, differences)


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
        columns = _tabulated(value[TIME], value["columns"])
    else:
        columns = _read_table(_table_text(value))
    if TIME not in columns:
        raise ValueProblem("expected a column `t` of times", path=("answer",))
    return columns, [name for name in columns if name != TIME]


# --- tables: a line with the names of the columns, then a line of numbers for each row

_UNIT_OF_HEAD = re.compile(r"(?P<name>[^(\[/]*?)\s*[(\[/](?P<unit>.*?)[)\]]?")
# A decimal number within the range of numbers; others, and expressions, take longer to read.
_PLAIN_NUMBER = re.compile(r"[-+]?(?:[0-9]{1,30}\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,2})?")


@dataclass(frozen=True, slots=True)
class TypedColumn:
    """The numbers of a column (n) as typed, under a head with a `name` and perhaps a `unit`."""

    name: str
    unit: Unit | None
    values: Floats

    def in_si(self, unit: Unit | None) -> Floats:
        """The numbers in SI units; a column without a unit of its own is in `unit`. Raises Unreadable."""
        own = self.unit or unit
        if own is None:
            return self.values
        try:
            return self.values * scale_in(own, unit or own)
        except ValueProblem as problem:
            raise Unreadable("unit_incompatible", problem.message, place=shown(self.name)) from None


def _read_table(text: str, wanted: Collection[str] | None = None) -> dict[str, TypedColumn]:
    """The columns of a table by their names: those `wanted`, in any usual spelling, as far as there are any.

    Names are compared as typed, then without regard to capitals, underscores and Greek letters; two heads
    that come to the same name are none of them. Raises Unreadable.
    """
    text = text.removeprefix("\ufeff").translate({ord('"'): None, ord("\N{MINUS SIGN}"): "-"})
    lines = [(n, line) for n, line in enumerate(re.split("\r\n?|\n", text), 1) if line.strip()]
    heads, separator, begin = _heads([line for _, line in lines])
    rows = [(number, _cells(line, separator)) for number, line in lines[begin:]]
    if not rows:
        raise Unreadable("wrong_shape", "there are no rows of numbers")
    for number, cells in rows:
        if len(cells) != len(heads):
            hint = "; with decimal commas, separate cells with `;`" * (separator == ",")
            detail = f"{len(cells)} cells, expected {len(heads)}{hint}"
            raise Unreadable("wrong_shape", detail, place=f"line {number}")
    named = [_head(head) for head in heads]
    columns = {}
    for name, place in _places([name for name, _ in named], wanted).items():
        numbers = [_cell(cells[place], line, name) for line, cells in rows]
        columns[name] = TypedColumn(name, named[place][1], np.array(numbers))
    return columns


def _heads(lines: Sequence[str]) -> tuple[list[str], str | None, int]:
    """The heads of columns, what separates cells (None for blanks), and the index of the first row."""
    begin = next((k for k, line in enumerate(lines) if not line.lstrip().startswith("#")), None)
    if begin is None:
        raise Unreadable("wrong_shape", "read an empty table, expected a line of names and lines of numbers")
    separator = next((each for each in ";\t," if each in lines[begin]), None)
    heads = lines[begin].split(separator)
    if all(map(_PLAIN_NUMBER.fullmatch, _cells(lines[begin], separator))):
        above = lines[begin - 1].lstrip(" #").split(separator) if begin else []
        if len(above) != len(heads):
            raise Unreadable("missing_column", "the first line has no names of columns", place=shown(TIME))
        heads, begin = above, begin - 1
    return [head.strip() for head in heads], separator, begin + 1


def _cells(line: str, separator: str | None) -> list[str]:
    """The cells of a line, with decimal points; blanks separate them where `separator` is None."""
    return [cell.strip() for cell in (line if separator == "," else line.replace(",", ".")).split(separator)]


def _cell(cell: str, line: int, name: str) -> float:
    if _PLAIN_NUMBER.fullmatch(cell):
        return float(cell)
    return read_numbers(cell, None, f"line {line}, column {shown(name)}")[0].value


def _head(text: str) -> tuple[str, Unit | None]:
    """The name and the unit in a head such as `x (cm)`; an unknown unit counts as none."""
    match = _UNIT_OF_HEAD.fullmatch(text) if len(text) <= 200 else None  # a longer one takes long
    if match is None:
        return text, None
    name, unit = match["name"], match["unit"].strip()
    with suppress(Unreadable):
        if unit.casefold() not in ("", TIME, "time"):  # `x(t)` is a function of the time, and not in tonnes
            return name, read_units(unit)[0]
    return name, None


def _places(heads: Sequence[str], wanted: Collection[str] | None) -> dict[str, int]:
    """The index of each wanted column. Raises Unreadable for two columns of one name."""
    if wanted is None:
        wanted = dict.fromkeys(TIME if _usual(head) == TIME else head for head in heads)
    usual = [_usual(head) for head in heads]
    indices = {}
    for name in wanted:
        places = [k for k, head in enumerate(heads) if head == name]
        if len(places) > 1:
            raise Unreadable("duplicate_key", "there are several columns of this name", place=shown(name))
        if not places:
            places = [k for k, head in enumerate(usual) if head == _usual(name) and heads[k] not in wanted]
        if not places and name.startswith("p_") and sum(each.startswith("p_") for each in wanted) == 1:
            places = [k for k, head in enumerate(usual) if head == "p"]
        if len(places) == 1:
            indices[name] = places[0]
    return indices


def _usual(name: str) -> str:
    """A name in small ASCII letters without underscores: `Θ_1` is theta1, `omega_1` is w1, `Time` is t."""
    with suppress(ExpressionError):  # a head that is no name
        name = plain(name)
    small = re.sub(r"[\s_{}]", "", name).casefold()
    return {"time": TIME}.get(small) or re.sub(r"omega(?=[0-9]|$)", "w", small)


def _table_text(answer: Tree) -> str:
    """The table of an answer. Raises Unreadable."""
    text = answer["csv"] if isinstance(answer, dict) and set(answer) == {"csv"} else answer
    if not isinstance(text, str) or "\n" not in text.strip():
        hint = "expected `{file: orbit.csv}`, or `csv: |` and the table"
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {hint}")
    return text


def _tabulated(span: Tree, texts: Tree) -> dict[str, TypedColumn]:
    """The columns of formulas of `t`, at as many times as they ask for or more. Raises ValueProblem."""
    times = _times(span)
    columns = {TIME: TypedColumn(TIME, None, times)}
    for name, text in texts.items() if isinstance(texts, dict) else ():
        place = ("answer", "columns", name)
        try:
            root = parse(str(text)).root
        except ExpressionError as error:
            raise ValueProblem(error.message, path=place) from None
        if not tree.names_in(root) <= {TIME} or name == TIME:
            raise ValueProblem("expected a formula of `t` and numbers alone", path=place)
        values = array(root, {TIME: times}) + 0 * times
        if not np.isfinite(values).all():
            raise ValueProblem("has no finite real value at some of the times", path=place)
        columns[str(name)] = TypedColumn(str(name), None, values)
    return columns


def _times(span: Tree) -> Floats:
    """Times from `start` to `stop`, at least as dense as `step`. Raises ValueProblem."""
    start = stop = step = 0.0
    with suppress(Unreadable, TypeError, ValueError):
        start, stop, step = (read_numbers(entry, SECOND)[0].value for entry in span)
    if not (start < stop and 0 < step <= stop - start and (stop - start) / step < 1_000_000):
        hint = "write three numbers, the start before the stop, and a step that fits between"
        raise ValueProblem("expected `[start, stop, step]`", path=("answer", TIME), hint=hint)
    # Of fewer rows, a line between two would not be near.
    return np.linspace(start, stop, max(4001, round((stop - start) / step) + 1))
