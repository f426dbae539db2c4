"""Gradebooks of Canvas and Moodle: the column of one assignment is filled, and nothing else is touched.

The form of Canvas' file, and how Canvas reads it back, is that of its GradebookExporter and Importer:
a header, at most two rows about the assignments (`Manual Posting`, `Points Possible`), and one row a student.
Moodle's is the grading worksheet of one assignment (its plugin `feedback/offline`): `Identifier`, such as
`Participant 5008`, `Full name`, `Email address`, `Grade`, `Maximum Grade`, in the language of the teacher.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

from rigidcli.errors import UsageError, nearest, shown
from rigidcli.homework.base import Judgement
from rigidcli.homework.files import listed, noted
from rigidcli.homework.reports.formats import points
from rigidcli.homework.roster import LOGINS, NAMES, Cells, Roster, columns_of, points_in, words_of

ABOUT_STUDENTS = frozenset([*NAMES, *LOGINS, "Integration ID", "Root Account", "Section"])

TOTALS = re.compile(r"(Current|Final) (Score|Points|Grade)|Override (Score|Grade|Status)")
"""Columns that Canvas works out itself."""

POINTS = "Points Possible"
"""What the row is called that says how many points an assignment is worth."""

KEPT = frozenset(["EX", "N/A"])
"""Cells that stay: the student is excused, or does not have the assignment."""

GRADES = ("grade", "bewertung", "note", "calificacion", "valutazione")
"""The letters of the column of grades in Moodle's worksheet, in the languages of SPELLINGS."""

MOST = ("maximumgrade", "bestwertung", "maximalebewertung", "notemaximale", "calificacionmaxima")
"""Those of the column that says how many points the assignment is worth."""

MAY_CHANGE = ("gradecanbechanged", "bewertungkannverandertwerden", "bewertungkanngeandertwerden")
"""Those of the column that says whether Moodle takes another grade."""

_ASSIGNMENT = re.compile(r"(.*?)(?:\s*\(([0-9]+)\))?", re.DOTALL)
"""The name of an assignment: its title, and the number that Canvas knows it by."""


class Filled(NamedTuple):
    """The gradebook with the scores in it, and what the instructor should know."""

    text: str
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Book:
    """A gradebook: its `text`, its `rows` with the `mark` between cells, the students of rows, and a column.

    `column` is the place of the cells that are filled, `kept` are the rows in which they stay, and `worth`
    are cells that say how many points the assignment is worth.
    """

    text: str
    mark: str
    rows: list[list[str]]
    students: Mapping[int, Cells]
    column: int
    kept: frozenset[int]
    worth: Sequence[str]


def canvas(text: str, column: str) -> Book:
    """A gradebook of Canvas, and the column of an assignment, named by its title, its number, or both.

    Raises UsageError where the column is not there, or not the only one of its name.
    """
    hint = "it begins with the columns `Student` and `ID`"
    mark, rows = _rows(text, [{"ID"}, {"Student", "LastName"}], "Canvas", hint)
    worth = next((row for row in rows if POINTS in _value(row, 0)), [])
    about = {place: name for place, cell in enumerate(rows[0]) if (name := cell.strip()) in (*NAMES, *LOGINS)}
    column_of = _place(rows[0], worth, column)
    students = {
        number: [(name, _value(row, place)) for place, name in about.items()]
        for number, row in enumerate(rows)
        if number and row is not worth
    }
    kept = frozenset(number for number in students if _value(rows[number], column_of).upper() in KEPT)
    return Book(text, mark, rows, students, column_of, kept, [_value(worth, column_of)])


