"""Work on many tasks: in this process, in others of this machine, or by the workers of a Dask cluster.

Whoever calls `each` says what a task is, and what its results are; both can be pickled.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Generic, Self, TypeAlias, TypeVar

from rigidcli.errors import ComputationError

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future
    from types import TracebackType

_Task = TypeVar("_Task")
_Result = TypeVar("_Result")

Jobs: TypeAlias = int | str
"""How many processes work, or the address of the scheduler of a Dask cluster that does."""

AHEAD = 4
"""Packs of tasks for each process that are handed out before results are asked for: none of them waits."""

PACK = 0.1
"""Seconds that a process is busy with a pack of tasks: to hand it over takes a hundredth of that."""

MOST = 256
"""The most tasks of a pack, which bounds the memory that their results take."""

_ALONE = threading.Lock()
"""Held by a thread that works: a worker of a cluster may have several, which would share settings."""


@dataclass(frozen=True, slots=True)
class Lost(Generic[_Task]):
    """A task that has ended the process that worked on it, twice: it has no result."""

    task: _Task


def each(
    work: Callable[[_Task], Iterable[_Result]], tasks: Iterable[_Task], jobs: Jobs
) -> Iterator[_Result | Lost[_Task]]:
    """All results of each task, in the order of the tasks.

    Tasks are taken when there is room for them, so that there may be any number, and handed out in packs.
    When a process ends early, the tasks that it had are done again, one at a time: the one that ends a
    process again is `Lost`. With one job, all is done in this process, and each result comes at once.
    Raises ComputationError where no process can be started, and UsageError where no cluster is reached.
    """
    rest = iter(tasks)
    if jobs == 1:
        for task in rest:
            yield from work(task)
        return
    waiting: deque[tuple[list[_Task], Future[tuple[float, list[_Result]]]]] = deque()
    size = 1
    with _Workers(jobs) as workers:
        while True:
            while len(waiting) < AHEAD * workers.count() and (pack := list(islice(rest, size))):
                waiting.append((pack, workers.submit(_done, work, pack)))
            if not waiting:
                return
            pack, future = waiting.popleft()
            try:
                seconds, results = future.result()
            except Exception as error:  # only the errors of a lost process are meant here
                if not _ended(error):
                    raise
                for task in pack:
                    yield from _alone(workers, work, task)
            else:
                yield from results
                size = min(MOST, 2 * size, max(1, int(len(pack) * PACK / max(seconds, 1e-6))))


def _done(work: Callable[[_Task], Iterable[_Result]], pack: list[_Task]) -> tuple[float, list[_Result]]:
    """How long a pack of tasks has taken (s), and its results."""
    with _ALONE:
        begin = time.perf_counter()
        results = [result for task in pack for result in work(task)]
        return time.perf_counter() - begin, results


def _alone(
    workers: _Workers, work: Callable[[_Task], Iterable[_Result]], task: _Task
) -> Iterable[_Result | Lost[_Task]]:
    """The results of a task that is done again."""
    try:
        return workers.submit(_done, work, [task]).result()[1]
    except Exception as error:  # as in `each`
        if not _ended(error):
            raise
        return [Lost(task)]


def _ended(error: Exception) -> bool:
    """Whether a process has ended early. The error of a cluster is seen by its name: it loads slowly."""
    from concurrent.futures import BrokenExecutor

    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


class _Workers:
    """What works on tasks; a context that ends it. A pool of which a process has ended is opened anew."""

    def __init__(self, jobs: Jobs) -> None:
        self._jobs = jobs
        self._stack = ExitStack()
        self._executor: Executor
        self.count: Callable[[], int]

    def __enter__(self) -> Self:
        if isinstance(self._jobs, str):
            from rigidcli.cluster import opened

            self._executor, self.count = self._stack.enter_context(opened(self._jobs))
        else:
            jobs = self._jobs
            self._executor, self.count = self._stack.enter_context(_pool(jobs)), lambda: jobs
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def submit(self, function: Callable[..., _Result], *arguments: object) -> Future[_Result]:
        """The result of a function that is to come. Raises ComputationError where no process can start."""
        from concurrent.futures import BrokenExecutor

        try:
            with warnings.catch_warnings():
                # Threads of a library for matrices do nothing at this moment.
                warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
                return self._executor.submit(function, *arguments)
        except BrokenExecutor:
            self._stack.close()
            self.__enter__()
            return self.submit(function, *arguments)
        except OSError as error:
            raise ComputationError(
                f"no process can be started: {error.strerror or error}",
                hint="ask for fewer processes: `--jobs 1` needs least memory",
            ) from None


@contextmanager
def _pool(jobs: int) -> Iterator[Executor]:
    """Processes of this machine, which have at once what is loaded here, where that is safe."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    pool = ProcessPoolExecutor(jobs, get_context("fork" if sys.platform == "linux" else "spawn"), _begin)
    try:
        yield pool
    finally:
        # What they still work on is no longer wanted.
        processes = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()


def _begin() -> None:
    """Leave it to the process that began this one to end it, when the user interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
