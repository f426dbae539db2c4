"""A plan: independent tasks in an order, and their results in that order, whoever works them out.

What a task is, and what its results are, is for those to say who make the plan: both can be pickled.
"""

from __future__ import annotations

import re
import signal
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from rigidcli.errors import ComputationError, UsageError, shown

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor

_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

AHEAD = 4
"""Tasks for each process, or worker, that are handed out before results are asked for: none of them waits."""

PAYS = 16
"""Tasks from which on processes pay that nobody has asked for: they take longer to start than a few tasks."""

MOST_JOBS = 1024
"""The most processes: more than any machine has cores for."""

_ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")
"""The address of a scheduler, as Dask writes it."""

Jobs: TypeAlias = int | str
"""How many processes work, or the address of the scheduler of a Dask cluster that does."""


def read_jobs(text: str | None) -> Jobs | None:
    """What stands after `--jobs`. Raises UsageError."""
    if text is None or _ADDRESS.fullmatch(text):
        return text
    if text.isdecimal() and 1 <= int(text[:9]) <= MOST_JOBS:
        return int(text)
    raise UsageError(
        f"read {shown(text)}, expected a number of processes from 1 to {MOST_JOBS}",
        hint="or the scheduler of a Dask cluster, as in `tcp://host:8786`",
    )


def usable_cores() -> int:
    """Processors that this process may run on."""
    from rigidcli import sandbox

    return sandbox.usable_cores()


def ordered(
    work: Callable[[_Task], Iterable[_Result]], tasks: Iterable[_Task], jobs: Jobs, least: int = 1
) -> Iterator[_Result]:
    """All results of each task, in the order of the tasks, of which `jobs` run at a time.

    Tasks are made when there is room for them, so that there may be any number. With one job, or fewer tasks
    than the `least`, all is done in this process, and each result comes at once. Raises ComputationError
    where a process ends early.
    """
    if isinstance(jobs, str):
        from rigidcli.cli.cluster import on_cluster

        yield from on_cluster(work, tasks, jobs, AHEAD)
        return
    tasks = iter(tasks)
    first = list(islice(tasks, least)) if jobs > 1 else []
    tasks = chain(first, tasks)
    if len(first) < least:
        for task in tasks:
            yield from work(task)
        return
    from concurrent.futures.process import BrokenProcessPool

    pool = _pool(jobs)
    waiting: deque[Future[list[_Result]]] = deque()
    try:
        for task in tasks:
            with warnings.catch_warnings():
                # Threads of a library for matrices do nothing at this moment.
                warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
                waiting.append(pool.submit(_all, work, task))
            if len(waiting) >= AHEAD * jobs:
                yield from waiting.popleft().result()
        while waiting:
            yield from waiting.popleft().result()
    except (BrokenProcessPool, OSError) as error:
        reason = (
            "a process that worked on it has ended" if isinstance(error, BrokenProcessPool) else str(error)
        )
        raise ComputationError(
            reason, hint="ask for fewer processes: `--jobs 1` needs least memory"
        ) from None
    finally:
        _end(pool)


def _all(work: Callable[[_Task], Iterable[_Result]], task: _Task) -> list[_Result]:
    """The results of a task, together."""
    return list(work(task))


def _pool(jobs: int) -> ProcessPoolExecutor:
    """Processes that have at once what is loaded here, where that is safe."""
    import sys
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("fork" if sys.platform == "linux" else "spawn")
    return ProcessPoolExecutor(jobs, context, _begin)


def _begin() -> None:
    """Leave it to the process that began this one to end it, when the user interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end(pool: ProcessPoolExecutor) -> None:
    """End all processes at once; what they work on is no longer wanted."""
    processes = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()
