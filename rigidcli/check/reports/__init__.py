"""Judgements -> text, piece by whole piece."""

from __future__ import annotations

import errno
import os
import stat
from dataclasses import dataclass
from pathlib import Path

from rigidcli.check import Feedback
from rigidcli.errors import DocumentError, Problem

MAX_BYTES = 50_000_000
"""Bytes of an instructor's file: those of the largest classes, and no disk image named by mistake."""


@dataclass(frozen=True, slots=True)
class Style:
    """How results look: how much students read, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False


def read(path: str | os.PathLike[str]) -> tuple[str, str]:
    """The text of an instructor's file, bounded, and its name for messages. Raises DocumentError."""
    name = os.fsencode(path).decode(errors="backslashreplace")
    try:
        found = Path(path).stat()
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "not a regular file")
        if found.st_size > MAX_BYTES:
            raise OSError(errno.EFBIG, f"too long, expected at most {MAX_BYTES:,} bytes")
        data = Path(path).read_bytes()
        return data.decode(), name
    except OSError as error:
        raise DocumentError([Problem(name, f"cannot be read: {error.strerror or error}")]) from None
    except UnicodeDecodeError as error:
        message = f"not UTF-8 text: byte {error.start} is {data[error.start]:#04x}"
        raise DocumentError([Problem(name, message, hint="export it again, or save it as UTF-8")]) from None
