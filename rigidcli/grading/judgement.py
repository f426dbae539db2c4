"""The outcome of a whole answer file, and its way through a pipe between processes."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

import orjson

from rigidcli.grading.outcome import Finding, Outcome, Verdict

PLACES = 6
"""Decimal places of a score."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One question of one answer file. `answer` is a short text, the same for the same wrong answer."""

    id: str
    verdict: Verdict
    score: float
    max_score: float
    findings: tuple[Finding, ...] = ()
    answer: str = ""

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the findings."""
        return tuple(finding.code for finding in self.findings)


@dataclass(frozen=True, slots=True)
class Sheet:
    """What an answer file holds: its questions, and `notes` for the instructor on the rest of it.

    `files` are those beside it that it names.
    """

    questions: tuple[Judged, ...]
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a student has handed in: `source` is the path of the answer file, empty where there is none.

    `files` are the names of those beside it that it names.
    """

    student: str
    source: str
    questions: tuple[Judged, ...]
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    @property
    def score(self) -> float:
        """Points earned."""
        return round(sum(question.score for question in self.questions), PLACES)

    def score_to(self, places: int) -> float:
        """Points earned, rounded half up to so many decimal places, as a gradebook has them."""
        return float(Decimal(str(self.score)).quantize(Decimal(1).scaleb(-places), ROUND_HALF_UP))

    @property
    def max_score(self) -> float:
        """Points that could be earned."""
        return round(sum(question.max_score for question in self.questions), PLACES)


def judged(id: str, points: float, outcome: Outcome, answer: str = "") -> Judged:
    """A question with the points that its outcome earns."""
    return Judged(
        id, outcome.verdict, round(outcome.share * points, PLACES), points, outcome.findings, answer
    )


def to_bytes(sheet: Sheet) -> bytes:
    """A sheet as a process hands it to another: plain JSON, never objects."""
    return orjson.dumps(sheet)


def from_bytes(data: bytes) -> Sheet:
    """A sheet from another process."""
    tree = orjson.loads(data)
    return Sheet(tuple(map(_judged, tree["questions"])), tuple(tree["notes"]), tuple(tree["files"]))


def _judged(entry: dict[str, Any]) -> Judged:
    return Judged(**entry | {"findings": tuple(Finding(**finding) for finding in entry["findings"])})
