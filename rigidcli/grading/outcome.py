"""What comes of judging one answer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

Verdict: TypeAlias = Literal["review", "correct", "partial", "incorrect", "invalid", "missing"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""As they are told: what waits for a person, then from the best to the worst."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing to say of an answer.

    `place` names the part that is meant (`Ixy`, `row 2`), `detail` says more of what was read: neither may
    hold, or lead to, a reference value. `reference` may, and is told at the level `full` only.
    """

    code: str
    place: str = ""
    detail: str = ""
    reference: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The verdict on one answer, the share (0 to 1) of its points that it earns, and what to say of it."""

    verdict: Verdict
    share: float
    findings: tuple[Finding, ...] = field(default=())


def correct(*remarks: Finding) -> Outcome:
    """A right answer, perhaps with remarks."""
    return Outcome("correct", 1.0, remarks)


def wrong(*findings: Finding, share: float = 0.0) -> Outcome:
    """A wrong answer, or one that is right in part when it earns a share."""
    return Outcome("partial" if share > 0 else "incorrect", share, findings)


def earning(share: float, *findings: Finding) -> Outcome:
    """An answer that earns a share of its points, whatever it is."""
    return correct(*findings) if share == 1 else wrong(*findings, share=share)


def review(detail: str, *findings: Finding) -> Outcome:
    """An answer of which it cannot be told whether it is right, with the reason."""
    return Outcome("review", 0.0, (Finding("undecided", detail=detail), *findings))


MISSING = Outcome("missing", 0.0)
"""The outcome of a question without an answer."""


class Unreadable(Exception):  # noqa: N818 - it is findings on the way to their outcome
    """What was handed in is no answer of the kind that is asked.

    `also` are further findings, so that all problems of an answer are told at once.
    """

    def __init__(self, code: str, detail: str = "", *, place: str = "", also: Iterable[Finding] = ()) -> None:
        super().__init__(detail)
        self.finding = Finding(code, place, detail)
        self.findings = (self.finding, *also)

    @classmethod
    def of(cls, first: Finding, *others: Finding) -> Unreadable:
        """All that is wrong with an answer."""
        return cls(first.code, first.detail, place=first.place, also=others)

    @property
    def outcome(self) -> Outcome:
        """The outcome of an answer that cannot be read."""
        return Outcome("invalid", 0.0, self.findings)
