"""The work of a computing command: a document, at one point of a sweep or as it is, and its report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias, TypeVar

from rigidcli.cli.failures import Failure, Failures, failure
from rigidcli.cli.requirements import require_columns, require_fitting
from rigidcli.errors import UNKNOWN, DocumentError, RigidError, UsageError
from rigidcli.report import Field, Report

if TYPE_CHECKING:
    from pathlib import Path

    from rigidcli.document.document import Document
    from rigidcli.document.files import Drafts
    from rigidcli.document.load import Draft
    from rigidcli.document.sweeps import Sweep
    from rigidcli.studies.ensembles import Form

Watch: TypeAlias = Callable[[], AbstractContextManager[Callable[[float], None]]]
"""What makes a context in which progress is told, as a share of the whole."""

FOLLOW = ("euler", "hamilton")
"""The studies that follow a motion, and tell how far they are; a document may have an ensemble of starts."""

TASKS, MOST_BLOCKS = 64, 16
"""Tasks of a large ensemble, and the most blocks of starts of one: each task reads the document anew."""

AT_A_TIME = 32
"""Points of a sweep of one task: they take longer than to hand them to a process."""

FILES_AT_A_TIME = 64
"""FILES of one task."""


@dataclass(frozen=True, slots=True)
class Work:
    """What is asked of every document: a study with its options, and how the document is read.

    `settings` are those of `--set`, `named` has the keys that an option of its own has given. `require`
    raises RigidError for a report that cannot be written. `ensembles` says how these are told.
    `columns` are those that are asked for, of the table of data. Where `in_rows` is not None, reports of a
    sweep, whose keys it has, and reports without data are written as rows, and the columns are those of rows.
    `write` makes texts of reports, where each is written by itself: texts are handed over in less time.
    """

    study: str
    options: Mapping[str, Any]
    exact: bool
    settings: Sequence[str]
    named: Mapping[str, str]
    columns: tuple[str, ...]
    require: Callable[[Report], None] | None
    ensembles: Form = "starts"
    in_rows: tuple[str, ...] | None = None
    write: Callable[[Iterable[Report]], Iterator[str]] | None = None

    def drafts(self, file: str) -> Drafts:
        """What is in a file, for documents. Raises DocumentError."""
        from rigidcli.document.files import drafts

        return drafts(file, exact=self.exact, settings=self.settings, options=self.named)

    def report(self, document: Document, watch: Watch | None) -> Report:
        """What the study finds, within the context in which it may tell its progress."""
        require_fitting(document, self.study)
        run = import_module(f"rigidcli.studies.{self.study}").run
        if watch is None or self.study not in FOLLOW:
            report: Report = run(document, **self.options)
        else:
            with watch() as show:
                report = run(document, **self.options, progress=show)
        require_columns(report, self.columns, self.in_rows)
        if self.require is not None:
            self.require(report)
        return report


class Texts(NamedTuple):
    """What is written of a report: its text, or one for each point of a sweep; and its notes."""

    source: str
    notes: Sequence[str]
    texts: Sequence[str]


_Found = TypeVar("_Found")


class Answer(NamedTuple, Generic[_Found]):
    """What is found for a document, or the failure; `files` are those that the document names.

    `notes` are on the file that it is the first document of. `start` is the place of a start of an ensemble.
    """

    source: str
    found: _Found | Failure
    files: Sequence[Path] = ()
    notes: Sequence[str] = ()
    start: int | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """What a process works out at a time: some FILES, or some `places` of a sweep of the document in one.

    `read` is what is in the FILES, for a process that cannot read them itself.
    """

    work: Work
    files: Sequence[str]
    read: Sequence[Drafts | Failure] | None = None
    draft: Draft | None = None
    sweep: Sweep | None = None
    places: range = range(0)


def tasks(
    work: Work, files: Sequence[str], sweep: Sweep | None, failures: Failures, jobs: int | str = 1
) -> Iterator[Task]:
    """The tasks that answer for all FILES, each made when it is asked for, for so many processes.

    A file that cannot be swept is a failure, once and not at every value. Tasks for a cluster, of
    which `jobs` is the address, have what is in the FILES with them.
    """
    afar = isinstance(jobs, str)
    if isinstance(jobs, int) and sweep is None and len(files) <= jobs > 1 and work.study in FOLLOW:
        for file in files:
            yield from _parts(work, file)
        return
    if sweep is None:
        for begin in range(0, len(files), FILES_AT_A_TIME):
            some = files[begin : begin + FILES_AT_A_TIME]
            yield Task(work, some, [_read(work, file, afar=True) for file in some] if afar else None)
        return
    for file in files:
        with failures.of(file):
            for draft in work.drafts(file).each:
                fitting = _fitting(draft, sweep, work.study)
                draft = draft.absolute() if afar else draft
                for begin in range(0, sweep.count, AT_A_TIME):
                    places = range(begin, min(begin + AT_A_TIME, sweep.count))
                    yield Task(work, [file], None, draft, fitting, places)


def _parts(work: Work, file: str) -> Iterator[Task]:
    """The tasks of a file, several where it holds an ensemble; what is wrong with it is told by the first."""
    with suppress(RigidError):
        (draft,) = work.drafts(file).each
        document = draft.document()
        if document.ensemble is not None:
            from rigidcli.studies.ensembles import block

            count, size = len(document.ensemble), block(document)
            size *= max(1, min(MOST_BLOCKS, count // (TASKS * size)))
            for begin in range(0, count, size):
                yield Task(work, [file], draft=draft, places=range(begin, min(begin + size, count)))
            return
    yield Task(work, [file])


def _fitting(draft: Draft, sweep: Sweep, study: str) -> Sweep:
    """The sweep with the kind of number of the document; raises RigidError where no document has its keys."""
    first = sweep.settings(sweep.point(0))
    exact = draft.is_exact(first)
    try:
        ensemble = draft.document(first).ensemble
        if ensemble is not None and study in FOLLOW:
            raise UsageError(
                f"a sweep has one row a value, and this document an ensemble of {len(ensemble):,} starts",
                hint="give one start, and sweep over it, or leave out `--sweep`",
            )
    except DocumentError as error:
        unknown = [problem for problem in error.problems if problem.code == UNKNOWN]
        if unknown:
            raise DocumentError(unknown) from None
    return sweep.exactly() if exact else sweep


def texts(task: Task, watch: Watch | None = None) -> Iterator[Answer[Texts]]:
    """What is written of the answers to a task, by a work that has a `write`: else as `answers`."""
    write = task.work.write
    assert write is not None
    for answer in answers(task, watch):
        found: Report | Texts | Failure = answer.found
        if isinstance(found, Report):
            found = Texts(found.source, found.notes, [*write([found])])
        yield Answer(answer.source, found, answer.files, answer.notes, answer.start)


def answers(task: Task, watch: Watch | None = None) -> Iterator[Answer[Report]]:
    """The answers to a task in their order; `watch` is a context in which one may tell its progress."""
    if task.draft is not None and task.sweep is None:
        yield from _of_document(task.work, task.draft.source, task.draft.document, watch, task.places)
        return
    if task.draft is None or task.sweep is None:
        yield from _of_files(task, watch)
        return
    yield from (_at_point(task, task.draft, task.sweep, place) for place in task.places)


def _at_point(task: Task, draft: Draft, sweep: Sweep, place: int) -> Answer[Report]:
    """The answer at one point of a sweep; a failure says which."""
    try:
        point = sweep.point(place)
    except UsageError as error:
        return Answer(draft.source, failure(error, draft.source))
    settings = sweep.settings(point)
    answer = _answer(task.work, draft.source, lambda: draft.document(settings), None)
    found = answer.found
    if isinstance(found, Failure):
        return answer._replace(found=replace(found, place=", ".join(settings)))
    units = {entry.key: entry.unit for entry in found.fields}
    swept = [
        Field(name, value, unit=unit or units.get(name, ""), cells={name: ()})
        for name, value, unit in sweep.told(point, draft.is_exact(settings))
    ]
    return answer._replace(found=replace(found, swept=tuple(swept)))


def _read(work: Work, file: str, *, afar: bool = False) -> Drafts | Failure:
    """What is in a file, or why it cannot be read."""
    try:
        drafts = work.drafts(file)
    except (RigidError, MemoryError) as error:
        return failure(error, file)
    return drafts._replace(each=[draft.absolute() for draft in drafts.each]) if afar else drafts


def _of_files(task: Task, watch: Watch | None) -> Iterator[Answer[Report]]:
    """The answers to all documents of FILES."""
    files = zip(task.files, task.read or (_read(task.work, file) for file in task.files), strict=True)
    for file, found in files:
        yield from _of_file(task.work, file, found, watch)


def _of_file(work: Work, file: str, found: Drafts | Failure, watch: Watch | None) -> Iterator[Answer[Report]]:
    """The answers to all documents of a file, in which this is found."""
    if isinstance(found, Failure):
        yield Answer(file, found)
        return
    drafts, notes = found
    for draft in drafts:
        for answer in _of_document(work, file, draft.document, watch):
            yield answer._replace(notes=notes) if notes else answer
            notes = ()


def _of_document(
    work: Work, source: str, read: Callable[[], Document], watch: Watch | None, places: range | None = None
) -> Iterator[Answer[Report]]:
    """The answer to a document, or those to its ensemble, at these places or all."""
    try:
        document = read() if work.study in FOLLOW else None
        ensemble = None if document is None else document.ensemble
    except (RigidError, MemoryError) as error:
        yield Answer(source, failure(error, source))
        return
    if document is None or ensemble is None:
        yield _answer(work, source, read if document is None else lambda: document, watch)
        return
    from rigidcli.studies.ensembles import Together, reports, require_one_start

    several: Together | None = None
    if work.study == "euler":
        from rigidcli.studies.euler.ensemble import together as several
    alone = {key: value for key, value in work.options.items() if key not in ("picture", "scene", "steps")}

    def run(one: Document) -> Report:
        with one.placing():
            return replace(work, options=alone, columns=()).report(one, None)

    source, files = document.source, tuple(document.files)
    asked = range(len(ensemble)) if places is None else places
    try:
        require_one_start(document, work.options)
        for place, found in reports(document, run, work.ensembles, asked, several):
            if isinstance(found, RigidError):
                yield Answer(source, replace(failure(found, source), place=f"start {place}"), files)
            else:
                require_columns(found, work.columns, work.in_rows)
                yield Answer(source, found, files, start=place)
    except (RigidError, MemoryError) as error:
        yield Answer(source, failure(error, source), files)


def _answer(work: Work, source: str, read: Callable[[], Document], watch: Watch | None) -> Answer[Report]:
    files: Sequence[Path] = ()
    try:
        document = read()
        files = tuple(document.files)
        with document.placing():
            return Answer(document.source, work.report(document, watch), files)
    except (RigidError, MemoryError) as error:
        return Answer(source, failure(error, source), files)
