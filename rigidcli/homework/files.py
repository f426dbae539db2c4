"""The files that are handed in, in folders and archives; they are read if they are regular and bounded."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path, PurePath

from rigidcli.errors import Problem, printable, shown
from rigidcli.homework.archives import BROKEN, ELSEWHERE, ENDING, HIDDEN, Room, size, unpack
from rigidcli.homework.base import Tree, Unreadable

MOST_BYTES = 1_000_000
"""Length of an answer file, and of one beside it."""

MOST_FILES = 50_000
"""Files of an archive that are unpacked, and of a folder in which names are looked for."""

CLASS = Room(files=MOST_FILES, bytes=500_000_000, each=MOST_BYTES + 1)
"""What the archive of a class of thousands becomes, which every disk has room for."""

HAND_IN = Room(files=200, bytes=5_000_000, each=MOST_BYTES + 1)
"""What the archive becomes that a student hands in."""

GRADESCOPE = "submission_metadata.yml"
"""The list of who has submitted what in Gradescope's export."""

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

TEXTS = frozenset([*SUFFIXES, "", ".txt", ".text", ".md", ".markdown"])
"""Ends of the names of files that may be answers, too, if they answer a question."""

# --- names, with what platforms put before them

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

_NOT_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)

# Windows has no links to follow or pipes to wait for in opening, and its text mode would change bytes.
_FLAGS = ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY")


def safe_name(name: str | os.PathLike[str]) -> str:
    """A name of a file, which may hold anything, as a text that is safe to print."""
    return printable(os.fsencode(name).decode(errors="backslashreplace"))


def is_answer(name: str) -> bool:
    """Whether a file has the name of an answer file."""
    return PurePath(name).suffix.lower() in SUFFIXES


def may_answer(name: str) -> bool:
    """Whether a file may be an answer file, by its name."""
    return PurePath(name).suffix.lower() in TEXTS


