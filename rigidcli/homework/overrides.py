"""Scores that a person has given, which stand over those of the program."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from rigidcli.errors import DocumentError, Problem, guess, shown
from rigidcli.homework.answers import folded
from rigidcli.homework.base import Judgement, Tell
from rigidcli.homework.names import listed, noted
from rigidcli.homework.roster import Roster
from rigidcli.homework.spreadsheets import points_in, read_spreadsheet

COLUMNS = ("student", "question", "score", "reason")
"""The columns of a table of scores that a person has given; the last may be missing."""


class Score(NamedTuple):
    """A score in points with its `reason`, and the student as the table has the name."""

    points: float
    reason: str
    student: str


@dataclass(frozen=True, slots=True)
class Overrides:
    """The scores in the file `source`, by the folded names of the student and the question."""

    source: str
    scores: Mapping[tuple[str, str], Score]

    def applied(self, judgements: Iterable[Judgement], tell: Tell) -> Iterator[Judgement]:
        """The judgements with these scores; `tell` gets a note on students who are not there."""
        unknown = {student: score.student for (student, _), score in self.scores.items()}
        for judgement in judgements:
            student = folded(judgement.student)
            unknown.pop(student, None)
            questions = []
            for question in judgement.questions:
                score = self.scores.get((student, folded(question.id)))
                questions.append(question.overridden(score.points, score.reason) if score else question)
            yield replace(judgement, questions=tuple(questions))
        what = "nobody of this name has a row, and the override is left out"
        tell(self.source, noted(what, list(unknown.values())))


def read_overrides(
    path: str | os.PathLike[str], worth: Mapping[str, float], roster: Roster | None = None
) -> Overrides:
    """The overrides in a file, of questions that are `worth` points; a roster knows all names of a student.

    Raises DocumentError.
    """
    table = read_spreadsheet(path)
    heads = [folded(head) for row in table.rows[:1] for head in row]
    if missing := [name for name in COLUMNS[:3] if name not in heads]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(table.source, message, 1)])
    most = {folded(id): points for id, points in worth.items()}
    scores, problems = dict[tuple[str, str], Score](), list[Problem]()
    for line, row in enumerate(table.rows[1:], 2):
        if not any(text.strip() for text in row):
            continue
        cells = dict(zip(heads, row, strict=False))
        student, question, score, reason = (cells.get(name, "").strip() for name in COLUMNS)
        people = roster.called(student) if roster else []
        student = people[0] if len(people) == 1 else student
        whole, points = most.get(folded(question)), points_in(score)
        if whole is None:
            message = f"there is no question {shown(question)}{guess(question, list(worth))}"
            problems.append(Problem(table.source, message, line))
        elif points is None or not 0 <= points <= whole:
            message = f"read {shown(score)}, expected points from 0 to {whole:.12g}"
            problems.append(Problem(table.source, message, line, "score"))
        elif len(people) > 1:
            message = f"{shown(student)} may be any of {listed(people)}"
            hint = "write the login, or the number, of the student"
            problems.append(Problem(table.source, message, line, "student", hint))
        elif (folded(student), folded(question)) in scores:
            problems.append(Problem(table.source, f"{shown(student)} has this question twice", line))
        else:
            scores[folded(student), folded(question)] = Score(points, reason, student)
    if problems:
        raise DocumentError(problems)
    return Overrides(table.source, scores)
