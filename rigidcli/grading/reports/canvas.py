"""The gradebook that Canvas exports: the column of one assignment is filled, and nothing else is touched.

The form of the file, and how Canvas reads it back, is that of Canvas' GradebookExporter and
GradebookImporter: a header, at most two rows about the assignments (`Manual Posting`, `Points Possible`),
and one row a student. The names of files in a download of submissions are those of its ContentZipper.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rigidcli.errors import DocumentError, Problem, UsageError, nearest, shown
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.reports.layout import points
from rigidcli.grading.reports.reading import name_of, read_bytes
from rigidcli.grading.roster import LOGINS, NAMES, Roster, listed, noted

ABOUT_STUDENTS = frozenset([*NAMES, *LOGINS, "Integration ID", "Root Account", "Section"])

TOTALS = re.compile(r"(Current|Final) (Score|Points|Grade)|Override (Score|Grade|Status)")
"""Columns that Canvas works out itself."""

POINTS = "Points Possible"
"""What the row is called that says how many points an assignment is worth."""

KEPT = frozenset(["EX", "N/A"])
"""Cells that stay: the student is excused, or does not have the assignment."""

_CELL = r'("(?:[^"]|"")*+"|[^{mark}\r\n]*+)({mark}|\r\n|\n|\r|\Z)'
_ID = re.compile(r"\s*\(([0-9]+)\)\s*")


@dataclass(frozen=True, slots=True)
class Filled:
    """The gradebook with the scores in it, and what the instructor should know."""

    text: str
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell: its value, and the place of its text in the file."""

    value: str
    start: int
    end: int


_Row: TypeAlias = Sequence[_Cell]


@dataclass(frozen=True, slots=True)
class _Book:
    """The cells of a gradebook: the names of its columns, and the rows below; `worth` has the points."""

    mark: str
    names: tuple[str, ...]
    rows: Sequence[_Row]
    worth: _Row

    def score(self, score: float) -> str:
        """A score as it is written in this file, with a decimal comma where others have one."""
        text = f"{score:.12g}"
        if any(re.fullmatch(r"[0-9]+,[0-9]+", cell.value) for cell in self.worth):
            text = text.replace(".", ",")
        return f'"{text}"' if self.mark in text else text


def read(path: str | os.PathLike[str]) -> str:
    """The text of an exported gradebook, its byte order mark and ends of lines too. Raises DocumentError."""
    source = name_of(path)
    try:
        return read_bytes(path, source).decode()
    except UnicodeDecodeError as error:
        hint = "export it from Canvas again, or save it as CSV UTF-8"
        message = f"not UTF-8 text: byte {error.start} is {error.object[error.start]:#04x}"
        raise DocumentError([Problem(source, message, hint=hint)]) from None


def fill(text: str, judgements: Iterable[Judgement], column: str) -> Filled:
    """Put the scores into the column of an assignment, which is named by its title, its number, or both.

    Students are known by the names of their answer files. All other text of the file stays as it is.
    Raises UsageError where the column is not there, or not the only one of its name.
    """
    # First the gradebook: nobody waits for judgements that it has no place for.
    book = _book(text)
    place = _place(book, column)
    judgements = tuple(judgements)
    files, notes = Roster(_students(book)).match([each.student for each in judgements])
    edits: list[tuple[_Cell, str]] = []
    kept, replaced = list[str](), 0
    for student, file in files.items():
        row, judgement = book.rows[student], judgements[file]
        cell = row[place] if place < len(row) else _Cell("", row[-1].end, row[-1].end)
        if cell.value.strip().upper() in KEPT:
            kept.append(judgement.student)
            continue
        replaced += bool(cell.value.strip()) and _number(cell.value) != judgement.score
        missing = book.mark * max(0, place + 1 - len(row))
        edits.append((cell, missing + book.score(judgement.score)))
    notes += noted("excused, or without this assignment, and left so", kept)
    if replaced:
        notes.append(f"scores that stood in the column and are replaced: {replaced}")
    most = _number(book.worth[place].value) if place < len(book.worth) else None
    if judgements and most is not None and most != judgements[0].max_score:
        whole = points(judgements[0].max_score)
        notes.append(f"the column is worth {points(most)} points, the assignment {whole}")
    return Filled(_edited(text, edits), tuple(notes))


