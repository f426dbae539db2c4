"""Homework: judging answers, which are untrusted text, against an assignment."""

from __future__ import annotations

from enum import StrEnum


class Feedback(StrEnum):
    """How much is told, the same in every format.

    `none`: nothing that is meant for students, though scores and verdicts stay in json and csv; `verdict`:
    whether an answer is right; `hint`: what is wrong with it, too; `full`: the reference, too.
    """

    none = "none"
    verdict = "verdict"
    hint = "hint"
    full = "full"

    @property
    def reasons(self) -> bool:
        """Whether it is told what is wrong with an answer."""
        return self in (Feedback.hint, Feedback.full)
