"""The studies as commands: from options through documents, study, reports and renderer to the output."""

# Annotations here are objects, not texts: typer reads them.

import inspect
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rigidcli.cli import options as shared
from rigidcli.cli.failures import (
    Failure,
    Failures,
    bad_parameter,
    complain,
    counted,
    forecast,
    fresh,
    progress,
    tell_notes,
)
from rigidcli.cli.output import Output, is_folder
from rigidcli.cli.work import Answer, Work, answers, lost, require_used, tasks
from rigidcli.commands import COMMANDS, Command
from rigidcli.errors import UsageError
from rigidcli.processes import Jobs, each
from rigidcli.render import TRAITS, Format, Look, Traits, formats_of, joined, require_fit
from rigidcli.sandbox import usable_cores

if TYPE_CHECKING:
    from rigidcli.document.sweeps import Sweep
    from rigidcli.render.units import Units
    from rigidcli.report import Report

LEAST_FOR_PROCESSES = 500
"""With fewer values or FILES, starting processes costs more than it saves; else each core gets one."""

MOST_SHOWN = 100_000
"""The most rows of a table for people, which is kept in memory until the columns are known."""

MOST_MOTIONS = 60
"""The most motions of a sweep among which a slider of a page chooses: they are all in the page."""

PULSE = 2.0
"""Seconds after which a terminal shows the time that the work has taken."""


class CommandLine(NamedTuple):
    """The command line besides the study: FILES, their sweep or comparison, and the places of the output."""

    files: Sequence[str]
    tables: Sequence[str]
    sweep: "Sweep | None"
    jobs: Jobs | None
    compare: bool
    units: "Units"
    output: str | None
    plot: str | None
    quiet: bool

    @property
    def total(self) -> int:
        """The number of answers, without further links of robots and starts of ensembles."""
        return len(self.files) * (1 if self.sweep is None else self.sweep.count)

    @property
    def hands(self) -> Jobs:
        """The number of processes, or the address of a cluster."""
        return self.jobs or (usable_cores() if self.total >= LEAST_FOR_PROCESSES else 1)


OPTIONS: dict[str, tuple[Any, Any]] = {
    "files": (shared.Files, inspect.Parameter.empty),
    "format": (None, None),
    "output": (shared.OutputPath, None),
    "settings": (shared.Settings, None),
    "sweep": (shared.Sweeps, None),
    "pair": (shared.Pair, False),
    "jobs": (shared.Jobs, None),
    "compare": (shared.Compare, False),
    "digits": (shared.Digits, 6),
    "exact": (shared.Exact, False),
    "units": (shared.UnitList, None),
    "unit_header": (shared.UnitHeader, False),
    "no_header": (shared.NoHeader, False),
    "columns": (shared.Columns, None),
    "verbose": (shared.Verbose, False),
    "steps": (shared.Steps, False),
    "standalone": (shared.Standalone, False),
    "plot": (shared.PlotPath, None),
    "plot_kind": (None, None),
    "quiet": (shared.Quiet, False),
    "samples": (shared.Samples, None),
    "duration": (shared.Duration, None),
}
"""The arguments and options of the studies with their defaults, in the order of the help.

The formats and the kinds of pictures differ from study to study.
"""


def command_of(name: str) -> Callable[..., None]:
    """The study of this name as a command, with its formats, and the options that apply to it."""
    row = COMMANDS[name]
    named = [(format.value, format.value) for format in formats_of(name)]
    formats: Any = StrEnum("Format", named)  # type: ignore[misc]  # it is known at run time
    options = OPTIONS | {
        "format": (Annotated[formats, shared.format_option(formats)], formats("table")),
        "plot_kind": (shared.plot_kind(row.pictures), None),
    }
    for key in ("compare",) if row.section else ("samples", "duration"):
        del options[key]

    def command(**given: Any) -> None:
        raise typer.Exit(_compute(row, {key: given.get(key) for key in OPTIONS}))

    command.__name__, command.__doc__ = name, row.help
    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
            for key, (kind, default) in options.items()
        ]
    )
    return command


