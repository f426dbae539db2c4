"""Trajectories: a table of the time and of columns, judged at its own times.

A question may list `columns`, `angles` (modulo 2 pi, or `modulo`) and what is `conserved`. Without `columns`,
those that the result is asked for must be there, and any other column of it that is handed in under its own
name must be right, too. A coordinate on which the Hamiltonian depends, but not on its turns, is an angle by
itself; of a cyclic one nothing tells whether it is an angle or a length, so that `angles` must list it.

An answer must have at least LEAST_ROWS rows in ascending order of the time, cover the span but for a
hundredth, leave no gap of a quarter of it, and show how the columns move. Where the motion is chaotic, it is
judged point by point up to the horizon, and beyond by what it conserves and by how one row follows another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.files import read_beside
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.trajectories.building import key_of
from rigidcli.grading.trajectories.columns import read_columns
from rigidcli.grading.trajectories.heads import TIME
from rigidcli.grading.trajectories.key import Key, Rows, without_flips
from rigidcli.grading.trajectories.mistakes import DEGREES, code_of, explaining, grows
from rigidcli.grading.trajectories.retiming import OSCILLATING
from rigidcli.grading.trajectories.source import source_of

LEAST_ROWS = 10

COVERED = 0.99
"""The part of the span that an answer must cover."""

LONGEST_GAP = 0.25
"""Between two rows, in units of the span."""

SHOWN = 0.5
"""The part of a column's range that must be seen in the rows: of a swing, not just the returns."""

SLACK = 1e-9
"""How far beyond the span, in units of it, a time still belongs to it."""

OF_TIME = frozenset({"time_unit", "time_shift", "time_reversed", "frequency_wrong"})
"""Mistakes of the whole motion, not of some columns."""

GROWS = "the error grows with time: try a finer tolerance of the integration, or more exact constants"

MOST_NAMED = 6
"""Columns that one message names."""

EXAMPLE_ROWS = 401


def read_key(asked: Asked) -> Key:
    """The key of a trajectory. Raises ValueProblem for what is none, and for options that do not fit."""
    return key_of(source_of(asked), asked.question)


