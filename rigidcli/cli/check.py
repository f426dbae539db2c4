"""The command `check`: judgements as text in a format, as pages, or in a gradebook, and the notes on them."""

# Annotations here are objects, not texts: typer reads them.

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

import rigidcli
from rigidcli.check import Feedback
from rigidcli.cli.failures import Failures, complain, progress, tell_notes
from rigidcli.cli.options import NoHeader, OutputPath, Quiet, listed
from rigidcli.cli.output import Folder, Output
from rigidcli.errors import UsageError
from rigidcli.render import Look

if TYPE_CHECKING:
    from rigidcli.check.assignment import Prepared
    from rigidcli.check.base import Judgement
    from rigidcli.check.files import Place
    from rigidcli.check.reports import Style
    from rigidcli.document.document import Document
    from rigidcli.report import Report

    View: TypeAlias = Callable[[Iterator[Judgement], Style], Iterator[str]]

NOT_CORRECT = 1
"""The exit code if any answer is judged not to be correct."""


CheckFormat = StrEnum("CheckFormat", "table json csv junit gradescope html")
"""The output formats of judgements."""


TABULAR = {
    "--items": ("table", "json", "csv"),
    "--regrade": ("table",),
    "--canvas": ("table", "csv"),
    "--selftest": ("table",),
}
"""The formats of each option that prints something else than judgements; a gradebook is csv in both."""


def studies(steps: bool = False) -> "dict[str, Callable[[Document], Report]]":
    """The studies that work out keys, each loaded when it is first asked; their reports may have steps."""

    def of(name: str) -> "Callable[[Document], Report]":
        return lambda document: getattr(rigidcli, name)(document, steps=steps)

    return {name: of(name) for name in rigidcli.STUDIES}


def _file(option: str, metavar: str, help: str) -> typer.models.OptionInfo:
    """An option that names a file."""
    declared: typer.models.OptionInfo = typer.Option(option, metavar=metavar, help=help)
    return declared


def check(
    assignment: Annotated[str, typer.Argument(metavar="ASSIGNMENT", help="The questions and their keys.")],
    answers: Annotated[
        list[str] | None,
        typer.Argument(metavar="ANSWERS", help="Answer files, folders, or a zip; `@files.txt` lists names."),
    ] = None,
    format: Annotated[CheckFormat, typer.Option("-f", "--format", help="What to print.")] = CheckFormat.table,
    output: OutputPath = None,
    feedback: Annotated[
        Feedback, typer.Option("--feedback", help="How much students read; reference values only in full.")
    ] = Feedback.hint,
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, max=1024, metavar="N", help="Processes.")
    ] = None,
    items: Annotated[
        bool, typer.Option("--items", help="What the class made of each question, instead of each student.")
    ] = False,
    regrade: Annotated[
        str | None, _file("--regrade", "OLD.json", "What changes in a run that `-f json` has written.")
    ] = None,
    canvas: Annotated[
        str | None, _file("--canvas", "EXPORTED.csv", "Fill a gradebook that Canvas has exported.")
    ] = None,
    column: Annotated[
        str | None, _file("--column", "NAME", "Its column, if not named like the assignment.")
    ] = None,
    roster: Annotated[
        str | None, _file("--roster", "FILE.csv", "Who the students are; all of them get a row.")
    ] = None,
    overrides: Annotated[
        str | None,
        _file("--overrides", "FILE.csv", "A person's scores over these: student,question,score,reason."),
    ] = None,
    selftest: Annotated[
        bool, typer.Option("--selftest", help="Show each key, judge it, and tell which mistakes are named.")
    ] = False,
    steps: Annotated[
        bool, typer.Option("--steps", help="Solutions of the questions, too; with --feedback full.")
    ] = False,
    no_header: NoHeader = False,
    quiet: Quiet = False,
) -> None:
    """Judge answer files (homework).

    Example: rigidcli check homework.yaml answers/ -f csv -o scores.csv
    """
    answers, lists = listed(answers or ())
    chosen = {"--items": items, "--regrade": regrade, "--canvas": canvas, "--selftest": selftest}
    views = [option for option, given in chosen.items() if given]
    if len(views) > 1:
        raise typer.BadParameter(f"{' and '.join(views)} exclude each other")
    if bool(answers) == selftest:
        wrong = "--selftest takes no ANSWERS" if selftest else "expected ANSWERS: files, or folders of them"
        raise typer.BadParameter(wrong)
    if views and format not in TABULAR[views[0]]:
        raise typer.BadParameter(f"{views[0]} has no other format than {', '.join(TABULAR[views[0]])}")
    shows_steps = format in (CheckFormat.table, CheckFormat.html) and not views
    if steps and (feedback is not Feedback.full or not shows_steps):
        raise typer.BadParameter("--steps shows the keys: it is for table and html with --feedback full")
    if column is not None and canvas is None:
        raise typer.BadParameter("--column is for --canvas")
    failures = Failures()
    with (
        failures.of(assignment),
        _target(format, output, feedback) as target,
        tempfile.TemporaryDirectory(prefix="rigidcli-") as scratch,
    ):
        from rigidcli.check import files
        from rigidcli.check import roster as students
        from rigidcli.check.assignment import prepare
        from rigidcli.check.base import MISSING
        from rigidcli.check.judge import run
        from rigidcli.check.judge import selftest as test_keys
        from rigidcli.check.reports import Style

        prepared = prepare(assignment, studies(steps))
        target.protect(*prepared.files, *filter(None, (regrade, canvas, roster, overrides)), *lists)
        for note in () if quiet else prepared.notes:
            complain(str(note))
        if selftest:
            for words, is_right in test_keys(prepared.items, prepared.questions):
                target.write(words)
                failures.code = max(failures.code, 0 if is_right else NOT_CORRECT)
            raise typer.Exit(failures.code)
        width, colour = target.terminal()
        style = Style(feedback, not no_header, width, colour)
        remarks = Remarks(quiet)
        view = view_of(format, items, regrade, canvas, column or prepared.title, quiet)
        if format is CheckFormat.html:
            view = pages(prepared, remarks.kept, target, steps=steps)
        batch = files.gather(answers, assignment, Path(scratch))
        target.protect(*(place.file for place in batch.answers))
        known = None if roster is None else students.read_roster(roster)
        person = None if overrides is None else students.read_overrides(overrides, prepared.worth)
        papers, notes = students.papers(batch, known)
        # Gradescope waits for a result of those, too, who have handed in nothing.
        unhanded = format is CheckFormat.gradescope and not papers
        if unhanded:
            papers = [students.Paper(Path(answers[0]).stem, outcome=MISSING)]
        for problem in batch.problems:
            complain(str(problem))
            remarks.kept.append(str(problem))
            failures.code = max(failures.code, NOT_CORRECT if unhanded else UsageError.exit_code)
        remarks.tell(roster or prepared.source, notes)
        with progress() as show:
            judgements = run(prepared.items, papers, jobs, show)
            late = list[str]()
            if person is not None:
                judgements = students.overridden(judgements, person, late)
            judged = noted(judgements, batch.others, prepared.source, failures, remarks, target)
            for piece in view(judged, style):
                target.write(piece)
            remarks.tell(overrides or "", late)
        for piece in solutions(prepared, width, colour) if steps and format is CheckFormat.table else ():
            target.write(piece)
    raise typer.Exit(failures.code)


