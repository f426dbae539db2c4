"""What a new run changes in an old one, which is read back from its json: the marks of both that differ."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import orjson

from rigidcli.check.records import Judgement
from rigidcli.check.reports import Style
from rigidcli.check.reports import read as read_text
from rigidcli.check.reports.table import block, points
from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.render.terminal import Row


class Mark(NamedTuple):
    """What a question was judged to be."""

    verdict: str
    score: float
    max_score: float

    def __str__(self) -> str:
        return f"{self.verdict} {points(self.score)}/{points(self.max_score)}"


Run: TypeAlias = dict[tuple[str, str], Mark]
"""Marks by student and question."""


class Change(NamedTuple):
    """A question whose mark has changed: None where there is, or was, none."""

    student: str
    question: str
    old: Mark | None
    new: Mark | None

    @property
    def waits(self) -> bool:
        """Whether the answer has come to wait for a person."""
        return self.new is not None and self.new.verdict == "review"


def read(path: str | os.PathLike[str]) -> Run:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    text, source = read_text(path)
    run: Run = {}
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        try:
            entry: dict[str, Any] = orjson.loads(line)
            if entry["schema"] != "rigidcli.check/1":
                raise ValueError
            for each in entry["questions"]:
                mark = Mark(printable(str(each["verdict"])), float(each["score"]), float(each["max_score"]))
                run[printable(entry["student"]), printable(each["id"])] = mark
        except (TypeError, KeyError, ValueError, AttributeError):
            hint = "an old run is what `rigidcli check -f json` has printed"
            message = "not an object of `rigidcli.check/1`"
            raise DocumentError([Problem(source, message, number, hint=hint)]) from None
    return run


def changes(old: Run, judgements: Iterable[Judgement]) -> list[Change]:
    """What has changed: the students of the new run first, then those who are gone."""
    new = {
        (printable(each.student), printable(question.id)): Mark(
            question.verdict, float(question.score), float(question.max_score)
        )
        for each in judgements
        for question in each.questions
    }
    both = (Change(*place, old.get(place), new.get(place)) for place in new | old)
    return [change for change in both if change.old != change.new]


def table(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A line for each change, those first that wait for a person, and below how many there are."""
    rows = [
        Row(((each.student, "bold"), (each.question, "")), f"{each.old or 'none'} -> {each.new or 'none'}")
        for each in sorted(found, key=lambda change: not change.waits)
    ]
    yield block([], rows, style)
    counts = {"waiting for a person": sum(each.waits for each in found), "questions changed": len(found)}
    words = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    yield block([(words or "nothing has changed", "")], [], style)
