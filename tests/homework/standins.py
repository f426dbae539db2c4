"""A kind of answer that stands for any, where what is tested is all around the kinds."""

from __future__ import annotations

from typing import Any

from rigidcli.homework.base import AnswerKind, Finding, Judged, KeySource, Outcome, ReadAnswer, Tree, Verdict


class Same(AnswerKind):
    """A kind whose answer must be its key."""

    name = "same"

    def key(self, source: KeySource) -> Any:
        return source.value

    def read(self, key: Any, answer: Tree) -> ReadAnswer:
        return ReadAnswer(answer, f"read {answer}")

    def judge(self, key: Any, value: Any) -> Outcome:
        return (
            Outcome.correct()
            if value == key
            else Outcome.earning(0.0, Finding("outside_tolerance", detail=f"read {value}"))
        )

    def typed(self, key: Any) -> Tree:
        return key


def mark(
    id: str, verdict: Verdict, score: float, most: float, findings: tuple[Finding, ...] = (), answer: str = ""
) -> Judged:
    """A judged question without a title, whose answer was read as it stands."""
    return Judged(id, "", answer, answer, verdict, score, most, findings)


def waiting(id: str, most: float) -> Judged:
    """A question whose answer waits for a person."""
    return mark(id, "review", 0.0, most, Outcome.review("it may be singular").findings)
