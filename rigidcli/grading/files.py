"""Untrusted files: which there are, whose they are, and how they are read: regular ones, within bounds."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from rigidcli.errors import Problem, printable, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.roster import submitted

MOST_BYTES = 1_000_000
"""Length of an answer file, and of one beside it."""

MOST_FILES = 50_000
"""Files of one folder, and of those in it, that are looked at: more than any class hands in."""

DEEPEST = 8
"""Levels of folders in a folder that are looked into: a download has one or two."""

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

HIDDEN = (".", "__MACOSX")
"""Beginnings of names that are passed over without a word: some systems put such files beside others."""

ELSEWHERE = frozenset("/\\:\0")
"""Characters by which a name leads out of its folder, on one system or another."""

_FORMS = {
    stat.S_IFLNK: "a link",
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}

_NOT_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)

# Windows has no links to follow or pipes to wait for in opening, and its text mode would change bytes.
_FLAGS = ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY", "O_BINARY")


# --- finding


@dataclass(slots=True)
class Found:
    """The answer `files`, each once; `others` that lie in the same folders; and what is not there."""

    files: list[Path] = field(default_factory=list)
    others: list[Path] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)


def gather(
    paths: Sequence[str | os.PathLike[str]], assignment: str | os.PathLike[str] | None = None
) -> Found:
    """The answer files that are meant by files and folders.

    Of a folder, those in it and in its folders, by name; hidden ones, and the `assignment`, are left out.
    Whatever has the name of an answer file is one, and is judged as one: folders and pipes, too, and links,
    which are not followed.
    """
    found = Found()
    seen = set() if assignment is None else {_spot(Path(assignment))}

    def trouble(path: Path, message: str) -> None:
        found.problems.append(Problem(safe_name(os.fspath(path)), message))

    for given in paths:
        path = Path(given)
        try:
            if not os.fspath(given):
                raise ValueError
            into = path.is_dir() and not _is_answer(path.name)
            path.lstat()
        except (OSError, ValueError) as error:
            trouble(path, _reason(error))
            continue
        inside = list(_walk(path, trouble)) if into else [path]
        if not any(_is_answer(file.name) or not into for file in inside):
            trouble(path, f"no answer files: their names end in {', '.join(sorted(SUFFIXES))}")
        for file in inside:
            if _spot(file) not in seen:
                (found.others if into and not _is_answer(file.name) else found.files).append(file)
                seen.add(_spot(file))
    return found


def _walk(folder: Path, trouble: Callable[[Path, str], None]) -> Iterator[Path]:
    """What there is in a folder and its folders, but for folders that are looked into."""
    left = MOST_FILES
    top = len(folder.parts)
    for name, folders, files in os.walk(
        folder, onerror=lambda error: trouble(Path(error.filename), _reason(error))
    ):
        here = Path(name)
        into = [each for each in sorted(folders) if not each.startswith(HIDDEN) and not _is_answer(each)]
        into = [each for each in into if not (here / each).is_symlink()]
        named = sorted(each for each in {*files, *folders} - {*into} if not each.startswith(HIDDEN))
        if len(here.parts) - top == DEEPEST and into:
            trouble(here, f"not looked into: expected at most {DEEPEST} folders in each other")
            into = []
        if len(named) > left:
            trouble(folder, f"expected at most {MOST_FILES:,} files: the others are left out")
        yield from (here / each for each in named[:left])
        left -= len(named)
        folders[:] = into if left > 0 else []


def _reason(error: Exception) -> str:
    return f"cannot be read: {getattr(error, 'strerror', None) or 'no file has such a name'}"


def _spot(path: Path) -> str:
    """The place of a file, whatever path leads there; no link is followed."""
    return os.path.normpath(path.absolute())


def _is_answer(name: str) -> bool:
    return Path(name).suffix.lower() in SUFFIXES


def safe_name(name: str) -> str:
    """A name of a file, which may hold anything, as a text that is safe to print."""
    return printable(os.fsencode(name).decode(errors="backslashreplace"))


# --- reading


def read_beside(name: Tree, answers: Path) -> str:
    """The text of the file `name` beside the answer file, as `read_file` reads it. Raises Unreadable."""
    return read_file(beside(name, answers), shown(name))


def beside(name: Tree, answers: Path) -> Path:
    """The file that an answer names: beside the file `answers`, or in that folder.

    What Canvas and Moodle have put before its name is seen through. Raises Unreadable: path_outside for a
    name that is a path, and not_allowed for a file of another student.
    """
    if not isinstance(name, str) or not name.strip():
        raise Unreadable("wrong_shape", f"read {shown(name)}, expected the name of a file", place="file")
    wanted: str = name.removeprefix("./")
    if wanted in ("", ".", "..") or not ELSEWHERE.isdisjoint(wanted):
        message = f"read {shown(name)}, expected a name without a folder"
        raise Unreadable("path_outside", message, place="file")
    if answers.is_dir():
        return answers / wanted
    names = names_in(answers.parent)
    student = _student(answers.name)
    if _owner(wanted, answers, names) not in ("", student):
        raise Unreadable("not_allowed", "this file is another student's", place=shown(name))
    if wanted not in names:
        own = {each: submitted(each)[1] for each in names if submitted(each)[0] == student}
        same = [each for each in own if own[each] == wanted]
        same = same or [each for each in own if _uncounted(own[each]) == _uncounted(wanted)]
        # Of several that were handed in under one name, the last.
        wanted = max(same, key=lambda each: (len(each), each), default=wanted)
    return answers.parent / wanted


def names_in(folder: Path) -> list[str]:
    """The names of what lies in a folder, as far as it can be read, in any order."""
    try:
        with os.scandir(folder) as entries:
            return [entry.name for entry in islice(entries, MOST_FILES)]
    except OSError:
        return []


def _student(name: str) -> str:
    """Whose an answer file is by its name alone."""
    return submitted(name)[0] or Path(name).stem


def _owner(name: str, answers: Path, names: Sequence[str]) -> str:
    """Whose a file is by its name, among those who have answer files; empty where it is nobody's."""
    students = {_student(each) for each in names if _is_answer(each)}
    student = submitted(name)[0]
    if student and (student in students or submitted(answers.name)[0]):
        return student
    folded = name.casefold()
    begun = [each for each in students if folded.startswith(each.casefold())]
    begun = [each for each in begun if not folded[len(each.casefold()) :][:1].isalnum()]
    return max(begun, key=len, default="")


def is_contested(file: Path, answers: Path) -> bool:
    """Whether the answer file of another student names a file that is nobody's by its name."""
    names = names_in(answers.parent)
    if _owner(file.name, answers, names):
        return False
    named = re.compile(rf"(?<![\w.-]){re.escape(file.name)}(?![\w.-])")
    for other in names:
        if _is_answer(other) and other != answers.name:
            with suppress(Unreadable):
                if named.search(read_file(answers.parent / other)):
                    return True
    return False


def _uncounted(name: str) -> str:
    """A name without the count that Canvas adds where a file is handed in again: `orbit-1.csv`."""
    return re.sub(r"-[0-9]+(?=\.[^.]*$)", "", name).casefold()


def read_file(path: Path, place: str = "") -> str:
    """The UTF-8 text of a regular file.

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
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        wrong = f"not UTF-8 text: byte {error.start} is {data[error.start]:#04x}"
        raise Unreadable("parse_error", wrong, place=place) from None


def _require_regular(found: os.stat_result, place: str) -> None:
    if not stat.S_ISREG(found.st_mode):
        form = _FORMS.get(stat.S_IFMT(found.st_mode), "something else")
        raise Unreadable("not_allowed", f"read {form}, expected a file", place=place)
