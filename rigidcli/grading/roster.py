"""Who is who: whose an answer file is, by its name, its folder's, or a list of the students."""

from __future__ import annotations

import csv
import io
import os
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigidcli.errors import DocumentError, Problem, printable, shown
from rigidcli.fields.texts import read_text
from rigidcli.grading.outcome import MISSING, Outcome, Unreadable

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

MOST_NAMED = 20
"""Names that a message tells."""

# What Moodle puts before a file's name, or makes its folder's: Jane Doe_4711_assignsubmission_file_
_MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>[0-9]+)_assignsubmission_(?:file|onlinetext)(?:_(?P<own>.*))?")
# And Canvas, with a number for each file: doejane_LATE_4711_98765_homework.yaml
_CANVAS = re.compile(r"(?P<name>[^_]+)(?:_LATE)?_(?P<id>[0-9]+)_(?P<number>[0-9]+)_(?P<own>.+)")
_STUDENT = re.compile(r"(?P<name>.+)_(?P<id>[0-9]+)")
_WORD = re.compile(r"[^\W_]+")


def listed(names: Sequence[str]) -> str:
    """Names in a message, each short and harmless."""
    told = ", ".join(shown(printable(name)) for name in names[:MOST_NAMED])
    return told if len(names) <= MOST_NAMED else f"{told} and {len(names) - MOST_NAMED} more"


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []


# --- names of files


def submitted(name: str, forms: Sequence[re.Pattern[str]] = (_CANVAS, _MOODLE)) -> tuple[str, str]:
    """The student, and the student's own name of a file, where Canvas or Moodle has joined the two.

    The student is empty in any other name. The first that is read counts: a student may put another one
    into the rest.
    """
    found = next(filter(None, (form.fullmatch(name) for form in forms)), None)
    return (f"{found['name']}_{found['id']}", found["own"] or "") if found else ("", name)


def students_of(files: Sequence[Path]) -> list[str]:
    """The student of each answer file.

    Where files share a name, it is told from the folder, below all of them, that is a student's; elsewhere
    from what Canvas or Moodle has put into a name, or from the name of the file. What is above comes first:
    a student chooses the names within the own folder only.
    """
    places = [Path(os.path.normpath(file.absolute())) for file in files]
    depth = len(Path(os.path.commonpath([place.parent for place in places])).parts) if places else 0
    ways = [(*place.parts[depth:-1], place.stem) for place in places]
    level = _level(ways)
    numbers = Counter(found["number"] for place in places if (found := _CANVAS.fullmatch(place.stem)))
    students = []
    for place, way in zip(places, ways, strict=True):
        if 0 < level < len(way):
            students.append(submitted(way[level - 1], (_MOODLE,))[0] or way[level - 1])
            continue
        above = (submitted(folder, (_MOODLE,))[0] for folder in place.parts[:-1])
        folders = list(filter(None, above))
        canvas = _CANVAS.fullmatch(place.stem)
        # Numbers of files differ, while `hw_10_3_ada` and `hw_10_3_bob` are no names by Canvas.
        joined = "" if canvas and numbers[canvas["number"]] > 1 else submitted(place.stem)[0]
        students.append(folders[0] if folders else joined or place.stem)
    return students


def _level(ways: Sequence[tuple[str, ...]]) -> int:
    """The level of the folders that are students': the first on which half of them hold one answer file.

    It is 0, that of no folder, where no two files in folders share a name.
    """
    within = [way for way in ways if len(way) > 1]
    if len({way[-1].casefold() for way in within}) == len(within):
        return 0
    for level in range(1, max(map(len, within))):
        held = Counter(way[:level] for way in within if len(way) > level)
        if 2 * sum(count == 1 for count in held.values()) >= len(held):
            return level
    return 0


# --- papers


@dataclass(frozen=True, slots=True)
class Paper:
    """What a student has handed in: a file, or none; with an `outcome` if that is not judged at all."""

    student: str
    file: Path | None = None
    outcome: Outcome | None = None


def papers(files: Sequence[Path], roster: Roster | None = None) -> tuple[list[Paper], list[str]]:
    """Every file with its student, and every student of the roster without one; and notes on who is who."""
    names, notes = students_of(files), list[str]()
    absent: Sequence[str] = ()
    if roster is not None:
        names, absent, notes = roster.named(names)
    counts = Counter(map(_folded, names))
    found = []
    for name, file in zip(names, files, strict=True):
        several = counts[_folded(name)]
        twice = Unreadable("duplicate_key", f"{several} files are this student's").outcome
        found.append(Paper(name, file, twice if several > 1 else None))
    double = sorted({paper.student for paper in found if paper.outcome})
    notes += noted("more than one answer file, and none of them judged", double)
    return [*found, *(Paper(name, None, MISSING) for name in absent)], notes


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


# --- lists of students


