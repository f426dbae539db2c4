"""The work of a study: documents as they are, at points of a sweep, or from some starts, and the answers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rigidcli.cli.failures import Failure, failure
from rigidcli.commands import COMMANDS, STUDIES, Command
from rigidcli.errors import UNKNOWN, ComputationError, DocumentError, Path, RigidError, UsageError
from rigidcli.processes import Jobs
from rigidcli.render import TRAITS, Format, Look, piece, require_columns
from rigidcli.report import Field, Report

if TYPE_CHECKING:
    import pathlib

    from rigidcli.document.document import Document
    from rigidcli.document.draft import Draft
    from rigidcli.document.load import Drafts
    from rigidcli.document.sweeps import Sweep

Watch: TypeAlias = Callable[[], AbstractContextManager[Callable[[float], None]]]
"""Makes a context in which progress is shown, as a share of the whole."""

FEW = 16
"""FILES up to which ensembles are divided among processes: with more of them, the FILES are."""

TASKS, MOST_BLOCKS = 64, 16
"""Tasks of a large ensemble, and the most blocks of starts of one: each task reads the document anew."""


@dataclass(frozen=True, slots=True)
class Work:
    """What is asked of every document: a study with its options, how it is read, and how it is written.

    `settings` are those of `--set`, `named` has the keys that an option of its own has given. A picture of
    the result is drawn for `plot`, the path of a file or of a chart of characters.
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
        """What is in a file, for documents. Raises DocumentError."""
        from rigidcli.document.load import drafts

        return drafts(file, exact=self.exact, settings=self.settings, options=self.named)

    def run(self, document: Document, watch: Watch | None = None) -> Report:
        """The result of the study, worked out in a context that shows the progress."""
        require_fitting(document, self.command)
        run: Callable[..., Report] = import_module(f"rigidcli.studies.{self.command.name}").run
        if watch is None or not self.command.section:
            return run(document, **self.options)
        with watch() as show:
            return run(document, **self.options, progress=show)

    def answer(self, report: Report, files: Sequence[pathlib.Path]) -> Answer:
        """The answer that is a report, as it is handed over."""
        picture = None
        if self.plot is not None:
            from rigidcli.render.plots import CHARACTERS, chart, picture_file

            is_chart = self.plot == CHARACTERS
            picture = chart(report, self.look.width) if is_chart else picture_file(report, self.plot)
        require_columns(report, self.look.columns, TRAITS[self.format])
        found = piece(self.format, report, self.look)
        return Answer(report.source, found, report.notes, files=files, picture=picture)


class Answer(NamedTuple):
    """A piece of the output for a document, with notes on it, or the failure.

    `about` are notes on the file that it is the first document of; `files` are those that the document names.
    """

    source: str
    found: Any
    notes: Sequence[str] = ()
    about: Sequence[str] = ()
    files: Sequence[pathlib.Path] = ()
    picture: str | bytes | None = None


class Task(NamedTuple):
    """A document that is to be worked, or why there is none: at a `place` of a sweep, or from some `starts`.

    `about` are notes on the file that it is the first document of.
    """

    source: str
    draft: Draft | Failure
    about: Sequence[str] = ()
    sweep: Sweep | None = None
    place: int = 0
    starts: range | None = None


def require_fitting(document: Document, command: Command) -> None:
    """Raise DocumentError for a document that is for another command, which is named."""
    if any(getattr(document, section) is not None for section in command.needs):
        return
    for other in STUDIES:
        for section in COMMANDS[other].needs:
            if getattr(document, section) is not None:
                hint = f"this document has a `{section}`: `rigidcli {other} {document.source}`"
                raise document.refusal(f"missing: `{command.name}` needs it", command.needs[0], hint=hint)


def require_comparable(work: Work, files: Sequence[str]) -> None:
    """Raise UsageError where a FILE has several results, which have no column of their own to stand in."""
    from rigidcli.bodies.robots import is_robot

    for file in filter(is_robot, files):
        with suppress(DocumentError):  # which is told when the file is worked
            if len(work.drafts(file).each) > 1:
                hint = "`body: {robot: arm.urdf, link: forearm}` in a document is one of its links"
                raise UsageError(f"--compare: `{file}` has several results", hint=hint)


