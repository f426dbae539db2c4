"""Whose a hand-in is, which of a student's files is the answer file, and what becomes of the others."""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple, TypeAlias

import orjson

from rigidcli.errors import printable
from rigidcli.fields.texts import BINARY_FILES, ending
from rigidcli.homework.answers import folded, read_answers
from rigidcli.homework.base import MISSING, Outcome, Unreadable
from rigidcli.homework.files import (
    IN_ROSTER,
    ONE_HAND_IN,
    Batch,
    HandedFile,
    first_bytes,
    names_file,
    read_file,
)
from rigidcli.homework.owner import Owner, is_answer, latest, listed, may_answer, noted, owner_of, platform_of
from rigidcli.homework.roster import Roster
from rigidcli.homework.workers import each
from rigidcli.sandbox import LIMITS, usable_cores

# Endings of data files and of tables that platforms add: none of them is an answer file.
TABLES = frozenset([".csv", ".tsv", ".npy", ".xls", ".xlsx", ".ods", ".html", ".htm"])
# With so many answer files, or folders, in it a folder is that of the class, and not of a student.
LEAST_OF_CLASS = 4
MOST_OPENED = 30  # the most files of a student that are opened to see whether they answer a question
# What zips with other endings are.
OFFICE = {".docx": "a Word file", ".odt": "an OpenDocument file", ".pages": "a Pages file"}


@dataclass(frozen=True, slots=True)
class Paper:
    """What a student has handed in: a file, or none; with an `outcome` if the program does not judge it."""

    student: str
    file: Path | None = None
    source: str = ""
    outcome: Outcome | None = None
    is_late: bool = False


class HandIns(NamedTuple):
    """What every student has handed in, notes on who is who, and files that are no hand-ins."""

    papers: list[Paper]
    notes: list[str]
    others: list[HandedFile]


class _Look(NamedTuple):
    """Whether a file answers a question, the hash of its text, and the files that it names."""

    answers: bool = False
    digest: str = ""
    names: Sequence[str] = ()


@dataclass(slots=True)
class _Student:
    """A student's files with their owners, and who of the roster may be `meant`: one, none, or several."""

    name: str
    meant: Sequence[str] | None = None
    files: dict[HandedFile, Owner] = field(default_factory=dict)


def papers(
    batch: Batch,
    roster: Roster | None = None,
    known: Collection[str] = (),
    jobs: int | None = None,
    *,
    one: str = "",
) -> HandIns:
    """The hand-in of every student, also of those on the roster without one.

    `known` are the names of questions. If `one` has a name, all files are of this student.
    """
    students = [_Student(one, [one], dict.fromkeys(batch.places, Owner("", "")))]
    students = students if one else _students(batch.places, roster)
    looks = _looked_at([_candidates(student.files) for student in students], known, jobs)
    found, unknown, doubtful = HandIns([], [], []), list[str](), list[str]()
    for student in students:
        paper = _paper(student, looks, found)
        if student.meant and len(student.meant) > 1:
            outcome = Unreadable("duplicate_key", f"it may be that of {listed(student.meant)}").outcome
            paper = Paper(student.name, None, next(iter(student.files)).source, outcome)
            doubtful.append(student.name)
        elif paper and student.meant is not None and not student.meant:
            if not paper.file and not any(_nature(place.file) for place in student.files):
                continue  # a text about the course is no hand-in
            unknown.append(student.name)
        found.papers.extend(filter(None, [paper]))
    given = {folded(paper.student) for paper in found.papers}
    expected = [one] if one else [*roster.labels.values()] if roster else []
    found.papers.extend(Paper(name, outcome=MISSING) for name in expected if folded(name) not in given)
    said = [] if roster is None else roster.notes(unknown, doubtful)
    return found._replace(notes=[*said, *found.notes])


