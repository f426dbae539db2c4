"""The students in the list of an instructor, and which of them a name means."""

from __future__ import annotations

import os
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.homework.answers import folded
from rigidcli.homework.owner import Owner, noted, spellings, words_of
from rigidcli.homework.spreadsheets import Spreadsheet, read_spreadsheet

# The columns of a student's name, in one or in two, and those of logins and numbers.
NAMES = ("Student", "LastName", "FirstName")
LOGINS = ("SIS Login ID", "SIS User ID", "OrgDefinedId", "ID", "Identifier")
_LINES = Path(__file__).with_name("heads.csv").read_text("utf-8").splitlines()[1:]
# The letters of the heads of these columns and of those of Moodle's worksheet, and two sets of words.
SPELLINGS = {column: all.split() for column, all in (line.split(",", 1) for line in _LINES)}
ROW_OF_POINTS = "Points Possible"  # begins the row in which Canvas has the points that assignments are worth
TEST_STUDENT = "Student, Test"  # the student that Canvas adds to every course, who is nobody
# Rows in which the head of a list is looked for: Sakai has the title of the assignment above it.
HEAD_ROWS = 6
# The fewest digits of a student's number within a longer name: shorter ones count days and weeks.
FEWEST_DIGITS = 4
LONGEST_RUN = 8  # the most words of a login, or of a name, that are tried as one word
SILENT = frozenset(SPELLINGS["in names of files"])  # words in names of files that name nobody
# What Moodle's grading worksheet calls a student: `Participant 5008`.
_NUMBERED = re.compile(r"(?:Participante?|Teilnehmer(?:/?in)?)\s*([0-9]+)", re.IGNORECASE)


def columns_of(head: Sequence[str]) -> list[str]:
    """What the columns of a list are by their names; empty for any other."""
    named = {spelling: column for column in (*NAMES, *LOGINS) for spelling in SPELLINGS[column]}
    columns = [named.get("".join(words_of(cell)), "") for cell in head]
    if columns.count("Student") > 1:  # `student,name`: the first is a login
        columns[columns.index("Student")] = "SIS Login ID"
    # The `ID` of another list than that of Canvas is a number of the school.
    is_canvas = any(cell.strip() in ("Student", "LastName") for cell in head)
    return ["SIS User ID" if column == "ID" and not is_canvas else column for column in columns]


def read_roster(path: str | os.PathLike[str]) -> Roster:
    """The students of a table in a file, one a row, with columns of SPELLINGS. Raises DocumentError."""
    table = read_spreadsheet(path)
    heads = dict(enumerate(map(columns_of, table.rows[:HEAD_ROWS])))
    head = next((number for number, columns in heads.items() if any(columns)), None)
    if head is None:
        hint = "its first line names columns such as `name`, `login` and `id`"
        raise DocumentError([Problem(table.source, "read no list of students", 1, hint=hint)])
    return Roster(heads[head], table, head)


class Person(NamedTuple):
    """A student by the cells of a list: the name, and the logins and numbers in the order of LOGINS."""

    name: str
    logins: tuple[str, ...]
    cells: tuple[tuple[str, str], ...]


