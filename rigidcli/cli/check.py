"""The command `check`: judgements as text in a format, as pages, or in a gradebook, and the notes on them."""

# Annotations here are objects, not texts: typer reads them.

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeAlias

import typer

from rigidcli.cli.failures import Failures, complain, progress, tell_notes
from rigidcli.cli.options import NoHeader, OutputPath, Quiet, format_option, listed, whole
from rigidcli.cli.output import Folder, Output, is_folder
from rigidcli.commands import STUDIES
from rigidcli.errors import UsageError
from rigidcli.homework import Feedback

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.homework.assignment import Prepared, Study
    from rigidcli.homework.base import Judgement
    from rigidcli.homework.reports.formats import ReportStyle
    from rigidcli.homework.reports.gradebooks import Gradebook
    from rigidcli.report import Report

    View: TypeAlias = Callable[[Iterator[Judgement], ReportStyle], Iterator[str]]

NOT_CORRECT = 1
"""The exit code if any answer is judged not to be correct."""


CheckFormat = StrEnum("CheckFormat", "table json csv junit gradescope html")
"""The output formats of judgements."""


FORMATS_OF_VIEWS = {
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


def studies(steps: bool = False) -> "dict[str, Study]":
    """The studies that work out keys, each loaded when it is asked; their reports may have steps."""

    def study(name: str, document: "Document") -> "Report":
        report: Report = import_module(f"rigidcli.studies.{name}").run(document, steps=steps)
        return report

    return {name: partial(study, name) for name in STUDIES}


def _file(name: str, metavar: str, help: str) -> Any:
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


class Request(NamedTuple):
    """What the user asks of `check`: its options, and `view`, the one that asks for more than judgements.

    `file` is the old run of --regrade, or the gradebook.
    """

    assignment: str
    answers: Sequence[str]
    lists: Sequence[str]
    view: str
    file: str | None
    format: CheckFormat
    output: str | None
    feedback: Feedback
    jobs: int | None
    column: str | None
    roster: str | None
    overrides: str | None
    steps: bool
    header: bool
    quiet: bool

    @property
    def is_gradebook(self) -> bool:
        """Whether a gradebook is filled."""
        return self.view in ("--canvas", "--moodle")

    @property
    def files(self) -> Sequence[str]:
        """The files that are read besides the assignment and the answers."""
        return [*filter(None, (self.file, self.roster, self.overrides)), *self.lists]


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
    given, lists = listed(answers or ())
    chosen = {"--items": items, "--regrade": regrade, "--canvas": canvas, "--moodle": moodle, "--wide": wide}
    chosen |= {"--selftest": selftest, "--sheets": sheets}
    views = [option for option, value in chosen.items() if value]
    if len(views) > 1:
        raise typer.BadParameter(f"{' and '.join(views)} exclude each other")
    asked = Request(
        *(assignment, given, lists, "".join(views), regrade or canvas or moodle, format, output, feedback),
        *(jobs, column, roster, overrides, steps, not no_header, quiet),
    )
    require_consistent(asked)
    if asked.view == "--sheets" and format is not CheckFormat.csv:
        asked = asked._replace(format=CheckFormat.html)
    run = {"--sheets": hand_out, "--selftest": show_keys}.get(asked.view, judge)
    failures = Failures()
    with failures.of(assignment), _target(asked) as target:
        run(asked, target, failures)
    raise typer.Exit(failures.code)


def require_consistent(asked: Request) -> None:
    """Raise BadParameter for options that do not go together."""
    view, formats = asked.view, FORMATS_OF_VIEWS.get(asked.view, tuple(CheckFormat))
    needs_answers = view not in ("--selftest", "--sheets")
    is_folder_missing = asked.format is not CheckFormat.csv and not is_folder(asked.output)
    wrong = {
        f"{view} takes no ANSWERS": asked.answers and not needs_answers,
        "expected ANSWERS: files, or folders of them": needs_answers and not asked.answers,
        f"{view} has no other format than {', '.join(formats)}": asked.format not in formats,
        "--steps shows the keys: it is for html with --feedback full": asked.steps
        and (asked.feedback is not Feedback.full or asked.format is not CheckFormat.html),
        "--sheets are for the students of a --roster": view == "--sheets" and asked.roster is None,
        "--selftest takes no --roster": view == "--selftest" and asked.roster is not None,
        "--sheets are pages: name a folder for them, as in `-o sheets/`; or -f csv": view == "--sheets"
        and is_folder_missing,
        "--column is for --canvas and --moodle": asked.column is not None and not asked.is_gradebook,
    }
    for message, is_wrong in wrong.items():
        if is_wrong:
            raise typer.BadParameter(message)


def _target(asked: Request) -> Output:
    """Where results go; for pages, it may be a folder. Raises UsageError where that is not clear."""
    path = asked.output
    if asked.format is not CheckFormat.html or path is None or path == "-":
        return Output(path)
    place = Path(path)
    named = path.endswith((os.sep, os.altsep or os.sep))
    if not (named or place.exists() or place.suffix):
        hint = f"`-o {path}/` writes a page for each student, too, `-o {path}.html` the class on one page"
        raise UsageError(f"`{path}` may be a file or a folder", hint=hint)
    if not (named or place.is_dir()):
        return Output(path)
    if asked.feedback is Feedback.none and asked.view != "--sheets":
        hint = f"`--feedback verdict` tells them more; `-o {place}.html` writes the class on one page"
        raise UsageError("`--feedback none` leaves nothing to say on the pages of students", hint=hint)
    return Folder(path)


def prepared_for(asked: Request, target: Output) -> "Prepared":
    """Read the assignment, work out its keys, and note settings that nothing uses. Raises DocumentError."""
    from rigidcli.homework.assignment import prepare

    prepared = prepare(asked.assignment, studies(asked.steps))
    target.protect(*prepared.files, *asked.files)
    for note in () if asked.quiet else prepared.notes:
        complain(str(note))
    return prepared


# --- without answers


def show_keys(asked: Request, target: Output, failures: Failures) -> None:
    """Write what each question would do, and whether its own key is right."""
    from rigidcli.homework.judge import selftest

    prepared = prepared_for(asked, target)
    for questions in prepared.trials():
        for words, is_right in selftest(questions, prepared.questions):
            target.write(words)
            failures.code = max(failures.code, 0 if is_right else NOT_CORRECT)


def hand_out(asked: Request, target: Output, failures: Failures) -> None:
    """Write the sheet of each student of a roster: pages into a folder, or the rows of a table."""
    from rigidcli.homework.reports import pages
    from rigidcli.homework.reports.formats import ReportStyle
    from rigidcli.homework.roster import read_roster

    prepared = prepared_for(asked, target)
    if prepared.variants is None:
        hint = "`rigidcli new assignment` shows how parameters get other values for each student"
        raise UsageError("there are no `variants` in it, and so all sheets would be the same", hint=hint)
    people = read_roster(str(asked.roster))
    with progress() as show:
        questions = prepared.own(people.students, show)
    sheets = [
        pages.Sheet(label, prepared.variants.of(name), questions[label], people.rows[number])
        for number, label in people.labels.items()
        for name in [people.students[label]]
    ]
    if not isinstance(target, Folder):
        for piece in pages.sheet_rows(sheets, people.head, ReportStyle(header=asked.header)):
            target.write(piece)
        return
    for name, content in pages.sheet_pages(sheets, prepared.title):
        target.begin(name)
        target.write(content)


# --- with answers


class Remarks:
    """Notes on files and students: printed, unless the user wants none, and `kept` for a page."""

    def __init__(self, quiet: bool) -> None:
        self.kept: list[str] = []
        self._quiet = quiet

    def tell(self, source: str, notes: Sequence[str]) -> None:
        """Take notes on a source."""
        tell_notes(source, notes, self._quiet)
        self.kept += [f"{source}: {note}" for note in notes]


def judge(asked: Request, target: Output, failures: Failures) -> None:
    """Write the judgements of what is handed in, in the view that the user asks for."""
    from rigidcli.homework.files import gather
    from rigidcli.homework.hand_ins import papers
    from rigidcli.homework.reports.formats import ReportStyle
    from rigidcli.homework.roster import read_roster
    from rigidcli.homework.spreadsheets import read_overrides

    prepared, remarks = prepared_for(asked, target), Remarks(asked.quiet)
    book = read_gradebook(asked, prepared) if asked.is_gradebook else None
    roster = read_roster(asked.roster) if asked.roster else None
    if book and not roster:
        roster = book.people  # a gradebook is a list of students, too
    called = None if roster is None else roster.called
    overrides = None if asked.overrides is None else read_overrides(asked.overrides, prepared.worth, called)
    with TemporaryDirectory(prefix="rigidcli-") as scratch:
        batch = gather(asked.answers, asked.assignment, Path(scratch))
        target.protect(*(place.file for place in batch.places))
        for problem in batch.problems:
            complain(str(problem))
            remarks.kept.append(str(problem))
        if book and not batch.is_whole:
            failures.code = max(failures.code, UsageError.exit_code)
            raise UsageError("not all of ANSWERS can be read, and the gradebook is not filled")
        # Gradescope runs this for one student, and waits for a result also of those who hand in nothing.
        one = Path(asked.answers[0]).absolute().stem if asked.format is CheckFormat.gradescope else ""
        listing = "gradebook" if book and not asked.roster else "roster"
        handed_in = papers(
            batch, None if one else roster, prepared.questions, asked.jobs, one=one, listing=listing
        )
        if batch.problems:
            is_small = batch.is_whole or (one and not handed_in.papers[0].source)  # an entry of an archive
            failures.code = max(failures.code, NOT_CORRECT if is_small else UsageError.exit_code)
        elif not handed_in.papers:
            raise UsageError("there is no hand-in in ANSWERS", hint="; ".join(handed_in.notes) or None)
        remarks.tell(asked.roster or (book and asked.file) or prepared.source, handed_in.notes)
        is_late = any(paper.is_late for paper in handed_in.papers)
        style = ReportStyle(asked.feedback, asked.header, *target.terminal(), is_late)
        fill = partial(filled, book, roster.aliases, handed_in.notes, remarks) if book and roster else None
        with progress() as show:
            judged = prepared.judged(handed_in, roster, overrides, asked.jobs, remarks.tell, show)
            view = fill or view_of(asked, prepared, target, remarks)
            for piece in view(watched(judged, failures, target), style):
                target.write(piece)


def watched(judged: "Iterator[Judgement]", failures: Failures, target: Output) -> "Iterator[Judgement]":
    """Pass judgements on: verdicts set the exit code, and files that answers name are protected."""
    for judgement in judged:
        if any(question.verdict != "correct" for question in judgement.questions):
            failures.code = max(failures.code, NOT_CORRECT)
        target.protect(*judgement.beside)
        yield judgement


def view_of(asked: Request, prepared: "Prepared", target: Output, remarks: Remarks) -> "View":
    """The function that turns judgements into text; an old run is read at once. Raises DocumentError."""
    from rigidcli.homework.reports import formats, items

    if asked.view == "--items":
        return partial(items.render, asked.format)
    if asked.view == "--regrade":
        return partial(items.changes, items.run_of(str(asked.file)))
    if asked.view == "--wide":
        return formats.wide
    if asked.format is CheckFormat.html:
        return pages_of(prepared, remarks.kept, target, steps=asked.steps)
    return partial(formats.render, asked.format)


def pages_of(prepared: "Prepared", remarks: Sequence[str], target: Output, *, steps: bool) -> "View":
    """The function that turns judgements into the page of a class, or into those of a folder."""
    from rigidcli.homework.reports import pages

    solutions = pages.worked(prepared.solutions) if steps else {}
    course = pages.Course(prepared.title, remarks, solutions)
    if not isinstance(target, Folder):
        return lambda judgements, style: pages.one_page(judgements, course, style)

    def fill(judgements: "Iterator[Judgement]", style: "ReportStyle") -> Iterator[str]:
        for name, content in pages.pages(judgements, course, style):
            target.begin(name)
            yield content

    return fill


def read_gradebook(asked: Request, prepared: "Prepared") -> "Gradebook":
    """The gradebook that is filled. Raises UsageError for what is none, or has not this column."""
    from rigidcli.homework.reports import gradebooks
    from rigidcli.homework.spreadsheets import read_spreadsheet

    if prepared.variants is not None and not asked.roster:
        hint = "`--roster FILE.csv` is the list of students with which the sheets were made"
        raise UsageError("the values of a student follow from the name in the roster", hint=hint)
    table = read_spreadsheet(str(asked.file))
    if asked.view == "--moodle":
        return gradebooks.moodle(table, asked.column)
    return gradebooks.canvas(table, asked.column or prepared.title)


def filled(
    book: "Gradebook",
    aliases: "Mapping[str, Sequence[str]]",
    told: Sequence[str],
    remarks: Remarks,
    judgements: "Iterator[Judgement]",
    style: "ReportStyle",
) -> Iterator[str]:
    """Fill the scores into a gradebook, and print the notes on it that are not printed yet."""
    from rigidcli.homework.reports.gradebooks import fill

    text, notes = fill(book, judgements, aliases)
    remarks.tell(book.table.source, [note for note in notes if note not in told])
    yield text
