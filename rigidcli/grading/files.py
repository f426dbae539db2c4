"""Untrusted files: opened where they are regular ones, and nothing else, and read within bounds."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from rigidcli.errors import shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable

MOST_BYTES = 1_000_000
"""Length of an answer file, and of one beside it."""

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


def read_beside(name: Tree, folder: Path) -> str:
    """The text of the file `name` in `folder`, as `read_file` reads it.

    Raises Unreadable: also path_outside, for a name that is a path.
    """
    if not isinstance(name, str) or not name.strip():
        raise Unreadable("wrong_shape", f"read {shown(name)}, expected the name of a file", place="file")
    name = name.removeprefix("./")
    if name in ("", ".", "..") or not ELSEWHERE.isdisjoint(name):
        message = f"read {shown(name)}, expected a name without a folder"
        raise Unreadable("path_outside", message, place="file")
    return read_file(folder / name, shown(name))


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
