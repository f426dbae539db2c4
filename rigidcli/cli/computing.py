"""The studies as commands: from options through documents, study, reports and renderer to the output."""

# Annotations here are objects, not texts: typer reads them.

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from functools import partial
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rigidcli.cli import options as shared
from rigidcli.cli.options import option
from rigidcli.cli.output import (
    Failure,
    Failures,
    Output,
    bad_parameter,
    complain,
    counted,
    is_folder,
    tell_notes,
)
from rigidcli.commands import COMMANDS, Command
from rigidcli.errors import UsageError
from rigidcli.processes import Jobs, each
from rigidcli.render import TRAITS, Format, Look, Traits, formats_of, joined, require_fit
from rigidcli.sandbox import usable_cores

if TYPE_CHECKING:
    from rigidcli.cli.work import Work
    from rigidcli.document.sweeps import Sweep
    from rigidcli.report import Report

# With fewer values or FILES, starting processes costs more than it saves; else each core gets one.
LEAST_FOR_PROCESSES = 500
# The most rows of a table for people, which is kept in memory until the columns are known.
MOST_SHOWN = 100_000
# The most motions of a sweep among which a slider of a page chooses: they are all in the page.
MOST_MOTIONS = 60


class Asked(NamedTuple):
    """The command line of a study: its FILES and options, in the order of the help.

    The types of `format` and `plot_kind` differ from study to study. The last two fields are no options: the
    `tables` are files that name FILES or hold values, and `swept` is the sweep that was read.
    """

    files: shared.Files
    format: Any = None
    output: shared.OutputPath = None
    settings: shared.Settings = None
    sweep: Annotated[list[str] | None, option("sweep")] = None
    pair: Annotated[bool, option("pair")] = False
    jobs: Annotated[str | None, option("jobs", callback=shared.read_jobs)] = None
    compare: Annotated[bool, option("compare")] = False
    digits: Annotated[int, option("digits", parser=lambda text: shared.whole(text, 17))] = 6
    exact: shared.Exact = False
    units: Annotated[Any, option("units", parser=shared.read_units)] = None
    unit_header: Annotated[bool, option("unit_header")] = False
    no_header: shared.NoHeader = False
    columns: Annotated[str | None, option("columns", callback=shared.split)] = None
    verbose: Annotated[bool, option("verbose")] = False
    steps: Annotated[bool, option("steps")] = False
    standalone: Annotated[bool, option("standalone")] = False
    plot: Annotated[str | None, option("plot")] = None
    plot_kind: Any = None
    quiet: shared.Quiet = False
    samples: Annotated[str | None, option("samples")] = None
    duration: Annotated[str | None, option("duration")] = None
    tables: Sequence[str] = ()
    swept: "Sweep | None" = None

    @property
    def total(self) -> int:
        """The number of answers, without further links of robots and starts of ensembles."""
        return len(self.files) * (1 if self.swept is None else self.swept.count)

    @property
    def hands(self) -> Jobs:
        """The number of processes, or the address of a cluster."""
        return self.jobs or (usable_cores() if self.total >= LEAST_FOR_PROCESSES else 1)


def command_of(name: str) -> Callable[..., None]:
    """The study of this name as a command, with its formats, and the options that apply to it."""
    row = COMMANDS[name]
    named = [(format.value, format.value) for format in formats_of(name)]
    formats: Any = StrEnum("Format", named)  # type: ignore[misc]  # it is known at run time
    kinds = f"Choose the picture: {', '.join(row.pictures)}. By default the first that applies."
    picture = typer.Option("--plot-kind", metavar="NAME", help=kinds, rich_help_panel=shared.MORE)
    changed = {
        "format": (Annotated[formats, shared.format_option(formats)], formats("table")),
        "plot_kind": (Annotated[str | None, picture], None),
        **dict.fromkeys(("compare",) if row.section else ("samples", "duration")),
    }
    if "body" not in row.needs:
        files = typer.Argument(metavar="FILE", help=shared.FILES.format("Documents"))
        changed["files"] = (Annotated[list[str], files], Parameter.empty)
    return shared.command(name, row.help, Asked, partial(_compute, row), changed)