def read_roster(path: str | os.PathLike[str]) -> Roster:
    """The students of a table in a file, one a row, with columns of SPELLINGS. Raises DocumentError."""
    source = os.fsencode(path).decode(errors="backslashreplace")
    text = read_text(os.fspath(path), source)
    mark = max(",;\t", key=text.partition("\n")[0].count)
    try:
        header, *rows = csv.reader(io.StringIO(text, newline=""), delimiter=mark)
    except (ValueError, csv.Error):
        header, rows = [], []
    known = {spelling: column for column, spellings in SPELLINGS.items() for spelling in spellings}
    columns = [known.get("".join(_words(name)), "") for name in header]
    if not any(columns):
        hint = "its first line names columns such as `name`, `login` and `id`"
        raise DocumentError([Problem(source, "read no list of students", 1, hint=hint)])
    students = {
        number: {column: cell for column, cell in zip(columns, row, strict=False) if column}
        for number, row in enumerate(rows)
        if row and "Points Possible" not in row[0]
    }
    return Roster(
        {number: cells for number, cells in students.items() if any(map(str.strip, cells.values()))}
    )


class Roster:
    """The students of a gradebook by all that the name of an answer file may say of one."""

    def __init__(self, students: Mapping[int, Mapping[str, str]]) -> None:
        """The cells about each student by the names of their columns."""
        self._names: dict[int, str] = {}
        self._labels: dict[int, str] = {}
        self._words: dict[str, set[int]] = defaultdict(set)
        self._numbers: dict[str, set[int]] = defaultdict(set)
        self._users: dict[str, set[int]] = defaultdict(set)
        self._spellings: dict[str, set[int]] = defaultdict(set)
        for key, raw in students.items():
            cells = {column: printable(cell.strip()) for column, cell in raw.items()}
            name = cells.get("Student") or ", ".join(filter(None, map(cells.get, NAMES[1:])))
            self._names[key] = name
            logins = [cells[column] for column in LOGINS if cells.get(column)]
            self._labels[key] = next(iter(logins), name)
            for login in map(str.casefold, logins):
                self._words[login].add(key)
                self._users[login.partition("@")[0]].add(key)
            self._numbers[cells.get("ID", "")].add(key)
            for spelling in _spellings(name):
                self._spellings[spelling].add(key)
        alike = Counter(self._names.values())
        self._labels |= {key: name for key, name in self._names.items() if name and alike[name] == 1}

    def match(self, stems: Sequence[str]) -> tuple[dict[int, int], list[str]]:
        """The place among `stems` of each student's answer file.

        Notes tell of files that belong to nobody, or to nobody alone, and of students without any.
        """
        files, notes = self._files(stems, "gradebook")
        several = [stems[place] for places in files.values() if len(places) > 1 for place in places]
        without = [name for key, name in self._names.items() if key not in files and name != TEST_STUDENT]
        notes += noted("several answer files of one student, and none of them taken", several)
        notes += noted("no answer file, and the cell left as it was", without)
        return {key: places[0] for key, places in files.items() if len(places) == 1}, notes

    def named(self, stems: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
        """The students of answer files as the list has them, its students without any, and notes."""
        files, notes = self._files(stems, "roster")
        owners = {place: self._labels[key] for key, places in files.items() for place in places}
        absent = [
            label
            for key, label in self._labels.items()
            if key not in files and self._names[key] != TEST_STUDENT
        ]
        return [owners.get(place, stem) for place, stem in enumerate(stems)], absent, notes

    def _files(self, stems: Sequence[str], source: str) -> tuple[dict[int, list[int]], list[str]]:
        """The places among `stems` of every student's files, and notes on those of nobody or nobody alone."""
        files: dict[int, list[int]] = defaultdict(list)
        absent, doubtful = list[str](), list[str]()
        for place, stem in enumerate(stems):
            keys = self._find(stem)
            if len(keys) == 1:
                files[min(keys)].append(place)
            else:
                (doubtful if keys else absent).append(stem)
        doubt = f"more than one student of the {source} may be meant by"
        return files, [*noted(f"not found in the {source}", absent), *noted(doubt, doubtful)]

    def _find(self, stem: str) -> set[int]:
        """The students whose answer file it may be, by the first way that leads to any."""
        ways = [
            (self._words, stem.casefold()),
            (self._users, stem.casefold()),
            (self._spellings, " ".join(sorted(_words(stem)))),
        ]
        direct = next((known[key] for known, key in ways if key and key in known), None)
        if direct is not None:
            return direct
        found = _STUDENT.fullmatch(submitted(stem)[0] or stem)
        if found is None:
            return set()
        numbered = self._numbers.get(found["id"], set())
        called = self._spellings.get(" ".join(sorted(_words(found["name"]))), set())
        if not called and not submitted(stem)[0]:
            return set()  # any name may end in a number
        # The number may be another's, of Moodle: a name that does not fit it leaves the student in doubt.
        return numbered & called or numbered | called


def _words(name: str) -> list[str]:
    """The words of a name in small letters without accents."""
    plain = unicodedata.normalize("NFKD", re.sub("['’]", "", name)).casefold()
    return _WORD.findall("".join(char for char in plain if not unicodedata.combining(char)))


def _spellings(name: str) -> set[str]:
    """A name as its words in any order, and written as one word with either name first."""
    last, _, first = name.partition(",")
    both = ["".join(_words(part)) for part in (last, first)]
    return {" ".join(sorted(_words(name))), "".join(both), "".join(reversed(both))}