def tasks(work: Work, files: Sequence[str], sweep: Sweep | None, jobs: Jobs) -> Iterator[Task]:
    """The tasks that answer for all FILES, each made when it is asked for, for so many processes."""
    for task in documents(work, files, sweep, jobs):
        yield task
        for place in range(1, 1 if task.sweep is None else task.sweep.count):
            yield Task(task.source, task.draft, (), task.sweep, place)


def documents(work: Work, files: Sequence[str], sweep: Sweep | None, jobs: Jobs) -> Iterator[Task]:
    """A task for each document of the FILES, or several for its ensemble, or its first point of a sweep.

    FILES are read here, and what they name where they are worked. One that cannot be swept is a failure,
    once and not at every value.
    """
    divided = sweep is None and jobs != 1 and len(files) <= FEW and work.command.section
    for file in files:
        try:
            drafts, notes = work.drafts(file)
        except (RigidError, MemoryError) as error:
            yield Task(file, failure(error, file))
            continue
        for draft in drafts:
            try:
                fitting = None if sweep is None else _fitting(draft, sweep, work.command)
                blocks = _blocks(draft) if divided else (None,)
            except (RigidError, MemoryError) as error:
                yield Task(draft.source, failure(error, draft.source), notes)
            else:
                sent = draft.absolute() if isinstance(jobs, str) else draft
                for starts in blocks:
                    yield Task(draft.source, sent, notes, fitting, starts=starts)
                    notes = ()
            notes = ()