def _compute(command: Command, asked: Asked) -> int:
    form = Format(asked.format)
    traits, sweep = TRAITS[form], shared.read_sweep(asked.sweep, asked.pair)
    files, lists = shared.listed(asked.files)
    asked = asked._replace(files=files, tables=[*lists, *(sweep.files if sweep else ())], swept=sweep)
    _require_compatible(asked, form, traits)
    is_alone = sweep is None and not asked.compare
    picture = _picture_kind(command.name, traits, asked) if is_alone else None
    options: dict[str, Any] = {"steps": asked.steps and traits.people}
    if picture:
        options["picture"] = picture
    if traits.program:
        options["program"] = True
    if traits.page and command.has_replay and not asked.compare and asked.total <= MOST_MOTIONS:
        options["scene"] = True
    motion = {"samples": asked.samples, "duration": asked.duration}
    of_motion = {f"{command.section}.{key}": key for key in motion if motion[key] is not None}
    settings = [*(asked.settings or ()), *(f"{path}={motion[key]}" for path, key in of_motion.items())]
    named = {path: f"--{key}" for path, key in of_motion.items()}
    look = Look(
        asked.digits,
        not asked.no_header,
        columns=tuple(asked.columns or ()),
        unit_header=asked.unit_header,
        verbose=asked.verbose,
        standalone=asked.standalone,
    )
    for name, note in _unheeded(asked, form, picture):
        tell_notes(name, [note], asked.quiet)
    from rigidcli.cli.work import Work  # loads pydantic (60 ms), which wrong options need not wait for

    return _run(asked, Work(command, form, look, options, asked.exact, settings, named, asked.plot))


def _unheeded(asked: Asked, form: Format, picture: str | None) -> Iterator[tuple[str, str]]:
    """The options that have no effect on the output, or on a part of it, with the reason."""
    is_data = not TRAITS[form].people
    if asked.steps and is_data:
        yield "--steps", f"{form} has no working: use table, latex or html"
    if asked.units and (asked.steps or is_data):
        yield "--units", f"{form if is_data else 'the working'} has SI units, whatever `--units` says"
    if asked.units and picture:
        yield "--units", "the picture has SI units, whatever `--units` says"


def _require_compatible(asked: Asked, form: Format, traits: Traits) -> None:
    """Raise BadParameter where options exclude each other, or are for one document and there are several."""
    files, sweep, output = asked.files, asked.swept, asked.output
    several = "a comparison" if asked.compare else "a sweep" if sweep is not None else ""
    single = {"--steps": asked.steps, "--plot": asked.plot, "--plot-kind": asked.plot_kind}
    alone = next((name for name in single if single[name] and several), "")
    program = f"a program in {form} has the equations of one document"
    is_long = sweep is not None and sweep.count > MOST_SHOWN and traits.people
    people = f"{form} has no comparison: use table, latex or html"
    for wrong, where, problem in (
        (traits.program and len(files) > 1, "--format", f"{program}; {len(files)} files are given"),
        (traits.program and several, "--sweep", f"{program}, not of {several}"),
        (traits.file and output in (None, "-"), "--format", f"{form} is no text: `-o table{traits.file}`"),
        (alone, alone, f"{alone} is for one document, not for {several}"),
        (is_long, "--sweep", f"a table of {asked.total:,} rows is too long to read: `-f csv` streams them"),
        (asked.compare and sweep is not None, "--compare", "a sweep stands in rows already"),
        (asked.compare and not traits.people, "--compare", people),
        (asked.compare and len(files) < 2, "--compare", "expected several FILEs"),
    ):
        if wrong:
            raise typer.BadParameter(problem, param_hint=f"'{where}'")


