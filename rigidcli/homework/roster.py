"""Who the students are: lists and gradebooks of instructors, whom a name means, and scores by a person."""

from __future__ import annotations

import csv
import io
import os
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TypeAlias

from rigidcli.errors import DocumentError, Problem, guess, printable, shown
from rigidcli.fields.texts import read_text
from rigidcli.homework.answers import folded
from rigidcli.homework.base import Judgement, Outcome
from rigidcli.homework.files import Owner, noted

NAMES = ("Student", "LastName", "FirstName")
"""The columns of a student's name, in one or in two."""

LOGINS = ("SIS Login ID", "SIS User ID", "OrgDefinedId", "ID", "Identifier")
"""The columns of what the school, the platform, and its lists call a student."""

SPELLINGS = {
    "Student": "student name fullname studentname displayname teilnehmer studierende vollstandigername "
    "vollername vorundnachname namevorname etudiant nomcomplet nometprenom nomprenom alumno estudiante "
    "nombrecompleto nombreyapellidos apellidosynombre nome nomecompleto",
    "LastName": "lastname surname familyname last nachname familienname zuname nom nomdefamille apellido "
    "apellidos cognome",
    "FirstName": "firstname givenname forename first vorname rufname prenom nombre nombres",
    "SIS Login ID": "sisloginid login loginid loginname username user netid uid mail email emailaddress "
    "githubusername githublogin github gitlab gitlabusername benutzername benutzer nutzername anmeldename "
    "kennung benutzerkennung emailadresse nomdutilisateur identifiant courriel adressedecourriel "
    "adresseemail adresseelectronique nombredeusuario usuario correo correoelectronico "
    "direcciondecorreo displayid",
    "SIS User ID": "sisuserid sid studentid studentnumber idnumber matrikelnummer matrikel "
    "matriculationnumber matriculation idnummer numeroetudiant numerodidentification numerodealumno",
    "OrgDefinedId": "orgdefinedid",
    "ID": "id",
    "Identifier": "identifier participant teilnehmerin participante",
}
"""The letters of these columns in other lists of students: English, German, French, Spanish, Italian."""

TEST_STUDENT = "Student, Test"
"""The student that Canvas adds to every course, who is nobody."""

FEW_ROWS = 6
"""Rows in which the head of a list is looked for: Sakai has the title of the assignment above it."""

FEWEST_DIGITS = 4
"""Digits of a number that means a student within a longer name: shorter ones count days and weeks."""

LONGEST_RUN = 8
"""Words of a login or of a name that may stand as one word."""

SILENT = frozenset(
    """hw homework answer answers assignment assignments solution solutions sheet exercise exercises problem
    set week task lab submission submissions final new copy late group blatt aufgabe abgabe hausaufgabe
    loesung losung ubung uebung devoir reponses tarea respuestas""".split()  # noqa: SIM905 - rows of words
)
"""Words in names of files that name nobody."""

_WORD = re.compile(r"[^\W_]+")
_NUMBERED = re.compile(r"(?:Participante?|Teilnehmer(?:/?in)?)\s*([0-9]+)", re.IGNORECASE)
"""What Moodle's grading worksheet calls a student: `Participant 5008`."""


Cells: TypeAlias = Sequence[tuple[str, str]]
"""What a list says of a student: names of columns, of which several may be alike, with what they hold."""


@dataclass(frozen=True, slots=True)
class Paper:
    """What a student has handed in: a file, or none; with an `outcome` if the program does not judge it."""

    student: str
    file: Path | None = None
    source: str = ""
    outcome: Outcome | None = None
    is_late: bool = False


# --- lists of students


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


def columns_of(head: Sequence[str]) -> list[str]:
    """What the columns of a list are by their names; empty for any other."""
    named = {spelling: column for column, all in SPELLINGS.items() for spelling in all.split()}
    columns = [named.get("".join(words_of(cell)), "") for cell in head]
    if columns.count("Student") > 1:  # `student,name`: the first is a login
        columns[columns.index("Student")] = "SIS Login ID"
    if any(cell.strip() in ("Student", "LastName") for cell in head):
        return columns
    # The `ID` of another list than that of Canvas is a number of the school.
    return ["SIS User ID" if column == "ID" else column for column in columns]


def read_roster(path: str | os.PathLike[str]) -> Roster:
    """The students of a table in a file, one a row, with columns of SPELLINGS. Raises DocumentError."""
    first, rest = read_table(path)
    rows = [first, *rest]
    heads = list(map(columns_of, rows[:FEW_ROWS]))
    above = next((number for number, columns in enumerate(heads) if any(columns)), None)
    if above is None:
        source = os.fsencode(path).decode(errors="backslashreplace")
        hint = "its first line names columns such as `name`, `login` and `id`"
        raise DocumentError([Problem(source, "read no list of students", 1, hint=hint)])
    return Roster(
        {
            number: [(column, cell) for column, cell in zip(heads[above], row, strict=False) if column]
            for number, row in enumerate(rest)
            if number >= above and row and "Points Possible" not in row[0]
        }
    )