@np.errstate(all="ignore")
def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of an answer. Raises Unreadable."""
    required = key.columns[: key.required]
    needed = tuple(dict.fromkeys((*required, *key.further)))
    table = read_columns(_text(answer, folder), (TIME, *needed), key.columns[key.required :], in_si=key.in_si)
    if TIME not in table:
        raise Unreadable("missing_column", "there is no column of times", place=shown(TIME))
    times = table[TIME]
    later = np.diff(times) > 0
    if not later.all():
        row = int(np.argmin(later)) + 2
        return wrong(Finding("wrong_order", shown(TIME), f"row {row} is not later than the one before"))
    key = key.of(table.keys())
    values = np.column_stack([table.get(name, np.full(len(times), np.nan)) for name in key.columns])
    missing = tuple(Finding("missing_column", shown(name)) for name in needed if name not in table)
    short = _too_short(key, times)
    if short is not None:
        code = code_of(key, Rows(times, values, None), short.code)
        return wrong(short if code == short.code else Finding(code), *missing)
    return _compared(key, table, Rows(times, values, None), missing)


def _text(answer: Tree, folder: Path) -> str:
    """The table of an answer."""
    if not isinstance(answer, dict) or len(answer) != 1 or not answer.keys() <= {"file", "csv"}:
        read = ", ".join(map(shown, answer)) if isinstance(answer, dict) else shown(answer)
        raise Unreadable("wrong_shape", f"read {read}, expected `file` or `csv`")
    if "file" in answer:
        return read_beside(answer["file"], folder)
    if not isinstance(answer["csv"], str):
        raise Unreadable("wrong_shape", f"read {shown(answer['csv'])}, expected a text", place="`csv`")
    return answer["csv"]


def _inside(key: Key, times: Floats) -> Mask:
    """The rows that belong to the span."""
    slack = SLACK * key.span
    inside: Mask = (times >= key.start - slack) & (times <= key.stop + slack)
    return inside


def _too_short(key: Key, times: Floats) -> Finding | None:
    """What is wrong with the times of an answer, if anything is."""
    own = times[_inside(key, times)]
    if not len(own) or own[-1] - own[0] < COVERED * key.span:
        return Finding("time_range_short", detail=f"read times from {times[0]:g} to {times[-1]:g}")
    if len(own) < LEAST_ROWS:
        return Finding("time_range_short", detail=f"{len(own)} rows, expected at least {LEAST_ROWS}")
    if np.diff(own).max() > LONGEST_GAP * key.span:
        return Finding("time_range_short", detail="there are gaps between its rows")
    seen = np.ptp(key.roughly_at(own[own <= key.horizon]), axis=0)
    if (key.moving & (seen < SHOWN * key.ranges))[: key.required].any():
        return Finding("time_range_short", detail="it has too few rows to show the motion")
    return None


def _compared(key: Key, table: Mapping[str, Floats], answer: Rows, missing: Sequence[Finding]) -> Outcome:
    """The outcome of an answer that covers the span."""
    inside = _inside(key, answer.times)
    near = _near(key, answer)
    right = _right(key, answer, near)
    laws = [law for law in key.conserved if law.names | {TIME} <= table.keys()]
    kept = [law.is_kept({name: table[name][inside] for name in {TIME, *law.names}}) for law in laws]
    drifting = [
        Finding("conserved_quantity_drift", shown(law.name))
        for law, fine in zip(laws, kept, strict=True)
        if not fine
    ]
    if not right.all():
        failing = tuple(place for place in answer.present if not right[place])
        findings = _wrong(key, replace(answer, failing=failing), near) if failing else []
        # Where no mistake is named, energy that grows tells more than rows that are off.
        unnamed = all(finding.code == "outside_tolerance" for finding in findings)
        return wrong(*missing, *findings, *(drifting if unnamed else ()), share=_earned(key, right))
    astray = [] if drifting else _astray(key, answer)
    if missing or drifting or astray:
        parts = key.required + len(kept) + len(missing) + len(astray)
        return wrong(*missing, *drifting, *astray, share=(key.required + sum(kept)) / parts)
    return correct(*([] if near.all() else [Finding("chaotic_divergence_after_horizon")]))


def _earned(key: Key, right: Mask) -> float:
    """The share of required columns that are right (m); the others only cost, where they are wrong."""
    own, moving = right[: key.required], key.moving[: key.required]
    # A column that does not move is right without any work.
    if moving.any() and not (own & moving).any():
        return 0.0
    return float(own.sum()) / (key.required + int((~right[key.required :]).sum()))


def _astray(key: Key, answer: Rows) -> list[Finding]:
    """What to say of rows beyond the horizon that do not follow the motion."""
    late = _inside(key, answer.times) & (answer.times > key.horizon)
    if key.following is None or answer.present != list(range(len(key.columns))) or not late.any():
        return []
    first = max(int(np.argmax(late)) - 1, 0)
    rows = slice(first, first + 1 + int(late.sum()))
    since = key.following.strays(answer.times[rows], without_flips(answer.values[rows], key.quaternion))
    detail = "" if since is None else f"after t = {since:.6g} the rows do not follow the motion"
    return [Finding("outside_tolerance", detail=detail)] if detail else []


def _near(key: Key, answer: Rows) -> Mask:
    """Which values are right (k by m), of the rows inside the span."""
    inside = _inside(key, answer.times)
    near: Mask = key.misses(answer.values[inside], key.at(answer.times[inside])) <= 1
    return near


def _right(key: Key, answer: Rows, near: Mask) -> Mask:
    """Which columns are right (m), as far as the motion can be predicted."""
    predicted = answer.times[_inside(key, answer.times)] <= key.horizon + SLACK * key.span
    return np.array(near[predicted].all(axis=0))


def _wrong(key: Key, answer: Rows, near: Mask) -> list[Finding]:
    """What to say of columns that are not right."""
    failing = answer.failing or ()
    code = code_of(key, answer, "outside_tolerance")
    if code in OF_TIME:
        return [Finding(code)]
    if code != "outside_tolerance":
        return [Finding(code, _names(key, failing))]
    if grows(key, answer):
        return [Finding("precision_insufficient", _names(key, failing), GROWS)]
    times = answer.times[_inside(key, answer.times)]
    rows = np.argmin(near, axis=0)
    begin = [place for place in failing if rows[place] == 0]
    later = [place for place in failing if rows[place] > 0]
    findings = []
    if begin:
        findings.append(
            Finding("wrong_initial_condition", _names(key, begin), "", _told(key, begin, times[:1]))
        )
    if later:
        first = times[rows[later].min() :][:1]
        detail = f"first at t = {first[0]:.6g}"
        findings.append(Finding("outside_tolerance", _names(key, later), detail, _told(key, later, first)))
    return findings


def _names(key: Key, places: Sequence[int]) -> str:
    names = [shown(key.columns[place]) for place in places[:MOST_NAMED]]
    return ", ".join([*names, "..."] if len(places) > MOST_NAMED else names)


def _told(key: Key, places: Sequence[int], time: Floats) -> str:
    """What some columns should be at a time (1)."""
    expected = key.at(time)[0]
    values = ", ".join(f"{key.columns[place]} = {expected[place]:.6g}" for place in places[:MOST_NAMED])
    return f"expected {values} at t = {time[0]:.6g}"


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The key itself, at other times, in other forms, and under each named mistake that changes it."""
    times = np.linspace(key.start, key.stop, EXAMPLE_ROWS)
    whole, key = key, key.of(())
    columns = key.all_at(times)
    yield Example("the key itself", _table(key, times, columns))
    if whole is not key:
        yield Example("with all columns that are known", _table(whole, times, whole.all_at(times)))
    between = times.copy()
    between[1:-1] += 0.3 * (times[1] - times[0]) * np.sin(np.arange(1, EXAMPLE_ROWS - 1))
    yield Example("at other times", _table(key, between, key.all_at(between)))
    text = _table(key, times, columns)["csv"]
    yield Example("parted by semicolons, with blanks", {"csv": text.replace(",", " ; ")})
    turned = columns.copy()
    for place in np.flatnonzero(np.isfinite(key.periods)):
        turned[:, place] -= key.periods[place] * np.floor(turned[:, place] / key.periods[place])
    turned[::2, list(key.quaternion)] *= -1
    if (turned != columns).any():
        yield Example("modulo periods and the signs of quaternions", _table(key, times, turned))
    yield from _mistaken(key, times, columns)


