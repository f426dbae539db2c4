"""What a new run changes in an old one, which is read back from its json."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import orjson

from rigidcli.check.records import Judgement
from rigidcli.check.reports import Style, read_bytes
from rigidcli.check.reports.formats import csv_rows
from rigidcli.check.reports.table import block, points
from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.render.terminal import Row


class Mark(NamedTuple):
    """What a question was judged to be; the `verdict` of a whole hand-in is empty."""

    verdict: str
    score: float
    max_score: float

    def __str__(self) -> str:
        return f"{self.verdict} {points(self.score)}/{points(self.max_score)}".strip()


class Change(NamedTuple):
    """A question whose mark has changed: None where there is, or was, none.

    `question` is empty where a whole student is new, or gone.
    """

    student: str
    question: str
    old: Mark | None
    new: Mark | None


Run = dict[str, dict[str, Mark]]
"""Marks by student and question; that of a whole hand-in stands under the empty question."""


def read(path: str | os.PathLike[str]) -> Run:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    data, source = read_bytes(path)
    run: Run = {}
    for number, line in enumerate(data.removeprefix(b"\xef\xbb\xbf").splitlines(), 1):
        try:
            entry = orjson.loads(line or b"{}")
            if line and entry["schema"] != "rigidcli.check/1":
                raise ValueError
            if line:
                marks = {printable(each["id"]): _mark(each, each["verdict"]) for each in entry["questions"]}
                run[printable(entry["student"])] = {"": _mark(entry, "")} | marks
        except (TypeError, KeyError, ValueError, AttributeError):
            hint = "an old run is what `rigidcli check -f json` has printed"
            raise DocumentError(
                [Problem(source, "not an object of `rigidcli.check/1`", number, hint=hint)]
            ) from None
    return run


def _mark(entry: dict[str, Any], verdict: object) -> Mark:
    return Mark(printable(str(verdict)), float(entry["score"]), float(entry["max_score"]))


def changes(old: Run, judgements: Iterable[Judgement]) -> list[Change]:
    """What has changed, student by student: those of the new run first, then those who are gone."""
    new: Run = {}
    for each in judgements:
        marks = {q.id: Mark(q.verdict, float(q.score), float(q.max_score)) for q in each.questions}
        new[each.student] = {"": Mark("", each.score, each.max_score)} | marks
    both = [(student, old.get(student, {}), new.get(student, {})) for student in new | old]
    return [
        Change(student, question, was.get(question), now.get(question))
        for student, was, now in both
        for question in (filter(None, now | was) if was and now else [""])
        if was.get(question) != now.get(question)
    ]


def _waits(change: Change) -> bool:
    """Whether an answer has come to wait for a person."""
    return change.new is not None and change.new.verdict == "review"


def table(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A block for each student, those who wait for a person first, and how much has changed below."""
    groups = [list(group) for _, group in groupby(found, key=lambda change: change.student)]
    for group in sorted(groups, key=lambda own: not any(map(_waits, own))):
        yield block([(group[0].student, "bold")], list(map(_row, group)), style)
    questions = sum(bool(change.question) for change in found)
    counts = {"waiting for a person": sum(map(_waits, found)), "questions changed": questions}
    counts |= {"new students": sum(each.old is None for each in found if not each.question)}
    counts |= {"students gone": sum(each.new is None for each in found if not each.question)}
    told = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    yield block([(told or "nothing has changed", "")], [], style)


def _row(change: Change) -> Row:
    if change.question:
        return Row(((f"  {change.question}", ""),), f"{change.old or 'nothing'} -> {change.new or 'nothing'}")
    return Row((("  new" if change.old is None else "  gone", ""),), str(change.new or change.old))


HEADER = ("student", "question", *(f"{run}_{part}" for run in ("old", "new") for part in Mark._fields))
"""The columns of csv: what each part of a mark was, then what it is."""


def csv(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A row for each change; that of a whole student has an empty question."""
    nothing = (None,) * len(Mark._fields)
    rows = ((each.student, each.question, *(each.old or nothing), *(each.new or nothing)) for each in found)
    return csv_rows(HEADER, rows, style)


TEXTS = {"table": table, "csv": csv}
"""The formats of changes."""
