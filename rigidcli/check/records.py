"""The marks of a hand-in, question by question, and what each level of feedback says of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import ROUND_HALF_UP, Decimal
from functools import cache

import orjson
from pydantic import TypeAdapter

from rigidcli.check import Feedback
from rigidcli.check.base import CODES, Finding, Outcome, Verdict
from rigidcli.errors import printable, shortened

PLACES = 6
"""Decimal places of a score: shares such as 1/3 need an end."""

MISSING = Outcome("missing", 0.0)
"""The outcome of a student, or a question, without an answer."""

UNREAD = frozenset(["parse_error", "unknown_symbol", "too_large"])
"""What is said of parts of an answer that cannot be read, such as one of several equations."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One question of a hand-in: the `answer` as it was typed, `read_as`, how it was read, and its mark."""

    id: str
    title: str
    answer: str
    read_as: str
    verdict: Verdict
    score: float
    max_score: float
    findings: tuple[Finding, ...] = ()

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the findings, without repetition, in their order."""
        return tuple(dict.fromkeys(finding.code for finding in self.findings))

    @property
    def sentences(self) -> list[str]:
        """What is said of the answer, one sentence a finding."""
        return [sentence(finding) for finding in self.findings]

    @property
    def message(self) -> str:
        """The sentences, one a line."""
        return "\n".join(self.sentences)

    @property
    def reading(self) -> str:
        """How the answer was read, where that says more than what was typed."""
        return "" if "".join(self.read_as.split()) == "".join(self.answer.split()) else self.read_as

    @property
    def is_urgent(self) -> bool:
        """Whether a person must look at it first: it is not judged, or not read, or not all of it is read."""
        loses = self.verdict in ("partial", "incorrect") and not UNREAD.isdisjoint(self.codes)
        return loses or self.verdict in ("review", "invalid")

    def overridden(self, score: float, reason: str) -> Judged:
        """The question as a person has judged it."""
        verdict: Verdict = "correct" if score >= self.max_score else "partial" if score > 0 else "incorrect"
        return replace(self, verdict=verdict, score=score, findings=(Finding("overridden", detail=reason),))


def judged(
    id: str, title: str, points: float, outcome: Outcome, answer: str = "", read_as: str = ""
) -> Judged:
    """A question with the points that its outcome earns."""
    score = round(outcome.share * points, PLACES)
    return Judged(id, title, answer, read_as, outcome.verdict, score, points, outcome.findings)


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a student has handed in, judged; `source` is the answer file, empty where there is none.

    `notes` are for the instructor, and `files` lie beside the answer file, which names them.
    """

    student: str
    source: str
    questions: tuple[Judged, ...]
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    def to_bytes(self) -> bytes:
        """The judgement as one process hands it to another: plain JSON, never objects."""
        return orjson.dumps(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> Judgement:
        """A judgement from another process."""
        return _reader().validate_json(data)

    @property
    def score(self) -> float:
        """Points earned."""
        return round(sum((question.score for question in self.questions), 0.0), PLACES)

    @property
    def max_score(self) -> float:
        """Points that could be earned."""
        return round(sum((question.max_score for question in self.questions), 0.0), PLACES)

    def score_to(self, places: int) -> float:
        """Points earned, rounded half up to so many decimal places, as a gradebook has them."""
        return float(Decimal(str(self.score)).quantize(Decimal(1).scaleb(-places), ROUND_HALF_UP))


@cache
def _reader() -> TypeAdapter[Judgement]:
    return TypeAdapter(Judgement)


def reported(judgement: Judgement, feedback: Feedback) -> Judgement:
    """A hand-in as reports show it, with what waits for a person before the other questions.

    All texts are safe to print, and only the level `full` has references.
    """
    waiting_first = sorted(judgement.questions, key=lambda question: question.verdict != "review")
    return replace(
        judgement,
        student=printable(judgement.student),
        source=printable(judgement.source),
        questions=tuple(_reported(question, feedback) for question in waiting_first),
    )


def _reported(question: Judged, feedback: Feedback) -> Judged:
    findings = question.findings if feedback.reasons else ()
    if feedback is not Feedback.full:
        findings = tuple(replace(finding, reference="") for finding in findings)
    return replace(
        question,
        id=printable(question.id),
        title=printable(question.title),
        answer=printable(question.answer),
        read_as=printable(question.read_as),
        findings=findings,
    )


def sentence(finding: Finding) -> str:
    """What a student reads of a finding."""
    text = f"{finding.place}: {CODES[finding.code]}" if finding.place else CODES[finding.code]
    text = f"{text}; {shortened(finding.detail, 500)}" if finding.detail else text
    return printable(f"{text}; {finding.reference}" if finding.reference else text)