def moodle(text: str, column: str | None = None) -> Book:
    """A grading worksheet of Moodle, and its column of grades, or another that is named.

    Raises UsageError where it is none.
    """
    hint = "`Download grading worksheet` in an assignment with this kind of feedback exports it"
    mark, rows = _rows(text, [], "Moodle", hint)
    heads = ["".join(words_of(cell)) for cell in rows[0]]
    wanted = GRADES if column is None else ("".join(words_of(column)),)
    places = [place for place, head in enumerate(heads) if head in wanted]
    about = columns_of(rows[0])
    if not any(about) or len(places) != 1:
        if column is None or not any(about):
            raise UsageError("this is not a grading worksheet that Moodle has exported", hint=hint)
        hint = f"its columns are {listed([cell.strip() for cell in rows[0]])}"
        raise UsageError(f"the worksheet has no column {shown(column)}", hint=hint)
    students = {
        number: [(name, _value(row, place)) for place, name in enumerate(about) if name]
        for number, row in enumerate(rows)
        if number
    }
    locked = next((place for place, head in enumerate(heads) if head in MAY_CHANGE), len(heads))
    kept = frozenset(
        number for number in students if _value(rows[number], locked).casefold() in ("no", "nein", "non")
    )
    most = next((place for place, head in enumerate(heads) if head in MOST), len(heads))
    return Book(text, mark, rows, students, places[0], kept, [_value(row, most) for row in rows[1:]])


def fill(book: Book, judgements: Iterable[Judgement], aliases: Mapping[str, Sequence[str]]) -> Filled:
    """The gradebook with the scores; `aliases` are other names of students in the results.

    All other cells stay as they are, and so does that of a student of whom an answer waits for a person.
    """
    judgements = tuple(judgements)
    rows = [list(row) for row in book.rows]
    named = [[each.student, *aliases.get(each.student, ())] for each in judgements]
    hands, notes = Roster(book.students).match(named)
    cells = [*book.worth, *(_value(row, book.column) for row in rows[1:])]
    has_commas = any(re.fullmatch(r"[0-9]+,[0-9]+", cell) for cell in cells)
    kept, waiting, replaced = list[str](), list[str](), 0
    for student, hand in hands.items():
        row, judgement = rows[student], judgements[hand]
        stands = _value(row, book.column)
        if student in book.kept:
            kept.append(judgement.student)
        elif any(question.verdict == "review" for question in judgement.questions):
            waiting.append(judgement.student)
        else:
            score = judgement.score_to(2)  # as Canvas rounds points
            replaced += points_in(stands) not in (None, score)
            row += [""] * (book.column + 1 - len(row))
            row[book.column] = f"{score:.12g}".replace(".", "," if has_commas else ".")
    notes += noted("an answer waits for a person to judge, and the cell left as it was", waiting)
    notes += noted("excused, locked, or without this assignment, and left so", kept)
    if replaced:
        notes.append(f"scores that stood in the column and are replaced: {replaced}")
    most = next((number for cell in book.worth if (number := points_in(cell)) is not None), None)
    if judgements and most is not None and most != judgements[0].max_score:
        whole = points(judgements[0].max_score)
        notes.append(f"the column is worth {points(most)} points, the assignment {whole}")
    start = "\ufeff" if book.text.startswith("\ufeff") else ""
    return Filled(start + _written(rows, book.mark, like=book.text), tuple(notes))


def _rows(text: str, needed: Sequence[set[str]], platform: str, hint: str) -> tuple[str, list[list[str]]]:
    """What separates the cells of a gradebook, and its rows. Raises UsageError."""
    for mark in ",;\t":
        with suppress(csv.Error, IndexError):
            rows = list(csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), delimiter=mark))
            names = {cell.strip() for cell in rows[0]}
            if len(names) > 1 and all(names & one_of for one_of in needed):
                return mark, rows
    raise UsageError(f"this is not a gradebook that {platform} has exported", hint=hint)


def _written(rows: Sequence[Sequence[str]], mark: str, like: str) -> str:
    """The text of a gradebook, whose lines end like those of another text."""
    end = next((end for end in ("\r\n", "\n") if end in like), "\r")
    target = io.StringIO(newline="")
    csv.writer(target, delimiter=mark, lineterminator=end).writerows(rows)
    return target.getvalue() if like.endswith(end) else target.getvalue().removesuffix(end)


def _value(row: Sequence[str], place: int) -> str:
    """What a cell says; a short row has empty ones at its end."""
    return row[place].strip() if place < len(row) else ""


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
