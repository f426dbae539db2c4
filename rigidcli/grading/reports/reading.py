"""Files of an instructor that outputs are compared with or filled into."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from rigidcli.errors import DocumentError, Problem

MAX_BYTES = 50_000_000


def read_bytes(path: str | os.PathLike[str], source: str) -> bytes:
    """The bytes of a regular file, bounded. Raises DocumentError."""
    try:
        # A FIFO or device named by mistake is refused, not waited for.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        with os.fdopen(descriptor, "rb") as file:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise DocumentError([Problem(source, "cannot be read: not a regular file")])
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise DocumentError([Problem(source, f"cannot be read: {error.strerror or error}")]) from None
    if len(data) > MAX_BYTES:
        raise DocumentError([Problem(source, f"too long, expected at most {MAX_BYTES:,} bytes")])
    return data


def name_of(path: str | os.PathLike[str]) -> str:
    """The name of a file, which may have bytes that are no text."""
    return os.fsencode(Path(path)).decode(errors="backslashreplace")