def _compute(command: Command, given: Mapping[str, Any]) -> int:
    """Do what is asked for with the `given` options, and return the exit code."""
    form = Format(given["format"])
    traits = TRAITS[form]
    files, lists = shared.listed(given["files"])
    sweep, units = shared.read_sweep(given["sweep"], given["pair"]), shared.read_units(given["units"])
    tables = [*lists, *(() if sweep is None else sweep.files)]
    places = given["output"], given["plot"], given["quiet"]
    asked = CommandLine(files, tables, sweep, given["jobs"], bool(given["compare"]), units, *places)
    single = {f"--{key.replace('_', '-')}": bool(given[key]) for key in ("steps", "plot", "plot_kind")}
    _require_compatible(asked, form, traits, single)
    is_alone = sweep is None and not asked.compare
    picture = _picture_kind(command.name, traits, asked, given["plot_kind"]) if is_alone else None
    _tell_unheeded(asked, form, given["steps"], picture)
    options: dict[str, Any] = {"steps": given["steps"] and traits.people}
    if picture:
        options["picture"] = picture
    if traits.program:
        options["program"] = True
    if traits.page and command.has_replay and not asked.compare and asked.total <= MOST_MOTIONS:
        options["scene"] = True
    of_motion = {key: given[key] for key in ("samples", "duration") if given[key] is not None}
    named = {f"{command.section}.{key}": f"--{key}" for key in of_motion}
    changes = [f"{command.section}.{key}={value}" for key, value in of_motion.items()]
    look = Look(
        given["digits"],
        not given["no_header"],
        columns=tuple(given["columns"] or ()),
        **{key: given[key] for key in ("unit_header", "verbose", "steps", "standalone")},
    )
    settings = [*(given["settings"] or ()), *changes]
    return _run(asked, Work(command, form, look, options, given["exact"], settings, named, given["plot"]))


def _tell_unheeded(asked: CommandLine, form: Format, steps: bool, picture: str | None) -> None:
    """Note options that have no effect on the output, or on a part of it."""
    is_data = not TRAITS[form].people
    if steps and is_data:
        tell_notes("--steps", [f"{form} has no working: use table, latex or html"], asked.quiet)
    if asked.units and (steps or is_data):
        other = form if is_data else "the working"
        tell_notes("--units", [f"{other} has SI units, whatever `--units` says"], asked.quiet)
    if asked.units and picture:
        tell_notes("--units", ["the picture has SI units, whatever `--units` says"], asked.quiet)


def _require_compatible(asked: CommandLine, form: Format, traits: Traits, single: dict[str, bool]) -> None:
    """Raise BadParameter where options exclude each other; the `single` ones are for one document."""
    files, sweep, output = asked.files, asked.sweep, asked.output
    several = "a comparison" if asked.compare else "a sweep" if sweep is not None else ""
    alone = next((name for name in single if single[name] and several), "")
    program = f"a program in {form} has the equations of one document"
    is_long = sweep is not None and sweep.count > MOST_SHOWN and traits.people
    for wrong, option, problem in (
        (traits.program and len(files) > 1, "--format", f"{program}; {len(files)} files are given"),
        (traits.program and several, "--sweep", f"{program}, not of {several}"),
        (traits.file and output in (None, "-"), "--format", f"{form} is no text: `-o table{traits.file}`"),
        (alone, alone, f"{alone} is for one document, not for {several}"),
        (is_long, "--sweep", f"a table of {asked.total:,} rows is too long to read: `-f csv` streams them"),
        (asked.compare and sweep is not None, "--compare", "a sweep stands in rows already"),
        (
            asked.compare and not traits.people,
            "--compare",
            f"{form} has no comparison: use table, latex or html",
        ),
        (asked.compare and len(files) < 2, "--compare", "expected several FILEs"),
    ):
        if wrong:
            raise typer.BadParameter(problem, param_hint=f"'{option}'")


def _picture_kind(command: str, traits: Traits, asked: CommandLine, kind: str | None) -> str | None:
    """The kind of the picture, if one is drawn. Raises BadParameter where it cannot be drawn or written."""
    path, output = asked.plot, asked.output
    if path is None and kind is None and not traits.page:
        return None
    from rigidcli.render.plots import CHARACTERS, require_ending, require_library
    from rigidcli.studies.pictures import ANY, BEST, require_kind

    with bad_parameter("--plot-kind"):
        require_kind(command, kind or BEST)
        if path is None and traits.page:
            return kind or ANY
        if path is None:
            raise UsageError(
                "it chooses a picture, and nothing asks for one", hint="add `--plot picture.png`"
            )
    with bad_parameter("--plot"):
        require_ending(path)
        if len(asked.files) > 1:
            raise UsageError("it draws one picture, and several FILEs are given", hint="run it for each FILE")
        if path != CHARACTERS and output is not None and Path(path).resolve() == Path(output).resolve():
            raise UsageError(f"`-o` writes the results to `{path}`", hint="give the picture another name")
        require_library("characters" if path == CHARACTERS else "drawing")
    return kind or BEST


