"""Work on many tasks: in this process, in others of this machine, or by the workers of a Dask cluster.

The work, its tasks and their results can be pickled.
"""

from __future__ import annotations

import pickle
import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from itertools import islice
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from rigidcli.errors import ComputationError

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

# How many processes work, or the address of the scheduler of a Dask cluster that does.
Jobs: TypeAlias = int | str

PACKS_AHEAD = 4  # packs of tasks that are queued for each process, so that none is idle
PACK_SECONDS = 0.1  # seconds of work in a pack of tasks: handing it over takes a hundredth of that
MOST_TASKS_IN_PACK = 256  # the most tasks in a pack, which bounds the memory for their results
# Held by a thread that works: a worker of a cluster may have several, which would share settings.
_ALONE = threading.Lock()


def each(
    work: Callable[[_Task], Iterable[_Result]],
    tasks: Iterable[_Task],
    jobs: Jobs,
    lost: Callable[[_Task], _Result],
) -> Iterator[_Result]:
    """All results of each task, in the order of the tasks.

    Tasks are read as they are needed, so that there may be any number, and handed out in packs.
    When a process is killed, its tasks are done again, one at a time; a task that kills its process twice
    yields `lost(task)`. With one job, all is done in this process, and each result comes at once.

    Raises ComputationError where no process can be started, and UsageError where no cluster is reached.
    """
    rest = iter(tasks)
    if jobs == 1:
        for task in rest:
            yield from work(task)
        return
    waiting: deque[tuple[list[_Task], Future[tuple[float, list[_Result]]]]] = deque()
    size = 1
    with ExitStack() as stack:
        executor, workers = stack.enter_context(_opened(jobs))
        while True:
            while len(waiting) < PACKS_AHEAD * workers and (pack := list(islice(rest, size))):
                waiting.append((pack, _submitted(executor, work, pack)))
            if not waiting:
                return
            pack, future = waiting.popleft()
            try:
                seconds, results = future.result()
            except Exception as error:  # only the errors of a lost process are meant here
                if not _has_ended(error):
                    raise
                stack.close()
                for task in pack:
                    yield from _alone(work, task, jobs, lost)
                executor, workers = stack.enter_context(_opened(jobs))
                waiting = deque((pack, _submitted(executor, work, pack)) for pack, _ in waiting)
            else:
                yield from results
                fitting = int(len(pack) * PACK_SECONDS / max(seconds, 1e-6))
                size = min(MOST_TASKS_IN_PACK, 2 * size, max(1, fitting))


def _alone(
    work: Callable[[_Task], Iterable[_Result]], task: _Task, jobs: Jobs, lost: Callable[[_Task], _Result]
) -> Iterable[_Result]:
    """The results of a task that is done again, by a process of its own."""
    with _opened(jobs if isinstance(jobs, str) else 1) as (executor, _):
        try:
            return _submitted(executor, work, [task]).result()[1]
        except Exception as error:  # as in `each`
            if not _has_ended(error):
                raise
            return [lost(task)]


def _submitted(
    executor: Executor, work: Callable[[_Task], Iterable[_Result]], pack: list[_Task]
) -> Future[tuple[float, list[_Result]]]:
    """The future of a pack. Raises ComputationError where no process can start.

    Tasks are pickled here, not by the feeder thread of the pool: cached properties would change under it.
    """
    from concurrent.futures import BrokenExecutor, Future

    data = pickle.dumps((work, pack), pickle.HIGHEST_PROTOCOL)
    try:
        with warnings.catch_warnings():
            # Threads of a library for matrices do nothing at this moment.
            warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
            return executor.submit(_done, data)
    except BrokenExecutor as error:
        broken: Future[tuple[float, list[_Result]]] = Future()
        broken.set_exception(error)
        return broken
    except OSError as error:
        raise ComputationError(
            f"no process can be started: {error.strerror or error}",
            hint="ask for fewer processes: `--jobs 1` needs least memory",
        ) from None


def _done(data: bytes) -> tuple[float, list[_Result]]:
    """How long a pack of tasks has taken (s), and its results."""
    work, pack = pickle.loads(data)  # noqa: S301 - `_submitted` has made it
    with _ALONE:
        begin = time.perf_counter()
        results = [result for task in pack for result in work(task)]
        return time.perf_counter() - begin, results


def _has_ended(error: Exception) -> bool:
    """Whether a process was killed. The error of a cluster is known by its name: its module loads slowly."""
    from concurrent.futures import BrokenExecutor

    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


def _opened(jobs: Jobs) -> AbstractContextManager[tuple[Executor, int]]:
    """A context that gives an executor and the number of its workers."""
    if isinstance(jobs, str):
        from rigidcli.cluster import opened

        return opened(jobs)
    return _pool(jobs)


@contextmanager
def _pool(jobs: int) -> Iterator[tuple[Executor, int]]:
    """A pool of processes on this machine. They are forked where that is safe, and share what is loaded."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("fork" if sys.platform == "linux" else "spawn")
    # Workers ignore Ctrl-C: their parent ends them.
    pool = ProcessPoolExecutor(jobs, context, signal.signal, (signal.SIGINT, signal.SIG_IGN))
    try:
        yield pool, jobs
    finally:
        # What they still work on is no longer wanted.
        processes = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()
