"""The files that are handed in, in folders and archives; they are read if they are regular and bounded."""

from __future__ import annotations

import errno
import lzma
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rigidcli.errors import Problem, printable, shortened, shown
from rigidcli.fields.texts import ending, safe_name
from rigidcli.homework.answers import tree_of
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.owner import ARCHIVE, is_answer, may_answer, owner_of, platform_of, uncounted

MOST_BYTES = 1_000_000  # the most bytes of an answer file, and of a file that it names
MOST_FILES = 50_000  # the most files of an archive that are unpacked, and of a folder whose names are read
GRADESCOPE = "submission_metadata.yml"  # the list of who has submitted what in Gradescope's export
_NOT_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)
# Windows has no links to follow or pipes to wait for in opening, and its text mode would change bytes.
_FLAGS = ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY")


# --- finding

# Groups besides those of single folders: folders with one hand-in, files, and folders that a roster may name.
ONE_HAND_IN, FILES, IN_ROSTER = -1, -2, -3


@dataclass(frozen=True, slots=True)
class HandedFile:
    """A file below one of ANSWERS: `way` are the folders that lead to it, `source` is its name in reports.

    The names in one `group` tell the students apart. A group has all files below a folder that is given, all
    files that are given by themselves, or all folders of single students. Where several of ANSWERS are given,
    `given` is the name of the folder. `owners` are the students whom the platform names, each by several
    names.
    """

    file: Path
    source: str
    group: int = 0
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

    places: list[HandedFile] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    is_whole: bool = True

    def trouble(self, path: Path, message: str, *, is_whole: bool = True) -> None:
        """Take note of a file that cannot be read, and whether the batch is whole without it."""
        self.problems.append(Problem(safe_name(path), message))
        self.is_whole &= is_whole


def gather(paths: Sequence[str], assignment: str | None, scratch: Path) -> Batch:
    """The files that paths mean: files, folders and archives, which are unpacked into `scratch`.

    Folders, pipes and links that have the name of an answer file count as files, and are not followed. Hidden
    files and the `assignment` are left out. An archive below ANSWERS is a folder of its name.
    """
    batch = Batch()
    seen = set() if assignment is None else {_spot(Path(assignment))}
    ways = _ways([given for given in paths if given and os.path.isfile(given)])  # noqa: PTH113 - it never raises
    for group, given in enumerate(paths):
        path = Path(given)
        try:
            if not given:
                raise ValueError
            path.lstat()
            is_folder = path.is_dir() and not is_answer(path.name)
        except (OSError, ValueError) as error:
            batch.trouble(path, _reason(error), is_whole=False)
            continue
        is_archive = path.suffix.lower() == ARCHIVE and not is_folder
        if is_folder or is_archive:
            folder = scratch / str(group) if is_archive else path
            if is_archive and _unpacked(path, folder, CLASS, batch) is None:
                continue
            places = _below(folder, path, group, scratch / f"{group}-within", batch)
            if len(paths) > 1:
                places = _given(places, path.absolute().stem if is_archive else path.absolute().name)
            if not places:
                batch.trouble(path, "no answer files in it")
        else:
            places = [HandedFile(path, safe_name(path), FILES, ways.get(given, ()))]
        for place in _named(places):
            if _spot(place.file) not in seen:
                seen.add(_spot(place.file))
                batch.places.append(place)
    return batch


def _given(places: Sequence[HandedFile], name: str) -> list[HandedFile]:
    """The places below one of several folders given; one with a single hand-in is a student's."""
    answers = [place for place in places if is_answer(place.file.name)]
    if len(answers or [place for place in places if may_answer(place.file.name)] or places) == 1:
        return [replace(place, group=ONE_HAND_IN, way=(name, *place.way)) for place in places]
    return [replace(place, given=name) for place in places]


