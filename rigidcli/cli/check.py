"""The command `check`: judgements as text in a format, as pages, or in a gradebook, and the notes on them."""

# Annotations here are objects, not texts: typer reads them.

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

import rigidcli
from rigidcli.cli.failures import Failures, complain, progress, tell_notes
from rigidcli.cli.options import NoHeader, OutputPath, Quiet, format_option, listed, whole
from rigidcli.cli.output import Folder, Output, is_folder
from rigidcli.errors import UsageError
from rigidcli.homework import Feedback

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.homework.assignment import Prepared
    from rigidcli.homework.base import Judgement
    from rigidcli.homework.files import Place
    from rigidcli.homework.reports import Style
    from rigidcli.report import Report

    Fill: TypeAlias = Callable[[Iterator[Judgement], Mapping[str, Sequence[str]]], tuple[str, Sequence[str]]]
    View: TypeAlias = Callable[[Iterator[Judgement], Style], Iterator[str]]

NOT_CORRECT = 1
"""The exit code if any answer is judged not to be correct."""


CheckFormat = StrEnum("CheckFormat", "table json csv junit gradescope html")
"""The output formats of judgements."""


TABULAR = {
    "--items": ("table", "json", "csv"),
    "--regrade": ("table",),
    "--canvas": ("table", "csv"),
    "--moodle": ("table", "csv"),
    "--wide": ("table", "csv"),
    "--selftest": ("table",),
    "--sheets": ("table", "html", "csv"),
}
"""The formats of each option that prints something else than judgements.

Gradebooks and wide rows are csv in both of their formats; sheets are pages in html, unless csv is asked for.
"""


def studies(steps: bool = False) -> "dict[str, Callable[[Document], Report]]":
    """The studies that work out keys; their reports may have steps."""
    return {name: partial(getattr(rigidcli, name), steps=steps) for name in rigidcli.STUDIES}


def _file(name: str, metavar: str, help: str) -> Any:
    """An option that names a file or a column."""
    return typer.Option(name, metavar=metavar, help=help)


LEVELS = "How much students read; reference values only in full."
ITEMS = "What the class made of each question, instead of each student."
OLD = "What changes in a run that `-f json` has written."
MOODLE = "Fill a grading worksheet that Moodle has exported."
COLUMN = "The column of the gradebook, if not named like the assignment."
WIDE = "A row of csv for each student, with a column for each question."
OVERRIDES = "A person's scores over these: student,question,score,reason."
KEYS = "Show each key, judge it, and list the mistakes that are named."

Form = Annotated[CheckFormat, format_option(CheckFormat)]
Level = Annotated[Feedback, typer.Option("--feedback", help=LEVELS)]
Jobs = Annotated[int | None, typer.Option("-j", "--jobs", parser=whole, metavar="N", help="Processes.")]
Items = Annotated[bool, typer.Option("--items", help=ITEMS)]
Regrade = Annotated[str | None, _file("--regrade", "OLD.json", OLD)]
Canvas = Annotated[
    str | None, _file("--canvas", "EXPORTED.csv", "Fill a gradebook that Canvas has exported.")
]
Moodle = Annotated[str | None, _file("--moodle", "WORKSHEET.csv", MOODLE)]
Wide = Annotated[bool, typer.Option("--wide", help=WIDE)]
Column = Annotated[str | None, _file("--column", "NAME", COLUMN)]
Roster = Annotated[str | None, _file("--roster", "FILE.csv", "Who the students are; all of them get a row.")]
Overrides = Annotated[str | None, _file("--overrides", "FILE.csv", OVERRIDES)]
SHEETS = "What each student gets to solve: a page each in -o FOLDER/, or -f csv."
Sheets = Annotated[bool, typer.Option("--sheets", help=SHEETS)]
Selftest = Annotated[bool, typer.Option("--selftest", help=KEYS)]
Steps = Annotated[bool, typer.Option("--steps", help="Solutions on the pages, too; with --feedback full.")]


