"""A person's judgement over the tool's: a table of students, questions, scores and reasons."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from rigidcli.check.answers import folded
from rigidcli.check.files import noted
from rigidcli.check.judge import Item
from rigidcli.check.records import Judgement
from rigidcli.check.roster import points_in, read_table
from rigidcli.errors import DocumentError, Problem, nearest, shown

COLUMNS = ("student", "question", "score", "reason")
"""The columns of the table; the last may be missing."""


@dataclass(frozen=True, slots=True)
class Overrides:
    """Scores in points, with their reasons, by student and question."""

    scores: Mapping[tuple[str, str], tuple[float, str]]
    students: Mapping[str, str]

    def over(self, judgements: Iterable[Judgement], notes: list[str]) -> Iterator[Judgement]:
        """The judgements with the scores of the person; at the end, notes on students who are not there."""
        unknown = dict(self.students)
        for each in judgements:
            student = folded(each.student)
            unknown.pop(student, None)
            questions = tuple(
                question.overridden(*self.scores[student, folded(question.id)])
                if (student, folded(question.id)) in self.scores
                else question
                for question in each.questions
            )
            yield replace(each, questions=questions)
        notes += noted("nobody of this name has a row, and the override is left out", list(unknown.values()))


def read_overrides(path: str | os.PathLike[str], items: Mapping[str, Item]) -> Overrides:
    """The overrides in a file. Raises DocumentError with all that is wrong with it."""
    source = os.fsencode(path).decode(errors="backslashreplace")
    head, rows = read_table(path)
    places = {folded(name): place for place, name in enumerate(head)}
    if missing := [name for name in COLUMNS[:3] if name not in places]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(source, message, 1)])
    known = {folded(id): item for id, item in items.items()}
    scores: dict[tuple[str, str], tuple[float, str]] = {}
    students: dict[str, str] = {}
    problems: list[Problem] = []
    for line, row in enumerate(rows, 2):
        if not any(cell.strip() for cell in row):
            continue
        student, question, score, reason = (
            row[place].strip() if (place := places.get(name, len(row))) < len(row) else "" for name in COLUMNS
        )
        item = known.get(folded(question))
        points = points_in(score)
        if item is None:
            near = nearest(question, list(items))
            guess = f" (did you mean {near}?)" if near else ""
            problems.append(Problem(source, f"there is no question {shown(question)}{guess}", line))
        elif points is None or not 0 <= points <= item.points:
            expected = f"points from 0 to {item.points:.12g}"
            problems.append(Problem(source, f"read {shown(score)}, expected {expected}", line, "score"))
        elif (folded(student), folded(question)) in scores:
            problems.append(Problem(source, f"{shown(student)} has this question twice", line))
        else:
            scores[folded(student), folded(question)] = points, reason
            students[folded(student)] = student
    if problems:
        raise DocumentError(problems)
    return Overrides(scores, students)
