"""Scores that a person has given, which replace those of the program."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

from rigidcli.errors import DocumentError, Problem, shown
from rigidcli.homework.answers import folded
from rigidcli.homework.base import Judgement, Tell
from rigidcli.homework.judge import Item
from rigidcli.homework.owner import listed, noted
from rigidcli.homework.roster import Roster
from rigidcli.homework.spreadsheets import points_in, read_spreadsheet
from rigidcli.suggestions import guess

# The columns of a table of scores that a person has given; the last may be missing.
COLUMNS = ("student", "question", "score", "reason")


@dataclass(frozen=True, slots=True)
class Overrides:
    """The points and reasons in the file `source`, by the folded names of the student and the question.

    `students` has the names of students as they stand in the file, by the folded ones.
    """

    source: str
    scores: Mapping[tuple[str, str], tuple[float, str]]
    students: Mapping[str, str]

    def applied(self, judgements: Iterable[Judgement], tell: Tell) -> Iterator[Judgement]:
        """The judgements with these scores; `tell` gets a note on students who are not there."""
        unknown = dict(self.students)
        for judgement in judgements:
            student = folded(judgement.student)
            unknown.pop(student, None)
            questions = []
            for question in judgement.questions:
                score = self.scores.get((student, folded(question.id)))
                questions.append(question.overridden(*score) if score else question)
            yield replace(judgement, questions=tuple(questions))
        what = "nobody of this name has a row, and the override is left out"
        tell(self.source, noted(what, list(unknown.values())))


def read_overrides(
    path: str | os.PathLike[str], items: Mapping[str, Item], roster: Roster | None = None
) -> Overrides:
    """The overrides in a file, of these questions. Raises DocumentError."""
    table = read_spreadsheet(path)
    heads = [folded(head) for row in table.rows[:1] for head in row]
    if missing := [name for name in COLUMNS[:3] if name not in heads]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(table.source, message, 1)])
    most = {folded(id): item.points for id, item in items.items()}
    scores, students = dict[tuple[str, str], tuple[float, str]](), dict[str, str]()
    problems = list[Problem]()
    for line, row in zip(table.lines[1:], table.rows[1:], strict=False):
        cells = defaultdict(str, zip(heads, map(str.strip, row), strict=False))
        if not any(cells.values()):
            continue
        student, question, score, reason = (cells[name] for name in COLUMNS)
        people = roster.called(student) if roster else ()
        student = people[0] if len(people) == 1 else student
        place = folded(student), folded(question)
        whole, points = most.get(place[1]), points_in(score)
        refuse = partial(Problem, table.source, line=line)
        if whole is None:
            problems.append(refuse(f"there is no question {shown(question)}{guess(question, items)}"))
        elif points is None or not 0 <= points <= whole:
            message = f"read {shown(score)}, expected points from 0 to {whole:.12g}"
            problems.append(refuse(message, key="score"))
        elif len(people) > 1:
            message = f"{shown(student)} may be any of {listed(people)}"
            hint = "write the login, or the number, of the student"
            problems.append(refuse(message, key="student", hint=hint))
        elif place in scores:
            problems.append(refuse(f"{shown(student)} has this question twice"))
        else:
            scores[place], students[place[0]] = (points, reason), student
    if problems:
        raise DocumentError(problems)
    return Overrides(table.source, scores, students)