class Roster:
    """The students of a list, or of a gradebook, by all that a name in a download may say of one."""

    def __init__(self, students: Mapping[int, Cells]) -> None:
        """The cells about each student, with the names of their columns, of which several may be alike."""
        self.labels: dict[int, str] = {}
        self.aliases: dict[str, list[str]] = {}
        self._names: dict[int, str] = {}
        self._meant: dict[str, set[int]] = defaultdict(set)
        self._logins: dict[tuple[str, ...], set[int]] = defaultdict(set)
        self._called: dict[str, set[tuple[frozenset[str], int]]] = defaultdict(set)
        self._glued: dict[str, set[int]] = defaultdict(set)
        self._own: dict[int, set[str]] = defaultdict(set)
        self._numbers: dict[str, dict[str, int]] = {"canvas": {}, "moodle": {}, "brightspace": {}}
        for key, raw in students.items():
            cells = [(column, cell) for column, text in raw if (cell := printable(text.strip()).lstrip("#"))]
            name = _full_name(dict(reversed(cells)))
            if name == TEST_STUDENT or not cells:
                continue
            self._names[key] = name
            logins = list(dict.fromkeys(cell for kind in LOGINS for column, cell in cells if column == kind))
            self.labels[key] = next(iter(logins), name)
            for column, cell in cells:
                if numbered := _NUMBERED.fullmatch(cell):
                    self._numbers["moodle"][numbered[1]] = key
                elif column in ("ID", "OrgDefinedId"):
                    self._numbers["canvas" if column == "ID" else "brightspace"][cell] = key
            for login in logins:
                for spelled in {login, login.partition("@")[0]}:
                    self._meant[spelled.casefold()].add(key)
                    self._logins[tuple(words_of(spelled))].add(key)
                    self._own[key] |= {*words_of(spelled)}
            for words in _spellings(name):
                self._own[key] |= {*words}
                self._meant[" ".join(sorted(words))].add(key)
                self._called[max(words, key=len)].add((frozenset(words), key))
                for turn in range(len(words)):
                    self._glued["".join([*words[turn:], *words[:turn]])].add(key)
        alike = Counter(self._names.values())
        self.labels |= {key: name for key, name in self._names.items() if name and alike[name] == 1}
        often = Counter(map(folded, self.labels.values()))
        for key, label in self.labels.items():
            if often[folded(label)] > 1:
                self.labels[key] = f"{label} (row {key + 2})"
        for key, label in self.labels.items():
            logins = [text.strip().lstrip("#") for column, text in students[key] if column in LOGINS]
            self.aliases[label] = [*filter(None, logins), self._names[key]]

    @property
    def students(self) -> dict[str, str]:
        """The name of each student in the list, by the label that results have."""
        return {label: self._names[key] or label for key, label in self.labels.items()}

    def find(self, owner: Owner | str, common: Collection[str] = ()) -> set[int]:
        """The students whom a name may mean.

        A name, login or number is found whole, else as words within. Of words within other words that mean
        somebody, only the longer ones count. A single word that is `common` to all names beside this one
        tells nobody apart. The number that a platform adds counts only if it is of the list's own kind.
        """
        if isinstance(owner, str):
            owner = Owner(owner, owner)
        text = owner.name
        words = words_of(text)
        glued = "".join(words)
        keys = self._meant.get(text.casefold()) or self._meant.get(" ".join(sorted(words))) or set()
        keys = keys or self._within(words, common)
        numbered = self._numbers.get(owner.platform, {}).get(owner.number)
        # A number may be another's by chance: then the names have nothing in common.
        if numbered is None or (keys and numbered not in keys and len(keys) == 1):
            return keys
        shares = any(word in glued for word in words_of(self._names[numbered]))
        if owner.platform != "moodle" and not shares:
            return keys
        return {numbered} & keys or {numbered} | keys

    def _within(self, words: Sequence[str], common: Collection[str]) -> set[int]:
        """The students whose names, logins or numbers stand among words."""
        found: dict[frozenset[str], set[int]] = defaultdict(set)
        numbers = set[int]()
        for begin, end in product(range(len(words)), range(1, LONGEST_RUN + 1)):
            run = tuple(words[begin : begin + end])
            if len(run) == 1 and run[0].isdecimal():
                if run[0] not in common and (len(run[0]) >= FEWEST_DIGITS or {*words} - {*common} == {*run}):
                    numbers |= self._logins.get(run, set())
            elif keys := self._logins.get(run, set()) | self._glued.get("".join(run), set()):
                found[frozenset(run)] |= keys
        for word in words:
            for used, key in self._called.get(word, ()):
                if used <= {*words}:
                    found[used].add(key)
        letters = {word for word in words if word.isalpha()} - {*common, *SILENT}
        for used in [each for each in found if len(each) == 1]:
            (word,) = used
            # It may be the first name of somebody else: all other words must be silent, or the student's.
            own = {other for key in found[used] for other in self._own[key]}
            if word in common or (word.isalpha() and letters - own - used):
                del found[used]
        numbers = {key for key in numbers if found or not letters - self._own[key]}
        longest = [keys for used, keys in found.items() if not any(used < other for other in found)]
        named = set.intersection(*longest) or set.union(*longest) if longest else set[int]()
        return named if len(named) == 1 else named & numbers or named or numbers

    def first(self, names: Sequence[str]) -> set[int]:
        """The students whom the first of several names means that means one student, or else any."""
        means = [self.find(name) for name in names]
        return next((keys for keys in means if len(keys) == 1), max(means, key=len))

    def one(self, name: str) -> str:
        """The label of the one student whom a name means, or the name as it is."""
        keys = self.find(name)
        return self.labels[min(keys)] if len(keys) == 1 else name

    def match(self, students: Sequence[Sequence[str]]) -> tuple[dict[int, int], list[str]]:
        """The place among `students` of each row of a gradebook, and notes on those without one.

        A student is called by a label, and by other names; the first of them that means one student counts.
        """
        places: dict[int, list[int]] = defaultdict(list)
        unknown, doubtful = list[str](), list[str]()
        for place, (label, *names) in enumerate(students):
            keys = self.first([label, *names])
            if len(keys) == 1:
                places[min(keys)].append(place)
            else:
                (doubtful if keys else unknown).append(label)
        several = [students[place][0] for rows in places.values() if len(rows) > 1 for place in rows]
        absent = [name for key, name in self._names.items() if key not in places]
        notes = noted("not found in the gradebook", unknown)
        notes += noted("more than one student of the gradebook may be meant by", doubtful)
        notes += noted("several hand-ins of one student, and none of them taken", several)
        notes += noted("no answer file, and the cell left as it was", absent)
        return {key: own[0] for key, own in places.items() if len(own) == 1}, notes


