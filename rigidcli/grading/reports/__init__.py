"""Judgements -> text, piece by whole piece, so that output begins before the last answer file is judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import TypeAlias

from rigidcli.grading.feedback import Feedback
from rigidcli.grading.judgement import Judgement

FORMATS = {
    "table": "rigidcli.grading.reports.table",
    "json": "rigidcli.grading.reports.json",
    "csv": "rigidcli.grading.reports.csv",
    "junit": "rigidcli.grading.reports.junit",
    "gradescope": "rigidcli.grading.reports.gradescope",
}
"""The output formats; each is a module with a function `render`."""


@dataclass(frozen=True, slots=True)
class Style:
    """How results are told: how much of them, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False


Renderer: TypeAlias = Callable[[Iterable[Judgement], Style], Iterator[str]]


def renderer(name: str) -> Renderer:
    """The renderer of a format; only its own module is loaded."""
    render: Renderer = import_module(FORMATS[name]).render
    return render