def _run(asked: CommandLine, work: Work) -> int:
    """Do the work, write the output, and return the exit code."""
    from rigidcli.bodies.robots import is_robot

    failures, traits, pictures = Failures(), TRAITS[work.format], list[str | bytes]()
    opened = Output(asked.output), Output(asked.plot, "--plot")
    with failures.of(asked.output or ""), opened[0] as target, opened[1] as drawing:
        for output in opened:
            output.protect(*(file for file in (*asked.files, *asked.tables) if file != "-"))
        width, colour = target.terminal()
        several = len(asked.files) > 1 or any(map(is_robot, asked.files))
        look = work.look._replace(width=width, colour=colour, several=several)
        work = work._replace(look=look)
        if work.settings or asked.sweep is not None:
            require_used(work, asked.files, asked.sweep)
        if traits.file and is_folder(asked.output):
            from rigidcli.cli.folder import write_folder

            write_folder(str(asked.output), asked.files, asked.sweep, asked.hands, work, failures)
            return failures.code
        pieces = _pieces(asked, work, failures, opened, pictures)
        reports = _for_people(pieces, asked, work) if traits.people else pieces
        for part in joined(work.format, reports, work.look):
            target.write(part)
        for picture in pictures:
            if isinstance(picture, bytes):
                drawing.write(picture)
            elif traits.terminal and asked.output in (None, "-"):
                target.write(picture)
            else:  # a chart of characters stays away from data
                complain(picture.rstrip("\n"))
    return failures.code


def _pieces(
    asked: CommandLine, work: Work, failures: Failures, opened: Sequence[Output], pictures: list[str | bytes]
) -> Iterator[Any]:
    """The pieces of the output, one after the other; pictures are put into the list `pictures`."""
    first = None
    for answer in _good_answers(asked, work, failures, opened):
        with failures.of(answer.source):
            if answer.picture is not None and pictures:
                problem = "`--plot` draws one picture, and this FILE has several bodies"
                raise UsageError(problem, hint="leave out `--plot`")
            pictures += [] if answer.picture is None else [answer.picture]
            if asked.sweep is not None:
                first = answer.outcome if first is None else first
                require_fit(work.format, answer.outcome, first)
            yield answer.outcome


def _good_answers(
    asked: CommandLine, work: Work, failures: Failures, opened: Sequence[Output]
) -> Iterator[Answer]:
    """The answers that are no failures. Notes and failures are printed as the work goes on."""
    printed = defaultdict[str, set[str]](set)
    here = asked.hands == 1 and asked.sweep is None
    do = partial(answers, work=work, watch=partial(progress, pulse=PULSE) if here else None)
    # On a terminal, rows that stream show the progress themselves.
    streams = work.look.width is not None and not TRAITS[work.format].people
    foretell = forecast()
    with counted(0 if here or streams else asked.total) as done:
        for answer in each(do, tasks(work, asked.files, asked.sweep, asked.hands), asked.hands, lost):
            with failures.of(answer.source):
                for output in opened:
                    output.protect(*answer.files)
                tell_notes(answer.source, fresh(answer.notes, printed[answer.source]), asked.quiet)
                if len(asked.files) == 1 and answer.starts[0] and not streams and not asked.quiet:
                    foretell(*answer.starts)
                if isinstance(answer.outcome, Failure):
                    failures.tell(answer.outcome)
                else:
                    yield answer
            done()
    failures.end()


def _for_people(reports: "Iterable[Report]", asked: CommandLine, work: Work) -> "Iterable[Report]":
    """The reports for people: with summaries of ensembles, in the chosen units, or as one table."""
    if work.command.section:
        from rigidcli.studies.ensembles import summaries

        reports = summaries(reports)
    if asked.units:
        from rigidcli.render.units import in_units

        reports = map(partial(in_units, units=asked.units), reports)
    if asked.sweep is not None:
        from rigidcli.render.several import gathered

        return gathered(reports, work.look, lambda note: tell_notes("--sweep", [note], asked.quiet))
    if work.look.several:
        from rigidcli.render.several import compared, named

        return compared(reports, work.look) if asked.compare else named(reports)
    return reports