def check(
    assignment: Annotated[str, typer.Argument(metavar="ASSIGNMENT", help="The questions and their keys.")],
    answers: Annotated[
        list[str] | None,
        typer.Argument(metavar="ANSWERS", help="Answer files, folders, or a zip; `@files.txt` lists names."),
    ] = None,
    format: Form = CheckFormat.table,
    output: OutputPath = None,
    feedback: Level = Feedback.hint,
    jobs: Jobs = None,
    items: Items = False,
    regrade: Regrade = None,
    canvas: Canvas = None,
    moodle: Moodle = None,
    wide: Wide = False,
    column: Column = None,
    roster: Roster = None,
    overrides: Overrides = None,
    selftest: Selftest = False,
    sheets: Sheets = False,
    steps: Steps = False,
    no_header: NoHeader = False,
    quiet: Quiet = False,
) -> None:
    """Judge answer files (homework).

    Example: rigidcli check homework.yaml answers/ -f csv -o scores.csv
    """
    answers, lists = listed(answers or ())
    chosen = {"--items": items, "--regrade": regrade, "--canvas": canvas, "--moodle": moodle, "--wide": wide}
    chosen |= {"--selftest": selftest, "--sheets": sheets}
    views = [option for option, given in chosen.items() if given]
    if len(views) > 1:
        raise typer.BadParameter(f"{' and '.join(views)} exclude each other")
    alone = next((option for option in views if option in ("--selftest", "--sheets")), None)
    if bool(answers) == bool(alone):
        wrong = f"{alone} takes no ANSWERS" if alone else "expected ANSWERS: files, or folders of them"
        raise typer.BadParameter(wrong)
    if views and format not in TABULAR[views[0]]:
        raise typer.BadParameter(f"{views[0]} has no other format than {', '.join(TABULAR[views[0]])}")
    if steps and (feedback is not Feedback.full or format is not CheckFormat.html):
        raise typer.BadParameter("--steps shows the keys: it is for html with --feedback full")
    if sheets and roster is None:
        raise typer.BadParameter("--sheets are for the students of a --roster")
    if selftest and roster is not None:
        raise typer.BadParameter("--selftest takes no --roster")
    if sheets and format is not CheckFormat.csv:
        format = CheckFormat.html
        if not is_folder(output):
            raise typer.BadParameter(
                "--sheets are pages: name a folder for them, as in `-o sheets/`; or -f csv"
            )
    book = canvas or moodle
    if column is not None and book is None:
        raise typer.BadParameter("--column is for --canvas and --moodle")
    failures = Failures()
    if alone:
        with failures.of(assignment), _target(format, output, Feedback.hint) as target:
            code = without_answers(assignment, roster, target, not no_header, quiet)
            failures.code = max(failures.code, code)
        raise typer.Exit(failures.code)
    with (
        failures.of(assignment),
        _target(format, output, feedback) as target,
        tempfile.TemporaryDirectory(prefix="rigidcli-") as scratch,
    ):
        from rigidcli.homework import files, hand_ins
        from rigidcli.homework import roster as students
        from rigidcli.homework.assignment import prepare
        from rigidcli.homework.base import MISSING
        from rigidcli.homework.judge import run
        from rigidcli.homework.reports import Style

        prepared = prepare(assignment, studies(steps))
        target.protect(*prepared.files, *filter(None, (regrade, book, roster, overrides)), *lists)
        for note in () if quiet else prepared.notes:
            complain(str(note))
        width, colour = target.terminal()
        remarks = list[str]()
        remark = partial(_remark, quiet, remarks)
        view = view_of(format, items, regrade, wide)
        fill = gradebook(book, moodle is not None, column, prepared.title) if book else None
        batch = files.gather(answers, assignment, Path(scratch))
        target.protect(*(place.file for place in batch.places))
        # A gradebook is a list of students, too.
        class_list = students.read_roster(listing) if (listing := roster or book) else None
        person = None if overrides is None else students.read_overrides(overrides, prepared.worth, class_list)
        # Gradescope runs this for one student, and waits for a result of those, too, who hand in nothing.
        is_single = format is CheckFormat.gradescope
        papers, notes, others = hand_ins.papers(
            batch,
            None if is_single else class_list,
            prepared.questions,
            jobs,
            one=Path(answers[0]).absolute().stem if is_single else "",
            listing="roster" if roster else "gradebook",
        )
        unhanded = is_single and not papers
        if unhanded:
            papers = [students.Paper(Path(answers[0]).absolute().stem, outcome=MISSING)]
        style = Style(feedback, not no_header, width, colour, any(paper.is_late for paper in papers))
        for problem in batch.problems:
            complain(str(problem))
            remarks.append(str(problem))
            is_small = unhanded or batch.is_whole  # such as an entry of an archive
            failures.code = max(failures.code, NOT_CORRECT if is_small else UsageError.exit_code)
        if book and not roster and prepared.variants is not None:
            hint = "`--roster FILE.csv` is the list of students with which the sheets were made"
            raise UsageError("the values of a student follow from the name in the roster", hint=hint)
        if book and fill and class_list:
            if not batch.is_whole:
                raise UsageError("not all of ANSWERS can be read, and the gradebook is not filled")
            view = partial(filled, book, fill, class_list.aliases, notes, quiet)
        if not papers and not batch.problems:
            raise UsageError("there is no hand-in in ANSWERS", hint="; ".join(notes) or None)
        remark(listing or prepared.source, notes)
        with progress() as show:
            papers, own, said = prepared.for_students(papers, class_list, show)
            remark(prepared.source, said)
            if format is CheckFormat.html:
                view = pages(prepared, remarks, target, steps=steps)
            judgements = run(prepared.items, papers, jobs, show, own=own)
            late = list[str]()
            if person is not None:
                judgements = students.overridden(judgements, person, late)
            judged = noted(judgements, others, prepared.source, failures, remark, target)
            for piece in view(judged, style):
                target.write(piece)
            remark(overrides or "", late)
    raise typer.Exit(failures.code)


