"""Homework: the questions of an assignment, the answers handed in, their judgement and the feedback."""

from __future__ import annotations

from enum import StrEnum


class Feedback(StrEnum):
    """How much of the judgement students read, the same in every format.

    `none` hides all that is meant for students, though scores and verdicts stay in json and csv.
    `verdict` says whether an answer is right, `hint` also what is wrong with it, and `full` also what
    was expected.
    """

    none = "none"
    verdict = "verdict"
    hint = "hint"
    full = "full"

    @property
    def reasons(self) -> bool:
        """Whether it says what is wrong with an answer."""
        return self in (Feedback.hint, Feedback.full)