def _ways(files: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """For each file given by itself, its folders below the common one; nothing if depths differ."""
    parts = {given: Path(given).absolute().parts[:-1] for given in files}
    above = os.path.commonpath([Path(given).absolute().parent for given in files]) if files else ""
    ways = {given: way[len(Path(above).parts) :] for given, way in parts.items()}
    return ways if len(set(map(len, ways.values()))) == 1 else {}


def _below(folder: Path, path: Path, group: int, scratch: Path, batch: Batch) -> list[HandedFile]:
    """The places in a folder, and in the archives there; reports call the folder `path`."""
    found = {place: [place] for place in _listed(folder, path, group, (), batch)}
    named = [place for place in found if ending(place.file.name) == ARCHIVE]
    archives = [each for each in named if first_bytes(each.file) and zipfile.is_zipfile(each.file)]
    left = CLASS.bytes
    # The smallest come first, so that no large one takes the room of others.
    for number, place in enumerate(sorted(archives, key=lambda place: place.file.stat().st_size)):
        within = scratch / str(number)
        taken = _unpacked(place.file, within, HAND_IN, batch, place.source) if left > 0 else None
        if taken is not None:
            left -= taken
            way = (*place.way, place.file.name)
            found[place] = _listed(within, path.joinpath(*way), group, way, batch) or [place]
    return [place for places in found.values() for place in places]


def _listed(folder: Path, path: Path, group: int, way: tuple[str, ...], batch: Batch) -> list[HandedFile]:
    """The places in a folder, which reports call `path`, at the end of a `way`.

    They are all files, and what poses as an answer file. Hidden names are left out.
    """

    def failed(error: OSError) -> None:
        batch.trouble(Path(error.filename), _reason(error), is_whole=Path(error.filename) != folder)

    places = list[HandedFile]()
    for name, folders, files in os.walk(folder, onerror=failed):
        here = Path(name).relative_to(folder)
        named = sorted(each for each in {*files, *folders} if not each.startswith(HIDDEN_NAMES))
        looked_into = [each for each in named if each in folders and not is_answer(each)]
        folders[:] = [each for each in looked_into if not Path(name, each).is_symlink()]
        for file in (here / each for each in named if each not in folders):
            source = safe_name(path / file)
            places.append(HandedFile(folder / file, source, group, (*way, *here.parts)))
    return places


def _named(places: Sequence[HandedFile]) -> Iterator[HandedFile]:
    """The places with the students whom Gradescope's list names, and without the list.

    It counts where it lies above all other files: a student may put another into the own folder.
    """
    lists = sorted((each for each in places if each.file.name == GRADESCOPE), key=lambda each: len(each.way))
    depth = len(lists[0].way) if lists else 0
    tree = None
    if lists and len({place.way[:depth] for place in places}) == 1:
        with suppress(Unreadable):
            tree = tree_of(read_file(lists[0].file))
    owners = dict[str, tuple[tuple[str, ...], ...]]()
    for folder, entry in tree.items() if isinstance(tree, dict) else ():
        with suppress(AttributeError, KeyError, TypeError):  # an entry of another form names nobody
            keys = (":email", ":sid", ":name")
            people = [[str(each.get(key) or "") for key in keys] for each in entry[":submitters"]]
            owners[folder] = tuple(tuple(filter(None, each)) for each in people if any(each))
    for place in places:
        if place.file.name != GRADESCOPE:
            yield replace(place, owners=owners.get("".join(place.way[depth : depth + 1]), ()))


def _reason(error: Exception) -> str:
    return f"cannot be read: {getattr(error, 'strerror', None) or 'no file has such a name'}"


def _spot(path: Path) -> str:
    return os.path.normpath(path.absolute())  # no link is followed


# --- archives


class Bounds(NamedTuple):
    """How much of an archive is unpacked: the number of files, and the bytes of all of them."""

    files: int
    bytes: int


CLASS = Bounds(files=MOST_FILES, bytes=500_000_000)  # a class of thousands
HAND_IN = Bounds(files=200, bytes=5_000_000)  # what a student hands in
# The most parts of a name in an archive: a download has two or three, and a student may add some.
MOST_FOLDERS = 9
ELSEWHERE = frozenset("/\\:\0")  # characters that separate folders or drives on some system, and NUL
# Beginnings of names that are ignored: systems add such files to folders and archives.
HIDDEN_NAMES = (".", "__MACOSX", "Thumbs.db", "desktop.ini")
_UTF8 = 0x800  # the flag of an entry whose name is in UTF-8
_DEVICE = re.compile(r"(?i:con|prn|aux|nul|com[0-9]|lpt[0-9])(?:\..*)?")  # on Windows, with any ending
# What is raised for an archive, or for an entry, that is broken, encrypted, or of an unknown form.
BROKEN = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, RuntimeError, ValueError, EOFError)


