"""The gradebook that Canvas exports: the column of one assignment is filled, and nothing else is touched.

The form of the file, and how Canvas reads it back, is that of Canvas' GradebookExporter and
GradebookImporter: a header, at most two rows about the assignments (`Manual Posting`, `Points Possible`),
and one row a student. The names of files in a download of submissions are those of its ContentZipper.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import NamedTuple

from rigidcli.check.base import Judgement
from rigidcli.check.files import listed, noted
from rigidcli.check.reports.formats import points
from rigidcli.check.roster import LOGINS, NAMES, Roster, points_in
from rigidcli.errors import UsageError, nearest, shown

ABOUT_STUDENTS = frozenset([*NAMES, *LOGINS, "Integration ID", "Root Account", "Section"])

TOTALS = re.compile(r"(Current|Final) (Score|Points|Grade)|Override (Score|Grade|Status)")
"""Columns that Canvas works out itself."""

POINTS = "Points Possible"
"""What the row is called that says how many points an assignment is worth."""

KEPT = frozenset(["EX", "N/A"])
"""Cells that stay: the student is excused, or does not have the assignment."""

_ASSIGNMENT = re.compile(r"(.*?)(?:\s*\(([0-9]+)\))?", re.DOTALL)
"""The name of an assignment: its title, and the number that Canvas knows it by."""


class Filled(NamedTuple):
    """The gradebook with the scores in it, and what the instructor should know."""

    text: str
    notes: tuple[str, ...]


def fill(text: str, judgements: Iterable[Judgement], column: str) -> Filled:
    """Put the scores into the column of an assignment, which is named by its title, its number, or both.

    The names of answer files say whose they are. All other cells stay as they are, and so does that
    of a student of whom an answer waits for a person.
    Raises UsageError where the column is not there, or not the only one of its name.
    """
    # First the gradebook: nobody waits for judgements that it has no place for.
    start = "\ufeff" if text.startswith("\ufeff") else ""
    mark, rows = _rows(text.removeprefix(start))
    worth = next((row for row in rows if POINTS in _value(row, 0)), [])
    place = _place(rows[0], worth, column)
    judgements = tuple(judgements)
    files, notes = Roster(_students(rows, worth)).match([each.student for each in judgements])
    has_commas = any(re.fullmatch(r"[0-9]+,[0-9]+", cell.strip()) for cell in worth)
    kept, waiting, replaced = list[str](), list[str](), 0
    for student, file in files.items():
        row, judgement = rows[student], judgements[file]
        stands = _value(row, place)
        if stands.upper() in KEPT:
            kept.append(judgement.student)
        elif any(question.verdict == "review" for question in judgement.questions):
            waiting.append(judgement.student)
        else:
            score = judgement.score_to(2)  # as Canvas rounds points
            replaced += bool(stands) and points_in(stands) != score
            row += [""] * (place + 1 - len(row))
            row[place] = f"{score:.12g}".replace(".", "," if has_commas else ".")
    notes += noted("an answer waits for a person to judge, and the cell left as it was", waiting)
    notes += noted("excused, or without this assignment, and left so", kept)
    if replaced:
        notes.append(f"scores that stood in the column and are replaced: {replaced}")
    most = points_in(_value(worth, place))
    if judgements and most is not None and most != judgements[0].max_score:
        whole = points(judgements[0].max_score)
        notes.append(f"the column is worth {points(most)} points, the assignment {whole}")
    return Filled(start + _written(rows, mark, like=text), tuple(notes))


def _rows(text: str) -> tuple[str, list[list[str]]]:
    """What separates the cells of a gradebook, and its rows. Raises UsageError."""
    for mark in ",;":
        with suppress(csv.Error, IndexError):
            rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=mark))
            names = {cell.strip() for cell in rows[0]}
            if "ID" in names and names & {"Student", "LastName"}:
                return mark, rows
    hint = "it begins with the columns `Student` and `ID`"
    raise UsageError("this is not a gradebook that Canvas has exported", hint=hint)


def _written(rows: Sequence[Sequence[str]], mark: str, like: str) -> str:
    """The text of a gradebook, whose lines end like those of another text."""
    end = next((end for end in ("\r\n", "\n") if end in like), "\r")
    target = io.StringIO(newline="")
    csv.writer(target, delimiter=mark, lineterminator=end).writerows(rows)
    return target.getvalue() if like.endswith(end) else target.getvalue().removesuffix(end)


def _value(row: Sequence[str], place: int) -> str:
    """What a cell says; a short row has empty ones at its end."""
    return row[place].strip() if place < len(row) else ""


def _students(rows: Sequence[Sequence[str]], worth: Sequence[str]) -> dict[int, list[tuple[str, str]]]:
    """What the gradebook says of each student, by the number of the row."""
    about = {place: name for place, cell in enumerate(rows[0]) if (name := cell.strip()) in (*NAMES, *LOGINS)}
    return {
        number: [(name, _value(row, place)) for place, name in about.items()]
        for number, row in enumerate(rows)
        if number and row is not worth
    }


def _place(head: Sequence[str], worth: Sequence[str], wanted: str) -> int:
    """The place of the column of an assignment. Raises UsageError."""
    names = [cell.strip() for cell in head]
    last = max(place for place, name in enumerate(names) if name in ABOUT_STUDENTS)
    titles = {
        place: name
        for place, name in enumerate(names)
        if place > last and name and "read only" not in _value(worth, place) and not TOTALS.search(name)
    }
    parts = {place: _ASSIGNMENT.fullmatch(name) for place, name in titles.items()}
    for part in (0, 1, 2):
        places = [place for place, name in parts.items() if name and _folded(name[part]) == _folded(wanted)]
        if len(places) == 1:
            return places[0]
        if places:
            hint = f"say which by its number: {listed([titles[place] for place in places])}"
            raise UsageError(f"the gradebook has {len(places)} columns {shown(wanted)}", hint=hint)
    near = nearest(wanted, [*titles.values(), *(name[1] for name in parts.values() if name)])
    meant = f"did you mean {shown(near)}? " if near else ""
    hint = f"{meant}its assignments are {listed(list(titles.values()))}" if titles else "it has no assignment"
    raise UsageError(f"the gradebook has no column {shown(wanted)}", hint=hint)


def _folded(name: str | None) -> str | None:
    return name and " ".join(name.casefold().split())
