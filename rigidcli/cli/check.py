"""The command `check`: judgements as text in a format, as pages, or in a gradebook, and the notes on them."""

# Annotations here are objects, not texts: typer reads them.

from collections.abc import Callable, Collection, Iterator, Sequence
from enum import StrEnum
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, TypeAlias

import typer

from rigidcli.cli.options import NoHeader, OutputPath, Quiet, command, format_option, listed, option, whole
from rigidcli.cli.output import Failures, Folder, Output, complain, is_folder, progress, tell_notes
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

NOT_CORRECT = 1  # the exit code if any answer is judged not to be correct

CheckFormat = StrEnum("CheckFormat", "table json csv junit gradescope html")

# The formats of each option that prints something else than judgements. Gradebooks and wide rows are csv in
# both of their formats; sheets are pages in html, unless csv is asked for.
FORMATS_OF_VIEWS = {
    **dict.fromkeys(("--items", "--regrade", "--selftest"), ("table",)),
    **dict.fromkeys(("--canvas", "--moodle", "--wide"), ("table", "csv")),
    "--sheets": ("table", "html", "csv"),
}


def studies() -> "dict[str, Study]":
    """The studies that work out keys, each loaded when it is asked."""

    def study(name: str, document: "Document") -> "Report":
        report: Report = import_module(f"rigidcli.studies.{name}").run(document)
        return report

    return {name: partial(study, name) for name in STUDIES}


class Request(NamedTuple):
    """What the user asks of `check`: its arguments and options, in the order of the help.

    The last field is no option: it has the lists in which ANSWERS were named.
    """

    assignment: Annotated[str, typer.Argument(metavar="ASSIGNMENT", help="The questions and their keys.")]
    answers: Annotated[
        list[str] | None,
        typer.Argument(metavar="ANSWERS", help="Answer files, folders, or a zip; `@files.txt` lists names."),
    ] = None
    format: Annotated[CheckFormat, format_option(CheckFormat)] = CheckFormat.table
    output: OutputPath = None
    feedback: Annotated[Feedback, option("feedback")] = Feedback.hint
    jobs: Annotated[int | None, option("check.jobs", parser=whole)] = None
    items: Annotated[bool, option("items")] = False
    regrade: Annotated[str | None, option("regrade")] = None
    canvas: Annotated[str | None, option("canvas")] = None
    moodle: Annotated[str | None, option("moodle")] = None
    wide: Annotated[bool, option("wide")] = False
    column: Annotated[str | None, option("column")] = None
    roster: Annotated[str | None, option("roster")] = None
    overrides: Annotated[str | None, option("overrides")] = None
    selftest: Annotated[bool, option("selftest")] = False
    sheets: Annotated[bool, option("sheets")] = False
    no_header: NoHeader = False
    quiet: Quiet = False
    lists: Sequence[str] = ()

    @property
    def gradebook(self) -> str | None:
        """The gradebook that is filled."""
        return self.canvas or self.moodle


def run(asked: Request) -> int:
    """Do what is asked of `check`, and return the exit code."""
    answers, lists = listed(asked.answers or ())
    asked = asked._replace(answers=answers, lists=lists)
    require_consistent(asked)
    if asked.sheets and asked.format is not CheckFormat.csv:
        asked = asked._replace(format=CheckFormat.html)
    work = hand_out if asked.sheets else show_keys if asked.selftest else judge
    failures = Failures()
    with failures.of(asked.assignment), _target(asked) as target:
        work(asked, target, failures)
    return failures.code


HELP = """Judge answer files (homework).

Example: rigidcli check homework.yaml answers/ -f csv -o scores.csv
"""

check = command("check", HELP, Request, run)  # the command of typer


