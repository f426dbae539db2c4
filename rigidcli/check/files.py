"""The files that are handed in, in folders and archives; they are read if they are regular and bounded."""

from __future__ import annotations

import errno
import lzma
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from rigidcli.check.base import Tree, Unreadable
from rigidcli.errors import Problem, printable, shortened, shown

MOST_BYTES = 1_000_000
"""Length of an answer file, and of one beside it."""

MOST_FILES = 50_000
"""Files of an archive that are unpacked, and of a folder in which names are looked for."""

MOST_FOLDERS = 9
"""Parts of a name in an archive: a download has two or three, and a student may add some."""

MOST_UNPACKED = 500_000_000
"""Bytes that an archive may become: those of a class of thousands, which every disk has room for."""

HIDDEN = (".", "__MACOSX")
"""Beginnings of names that are passed over without a word: some systems put such files beside others."""

GRADESCOPE = "submission_metadata.yml"
"""The list of who has submitted what in Gradescope's export."""

ELSEWHERE = frozenset("/\\:\0")
"""Characters by which a name leads out of its folder, on one system or another."""

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

# Moodle puts this before the name of a file, or into that of a folder: Jane Doe_4711_assignsubmission_file_
MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>[0-9]+)_assignsubmission_(?:file|onlinetext)(?:_(?P<own>.*))?")
# And Canvas, with a number for each file: doejane_LATE_4711_98765_homework.yaml
CANVAS = re.compile(r"(?P<name>[^_]+)(?:_LATE)?_(?P<id>[0-9]+)_(?P<number>[0-9]+)_(?P<own>.+)")

_UTF8 = 0x800
"""The flag of an entry of an archive whose name is in UTF-8."""

_BROKEN = (zipfile.BadZipFile, zlib.error, lzma.LZMAError)
"""What is raised for an entry of an archive that is broken."""

_NOT_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)

# Windows has no links to follow or pipes to wait for in opening, and its text mode would change bytes.
_FLAGS = ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY")


def safe_name(name: str | os.PathLike[str]) -> str:
    """A name of a file, which may hold anything, as a text that is safe to print."""
    return printable(os.fsencode(name).decode(errors="backslashreplace"))


# --- names, with what Canvas and Moodle put before them


def is_answer(name: str) -> bool:
    """Whether a file has the name of an answer file."""
    return Path(name).suffix.lower() in SUFFIXES


def submitted(name: str, forms: Sequence[re.Pattern[str]] = (CANVAS, MOODLE)) -> tuple[str, str]:
    """The student, and the student's own name of a file, where Canvas or Moodle has joined the two.

    The student is empty in any other name. The first form that fits counts: a student may put another one
    into the rest.
    """
    match = next(filter(None, (form.fullmatch(name) for form in forms)), None)
    return (f"{match['name']}_{match['id']}", match["own"] or "") if match else ("", name)


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
    unused = [str(Path(*Path(place.source).parts[-2:])) for place in others if place.source not in named]
    return noted("no answer files, and left out", unused)


# --- finding


@dataclass(frozen=True, slots=True)
class Place:
    """A file below one of ANSWERS: `way` are the folders that lead to it, `source` is its name in reports.

    `root` tells the ANSWERS apart, and `owners` are the students whom the platform itself names.
    """

    file: Path
    source: str
    root: int = 0
    way: tuple[str, ...] = ()
    owners: tuple[str, ...] = ()


@dataclass(slots=True)
class Batch:
    """What is handed in: the answer files, the other files among them, and what cannot be read.

    It is not `is_whole` where a folder, an archive, or what was given is missing as a whole.
    """

    answers: list[Place] = field(default_factory=list)
    others: list[Place] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    is_whole: bool = True

    def trouble(self, path: Path, message: str, *, is_whole: bool = True) -> None:
        """Take note of a file that cannot be read, and whether the batch is whole without it."""
        self.problems.append(Problem(safe_name(path), message))
        self.is_whole &= is_whole


