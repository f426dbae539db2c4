"""What all computing commands share: their options, the loop over FILES, and what becomes of errors."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidcli.cli.output import Failures, Output, complain
from rigidcli.errors import Problem, UsageError
from rigidcli.render import Format, Look, renderer

if TYPE_CHECKING:
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
Exact = Annotated[
    bool,
    typer.Option("--exact", help="Exact arithmetic: decimals are rationals, parameters may stay symbols."),
]


SHORTHANDS = {"samples": "motion.samples", "duration": "motion.duration"}
"""Options of single commands that stand for a setting."""


def computing(study: Callable[..., Report]) -> Callable[..., None]:
    """A command with the shared options that makes one report of each FILE by `study`.

    Keyword-only parameters of `study` are options of its own, annotated with objects and not with texts;
    one in SHORTHANDS becomes a setting, and `columns` is for the output.
    """
    own = [p for p in inspect.signature(study).parameters.values() if p.kind is p.KEYWORD_ONLY]

    def command(
        files: Files,
        format: Annotated[Format, typer.Option("-f", "--format", help="What to print.")] = Format.table,
        output: OutputPath = None,
        settings: Settings = None,
        digits: Annotated[
            int, typer.Option(min=1, max=17, metavar="N", help="Significant digits in table and latex.")
        ] = 6,
        exact: Exact = False,
        no_header: Annotated[bool, typer.Option("--no-header", help="CSV without the header row.")] = False,
        quiet: Quiet = False,
        **options: Any,
    ) -> None:
        failures = Failures()
        changes, named = list(settings or ()), {}
        for name in [name for name in SHORTHANDS if name in options]:
            value = options.pop(name)
            if value is not None:
                changes.append(f"{SHORTHANDS[name]}={value}")
                named[SHORTHANDS[name]] = f"--{name}"

        def reports() -> Iterator[Report]:
            from rigidcli.model.load import load

            for file in files:
                with failures.of(file):
                    document = load(file, exact=exact, settings=changes, options=named)
                    with document.placing():
                        report = study(document, **options)
                    if not quiet:
                        for note in report.notes:
                            complain(str(Problem(report.source, f"note: {note}")))
                    yield report

        with Output(output) as target:
            width, colour = target.terminal()
            look = Look(
                digits=digits,
                header=not no_header,
                width=width,
                colour=colour,
                columns=tuple(options.get("columns") or ()),
                several=len(files) > 1,
            )
            for piece in renderer(format)(reports(), look):
                target.write(piece)
        raise typer.Exit(failures.code)

    shared = inspect.signature(command, eval_str=True)
    parameters = [p for p in shared.parameters.values() if p.kind is not p.VAR_KEYWORD]
    own = [p.replace(kind=p.POSITIONAL_OR_KEYWORD) for p in own]
    command.__name__, command.__doc__ = study.__name__, study.__doc__
    command.__signature__ = shared.replace(parameters=[*parameters, *own])  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in [*parameters, *own]}
    return command