def require_consistent(asked: Request) -> None:
    """Raise BadParameter for options that do not go together."""
    view = " and ".join(name for name in FORMATS_OF_VIEWS if getattr(asked, name.removeprefix("--")))
    formats = FORMATS_OF_VIEWS.get(view, tuple(CheckFormat))
    needs_answers = not (asked.selftest or asked.sheets)
    wrong = {
        f"{view} exclude each other": " and " in view,
        f"{view} takes no ANSWERS": asked.answers and not needs_answers,
        "expected ANSWERS: files, or folders of them": needs_answers and not asked.answers,
        f"{view} has no other format than {', '.join(formats)}": asked.format not in formats,
        "--sheets are for the students of a --roster": asked.sheets and asked.roster is None,
        "--selftest takes no --roster": asked.selftest and asked.roster is not None,
        "--sheets are pages: name a folder for them, as in `-o sheets/`; or -f csv": asked.sheets
        and not (asked.format is CheckFormat.csv or is_folder(asked.output)),
        "--column is for --canvas": asked.column is not None and not asked.canvas,
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
    if not is_folder(path):
        if place.exists() or place.suffix:
            return Output(path)
        hint = f"`-o {path}/` writes a page for each student, too, `-o {path}.html` the class on one page"
        raise UsageError(f"`{path}` may be a file or a folder", hint=hint)
    if asked.feedback is Feedback.none and not asked.sheets:
        hint = f"`--feedback verdict` tells them more; `-o {place}.html` writes the class on one page"
        raise UsageError("`--feedback none` leaves nothing to say on the pages of students", hint=hint)
    return Folder(path)


def prepared_for(asked: Request, target: Output) -> "Prepared":
    """Read the assignment, work out its keys, and note settings that nothing uses. Raises DocumentError."""
    from rigidcli.homework.assignment import prepare

    prepared = prepare(asked.assignment, studies())
    read = filter(None, (asked.regrade, asked.gradebook, asked.roster, asked.overrides))
    target.protect(*prepared.files, *read, *asked.lists)
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
    names = people.students
    with progress() as show:
        questions = prepared.own(names, show)
    sheets = [
        pages.Sheet(label, prepared.variants.of(names[label]), questions[label], people.rows[number])
        for number, label in people.labels.items()
    ]
    if not isinstance(target, Folder):
        for piece in pages.sheet_rows(sheets, people.head, ReportStyle(header=not asked.no_header)):
            target.write(piece)
        return
    for name, content in pages.sheet_pages(sheets, prepared.title):
        target.begin(name)
        target.write(content)


# --- with answers


def judge(asked: Request, target: Output, failures: Failures) -> None:
    """Write the judgements of what is handed in, in the view that the user asks for."""
    from tempfile import TemporaryDirectory

    from rigidcli.homework.files import gather
    from rigidcli.homework.hand_ins import papers
    from rigidcli.homework.overrides import read_overrides
    from rigidcli.homework.reports import gradebooks
    from rigidcli.homework.reports.formats import ReportStyle
    from rigidcli.homework.roster import read_roster

    prepared, remarks = prepared_for(asked, target), dict[str, None]()
    answers: Sequence[str] = asked.answers or ()

    def tell(source: str, notes: Sequence[str]) -> None:
        new = [note for note in notes if f"{source}: {note}" not in remarks]
        tell_notes(source, new, asked.quiet)
        remarks.update(dict.fromkeys(f"{source}: {note}" for note in new))

    book = read_gradebook(asked, prepared) if asked.gradebook else None
    # A gradebook is a list of students, too.
    roster = read_roster(asked.roster) if asked.roster else book.people if book else None
    overrides = None if asked.overrides is None else read_overrides(asked.overrides, prepared.items, roster)
    with TemporaryDirectory(prefix="rigidcli-") as scratch:
        batch = gather(answers, asked.assignment, Path(scratch))
        target.protect(*(place.file for place in batch.places))
        for problem in batch.problems:
            complain(str(problem))
            remarks[str(problem)] = None
        if book and not batch.is_whole:
            failures.code = max(failures.code, UsageError.exit_code)
            raise UsageError("not all of ANSWERS can be read, and the gradebook is not filled")
        # Gradescope runs this for one student, and waits for a result also of those who hand in nothing.
        one = Path(answers[0]).absolute().stem if asked.format is CheckFormat.gradescope else ""
        handed_in = papers(batch, None if one else roster, prepared.questions, asked.jobs, one=one)
        if batch.problems:
            is_small = batch.is_whole or (one and not handed_in.papers[0].source)  # an entry of an archive
            failures.code = max(failures.code, NOT_CORRECT if is_small else UsageError.exit_code)
        elif not handed_in.papers:
            raise UsageError("there is no hand-in in ANSWERS", hint="; ".join(handed_in.notes) or None)
        tell(asked.roster or asked.gradebook or prepared.source, handed_in.notes)
        is_late = any(paper.is_late for paper in handed_in.papers)
        style = ReportStyle(asked.feedback, not asked.no_header, *target.terminal(), is_late)
        with progress() as show:
            judged = prepared.judged(handed_in, roster, overrides, asked.jobs, tell, show)
            if book and roster:
                view: View = partial(gradebooks.fill, book, roster.aliases, tell)
            else:
                view = view_of(asked, prepared, target, remarks)
            for piece in view(watched(judged, failures, target), style):
                target.write(piece)


def watched(judged: "Iterator[Judgement]", failures: Failures, target: Output) -> "Iterator[Judgement]":
    """Pass judgements on: verdicts set the exit code, and files that answers name are protected."""
    for judgement in judged:
        if any(question.verdict != "correct" for question in judgement.questions):
            failures.code = max(failures.code, NOT_CORRECT)
        target.protect(*judgement.beside)
        yield judgement


def view_of(asked: Request, prepared: "Prepared", target: Output, remarks: Collection[str]) -> "View":
    """The function that turns judgements into text; an old run is read at once. Raises DocumentError."""
    from rigidcli.homework.reports import formats

    if asked.items:
        return formats.by_question
    if asked.regrade:
        return partial(formats.changes, formats.run_of(asked.regrade))
    if asked.wide:
        return partial(formats.wide, [*prepared.items])
    if asked.format is not CheckFormat.html:
        return partial(formats.render, asked.format)
    from rigidcli.homework.reports import pages

    course = pages.Course(prepared.title, remarks)
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
    table = read_spreadsheet(str(asked.gradebook))
    if asked.moodle:
        return gradebooks.moodle(table)
    return gradebooks.canvas(table, asked.column or prepared.title)