def _target(format: CheckFormat, path: str | None, feedback: Feedback) -> Output:
    """Where results go; for pages, it may be a folder. Raises UsageError where that is not clear."""
    if format is not CheckFormat.html or path in (None, "-"):
        return Output(path)
    place = Path(str(path))
    named = str(path).endswith((os.sep, os.altsep or os.sep))
    if not (named or place.exists() or place.suffix):
        hint = f"`-o {path}/` writes a page for each student, too, `-o {path}.html` the class on one page"
        raise UsageError(f"`{path}` may be a file or a folder", hint=hint)
    if not (named or place.is_dir()):
        return Output(path)
    if feedback is Feedback.none:
        hint = f"`--feedback verdict` tells them more; `-o {place}.html` writes the class on one page"
        raise UsageError("`--feedback none` leaves nothing to say on the pages of students", hint=hint)
    return Folder(str(path))


def _remark(quiet: bool, kept: list[str], source: str, notes: Sequence[str]) -> None:
    """Print notes on files and students, unless the user wants none, and keep them for a page."""
    tell_notes(source, notes, quiet)
    kept += [f"{source}: {note}" for note in notes]


def pages(prepared: "Prepared", remarks: Sequence[str], target: Output, *, steps: bool) -> "View":
    """The function that turns judgements into the page of a class, or into those of a folder."""
    from rigidcli.homework.reports import pages as report

    solutions = report.worked(prepared.solutions) if steps else {}
    course = report.Course(prepared.title, remarks, solutions)
    if not isinstance(target, Folder):
        return lambda judgements, style: report.one_page(judgements, course, style)

    def fill(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
        for name, content in report.pages(judgements, course, style):
            target.begin(name)
            yield content

    return fill


def without_answers(assignment: str, roster: str | None, target: Output, header: bool, quiet: bool) -> int:
    """Write the sheets of the students of a roster, or without one test the keys. Returns the exit code."""
    from rigidcli.homework.assignment import prepare
    from rigidcli.homework.judge import selftest

    prepared = prepare(assignment, studies())
    target.protect(*prepared.files, *filter(None, [roster]))
    for note in () if quiet else prepared.notes:
        complain(str(note))
    if roster is not None:
        with progress() as show:
            hand_out(prepared, roster, target, header, show)
        return 0
    code = 0
    for questions in prepared.trials():
        for words, is_right in selftest(questions, prepared.questions):
            target.write(words)
            code = max(code, 0 if is_right else NOT_CORRECT)
    return code


def hand_out(
    prepared: "Prepared",
    roster: str,
    target: Output,
    header: bool,
    progress: Callable[[float], None],
) -> None:
    """Write the sheet of each student of a roster: pages into a folder, or the rows of a table."""
    from rigidcli.homework import roster as students
    from rigidcli.homework.reports import Style
    from rigidcli.homework.reports import sheets as report

    if prepared.variants is None:
        hint = "`rigidcli new assignment` shows how parameters get other values for each student"
        raise UsageError("there are no `variants` in it, and so all sheets would be the same", hint=hint)
    columns, rows = students.read_table(roster)
    people = students.read_roster(roster)
    questions = prepared.own(people.students, progress)
    sheets = [
        report.Sheet(label, prepared.variants.of(people.students[label]), questions[label], rows[place])
        for place, label in people.labels.items()
    ]
    if not isinstance(target, Folder):
        for piece in report.csv(sheets, columns, Style(header=header)):
            target.write(piece)
        return
    for name, content in report.pages(sheets, prepared.title):
        target.begin(name)
        target.write(content)


def noted(
    judgements: "Iterator[Judgement]",
    others: "Sequence[Place]",
    source: str,
    failures: Failures,
    remark: Callable[[str, Sequence[str]], None],
    target: Output,
) -> "Iterator[Judgement]":
    """The judgements, whose notes are printed, and whose verdicts decide the exit code.

    `others` are files beside the answers, which are listed in the end, if no answer names them.
    """
    from rigidcli.homework.files import unnamed

    named = set[str]()
    for judgement in judgements:
        remark(judgement.source, judgement.notes)
        if any(question.verdict != "correct" for question in judgement.questions):
            failures.code = max(failures.code, NOT_CORRECT)
        beside = [str(Path(judgement.source).parent / name) for name in judgement.files]
        target.protect(*beside)
        named.update(beside)
        yield judgement
    remark(source, unnamed(others, named))


def view_of(format: CheckFormat, items: bool, regrade: str | None, wide: bool) -> "View":
    """The function that turns judgements into text; other files that it needs are read at once."""
    if items:
        from rigidcli.homework.reports import items as report

        def told(judgements: "Iterator[Judgement]", style: "Style") -> Iterator[str]:
            every = list(judgements)
            return report.TEXTS[format](report.tally(every), style, report.alike(every))

        return told
    if regrade is not None:
        from rigidcli.homework.reports.items import changes, run_of

        return partial(changes, run_of(regrade))
    from rigidcli.homework.reports import formats

    return formats.wide if wide else partial(formats.render, format)


def gradebook(path: str, is_moodle: bool, column: str | None, title: str) -> "Fill":
    """The function that fills a gradebook, which is read at once. Raises RigidError."""
    from rigidcli.homework.reports import gradebooks, read

    text, _ = read(path)
    book = gradebooks.moodle(text, column) if is_moodle else gradebooks.canvas(text, column or title)
    return partial(gradebooks.fill, book)


def filled(
    path: str,
    fill: "Fill",
    aliases: "Mapping[str, Sequence[str]]",
    told: Sequence[str],
    quiet: bool,
    judgements: "Iterator[Judgement]",
    style: "Style",
) -> Iterator[str]:
    """The text of a gradebook with the scores of all who have handed in; its notes are printed."""
    text, notes = fill((each for each in judgements if each.source), aliases)
    tell_notes(path, [note for note in notes if note not in told], quiet)
    yield text
