"""A table in a folder: parts, written by those who work them out, and a manifest that tells what they are."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import orjson
import typer

import rigidcli
from rigidcli.cli.failures import Failure, Failures, bad_parameter, tell_notes
from rigidcli.cli.output import OTHER_NAME
from rigidcli.cli.plan import Jobs, ordered
from rigidcli.cli.progress import counted
from rigidcli.cli.sweeps import Known
from rigidcli.cli.work import AT_A_TIME, Task, answers
from rigidcli.errors import UsageError
from rigidcli.render import Look
from rigidcli.render.parquet import Kinds, Rows, described, differ, joined, recast, require_library

MANIFEST = "manifest.json"
"""The file that is written last: where it is, all parts are."""

PARTS = 1024
"""Parts of a table of up to some 1e7 rows: enough for as many processes."""

MOST_TASKS = 2048
"""The most tasks of a part, whose 65,536 rows are worked in a minute, and are lost when a worker is.

Tasks whose points are worked at once have more rows, and count as several.
"""


@dataclass(frozen=True, slots=True)
class Part:
    """What becomes one file of a folder: the answers to some tasks."""

    path: Path
    tasks: Sequence[Task]


@dataclass(frozen=True, slots=True)
class Told:
    """What the user is told of an answer: notes on it, and why there is none."""

    source: str
    notes: Sequence[str]
    failure: Failure | None = None


@dataclass(frozen=True, slots=True)
class Written:
    """A part that is written, unless it has no rows: its columns, and what is told of its answers."""

    path: Path
    rows: int
    kinds: Kinds
    answers: int
    told: Sequence[Told]


def is_folder(path: str | None) -> bool:
    """Whether a table goes to a folder: its name ends so, or one is there."""
    return path is not None and (path.endswith(("/", "\\")) or Path(path).is_dir())


def write_parts(
    output: str,
    tasks: Iterable[Task],
    count: int,
    look: Look,
    jobs: Jobs,
    about: dict[str, Any],
    tell: Callable[[Written], None],
) -> None:
    """Write the table of all answers, of which there are `count`, to a folder that has no files yet.

    Here, the folder comes whole or not at all. On a cluster, its workers write the parts to the folder of
    that name where they are, each at once, and the manifest is written here at the end. `about` is the rest
    of the manifest. Raises UsageError where the folder cannot be written.
    """
    with _refused(output), _place(Path(output).absolute(), jobs) as folder:
        size = AT_A_TIME * min(MOST_TASKS, max(1, count // (AT_A_TIME * PARTS)))
        documents: dict[str, str | None] = {}
        files: list[dict[str, Any]] = []
        by_columns: dict[tuple[Any, ...], list[Path]] = {}
        for part in ordered(partial(_written, look=look), _parts(folder, tasks, size, documents), jobs):
            tell(part)
            if part.rows:
                files.append({"file": part.path.name, "rows": part.rows})
                by_columns.setdefault(tuple(part.kinds.items()), []).append(part.path)
        if not files:
            return
        kinds = joined(map(dict, by_columns))
        others = [path for own, paths in by_columns.items() if differ(dict(own), kinds) for path in paths]
        for path in () if isinstance(jobs, str) else others:
            recast(path, kinds)
        if others and isinstance(jobs, str):
            from rigidcli.cli.cluster import everywhere

            everywhere(partial(_recast_all, kinds=kinds), others, jobs)
        folder.mkdir(parents=True, exist_ok=True)
        manifest = {
            "schema": "rigidcli.parts/1",
            "rigidcli": rigidcli.__version__,
            **about,
            "documents": [{"source": source, "text": text} for source, text in documents.items()],
            "columns": described(kinds),
            "rows": sum(file["rows"] for file in files),
            "parts": files,
        }
        path = folder / MANIFEST
        path.write_bytes(orjson.dumps(manifest, option=orjson.OPT_INDENT_2) + b"\n")


@contextmanager
def _place(folder: Path, jobs: Jobs) -> Iterator[Path]:
    """Where parts are written: on a cluster the folder itself, and here one beside it that takes its place.

    Raises UsageError where it has files already, which would be taken for parts of the table.
    """
    if folder.exists() and any(folder.iterdir()):
        raise UsageError(f"`{folder}` has files already, among which parts would be lost", hint=OTHER_NAME)
    if isinstance(jobs, str):
        yield folder
        return
    with tempfile.TemporaryDirectory(prefix=".rigidcli-", dir=folder.parent) as name:
        stage = Path(name) / "parts"
        stage.mkdir()
        yield stage
        if (stage / MANIFEST).exists():
            if folder.exists():
                folder.rmdir()
            stage.rename(folder)


@contextmanager
def _refused(output: str) -> Iterator[None]:
    """A context in which a folder that cannot be written is a UsageError."""
    try:
        yield
    except OSError as error:
        raise UsageError(f"`{output}` cannot be written: {error.strerror or error}") from None


def _parts(
    folder: Path, tasks: Iterable[Task], size: int, documents: dict[str, str | None]
) -> Iterator[Part]:
    """Parts of so many rows, or of one task; FILES are gathered on the way, with the texts of swept ones."""
    some: list[Task] = []
    number = rows = 0
    for task in tasks:
        for file in task.files:
            documents.setdefault(file, None if task.draft is None else task.draft.places.text)
        some.append(task)
        rows += len(task.places) or len(task.files)
        if rows >= size:
            yield Part(folder / f"part-{number:05}.parquet", some)
            some, rows, number = [], 0, number + 1
    if some:
        yield Part(folder / f"part-{number:05}.parquet", some)


def _written(part: Part, look: Look) -> Iterator[Written]:
    """A part, once it is written."""
    told: list[Told] = []
    known = set[str]()
    count = 0
    with _refused(str(part.path)):
        part.path.parent.mkdir(parents=True, exist_ok=True)
        with Rows(part.path, look) as rows:
            for task in part.tasks:
                for answer in answers(task):
                    count += 1
                    if isinstance(answer.found, Failure):
                        told.append(Told(answer.source, answer.notes, answer.found))
                        continue
                    rows.add(answer.found)
                    notes = answer.found.notes
                    if answer.found.swept:
                        notes = tuple(note for note in notes if note not in known)
                        known.update(notes)
                    if notes or answer.notes:
                        told.append(Told(answer.source, (*answer.notes, *notes)))
        yield Written(part.path, rows.count, rows.kinds, count, told)


def _recast_all(paths: Sequence[Path], kinds: Kinds) -> Iterator[None]:
    """Let those of the parts that are here have the columns of the whole table."""
    for path in paths:
        recast(path, kinds)
    yield None


def goes_to_folder(output: str | None) -> bool:
    """Whether a table in Parquet goes to a folder. Raises BadParameter where it cannot be written."""
    with bad_parameter("--format"):
        require_library()
    if output in (None, "-"):
        problem = "parquet is no text, and needs a file or a folder: `-o table.parquet` or `-o table/`"
        raise typer.BadParameter(problem, param_hint="'--format'")
    return is_folder(output)


def write_folder(
    output: str,
    parts: Iterator[Task],
    total: int,
    look: Look,
    hands: int | str,
    about: dict[str, Any],
    failures: Failures,
    quiet: bool,
) -> None:
    """Write the table of all answers to a folder, and tell what is to be told of each part."""
    known = Known()
    with counted(total) as done:

        def tell(part: Written) -> None:
            for each in part.told:
                tell_notes(each.source, known.new(each.notes) if about["sweep"] else each.notes, quiet)
                if each.failure is not None:
                    failures.tell(each.failure)
            for _ in range(part.answers):
                done()

        write_parts(output, parts, total, look, hands, about, tell)
    failures.end()
