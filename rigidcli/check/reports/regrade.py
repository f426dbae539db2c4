"""What a new run changes in an old one, which is read back from its json: the marks of both that differ."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
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


def table(old: Run, judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A line for each mark that differs, what waits for a person first, and below how many there are.

    Students of the new run come before those who are gone.
    """
    new = {
        (printable(each.student), printable(question.id)): Mark(
            question.verdict, question.score, question.max_score
        )
        for each in judgements
        for question in each.questions
    }
    changed = [place for place in new | old if old.get(place) != new.get(place)]
    waiting = [place for place in changed if place in new and new[place].verdict == "review"]
    rows = [
        Row(
            ((student, "bold"), (question, "")),
            f"{old.get((student, question), 'none')} -> {new.get((student, question), 'none')}",
        )
        for student, question in sorted(changed, key=lambda place: place not in waiting)
    ]
    yield block([], rows, style)
    counts = {"waiting for a person": len(waiting), "questions changed": len(changed)}
    words = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    yield block([(words or "nothing has changed", "")], [], style)
