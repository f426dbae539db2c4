"""Trajectories: a table of the time and of columns, judged at its own times.

A question may list `columns`, `angles` (modulo 2 pi, or `modulo`) and what is `conserved`. Without `columns`,
those that the result is asked for must be there, and any other column of it that is handed in under its own
name must be right, too. A coordinate on which the Hamiltonian depends, but not on its turns, is an angle by
itself; of a cyclic one nothing tells whether it is an angle or a length, so that `angles` must list it.

An answer must have rows in ascending order of the time, cover the span but for a hundredth, leave no gap of
more than a tenth of it, and show how the columns move. Where the motion is chaotic, its columns are judged up
to the horizon; beyond, rows neither earn nor cost anything, but for what the motion conserves.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.files import read_beside
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, review, wrong
from rigidcli.grading.trajectories import mistakes
from rigidcli.grading.trajectories.key import Key, Rows
from rigidcli.grading.trajectories.key_making import key_of
from rigidcli.grading.trajectories.source import source_of
from rigidcli.grading.trajectories.tables import TIME, read_columns

OF_TIME = frozenset({"time_unit", "time_shift", "time_reversed", "frequency_wrong"})
"""Mistakes of the whole motion, not of some columns."""

GROWS = "the error grows with time: try a finer tolerance of the integration, or more exact constants"

TOO_FAR = "the key has few rows, and those of the answer are at other times, too far apart to compare"

MOST_NAMED = 6
"""Columns that one message names."""

EXAMPLE_ROWS = 401


class Trajectory(Kind):
    """A motion as a table in time."""

    name: ClassVar[str] = "trajectory"
    options: ClassVar[frozenset[str]] = frozenset({"columns", "angles", "conserved", "modulo", "symbols"})

    def read_key(self, asked: Asked) -> Key:
        """The key of a trajectory. Raises ValueProblem for what is none, and for options that do not fit."""
        return key_of(source_of(asked), asked.question)

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> Rows:
        """The table of an answer. Raises Unreadable."""
        known = [name for name in key.columns if name not in key.needed]
        needed = (TIME, *(name for name in key.columns if name in key.needed))
        table = read_columns(_text(answer, folder), needed, known, in_si=key.in_si)
        if TIME not in table:
            raise Unreadable("missing_column", "there is no column of times", place=shown(TIME))
        missing = np.full(len(table[TIME]), np.nan)
        return Rows(table[TIME], np.column_stack([table.get(name, missing) for name in key.columns]))

    @np.errstate(all="ignore")
    def judge(self, key: Key, answer: Rows) -> Outcome:
        """The outcome of an answer: its times, then its columns, then what it should conserve."""
        if row := _out_of_order(answer):
            return wrong(Finding("wrong_order", shown(TIME), f"row {row} is not later than the one before"))
        present = answer.present
        missing = [Finding("missing_column", shown(name)) for name in _missing(key, answer)]
        if short := key.lacks(answer):
            found = self.explanation(key, answer) or Finding("time_range_short", detail=short)
            return wrong(found, *missing)
        off = _off(key, answer)
        failing, open_ = present & (off > 1).any(axis=0), present & np.isnan(off).any(axis=0)
        kept = _kept(key, answer)
        drifting = [Finding("conserved_quantity_drift", shown(law)) for law, fine in kept.items() if not fine]
        if failing.any() or not present[: key.required].all():
            findings = self._wrong(key, answer, off, failing) if failing.any() else []
            # Where no mistake is named, energy that grows tells more than rows that are off.
            unnamed = all(finding.code == "outside_tolerance" for finding in findings)
            share = _earned(key, present & ~failing & ~open_, failing)
            return wrong(*missing, *findings, *(drifting if unnamed else ()), share=share)
        if open_.any():
            return review(TOO_FAR, *missing, *drifting)
        if missing or drifting:
            parts = key.required + len(kept) + len(missing)
            return wrong(*missing, *drifting, share=(key.required + sum(kept.values())) / parts)
        if (_off(key, answer, key.stop)[:, present] <= 1).all():
            return correct()
        since = f"what comes after t = {key.horizon:.4g} is not judged"
        return correct(Finding("chaotic_divergence_after_horizon", detail=since))

    @np.errstate(all="ignore")
    def is_right(self, key: Key, answer: Rows) -> bool:
        """Whether all columns are right, and what is conserved is kept."""
        if _out_of_order(answer) or _missing(key, answer) or key.lacks(answer):
            return False
        present = answer.present
        near = bool((_off(key, answer)[:, present] <= 1).all())
        return near and bool(present.any()) and all(_kept(key, answer).values())

    def _wrong(self, key: Key, answer: Rows, off: Floats, failing: Mask) -> list[Finding]:
        """What to say of columns that are not right."""
        places = np.flatnonzero(failing).tolist()
        if found := self.explanation(key, answer):
            return [found if found.code in OF_TIME else replace(found, place=_names(key, places))]
        if mistakes.grows(key, answer):
            return [Finding("precision_insufficient", _names(key, places), GROWS)]
        times, _, expected = key.compared(answer)
        first = np.argmax(off > 1, axis=0)
        findings = []
        for code, own in (
            ("wrong_initial_condition", [place for place in places if first[place] == 0]),
            ("outside_tolerance", [place for place in places if first[place] > 0]),
        ):
            if own:
                row = int(first[own].min())
                values = (f"{key.columns[place]} = {expected[row, place]:.6g}" for place in own[:MOST_NAMED])
                told = f"expected {', '.join(values)} at t = {times[row]:.6g}"
                findings.append(Finding(code, _names(key, own), reference=told))
        return findings

    @np.errstate(all="ignore")
    def right_forms(self, key: Key) -> Iterator[tuple[str, Tree]]:
        """The key itself, then at other times, in other forms, modulo periods."""
        times = np.linspace(key.start, key.stop, EXAMPLE_ROWS) if key.times is None else key.times
        itself = key.written(times)
        yield "the key itself", _table(key, itself, key.needed or None)
        yield "with all columns that are known", _table(key, itself)
        if key.times is None:
            between = times.copy()
            between[1:-1] += 0.3 * (times[1] - times[0]) * np.sin(np.arange(1, len(times) - 1))
            yield "at other times", _table(key, key.written(between))
        text = _table(key, itself)["csv"]
        yield "parted by semicolons, with blanks", {"csv": text.replace(",", " ; ")}
        turned = itself.values.copy()
        for place in np.flatnonzero(np.isfinite(key.periods)):
            turned[:, place] %= key.periods[place]
        turned[::2, list(key.quaternion)] *= -1
        if (turned != itself.values).any():
            yield "modulo periods and the signs of quaternions", _table(key, Rows(itself.times, turned))

    def mistaken(self, key: Key) -> Iterator[tuple[str, Key]]:
        """Codes of mistakes, and the keys that they make."""
        yield from super().mistaken(key)
        yield from mistakes.examples(key)

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """The key cut short, and backwards."""
        rows = key.written(np.linspace(key.start, key.stop, EXAMPLE_ROWS))
        half = Rows(rows.times[: EXAMPLE_ROWS // 2], rows.values[: EXAMPLE_ROWS // 2])
        yield Example("the first half", _table(key, half), "time_range_short")
        backwards = Rows(rows.times[::-1], rows.values[::-1])
        yield Example("backwards", _table(key, backwards), "wrong_order")


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


def _table(key: Key, rows: Rows, names: Collection[str] | None = None) -> dict[str, str]:
    """An answer with these rows, to 17 digits, and the columns of these names, or all."""
    places = [place for place, name in enumerate(key.columns) if names is None or name in names]
    lines = [",".join([TIME, *(key.columns[place] for place in places)])]
    lines += [
        ",".join(map(repr, row)) for row in np.column_stack([rows.times, rows.values[:, places]]).tolist()
    ]
    return {"csv": "\n".join(lines)}


def _out_of_order(answer: Rows) -> int:
    """The row, counted from 1, whose time is not later than that before; 0 for none."""
    later = np.diff(answer.times) > 0
    return 0 if later.all() else int(np.argmin(later)) + 2


def _missing(key: Key, answer: Rows) -> list[str]:
    """The columns that an answer must have, and has not."""
    return [
        name
        for name, there in zip(key.columns, answer.present, strict=True)
        if name in key.needed and not there
    ]


def _off(key: Key, answer: Rows, until: float | None = None) -> Floats:
    """By how much values are off (k by m), in margins; NaN where that cannot be told."""
    return key.misses(*key.compared(answer, until)[1:])


def _kept(key: Key, answer: Rows) -> dict[str, bool]:
    """Whether each conserved quantity stays the same, if the answer has the columns for it."""
    inside = key.inside(answer.times, key.stop)
    columns = {TIME: answer.times[inside]}
    for place in np.flatnonzero(answer.present):
        columns[key.columns[place]] = answer.values[inside, place]
    return {law.name: law.is_kept(columns) for law in key.conserved if law.names <= columns.keys()}


def _earned(key: Key, right: Mask, failing: Mask) -> float:
    """The share of required columns that are right (m); the others only cost, where they are wrong."""
    own, moving = right[: key.required], key.moving[: key.required]
    # A column that does not move is right without any work.
    if moving.any() and not (own & moving).any():
        return 0.0
    return float(own.sum()) / (key.required + int(failing[key.required :].sum()))


def _names(key: Key, places: Sequence[int]) -> str:
    names = [shown(key.columns[place]) for place in places[:MOST_NAMED]]
    return ", ".join([*names, "..."] if len(places) > MOST_NAMED else names)