def gather(paths: Sequence[str], assignment: str | None, scratch: Path) -> Batch:
    """The files that are meant by files, folders and archives, which are unpacked into `scratch`.

    Whatever has the name of an answer file is judged as one: folders and pipes, too, and links, which are
    not followed. Hidden files and the `assignment` are left out.
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
        is_archive = path.suffix.lower() == ".zip" and not is_folder
        if is_folder or is_archive:
            folder = _unpacked(path, scratch / str(root), batch) if is_archive else path
            inside = (file.relative_to(folder) for file in _walk(folder, batch))
            places = [Place(folder / file, safe_name(path / file), root, file.parts[:-1]) for file in inside]
            direct = [place for place in places if is_answer(place.file.name)]
            if len(paths) > 1 and len(direct) == 1 and not direct[0].way:
                # One of several folders, with a single hand-in: it is a student's.
                name = path.absolute().stem if is_archive else path.absolute().name
                places = [Place(each.file, each.source, -1, (name, *each.way)) for each in places]
            if not places:
                batch.trouble(path, "no answer files in it")
        else:
            places = [Place(path, safe_name(path), -2, ways.get(given, ()))]
        for place in _named(places):
            if _spot(place.file) not in seen:
                seen.add(_spot(place.file))
                is_judged = place.file == path or is_answer(place.file.name)
                (batch.answers if is_judged else batch.others).append(place)
    return batch


def _ways(files: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """The folders above files that are given one by one, below the one of all, if all lie equally deep."""
    parts = {given: Path(given).absolute().parts[:-1] for given in files}
    above = os.path.commonpath([Path(given).absolute().parent for given in files]) if files else ""
    ways = {given: way[len(Path(above).parts) :] for given, way in parts.items()}
    return ways if len(set(map(len, ways.values()))) == 1 else {}


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


def _unpacked(path: Path, folder: Path, batch: Batch) -> Path:
    """The folder of the files of an archive, each cut off where it is too long to be judged anyway.

    A file that cannot be unpacked is left out by itself, and told.
    """
    left = MOST_UNPACKED
    folder.mkdir(parents=True, exist_ok=True)
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, OSError, NotImplementedError, ValueError) as error:
        reason = getattr(error, "strerror", None) or printable(str(error))
        batch.trouble(path, f"cannot be read as a zip: {reason}", is_whole=False)
        return folder
    with archive:
        named = [(_parts_of(info), info) for info in archive.infolist() if not info.is_dir()]
        # Where a file and a folder have one name, the file stays if it may be an answer, else the folder.
        answers = {parts for parts, _ in named if parts and is_answer(parts[-1])}
        folders = {above for parts, _ in named for above in _above(parts) if above not in answers}
        # The smallest come first, so that no large one takes the room of others.
        named.sort(key=lambda each: each[1].file_size)
        for number, (parts, info) in enumerate(named):
            if number >= MOST_FILES or left <= 0:
                message = f"{len(named) - number:,} files are left out: the archive is too large"
                batch.trouble(path, message, is_whole=False)
                break
            try:
                if parts in folders or not answers.isdisjoint(_above(parts)):
                    raise ValueError("a file and a folder have one name")
                left -= _unpack(archive, info, folder.joinpath(*_harmless(parts, info)))
            except (*_BROKEN, OSError, RuntimeError, ValueError, EOFError) as error:
                reason = "it is encrypted" if info.flag_bits & 1 else "it is broken, or its form is unknown"
                if isinstance(error, OSError | ValueError):
                    reason = getattr(error, "strerror", None) or str(error)
                name = shortened(safe_name("/".join(parts)))
                batch.trouble(path, f"`{name}` is left out: {reason}")
    return folder


def _parts_of(info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The folders and the name of an entry; some programs write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & _UTF8:
        with suppress(UnicodeError):
            name = name.encode("cp437").decode()
    return tuple(part for part in re.split(r"[/\\]", name) if part not in ("", "."))


def _above(parts: tuple[str, ...]) -> list[tuple[str, ...]]:
    """The folders above an entry."""
    return [parts[:depth] for depth in range(1, len(parts))]


def _harmless(parts: tuple[str, ...], info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The parts of a name below which an entry may be written. Raises ValueError for other entries."""
    if stat.S_ISLNK(info.external_attr >> 16):
        raise ValueError("it is a link")
    if not parts or ".." in parts or ELSEWHERE & set("".join(parts)):
        raise ValueError("its name leads out of the folder")
    if len(parts) > MOST_FOLDERS:
        raise ValueError("it lies too deep")
    return parts


def _unpack(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: Path) -> int:
    """Write an entry of an archive into a file that is not there yet, and return how long it is."""
    with archive.open(info) as packed:
        data = packed.read(MOST_BYTES + 1)
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("xb") as target:
        target.write(data)
    return len(data)


