"""Keys and outcomes of one kind of answers, as the tests of several kinds ask for them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rigidcli
from rigidcli.grading import kinds
from rigidcli.grading.asked import Asked
from rigidcli.grading.outcome import Outcome, Unreadable
from rigidcli.grading.question import Question


@dataclass(frozen=True)
class Asking:
    """Questions of the kind of this name."""

    kind: str

    def literal(self, answer: Any, **options: Any) -> Any:
        """The key of a literal answer."""
        question = Question.model_validate({"kind": self.kind, "answer": answer, **options})
        return kinds.kind(self.kind).read_key(Asked(question, answer))

    def computed(self, text: str, ask: str, unit: str = "", **options: Any) -> Any:
        """The key of a result, which has this unit, of the document in a text."""
        question = Question.model_validate({"kind": self.kind, "document": "x.yaml", "ask": ask, **options})
        document = rigidcli.loads(text)
        study, *way = ask.split(".")
        report = getattr(rigidcli, study)(document)
        value = report.tree()
        for step in way:
            value = value[step]
        return kinds.kind(self.kind).read_key(Asked(question, value, unit, (study, *way), document, report))

    def judged(self, key: Any, answer: Any) -> Outcome:
        """What comes of an answer, be it one or not."""
        try:
            return kinds.kind(self.kind).judge(key, answer, Path())
        except Unreadable as unreadable:
            return unreadable.outcome


def codes(outcome: Outcome) -> list[str]:
    """The codes of what was found."""
    return [finding.code for finding in outcome.findings]


def rows(values: Any) -> list[list[str]]:
    """A table of numbers, as typed with all digits."""
    return [[repr(float(value)) for value in row] for row in values]


def tolerance(relative: float | None) -> dict[str, Any]:
    """The option of a question for a relative tolerance; none for the default."""
    return {} if relative is None else {"tolerance": {"relative": relative}}