def _book(text: str) -> _Book:
    """The gradebook of a file, whichever mark separates its cells. Raises UsageError."""
    mark = max(",;", key=lambda each: len(_rows(text, each, 1)[0]))
    header, *rows = _rows(text, mark)
    names = tuple(cell.value.strip() for cell in header)
    if "ID" not in names or not {"Student", "LastName"} & set(names):
        hint = "it begins with the columns `Student` and `ID`"
        raise UsageError("this is not a gradebook that Canvas has exported", hint=hint)
    return _Book(mark, names, rows, next((row for row in rows if POINTS in row[0].value), ()))


def _students(book: _Book) -> dict[int, dict[str, str]]:
    """What the gradebook says of each student, by the number of the row."""
    about = (*NAMES, *LOGINS)
    students = {}
    for number, row in enumerate(book.rows):
        cells = {name: cell.value for name, cell in zip(book.names, row, strict=False) if name in about}
        if POINTS not in row[0].value and any(cell.strip() for cell in cells.values()):
            students[number] = cells
    return students


def _rows(text: str, mark: str, most: int | None = None) -> list[list[_Cell]]:
    """The cells of a file, or of its first rows, separated by a mark."""
    pattern = re.compile(_CELL.format(mark=mark))
    place = 1 if text.startswith("\ufeff") else 0
    rows: list[list[_Cell]] = [[]]
    while found := pattern.match(text, place):
        value, place = found[1], found.end()
        if len(value) > 1 and value[0] == value[-1] == '"':
            value = value[1:-1].replace('""', '"')
        rows[-1].append(_Cell(value, found.start(1), found.end(1)))
        if found[2] == mark:
            continue
        if place == len(text) or len(rows) == most:
            break
        rows.append([])
    return rows


def _edited(text: str, edits: Iterable[tuple[_Cell, str]]) -> str:
    """The text with other texts in place of some cells."""
    pieces, place = [], 0
    for cell, new in sorted(edits, key=lambda edit: edit[0].start):
        pieces += [text[place : cell.start], new]
        place = cell.end
    return "".join([*pieces, text[place:]])


def _number(text: str) -> float | None:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return None


def _place(book: _Book, wanted: str) -> int:
    """The place of the column of an assignment. Raises UsageError."""
    last = max(place for place, name in enumerate(book.names) if name in ABOUT_STUDENTS)
    fixed = {place for place, cell in enumerate(book.worth) if "read only" in cell.value}
    known = {
        place: name
        for place, name in enumerate(book.names)
        if place > last and place not in fixed and name and not TOTALS.search(name)
    }
    for spelt in (_folded, _title, _identifier):
        found = [place for place, name in known.items() if spelt(name) == _folded(wanted)]
        if len(found) == 1:
            return found[0]
        if found:
            hint = f"say which by its number: {listed([known[place] for place in found])}"
            raise UsageError(f"the gradebook has {len(found)} columns {shown(wanted)}", hint=hint)
    near = nearest(wanted, [*known.values(), *(_ID.sub("", name) for name in known.values())])
    meant = f"did you mean {shown(near)}? " if near else ""
    hint = f"{meant}its assignments are {listed(list(known.values()))}" if known else "it has no assignment"
    raise UsageError(f"the gradebook has no column {shown(wanted)}", hint=hint)


def _folded(name: str) -> str:
    return " ".join(name.casefold().split())


def _title(name: str) -> str:
    return _folded(re.sub(f"{_ID.pattern}$", "", name))


def _identifier(name: str) -> str | None:
    found = re.search(f"{_ID.pattern}$", name)
    return found and found[1]
