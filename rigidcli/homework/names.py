"""Names of students, folders and files: their words, and what platforms put before them."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import PurePath

from rigidcli.errors import printable, shown

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

TEXTS = frozenset([*SUFFIXES, "", ".txt", ".text", ".md", ".markdown"])
"""Ends of the names of files that may be answers, too, if they answer a question."""

ARCHIVE = ".zip"


def is_answer(name: str) -> bool:
    """Whether a file has the name of an answer file."""
    return PurePath(name).suffix.lower() in SUFFIXES


def may_answer(name: str) -> bool:
    """Whether a file may be an answer file, by its name."""
    return PurePath(name).suffix.lower() in TEXTS


def listed(names: Sequence[str]) -> str:
    """Names in a message, short and safe to print."""
    first, more = ", ".join(shown(printable(name)) for name in names[:20]), len(names) - 20
    return f"{first} and {more} more" if more > 0 else first


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students or files; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []


# --- words

_WORD = re.compile(r"[^\W_]+")

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


def spellings(name: str) -> set[tuple[str, ...]]:
    """The ways to write a name: with transcribed umlauts, each part as one word, and all in one."""
    transcribed = unicodedata.normalize("NFC", name).casefold().translate(_TRANSCRIBED)
    found = set[tuple[str, ...]]()
    for text in (name, transcribed, _APOSTROPHES.sub(" ", name)):
        words, parts = words_of(text), ["".join(words_of(part)) for part in text.split(",")]
        found |= {tuple(words), tuple(filter(None, parts))}
    return found - {()}


# --- what platforms put before names

_DATE = r"[A-Z][a-z]{2} [0-9]{1,2}, [0-9]{4} [0-9]{3,4} [AP]M"

FORMS = {
    # Moodle: Jane Doe_4711_assignsubmission_file_, a folder, or joined with the name of a file.
    "moodle": re.compile(
        r"(?P<name>.+?)_(?P<id>[0-9]+)_assignsubmission_(?:file|onlinetext)(?:_(?P<own>.*))?"
    ),
    # Blackboard: Week 3_jdoe_attempt_2026-11-20-13-05-22_homework.yaml, and .txt about the attempt.
    "blackboard": re.compile(
        r"(?P<name>(?:.+?_)?(?P<login>[^_]+))_attempt_(?P<when>[0-9-]{10,19})(?:_(?P<own>.+)|\.txt|)"
    ),
    # Brightspace: 300001-701 - Jane Doe - Nov 20, 2026 201 PM, a folder, or joined with the name of a file.
    "brightspace": re.compile(
        rf"(?P<id>[0-9]+)-[0-9]+ - (?P<name>.+?) - (?P<when>{_DATE})(?: - (?P<own>.+)|)"
    ),
    # Sakai: Doe, Jane(jdoe), a folder.
    "sakai": re.compile(r"(?P<name>[^()]+, [^()]+\([^()]+\))"),
    # Canvas, with a number for each file: doejane_LATE_4711_98765_homework.yaml
    "canvas": re.compile(r"(?P<name>[^_]+)(?P<late>_LATE)?_(?P<id>[0-9]+)_(?P<when>[0-9]+)_(?P<own>.+\..+)"),
}
"""How platforms name a hand-in: a name or login, a number, and the student's own name of the file."""


@dataclass(frozen=True, slots=True)
class Owner:
    """The student whom the name of a folder or a file means.

    `label` names the student in reports. A `platform` writes a `name` and a `number` of the student before
    `own`, the name that the student gave the file. Of copies the last one counts, by `when`.
    """

    label: str
    name: str
    number: str = ""
    platform: str = ""
    own: str = ""
    when: str = ""
    is_late: bool = False

    @property
    def turn(self) -> tuple[int, str]:
        """The sort key of copies of a file: a number, or a time."""
        if self.platform == "brightspace":
            with suppress(ValueError):  # a folder may have any name
                time = datetime.strptime(f"{self.when[:-5]}:{self.when[-5:]}", "%b %d, %Y %I:%M %p")
                return 0, time.isoformat()
        return (int(self.when), "") if self.when.isdecimal() else (0, self.when)


def platform_of(names: Collection[str]) -> str:
    """The platform whose form at least half of these names have; empty for none.

    Names that stand beside each other are taken together, as a student could imitate the form in one of them.
    Canvas gives no number twice.
    """
    counts = Counter[str]()
    for platform, form in FORMS.items():
        matches = [match for name in names if (match := form.fullmatch(name))]
        numbers = [match["when"] for match in matches] if platform == "canvas" else []
        counts[platform] = 0 if len(set(numbers)) < len(numbers) else len(matches)
    platform, most = max(counts.items(), key=lambda each: each[1])
    return platform if most and 2 * most >= len(names) else ""


def owner_of(name: str, platform: str = "", *, is_folder: bool = False) -> Owner:
    """The owner of a folder or a file, by the form of the platform where the name has it."""
    match = FORMS[platform].fullmatch(name) if platform else None
    if match:
        found = defaultdict(str, {key: text or "" for key, text in match.groupdict().items()})
        name, number, when = found["name"], found["id"], found["when"]
        label = "_".join(filter(None, [found["login"] or name, number]))
        return Owner(label, name, number, platform, found["own"], when, bool(found["late"]))
    stem = name.removesuffix(ARCHIVE) if is_folder else PurePath(name).stem
    while not is_folder and PurePath(stem).suffix.lower() in {*TEXTS, ARCHIVE} - {""}:
        stem = PurePath(stem).stem
    stem = re.sub(r"(?<=.) ?\([0-9]{1,2}\)$", "", stem)  # the count of a browser
    return Owner(stem, stem, own=name)


def uncounted(name: str) -> str:
    """A name without the count that Canvas adds where a file is handed in again: `orbit-1.csv`."""
    return re.sub(r"-[0-9]+(?=\.[^.]*$)", "", name).casefold()