def _students(places: Sequence[HandedFile], roster: Roster | None) -> list[_Student]:
    """The students with their files, in the order of first files."""
    students: dict[str, _Student] = {}
    owners = _owners(places, roster)
    for place in places:
        owner, keys = owners[place]
        for names in place.owners or [(owner.label,)]:
            name, meant = names[0], None
            if roster is not None:
                keys = roster.first(names) if place.owners else keys
                meant = [roster.labels[key] for key in sorted(keys)]
                name = meant[0] if len(meant) == 1 else name
            student = students.setdefault(folded(name), _Student(name, meant))
            student.files[place] = owner
    return [*students.values()]


# --- whose a file is

# The owner of each file, and the students of the roster who may be meant.
_Found: TypeAlias = dict[HandedFile, tuple[Owner, set[int]]]


def _owners(places: Sequence[HandedFile], roster: Roster | None) -> _Found:
    """The owner of each file, by the first level of folders that tells students apart, or by its own name.

    Names further down are chosen by students, who could pose as others by them.
    """
    groups = defaultdict[int, dict[HandedFile, tuple[str, ...]]](dict)
    for place in places:
        if roster and place.given:
            groups[IN_ROSTER][place] = (place.given, *place.way)
        else:
            groups[place.group][place] = place.way
    found: _Found = {}
    for ways in groups.values():
        found |= _of_group(ways, roster)
    return found


def _of_group(ways: Mapping[HandedFile, tuple[str, ...]], roster: Roster | None) -> _Found:
    """The owners of the files below one of ANSWERS, by the folders that lead to each file.

    The level that decides is the first with the form of a platform, or with names of students of the roster;
    without a roster it is the first that tells hand-ins apart.
    """
    apart = _level_apart([*ways]) if roster is None else -1
    found: _Found = {}
    for level in range(max(map(len, ways.values()))):
        names = {place: way[level] for place, way in ways.items() if len(way) > level}
        owners = _of_names(names, roster, is_folder=True)
        if level == apart or any(owner.platform or keys for owner, keys in owners.values()):
            found = owners
            break
    direct = {place: place.file.name for place in ways if place not in found}
    by_file = _of_names(direct, roster, is_folder=False)
    if roster and not found and not any(keys for _, keys in by_file.values()):
        return _owners([*ways], None)  # the list is no help
    return found | by_file


def _of_names(names: Mapping[HandedFile, str], roster: Roster | None, *, is_folder: bool) -> _Found:
    every = {*names.values()}
    platform = platform_of(every)
    owners = {name: owner_of(name, platform, is_folder=is_folder) for name in every}
    keys = {} if roster is None else roster.find_all(owners)
    return {place: (owners[name], keys.get(name, set())) for place, name in names.items()}


def _level_apart(places: Collection[HandedFile]) -> int:
    """The level of the folders that tell hand-ins apart; -1 where files go by their own names.

    An answer file in the one folder that all share is a student's, unless many lie there: then the folder is
    that of the class.
    """
    ways = [place.way for place in places]
    if any(place.group == ONE_HAND_IN for place in places):
        return 0
    levels = zip(*filter(None, ways), strict=False)
    common = tuple(level[0] for level in takewhile(lambda level: len({*level}) == 1, levels))
    level = len(common)
    here = [place.file.name for place in places if place.way == common]
    is_last = not any(way > common for way in ways)
    is_few = sum(map(may_answer, here)) < LEAST_OF_CLASS
    has_platform = platform_of({place.file.name for place in places})
    if common and (is_last or any(map(is_answer, here))) and is_few and not has_platform:
        level -= 1
    # Folders that all hold many folders, and nothing else, are sections of the class.
    while min(map(len, ways)) >= level + 2:
        within = Counter(way[:-1] for way in {way[: level + 2] for way in ways})
        if min(within.values()) < LEAST_OF_CLASS:
            break
        level += 1
    return level if any(len(way) > level for way in ways) else -1


# --- which file it is


def _candidates(files: Collection[HandedFile]) -> list[HandedFile]:
    """The files of a student that may be the answer file, those of the right names first."""
    texts = {place: place.file.name for place in files if ending(place.file.name) not in TABLES}
    order = {place: (not is_answer(name), len(place.way), len(name)) for place, name in texts.items()}
    return sorted(texts, key=order.__getitem__)


