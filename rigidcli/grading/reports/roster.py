"""Who is who: the names of answer files, and the students of a gradebook."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Mapping, Sequence

from rigidcli.errors import printable, shown

NAMES = ("Student", "LastName", "FirstName")
"""The columns of a student's name, in one or in two."""

LOGINS = ("SIS Login ID", "SIS User ID", "ID")
"""The columns of what the school, and Canvas, call a student."""

TEST_STUDENT = "Student, Test"

MOST_NAMED = 20
"""Names that a message tells."""

# As Canvas names files in a download of submissions: doejane_LATE_4711_98765_homework.yaml
_SUBMISSION = re.compile(r"[^_]+(?:_LATE)?_([0-9]+)_[0-9]+_.+")
_WORD = re.compile(r"[^\W_]+")


def listed(names: Sequence[str]) -> str:
    """Names in a message, each short and harmless."""
    told = ", ".join(shown(printable(name)) for name in names[:MOST_NAMED])
    return told if len(names) <= MOST_NAMED else f"{told} and {len(names) - MOST_NAMED} more"


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []


class Roster:
    """The students of a gradebook by all that the name of an answer file may say of one."""

    def __init__(self, students: Mapping[int, Mapping[str, str]]) -> None:
        """The cells about each student by the names of their columns."""
        self._names: dict[int, str] = {}
        self._words: dict[str, set[int]] = defaultdict(set)
        self._numbers: dict[str, set[int]] = defaultdict(set)
        self._users: dict[str, set[int]] = defaultdict(set)
        self._spellings: dict[str, set[int]] = defaultdict(set)
        for key, raw in students.items():
            cells = {column: printable(cell.strip()) for column, cell in raw.items()}
            name = cells.get("Student") or ", ".join(filter(None, map(cells.get, NAMES[1:])))
            self._names[key] = name
            for login in filter(None, (cells.get(column, "").casefold() for column in LOGINS)):
                self._words[login].add(key)
                self._users[login.partition("@")[0]].add(key)
            self._numbers[cells.get("ID", "")].add(key)
            for spelling in _spellings(name):
                self._spellings[spelling].add(key)

    def match(self, stems: Sequence[str]) -> tuple[dict[int, int], list[str]]:
        """The place among `stems` of each student's answer file.

        Notes tell of files that belong to nobody, or to nobody alone, and of students without any.
        """
        files: dict[int, list[int]] = defaultdict(list)
        absent, doubtful = list[str](), list[str]()
        for place, stem in enumerate(stems):
            keys = self._find(stem)
            if len(keys) == 1:
                files[min(keys)].append(place)
            else:
                (doubtful if keys else absent).append(stem)
        several = [stems[place] for places in files.values() if len(places) > 1 for place in places]
        without = [name for key, name in self._names.items() if key not in files and name != TEST_STUDENT]
        notes = [
            *noted("not found in the gradebook", absent),
            *noted("more than one student of the gradebook may be meant by", doubtful),
            *noted("several answer files of one student, and none of them taken", several),
            *noted("no answer file, and the cell left as it was", without),
        ]
        return {key: places[0] for key, places in files.items() if len(places) == 1}, notes

    def _find(self, stem: str) -> set[int]:
        """The students whose answer file it may be, by the first way that leads to any."""
        download = _SUBMISSION.fullmatch(stem)
        ways = [
            (self._words, stem.casefold()),
            (self._numbers, download[1] if download else ""),
            (self._users, stem.casefold()),
            (self._spellings, " ".join(sorted(_words(stem)))),
        ]
        return next((known[key] for known, key in ways if key and key in known), set())


def _words(name: str) -> list[str]:
    """The words of a name in small letters without accents."""
    plain = unicodedata.normalize("NFKD", re.sub("['’]", "", name)).casefold()
    return _WORD.findall("".join(char for char in plain if not unicodedata.combining(char)))


def _spellings(name: str) -> set[str]:
    """A name as its words in any order, and written as one word with either name first."""
    last, _, first = name.partition(",")
    both = ["".join(_words(part)) for part in (last, first)]
    return {" ".join(sorted(_words(name))), "".join(both), "".join(reversed(both))}