@dataclass(frozen=True, slots=True)
class Owner:
    """Whose a folder or a file is by its name alone.

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
        """What orders the copies of a file: a number, or a time."""
        if self.platform == "brightspace":
            with suppress(ValueError):  # a folder may have any name
                time = datetime.strptime(f"{self.when[:-5]}:{self.when[-5:]}", "%b %d, %Y %I:%M %p")
                return 0, time.isoformat()
        return (int(self.when), "") if self.when.isdecimal() else (0, self.when)


def platform_of(names: Collection[str]) -> str:
    """The platform whose form at least half of the names have that stand beside each other, or none.

    A student may choose a part of one name, and not of the others. Canvas gives every file another number.
    """
    counts = Counter[str]()
    for platform, form in FORMS.items():
        matches = [match for name in names if (match := form.fullmatch(name))]
        numbers = [match["when"] for match in matches] if platform == "canvas" else []
        counts[platform] = 0 if len(set(numbers)) < len(numbers) else len(matches)
    platform, most = max(counts.items(), key=lambda each: each[1])
    return platform if most and 2 * most >= len(names) else ""


def owner_of(name: str, platform: str = "", *, is_folder: bool = False) -> Owner:
    """Whose a folder or a file is, by the form of a platform if it has that."""
    match = FORMS[platform].fullmatch(name) if platform else None
    if match:
        found = defaultdict(str, {key: text or "" for key, text in match.groupdict().items()})
        name, number, when = found["name"], found["id"], found["when"]
        label = "_".join(filter(None, [found["login"] or name, number]))
        return Owner(label, name, number, platform, found["own"], when, bool(found["late"]))
    stem = name.removesuffix(ENDING) if is_folder else PurePath(name).stem
    while not is_folder and PurePath(stem).suffix.lower() in {*TEXTS, ENDING} - {""}:
        stem = PurePath(stem).stem
    stem = re.sub(r"(?<=.) ?\([0-9]{1,2}\)$", "", stem)  # the count of a browser
    return Owner(stem, stem, own=name)


def uncounted(name: str) -> str:
    """A name without the count that Canvas adds where a file is handed in again: `orbit-1.csv`."""
    return re.sub(r"-[0-9]+(?=\.[^.]*$)", "", name).casefold()


def listed(names: Sequence[str]) -> str:
    """Names in a message, short and safe to print."""
    first, more = ", ".join(shown(printable(name)) for name in names[:20]), len(names) - 20
    return f"{first} and {more} more" if more > 0 else first


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students or files; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []


def unnamed(others: Sequence[Place], named: Collection[str]) -> list[str]:
    """A note on files beside the answers that no answer names."""
    unused = [place.short for place in others if place.source not in named]
    return noted("no answer files, and left out", unused)


# --- finding


@dataclass(frozen=True, slots=True)
class Place:
    """A file below one of ANSWERS: `way` are the folders that lead to it, `source` is its name in reports.

    `root` tells the ANSWERS apart; `given` is the name of one of several of them that is a folder. `owners`
    are the students whom the platform itself names, each by several names.
    """

    file: Path
    source: str
    root: int = 0
    way: tuple[str, ...] = ()
    given: str = ""
    owners: tuple[tuple[str, ...], ...] = ()

    @property
    def short(self) -> str:
        """The name of the file and of its folder."""
        return str(Path(*Path(self.source).parts[-2:]))


@dataclass(slots=True)
class Batch:
    """What is handed in, and what cannot be read.

    It is not `is_whole` where a folder, an archive, or what was given is missing as a whole.
    """

    places: list[Place] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    is_whole: bool = True

    def trouble(self, path: Path, message: str, *, is_whole: bool = True) -> None:
        """Take note of a file that cannot be read, and whether the batch is whole without it."""
        self.problems.append(Problem(safe_name(path), message))
        self.is_whole &= is_whole


def gather(paths: Sequence[str], assignment: str | None, scratch: Path) -> Batch:
    """The files that are meant by files, folders and archives, which are unpacked into `scratch`.

    Folders, pipes and links that have the name of an answer file count as files, and are not followed. Hidden
    files and the `assignment` are left out. An archive below ANSWERS is a folder of its name.
    """
    batch = Batch()
    seen = set() if assignment is None else {_spot(Path(assignment))}
    ways = _ways([given for given in paths if given and os.path.isfile(given)])  # noqa: PTH113 - it never raises
    for root, given in enumerate(paths):
        path = Path(given)
        try:
            if not given:
                raise ValueError
            path.lstat()
            is_folder = path.is_dir() and not is_answer(path.name)
        except (OSError, ValueError) as error:
            batch.trouble(path, _reason(error), is_whole=False)
            continue
        is_archive = path.suffix.lower() == ENDING and not is_folder
        if is_folder or is_archive:
            folder = scratch / str(root) if is_archive else path
            if is_archive and not _unpacked(path, folder, CLASS, batch):
                continue
            places = _below(folder, path, root, scratch / f"{root}-within", batch)
            if len(paths) > 1:
                places = _given(places, path.absolute().stem if is_archive else path.absolute().name)
            if not places:
                batch.trouble(path, "no answer files in it")
        else:
            places = [Place(path, safe_name(path), -2, ways.get(given, ()))]
        for place in _named(places):
            if _spot(place.file) not in seen:
                seen.add(_spot(place.file))
                batch.places.append(place)
    return batch


def _given(places: Sequence[Place], name: str) -> list[Place]:
    """The places below a folder, one of several given; with a single hand-in in it, it is a student's."""
    direct = [place for place in places if is_answer(place.file.name)] or places
    if len(direct) == 1 and not direct[0].way:
        return [replace(place, root=-1, way=(name, *place.way)) for place in places]
    return [replace(place, given=name) for place in places]


