"""The text of a file, a pipe or standard input, which is untrusted."""

from __future__ import annotations

import csv
import errno
import io
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

from rigidcli.errors import DocumentError, Problem, ValueProblem, printable

MAX_BYTES = 2_000_000  # the longest text in UTF-8, which takes about half a second to read
# How a file begins that Git LFS has put in place of a large one.
LFS_POINTER = b"version https://git-lfs.github.com/spec/"
# What is said of such a file, and the cure.
_LFS_PROBLEM = "a pointer of Git LFS, expected the file itself", "`git lfs pull` fetches it"
STDIN = "-"  # the name of a file that stands for standard input

# The endings of meshes and solids that are not read; a file with one of them is refused.
NOT_READ = frozenset(
    [".3ds", ".3mf", ".amf", ".blend", ".dae", ".fbx", ".gltf", ".iges", ".igs", ".step", ".stp", ".wrl"]
)
CONVERT_HINT = "save it as STL in the program that made it, or in one that converts meshes"

# The kinds of binary files, by the bytes with which they begin.
BINARY_FILES = {
    b"%PDF": "a PDF",
    b"PK\x03\x04": "a document of Word or another office program, or an archive (zip)",
    b"\xd0\xcf\x11\xe0": "a document of an old office program",
    b"{\\rtf": "rich text (RTF)",
    b"\x1f\x8b": "a compressed file (gzip)",
    **dict.fromkeys((b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*"), "a picture"),
}
_PLAIN_TEXT = (
    "copy the text into a plain text file, such as cube.yaml; `rigidcli new` prints one to start from"
)
# What is said of files that are no texts, and the cures, by the bytes with which they begin.
_NO_TEXTS = {LFS_POINTER: _LFS_PROBLEM} | {
    begin: (f"this is {kind}, expected plain text", _PLAIN_TEXT) for begin, kind in BINARY_FILES.items()
}
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # how a text in UTF-16 begins, as `>` of PowerShell writes it


def ending(name: str) -> str:
    """The ending of the name of a file, in small letters, such as `.stl`."""
    return os.path.splitext(name)[1].lower()  # noqa: PTH122 - a PurePath takes ten times as long


def safe_name(name: str | os.PathLike[str]) -> str:
    """A name of a file, which may hold anything, as a text that is safe to print."""
    return printable(os.fsencode(name).decode(errors="backslashreplace"))


def read_text(name: str, source: str, most: int = MAX_BYTES, fallback: str | None = None) -> str:
    """The text of a regular file, a pipe or standard input, of at most so many bytes. Raises DocumentError.

    With a `fallback`, a text that is not in UTF-8 or UTF-16 is in that encoding. A mark at the beginning of
    UTF-8 then stays.
    """
    hint = None
    if ending(name) in NOT_READ:
        message = f"{ending(name)} is not read, expected a mesh such as .stl, .obj or .glb"
        raise DocumentError([Problem(source, message, hint=CONVERT_HINT)])
    try:
        if name == STDIN:
            if sys.stdin is None:
                raise OSError(errno.EBADF, "standard input is closed")
            data = sys.stdin.buffer.read(most + 1)
        else:
            # A pipe without a writer, or a device, named by mistake is refused, not waited for.
            descriptor = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
            with os.fdopen(descriptor, "rb") as file:
                mode = os.fstat(descriptor).st_mode
                if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
                    raise OSError(errno.EINVAL, "not a regular file")
                data = _of_pipe(file, most) if stat.S_ISFIFO(mode) else file.read(most + 1)
        require_bounded(data, source, most)
        for begin, (message, cure) in _NO_TEXTS.items():
            if data.startswith(begin):
                raise DocumentError([Problem(source, message, hint=cure)])
        usual = "utf-8" if fallback else "utf-8-sig"
        return data.decode("utf-16" if data.startswith(_UTF_16) else usual)
    except OSError as error:
        message = f"cannot be read: {error.strerror or error}"
    except UnicodeDecodeError as error:
        if fallback and b"\0" not in data:
            return data.decode(fallback, errors="replace")
        message = f"not UTF-8 text: byte {error.start} is {data[error.start]:#04x}"
        hint = "save the file as UTF-8 in the editor, or with `iconv -f ENCODING -t UTF-8`"
        if name == STDIN:
            hint = "a document is text; a mesh is given by the name of its file"
    except ValueError:  # there is a NUL in it
        message = "cannot be read: no file has such a name"
    raise DocumentError([Problem(source, message, hint=hint)])


def _of_pipe(file: io.BufferedReader, most: int) -> bytes:
    """The bytes written to a pipe, as by a process substitution; raises OSError where nobody writes."""
    first = file.raw.read(most + 1)  # None where a writer is there, and has written nothing yet
    if first == b"":
        raise OSError(errno.EPIPE, "nothing is written to this pipe")
    os.set_blocking(file.fileno(), True)
    return (first or b"") + file.read(most + 1)


def require_bounded(data: bytes, source: str, most: int = MAX_BYTES) -> None:
    """Raise DocumentError for a text that is longer."""
    if len(data) > most:
        hint = "many points are read faster from a .csv or .npy file: `points: cloud.npy`"
        message = f"too long, expected at most {most:,} bytes"
        raise DocumentError([Problem(source, message, hint=hint, code="too_large")])


def csv_rows(path: str | os.PathLike[str]) -> Iterator[tuple[int, list[str]]]:
    """The rows of a table that are not empty, each with its line; the first one has the heads.

    Raises ValueProblem, without the name of the file, where it cannot be read.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:  # noqa: PTH123 - as typed
            rows = csv.reader(file)
            for row in rows:
                if any(cells := [cell.strip() for cell in row]):
                    yield rows.line_num, cells
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no table in UTF-8"
        raise ValueProblem(f"cannot be read: {reason}") from None


@contextmanager
def opened(path: Path) -> Iterator[BufferedReader]:
    """The regular file at `path`, open for reading. Raises ValueProblem where it cannot be read."""
    try:
        if not path.is_file():  # asked before opening: to open a pipe is to wait for its writer
            raise ValueProblem(f"{path}: {'not a regular file' if path.exists() else 'no such file'}")
        with path.open("rb") as file:
            if os.pread(file.fileno(), len(LFS_POINTER), 0) == LFS_POINTER:
                raise ValueProblem(f"{path}: {_LFS_PROBLEM[0]}", hint=_LFS_PROBLEM[1])
            yield file
    except OSError as error:
        raise ValueProblem(f"{path}: cannot be read: {error.strerror or error}") from error
