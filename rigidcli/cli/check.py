"""The command `check`."""

# Annotations here are objects, not texts: typer reads them.

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

import rigidcli
from rigidcli.cli.failures import Failures, complain, tell_notes
from rigidcli.cli.options import NoHeader, OutputPath, Quiet, listed
from rigidcli.cli.output import Folder, Output
from rigidcli.cli.progress import progress
from rigidcli.cli.sweeps import Jobs, named_hands
from rigidcli.errors import UsageError
from rigidcli.grading import Feedback
from rigidcli.render import Look

if TYPE_CHECKING:
    from rigidcli.grading.assignment import Prepared
    from rigidcli.grading.batch import Elsewhere
    from rigidcli.grading.judgement import Judgement
    from rigidcli.grading.reports import Style
    from rigidcli.model.document import Document
    from rigidcli.report import Report

    View: TypeAlias = Callable[[Iterator[Judgement], Style], Iterator[str]]

NOT_CORRECT = 1
"""The exit code if any answer is judged not to be correct."""

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


class CheckFormat(StrEnum):
    """The output formats of judgements."""

    table = "table"
    json = "json"
    csv = "csv"
    junit = "junit"
    gradescope = "gradescope"
    html = "html"


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
            _selftest(prepared, target, failures)
        else:
            width, colour = target.terminal()
            style = Style(feedback, not no_header, width, colour)
            remarks = _Remarks(quiet)
            view = _view(format, items, regrade, canvas, column or prepared.title, quiet)
            if format is CheckFormat.html:
                view = _pages(prepared, remarks.told, target, steps=steps)
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
                here, elsewhere = (None, _cluster(hands)) if isinstance(hands, str) else (hands, None)
                judgements = batch.run(prepared.items, papers, here, seen, elsewhere=elsewhere)
                others = [files.safe_name(str(file)) for file in found.others]
                judged = _noted(judgements, others, prepared.source, failures, remarks, target)
                for piece in view(judged, style):
                    target.write(piece)
            for piece in _solutions(prepared, width, colour) if steps and format is CheckFormat.table else ():
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


def _cluster(address: str) -> "Elsewhere":
    """What has answer files judged by the workers of the cluster at an address."""
    from rigidcli.cli.plan import ordered
    from rigidcli.grading.afar import everywhere

    return partial(everywhere, partial(ordered, jobs=address))


class _Remarks:
    """Notes on files and students: printed, unless the user wants none, and kept for a page."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self.told = list[str]()

    def tell(self, source: str, notes: Sequence[str]) -> None:
        """Tell the notes on a source."""
        tell_notes(source, notes, self._quiet)
        self.told += [f"{source}: {note}" for note in notes]


def _pages(prepared: "Prepared", remarks: Sequence[str], target: Output, *, steps: bool) -> "View":
    """The function that turns judgements into the page of a class, or into those of a folder."""
    from rigidcli.grading.reports import classroom, sheet

    solutions = sheet.worked(prepared.solutions) if steps else {}
    course = sheet.Course(prepared.title, remarks, solutions)
    if not isinstance(target, Folder):
        return lambda judgements, style: classroom.one_page(judgements, course, style)

    def fill(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
        for name, content in classroom.pages(judgements, course, style):
            target.begin(name)
            yield content

    return fill


def _solutions(prepared: "Prepared", width: int | None, colour: bool) -> Iterator[str]:
    """The working of the questions whose keys come from documents, each after its name."""
    from rigidcli.render.table import render

    for id, report in prepared.solutions.items():
        yield "\n"
        named = replace(report, name=f"{id}, {report.name}")
        yield from render([named], Look(width=width, colour=colour, steps=True))


def _noted(
    judgements: "Iterator[Judgement]",
    others: Sequence[str],
    source: str,
    failures: Failures,
    remarks: "_Remarks",
    target: Output,
) -> "Iterator[Judgement]":
    """The judgements, whose notes are printed, and whose verdicts decide the exit code.

    `others` are files beside the answers, which are told in the end, if no answer names them.
    """
    from rigidcli.grading.roster import noted

    named = set[str]()
    for judgement in judgements:
        remarks.tell(judgement.source, judgement.notes)
        if any(question.verdict != "correct" for question in judgement.questions):
            failures.code = max(failures.code, NOT_CORRECT)
        beside = [str(Path(judgement.source).parent / name) for name in judgement.files]
        target.protect(*beside)
        named.update(beside)
        yield judgement
    unused = [str(Path(*Path(file).parts[-2:])) for file in others if file not in named]
    remarks.tell(source, noted("no answer files, and left out", unused))


def _view(
    format: CheckFormat, items: bool, regrade: str | None, canvas: str | None, column: str, quiet: bool
) -> "View":
    """The function that turns judgements into text; other files that it needs are read at once."""
    if items:
        from rigidcli.grading.reports import items as report

        return lambda judgements, style: report.TEXTS[format](report.tally(judgements), style)
    if regrade is not None:
        from rigidcli.grading.reports import regrade as again

        old = again.read(regrade)
        return lambda judgements, style: again.TEXTS[format](
            again.changes(old, judgements, style.feedback), style
        )
    if canvas is not None:
        from rigidcli.grading.reports import canvas as gradebook

        text, source = gradebook.read(canvas), canvas

        def fill(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
            # Who has handed in nothing gets no score.
            filled = gradebook.fill(text, (each for each in judgements if each.source), column)
            tell_notes(source, filled.notes, quiet)
            yield filled.text

        return fill
    from rigidcli.grading.reports.formats import render

    return partial(render, format)


def _selftest(prepared: "Prepared", target: Output, failures: Failures) -> None:
    from rigidcli.grading.selftest import told, trials

    done = list(trials(prepared.items))
    target.write(told(done))
    if not all(trial.passed for trial in done):
        failures.code = max(failures.code, NOT_CORRECT)
