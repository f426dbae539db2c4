"""What is told of what was judged: the one door from findings to outputs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal

from rigidcli.errors import printable
from rigidcli.grading import Feedback
from rigidcli.grading.outcome import Verdict

if TYPE_CHECKING:
    from rigidcli.grading.judgement import Judged, Judgement
    from rigidcli.grading.outcome import Finding

LONGEST_DETAIL = 500
"""Characters of what more is said of an answer."""


@dataclass(frozen=True, slots=True)
class Remark:
    """One thing that is told of an answer."""

    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class Told:
    """One question of a student as it is told."""

    id: str
    verdict: Verdict
    score: float
    max_score: float
    feedback: tuple[Remark, ...]

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the remarks, each once, in their order."""
        return tuple(dict.fromkeys(remark.code for remark in self.feedback))

    @property
    def message(self) -> str:
        """The texts of the remarks, one a line."""
        return "\n".join(remark.message for remark in self.feedback)


@dataclass(frozen=True, slots=True)
class Student:
    """An answer file as it is told: the fields, and their order, are those of `rigidcli.check/1`."""

    schema: Literal["rigidcli.check/1"]
    student: str
    source: str
    score: float
    max_score: float
    questions: tuple[Told, ...]


def told(judgement: Judgement, feedback: Feedback) -> Student:
    """An answer file, harmless to print; what waits for a person comes before the other questions."""
    waiting_first = sorted(judgement.questions, key=lambda question: question.verdict != "review")
    return Student(
        "rigidcli.check/1",
        printable(judgement.student),
        printable(judgement.source),
        float(judgement.score),
        float(judgement.max_score),
        tuple(_told(question, feedback) for question in waiting_first),
    )


def _told(question: Judged, feedback: Feedback) -> Told:
    full = feedback is Feedback.full
    remarks = [Remark(each.code, printable(sentence(each, full=full))) for each in question.findings]
    return Told(
        printable(question.id),
        question.verdict,
        float(question.score),
        float(question.max_score),
        tuple(remarks) if feedback.reasons else (),
    )


def sentence(finding: Finding, *, full: bool = False) -> str:
    """What a student reads of a finding; the reference only where all is told."""
    says = sentences()[finding.code]
    text = f"{finding.place}: {says}" if finding.place else says
    text = f"{text}; {finding.detail[:LONGEST_DETAIL]}" if finding.detail else text
    return f"{text}; {finding.reference}" if full and finding.reference else text


@cache
def sentences() -> dict[str, str]:
    """The sentence of every code. It loads the table of mistakes, and with it what they are made of."""
    from rigidcli.grading.codes import CODES
    from rigidcli.grading.mistakes import MISTAKES

    return CODES | {mistake.code: mistake.says for mistake in MISTAKES}
