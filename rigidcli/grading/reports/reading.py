"""Files of an instructor that outputs are compared with or filled into."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from rigidcli.errors import DocumentError, Problem

MAX_BYTES = 50_000_000
"""Bytes of a file that is read: those of the largest classes, and no disk image named by mistake."""


def read_bytes(path: str | os.PathLike[str]) -> tuple[bytes, str]:
    """The bytes of a regular file, bounded, and its name as messages tell it. Raises DocumentError."""
    name = os.fsencode(path).decode(errors="backslashreplace")
    try:
        found = Path(path).stat()
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "not a regular file")
        if found.st_size > MAX_BYTES:
            raise OSError(errno.EFBIG, f"too long, expected at most {MAX_BYTES:,} bytes")
        return Path(path).read_bytes(), name
    except OSError as error:
        raise DocumentError([Problem(name, f"cannot be read: {error.strerror or error}")]) from None
