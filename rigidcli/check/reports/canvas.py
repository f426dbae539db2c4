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
from dataclasses import dataclass

from rigidcli.check.files import listed, noted
from rigidcli.check.records import Judgement
from rigidcli.check.reports.table import points
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


@dataclass(frozen=True, slots=True)
class Filled:
    """The gradebook with the scores in it, and what the instructor should know."""

    text: str
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Book:
    """The rows of a gradebook, the first with the names of its columns; `worth` has the points."""

    mark: str
    rows: list[list[str]]
    worth: list[str]

    @property
    def names(self) -> list[str]:
        """The names of the columns."""
        return [cell.strip() for cell in self.rows[0]]

    def put(self, row: list[str], place: int, score: float) -> None:
        """Put a score into a row, with a decimal comma where other numbers have one."""
        text = f"{score:.12g}"
        if any(re.fullmatch(r"[0-9]+,[0-9]+", cell.strip()) for cell in self.worth):
            text = text.replace(".", ",")
        row += [""] * (place + 1 - len(row))
        row[place] = text

    def written(self, like: str) -> str:
        """The text of the gradebook, whose lines end like those of another text."""
        end = next((end for end in ("\r\n", "\n") if end in like), "\r")
        target = io.StringIO(newline="")
        csv.writer(target, delimiter=self.mark, lineterminator=end).writerows(self.rows)
        return target.getvalue() if like.endswith(end) else target.getvalue().removesuffix(end)


def fill(text: str, judgements: Iterable[Judgement], column: str) -> Filled:
    """Put the scores into the column of an assignment, which is named by its title, its number, or both.

    Students are known by the names of their answer files. All other cells stay as they are, and so does that
    of a student of whom an answer waits for a person.
    Raises UsageError where the column is not there, or not the only one of its name.
    """
    # First the gradebook: nobody waits for judgements that it has no place for.
    start = "\ufeff" if text.startswith("\ufeff") else ""
    book = _book(text.removeprefix(start))
    place = _place(book, column)
    judgements = tuple(judgements)
    files, notes = Roster(_students(book)).match([each.student for each in judgements])
    kept, waiting, replaced = list[str](), list[str](), 0
    for student, file in files.items():
        row, judgement = book.rows[student], judgements[file]
        stands = _value(row, place)
        if stands.upper() in KEPT:
            kept.append(judgement.student)
        elif any(question.verdict == "review" for question in judgement.questions):
            waiting.append(judgement.student)
        else:
            score = judgement.score_to(2)  # as Canvas rounds points
            replaced += bool(stands) and points_in(stands) != score
            book.put(row, place, score)
    notes += noted("an answer waits for a person to judge, and the cell left as it was", waiting)
    notes += noted("excused, or without this assignment, and left so", kept)
    if replaced:
        notes.append(f"scores that stood in the column and are replaced: {replaced}")
    most = points_in(_value(book.worth, place))
    if judgements and most is not None and most != judgements[0].max_score:
        whole = points(judgements[0].max_score)
        notes.append(f"the column is worth {points(most)} points, the assignment {whole}")
    return Filled(start + book.written(text), tuple(notes))


def _book(text: str) -> _Book:
    """The gradebook of a file, whichever mark separates its cells. Raises UsageError."""
    for mark in ",;":
        with suppress(csv.Error, IndexError):
            rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=mark))
            book = _Book(mark, rows, next((row for row in rows if POINTS in _value(row, 0)), []))
            if "ID" in book.names and {"Student", "LastName"} & set(book.names):
                return book
    hint = "it begins with the columns `Student` and `ID`"
    raise UsageError("this is not a gradebook that Canvas has exported", hint=hint)


def _value(row: Sequence[str], place: int) -> str:
    """What a cell says; a short row has empty ones at its end."""
    return row[place].strip() if place < len(row) else ""


def _students(book: _Book) -> dict[int, dict[str, str]]:
    """What the gradebook says of each student, by the number of the row."""
    about = {place: name for place, name in enumerate(book.names) if name in (*NAMES, *LOGINS)}
    students = {}
    for number, row in enumerate(book.rows[1:], 1):
        cells = {name: _value(row, place) for place, name in about.items()}
        if row is not book.worth and any(cells.values()):
            students[number] = cells
    return students


def _place(book: _Book, wanted: str) -> int:
    """The place of the column of an assignment. Raises UsageError."""
    last = max(place for place, name in enumerate(book.names) if name in ABOUT_STUDENTS)
    fixed = {place for place, cell in enumerate(book.worth) if "read only" in cell}
    known = {
        place: name
        for place, name in enumerate(book.names)
        if place > last and place not in fixed and name and not TOTALS.search(name)
    }
    parts = {place: _ASSIGNMENT.fullmatch(name) for place, name in known.items()}
    for part in (0, 1, 2):
        found = [place for place, name in parts.items() if name and _folded(name[part]) == _folded(wanted)]
        if len(found) == 1:
            return found[0]
        if found:
            hint = f"say which by its number: {listed([known[place] for place in found])}"
            raise UsageError(f"the gradebook has {len(found)} columns {shown(wanted)}", hint=hint)
    near = nearest(wanted, [*known.values(), *(name[1] for name in parts.values() if name)])
    meant = f"did you mean {shown(near)}? " if near else ""
    hint = f"{meant}its assignments are {listed(list(known.values()))}" if known else "it has no assignment"
    raise UsageError(f"the gradebook has no column {shown(wanted)}", hint=hint)


def _folded(name: str | None) -> str | None:
    return name and " ".join(name.casefold().split())
