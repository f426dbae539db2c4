"""How an answer is read without its question: for students who check a file before they hand it in."""

from __future__ import annotations

import re
from pathlib import Path

from rigidcli.check.base import Tree, Unreadable
from rigidcli.check.files import beside, read_file
from rigidcli.check.reading import describe
from rigidcli.errors import shortened, shown

LONGEST = 200
"""Characters of a description."""

_WORDS = re.compile(r"[\w\s,.;'<>-]*[^\W\d_]{3}[\w\s,.;'<>-]*")
"""Words, which may be the answer to a question with a choice."""


def described(answer: Tree | Unreadable, path: Path) -> str:
    """An answer in the file at `path`, as it is read. Raises Unreadable where no question reads it."""
    if isinstance(answer, Unreadable):
        raise answer
    if answer is None or (isinstance(answer, str) and not answer.strip()):
        return "no answer"
    if isinstance(answer, dict) and answer.keys() & {"file", "csv"}:
        text = str(answer.get("csv", ""))
        if "file" in answer:
            text = read_file(beside(answer["file"], path), shown(answer["file"]), table=True)
        head, *rows = [line for line in text.splitlines() if line.strip()] or [""]
        return f"a table with {len(rows)} rows below `{shortened(head, LONGEST)}`"
    try:
        return f"read as {shortened(describe(answer), LONGEST)}"
    except Unreadable:
        if isinstance(answer, str) and _WORDS.fullmatch(answer):
            return f"{shown(answer)} as it is typed: how it is read depends on the question"
        raise
