"""Trajectories: tables of columns in the time, each judged at its own times until it goes wrong.

Without `columns`, a question asks for the coordinates and momenta of an orbit, or for omega. Columns with the
usual names of angles (`theta1`, `phi`) are judged modulo a turn, and so are those that `angles` lists.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import ClassVar, NamedTuple

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
from rigidcli.check.kinds.trajectory_keys import LEAST_SAMPLES, OFF, Key, key_of, smooth, spline, text_of
from rigidcli.check.tables import SECOND, TIME, read_table
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import shown

QUATERNION = ["q0", "q1", "q2", "q3"]
"""The components of an orientation, whose common sign has no meaning."""

GAP, SHORT = 0.1, 0.01
"""The longest gap between two rows of an answer, and what may be missing at the end, in units of the span."""

SAME_TIME = 1e-6
"""How far times that are the same may be apart, in units of the span: they may be typed with few digits."""

SHOWN = 0.5
"""The part of the range of a column that the rows must show: of a swing, not only its returns."""

TOO_FAR = "the key has few rows, and those of the answer are at other times, too far apart to compare"


class Trajectory(Kind):
    """A motion as a table in time. An answer is an array (k by 1 + m): times, and the columns of the key."""

    name: ClassVar[str] = "trajectory"
    options: ClassVar[frozenset[str]] = frozenset({"columns", "angles"})

    def key(self, asked: Asked) -> Key:
        """The key of a trajectory. Raises ValueProblem for what is none, and for options that do not fit."""
        return key_of(asked)

    def read(self, key: Key, answer: Tree, folder: Path) -> Reading:
        """The table of an answer, in SI units; a column that is missing is NaN. Raises Unreadable."""
        found = read_table(text_of(answer), (TIME, *key.columns))
        if TIME not in found:
            raise Unreadable("missing_column", "there is no column of times", place=shown(TIME))
        missing = np.full(len(found[TIME].values), np.nan)
        named = zip((TIME, *key.columns), (SECOND, *key.units), strict=True)
        rows = np.column_stack(
            [found[name].in_si(unit) if name in found else missing for name, unit in named]
        )
        heads = ", ".join(name for name in (TIME, *key.columns) if name in found)
        return Reading(rows, f"{len(rows)} rows of {heads}, t from {rows[0, 0]:.6g} to {rows[-1, 0]:.6g}")

    @np.errstate(all="ignore")
    def judge(self, key: Key, value: Floats) -> Outcome:
        """The outcome of an answer: each column earns the share of the time until which it is right."""
        later = np.diff(value[:, 0]) > 0
        if not later.all():
            row = int(np.argmin(later)) + 2
            return earning(
                0.0, Finding("wrong_order", shown(TIME), f"row {row} is not later than the one before")
            )
        rows = value[:, [0, *(1 + place for place in key.order)]] if key.order else value
        there = np.asarray(~np.isnan(rows[:, 1:]).all(axis=0))
        missing = [Finding("missing_column", shown(key.columns[k])) for k in np.flatnonzero(~there)]
        compared = _compared(key, rows)
        if compared is None:
            return review(TOO_FAR, *missing)
        times, own, expected = compared
        until, complete = _reach(key, rows[:, 0] if key.reference else times)
        bad = np.abs(_wrapped(key, own - expected)) > key.margins
        wrong = np.asarray(there & bad.any(axis=0))
        ranges, moving = np.ptp(key.values, axis=0), np.ptp(key.values, axis=0) > key.margins
        if complete and there.all() and not wrong.any():
            seen = np.ptp(expected, axis=0) >= SHOWN * ranges
            return correct() if (seen | ~moving).all() else review("its rows are too few to show the motion")
        first = bad.argmax(axis=0) if len(bad) else np.zeros(len(there), dtype=int)
        ends = np.minimum(until, np.where(wrong, np.append(key.start, times)[first], until))
        ends = np.where(there, ends, key.start)
        # Columns that do not move are right without any work: they count where they are wrong.
        counted = moving | wrong | ~there | ~moving.any()
        findings = [*missing, *_said(key, compared, wrong, first, ends)]
        if not complete:
            detail = f"it is judged until t = {until:.4g} of {key.times[-1]:.4g}"
            findings.append(Finding("time_range_short", detail=detail))
        return earning(float((ends[counted] - key.start).mean() / key.span), *findings)

    def typed(self, key: Key) -> Tree:
        """The rows of the key."""
        units = [1.0 if unit is None else unit.scale for unit in key.units]
        rows = np.column_stack([key.times, key.values / units]).tolist()
        return {
            "csv": "\n".join([",".join((TIME, *key.columns)), *(",".join(map(repr, row)) for row in rows)])
        }


# --- judging


class Compared(NamedTuple):
    """Times (k), what an answer has there, and what is expected (both k by m)."""

    times: Floats
    own: Floats
    expected: Floats


def _compared(key: Key, rows: Floats) -> Compared | None:
    """An answer beside the key, at its own times or those of a key of few rows; None where that cannot be."""
    times, own, slack = rows[:, 0], rows[:, 1:], SAME_TIME * key.span
    if key.reference is not None:
        inside = (times >= key.start - slack) & (times <= key.times[-1] + slack)
        times, own = times[inside], own[inside]
        expected = key.reference(np.clip(times, key.start, key.times[-1]))
    else:
        near = np.abs(times[:, None] - key.times).argmin(axis=0)
        met = np.abs(times[near] - key.times) <= slack
        own, expected = own[near[met]], key.values[met]
        if not met.all() and met.sum() < LEAST_SAMPLES:
            between = spline(times, smooth(np.nan_to_num(rows[:, 1:]), key.periods), key.margins)
            if between is None:
                return None
            met = (key.times >= times[0] - slack) & (key.times <= times[-1] + slack)
            own, expected = (
                np.where(np.isnan(rows[:, 1:]).all(axis=0), np.nan, between(key.times[met])),
                key.values[met],
            )
        times = key.times[met]
    if set(QUATERNION) <= set(key.columns):
        places = [key.columns.index(name) for name in QUATERNION]
        sign = np.where((own[:, places] * expected[:, places]).sum(axis=1) < 0, -1.0, 1.0)
        own = own.copy()
        own[:, places] *= sign[:, None]
    return Compared(times, own, expected)


def _wrapped(key: Key, differences: Floats) -> Floats:
    """Differences of the columns (k by m), those of angles to the nearest of their turns."""
    own = np.where(np.isfinite(key.periods), key.periods, 1.0)
    # Where the digits of a huge angle do not tell what is left of it, it stays as it is.
    turns = np.isfinite(key.periods) & (np.spacing(np.abs(differences)) <= OFF * key.margins)
    return np.where(turns, differences - own * np.round(differences / own), differences)


def _reach(key: Key, times: Floats) -> tuple[float, bool]:
    """The time until which the rows of an answer follow each other closely, and whether that is the end."""
    stop, longest = (
        float(key.times[-1]),
        max(GAP * key.span, float(np.diff(key.times).max())) + SAME_TIME * key.span,
    )
    own = times[(times >= key.start - longest) & (times <= stop + longest)]
    if not len(own) or own[0] > key.start + longest:
        return key.start, False
    steps = np.diff(own)
    gaps = np.flatnonzero(steps > longest)
    end = float(own[gaps[0]] if len(gaps) else own[-1])
    last = float(np.median(steps)) * (1 + SAME_TIME) if len(steps) else 0.0
    complete = not len(gaps) and end >= stop - max(SHORT * key.span, last)
    return (stop if complete else max(key.start, end)), complete


def _said(key: Key, seen: Compared, wrong: Mask, first: Floats, ends: Floats) -> Iterator[Finding]:
    """What is said of wrong columns: the factor that all of them have, or until when they are right."""
    places = np.flatnonzero(wrong).tolist()
    codes = {_factor(key, k, seen.own[:, k], seen.expected[:, k]) for k in places}
    if len(codes) == 1 and (code := codes.pop()):
        yield Finding(code, ", ".join(shown(key.columns[k]) for k in places))
        return
    for k in places:
        name, row = key.columns[k], int(first[k])
        expected = f"expected {name} = {seen.expected[row, k]:.6g} at t = {seen.times[row]:.6g}"
        if row:
            yield Finding("outside_tolerance", shown(name), f"it is right until t = {ends[k]:.4g}", expected)
        else:
            yield Finding("wrong_initial_condition", shown(name), reference=expected)


def _factor(key: Key, place: int, own: Floats, expected: Floats) -> str | None:
    """The code of the one factor by which a column is wrong, told from its larger half."""
    largest = np.abs(expected).max()
    large = np.abs(expected) >= largest / 2
    middle = float(np.median(own[large] / expected[large]))
    if not (np.abs(own - middle * expected) <= abs(middle) * key.margins[place]).all():
        return None
    return common_factor(middle, key.units[place], (), float(key.margins[place] / largest))


# --- what mistakes make of a key


def exchanged(key: Key) -> Iterator[Key]:
    """The keys by which two columns of an answer stand under each other's names."""
    for one, other in combinations(range(len(key.columns)), 2):
        order = list(range(len(key.columns)))
        order[one], order[other] = other, one
        yield replace(key, order=tuple(order))
