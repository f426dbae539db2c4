"""Judgements as text in a format, as pages, or in a gradebook, and the notes on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from rigidcli.cli.failures import Failures, tell_notes
from rigidcli.cli.output import Folder, Output
from rigidcli.render import Look

if TYPE_CHECKING:
    from rigidcli.check.assignment import Prepared
    from rigidcli.check.files import Place
    from rigidcli.check.records import Judgement
    from rigidcli.check.reports import Style

    View: TypeAlias = Callable[[Iterator[Judgement], Style], Iterator[str]]

NOT_CORRECT = 1
"""The exit code if any answer is judged not to be correct."""


CheckFormat = StrEnum("CheckFormat", "table json csv junit gradescope html")
"""The output formats of judgements."""


class Remarks:
    """Notes on files and students: printed, unless the user wants none, and kept for a page."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self.told = list[str]()

    def tell(self, source: str, notes: Sequence[str]) -> None:
        """Tell the notes on a source."""
        tell_notes(source, notes, self._quiet)
        self.told += [f"{source}: {note}" for note in notes]


def pages(prepared: Prepared, remarks: Sequence[str], target: Output, *, steps: bool) -> View:
    """The function that turns judgements into the page of a class, or into those of a folder."""
    from rigidcli.check.reports import pages as report

    solutions = report.worked(prepared.solutions) if steps else {}
    course = report.Course(prepared.title, remarks, solutions)
    if not isinstance(target, Folder):
        return lambda judgements, style: report.one_page(judgements, course, style)

    def fill(judgements: Iterator[Judgement], style: Style) -> Iterator[str]:
        for name, content in report.pages(judgements, course, style):
            target.begin(name)
            yield content

    return fill


def solutions(prepared: Prepared, width: int | None, colour: bool) -> Iterator[str]:
    """The working of the questions whose keys come from documents, each after its name."""
    from rigidcli.render.table import render

    for id, report in prepared.solutions.items():
        yield "\n"
        named = replace(report, name=f"{id}, {report.name}")
        yield from render([named], Look(width=width, colour=colour, steps=True))


def noted(
    judgements: Iterator[Judgement],
    others: Sequence[Place],
    source: str,
    failures: Failures,
    remarks: Remarks,
    target: Output,
) -> Iterator[Judgement]:
    """The judgements, whose notes are printed, and whose verdicts decide the exit code.

    `others` are files beside the answers, which are told in the end, if no answer names them.
    """
    from rigidcli.check.files import noted

    named = set[str]()
    for judgement in judgements:
        remarks.tell(judgement.source, judgement.notes)
        if any(question.verdict != "correct" for question in judgement.questions):
            failures.code = max(failures.code, NOT_CORRECT)
        beside = [str(Path(judgement.source).parent / name) for name in judgement.files]
        target.protect(*beside)
        named.update(beside)
        yield judgement
    unused = [str(Path(*Path(place.source).parts[-2:])) for place in others if place.source not in named]
    remarks.tell(source, noted("no answer files, and left out", unused))


def view_of(
    format: CheckFormat, items: bool, regrade: str | None, canvas: str | None, column: str, quiet: bool
) -> View:
    """The function that turns judgements into text; other files that it needs are read at once."""
    if items:
        from rigidcli.check.reports import items as report

        return lambda judgements, style: report.TEXTS[format](report.tally(judgements), style)
    if regrade is not None:
        from rigidcli.check.reports import regrade as again

        old = again.read(regrade)
        return lambda judgements, style: again.table(again.changes(old, judgements), style)
    if canvas is not None:
        from rigidcli.check.reports import canvas as gradebook
        from rigidcli.check.reports import read

        text, source = read(canvas)

        def fill(judgements: Iterator[Judgement], style: Style) -> Iterator[str]:
            # Who has handed in nothing gets no score.
            filled = gradebook.fill(text, (each for each in judgements if each.source), column)
            tell_notes(source, filled.notes, quiet)
            yield filled.text

        return fill
    from rigidcli.check.reports.formats import render

    return partial(render, format)