def _blocks(draft: Draft) -> Sequence[range | None]:
    """Starts of the ensemble of a document that are worked at a time; None of one that has no ensemble."""
    from rigidcli.document.load import read

    document = read(draft)
    if document.ensemble is None:
        return (None,)
    from rigidcli.studies.ensembles import block

    count, size = len(document.ensemble), block(document)
    size *= max(1, min(MOST_BLOCKS, count // (TASKS * size)))
    return [range(begin, min(begin + size, count)) for begin in range(0, count, size)]


def _fitting(draft: Draft, sweep: Sweep, command: Command) -> Sweep:
    """The sweep with the kind of number of the document; raises RigidError where no document has its keys."""
    from rigidcli.document.load import is_exact, read

    first = sweep.settings(sweep.point(0))
    exact = is_exact(draft, first)
    try:
        ensemble = read(draft, first).ensemble
        if ensemble is not None and command.section:
            raise UsageError(
                f"a sweep has one row a value, and this document an ensemble of {len(ensemble):,} starts",
                hint="give one start, and sweep over it, or leave out `--sweep`",
            )
    except DocumentError as error:
        if unknown := [problem for problem in error.problems if problem.code == UNKNOWN]:
            raise DocumentError(unknown) from None
    return replace(sweep, exact=exact)


def answers(task: Task, work: Work, watch: Watch | None = None) -> Iterator[Answer]:
    """The answers to a task: one, or for an ensemble several; `watch` is a context for its progress."""
    if isinstance(task.draft, Failure):
        yield Answer(task.source, task.draft, about=task.about)
        return
    about = task.about
    for answer in _answers(task, task.draft, work, watch):
        yield answer._replace(about=about) if about else answer
        about = ()


def _answers(task: Task, draft: Draft, work: Work, watch: Watch | None) -> Iterator[Answer]:
    from rigidcli.document.load import read

    files, settings = tuple[Any, ...](), list[str]()
    try:
        if task.sweep is not None:
            point = task.sweep.point(task.place)
            settings = task.sweep.settings(point)
        document = read(draft, settings)
        files = tuple(document.files)
        if document.ensemble is not None and work.command.section:
            yield from _of_ensemble(document, work, task.starts)
            return
        report = work.run(document, watch)
        if task.sweep is not None:
            units = {entry.key: entry.unit for entry in report.fields}
            swept = (
                Field(name, value, unit=unit or units.get(name, ""), cells={name: ()})
                for name, value, unit in task.sweep.swept(point, document.exact_results)
            )
            report = replace(report, swept=tuple(swept))
        yield work.answer(report, files)
    except (RigidError, MemoryError) as error:
        found = replace(failure(error, task.source), place=", ".join(settings))
        yield Answer(task.source, found, files=files)


def _of_ensemble(document: Document, work: Work, starts: range | None) -> Iterator[Answer]:
    """The answers for these starts of the ensemble of a document, or for all. Raises RigidError."""
    from rigidcli.studies.ensembles import Together, reports, require_one_start

    assert document.ensemble is not None
    several: Together | None = None
    if work.command.name == "euler":
        from rigidcli.studies.euler.closed import together as several
    shown = ("picture", "scene", "steps")
    alone = replace(work, options={name: work.options[name] for name in work.options if name not in shown})
    source, files = document.source, tuple(document.files)
    require_one_start(document, work.options)
    places = range(len(document.ensemble)) if starts is None else starts
    form = TRAITS[work.format].ensembles
    for place, found in reports(document, alone.run, form, places, several):
        if isinstance(found, RigidError):
            yield Answer(source, replace(failure(found, source), place=f"start {place}"), files=files)
        else:
            yield work.answer(found, files)


def lost(task: Task) -> Failure:
    """The failure of a task that has ended the process that worked on it."""
    hint = "mostly it needs more memory: allow more, or ask for fewer samples"
    return failure(ComputationError("the process that worked on it has ended, twice", hint=hint), task.source)


IDLE = {
    "inertia": "motion top tide system orbit equilibrium transform",
    "axes": "top tide system orbit equilibrium transform",
    "precess": "system orbit equilibrium transform",
    "euler": "tide system orbit equilibrium transform",
    "hamilton": "body about axis frame motion top tide",
}
"""The keys at the top of a document that a command does not read."""


def require_used(work: Work, files: Sequence[str], sweep: Sweep | None) -> None:
    """Raise UsageError for a key that is set or swept, and that no FILE has or uses.

    Nothing is said where a FILE can be read only once, as standard input and pipes.
    """
    from rigidcli.document.draft import SWEEP, split_setting

    first = [] if sweep is None else sweep.settings(sweep.point(0))
    given = [("--set", text) for text in work.settings] + [(SWEEP, text) for text in first]
    for option, text in given:
        path, _ = split_setting(text)
        key = ".".join(map(str, path))
        if key not in work.named and all(_is_idle(work, file, path, first) for file in files):
            hint = f"`{work.command.name}` does not read `{path[0]}`"
            if path[0] == "parameters":
                hint = "a parameter is used where its name stands in the document"
            raise UsageError(f"{option} {key}: no FILE has this key, or uses it", hint=hint)


def _is_idle(work: Work, file: str, path: Path, first: Sequence[str]) -> bool:
    """Whether no document of a file has what the path leads to, nor does the command use it there."""
    if not os.path.isfile(file):  # noqa: PTH113 - as typed
        return False
    try:
        return all(_is_idle_in(draft, work, path, first) for draft in work.drafts(file).each)
    except DocumentError:
        return False  # it is told when the file is worked


def _is_idle_in(draft: Draft, work: Work, path: Path, first: Sequence[str]) -> bool:
    from rigidcli.document.load import read

    tree, rest = draft.tree, list(path)
    while rest and isinstance(tree, dict) and rest[0] in tree:
        tree = tree[rest.pop(0)]
    is_parameter = path[0] == "parameters"
    if not rest or not (is_parameter or path[0] in IDLE[work.command.name].split()):
        return False
    try:
        return not is_parameter or path[-1] in read(draft, first).unused
    except DocumentError as error:  # a key that no document has is told when the file is worked
        return not is_parameter and UNKNOWN not in {problem.code for problem in error.problems}
