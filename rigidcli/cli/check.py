"""The command `check`."""

# Annotations here are objects, not texts: typer reads them.

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

import rigidcli
from rigidcli.cli.failures import Failures, complain
from rigidcli.cli.judgements import (
    NOT_CORRECT,
    CheckFormat,
    Remarks,
    noted,
    pages,
    run_selftest,
    solutions,
    view_of,
)
from rigidcli.cli.options import NoHeader, OutputPath, Quiet, listed
from rigidcli.cli.output import Folder, Output
from rigidcli.cli.progress import progress
from rigidcli.cli.sweeps import Jobs, named_hands
from rigidcli.errors import UsageError
from rigidcli.grading import Feedback

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.grading.judgement import Judgement
    from rigidcli.grading.reports import Style
    from rigidcli.report import Report

    View: TypeAlias = Callable[[Iterator[Judgement], Style], Iterator[str]]


TABULAR = {
    "--items": ("table", "json", "csv"),
    "--regrade": ("table", "json", "csv"),
    "--canvas": ("table", "csv"),
    "--selftest": ("table",),
}
"""The formats of each option that prints something else than judgements; a gradebook is csv in both."""


def studies(steps: bool = False) -> "dict[str, Callable[[Document], Report]]":
    """The studies that work out keys, each loaded when it is first asked; their reports may have steps."""

    def of(name: str) -> "Callable[[Document], Report]":
        return lambda document: getattr(rigidcli, name)(document, steps=steps)

    return {name: of(name) for name in rigidcli.STUDIES}


def check(
    assignment: Annotated[str, typer.Argument(metavar="ASSIGNMENT", help="The questions and their keys.")],
    answers: Annotated[
        list[str] | None,
        typer.Argument(metavar="ANSWERS", help="Answer files, or folders; `@files.txt` lists names."),
    ] = None,
    format: Annotated[CheckFormat, typer.Option("-f", "--format", help="What to print.")] = CheckFormat.table,
    output: OutputPath = None,
    feedback: Annotated[
        Feedback, typer.Option("--feedback", help="How much is told; reference values only by full.")
    ] = Feedback.hint,
    jobs: Jobs = None,
    items: Annotated[
        bool, typer.Option("--items", help="What the class made of each question, instead of each student.")
    ] = False,
    regrade: Annotated[
        str | None,
        typer.Option(
            "--regrade", metavar="OLD.json", help="What changes in a run that `-f json` has written."
        ),
    ] = None,
    canvas: Annotated[
        str | None,
        typer.Option("--canvas", metavar="EXPORTED.csv", help="Fill a gradebook that Canvas has exported."),
    ] = None,
    column: Annotated[
        str | None,
        typer.Option("--column", metavar="NAME", help="Its column, if not named like the assignment."),
    ] = None,
    roster: Annotated[
        str | None,
        typer.Option(
            "--roster", metavar="FILE.csv", help="Who the students are; without a file, they get a row, too."
        ),
    ] = None,
    selftest: Annotated[
        bool, typer.Option("--selftest", help="Judge the keys themselves, their forms and named mistakes.")
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
    hands = named_hands(jobs)
    if isinstance(hands, str):
        reason = "homework is judged on this machine: expected a number of processes"
        raise typer.BadParameter(reason, param_hint="'--jobs'")
    failures = Failures()
    with failures.of(assignment), _target(format, output, feedback) as target:
        from rigidcli.grading import batch, files
        from rigidcli.grading import roster as students
        from rigidcli.grading.assignment import prepare
        from rigidcli.grading.outcome import MISSING
        from rigidcli.grading.reports import Style

        prepared = prepare(assignment, studies(steps))
        target.protect(*prepared.files, *filter(None, (regrade, canvas, roster)), *lists)
        for note in () if quiet else prepared.notes:
            complain(str(note))
        if selftest:
            run_selftest(prepared, target, failures)
        else:
            width, colour = target.terminal()
            style = Style(feedback, not no_header, width, colour)
            remarks = Remarks(quiet)
            view = view_of(format, items, regrade, canvas, column or prepared.title, quiet)
            if format is CheckFormat.html:
                view = pages(prepared, remarks.told, target, steps=steps)
            found = files.gather(answers, assignment)
            target.protect(*found.files)
            known = None if roster is None else students.read_roster(roster)
            papers, notes = students.papers(found.files, known)
            # Gradescope waits for a result of those, too, who have handed in nothing.
            unhanded = format is CheckFormat.gradescope and not papers
            if unhanded:
                papers = [students.Paper(Path(answers[0]).stem if answers else "", None, MISSING)]
            for problem in found.problems:
                complain(str(problem))
                remarks.told.append(str(problem))
                failures.code = max(failures.code, NOT_CORRECT if unhanded else UsageError.exit_code)
            remarks.tell(roster or prepared.source, notes)
            with progress() as show:
                # On a terminal, the results themselves show the progress.
                seen = (lambda fraction: None) if width else show
                judgements = batch.run(prepared.items, papers, hands, seen)
                others = [files.safe_name(str(file)) for file in found.others]
                judged = noted(judgements, others, prepared.source, failures, remarks, target)
                for piece in view(judged, style):
                    target.write(piece)
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