def _full_name(cells: Mapping[str, str]) -> str:
    """The name of a student, whose last name a list may call the name; or else the identifier."""
    last, first = cells.get("LastName", ""), cells.get("FirstName", "")
    name = cells.get("Student", "")
    if name and not last and not {*words_of(first)} <= {*words_of(name)}:
        last, name = name, ""
    identifier = "" if re.search("[0-9@]", cells.get("Identifier", "")) else cells.get("Identifier", "")
    return name or ", ".join(filter(None, [last, first])) or identifier


_PLAIN = str.maketrans(dict(zip("øåæœłđðþı", ["o", "a", "ae", "oe", "l", "d", "d", "th", "i"], strict=True)))
"""Letters that Unicode does not take apart into a letter and an accent."""

_TRANSCRIBED = _PLAIN | str.maketrans(dict(zip("äöüøå", ["ae", "oe", "ue", "oe", "aa"], strict=True)))
"""Letters as people write them who have no such keys; an accent is left away otherwise."""

_APOSTROPHES = re.compile("['’ʼ`´‘]")


def words_of(name: str) -> list[str]:
    """The words of a name in small letters without accents, and numbers without leading zeros."""
    plain = unicodedata.normalize("NFKD", _APOSTROPHES.sub("", name)).casefold().translate(_PLAIN)
    words = _WORD.findall("".join(char for char in plain if not unicodedata.combining(char)))
    return [word.lstrip("0") or "0" if word.isdecimal() else word for word in words]


def _spellings(name: str) -> set[tuple[str, ...]]:
    """The ways to write a name: with transcribed umlauts, each part as one word, and all in one."""
    transcribed = unicodedata.normalize("NFC", name).casefold().translate(_TRANSCRIBED)
    found = set[tuple[str, ...]]()
    for text in (name, transcribed, _APOSTROPHES.sub(" ", name)):
        words, parts = words_of(text), ["".join(words_of(part)) for part in text.split(",")]
        found |= {tuple(words), tuple(filter(None, parts))}
    return found - {()}


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


def read_overrides(
    path: str | os.PathLike[str], worth: Mapping[str, float], roster: Roster | None = None
) -> Scores:
    """The overrides in a file, of questions that are `worth` points; a roster knows all names of a student.

    Raises DocumentError.
    """
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
        student = student if roster is None else roster.one(student)
        whole, points = most.get(folded(question)), points_in(score)
        if whole is None:
            message = f"there is no question {shown(question)}{guess(question, worth)}"
            problems.append(Problem(source, message, line))
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
