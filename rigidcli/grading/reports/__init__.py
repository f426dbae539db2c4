"""Judgements -> text, piece by whole piece."""

from __future__ import annotations

from dataclasses import dataclass

from rigidcli.grading import Feedback


@dataclass(frozen=True, slots=True)
class Style:
    """How results are told: how much of them, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False
