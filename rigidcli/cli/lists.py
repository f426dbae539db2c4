"""`@files.txt` among FILES: the names in a list, where there are more of them than a shell can pass on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from rigidcli.errors import UsageError

LIST = "@"
"""What begins the name of a list; `./@name` is a file whose own name begins so."""

COMMENT = "#"
"""What begins a line of a list that is for people."""


def names_in(file: str) -> Iterator[str]:
    """The name of a file, or those in a list: one on a line, blanks within it included.

    Blanks round a name, empty lines and comments are passed over. `@-` is standard input. Raises UsageError.
    """
    if not file.startswith(LIST):
        yield file
        return
    name = file.removeprefix(LIST)
    try:
        if name == "-" and sys.stdin is None:
            raise OSError
        data = sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no file has such a name"
        hint = f"it lists names of files, one on a line; a file of this name is `./{file}`"
        raise UsageError(f"`{file}` cannot be read: {reason}", hint=hint) from None
    lines = (os.fsdecode(line).strip() for line in data.removeprefix(b"\xef\xbb\xbf").splitlines())
    names = [line for line in lines if line and not line.startswith(COMMENT)]
    if not names:
        raise UsageError(f"`{file}` lists no files", hint="one name on a line")
    yield from names
