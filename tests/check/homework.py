"""Questions of one kind with their answers, through the door of `asking`, and tables with several answers."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from rigidcli.check.base import Outcome
from rigidcli.check.judge import Item
from tests.check.asking import asked, codes, judged


@dataclass(frozen=True)
class Asking:
    """Questions of the kind of this name."""

    kind: str

    def literal(self, answer: Any, **options: Any) -> Item:
        """A question with a literal answer."""
        return asked({"kind": self.kind, "answer": answer, **options})

    def computed(self, document: str, ask: str, **options: Any) -> Item:
        """A question that asks for a result of the document in a text."""
        return asked({"ask": ask, **options}, document)

    def told(self, item: Item, answer: Any) -> str:
        """The verdict with the codes of all findings: `partial missing_equation`."""
        found = judged(item, answer)
        return " ".join([found.verdict, *dict.fromkeys(codes(found))])


def details(outcome: Outcome) -> str:
    """All that is said of an answer below full feedback."""
    return "\n".join(f"{each.place} {each.detail}" for each in outcome.findings)


def cases(table: str, *more: Any, read: Callable[[str], Any] = str) -> pytest.MarkDecorator:
    """The cases of a test, from a table: a line of names, then lines of cells, with bars between them.

    The last cell of a line holds several values, two blanks or more apart: each is a case with the others. A
    line without a bar goes on with the one before, and one that begins with `#` says what follows. In `more`
    are cases that no line can hold.
    """
    head, *lines = (line.strip() for line in table.strip().splitlines())
    names, found, first = head.split(" | "), list[Any](), tuple[str, ...]()
    for line in lines:
        if not line.startswith("# "):
            *others, last = re.split(r"\s\|(?=\s|$)", line)
            first = tuple(map(str.strip, others)) or first
            values = [read(value) for value in re.split(r"\s{2,}", last.strip()) if value]
            found += [(*first, value) for value in values] if len(names) > 1 else values
    return pytest.mark.parametrize(names if len(names) > 1 else head, [*found, *more])