def _unpacked(path: Path, folder: Path, bounds: Bounds, batch: Batch, source: str = "") -> int | None:
    """Unpack an archive into a folder, note what is left out, and return its bytes; None if it is broken.

    An archive that is handed in has the name `source`. Of entries with one name the smallest stays.
    """
    place, left = Path(source or path), bounds.bytes
    try:
        folder.mkdir(parents=True, exist_ok=True)
        archive = zipfile.ZipFile(path)
    except BROKEN as error:
        reason = getattr(error, "strerror", None) or printable(str(error))
        batch.trouble(place, f"cannot be read as a zip: {reason}", is_whole=bool(source))
        return None
    with archive:
        named = [(_parts_of(info), info) for info in archive.infolist() if not info.is_dir()]
        named = [each for each in named if not any(part.startswith(HIDDEN_NAMES) for part in each[0])]
        # The smallest come first, so that no large one takes the room of others.
        for number, (parts, info) in enumerate(sorted(named, key=lambda each: each[1].file_size)):
            if number >= bounds.files or left <= 0:
                message = f"{len(named) - number:,} files are left out: the archive is too large"
                batch.trouble(place, message, is_whole=bool(source))
                break
            try:
                # A longer file is cut off, and too large. Of an archive within, half could not be read.
                most = bounds.bytes if "".join(parts[-1:]).lower().endswith(ARCHIVE) else MOST_BYTES + 1
                file = folder.joinpath(*_harmless(parts, info))
                with archive.open(info) as packed:
                    data = packed.read(min(most, left))
                file.parent.mkdir(parents=True, exist_ok=True)
                with file.open("xb") as target:
                    target.write(data)
                left -= len(data)
            except BROKEN as error:
                reason = "it is encrypted" if info.flag_bits & 1 else "it is broken, or its form is unknown"
                if isinstance(error, FileExistsError | NotADirectoryError):
                    reason = "another file or folder has its name"
                elif isinstance(error, OSError | ValueError):
                    reason = getattr(error, "strerror", None) or str(error)
                batch.trouble(place, f"`{shortened(printable('/'.join(parts)))}` is left out: {reason}")
    return bounds.bytes - left


def _parts_of(info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The folders and the name of an entry; some programs write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & _UTF8:
        with suppress(UnicodeError):
            name = name.encode("cp437").decode()
    return tuple(part for part in re.split(r"[/\\]", name) if part not in ("", "."))


def _harmless(parts: tuple[str, ...], info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The parts of the name of an entry that is safe to write. Raises ValueError for others."""
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG):
        raise ValueError("it is a link, or no file")
    if not parts or ".." in parts or ELSEWHERE & set("".join(parts)) or info.filename.startswith(("/", "\\")):
        raise ValueError("its name leads out of the folder")
    if os.name == "nt" and any(map(_DEVICE.fullmatch, parts)):
        raise ValueError("its name is that of a device")
    if len(parts) > MOST_FOLDERS:
        raise ValueError("it lies too deep")
    return parts


# --- reading


def first_bytes(path: Path) -> bytes:
    """The first bytes of a regular file, by which formats are known; none of any other file."""
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

    What platforms put before its name is ignored. Raises Unreadable: path_outside for a name that
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
    if folder.owner_by_begin(wanted, answers.name) not in ("", student):
        raise Unreadable("not_allowed", "this file is another student's", place=shown(name))
    if wanted in folder.names:
        return answers.parent / wanted
    owners = {each: folder.owner(each) for each in folder.names}
    own = {each: owner.own for each, owner in owners.items() if owner.platform and owner.label == student}
    same = [each for each in own if own[each] == wanted]
    same = same or [each for each in own if uncounted(own[each]) == uncounted(wanted)]
    # Of several that were handed in under one name, the last.
    last = max(same, key=lambda each: (len(each), each), default="")
    return answers.parent / (last or wanted)


def whose_else(file: Path, answers: Path) -> str:
    """Why a file that an answer names may be another student's; empty where it is not.

    It may be so where it is nobody's by its name, and another answer names it, too.
    """
    folder = _Folder(answers.parent)
    for other in () if folder.owner_by_begin(file.name, answers.name) else folder.answers:
        with suppress(Unreadable):
            if other != answers.name and names_file(read_file(answers.parent / other), file.name):
                return "another student's answer names this file, too"
    return ""


def names_file(text: str, name: str) -> bool:
    """Whether a text holds the name of a file, and not as a part of another."""
    return name in text and bool(re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w.-])", text))


class _Folder:
    """The names in a folder, as far as it can be read, those of `answers` among them, and their owners."""

    def __init__(self, folder: Path) -> None:
        self.names: list[str] = []
        with suppress(OSError):
            self.names = os.listdir(folder)[:MOST_FILES]  # noqa: PTH208 - names are all that is needed
        self.answers = [name for name in self.names if may_answer(name)]
        self.owner = partial(owner_of, platform=platform_of(self.names))

    def owner_by_begin(self, name: str, asking: str) -> str:
        """The student, with an answer file, whose name a file begins with; empty for nobody."""
        # Beside a student's only answer file a .txt is a table, and nobody's by its name.
        is_table = name != asking and list(filter(is_answer, self.answers)) == [asking]
        students = {self.owner(each).label for each in self.answers if not (is_table and each == name)}
        owner = self.owner(name)
        if owner.platform and (owner.label in students or self.owner(asking).platform):
            return owner.label
        folded = name.casefold()
        rests = {each: folded.removeprefix(each.casefold()) for each in students}
        begun = [each for each, rest in rests.items() if rest != folded and not rest[:1].isalnum()]
        return max(begun, key=len, default="")