def _target(format: CheckFormat, path: str | None, feedback: Feedback) -> Output:
    """Where results go; for pages, it may be a folder. Raises UsageError where that is not clear."""
    if format is not CheckFormat.html or path in (None, "-"):
        return Output(path)
    place = Path(str(path))
    named = str(path).endswith((os.sep, os.altsep or os.sep))
    if place.exists() and named and not place.is_dir():
        raise UsageError(f"`{path}` is a file, and no folder", hint=f"`-o {place}` writes one page into it")
    if not (named or place.exists() or place.suffix):
        hint = f"`-o {path}/` writes a page for each student, too, `-o {path}.html` the class on one page"
        raise UsageError(f"`{path}` may be a file or a folder", hint=hint)
    if not (named or place.is_dir()):
        return Output(path)
    if feedback is Feedback.none:
        hint = f"`--feedback verdict` tells them more; `-o {place}.html` writes the class on one page"
        raise UsageError("`--feedback none` leaves nothing to say on the pages of students", hint=hint)
    return Folder(str(path))


class Remarks:
    """Notes on files and students: printed, unless the user wants none, and kept for a page."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self.kept = list[str]()

    def tell(self, source: str, notes: Sequence[str]) -> None:
        """Print the notes on a source, and keep them."""
        tell_notes(source, notes, self._quiet)
        self.kept += [f"{source}: {note}" for note in notes]


def pages(prepared: "Prepared", remarks: Sequence[str], target: Output, *, steps: bool) -> "View":
    """The function that turns judgements into the page of a class, or into those of a folder."""
    from rigidcli.check.reports import pages as report

    solutions = report.worked(prepared.solutions) if steps else {}
    course = report.Course(prepared.title, remarks, solutions)
    if not isinstance(target, Folder):
        return lambda judgements, style: report.one_page(judgements, course, style)

    def fill(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
        for name, content in report.pages(judgements, course, style):
            target.begin(name)
            yield content

    return fill


def solutions(prepared: "Prepared", width: int | None, colour: bool) -> Iterator[str]:
    """The working of the questions whose keys come from documents, each after its name."""
    from rigidcli.render.table import render

    for id, report in prepared.solutions.items():
        yield "\n"
        named = replace(report, name=f"{id}, {report.name}")
        yield from render([named], Look(width=width, colour=colour, steps=True))


def noted(
    judgements: "Iterator[Judgement]",
    others: "Sequence[Place]",
    source: str,
    failures: Failures,
    remarks: Remarks,
    target: Output,
) -> "Iterator[Judgement]":
    """The judgements, whose notes are printed, and whose verdicts decide the exit code.

    `others` are files beside the answers, which are listed in the end, if no answer names them.
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
) -> "View":
    """The function that turns judgements into text; other files that it needs are read at once."""
    if items:
        from rigidcli.check.reports import items as report

        return lambda judgements, style: report.TEXTS[format](report.tally(judgements), style)
    if regrade is not None:
        from rigidcli.check.reports.items import changes, run_of

        return partial(changes, run_of(regrade))
    if canvas is not None:
        from rigidcli.check.reports import canvas as gradebook
        from rigidcli.check.reports import read

        text, source = read(canvas)

        def fill(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
            # Who has handed in nothing gets no score.
            filled = gradebook.fill(text, (each for each in judgements if each.source), column)
            tell_notes(source, filled.notes, quiet)
            yield filled.text

        return fill
    from rigidcli.check.reports.formats import render

    return partial(render, format)
