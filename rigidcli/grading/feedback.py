"""What a student is told of what was found in an answer: the one door from findings to outputs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from rigidcli.errors import printable

if TYPE_CHECKING:
    from rigidcli.grading.judgement import Judged


class Feedback(StrEnum):
    """How much is told, the same in every format.

    `none`: nothing that is meant for students, though scores and verdicts stay in json and csv; `verdict`:
    whether an answer is right; `hint`: what is wrong with it, too; `full`: the reference, too.
    """

    none = "none"
    verdict = "verdict"
    hint = "hint"
    full = "full"


@dataclass(frozen=True, slots=True)
class Remark:
    """One thing that is told of an answer, harmless to print."""

    code: str
    message: str


def remarks(question: Judged, feedback: Feedback) -> tuple[Remark, ...]:
    """What is told of an answer; reference values only where all is."""
    if feedback in (Feedback.none, Feedback.verdict):
        return ()
    full = feedback is Feedback.full
    return tuple(Remark(finding.code, printable(finding.message(full=full))) for finding in question.findings)


def codes(told: tuple[Remark, ...]) -> tuple[str, ...]:
    """The codes of remarks, each once, in their order."""
    return tuple(dict.fromkeys(remark.code for remark in told))
