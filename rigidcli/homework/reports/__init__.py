"""Judgements -> text, piece by whole piece."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rigidcli.errors import DocumentError, Problem
from rigidcli.homework import Feedback


@dataclass(frozen=True, slots=True)
class Style:
    """How results look: how much students read, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken. With `late`, csv and json say which
    hand-ins are late: they do where any is.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False
    late: bool = False


def read(path: str | os.PathLike[str]) -> tuple[str, str]:
    """The text of an instructor's file, and its name for messages. Raises DocumentError."""
    name = os.fsencode(path).decode(errors="backslashreplace")
    try:
        return Path(path).read_bytes().decode(), name
    except OSError as error:
        raise DocumentError([Problem(name, f"cannot be read: {error.strerror or error}")]) from None
    except UnicodeDecodeError as error:
        message = f"not UTF-8 text: byte {error.start} is {error.object[error.start]:#04x}"
        raise DocumentError([Problem(name, message, hint="export it again, or save it as UTF-8")]) from None
