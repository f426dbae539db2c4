"""What a student is told of what was found in an answer: the one door from findings to outputs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING

from rigidcli.errors import printable

if TYPE_CHECKING:
    from rigidcli.grading.judgement import Judged
    from rigidcli.grading.outcome import Finding


LONGEST_DETAIL = 500
"""Characters of what more is said of an answer."""


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
    return tuple(Remark(each.code, printable(sentence(each, full=full))) for each in question.findings)


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


def codes(told: tuple[Remark, ...]) -> tuple[str, ...]:
    """The codes of remarks, each once, in their order."""
    return tuple(dict.fromkeys(remark.code for remark in told))