def _ways(files: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """The folders above files that are given one by one, below the one of all, if all lie equally deep."""
    parts = {given: Path(given).absolute().parts[:-1] for given in files}
    above = os.path.commonpath([Path(given).absolute().parent for given in files]) if files else ""
    ways = {given: way[len(Path(above).parts) :] for given, way in parts.items()}
    return ways if len(set(map(len, ways.values()))) == 1 else {}


def _below(folder: Path, path: Path, root: int, scratch: Path, batch: Batch) -> list[Place]:
    """The places in a folder, which reports call `path`, and in the archives there, which are no deeper."""

    def place_of(file: Path, way: tuple[str, ...], source: Path) -> Place:
        return Place(file, safe_name(source), root, way)

    found = [
        [place_of(file, inside.parts[:-1], path / inside)]
        for file in _walk(folder, batch)
        for inside in [file.relative_to(folder)]
    ]
    packed = dict[int, int]()
    for number, (place,) in enumerate(found):
        if place.file.suffix.lower() == ENDING and place.file.is_file() and not place.file.is_symlink():
            with suppress(*BROKEN):
                packed[number] = size(place.file)
    left = CLASS.bytes
    # The smallest come first, so that no large one takes the room of others.
    for number in sorted(packed, key=packed.__getitem__):
        (place,) = found[number]
        within = scratch / str(number)
        if left > 0 and _unpacked(place.file, within, HAND_IN, batch, place.source):
            left -= min(packed[number], HAND_IN.bytes)
            source, way = path.joinpath(*place.way, place.file.name), (*place.way, place.file.name)
            files = [(file, file.relative_to(within)) for file in _walk(within, batch)]
            inner = [place_of(file, (*way, *inside.parts[:-1]), source / inside) for file, inside in files]
            found[number] = inner or [place]
    return [place for places in found for place in places]


def _walk(folder: Path, batch: Batch) -> Iterator[Path]:
    """What there is in a folder and its folders, but for folders that are looked into."""
    for name, folders, files in os.walk(
        folder,
        onerror=lambda error: batch.trouble(
            Path(error.filename), _reason(error), is_whole=Path(error.filename) != folder
        ),
    ):
        here = Path(name)
        named = sorted(each for each in {*files, *folders} if not each.startswith(HIDDEN))
        looked_into = [each for each in named if each in folders and not is_answer(each)]
        folders[:] = [each for each in looked_into if not (here / each).is_symlink()]
        yield from (here / each for each in named if each not in folders)


def _unpacked(path: Path, folder: Path, room: Room, batch: Batch, source: str = "") -> bool:
    """Unpack an archive into a folder, note what is left out, and return whether it could be opened."""
    name = Path(source) if source else path
    try:
        for message in unpack(path, folder, room, SUFFIXES):
            batch.trouble(name, message, is_whole=bool(source) or "too large" not in message)
    except BROKEN as error:
        reason = getattr(error, "strerror", None) or printable(str(error))
        batch.trouble(name, f"cannot be read as a zip: {reason}", is_whole=bool(source))
        return False
    return True


def _named(places: Sequence[Place]) -> Iterator[Place]:
    """The places with the students whom Gradescope's list names, and without the list.

    It counts where it lies above all other files: a student may put another into the own folder.
    """
    from rigidcli.homework.answers import tree_of

    lists = sorted((each for each in places if each.file.name == GRADESCOPE), key=lambda each: len(each.way))
    others = [place for place in places if place.file.name != GRADESCOPE]
    owners: dict[str, tuple[tuple[str, ...], ...]] = {}
    depth = len(lists[0].way) if lists else 0
    for place in lists[:1] if len({place.way[:depth] for place in places}) == 1 else ():
        with suppress(Unreadable):
            tree = tree_of(read_file(place.file))
            for name, entry in tree.items() if isinstance(tree, dict) else ():
                people = entry.get(":submitters") if isinstance(entry, dict) else None
                known = [
                    [each.get(key) for key in (":email", ":sid", ":name")] for each in people or () if each
                ]
                owners[name] = tuple(tuple(filter(None, each)) for each in known if any(each))
    for place in others:
        yield replace(place, owners=owners.get("".join(place.way[depth : depth + 1]), ()))


def _reason(error: Exception) -> str:
    return f"cannot be read: {getattr(error, 'strerror', None) or 'no file has such a name'}"


def _spot(path: Path) -> str:
    """The place of a file, whatever path leads there; no link is followed."""
    return os.path.normpath(path.absolute())


# --- reading


def first_bytes(path: Path) -> bytes:
    """The first bytes of a regular file, which tell what it is; none of any other."""
    with suppress(Unreadable, OSError, ValueError):
        return _bytes_of(path, 16, "")
    return b""


def _bytes_of(path: Path, most: int, place: str) -> bytes:
    """The first bytes of a regular file. Raises Unreadable for what is none."""
    _require_regular(path.lstat(), place)
    descriptor = os.open(path, sum({getattr(os, flag, 0) for flag in _FLAGS}, os.O_RDONLY))
    with os.fdopen(descriptor, "rb") as file:
        _require_regular(os.fstat(descriptor), place)  # it may be another by now
        return file.read(most)


def read_file(path: Path, place: str = "") -> str:
    """The text of a regular file, in UTF-8, UTF-16 with its mark, or Windows' own code.

    Only what is a regular file is opened, because opening alone may hang, or have an effect. Raises
    Unreadable: missing_file; not_allowed for links, folders, devices and pipes; too_large; and parse_error
    for what is no text.
    """
    try:
        data = _bytes_of(path, MOST_BYTES + 1, place)
    except ValueError:
        raise Unreadable("missing_file", place=place) from None
    except OSError as error:
        code = "missing_file" if error.errno in _NOT_THERE else "parse_error"
        raise Unreadable(code, error.strerror or "", place=place) from None
    if len(data) > MOST_BYTES:
        raise Unreadable("too_large", f"expected at most {MOST_BYTES:,} bytes", place=place)
    try:
        return data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        if b"\0" not in data:
            return data.decode("cp1252", errors="replace")
        wrong = f"not UTF-8 text: byte {error.start} is {data[error.start]:#04x}"
        raise Unreadable("parse_error", wrong, place=place) from None


def _require_regular(status: os.stat_result, place: str) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise Unreadable("not_allowed", "it is a link, a folder, a pipe or a device", place=place)


# --- files that an answer names


def beside(name: Tree, answers: Path) -> Path:
    """The file that an answer in the file `answers` names, which lies beside it.

    What platforms have put before its name is seen through. Raises Unreadable: path_outside for a name that
    is a path, and not_allowed for a file of another student.
    """
    if not isinstance(name, str) or not name.strip():
        raise Unreadable("wrong_shape", f"read {shown(name)}, expected the name of a file", place="file")
    wanted = name.removeprefix("./")
    if wanted in ("", ".", "..") or not ELSEWHERE.isdisjoint(wanted):
        message = f"read {shown(name)}, expected a name without a folder"
        raise Unreadable("path_outside", message, place="file")
    folder = _Folder(answers.parent)
    student = folder.owner(answers.name).label
    if folder.owner_beside(wanted, answers.name) not in ("", student):
        raise Unreadable("not_allowed", "this file is another student's", place=shown(name))
    if wanted not in folder.names:
        owners = {each: folder.owner(each) for each in folder.names}
        own = {each: owner.own for each, owner in owners.items() if owner.platform and owner.label == student}
        same = [each for each in own if own[each] == wanted]
        same = same or [each for each in own if uncounted(own[each]) == uncounted(wanted)]
        # Of several that were handed in under one name, the last.
        wanted = max(same, key=lambda each: (len(each), each), default=wanted)
    return answers.parent / wanted


def is_contested(file: Path, answers: Path) -> bool:
    """Whether the answer file of another student names a file that is nobody's by its name."""
    folder = _Folder(answers.parent)
    if folder.owner_beside(file.name, answers.name):
        return False
    for other in folder.names:
        if may_answer(other) and other != answers.name:
            with suppress(Unreadable):
                if names_file(read_file(answers.parent / other), file.name):
                    return True
    return False


def names_file(text: str, name: str) -> bool:
    """Whether a text holds the name of a file, and not as a part of another."""
    return name in text and bool(re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w.-])", text))


class _Folder:
    """The names of what lies in a folder, as far as it can be read, and whose they are."""

    def __init__(self, folder: Path) -> None:
        self.names: list[str] = []
        with suppress(OSError):
            self.names = os.listdir(folder)[:MOST_FILES]  # noqa: PTH208 - names are all that is needed
        self._platform = platform_of(self.names)

    def owner(self, name: str) -> Owner:
        return owner_of(name, self._platform)

    def owner_beside(self, name: str, answers: str) -> str:
        """Whose a file is, by its name, among those who have answer files; empty where it is nobody's."""
        students = {self.owner(each).label for each in self.names if may_answer(each)}
        owner = self.owner(name)
        if owner.platform and (owner.label in students or self.owner(answers).platform):
            return owner.label
        folded = name.casefold()
        begun = [each for each in students if folded.startswith(each.casefold())]
        begun = [each for each in begun if not folded[len(each.casefold()) :][:1].isalnum()]
        return max(begun, key=len, default="")