def _named(places: Sequence[Place]) -> Iterator[Place]:
    """The places with the students whom Gradescope's list in their folder names, and without the list."""
    from rigidcli.check.answers import tree_of

    owners: dict[str, tuple[str, ...]] = {}
    for place in places:
        if place.file.name == GRADESCOPE:
            with suppress(Unreadable):
                tree = tree_of(read_file(place.file))
                for name, entry in tree.items() if isinstance(tree, dict) else ():
                    people = entry.get(":submitters") if isinstance(entry, dict) else None
                    emails = [each.get(":email") or each.get(":name") for each in people or () if each]
                    owners[name] = tuple(filter(None, emails))
    for place in places:
        if place.file.name != GRADESCOPE:
            own = next((owners[folder] for folder in place.way if folder in owners), ())
            yield replace(place, owners=own)


def _reason(error: Exception) -> str:
    return f"cannot be read: {getattr(error, 'strerror', None) or 'no file has such a name'}"


def _spot(path: Path) -> str:
    """The place of a file, whatever path leads there; no link is followed."""
    return os.path.normpath(path.absolute())


# --- reading


def read_file(path: Path, place: str = "") -> str:
    """The text of a regular file, in UTF-8, UTF-16 with its mark, or Windows' own code.

    Only what is a regular file is opened, because opening alone may hang, or have an effect. Raises
    Unreadable: missing_file; not_allowed for links, folders, devices and pipes; too_large; and parse_error
    for what is no text.
    """
    try:
        _require_regular(path.lstat(), place)
        descriptor = os.open(path, sum({getattr(os, flag, 0) for flag in _FLAGS}, os.O_RDONLY))
        with os.fdopen(descriptor, "rb") as file:
            _require_regular(os.fstat(descriptor), place)  # it may be another by now
            data = file.read(MOST_BYTES + 1)
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

    What Canvas and Moodle have put before its name is seen through. Raises Unreadable: path_outside for a
    name that is a path, and not_allowed for a file of another student.
    """
    if not isinstance(name, str) or not name.strip():
        raise Unreadable("wrong_shape", f"read {shown(name)}, expected the name of a file", place="file")
    wanted = name.removeprefix("./")
    if wanted in ("", ".", "..") or not ELSEWHERE.isdisjoint(wanted):
        message = f"read {shown(name)}, expected a name without a folder"
        raise Unreadable("path_outside", message, place="file")
    names = _names_in(answers.parent)
    student = _student(answers.name)
    if _owner(wanted, answers, names) not in ("", student):
        raise Unreadable("not_allowed", "this file is another student's", place=shown(name))
    if wanted not in names:
        own = {each: submitted(each)[1] for each in names if submitted(each)[0] == student}
        same = [each for each in own if own[each] == wanted]
        same = same or [each for each in own if uncounted(own[each]) == uncounted(wanted)]
        # Of several that were handed in under one name, the last.
        wanted = max(same, key=lambda each: (len(each), each), default=wanted)
    return answers.parent / wanted


def is_contested(file: Path, answers: Path) -> bool:
    """Whether the answer file of another student names a file that is nobody's by its name."""
    names = _names_in(answers.parent)
    if _owner(file.name, answers, names):
        return False
    named = re.compile(rf"(?<![\w.-]){re.escape(file.name)}(?![\w.-])")
    for other in names:
        if is_answer(other) and other != answers.name:
            with suppress(Unreadable):
                if named.search(read_file(answers.parent / other)):
                    return True
    return False


def _names_in(folder: Path) -> list[str]:
    """The names of what lies in a folder, as far as it can be read, in any order."""
    with suppress(OSError):
        return os.listdir(folder)[:MOST_FILES]  # noqa: PTH208 - names are all that is needed
    return []


def _student(name: str) -> str:
    """Whose an answer file is by its name alone."""
    return submitted(name)[0] or Path(name).stem


def _owner(name: str, answers: Path, names: Sequence[str]) -> str:
    """Whose a file is by its name, among those who have answer files; empty where it is nobody's."""
    students = {_student(each) for each in names if is_answer(each)}
    student = submitted(name)[0]
    if student and (student in students or submitted(answers.name)[0]):
        return student
    folded = name.casefold()
    begun = [each for each in students if folded.startswith(each.casefold())]
    begun = [each for each in begun if not folded[len(each.casefold()) :][:1].isalnum()]
    return max(begun, key=len, default="")
