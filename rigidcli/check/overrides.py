"""A person's judgement over the tool's: a table of students, questions, scores and reasons."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from rigidcli.check.answers import folded
from rigidcli.check.files import noted
from rigidcli.check.judge import Item
from rigidcli.check.records import Judged, Judgement
from rigidcli.check.roster import points_in, read_table
from rigidcli.errors import DocumentError, Problem, nearest, shown

COLUMNS = ("student", "question", "score", "reason")
"""The columns of the table; the last may be missing."""


@dataclass(frozen=True, slots=True)
class Overrides:
    """The names of `students` as they are spelled, and `scores` with reasons, by student and question."""

    students: dict[str, str] = field(default_factory=dict)
    scores: dict[tuple[str, str], tuple[float, str]] = field(default_factory=dict)

    def over(self, judgements: Iterable[Judgement], notes: list[str]) -> Iterator[Judgement]:
        """The judgements with the scores of the person; at the end, notes on students who are not there."""
        unknown = dict(self.students)

        def judged(student: str, question: Judged) -> Judged:
            mark = self.scores.get((student, folded(question.id)))
            return question if mark is None else question.overridden(*mark)

        for judgement in judgements:
            student = folded(judgement.student)
            unknown.pop(student, None)
            yield replace(judgement, questions=tuple(judged(student, each) for each in judgement.questions))
        notes += noted("nobody of this name has a row, and the override is left out", list(unknown.values()))


def read_overrides(path: str | os.PathLike[str], items: Mapping[str, Item]) -> Overrides:
    """The overrides in a file. Raises DocumentError with all that is wrong with it."""
    source = os.fsencode(path).decode(errors="backslashreplace")
    head, rows = read_table(path)
    places = {folded(name): place for place, name in enumerate(head)}
    if missing := [name for name in COLUMNS[:3] if name not in places]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(source, message, 1)])
    by_name = {folded(id): item for id, item in items.items()}
    overrides, problems = Overrides(), list[Problem]()
    for line, row in enumerate(rows, 2):
        if not any(cell.strip() for cell in row):
            continue
        student, question, score, reason = (
            row[place].strip() if (place := places.get(name, len(row))) < len(row) else "" for name in COLUMNS
        )
        item, points = by_name.get(folded(question)), points_in(score)
        if item is None:
            near = nearest(question, list(items))
            guess = f" (did you mean {near}?)" if near else ""
            problems.append(Problem(source, f"there is no question {shown(question)}{guess}", line))
        elif points is None or not 0 <= points <= item.points:
            expected = f"points from 0 to {item.points:.12g}"
            problems.append(Problem(source, f"read {shown(score)}, expected {expected}", line, "score"))
        elif (folded(student), folded(question)) in overrides.scores:
            problems.append(Problem(source, f"{shown(student)} has this question twice", line))
        else:
            overrides.scores[folded(student), folded(question)] = points, reason
            overrides.students[folded(student)] = student
    if problems:
        raise DocumentError(problems)
    return overrides
