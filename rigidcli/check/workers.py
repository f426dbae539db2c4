"""Work on many untrusted things, in processes that `sandbox` confines and that serve one thing after another.

A process that breaks its limits ends with the thing that it works on, and another takes its place. Where that
is safe (Linux), a process is a fork: it has at once what is loaded and worked out.
"""

from __future__ import annotations

import contextlib
import gc
import math
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

from rigidcli.errors import ComputationError
from rigidcli.sandbox import Limits, address_space, confine, start_clock, stop_clock

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_Task = TypeVar("_Task")

METHOD = "fork" if sys.platform == "linux" else "spawn"
"""How processes start: on other systems a fork is not safe, or not there."""

PATIENCE = {"fork": 0.5, "spawn": 60.0}
"""Seconds beyond the limit after which a process is ended from outside: a new one loads the program first."""

_FRESH, _WHOLE = b"f", b"="
"""Marks before what is handed over: bytes, because pickled objects of a process in doubt are not opened."""

WORN = 8
"""A process that has kept a WORNth of its memory after some work serves no more: the next has room."""


@dataclass(frozen=True, slots=True)
class Ended:
    """Work that came to nothing: the code of a finding, and its detail."""

    code: str
    detail: str = ""


_LATE = Ended("timeout")
_NO_MEMORY = Ended("too_large", "it takes too much memory")
_TOO_MUCH = Ended("too_large", "there is too much to say of it")
_STOPPED = Ended("not_allowed", "the process that judged it was stopped")

_SIGNALS = {
    "SIGALRM": _LATE,
    "SIGABRT": _NO_MEMORY,
    "SIGBUS": _NO_MEMORY,
    "SIGKILL": _NO_MEMORY,
    "SIGSEGV": Ended("too_large", "the process that judged it broke down"),
}
"""What it means when a signal ends a process; the system kills one when memory runs out for all."""

Result: TypeAlias = bytes | Ended
"""What comes of work: what it hands over, or why that is nothing."""


def each(
    work: Callable[[_Task], bytes],
    tasks: Sequence[_Task],
    jobs: int,
    limits: Limits,
    progress: Callable[[float], None],
) -> Iterator[Result]:
    """What `work` makes of each task, in the order of tasks, whatever is done first; `jobs` run at a time.

    `progress` is told the share that is done. Raises ComputationError where no process can be started.
    """
    workers: list[_Worker] = []
    done: dict[int, Result] = {}
    begun = finished = 0
    gc.freeze()  # the collection of garbage leaves alone what is there, so that forks can share it
    try:
        for index in range(len(tasks)):
            while index not in done:
                for worker in workers:
                    if worker.is_free and begun < len(tasks):
                        worker.give(begun, tasks[begun], limits)
                        begun += 1
                while begun < len(tasks) and len(workers) < jobs:
                    if not _start(workers, work, limits):
                        break
                    workers[-1].give(begun, tasks[begun], limits)
                    begun += 1
                for worker in _ready(workers):
                    ended = worker.index
                    done[ended] = worker.take()
                    finished += 1
                    progress(finished / len(tasks))
                    if not worker.is_free:
                        workers.remove(worker)
                        worker.end()
            yield done.pop(index)
    finally:
        gc.unfreeze()
        for worker in workers:
            worker.end()


class _Worker:
    """A process, and the task that it works on; its `index` is negative while it is free."""

    def __init__(self, process: Any, line: Connection) -> None:
        self._process = process
        self.line = line
        self.index = -1
        self.deadline = math.inf

    @property
    def is_free(self) -> bool:
        """Whether it waits for work."""
        return self.index < 0

    def give(self, index: int, task: object, limits: Limits) -> None:
        """Give it the task of this index."""
        self.index = index
        self.deadline = time.monotonic() + limits.seconds + PATIENCE[METHOD]
        with contextlib.suppress(OSError):  # it has ended, which is seen when it is read from
            self.line.send(task)

    def take(self) -> Result:
        """What has come of its task; it is free afterwards, unless it has ended or is worn."""
        try:
            if not self.line.poll():
                return _LATE
            message = self.line.recv_bytes()
        except (EOFError, OSError):
            self._process.kill()
            self._process.join()
            return _reason(self._process.exitcode)
        if message[:1] == _FRESH:
            self.index, self.deadline = -1, math.inf
        return message[2:] if message[1:2] == _WHOLE else _TOO_MUCH if message[2:] else _NO_MEMORY

    def end(self) -> None:
        """End the process, and leave nothing of it behind."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self.line.close()


def _ready(workers: Sequence[_Worker]) -> list[_Worker]:
    """Wait for the workers that have a result, have ended, or are late."""
    soonest = min(worker.deadline for worker in workers)
    ready = wait([worker.line for worker in workers], max(0.0, soonest - time.monotonic()))
    now = time.monotonic()
    return [worker for worker in workers if worker.line in ready or worker.deadline <= now]


def _reason(exitcode: int | None) -> Ended:
    """Why a process ended before all was handed over."""
    try:
        return _SIGNALS.get(signal.Signals(-(exitcode or 0)).name, _STOPPED)
    except ValueError:
        return _STOPPED


def _start(workers: list[_Worker], work: Callable[[_Task], bytes], limits: Limits) -> bool:
    """Start one more worker, where the system has room. Raises ComputationError where it has none for any."""
    context: Any = get_context(METHOD)
    with _interrupts_held(), warnings.catch_warnings():
        # Threads of a library for matrices do nothing at this moment.
        warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
        try:
            line, its_end = context.Pipe()
            with its_end:
                process = context.Process(target=_serve, args=(its_end, work, limits), daemon=True)
                process.start()
        except OSError as error:
            if workers:
                return False
            message = f"no process can be started: {error.strerror or error}"
            raise ComputationError(message) from None
        workers.append(_Worker(process, line))
    return True


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """A context that no interrupt leaves half way: a process that is started is known to be running."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(line: Connection, work: Callable[[_Task], bytes], limits: Limits) -> NoReturn:
    """Work on what comes, hand over the results, and end with the line.

    The process ends at once, so that nothing is done or written that belongs to the one it is a fork of.
    """
    code = 1
    try:
        confine(limits, line.fileno())
        start = address_space() or 0
        while True:
            task = line.recv()
            start_clock(limits.seconds)
            result = _done(work, task, limits)
            stop_clock()
            grown = (address_space() or 0) - start
            line.send_bytes((_FRESH if WORN * grown < limits.memory else b" ") + result)
    except EOFError:
        code = 0
    finally:
        os._exit(code)


def _done(work: Callable[[_Task], bytes], task: _Task, limits: Limits) -> bytes:
    """The result of work behind a mark, or the mark of why there is none."""
    try:
        data = work(task)
    except MemoryError:
        return b"-"
    return _WHOLE + data if len(data) <= limits.handed else b"-+"