def _looked_at(
    students: Iterable[Sequence[HandedFile]], known: Collection[str], jobs: int | None
) -> Mapping[Path, _Look]:
    """What is in the files of students who have several, or one without the name of an answer file."""
    tasks = list[tuple[Path, list[str]]]()
    for files in students:
        paths = [place.file for place in files[:MOST_OPENED]]
        if len(paths) > 1 or not all(is_answer(path.name) for path in paths):
            for path in paths:
                beside = [other.name for other in paths if other.parent == path.parent and other != path]
                tasks.append((path, beside))
    # The texts are untrusted: they are read where judging would read them.
    work = partial(_look, frozenset(known))
    results = each(work, tasks, jobs or usable_cores(), LIMITS, lambda share: None)
    looks = defaultdict[Path, _Look](_Look)
    for (path, _), result in zip(tasks, results, strict=True):
        looks[path] = _Look(*orjson.loads(result)) if isinstance(result, bytes) else _Look()
    return looks


def _look(known: frozenset[str], task: tuple[Path, Sequence[str]]) -> bytes:
    path, others = task
    look = _Look()
    with suppress(Unreadable):
        text = read_file(path)
        digest = hashlib.sha256(text.encode()).hexdigest()
        look = _Look(False, digest, [name for name in others if names_file(text, name)])
        answers, _ = read_answers(text, known)
        given = {id for id, answer in answers.items() if answer is not None}
        look = look._replace(answers=bool(given & known if known else given))
    return orjson.dumps([*look])


def _paper(student: _Student, looks: Mapping[Path, _Look], told: HandIns) -> Paper | None:
    """The hand-in of a student, if there is any; `told` gets notes on it, and the files that are none."""
    candidates = _candidates(student.files)
    answering = [place for place in candidates if looks[place.file].answers]
    named = {name for place in answering for name in looks[place.file].names}
    answering = [place for place in answering if place.file.name not in named] or answering
    # Where nothing can be read, what has the name of an answer file is judged, and says what is wrong.
    hand_ins = answering or [place for place in candidates if is_answer(place.file.name)]
    owners = {*latest([student.files[place] for place in hand_ins])}
    last = [place for place in hand_ins if student.files[place] in owners]
    earlier = [place.file.name for place in hand_ins if place not in last]
    again = f"handed in again by {printable(student.name)}, and the earlier left out"
    told.notes.extend(noted(again, earlier))
    told.others.extend(place for place in student.files if place not in hand_ins)
    apart = {looks[place.file].digest or place.source: place for place in reversed(last)}
    if len(apart) > 1:
        detail = f"{len(last)} answer files are this student's: {listed([place.short for place in last])}"
        told.notes.extend(noted("more than one answer file, and none of them judged", [student.name]))
        return Paper(student.name, outcome=Unreadable("duplicate_key", detail).outcome)
    for place in apart.values():
        outcome = Outcome.review(f"read {_told(place)}") if _nature(place.file) else None
        return Paper(student.name, place.file, place.source, outcome, student.files[place].is_late)
    # A table beside answer files is one that they name, unless it is all that somebody on the list has. Any
    # other file is a hand-in, such as a pdf.
    scans = [
        place
        for place, owner in student.files.items()
        if place.way or place in candidates or owner.platform or student.meant
    ]
    if not scans:
        return None
    detail = f"read {', '.join(map(_told, scans[:5]))}, which answers no question"
    return Paper(student.name, None, scans[0].source, Outcome.review(detail), student.files[scans[0]].is_late)


def _told(place: HandedFile) -> str:
    return ", ".join(filter(None, [listed([place.file.name]), _nature(place.file)]))


def _nature(path: Path) -> str:
    """What a file is that this program does not read, such as a PDF; empty for any other."""
    begin = first_bytes(path)
    if begin[4:8] == b"ftyp":  # of HEIC and of films
        return "a picture or a film"
    if begin.startswith(b"PK"):
        return OFFICE.get(ending(path.name), "a zip")
    return next((kind for mark, kind in BINARY_FILES.items() if begin.startswith(mark)), "")
