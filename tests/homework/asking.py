"""The door of judging, as the tests of all kinds of answers go through it, and tables of cases."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import rigidcli
from rigidcli.document.yaml_reader import read_tree
from rigidcli.homework.assignment import prepare
from rigidcli.homework.base import Outcome, Tree
from rigidcli.homework.judge import Item, outcome

STUDIES = {name: getattr(rigidcli, name) for name in ("inertia", "axes", "precess", "euler", "hamilton")}


def asked(question: Mapping[str, Any] | str, document: str = "") -> Item:
    """A question that is ready to judge; what it asks is asked of the `document` in a text."""
    return _asked(question if isinstance(question, str) else json.dumps(question), document)


@cache
def _asked(question: str, document: str) -> Item:
    with tempfile.TemporaryDirectory() as folder:
        text = f"questions: {{q: {question}}}"
        if document:
            (Path(folder) / "document.yaml").write_text(document, encoding="utf-8")
            text = text.replace("{ask:", "{document: document.yaml, ask:").replace(
                '{"ask":', '{"document": "document.yaml", "ask":'
            )
        return prepare(f"{folder}/homework.yaml", STUDIES, text).items["q"]


def judged(item: Item, answer: Tree) -> Outcome:
    """What comes of an answer, as it was typed."""
    return outcome(item, answer, Path("answers.yaml"))[0]


def codes(of: Outcome) -> list[str]:
    """The codes of what is said."""
    return [finding.code for finding in of.findings]


def told(of: Outcome) -> str:
    """The codes of what is said, with their places."""
    return " ".join(f"{each.code}@{each.place}".rstrip("@").replace(" ", "-") for each in of.findings)


def typed(text: str) -> Tree:
    """An answer as an answer file has it."""
    return read_tree(text, "", is_text=lambda path: True)


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
        outcome = judged(item, answer)
        return " ".join([outcome.verdict, *dict.fromkeys(codes(outcome))])


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
    names, rows, first = head.split(" | "), list[Any](), tuple[str, ...]()
    for line in lines:
        if not line.startswith("# "):
            *others, last = re.split(r"\s\|(?=\s|$)", line)
            first = tuple(map(str.strip, others)) or first
            values = [read(value) for value in re.split(r"\s{2,}", last.strip()) if value]
            rows += [(*first, value) for value in values] if len(names) > 1 else values
    return pytest.mark.parametrize(names if len(names) > 1 else head, [*rows, *more])
