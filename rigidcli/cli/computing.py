"""What all computing commands share: their options, the loop over FILES, and the handling of errors."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rigidcli
from rigidcli.cli.output import Failures, Output, complain, progress
from rigidcli.errors import Problem, UsageError
from rigidcli.render import Format, Look, renderer

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.report import Report

Files = Annotated[
    list[str], typer.Argument(metavar="FILE", help="Documents (YAML or JSON); `-` is standard input.")
]


def _check_settings(settings: list[str] | None) -> list[str]:
    from rigidcli.model.settings import split_setting

    for setting in settings or ():
        try:
            split_setting(setting)
        except UsageError as error:
            raise typer.BadParameter(f"{error.message} ({error.hint})") from None
    return settings or []


Settings = Annotated[
    list[str] | None,
    typer.Option(
        "-s",
        "--set",
        metavar="KEY=VALUE",
        callback=_check_settings,
        help="Override a value, such as body.mass=3; repeatable.",
    ),
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No notes on standard error.")]


def _check_path(path: str | None) -> str | None:
    if path == "":
        raise typer.BadParameter("a file without a name cannot be written")
    return path


OutputPath = Annotated[
    str | None,
    typer.Option(
        "-o", "--output", metavar="PATH", callback=_check_path, help="Write to PATH, whole or not at all."
    ),
]
NoHeader = Annotated[bool, typer.Option("--no-header", help="CSV without the header row.")]
MaxSteps = Annotated[
    int | None,
    typer.Option("--max-steps", min=1, metavar="N", help="Most steps of an integration (default 1,000,000)."),
]
Exact = Annotated[
    bool,
    typer.Option("--exact", help="Exact arithmetic: decimals are rationals, parameters may stay symbols."),
]


PULSE = 2.0
"""Seconds after which a terminal is told how long the work has taken, also where its share is not known."""

SHORTHANDS = {"samples": "motion.samples", "duration": "motion.duration"}
"""Options of single commands that set a value of the document, and the key of that value."""


def computing(study: Callable[..., None]) -> Callable[..., None]:
    """A command with the shared options, which calls the study of its name for each FILE.

    The keyword-only parameters of the function are options of its own, annotated with objects and not with
    texts. They are passed to the study, except those in SHORTHANDS, which become settings, and `columns`,
    which selects from the output. The function itself is never called.
    """
    own = [
        p.replace(kind=p.POSITIONAL_OR_KEYWORD)
        for p in inspect.signature(study).parameters.values()
        if p.kind is p.KEYWORD_ONLY
    ]

    def command(
        files: Files,
        format: Annotated[Format, typer.Option("-f", "--format", help="What to print.")] = Format.table,
        output: OutputPath = None,
        settings: Settings = None,
        digits: Annotated[
            int, typer.Option(min=1, max=17, metavar="N", help="Significant digits in table and latex.")
        ] = 6,
        exact: Exact = False,
        no_header: NoHeader = False,
        quiet: Quiet = False,
        **options: Any,
    ) -> None:
        failures = Failures()
        columns = tuple(options.pop("columns", None) or ())
        shorthands = {f"--{name}": options.pop(name) for name in SHORTHANDS if name in options}
        named = {SHORTHANDS[name[2:]]: name for name, value in shorthands.items() if value is not None}
        changes = [*(settings or ()), *(f"{key}={shorthands[name]}" for key, name in named.items())]

        def reports() -> Iterator[Report]:
            for document in documents(files, failures, exact=exact, settings=changes, options=named):
                with failures.of(document.source), document.placing():
                    run = getattr(rigidcli, study.__name__)
                    with progress(pulse=PULSE) as show:
                        if "progress" in inspect.signature(run).parameters:
                            options["progress"] = show
                        report = run(document, **options)
                    _require_columns(report, columns)
                    if format is Format.json:
                        _require_memory(report)
                    tell_notes(report.source, report.notes, quiet)
                    yield report

        with Output(output) as target:
            width, colour = target.terminal()
            look = Look(digits, not no_header, width, colour, columns, several=len(files) > 1)
            for piece in renderer(format)(reports(), look):
                target.write(piece)
        raise typer.Exit(failures.code)

    shared = inspect.signature(command, eval_str=True)
    parameters = [*(p for p in shared.parameters.values() if p.kind is not p.VAR_KEYWORD), *own]
    command.__name__, command.__doc__ = study.__name__, study.__doc__
    command.__signature__ = shared.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    return command


def _require_columns(report: Report, columns: Sequence[str]) -> None:
    """Raise UsageError unless the table of data has these columns; only that of a top has angles."""
    known = {name for table in report.tables if table.data for each in table.columns for name in each.cells}
    for name in columns:
        if name not in known:
            raise UsageError(f"`{name}` is no column here: only the motion of a `top` has phi, theta and psi")


def _require_memory(report: Report) -> None:
    """Raise ComputationError unless there is enough for the whole text of the tables."""
    from rigidcli.core.memory import ITS_TEXT, require

    for table in report.tables:
        require(len(table), sum(len(column.cells) for column in table.columns), ITS_TEXT)


def documents(files: Sequence[str], failures: Failures, **options: Any) -> Iterator[Document]:
    """The documents in FILES, loaded with `options`; those that are refused are failures."""
    from rigidcli.model.load import load

    for file in files:
        with failures.of(file):
            yield load(file, **options)


def tell_notes(source: str, notes: Sequence[str], quiet: bool) -> None:
    """Print the notes on a source, unless the user wants none."""
    for note in () if quiet else notes:
        complain(str(Problem(source, f"note: {note}")))
