"""Untrusted files: opened where they are regular ones, and nothing else, and read within bounds."""

from __future__ import annotations

import errno
import os
import re
import stat
from contextlib import suppress
from pathlib import Path

from rigidcli.errors import shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable

MOST_BYTES = 1_000_000
"""Length of an answer file, and of one beside it."""

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

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


_HANDED_IN = re.compile(
    r"(?P<name>[^_]+)_(?:LATE_)?(?P<id>[0-9]+)_[0-9]+_(?P<own>.+)"
    r"|(?P<moodle>.+?)_assignsubmission_[a-z]+_(?P<file>.+)",
    re.DOTALL,
)


def handed_in(name: str) -> tuple[str, str]:
    """The student whose file has this name in a download of Canvas or Moodle, and the name it had before.

    `doejane_4711_98765_orbit.csv`, also with `LATE_` before the numbers: the first of these is the student's.
    `Jane Doe_4711_assignsubmission_file_orbit.csv`. Of any other name the student is empty.
    """
    found = _HANDED_IN.fullmatch(name)
    if found is None:
        return "", name
    if found["file"]:
        return found["moodle"], found["file"]
    return f"{found['name']}_{found['id']}", found["own"]


def read_beside(name: Tree, beside: Path) -> str:
    """The text of the file `name` beside an answer file, or in a folder, as `read_file` reads it.

    Beside an answer file that Canvas or Moodle has renamed, it is looked for under the new name, too. Raises
    Unreadable: also path_outside, for a name that is a path; and not_allowed, for a file of another student.
    """
    if not isinstance(name, str) or not name.strip():
        raise Unreadable("wrong_shape", f"read {shown(name)}, expected the name of a file", place="file")
    name = name.removeprefix("./")
    if name in ("", ".", "..") or not ELSEWHERE.isdisjoint(name):
        message = f"read {shown(name)}, expected a name without a folder"
        raise Unreadable("path_outside", message, place="file")
    if beside.is_dir():
        return read_file(beside / name, shown(name))
    return read_file(beside.with_name(_name_beside(name, beside)), shown(name))


def _name_beside(name: str, answer: Path) -> str:
    """The name that a file of this name has beside an answer. Raises Unreadable for that of another student.

    Of another student is what Canvas or Moodle names so, or what begins as another answer file does.
    """
    with suppress(OSError):
        there = [path.name for path in answer.parent.iterdir()]
        student, _ = handed_in(answer.name)
        if student:
            own = [(each, handed_in(each)[1]) for each in there if handed_in(each)[0] == student]
            # Canvas tells a file that is handed in again by a number: `orbit-1.csv`.
            stem, dot, ending = name.rpartition(".")
            again = re.compile(rf"{re.escape(stem)}-[0-9]+{re.escape(dot + ending)}")
            fitting = [each for each, before in own if before == name]
            fitting = fitting or [each for each, before in own if again.fullmatch(before)]
            if len(fitting) > 1:
                raise Unreadable("missing_file", "several files of yours have this name", place=shown(name))
            if fitting:
                return fitting[0]
        answers = [Path(each) for each in there if Path(each).suffix.lower() in SUFFIXES]
        owner, _ = handed_in(name)
        others = {handed_in(each.name)[0] for each in answers} | ({owner} if student else set())
        stems = {each.stem.casefold() for each in (*answers, answer)}
        heading = [stem for stem in stems if re.match(rf"{re.escape(stem)}(?![^\W_])", name.casefold())]
        is_headed = bool(heading) and max(heading, key=len) != answer.stem.casefold()
        if is_headed or owner in others - {"", student}:
            raise Unreadable("not_allowed", "the file belongs to another student's answer", place=shown(name))
    return name


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
