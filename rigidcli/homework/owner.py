"""Whose a hand-in is by the names of folders and files: their words, and what platforms put before them."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePath

from rigidcli.errors import first_few, printable, shown

# Ends of the names of answer files, in small letters or capitals.
SUFFIXES = frozenset([".yaml", ".yml", ".json"])
# Ends of the names of files that may be answers, too, if they answer a question.
TEXTS = frozenset([*SUFFIXES, "", ".txt", ".text", ".md", ".markdown"])
ARCHIVE = ".zip"


def is_answer(name: str) -> bool:
    """Whether a file has the name of an answer file."""
    return PurePath(name).suffix.lower() in SUFFIXES


def may_answer(name: str) -> bool:
    """Whether a file may be an answer file, by its name."""
    return PurePath(name).suffix.lower() in TEXTS


def listed(names: Sequence[str]) -> str:
    """Names in a message, short and safe to print."""
    return first_few(names, lambda name: shown(printable(name)))


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students or files; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []


# --- words

_WORD = re.compile(r"[^\W_]+")
# Letters that Unicode does not take apart into a letter and an accent.
_PLAIN = str.maketrans(dict(zip("øåæœłđðþı", ["o", "a", "ae", "oe", "l", "d", "d", "th", "i"], strict=True)))
# Letters as people write them who have no such keys; an accent is left away otherwise.
_TRANSCRIBED = _PLAIN | str.maketrans(dict(zip("äöüøå", ["ae", "oe", "ue", "oe", "aa"], strict=True)))
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

_ROWS = csv.DictReader(Path(__file__).with_name("platforms.csv").read_text("utf-8").splitlines())
# How platforms name a hand-in: a name or login, a number, and the student's own name of the file.
FORMS = {row["platform"]: re.compile(row["form"]) for row in _ROWS}


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
    def words(self) -> list[str]:
        """The words of the name."""
        return words_of(self.name)

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


def latest(owners: Sequence[Owner]) -> Sequence[Owner]:
    """Of copies of a file, the last that a platform's number or time tells apart; all where none does."""
    platforms = {owner.platform for owner in owners}
    is_told = len(platforms) == 1 and all(owner.when for owner in owners)
    if not is_told or (platforms == {"canvas"} and len({uncounted(owner.own) for owner in owners}) > 1):
        return owners
    last = max(owner.turn for owner in owners)
    return [owner for owner in owners if owner.turn == last]


def uncounted(name: str) -> str:
    """A name without the count that Canvas adds where a file is handed in again: `orbit-1.csv`."""
    return re.sub(r"-[0-9]+(?=\.[^.]*$)", "", name).casefold()
