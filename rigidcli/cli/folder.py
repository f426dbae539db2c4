"""A table in a folder: workers of a Dask cluster write its parts, whose columns are settled beforehand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from importlib import util
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidcli.cli.failures import Failure, Failures
from rigidcli.cli.work import Task, Work, answers, documents
from rigidcli.errors import ComputationError, DocumentError, UsageError
from rigidcli.render import parquet

if TYPE_CHECKING:
    from rigidcli.document.sweeps import Sweep

Part: TypeAlias = Sequence[tuple[Task, range]]
"""Documents, each with the places of the sweep at which it is worked."""

PLACES, DOCUMENTS = 2048, 64
"""Places of a sweep, or documents, of a part: a worker is busy with them for seconds."""

ERROR = "error"
"""The column that says why a row has no results."""

CODES = {"refused: ": DocumentError.exit_code, "not computed: ": ComputationError.exit_code}
"""What an error begins with, and the exit code that follows from it."""

_TYPES = {parquet.TRUTH: "boolean", parquet.NUMBER: "float64", parquet.TEXT: "string"}
"""The types of pandas for what a column holds."""


def write_folder(
    folder: str, files: Sequence[str], sweep: Sweep | None, address: str, work: Work, failures: Failures
) -> None:
    """Write the table of all answers; what is refused is a row of nulls with the reason, and a failure.

    The columns are those of the first, the middle and the last answer; a row that does not fit them is not
    written, and its `error` says so. Raises UsageError where the folder has files already, and where no such
    cluster is reached.
    """
    if any(util.find_spec(library) is None for library in ("dask", "pandas", "pyarrow")):
        hint = "python -m pip install 'rigidcli[cluster,parquet]'"
        raise UsageError("dask, pandas or pyarrow is not installed", hint=hint)
    path = Path(folder).absolute()
    if path.is_dir() and any(path.iterdir()):
        raise UsageError(f"`{folder}` has files already, among which parts would be lost")
    parts = list(_parts(documents(work, files, sweep, address)))
    if not parts:
        return
    kinds: dict[str, str] = {}
    for part, last in ((parts[0], False), (parts[len(parts) // 2], False), (parts[-1], True)):
        task, places = part[-1 if last else 0]
        kinds = parquet.joined(kinds, _kinds(task._replace(place=places[-1 if last else 0]), work))
    kinds = {name: kind or parquet.NUMBER for name, kind in kinds.items()}
    from rigidcli.cluster import client

    with client(address) as reached:
        from dask import dataframe

        meta = _frame([], work, kinds)
        frame = dataframe.from_map(_frame, parts, work=work, kinds=kinds, meta=meta, enforce_metadata=False)
        frame.to_parquet(str(path), write_index=False, compute_kwargs={"scheduler": reached})
        errors = dataframe.read_parquet(str(path), columns=[ERROR])[ERROR].dropna()
        for error in errors.compute(scheduler=reached):
            failures.tell(Failure(error, next(CODES[start] for start in CODES if error.startswith(start))))
    failures.end()


def _parts(tasks: Iterator[Task]) -> Iterator[Part]:
    """What becomes a part of the table: some places of a sweep of a document, or some documents."""
    while some := list(islice(tasks, DOCUMENTS)):
        single = [(task, range(1)) for task in some if task.sweep is None]
        if single:
            yield single
        for task in some:
            count = 0 if task.sweep is None else task.sweep.count
            for begin in range(0, count, PLACES):
                yield [(task, range(begin, min(begin + PLACES, count)))]


def _kinds(task: Task, work: Work) -> dict[str, str]:
    """The columns of the answers to a task, and what they hold."""
    pieces = [answer.outcome for answer in answers(task, work) if not isinstance(answer.outcome, Failure)]
    columns = parquet.together(pieces).columns if pieces else {}
    return {name: parquet.kind(values) for name, values in columns.items()}


def _frame(part: Part, work: Work, kinds: Mapping[str, str]) -> Any:
    """A part of the table as pandas has it; it is made by a worker."""
    import pandas as pd

    rows: list[parquet.Piece] = []
    for task, places in part:
        for place in places:
            for answer in answers(task._replace(place=place), work):
                error = _error(answer.outcome, kinds)
                rows.append(parquet.Piece(1, {ERROR: [error]}, {}) if error else answer.outcome)
    columns = parquet.together(rows).columns
    count = sum(row.rows for row in rows)
    data = {
        name: pd.array(parquet.as_kind(columns.get(name, [None] * count), kind), dtype=_TYPES[kind])
        for name, kind in {**kinds, ERROR: parquet.TEXT}.items()
    }
    return pd.DataFrame(data)


def _error(outcome: Failure | parquet.Piece, kinds: Mapping[str, str]) -> str:
    """Why an answer has no row with these columns; "" where it has."""
    if isinstance(outcome, Failure):
        refused, failed = CODES
        place = f"at {outcome.place}: " if outcome.place else ""
        return f"{failed if outcome.code == ComputationError.exit_code else refused}{place}{outcome.text}"
    own = {name: parquet.kind(values) for name, values in outcome.columns.items()}
    if parquet.joined(kinds, own) != kinds:
        return "not computed: other columns, or texts where the first, middle and last row have numbers"
    return ""