@np.errstate(all="ignore")
def _mistaken(key: Key, times: Floats, columns: Floats) -> list[Example]:
    """The key under mistakes; those that another explains as well, or that change nothing, are left out."""
    count, angles = len(key.columns), np.isfinite(key.periods)
    scaled: dict[str, float | Floats] = {
        "sign_error": -1.0,
        "constant_factor": 2.0,
        "power_of_ten": 100.0,
        "degrees_radians": np.where(angles, DEGREES, 1.0),
    }
    trials = [(code, times, columns[:, :count] * factor) for code, factor in scaled.items()]
    trials.append(("components_permuted", times, np.roll(columns[:, :count], 1, axis=1)))
    if key.moving.any():
        trials += [
            ("time_unit", 1000 * times, columns[:, :count]),
            ("time_shift", times + 0.1 * key.span, columns[:, :count]),
            ("time_reversed", times, columns[::-1, :count]),
        ]
    if key.crossings >= OSCILLATING:
        trials.append(("frequency_wrong", times, key.at(key.start + 0.8 * (times - key.start))))
    examples = []
    for code, when, values in trials:
        answer = Rows(when, values, None)
        right = _right(key, answer, _near(key, answer))
        if _too_short(key, when) is None:
            answer = replace(answer, failing=tuple(np.flatnonzero(~right).tolist()))
        by_clock = code == "time_unit"  # whose first rows may happen to be right
        if (by_clock or not right.all()) and not explaining(key, answer) - {code}:
            changed = np.column_stack([values, columns[:, count:]])
            examples.append(Example(f"with {code}", _table(key, when, changed), code))
    half = len(times) // 2
    examples.append(Example("the first half", _table(key, times[:half], columns[:half]), "time_range_short"))
    return [*examples, Example("backwards", _table(key, times[::-1], columns[::-1]), "wrong_order")]


def _table(key: Key, times: Floats, columns: Floats) -> dict[str, str]:
    """An answer with these columns (k by m and more) to 17 digits."""
    by_name = {TIME: times, **dict(zip((*key.columns, *key.further), columns.T, strict=True))}
    lines = [",".join(by_name)]
    lines += [",".join(map(repr, row)) for row in np.column_stack(list(by_name.values())).tolist()]
    return {"csv": "\n".join(lines)}
