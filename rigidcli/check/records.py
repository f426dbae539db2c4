"""The marks of a hand-in, question by question, and what each level of feedback says of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import ROUND_HALF_UP, Decimal
from typing import Literal

import orjson

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
class _Marked:
    """One question of a hand-in: the `answer` as it was typed, and `read_as`, how it was read."""

    id: str
    title: str
    answer: str
    read_as: str
    verdict: Verdict
    score: float
    max_score: float


@dataclass(frozen=True, slots=True)
class Judged(_Marked):
    """One question as it was judged."""

    findings: tuple[Finding, ...] = ()

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the findings, without repetition, in their order."""
        return tuple(dict.fromkeys(finding.code for finding in self.findings))


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
        tree = orjson.loads(data)
        for entry in tree["questions"]:
            entry["findings"] = tuple(Finding(**finding) for finding in entry["findings"])
        questions = tuple(Judged(**entry) for entry in tree["questions"])
        return cls(tree["student"], tree["source"], questions, tuple(tree["notes"]), tuple(tree["files"]))

    @property
    def score(self) -> float:
        """Points earned."""
        return round(sum(question.score for question in self.questions), PLACES)

    @property
    def max_score(self) -> float:
        """Points that could be earned."""
        return round(sum(question.max_score for question in self.questions), PLACES)

    def score_to(self, places: int) -> float:
        """Points earned, rounded half up to so many decimal places, as a gradebook has them."""
        return float(Decimal(str(self.score)).quantize(Decimal(1).scaleb(-places), ROUND_HALF_UP))


@dataclass(frozen=True, slots=True)
class Remark:
    """One sentence on an answer, with its code."""

    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class Reported(_Marked):
    """One question as students and reports see it."""

    feedback: tuple[Remark, ...]

    @property
    def is_urgent(self) -> bool:
        """Whether a person must look at it first: it is not judged, or not read, or not all of it is read."""
        loses = self.verdict in ("partial", "incorrect") and not UNREAD.isdisjoint(self.codes)
        return loses or self.verdict in ("review", "invalid")

    @property
    def reading(self) -> str:
        """How the answer was read, where that says more than what was typed."""
        return "" if "".join(self.read_as.split()) == "".join(self.answer.split()) else self.read_as

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the remarks, without repetition, in their order."""
        return tuple(dict.fromkeys(remark.code for remark in self.feedback))

    @property
    def message(self) -> str:
        """The sentences of the remarks, one a line."""
        return "\n".join(remark.message for remark in self.feedback)


@dataclass(frozen=True, slots=True)
class Student:
    """A hand-in as reports show it: the fields, and their order, are those of `rigidcli.check/1`."""

    schema: Literal["rigidcli.check/1"]
    student: str
    source: str
    score: float
    max_score: float
    questions: tuple[Reported, ...]


def reported(judgement: Judgement, feedback: Feedback) -> Student:
    """A hand-in with all texts safe to print, and what waits for a person before the other questions."""
    waiting_first = sorted(judgement.questions, key=lambda question: question.verdict != "review")
    return Student(
        "rigidcli.check/1",
        printable(judgement.student),
        printable(judgement.source),
        float(judgement.score),
        float(judgement.max_score),
        tuple(_reported(question, feedback) for question in waiting_first),
    )


def _reported(question: Judged, feedback: Feedback) -> Reported:
    full = feedback is Feedback.full
    remarks = [Remark(each.code, printable(sentence(each, full=full))) for each in question.findings]
    return Reported(
        printable(question.id),
        printable(question.title),
        printable(question.answer),
        printable(question.read_as),
        question.verdict,
        float(question.score),
        float(question.max_score),
        tuple(remarks) if feedback.reasons else (),
    )


def sentence(finding: Finding, *, full: bool = False) -> str:
    """What a student reads of a finding; the reference only at the level `full`."""
    text = f"{finding.place}: {CODES[finding.code]}" if finding.place else CODES[finding.code]
    text = f"{text}; {shortened(finding.detail, 500)}" if finding.detail else text
    return f"{text}; {finding.reference}" if full and finding.reference else text


def overridden(question: Judged, score: float, reason: str) -> Judged:
    """The question as a person has judged it."""
    verdict: Verdict = "correct" if score >= question.max_score else "partial" if score > 0 else "incorrect"
    return replace(question, verdict=verdict, score=score, findings=(Finding("overridden", detail=reason),))
