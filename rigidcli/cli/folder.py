"""A table in a folder: each part is written by the process that works it out, in columns settled before."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from rigidcli.cli.output import Failure, Failures
from rigidcli.cli.work import Task, Work, answers, documents, lost
from rigidcli.errors import ComputationError, UsageError
from rigidcli.processes import Jobs, each
from rigidcli.render import parquet

if TYPE_CHECKING:
    from rigidcli.document.sweeps import Sweep

# Places of a sweep, or documents, of a part: a worker is busy with them for seconds.
PLACES, DOCUMENTS = 2048, 64
ERROR = "error"  # the column that says why a row has no results


def write_folder(
    folder: str, files: Sequence[str], sweep: Sweep | None, jobs: Jobs, work: Work, failures: Failures
) -> None:
    """Write the table of all answers; what is refused is a row of nulls with the reason, and a failure.

    The columns are those of the first, the middle and the last answer; a row that does not fit them is not
    written, and its `error` says so. Raises UsageError where the folder has files already, and where no such
    cluster is reached.
    """
    parquet.require_library()
    path = Path(folder).absolute()
    if path.is_dir() and any(path.iterdir()):
        raise UsageError(f"`{folder}` is not empty", hint="give a new folder for the parts of the table")
    parts = list(_parts(documents(work, files, sweep, jobs), sweep is not None))
    if not parts:
        return
    kinds: dict[str, str] = {}
    for part, end in ((parts[0], 0), (parts[len(parts) // 2], 0), (parts[-1], -1)):
        task = part[end]
        kinds = parquet.joined(kinds, _kinds(task._replace(places=task.places[end:][:1]), work))
    kinds = {name: kind or parquet.NUMBER for name, kind in kinds.items()}
    path.mkdir(parents=True, exist_ok=True)
    write = partial(_written, work=work, kinds=kinds, folder=path)
    for failed in each(write, enumerate(parts), jobs, lambda part: lost(part[1][0]).outcome):
        failures.tell(failed)
    failures.end()


def _parts(tasks: Iterator[Task], are_swept: bool) -> Iterator[Sequence[Task]]:
    """What becomes a part of the table: some places of a sweep of a document, or some documents."""
    if are_swept:
        yield from ([part] for task in tasks for part in task.cut(PLACES))
    while some := list(islice(tasks, DOCUMENTS)):
        yield some


def _kinds(task: Task, work: Work) -> dict[str, str]:
    """The columns of the answers to a task, and what they hold."""
    pieces = [answer.outcome for answer in answers(task, work) if not isinstance(answer.outcome, Failure)]
    columns = parquet.together(pieces).columns if pieces else {}
    return {name: parquet.kind(values) for name, values in columns.items()}


def _written(
    part: tuple[int, Sequence[Task]], work: Work, kinds: Mapping[str, str], folder: Path
) -> Iterator[Failure]:
    """Write a part of the table, and return what has failed in it."""
    from pyarrow.parquet import write_table

    rows: list[parquet.ParquetPiece] = []
    number, some = part
    for answer in (answer for task in some for single in task.cut(1) for answer in answers(single, work)):
        if (failed := _failure(answer.outcome, kinds)) is None:
            rows.append(answer.outcome)
        else:
            rows.append(parquet.ParquetPiece(1, {ERROR: [failed.text]}, {}))
            yield failed
    whole = parquet.together(rows)._replace(units={})
    write_table(parquet.as_table(whole, {**kinds, ERROR: parquet.TEXT}), folder / f"part.{number}.parquet")


def _failure(outcome: Failure | parquet.ParquetPiece, kinds: Mapping[str, str]) -> Failure | None:
    """The failure of an answer that has no row with these columns."""
    if isinstance(outcome, Failure):
        verb = "not computed" if outcome.code == ComputationError.exit_code else "refused"
        place = f"at {outcome.place}: " if outcome.place else ""
        return Failure(f"{verb}: {place}{outcome.text}", outcome.code)
    own = {name: parquet.kind(values) for name, values in outcome.columns.items()}
    if parquet.joined(kinds, own) == kinds:
        return None
    reason = "other columns, or texts where the first, middle and last row have numbers"
    return Failure(f"not computed: {reason}", ComputationError.exit_code)
