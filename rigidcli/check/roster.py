"""Whose a hand-in is, and the tables of instructors: lists of students, and scores by a person."""

from __future__ import annotations

import csv
import io
import os
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import TypeAlias

from rigidcli.check.answers import folded
from rigidcli.check.base import MISSING, Judgement, Outcome, Unreadable
from rigidcli.check.files import CANVAS, MOODLE, Batch, Place, is_answer, listed, noted, submitted, uncounted
from rigidcli.errors import DocumentError, Problem, nearest, printable, shown
from rigidcli.fields.texts import ending, read_text

NAMES = ("Student", "LastName", "FirstName")
"""The columns of a student's name, in one or in two."""

LOGINS = ("SIS Login ID", "SIS User ID", "ID")
"""The columns of what the school, and Canvas, call a student."""

SPELLINGS = {
    "Student": ("student", "name", "fullname", "studentname"),
    "LastName": ("lastname", "surname", "familyname"),
    "FirstName": ("firstname", "givenname"),
    "SIS Login ID": ("sisloginid", "login", "loginid", "username", "netid", "email", "emailaddress"),
    "SIS User ID": ("sisuserid", "sid", "studentid", "idnumber"),
    "ID": ("id",),
}
"""The letters of these columns in other lists of students, such as those of Moodle and Gradescope."""

TEST_STUDENT = "Student, Test"
"""The student that Canvas adds to every course, who is nobody."""

TABLES = frozenset([".csv", ".tsv", ".npy"])
"""Endings of files that answers name: one that lies beside answer files is no hand-in by itself."""

_STUDENT = re.compile(r"(?P<name>.+)_(?P<id>[0-9]+)")
_WORD = re.compile(r"[^\W_]+")


@dataclass(frozen=True, slots=True)
class Paper:
    """What a student has handed in: a file, or none; with an `outcome` if the program does not judge it."""

    student: str
    file: Path | None = None
    source: str = ""
    outcome: Outcome | None = None


def papers(batch: Batch, roster: Roster | None = None) -> tuple[list[Paper], list[str]]:
    """The hand-in of every student, also of those on the roster without one; and notes on who is who."""
    names: dict[str, str] = {}
    answers, others = defaultdict[str, list[Place]](list), defaultdict[str, list[Place]](list)
    notes, unknown, doubtful = list[str](), list[str](), list[str]()
    everything, judged = [*batch.answers, *batch.others], set(batch.answers)
    named = _students(everything) if roster is None else _named(everything, roster)
    for place, plain in zip(everything, named, strict=True):
        is_judged = place in judged
        for name in place.owners or (plain,):
            keys = set[int]() if roster is None else roster.find(name)
            student = roster.labels[min(keys)] if roster is not None and len(keys) == 1 else name
            if roster is not None and is_judged and len(keys) != 1:
                (doubtful if keys else unknown).append(name)
            names.setdefault(folded(student), student)
            (answers if is_judged else others)[folded(student)].append(place)
    notes += noted("not found in the roster", unknown)
    notes += noted("more than one student of the roster may be meant by", doubtful)
    rows, double = list[Paper](), list[str]()
    for key, student in names.items():
        last, earlier = _latest(answers[key])
        notes += noted(f"handed in again by {printable(student)}, and the earlier left out", earlier)
        # A table beside answer files is one that they name; any other file is a hand-in, such as a pdf.
        files = [(each, each.file.name) for each in others[key]]
        scans = [name for each, name in files if each.way or submitted(name)[0] or ending(name) not in TABLES]
        if len(last) == 1:
            rows.append(Paper(student, last[0].file, last[0].source))
        elif last:
            double.append(student)
            detail = f"{len(last)} answer files are this student's: {listed([each.source for each in last])}"
            rows.append(Paper(student, outcome=Unreadable("duplicate_key", detail).outcome))
        elif scans:
            detail = f"read {listed(scans)}, which is no answer file"
            rows.append(Paper(student, outcome=Outcome.review(detail)))
    notes += noted("more than one answer file, and none of them judged", double)
    if roster is not None:
        given = {folded(paper.student) for paper in rows}
        lacking = (label for label in roster.labels.values() if folded(label) not in given)
        rows += [Paper(label, outcome=MISSING) for label in lacking]
    return rows, notes


def _latest(places: Sequence[Place]) -> tuple[list[Place], list[str]]:
    """The last of copies that differ in Canvas' number or LATE only, and the names of the earlier ones."""
    forms = [CANVAS.fullmatch(place.file.name) for place in places]
    numbered = [(int(form["number"]), place) for form, place in zip(forms, places, strict=True) if form]
    names = {uncounted(form["own"]) for form in forms if form}
    if not places or len(numbered) < len(places) or len(names) > 1 or len({each.way for each in places}) > 1:
        return list(places), []
    *earlier, (_, last) = sorted(numbered, key=lambda each: each[0])
    return [last], [place.file.name for _, place in earlier]


# --- by folders and names of files


