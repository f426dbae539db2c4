"""Judgements -> text, piece by whole piece."""

from __future__ import annotations

from dataclasses import dataclass

from rigidcli.homework import Feedback


@dataclass(frozen=True, slots=True)
class Style:
    """How results look: how much students read, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken. With `late`, csv and json say which
    hand-ins are late: they do where any is.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False
    late: bool = False
