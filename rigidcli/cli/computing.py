"""What all computing commands share: the loop over FILES, and what their options make of it."""

from __future__ import annotations

import inspect
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext, suppress
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidcli.cli.failures import Failure, Failures, tell_notes
from rigidcli.cli.options import (
    Columns,
    Exact,
    Files,
    NoHeader,
    OutputPath,
    Quiet,
    Settings,
    listed,
    read_units_option,
)
from rigidcli.cli.output import Output
from rigidcli.cli.pictures import PlotKind, PlotPath, picture_kind, write_picture
from rigidcli.cli.progress import counted, progress
from rigidcli.cli.requirements import require_memory
from rigidcli.cli.sweeps import Jobs, Known, Pair, Sweeps, asked, hands, require_sweepable
from rigidcli.cli.work import FOLLOW, Answer, Texts, Work, answers, tasks, texts
from rigidcli.errors import RigidError, UsageError
from rigidcli.render import BLOCKS, PEOPLE, PROGRAMS, Format, Look, renderer
from rigidcli.report import Report

if TYPE_CHECKING:
    from rigidcli.studies.ensembles import Form


SECTIONS = {"euler": "motion", "hamilton": "orbit"}
"""The section of the document whose `samples` and `duration` the options of these commands set."""

SHORTHANDS = ("samples", "duration")
"""Options that set a value of the document."""

PULSE = 2.0
"""Seconds after which a terminal is told how long the work has taken, also where its share is not known."""


