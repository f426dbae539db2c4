"""What a new run changes in an old one, which is read back from its json."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from itertools import chain, groupby
from typing import Literal

import orjson
from pydantic import ConfigDict, TypeAdapter, ValidationError

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.grading import Feedback
from rigidcli.grading.feedback import Student, Told, told
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.outcome import Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.formats import Cell, csv_rows, json_line
from rigidcli.grading.reports.reading import read_bytes
from rigidcli.grading.reports.table import block, points
from rigidcli.render.terminal import Row

SCHEMA = "rigidcli.regrade/1"

_RUN = TypeAdapter(tuple[Student, ...], config=ConfigDict(strict=True, allow_inf_nan=False))
"""An old run; keys that a later version may add are passed over."""


@dataclass(frozen=True, slots=True)
class Mark:
    """What a question was judged to be; the `verdict` of a whole answer file is empty."""

    verdict: Verdict | Literal[""]
    score: float
    max_score: float
    codes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Change:
    """A question whose mark is another one than it was: None where there is, or was, none.

    `question` is empty where a whole student is new, or gone.
    """

    student: str
    question: str
    old: Mark | None
    new: Mark | None


def read(path: str | os.PathLike[str]) -> tuple[Student, ...]:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    return parse(*read_bytes(path))


def parse(data: bytes, source: str) -> tuple[Student, ...]:
    """The run in lines of JSON objects, or in one JSON array of them. Raises DocumentError."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    whole = data if data.lstrip().startswith(b"[") else b"[%b]" % data
    try:
        orjson.loads(whole)
    except orjson.JSONDecodeError:
        lines = [(number, line) for number, line in enumerate(data.splitlines(), 1) if line.strip()]
        return tuple(chain(*(_students(b"[%b]" % line, source, number) for number, line in lines)))
    return _students(whole, source)


def _students(array: bytes, source: str, line: int | None = None) -> tuple[Student, ...]:
    try:
        return _RUN.validate_json(array)
    except ValidationError as error:
        first = error.errors()[0]
        if first["type"] == "json_invalid":
            raise DocumentError([Problem(source, f"not JSON: {first['ctx']['error']}", line)]) from None
        hint = "an old run is what `rigidcli check -f json` has printed"
        key = ".".join(map(str, first["loc"][1:]))
        raise DocumentError(
            [Problem(source, "not an object of `rigidcli.check/1`", line, key, hint)]
        ) from None


def changes(
    old: Sequence[Student], new: Iterable[Judgement], feedback: Feedback = Feedback.hint
) -> tuple[Change, ...]:
    """What has changed, student by student: those of the new run first, then those who are gone.

    Students of whom an answer has come to wait for a person are before all others. Codes count where both
    runs tell them.
    """
    runs = old, [told(judgement, Feedback.hint) for judgement in new]
    coded = feedback.reasons and any(question.feedback for each in old for question in each.questions)
    counts = [Counter(each.student for each in run) for run in runs]
    several = {student for count in counts for student in count if count[student] > 1}
    # Those of one name in one run are told apart by their sources.
    was, now = (
        {printable(f"{s.student} ({s.source})" if s.student in several else s.student): s for s in run}
        for run in runs
    )
    found = {name: list(_of_student(name, was.get(name), now.get(name), coded)) for name in now | was}
    return tuple(chain.from_iterable(sorted(found.values(), key=lambda own: not any(map(_waits, own)))))


def _of_student(name: str, old: Student | None, new: Student | None, coded: bool) -> Iterator[Change]:
    if old is None or new is None:
        marks = (None if s is None else Mark("", s.score, s.max_score) for s in (old, new))
        yield Change(name, "", *marks)
        return
    was, now = ({printable(each.id): _mark(each, coded) for each in run.questions} for run in (old, new))
    for question in now | was:
        if was.get(question) != now.get(question):
            yield Change(name, question, was.get(question), now.get(question))


def _mark(question: Told, coded: bool) -> Mark:
    codes = tuple(map(printable, question.codes)) if coded else ()
    return Mark(question.verdict, question.score, question.max_score, codes)


def _waits(change: Change) -> bool:
    """Whether an answer waits for a person that did not, or not with the same points."""
    return change.new is not None and change.new.verdict == "review"


def table(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A block for each student, and how much has changed below."""
    for student, group in groupby(found, key=lambda change: change.student):
        yield block([(student, "bold")], list(map(_row, group)), style)
    yield block([(_summary(found), "")], [], style)


def _row(change: Change) -> Row:
    if change.question:
        return Row(((f"  {change.question}", ""),), f"{_text(change.old)} -> {_text(change.new)}")
    return Row((("  new" if change.old is None else "  gone", ""),), _text(change.new or change.old))


def _text(mark: Mark | None) -> str:
    if mark is None:
        return "nothing"
    score = f"{points(mark.score)}/{points(mark.max_score)}"
    given = f"({' '.join(mark.codes)})" if mark.codes else ""
    return " ".join(filter(None, [mark.verdict, score, given]))


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
    told = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    return told or "nothing has changed"


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
"""The formats in which it is told."""