class Roster:
    """The students of a list, or of a gradebook, by the names, logins and numbers that downloads may have.

    Students have the numbers of their `rows`, from 0, as their keys; `columns` tells what each column means,
    and `head` what the list calls it. `labels` are the students' names in reports, and `aliases`, by labels,
    are all names of each. Notes call the list by its `kind`.
    """

    def __init__(
        self, columns: Sequence[str], table: Spreadsheet, head: int = 0, kind: str = "roster"
    ) -> None:
        self.head, self._kind = table.rows[head], kind
        self.rows = {
            number: row if len(columns) > 1 else [table.separator.join(row)]  # `Doe, Jane` is one cell then
            for number, row in enumerate(table.rows)
            if number > head and row and ROW_OF_POINTS not in row[0]
        }
        self.labels: dict[int, str] = {}
        self.aliases: dict[str, list[str]] = {}
        self._people: dict[int, Person] = {}
        self._called: dict[str, set[tuple[frozenset[str], int]]] = defaultdict(set)
        self._glued: dict[str, set[int]] = defaultdict(set)
        self._own: dict[int, set[str]] = defaultdict(set)
        self._numbers: dict[tuple[str, str], int] = {}
        seen = set[Person]()
        for key, row in self.rows.items():
            person = _person_of([entry for entry in zip(columns, row, strict=False) if entry[0]])
            # A student of two sections may have two rows; without a login they may be two students.
            if person is not None and not (person.logins and person in seen):
                seen.add(person)
                self._people[key] = person
                self._learn(key, person)
        self._label()

    def _learn(self, key: int, person: Person) -> None:
        for column, cell in person.cells:
            if numbered := _NUMBERED.fullmatch(cell):
                self._numbers["moodle", numbered[1]] = key
            elif column in ("ID", "OrgDefinedId"):
                self._numbers["canvas" if column == "ID" else "brightspace", cell] = key
        names = spellings(person.name)
        logins = [words_of(each) for login in person.logins for each in (login, login.partition("@")[0])]
        for words in filter(None, [*names, *logins]):
            self._called[max(words, key=len)].add((frozenset(words), key))
            self._own[key] |= {*words}
        for words in names:
            for turn in range(len(words)):
                self._glued["".join([*words[turn:], *words[:turn]])].add(key)

    def _label(self) -> None:
        """Give each student a label of its own: the name, else a login, else with the row."""
        alike = Counter(person.name for person in self._people.values())
        for key, (name, logins, _) in self._people.items():
            self.labels[key] = name if name and alike[name] == 1 else next(iter(logins), name)
        often = Counter(map(folded, self.labels.values()))
        for key, label in self.labels.items():
            self.labels[key] = f"{label} (row {key + 1})" if often[folded(label)] > 1 else label
            self.aliases[self.labels[key]] = [*self._people[key].logins, self._people[key].name]

    @property
    def students(self) -> dict[str, str]:
        """The name of each student in the list, by the label that results have."""
        return {label: self._people[key].name or label for key, label in self.labels.items()}

    def find(self, owner: Owner | str, common: Collection[str] = ()) -> set[int]:
        """The students whom a name may mean.

        A name, login or number is found as words within. Of words within other words that mean somebody, only
        the longer ones count. A single word that is `common` to all names beside this one tells nobody apart.
        The number that a platform adds counts only if it is of the list's own kind.
        """
        owner = Owner(owner, owner) if isinstance(owner, str) else owner
        keys = self._within(owner.words, common)
        numbered = self._numbers.get((owner.platform, owner.number))
        if numbered is None or (len(keys) == 1 and numbered not in keys):
            return keys
        # A number may be another's by chance: then the names have nothing in common.
        shares = any(word in "".join(owner.words) for word in words_of(self._people[numbered].name))
        if owner.platform != "moodle" and not shares:
            return keys
        return {numbered} & keys or {numbered} | keys

    def _within(self, words: Sequence[str], common: Collection[str]) -> set[int]:
        """The students whose names, logins or numbers stand among the words of a longer name."""
        found: dict[frozenset[str], set[int]] = defaultdict(set)
        for word in words:
            for called, key in self._called.get(word, ()):
                if called <= {*words}:
                    found[called].add(key)
        for begin, end in product(range(len(words)), range(1, LONGEST_RUN + 1)):
            run = words[begin : begin + end]
            if keys := self._glued.get("".join(run)):
                found[frozenset(run)] |= keys
        numbers = set[int]()
        letters = {word for word in words if word.isalpha()} - {*common, *SILENT}
        for used in [each for each in found if len(each) == 1]:
            (word,) = used
            if word.isdecimal():
                keys, others = found.pop(used), {*words} - {*common}
                numbers |= keys if others == used or (word in others and _is_number(word)) else set()
                continue
            # It may be the first name of somebody else: all other words must be silent, or the student's.
            own = {other for key in found[used] for other in self._own[key]}
            if used != {*words} and (word in common or (word.isalpha() and letters - own - used)):
                del found[used]
        numbers = {key for key in numbers if found or not letters - self._own[key]}
        longest = [keys for used, keys in found.items() if not any(used < other for other in found)]
        named = set.intersection(*longest) or set.union(*longest) if longest else set[int]()
        return named if len(named) == 1 else named & numbers or named or numbers

    def find_all(self, owners: Mapping[str, Owner]) -> dict[str, set[int]]:
        """The students whom each of some names that stand beside each other may mean.

        Words that all of them have tell nobody apart, unless they are the names of one student's files.
        """
        words = [{*owner.words} for owner in owners.values()]
        common = set.intersection(*words) if len(words) > 1 else set[str]()
        keys = [self.find(owner, common) for owner in owners.values()]
        if len({min(each) for each in keys if len(each) == 1}) < 2:
            common = set()
        common |= self._strange_numbers([*owners.values()], common)
        return {name: self.find(owner, common) for name, owner in owners.items()}

    def _strange_numbers(self, owners: Sequence[Owner], common: Collection[str]) -> set[str]:
        """The numbers in names that stand beside each other, where they are not those of the list.

        Platforms have numbers of their own, which may be those of other students by chance. They are not the
        list's where those who are known by their names mostly have other ones.
        """
        numbers = {word for owner in owners for word in owner.words if _is_number(word)}
        agree = 0
        for owner in owners:
            keys = self.find(owner, {*common, *numbers}) or self.find(owner, common)
            own = {number for key in keys for number in self._own[key] if _is_number(number)}
            if len(keys) == 1 and own and (in_name := numbers & {*owner.words}):
                agree += 1 if own & in_name else -1
        return numbers if agree < 0 else set()

    def first(self, names: Sequence[str]) -> set[int]:
        """The students meant by the first of several names that means exactly one, else by any of them."""
        means = [self.find(name) for name in names]
        return next((keys for keys in means if len(keys) == 1), max(means, key=len))

    def called(self, name: str) -> list[str]:
        """The labels of the students whom a name may mean."""
        return [self.labels[key] for key in sorted(self.find(name))]

    def notes(self, unknown: Sequence[str], doubtful: Sequence[str]) -> list[str]:
        """Notes on names that mean nobody in the list, and on those that may mean several."""
        said = noted(f"not found in the {self._kind}", unknown)
        return said + noted(f"more than one student of the {self._kind} may be meant by", doubtful)

    def match(self, students: Sequence[Sequence[str]]) -> tuple[dict[int, int], list[str]]:
        """The place among `students` of each row of a gradebook, and notes on those without one.

        A student is called by a label, and by other names; the first of them that means one student counts.
        """
        places: dict[int, list[int]] = defaultdict(list)
        unknown, doubtful = list[str](), list[str]()
        for place, names in enumerate(students):
            keys = self.first(names)
            if len(keys) == 1:
                places[min(keys)].append(place)
            else:
                (doubtful if keys else unknown).append(names[0])
        several = [students[place][0] for rows in places.values() if len(rows) > 1 for place in rows]
        absent = [person.name for key, person in self._people.items() if key not in places]
        notes = self.notes(unknown, doubtful)
        notes += noted("several hand-ins of one student, and none of them taken", several)
        notes += noted("no answer file, and the cell left as it was", absent)
        return {key: own[0] for key, own in places.items() if len(own) == 1}, notes


def _is_number(word: str) -> bool:
    return word.isdecimal() and len(word) >= FEWEST_DIGITS


def _person_of(entries: Sequence[tuple[str, str]]) -> Person | None:
    """The student of some cells; None for Canvas' test student, and where all are empty."""
    cells = tuple((column, cell) for column, text in entries if (cell := printable(text.strip()).lstrip("#")))
    logins = dict.fromkeys(cell for kind in LOGINS for column, cell in cells if column == kind)
    first_of = dict(reversed(cells))
    name, last, first, identifier = (first_of.get(key, "") for key in (*NAMES, "Identifier"))
    # Some lists call the last name `Name`, others have an identifier only.
    if name and not last and not {*words_of(first)} <= {*words_of(name)}:
        last, name = name, ""
    named = "" if re.search("[0-9@]", identifier) else identifier
    name = name or ", ".join(filter(None, [last, first])) or named
    return Person(name, tuple(logins), cells) if cells and name != TEST_STUDENT else None
