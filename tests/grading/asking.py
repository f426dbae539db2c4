"""Keys and outcomes of one kind of answers, as the tests of several kinds ask for them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import rigidcli
from rigidcli.document.syntax import read_tree
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.question import Question
from rigidcli.grading.selftest import REMARKS


class Same(Kind):
    """A kind whose answer must be its key."""

    name = "same"

    def read_key(self, asked: Any) -> Any:
        return asked.value

    def read_answer(self, key: Any, answer: Tree, folder: Path) -> Tree:
        return answer

    def judge(self, key: Any, answer: Tree) -> Outcome:
        return correct() if answer == key else wrong(Finding("outside_tolerance", detail=f"read {answer}"))

    def is_right(self, key: Any, answer: Tree) -> bool:
        return bool(answer == key)

    def right_forms(self, key: Any) -> Iterator[tuple[str, Tree]]:
        yield "the key", key


@dataclass(frozen=True)
class Asking:
    """Questions of the kind of this name."""

    kind: str

    def literal(self, answer: Any, **options: Any) -> Any:
        """The key of a literal answer."""
        question = Question.model_validate({"kind": self.kind, "answer": answer, **options})
        return KINDS[self.kind].read_key(Asked(question, answer))

    def computed(self, text: str, ask: str, unit: str = "", **options: Any) -> Any:
        """The key of a result, which has this unit, of the document in a text."""
        question = Question.model_validate({"kind": self.kind, "document": "x.yaml", "ask": ask, **options})
        document = rigidcli.loads(text)
        study, *way = ask.split(".")
        report = getattr(rigidcli, study)(document)
        value = report.tree()
        for step in way:
            value = value[int(step)] if step.isdecimal() else value[step]
        return KINDS[self.kind].read_key(Asked(question, value, unit, (study, *way), document, report))

    def judged(self, key: Any, answer: Any) -> Outcome:
        """What comes of an answer, be it one or not."""
        try:
            return judged_alone(self.kind, key, answer)
        except Unreadable as unreadable:
            return unreadable.outcome


def judged_alone(kind: str, key: Any, answer: Any, folder: Path = Path()) -> Outcome:
    """What comes of an answer. Raises Unreadable."""
    judge = KINDS[kind]
    return judge.judge(key, judge.read_answer(key, answer, folder))


def codes(outcome: Outcome) -> list[str]:
    """The codes of what was found."""
    return [finding.code for finding in outcome.findings]


def require_examples(kind: str, key: Any, *, alone: bool = True) -> set[str | None]:
    """The codes of the examples of a key: each is judged as it was made, and where `alone`, nothing more."""
    seen = set[str | None]()
    for example in KINDS[kind].examples(key):
        outcome = judged_alone(kind, key, example.answer)
        found = codes(outcome)
        assert (outcome.verdict == "correct") == (example.code in (None, *REMARKS)), example
        assert example.code is None or example.code in found, example
        assert len(set(found)) <= 1 or not alone, (example, found)
        seen.add(example.code)
    return seen


def rows(values: Any) -> list[list[str]]:
    """A table of numbers, as typed with all digits."""
    return [[repr(float(value)) for value in row] for row in values]


def tolerance(relative: float | None) -> dict[str, Any]:
    """The option of a question for a relative tolerance; none for the default."""
    return {} if relative is None else {"tolerance": {"relative": relative}}


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


def answers(table: str, *more: Any) -> pytest.MarkDecorator:
    """The same where the last cells are answers as they stand in a file: read, and not worked out."""
    return cases(table, *more, read=lambda text: read_tree(text, "", typed=True))
