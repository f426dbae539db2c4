"""Tables of csv that instructors give, and one kind of them: the scores that a person has given."""

from __future__ import annotations

import csv
import io
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import NamedTuple

from rigidcli.errors import DocumentError, Problem, guess, shown
from rigidcli.fields.texts import read_text, safe_name
from rigidcli.homework.answers import folded
from rigidcli.homework.base import Judgement, Tell
from rigidcli.homework.names import listed, noted

# Length of a file that an instructor gives: a gradebook of thousands of students has some 5 MB.
MOST_BYTES = 50_000_000
ROWS_TRIED = 20  # rows by which the separator of cells is chosen


def read_own(path: str | os.PathLike[str]) -> str:
    """The text of a file that an instructor gives, or of a pipe. Raises DocumentError.

    Spreadsheets write UTF-8, UTF-16 with its mark, or Windows' own code.
    """
    return read_text(os.fspath(path), safe_name(path), MOST_BYTES, fallback="cp1252")


@dataclass(frozen=True, slots=True)
class Spreadsheet:
    """A table of csv with its `text`, and what separates the cells of its `rows`; `source` is its name.

    `lines` tells on which line of the text each row begins.
    """

    source: str
    text: str
    separator: str
    rows: list[list[str]]
    lines: list[int]

    def with_rows(self, rows: Sequence[Sequence[str]]) -> str:
        """The text of these rows, whose lines end like those of this table."""
        end = next((end for end in ("\r\n", "\n") if end in self.text), "\r")
        target = io.StringIO(newline="")
        csv.writer(target, delimiter=self.separator, lineterminator=end).writerows(rows)
        text = target.getvalue() if self.text.endswith(end) else target.getvalue().removesuffix(end)
        return "\ufeff" * self.text.startswith("\ufeff") + text


def read_spreadsheet(path: str | os.PathLike[str]) -> Spreadsheet:
    """The table of csv in a file. Raises DocumentError."""
    return spreadsheet_of(read_own(path), safe_name(path))


def spreadsheet_of(text: str, source: str = "") -> Spreadsheet:
    """A text as a table of csv, whatever separates the cells. Raises DocumentError."""
    body = text.removeprefix("\ufeff")
    separator = max(",;\t", key=lambda mark: _fit(body, mark))
    rows, lines = list[list[str]](), [1]
    reader = csv.reader(io.StringIO(body, newline=""), delimiter=separator)
    try:
        for row in reader:
            rows.append(row)
            lines.append(reader.line_num + 1)
        if rows and "".join(rows[-1][-1:]).endswith(("\n", "\r")) and not body.rstrip().endswith('"'):
            lines.pop()
            raise csv.Error("a quotation mark is opened, and not closed")
    except csv.Error as error:
        message = f"cannot be read as a table: {error}"
        raise DocumentError([Problem(source, message, lines[-1])]) from None
    return Spreadsheet(source, text, separator, rows, lines)


def _fit(text: str, separator: str) -> tuple[int, int]:
    """How many of the first rows have the same number of cells, if these are several, and that number."""
    rows = islice(csv.reader(io.StringIO(text, newline=""), delimiter=separator), ROWS_TRIED)
    with suppress(csv.Error):
        numbers = Counter(len(row) for row in rows if len(row) > 1)
        return max(((count, number) for number, count in numbers.items()), default=(0, 0))
    return 0, 0


def cell(row: Sequence[str], place: int) -> str:
    """The text of a cell; it is empty behind the end of a short row."""
    return row[place].strip() if place < len(row) else ""


def points_in(text: str) -> float | None:
    """The points in a cell, perhaps with a decimal comma; None where it holds no number."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None


# --- scores by a person

# The columns of a table of scores that a person has given; the last may be missing.
COLUMNS = ("student", "question", "score", "reason")


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
    path: str | os.PathLike[str],
    worth: Mapping[str, float],
    called: Callable[[str], Sequence[str]] | None = None,
) -> Overrides:
    """The overrides in a file, of questions that are `worth` points. Raises DocumentError.

    Of a roster, `called` tells the students whom a name may mean.
    """
    table = read_spreadsheet(path)
    heads = [folded(head) for row in table.rows[:1] for head in row]
    if missing := [name for name in COLUMNS[:3] if name not in heads]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(table.source, message, 1)])
    most = {folded(id): points for id, points in worth.items()}
    scores, problems = dict[tuple[str, str], Score](), list[Problem]()
    for line, row in enumerate(table.rows[1:], 2):
        cells = defaultdict(str, zip(heads, map(str.strip, row), strict=False))
        if not any(cells.values()):
            continue
        student, question, score, reason = (cells[name] for name in COLUMNS)
        people = called(student) if called else ()
        student = people[0] if len(people) == 1 else student
        place = folded(student), folded(question)
        whole, points = most.get(place[1]), points_in(score)
        refuse = partial(Problem, table.source, line=line)
        if whole is None:
            problems.append(refuse(f"there is no question {shown(question)}{guess(question, list(worth))}"))
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
            scores[place] = Score(points, reason, student)
    if problems:
        raise DocumentError(problems)
    return Overrides(table.source, scores)
