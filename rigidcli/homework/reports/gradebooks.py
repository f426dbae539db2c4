"""Gradebooks of Canvas and Moodle: the column of one assignment is filled, and nothing else is touched.

The form of Canvas' file, and how Canvas reads it back, is that of its GradebookExporter and Importer:
a header, at most two rows about the assignments (`Manual Posting`, `Points Possible`), and one row a student.
Moodle's is the grading worksheet of one assignment (its plugin `feedback/offline`): `Identifier`, such as
`Participant 5008`, `Full name`, `Email address`, `Grade`, `Maximum Grade`, in the language of the teacher.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rigidcli.errors import UsageError, shown
from rigidcli.homework.answers import folded
from rigidcli.homework.base import Judgement, Tell
from rigidcli.homework.owner import listed, noted, words_of
from rigidcli.homework.reports.formats import ReportStyle, points
from rigidcli.homework.roster import LOGINS, NAMES, ROW_OF_POINTS, SPELLINGS, Roster, columns_of
from rigidcli.homework.spreadsheets import Spreadsheet, cell, points_in
from rigidcli.suggestions import did_you_mean, nearest

ABOUT_STUDENTS = frozenset([*NAMES, *LOGINS, "Integration ID", "Root Account", "Section"])

# Columns that Canvas works out itself.
TOTALS = re.compile(r"(Current|Final) (Score|Points|Grade)|Override (Score|Grade|Status)")

KEPT = frozenset(["EX", "N/A"])  # cells that stay: excused, or without this assignment

# The name of an assignment: its title, and the number that Canvas knows it by.
_ASSIGNMENT = re.compile(r"(.*?)(?:\s*\(([0-9]+)\))?", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Gradebook:
    """A gradebook: its `table`, the `people` by the numbers of their rows, and the `column` that is filled.

    Cells in the rows `kept` stay. The cells `worth` say how many points the assignment is worth.
    """

    table: Spreadsheet
    people: Roster
    column: int
    kept: frozenset[int]
    worth: Sequence[str]


def canvas(table: Spreadsheet, column: str) -> Gradebook:
    """A gradebook of Canvas, and the column of an assignment, named by its title, its number, or both.

    Raises UsageError where the column is not there, or not the only one of its name.
    """
    head, *rows = table.rows or [[]]
    names = [name.strip() for name in head]
    if "ID" not in names or {"Student", "LastName"}.isdisjoint(names):
        hint = "it begins with the columns `Student` and `ID`"
        raise UsageError(f"`{table.source}` is not a gradebook that Canvas has exported", hint=hint)
    worth = next((row for row in rows if ROW_OF_POINTS in cell(row, 0)), [])
    about = [name if name in (*NAMES, *LOGINS) else "" for name in names]
    place = _place(names, worth, column)
    people = Roster(about, table, kind="gradebook")
    kept = frozenset(number for number in people.rows if cell(table.rows[number], place).upper() in KEPT)
    return Gradebook(table, people, place, kept, [cell(worth, place)])


def moodle(table: Spreadsheet) -> Gradebook:
    """A grading worksheet of Moodle, and its column of grades. Raises UsageError where it is none."""
    head, *rows = table.rows or [[]]
    heads = ["".join(words_of(name)) for name in head]
    places = [place for place, name in enumerate(heads) if name in SPELLINGS["Grade"]]
    about = columns_of(head)
    if not any(about) or len(places) != 1:
        hint = "`Download grading worksheet` in an assignment with this kind of feedback exports it"
        message = f"`{table.source}` is not a grading worksheet that Moodle has exported"
        raise UsageError(message, hint=hint)
    people = Roster(about, table, kind="gradebook")
    locked, most = (
        next((place for place, name in enumerate(heads) if name in names), len(heads))
        for names in (SPELLINGS["Grade can be changed"], SPELLINGS["Maximum Grade"])
    )
    no = SPELLINGS["no"]
    kept = frozenset(number for number in people.rows if cell(table.rows[number], locked).casefold() in no)
    return Gradebook(table, people, places[0], kept, [cell(row, most) for row in rows])


def fill(
    book: Gradebook,
    aliases: Mapping[str, Sequence[str]],
    tell: Tell,
    judgements: Iterable[Judgement],
    style: ReportStyle,
) -> Iterator[str]:
    """The gradebook with the scores; `aliases` are other names of students in the results.

    All other cells stay as they are. The cell of a student stays, too, if an answer waits for a person. It
    stays if nothing is handed in and no person has given a score. `tell` gets notes for the instructor.
    """
    handed_in = [each for each in judgements if each.source or each.is_overridden]
    rows = [list(row) for row in book.table.rows]
    named = [[each.student, *aliases.get(each.student, ())] for each in handed_in]
    hands, notes = book.people.match(named)
    cells = [*book.worth, *(cell(row, book.column) for row in rows[1:])]
    has_commas = any(re.fullmatch(r"[0-9]+,[0-9]+", text) for text in cells)
    undecided = {False: ("review",), True: ("review", "invalid")}  # of several files none is judged
    kept, waiting, replaced = list[str](), list[str](), 0
    for number, hand in hands.items():
        row, judgement = rows[number], handed_in[hand]
        if number in book.kept:
            kept.append(judgement.student)
        elif any(question.verdict in undecided[not judgement.source] for question in judgement.questions):
            waiting.append(judgement.student)
        else:
            score = judgement.score_to(2)  # as Canvas rounds points
            replaced += points_in(cell(row, book.column)) not in (None, score)
            row += [""] * (book.column + 1 - len(row))
            row[book.column] = f"{score:.12g}".replace(".", "," if has_commas else ".")
    notes += noted("an answer waits for a person to judge, and the cell left as it was", waiting)
    notes += noted("excused, locked, or without this assignment, and left so", kept)
    if replaced:
        notes.append(f"scores that stood in the column and are replaced: {replaced}")
    most = next((worth for text in book.worth if (worth := points_in(text)) is not None), None)
    if handed_in and most is not None and most != handed_in[0].max_score:
        whole = points(handed_in[0].max_score)
        notes.append(f"the column is worth {points(most)} points, the assignment {whole}")
    tell(book.table.source, notes)
    yield book.table.with_rows(rows)


def _place(names: Sequence[str], worth: Sequence[str], wanted: str) -> int:
    last = max(place for place, name in enumerate(names) if name in ABOUT_STUDENTS)
    titles = {
        place: name
        for place, name in enumerate(names)
        if place > last and name and "read only" not in cell(worth, place) and not TOTALS.search(name)
    }
    parts = {place: _ASSIGNMENT.fullmatch(name) for place, name in titles.items()}
    for part in (0, 1, 2):
        named = {place: match[part] for place, match in parts.items() if match and match[part]}
        places = [place for place, name in named.items() if folded(name) == folded(wanted)]
        if len(places) == 1:
            return places[0]
        if places:
            hint = f"say which by its number: {listed([titles[place] for place in places])}"
            raise UsageError(f"the gradebook has {len(places)} columns {shown(wanted)}", hint=hint)
    near = nearest(wanted, [*titles.values(), *(name[1] for name in parts.values() if name)])
    meant = did_you_mean(near and shown(near))
    hint = f"its assignments are {listed(list(titles.values()))}" if titles else "it has no assignment"
    raise UsageError(f"the gradebook has no column {shown(wanted)}{meant}", hint=hint)