def _students(places: Sequence[Place]) -> list[str]:
    """The student of each place: the first folder that tells hand-ins apart, or the name of the file.

    A student chooses the names within the own folder only, and so a folder comes before what is in it.
    """
    ways: dict[int, list[tuple[str, ...]]] = defaultdict(list)
    for place in places:
        ways[place.root].append(place.way)
    shared = {root: _shared(below) for root, below in ways.items()}
    held = {(place.root, place.way) for place in places if is_answer(place.file.name)}
    # Where an answer file lies in the one folder that all share, or nothing lies deeper, it is a student's.
    own = {
        root: bool(common) and ((root, common) in held or not any(way > common for way in ways[root]))
        for root, common in shared.items()
    }
    stems = [CANVAS.fullmatch(place.file.stem) for place in places]
    numbers = Counter(stem["number"] for stem in stems if stem)
    students = []
    for place, stem in zip(places, stems, strict=True):
        common = shared[place.root]
        level = len(common) - own[place.root]
        if len(place.way) > level:
            platform = (submitted(folder, (MOODLE,))[0] for folder in place.way[: level + 1])
            students.append(next(filter(None, platform), place.way[level]))
        else:
            # Numbers of files differ, while `hw_10_3_ada` and `hw_10_3_bob` are no names by Canvas.
            is_alike = stem is not None and numbers[stem["number"]] > 1
            name = "" if is_alike else submitted(place.file.stem)[0]
            students.append(name or place.file.stem)
    return students


def _named(places: Sequence[Place], roster: Roster) -> list[str]:
    """The name of each place that a roster is asked for: that of a folder, or of the file.

    Of the folders of each of ANSWERS, the first level decides that has the name of a student or the form of a
    platform. A student chooses the names of what lies deeper, and could take the place of another by them.
    Where no folder has, the names of files decide; and where these are unknown, too, the list is no help.
    """
    names = [tuple(submitted(folder, (MOODLE,))[0] or folder for folder in place.way) for place in places]
    levels: dict[int, int] = {}
    for place, folders in zip(places, names, strict=True):
        for level, (folder, name) in enumerate(zip(place.way, folders, strict=True)):
            if folder != name or roster.find(name):
                levels[place.root] = min(level, levels.get(place.root, level))
    named = []
    for place, folders, plain in zip(places, names, _students(places), strict=True):
        if (level := levels.get(place.root, len(folders))) < len(folders):
            named.append(folders[level])
        else:
            is_plain = place.root not in levels and not roster.find(place.file.stem)
            named.append(plain if is_plain else place.file.stem)
    return named


