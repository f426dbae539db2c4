"""The tasks of a study (documents, points of a sweep, starts of an ensemble), and their answers."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidcli.cli.output import Failure, failure, progress
from rigidcli.commands import COMMANDS, STUDIES, Command
from rigidcli.document.document import Document
from rigidcli.document.draft import SWEEP, Draft, split_setting
from rigidcli.document.load import Drafts, drafts, is_exact, read
from rigidcli.errors import UNKNOWN_KEY, ComputationError, DocumentError, RigidError, UsageError
from rigidcli.processes import Jobs
from rigidcli.render import TRAITS, Format, Look, piece, require_columns
from rigidcli.report import Field, Report

if TYPE_CHECKING:
    import pathlib

    from rigidcli.document.sweeps import Sweep
    from rigidcli.studies.hamilton.orbit import OrbitSolution

PULSE = 2.0  # seconds after which a terminal shows the time that a document has taken
FEW_FILES = 16  # up to this many FILES, starts are shared among processes; beyond it, whole FILES
# Tasks of a large ensemble, and blocks of starts in a task: few tasks, as each one reads the document.
FEW_TASKS, MOST_BLOCKS = 64, 16
WIDE = 2000  # starts in arrays: twice as many take twice as long, and half as many take nearly as long
# The most points of a sweep whose orbits are followed at once, and their samples: these take some 100 MB.
SWEPT, SWEPT_SAMPLES = 128, 500_000
READ_AT_ONCE = 64  # points of a sweep of rows: one by one takes a third longer, as caches are small
CLUSTER = 32  # processes that a cluster is taken to have


class Work(NamedTuple):
    """The work on every document: a study with its options, the way of reading, and the format of results.

    `settings` are texts of `--set`; `named` has the keys among them that have an option of their own. `plot`
    is the path of a picture, or that of a chart of characters.
    """

    command: Command
    format: Format
    look: Look
    options: Mapping[str, Any]
    exact: bool
    settings: Sequence[str]
    named: Mapping[str, str]
    plot: str | None = None

    def drafts(self, file: str) -> Drafts:
        """The drafts of the documents in a file. Raises DocumentError."""
        return drafts(file, exact=self.exact, settings=self.settings, options=self.named)

    def run(self, document: Document, is_watched: bool = False, **known: Any) -> Report:
        """The result of the study; the progress of a motion that `is_watched` is shown. Raises RigidError."""
        require_fitting(document, self.command)
        run: Callable[..., Report] = import_module(f"rigidcli.studies.{self.command.name}").run
        if not self.command.section:
            return run(document, **self.options, **known)
        with progress(PULSE, is_watched) as show:
            return run(document, **self.options, **known, progress=show)

    def kept_letters(self, document: Document, settings: Sequence[str]) -> tuple[str, ...]:
        """A note on parameters that are set, and stay letters: formulas keep all where one has no value."""
        kept = [str(name) for text in settings if (name := split_setting(text)[0][-1]) in document.values]
        if self.command.name != "hamilton" or not kept or not document.symbols:
            return ()
        missing = f"{', '.join(document.symbols)} {'has' if len(document.symbols) == 1 else 'have'} no value"
        return (f"{', '.join(kept)} {'stays a letter' if len(kept) == 1 else 'stay letters'}: {missing}",)

    def answer(self, report: Report, files: Sequence[pathlib.Path]) -> Answer:
        """The answer with a report in its format, and with the picture. Raises RigidError."""
        picture = None
        if self.plot is not None:
            from rigidcli.render.plots import CHARACTERS, chart, picture_file

            is_chart = self.plot == CHARACTERS
            picture = chart(report, self.look.width) if is_chart else picture_file(report, self.plot)
        require_columns(report, self.look.columns, TRAITS[self.format])
        output = piece(self.format, report, self.look)
        return Answer(report.source, output, report.notes, files, picture)


class Answer(NamedTuple):
    """A piece of the output, or a failure, with notes, the files that the document names, and a picture.

    `share` is its share of the work on its document: those of all starts of an ensemble add up to 1.
    """

    source: str
    outcome: Any
    notes: Sequence[str] = ()
    files: Sequence[pathlib.Path] = ()
    picture: str | bytes | None = None
    share: float = 1.0


class Task(NamedTuple):
    """A document at some `places` of a sweep, or some `starts` of its ensemble; or the failure to read it.

    `size`: how many places are read at once. `about`: notes on the whole file, which its first document has.
    """

    source: str
    draft: Draft | Failure
    about: Sequence[str] = ()
    sweep: Sweep | None = None
    places: range = range(1)
    size: int = 1
    starts: range | None = None

    def settings(self, point: Sequence[str]) -> list[str]:
        """The values at a point of the sweep as texts `KEY=VALUE`; none without a sweep, or a point."""
        return self.sweep.settings(point) if self.sweep is not None and point else []

    def failure(self, error: RigidError | MemoryError, point: Sequence[str]) -> Failure:
        """The failure at a point by this error."""
        return failure(error, self.source)._replace(place=", ".join(self.settings(point)))

    def cut(self, size: int) -> Iterator[Task]:
        """Tasks with so many of the places each; the first one keeps the notes."""
        for begin in range(0, len(self.places), size):
            yield self._replace(places=self.places[begin : begin + size], about=() if begin else self.about)


def require_fitting(document: Document, command: Command) -> None:
    """Raise DocumentError for a document of another command, which is named in the hint."""
    if any(getattr(document, section) is not None for section in command.needs):
        return
    for other in STUDIES:
        for section in COMMANDS[other].needs:
            if getattr(document, section) is not None:
                hint = f"this document has a `{section}`: `rigidcli {other} {document.source}`"
                raise document.refusal(f"missing: `{command.name}` needs it", command.needs[0], hint=hint)


def tasks(work: Work, files: Sequence[str], sweep: Sweep | None, jobs: Jobs) -> Iterator[Task]:
    """The tasks of all FILES, each made when it is needed, for this number of processes."""
    for task in documents(work, files, sweep, jobs):
        yield from task.cut(task.size)


def documents(work: Work, files: Sequence[str], sweep: Sweep | None, jobs: Jobs) -> Iterator[Task]:
    """A task for each document of the FILES with all places of the sweep, or for each block of an ensemble.

    FILES are read here; the files that they name are read where the task is done. A document that cannot be
    swept is one failure, and not one at every value.
    """
    divided = (
        sweep is None and jobs != 1 and work.plot is None and len(files) <= FEW_FILES and work.command.section
    )
    for file in files:
        try:
            drafts, notes, _ = work.drafts(file)
        except (RigidError, MemoryError) as error:
            yield Task(file, failure(error, file))
            continue
        for draft in drafts:
            try:
                fitting = {} if sweep is None else _fitting(draft, sweep, work.command)
                blocks = _blocks(draft, jobs) if divided else (None,)
            except (RigidError, MemoryError) as error:
                yield Task(draft.source, failure(error, draft.source), notes)
            else:
                sent = draft.absolute() if isinstance(jobs, str) else draft
                for starts in blocks:
                    yield Task(draft.source, sent, notes, starts=starts, **fitting)
                    notes = ()
            notes = ()


def _blocks(draft: Draft, jobs: Jobs) -> Sequence[range | None]:
    """The blocks of starts of an ensemble, each for one task; a single None where there is no ensemble.

    What is integrated does not depend on the other starts of its block: then each process gets two blocks, or
    one where these would be too few for arrays.
    """
    document = read(draft)
    if document.ensemble is None:
        return (None,)
    from rigidcli.studies.ensembles import block, may_go_in_arrays

    count, size = len(document.ensemble), block(document)
    size *= max(1, min(MOST_BLOCKS, count // (FEW_TASKS * size)))
    if document.system is not None or (document.motion is not None and document.motion.torque is not None):
        each = math.ceil(count / (jobs if isinstance(jobs, int) else CLUSTER))
        wide = WIDE if may_go_in_arrays(document) else 1
        size = min(size, max(math.ceil(each / 2), min(each, wide)))
    return [range(begin, min(begin + size, count)) for begin in range(0, count, size)]


def _fitting(draft: Draft, sweep: Sweep, command: Command) -> dict[str, Any]:
    """What a task has of the sweep, with the arithmetic of the document: `sweep`, `places` and `size`.

    The size does not depend on the number of processes, so that the rows do not.
    Raises RigidError where no document has such keys.
    """
    first = sweep.settings(sweep.point(0))
    exact, size = is_exact(draft, first), 1
    try:
        document = read(draft, first)
        ensemble, orbit = document.ensemble, document.orbit
        if orbit is not None and command.name == "hamilton":
            size = max(1, min(SWEPT, SWEPT_SAMPLES // len(orbit.instants(1.0))))
        elif not command.section and not document.files:
            size = max(1, min(READ_AT_ONCE, sweep.count // FEW_TASKS))
        if ensemble is not None and command.section:
            raise UsageError(
                f"a sweep has one row a value, and this document an ensemble of {len(ensemble):,} starts",
                hint="give one start, and sweep over it, or leave out `--sweep`",
            )
    except DocumentError as error:
        if unknown := [problem for problem in error.problems if problem.code == UNKNOWN_KEY]:
            raise DocumentError(unknown) from None
    return {"sweep": replace(sweep, exact=exact), "places": range(sweep.count), "size": size}


def answers(task: Task, work: Work, is_watched: bool = False) -> Iterator[Answer]:
    """The answers to a task, several for an ensemble; progress is shown where it `is_watched`."""
    if isinstance(task.draft, Failure):
        found = iter([Answer(task.source, task.draft)])
    else:
        found = _answers(task, task.draft, work, is_watched)
    for answer in found:
        yield answer._replace(notes=[*task.about, *answer.notes])


def lost(task: Task) -> Answer:
    """The answer to a task whose process has ended early, twice."""
    hint = "allow more memory, or ask for fewer samples"
    error = ComputationError("its process was killed twice, probably for memory", hint=hint)
    return Answer(task.source, failure(error, task.source))


def _answers(task: Task, draft: Draft, work: Work, is_watched: bool) -> Iterator[Answer]:
    """The answers at the places of a task; their orbits are followed at once where that is possible."""
    points: list[tuple[Sequence[str], Document | Failure]] = []
    for place in task.places:
        point: Sequence[str] = ()
        try:
            point = () if task.sweep is None else task.sweep.point(place)
            with progress(PULSE, is_watched):  # a large file takes seconds
                points.append((point, read(draft, task.settings(point))))
        except (RigidError, MemoryError) as error:
            points.append((point, task.failure(error, point)))
    followed: Iterator[OrbitSolution | None] = repeat(None)
    if len(points) > 1 and work.command.name == "hamilton":
        from rigidcli.studies.hamilton.many_orbits import swept

        followed = iter(swept([one for _, one in points if not isinstance(one, Failure)]))
    for point, document in points:
        if isinstance(document, Failure):
            yield Answer(task.source, document)
            continue
        files, orbit = tuple(document.files), next(followed)
        known: dict[str, Any] = {} if orbit is None else {"followed": orbit}
        try:
            if document.ensemble is not None and work.command.section:
                yield from _of_ensemble(document, work, task.starts)
                continue
            report = work.run(document, is_watched, **known)
            fields = () if task.sweep is None else tuple(_swept(task.sweep, point, document, report))
            kept = work.kept_letters(document, [*work.settings, *task.settings(point)])
            yield work.answer(replace(report, swept=fields, notes=(*report.notes, *kept)), files)
        except (RigidError, MemoryError) as error:
            yield Answer(task.source, task.failure(error, point), files=files)


def _swept(sweep: Sweep, point: Sequence[str], document: Document, report: Report) -> Iterator[Field]:
    """The swept keys as results, in the units of results of the same names."""
    from rigidcli.studies.common import RESULTS

    entries = [*report.fields, *chain.from_iterable(RESULTS.values())]
    for name, value, unit in sweep.swept(point, document.exact_results):
        usual = next((entry.unit for entry in entries if entry.key == name), "")
        yield Field(name, value, unit=unit or usual, cells={name: ()})


def _of_ensemble(document: Document, work: Work, starts: range | None) -> Iterator[Answer]:
    """The answers for these starts of an ensemble, or for all of them. Raises RigidError."""
    from rigidcli.studies.ensembles import InArrays, reports, require_one_start, starts_in, swarm

    assert document.ensemble is not None
    several: InArrays | None = None
    if work.command.name == "euler":
        from rigidcli.studies.euler.closed import together as several
    elif work.command.name == "hamilton":
        from rigidcli.studies.hamilton.many_orbits import together as several
    shown = ("picture", "scene", "steps")
    alone = work._replace(options={name: work.options[name] for name in work.options if name not in shown})
    source, files = document.source, tuple(document.files)
    require_one_start(document, work.options)
    places = range(len(document.ensemble)) if starts is None else starts
    form = TRAITS[work.format].ensembles
    parts = reports(document, alone.run, form, places, several)
    if work.plot is not None and document.system is not None:
        found = list(parts)
        good = [report for _, report in found if isinstance(report, Report)]
        if good:
            yield work.answer(replace(good[0], pictures=(swarm(good),)), files)
            found = [(place, report) for place, report in found if report is not good[0]]
        parts, work = iter(found), work._replace(plot=None)
    total = len(document.ensemble)
    for place, report in parts:
        if isinstance(report, RigidError):
            failed = failure(report, source)._replace(place=f"start {place}")
            yield Answer(source, failed, files=files, share=1 / total)
        else:
            yield work.answer(report, files)._replace(share=starts_in(report) / total)


def require_used(work: Work, files: Sequence[str], sweep: Sweep | None) -> None:
    """Raise UsageError for a key of `--set` or `--sweep` that the command ignores, or no FILE uses."""
    first = [] if sweep is None else sweep.settings(sweep.point(0))
    for option, text in [*(("--set", text) for text in work.settings), *((SWEEP, text) for text in first)]:
        path, _ = split_setting(text)
        may_be_parameter = path[0] == "parameters" or len(path) == 1
        if path[0] in work.command.ignored.split():
            hint = f"`{work.command.name}` does not read `{path[0]}`"
        elif may_be_parameter and all(_is_unused(path[-1], work, file, first) for file in files):
            hint = "a parameter is used if an expression of the document has its name"
        else:
            continue
        raise UsageError(f"{option} {'.'.join(map(str, path))}: no FILE has or uses this key", hint=hint)


def _is_unused(parameter: str | int, work: Work, file: str, first: Sequence[str]) -> bool:
    """Whether no document in a file uses a parameter. What can be read only once counts as if it did."""
    if not os.path.isfile(file):  # noqa: PTH113 - as typed
        return False
    try:
        return all(parameter in read(draft, first).unused for draft in work.drafts(file).each)
    except DocumentError:
        return False  # this is reported when the file is worked
