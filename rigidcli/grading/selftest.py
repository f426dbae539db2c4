"""An assignment held against itself: its keys, the same in other forms, and its own named mistakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rigidcli.errors import printable
from rigidcli.grading.judge import Item, outcome
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Outcome

REMARKS = ("chaotic_divergence_after_horizon", "second_order_form")
"""Codes that are said of right answers, too."""


@dataclass(frozen=True, slots=True)
class Trial:
    """An example, made from the key of the question `id`, and what came of judging it."""

    id: str
    example: Example
    outcome: Outcome

    @property
    def passed(self) -> bool:
        """Whether the example is judged as what it was made to be."""
        right, code = self.outcome.verdict == "correct", self.example.code
        if code is None:
            return right
        if code not in [finding.code for finding in self.outcome.findings]:
            return False
        return code == "accepted" or right == (code in REMARKS)


def trials(items: Mapping[str, Item]) -> Iterator[Trial]:
    """Every example of every key, judged, and every further answer that a question accepts."""
    for id, item in items.items():
        # What a question gives for a finding, and for other answers, says nothing of the key.
        plain = replace(item, credit="parts", accepted=())
        for example in item.kind.examples(item.key):
            yield Trial(id, example, outcome(plain, example.answer, Path()))
        for other in item.accepted:
            if (form := item.kind.typed(other.key)) is not None:
                yield Trial(id, Example("accepted", form, "accepted"), outcome(item, form, Path()))


def told(trials: list[Trial]) -> str:
    """What came of it: a line for each question, and one for each example that is not judged as made."""
    lines = []
    for id in dict.fromkeys(trial.id for trial in trials):
        own = [trial for trial in trials if trial.id == id]
        right = sum(trial.example.code is None for trial in own)
        lines.append(
            f"{printable(id)}: {right} right and {len(own) - right} wrong answers, made from the key"
        )
        for trial in own:
            if not trial.passed:
                wanted = trial.example.code or "correct"
                codes = " ".join(finding.code for finding in trial.outcome.findings)
                got = " ".join(filter(None, [trial.outcome.verdict, codes]))
                lines.append(
                    f"  not judged as made: {printable(trial.example.what)}: expected {wanted}, read {got}"
                )
    failed = sum(not trial.passed for trial in trials)
    lines.append(
        f"{len(trials)} examples, " + (f"{failed} not judged as made" if failed else "all judged as made")
    )
    return "".join(f"{line}\n" for line in lines)