def _shared(ways: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """The folders that all ways into folders begin with."""
    levels = takewhile(lambda level: len(set(level)) == 1, zip(*filter(None, ways), strict=False))
    return tuple(level[0] for level in levels)


# --- by a list of students


def read_table(path: str | os.PathLike[str]) -> tuple[list[str], list[list[str]]]:
    """The head and the rows of an instructor's csv, whatever mark separates cells. Raises DocumentError."""
    source = os.fsencode(path).decode(errors="backslashreplace")
    text = read_text(os.fspath(path), source)
    mark = max(",;\t", key=text.partition("\n")[0].count)
    try:
        header, *rows = csv.reader(io.StringIO(text, newline=""), delimiter=mark)
    except (ValueError, csv.Error):
        return [], []
    return header, rows


def points_in(cell: str) -> float | None:
    """The points in a cell, perhaps with a decimal comma; None where it holds no number."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return None


def read_roster(path: str | os.PathLike[str]) -> Roster:
    """The students of a table in a file, one a row, with columns of SPELLINGS. Raises DocumentError."""
    header, rows = read_table(path)
    columns_by_spelling = {spelling: column for column, all in SPELLINGS.items() for spelling in all}
    columns = [columns_by_spelling.get("".join(_words(name)), "") for name in header]
    if not any(columns):
        source = os.fsencode(path).decode(errors="backslashreplace")
        hint = "its first line names columns such as `name`, `login` and `id`"
        raise DocumentError([Problem(source, "read no list of students", 1, hint=hint)])
    return Roster(
        {
            number: [(column, cell) for column, cell in zip(columns, row, strict=False) if column]
            for number, row in enumerate(rows)
            if row and "Points Possible" not in row[0]
        }
    )


class Roster:
    """The students of a list, or of a gradebook, by all that a name in a download may say of one."""

    def __init__(self, students: Mapping[int, Sequence[tuple[str, str]]]) -> None:
        """The cells about each student, with the names of their columns, of which several may be alike."""
        self.labels: dict[int, str] = {}
        self._names: dict[int, str] = {}
        self._meant: dict[str, set[int]] = defaultdict(set)
        for key, raw in students.items():
            cells = [(column, printable(cell.strip())) for column, cell in raw if cell.strip()]
            parts = dict(reversed(cells))
            name = parts.get("Student") or ", ".join(filter(None, map(parts.get, NAMES[1:])))
            if name == TEST_STUDENT or not cells:
                continue
            logins = [cell for kind in LOGINS for column, cell in cells if column == kind]
            self._names[key], self.labels[key] = name, next(iter(logins), name)
            for login in logins:
                self._meant[login.casefold()].add(key)
                self._meant[login.casefold().partition("@")[0]].add(key)
            for spelling in _spellings(name):
                self._meant[spelling].add(key)
        alike = Counter(self._names.values())
        self.labels |= {key: name for key, name in self._names.items() if name and alike[name] == 1}

    @property
    def students(self) -> dict[str, str]:
        """The name of each student in the list, by the label that results have."""
        return {label: self._names[key] or label for key, label in self.labels.items()}

    def find(self, name: str) -> set[int]:
        """The students that a name may mean, by the first way that leads to any."""
        if keys := self._meant.get(name.casefold()) or self._meant.get(_sorted(name)):
            return keys
        joined = submitted(name)[0]
        match = _STUDENT.fullmatch(joined or name)
        if match is None:
            return set()
        numbered, called = (self._meant.get(key, set()) for key in (match["id"], _sorted(match["name"])))
        if not called and not joined:
            return set()  # any name may end in a number
        # The number may be another's, of Moodle: a name that does not fit it leaves the student in doubt.
        return numbered & called or numbered | called

    def match(self, students: Sequence[str]) -> tuple[dict[int, int], list[str]]:
        """The place among `students` of each row of a gradebook, and notes on those without one."""
        places: dict[int, list[int]] = defaultdict(list)
        unknown, doubtful = list[str](), list[str]()
        for place, name in enumerate(students):
            keys = self.find(name)
            if len(keys) == 1:
                places[min(keys)].append(place)
            else:
                (doubtful if keys else unknown).append(name)
        several = [students[place] for rows in places.values() if len(rows) > 1 for place in rows]
        absent = [name for key, name in self._names.items() if key not in places]
        notes = noted("not found in the gradebook", unknown)
        notes += noted("more than one student of the gradebook may be meant by", doubtful)
        notes += noted("several hand-ins of one student, and none of them taken", several)
        notes += noted("no answer file, and the cell left as it was", absent)
        return {key: own[0] for key, own in places.items() if len(own) == 1}, notes


def _words(name: str) -> list[str]:
    """The words of a name in small letters without accents."""
    plain = unicodedata.normalize("NFKD", re.sub("['’]", "", name)).casefold()
    return _WORD.findall("".join(char for char in plain if not unicodedata.combining(char)))


def _sorted(name: str) -> str:
    """The words of a name in the order of the alphabet."""
    return " ".join(sorted(_words(name)))


def _spellings(name: str) -> set[str]:
    """A name as its words in any order, and written as one word with either name first."""
    last, _, first = name.partition(",")
    both = ["".join(_words(part)) for part in (last, first)]
    return {_sorted(name), "".join(both), "".join(reversed(both))} - {""}


# --- scores that a person has given

COLUMNS = ("student", "question", "score", "reason")
"""The columns of a table of scores that a person has given; the last may be missing."""


Scores: TypeAlias = dict[tuple[str, str], tuple[float, str, str]]
"""Scores with their reasons and the student as spelled, by the folded names of student and question."""


def overridden(judgements: Iterable[Judgement], scores: Scores, notes: list[str]) -> Iterator[Judgement]:
    """The judgements with the scores of a person; at the end, notes on students who are not there."""
    unknown = {student: name for (student, _), (_, _, name) in scores.items()}
    for judgement in judgements:
        student = folded(judgement.student)
        unknown.pop(student, None)
        marks = [scores.get((student, folded(question.id))) for question in judgement.questions]
        both = zip(judgement.questions, marks, strict=True)
        yield replace(judgement, questions=tuple(q.overridden(*mark[:2]) if mark else q for q, mark in both))
    notes += noted("nobody of this name has a row, and the override is left out", list(unknown.values()))


def read_overrides(path: str | os.PathLike[str], worth: Mapping[str, float]) -> Scores:
    """The overrides in a file, of questions that are `worth` points. Raises DocumentError."""
    source = os.fsencode(path).decode(errors="backslashreplace")
    head, rows = read_table(path)
    heads = list(map(folded, head))
    if missing := [name for name in COLUMNS[:3] if name not in heads]:
        message = f"the columns {', '.join(missing)} are missing, expected {','.join(COLUMNS)}"
        raise DocumentError([Problem(source, message, 1)])
    most = {folded(id): points for id, points in worth.items()}
    scores, problems = Scores(), list[Problem]()
    for line, row in enumerate(rows, 2):
        if not any(cell.strip() for cell in row):
            continue
        cells = dict(zip(heads, row, strict=False))
        student, question, score, reason = (cells.get(name, "").strip() for name in COLUMNS)
        whole, points = most.get(folded(question)), points_in(score)
        if whole is None:
            near = nearest(question, list(worth))
            guess = f" (did you mean {near}?)" if near else ""
            problems.append(Problem(source, f"there is no question {shown(question)}{guess}", line))
        elif points is None or not 0 <= points <= whole:
            expected = f"points from 0 to {whole:.12g}"
            problems.append(Problem(source, f"read {shown(score)}, expected {expected}", line, "score"))
        elif (folded(student), folded(question)) in scores:
            problems.append(Problem(source, f"{shown(student)} has this question twice", line))
        else:
            scores[folded(student), folded(question)] = points, reason, student
    if problems:
        raise DocumentError(problems)
    return scores