def _picture_kind(command: str, traits: Traits, asked: Asked) -> str | None:
    """The kind of the picture, if one is drawn. Raises BadParameter where it cannot be drawn or written."""
    path, output, kind = asked.plot, asked.output, asked.plot_kind
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
        if path != CHARACTERS:
            require_ending(path)
        if len(asked.files) > 1:
            raise UsageError("it draws one picture, and several FILEs are given", hint="run it for each FILE")
        if path != CHARACTERS and output is not None and Path(path).resolve() == Path(output).resolve():
            raise UsageError(f"`-o` writes the results to `{path}`", hint="give the picture another name")
        require_library("characters" if path == CHARACTERS else "drawing")
    return kind or BEST


def _run(asked: Asked, work: "Work") -> int:
    from rigidcli.bodies.robots import is_robot
    from rigidcli.cli.work import require_used

    failures, traits, pictures = Failures(), TRAITS[work.format], list[str | bytes]()
    opened = Output(asked.output), Output(asked.plot, "--plot")
    with failures.of(asked.output or ""), opened[0] as target, opened[1] as drawing:
        for output in opened:
            output.protect(*(file for file in (*asked.files, *asked.tables) if file != "-"))
        width, colour = target.terminal()
        several = len(asked.files) > 1 or any(map(is_robot, asked.files))
        work = work._replace(look=work.look._replace(width=width, colour=colour, several=several))
        if work.settings or asked.swept is not None:
            require_used(work, asked.files, asked.swept)
        if traits.file and is_folder(asked.output):
            from rigidcli.cli.folder import write_folder

            write_folder(str(asked.output), asked.files, asked.swept, asked.hands, work, failures)
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
    asked: Asked, work: "Work", failures: Failures, opened: Sequence[Output], pictures: list[str | bytes]
) -> Iterator[Any]:
    """The pieces of the output, one after the other; pictures are put into the list `pictures`.

    Notes and failures are printed as the work goes on.
    """
    from rigidcli.cli.work import answers, lost, tasks

    first, printed = None, defaultdict[str, set[str]](set)
    here = asked.hands == 1 and asked.swept is None
    do = partial(answers, work=work, is_watched=here)
    # On a terminal, rows that stream show the progress themselves, and so does a single motion.
    streams = work.look.width is not None and not TRAITS[work.format].people
    with counted(asked.total) as done:
        for answer in each(do, tasks(work, asked.files, asked.swept, asked.hands), asked.hands, lost):
            with failures.of(answer.source):
                for output in opened:
                    output.protect(*answer.files)
                told = printed[answer.source]  # a sweep repeats its notes
                tell_notes(answer.source, [note for note in answer.notes if note not in told], asked.quiet)
                told.update(answer.notes)
                if answer.picture is not None and pictures:
                    problem = "`--plot` draws one picture, and this FILE has several bodies"
                    raise UsageError(problem, hint="leave out `--plot`")
                pictures += [] if answer.picture is None else [answer.picture]
                if isinstance(answer.outcome, Failure):
                    failures.tell(answer.outcome)
                else:
                    if asked.swept is not None:
                        first = answer.outcome if first is None else first
                        require_fit(work.format, answer.outcome, first)
                    yield answer.outcome
            if not streams and (answer.share < 1 or not here):
                done(answer.share)
    failures.end()


def _for_people(reports: "Iterable[Report]", asked: Asked, work: "Work") -> "Iterable[Report]":
    """The reports for people: with summaries of ensembles, in the chosen units, or as one table."""
    if work.command.section:
        from rigidcli.studies.ensembles import summaries

        reports = summaries(reports)
    if asked.units:
        from rigidcli.render.units import in_units

        reports = map(partial(in_units, units=asked.units), reports)
    if asked.swept is not None:
        from rigidcli.render.several import gathered

        return gathered(reports, work.look, lambda note: tell_notes("--sweep", [note], asked.quiet))
    if work.look.several:
        from rigidcli.render.several import compared, named

        return compared(reports, work.look) if asked.compare else named(reports)
    return reports