def computing(study: Callable[..., None]) -> Callable[..., None]:
    """A command with the shared options, which calls the study of its name for each FILE.

    The keyword-only parameters of the function are options of its own, annotated with objects and not with
    texts. They are passed to the study, except those in SHORTHANDS, which become settings. The function
    itself is never called.
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
        sweep: Sweeps = None,
        pair: Pair = False,
        jobs: Jobs = None,
        digits: Annotated[
            int, typer.Option(min=1, max=17, metavar="N", help="Significant digits for people.")
        ] = 6,
        exact: Exact = False,
        units: Annotated[
            str | None,
            typer.Option(
                metavar="LIST",
                help="Units for people, such as g,cm,deg,rpm; json and csv stay SI.",
            ),
        ] = None,
        unit_header: Annotated[bool, typer.Option("--unit-header", help="CSV heads with units.")] = False,
        no_header: NoHeader = False,
        columns: Columns = None,
        verbose: Annotated[
            bool, typer.Option("-v", "--verbose", help="Tell residuals, drifts, trusted digits, method, too.")
        ] = False,
        steps: Annotated[bool, typer.Option("--steps", help="Show the working, to people.")] = False,
        standalone: Annotated[
            bool, typer.Option("--standalone", help="LaTeX that compiles by itself.")
        ] = False,
        plot: PlotPath = None,
        plot_kind: PlotKind = None,
        quiet: Quiet = False,
        **options: Any,
    ) -> None:
        failures = Failures()
        files, lists = listed(files)
        if format in PROGRAMS:
            _require_equations(study.__name__, format, files)
            options["program"] = True
        if format in BLOCKS and study.__name__ != "inertia":
            problem = f"a block of mass and inertia in {format} is what `rigidcli inertia -f {format}` writes"
            raise typer.BadParameter(problem, param_hint="'--format'")
        options["steps"] = steps and format in PEOPLE
        chosen = tuple(columns or ())
        wanted = read_units_option(units)
        if wanted and format not in PEOPLE:
            tell_notes("--units", [f"{format} has SI units, whatever `--units` says"], quiet)
            wanted = {}
        given = {name: value for name in SHORTHANDS if (value := options.pop(name, None)) is not None}
        named = {f"{SECTIONS[study.__name__]}.{name}": f"--{name}" for name in given}
        changes = [*(settings or ()), *map("=".join, zip(named, map(str, given.values()), strict=True))]

        swept = asked(sweep, pair)
        if swept is not None:
            require_sweepable(format, {"--steps": steps, "--plot": bool(plot or plot_kind)}, swept.count)
        picture = (
            picture_kind(study.__name__, format, plot, plot_kind, files, output) if swept is None else None
        )
        if picture and wanted:
            tell_notes("--units", ["the picture has SI units, whatever `--units` says"], quiet)
        options |= {"picture": picture} if picture else {}
        if format is Format.html and swept is None and study.__name__ in SECTIONS:
            options["scene"] = True
        pictured: list[Report] = []

        told: Form = "rows" if format is Format.csv else "few" if format in PEOPLE else "starts"
        keys = () if swept is None else tuple(key.name for key in swept.keys)
        in_rows = keys if format in (Format.csv, Format.parquet) or (keys and format in PEOPLE) else None
        require = _requirement(format)
        write = None
        if format is Format.json and not plot:
            from rigidcli.render import json

            write = partial(json.render, look=Look(columns=chosen))
        work = Work(study.__name__, options, exact, changes, named, chosen, require, told, in_rows, write)

        from rigidcli.bodies.robots import is_robot

        total = len(files) * (1 if swept is None else swept.count)
        processes = hands(jobs, total, alone=swept is None and "-" in files)
        # The rows of a sweep are those of links; what is said of a file as a whole is not among them.
        for file in filter(is_robot, files if swept is not None else ()):
            with suppress(RigidError):  # which is told when the file is swept
                tell_notes(file, work.drafts(file).notes, quiet)

        def answered() -> Iterator[Report | Texts]:
            from rigidcli.cli.plan import PAYS, ordered

            known = defaultdict[str, Known](Known)
            asked_for: Callable[..., Iterator[Answer[Any]]] = answers if write is None else texts
            apart = processes != 1 or swept is not None
            do = asked_for if apart else partial(asked_for, watch=partial(progress, pulse=PULSE))
            # On a terminal, rows that stream show the progress themselves.
            is_seen = width is not None and format is not Format.table
            with counted(total) if apart and not is_seen else nullcontext(lambda: None) as done:
                plan = tasks(work, files, swept, failures, processes)
                for answer in ordered(do, plan, processes, PAYS if jobs is None else 1):
                    points = 1
                    with failures.of(answer.source):
                        target.protect(*answer.files)
                        tell_notes(answer.source, answer.notes, quiet)
                        told: Report | Texts | Failure = answer.found
                        if isinstance(told, Failure):
                            failures.tell(told)
                        else:
                            _require_one(pictured)
                            again = swept is not None or answer.start is not None
                            notes = known[told.source].new(told.notes) if again else told.notes
                            tell_notes(told.source, notes, quiet)
                            yield told
                            points = len(told.texts) if isinstance(told, Texts) else 1
                    for _ in range(points):
                        done()
            failures.end()

        def reports() -> Iterator[Report]:
            for report in answered():
                assert isinstance(report, Report)
                pictured.extend([report] if plot else [])
                yield report

        several = len(files) > 1 or any(map(is_robot, files))
        if format is Format.parquet:
            from rigidcli.cli.parts import goes_to_folder, write_folder

            if goes_to_folder(output):
                about = {
                    "results": f"rigidcli.{study.__name__}/1",
                    "set": changes,
                    "sweep": sweep or [],
                    "zip": pair,
                }
                look = Look(columns=chosen, several=several)
                with failures.of(str(output)):
                    parts = tasks(work, files, swept, failures, processes)
                    write_folder(str(output), parts, total, look, processes, about, failures, quiet)
                raise typer.Exit(failures.code)

        def written() -> Iterator[str]:
            for found in answered():
                assert isinstance(found, Texts)
                yield from found.texts

        def for_people(found: Iterator[Report]) -> Iterator[Report]:
            if study.__name__ in FOLLOW and format in PEOPLE:
                from rigidcli.studies.ensembles import summaries

                found = summaries(found)
            if not wanted:
                return found
            from rigidcli.render.units import in_units

            return map(partial(in_units, units=wanted), found)

        with failures.of(output or ""), Output(output) as target:
            tables = () if swept is None else swept.files
            target.protect(*(file for file in (*files, *lists, *tables) if file != "-"))
            width, colour = target.terminal()
            look = Look(
                digits,
                not no_header,
                width,
                colour,
                chosen,
                several=several,
                unit_header=unit_header,
                verbose=verbose,
                steps=steps,
                standalone=standalone,
            )
            found = for_people(reports())
            if swept is not None and format in PEOPLE:
                from rigidcli.render.sweeps import gathered

                found = gathered(found, look, lambda note: tell_notes("--sweep", [note], quiet))
            for piece in _pieces(format, found, look) if write is None else written():
                target.write(piece)
            for report in pictured:
                # A chart of characters follows the table, and stays away from other data.
                follows = format is Format.table and output in (None, "-")
                write_picture(report, str(plot), width, target if follows else None)
        raise typer.Exit(failures.code)

    shared = inspect.signature(command, eval_str=True)
    parameters = [*(p for p in shared.parameters.values() if p.kind is not p.VAR_KEYWORD), *own]
    command.__name__, command.__doc__ = study.__name__, study.__doc__
    command.__signature__ = shared.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    return command


def _pieces(format: Format, reports: Iterator[Report], look: Look) -> Iterator[str] | Iterator[bytes]:
    """The output, piece by piece."""
    if format is not Format.parquet:
        return renderer(format)(reports, look)
    from rigidcli.render.parquet import render

    return render(reports, look)


def _require_equations(study: str, format: Format, files: Sequence[str]) -> None:
    """Raise BadParameter unless this study of these files is written as one program."""
    if study != "hamilton":
        problem = f"a program in {format} has equations of motion, which only `rigidcli hamilton` writes"
    elif len(files) > 1:
        problem = f"a program in {format} has the equations of one document; {len(files)} files are given"
    else:
        return
    raise typer.BadParameter(problem, param_hint="'--format'")


def _requirement(format: Format) -> Callable[[Report], None] | None:
    """What raises RigidError where a report cannot be written in a format; None where each can."""
    if format is Format.json:
        return require_memory
    if format in BLOCKS:
        from rigidcli.render.inertial import require_numbers

        return require_numbers
    return None


def _require_one(pictured: Sequence[Report]) -> None:
    """Raise UsageError where a picture is there already: a robot has a body for each of its links."""
    if pictured:
        raise UsageError("`--plot` draws one picture, of a FILE with one body", hint="leave out `--plot`")
