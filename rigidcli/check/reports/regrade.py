"""What a new run changes in an old one, which is read back from its json."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from itertools import chain, groupby
from typing import Any

import orjson

from rigidcli.check.records import Judgement
from rigidcli.check.reports import Style, read_bytes
from rigidcli.check.reports.formats import Cell, csv_rows, json_line
from rigidcli.check.reports.table import block, points
from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.render.terminal import Row

SCHEMA = "rigidcli.regrade/1"


@dataclass(frozen=True, slots=True)
class Mark:
    """What a question was judged to be; the `verdict` of a whole hand-in is empty."""

    verdict: str
    score: float
    max_score: float


@dataclass(frozen=True, slots=True)
class Change:
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
        if line.strip():
            try:
                student, marks = _student(orjson.loads(line))
            except (orjson.JSONDecodeError, TypeError, KeyError, ValueError, AttributeError):
                hint = "an old run is what `rigidcli check -f json` has printed"
                problem = Problem(source, "not an object of `rigidcli.check/1`", number, hint=hint)
                raise DocumentError([problem]) from None
            run[student] = marks
    return run


def _student(entry: dict[str, Any]) -> tuple[str, dict[str, Mark]]:
    if entry["schema"] != "rigidcli.check/1":
        raise ValueError
    marks = {printable(each["id"]): _mark(each, str(each["verdict"])) for each in entry["questions"]}
    return printable(entry["student"]), {"": _mark(entry)} | marks


def _mark(entry: dict[str, Any], verdict: str = "") -> Mark:
    return Mark(verdict, float(entry["score"]), float(entry["max_score"]))


def changes(old: Run, judgements: Iterable[Judgement]) -> tuple[Change, ...]:
    """What has changed, student by student: those of the new run first, then those who are gone."""
    new: Run = {}
    for each in judgements:
        marks = {q.id: Mark(q.verdict, float(q.score), float(q.max_score)) for q in each.questions}
        new[each.student] = {"": Mark("", each.score, each.max_score)} | marks
    found = []
    for student in new | old:
        was, now = old.get(student, {}), new.get(student, {})
        asked = [""] if not was or not now else [question for question in now | was if question]
        found += [
            Change(student, question, was.get(question), now.get(question))
            for question in asked
            if was.get(question) != now.get(question)
        ]
    return tuple(found)


def _waits(change: Change) -> bool:
    """Whether an answer has come to wait for a person."""
    return change.new is not None and change.new.verdict == "review"


def table(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A block for each student, those who wait for a person first, and how much has changed below."""
    groups = [list(group) for _, group in groupby(found, key=lambda change: change.student)]
    for group in sorted(groups, key=lambda own: not any(map(_waits, own))):
        yield block([(group[0].student, "bold")], list(map(_row, group)), style)
    yield block([(_summary(found), "")], [], style)


def _row(change: Change) -> Row:
    if change.question:
        return Row(((f"  {change.question}", ""),), f"{_text(change.old)} -> {_text(change.new)}")
    return Row((("  new" if change.old is None else "  gone", ""),), _text(change.new or change.old))


def _text(mark: Mark | None) -> str:
    if mark is None:
        return "nothing"
    return f"{mark.verdict} {points(mark.score)}/{points(mark.max_score)}".strip()


def _summary(found: Sequence[Change]) -> str:
    """How much has changed, in one line."""
    questions = [change for change in found if change.question]
    counts = {
        "waiting for a person": sum(map(_waits, found)),
        "questions changed": len(questions),
        "students concerned": len({change.student for change in questions}),
        "new students": sum(change.old is None for change in found if not change.question),
        "students gone": sum(change.new is None for change in found if not change.question),
    }
    text = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    return text or "nothing has changed"


def json(found: Sequence[Change], style: Style) -> Iterator[str]:
    """One compact object a change, one a line."""
    yield from (json_line({"schema": SCHEMA} | asdict(change)) for change in found)


HEADER = ("student", "question", *(f"{run}_{mark.name}" for mark in fields(Mark) for run in ("old", "new")))
"""The columns of csv: of each part of a mark what it was, and what it is."""


def csv(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A row for each change; that of a whole student has an empty question."""
    rows = (
        (each.student, each.question, *chain(*zip(_cells(each.old), _cells(each.new), strict=True)))
        for each in found
    )
    return csv_rows(HEADER, rows, style)


def _cells(mark: Mark | None) -> tuple[Cell, ...]:
    return (None,) * len(fields(Mark)) if mark is None else astuple(mark)


TEXTS = {"table": table, "json": json, "csv": csv}
"""The formats of changes."""
