"""The door of judging, as the tests of all kinds of answers go through it, and tables of answers."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import rigidcli
from rigidcli.check.assignment import prepare
from rigidcli.check.base import Outcome, Tree
from rigidcli.check.judge import Item, outcome
from rigidcli.document.syntax import read_tree

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
    return read_tree(text, "", typed=True)


def table(text: str, read: Callable[[str], Any] = typed) -> pytest.MarkDecorator:
    """The cases of a test: a line of names, then lines of cells, with bars between them.

    The last cell of a line holds several values, two blanks or more apart, and each is a case. A line
    without a bar goes on with the one before.
    """
    head, *lines = (line.strip() for line in text.strip().splitlines())
    names, found, first = head.split(" | "), list[Any](), list[str]()
    for line in lines:
        if line.startswith("# "):
            continue
        *cells, last = (cell.strip() for cell in re.split(r"(?:^|\s)\|(?=\s|$)", line))
        first = cells or first
        found += [(*first, read(value)) for value in re.split(r"\s{2,}", last) if value]
    return pytest.mark.parametrize(names, found)
