"""Untrusted tasks in worker processes that `sandbox` confines, each of which serves one task after another.

A worker that breaks its limits ends with its task, and another takes its place. Where that is safe (Linux),
workers are forks, which have at once all modules and caches of this process.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, TypeAlias, TypeVar

from rigidcli.errors import ComputationError
from rigidcli.homework.base import Progress, Unreadable
from rigidcli.sandbox import Limits, address_space, confine, start_clock, stop_clock

_Task = TypeVar("_Task")
# How processes start: on other systems a fork is not safe, or not there.
START_METHOD = "fork" if sys.platform == "linux" else "spawn"
# Grace period (s) beyond the limit before a worker is killed: one that is spawned loads the program, too.
GRACE = {"fork": 0.5, "spawn": 60.0}
# Exit codes of a worker without memory, and of one whose result is too long; nothing else has them.
OUT_OF_MEMORY, TOO_LONG = 103, 104
_NO_MEMORY = Unreadable("too_large", "it takes too much memory")
# What a signal or an exit code of a worker means; the system kills one that takes all memory.
ENDS: dict[str | int, Unreadable] = {
    "SIGALRM": Unreadable("timeout"),
    **dict.fromkeys(("SIGABRT", "SIGBUS", "SIGKILL", OUT_OF_MEMORY), _NO_MEMORY),
    "SIGSEGV": Unreadable("too_large", "the process that judged it broke down"),
    TOO_LONG: Unreadable("too_large", "the feedback on it is too long"),
}
# The bytes of a result (pickles of an untrusted process are never opened), or why there is none.
Result: TypeAlias = bytes | Unreadable


def each(
    work: Callable[[_Task], bytes], tasks: Sequence[_Task], jobs: int, limits: Limits, progress: Progress
) -> Iterator[Result]:
    """The results of `work` for each task, in the order of tasks; `jobs` workers run at a time.

    `progress` gets the share that is done. Raises ComputationError where no process can be started.
    """
    workers: list[_Worker] = []
    done: dict[int, Result] = {}
    waiting, finished = deque(enumerate(tasks)), 0
    gc.freeze()  # the collection of garbage leaves alone what is there, so that forks can share it
    try:
        for index in range(len(tasks)):
            while index not in done:
                while waiting and len(workers) < jobs:
                    try:
                        workers.append(_Worker(work, limits))
                    except OSError as error:
                        if workers:
                            break  # the system has no room for more
                        message = f"no process can be started: {error.strerror or error}"
                        raise ComputationError(message) from None
                    workers[-1].give(*waiting.popleft(), limits)
                for worker in _ready(workers):
                    done[worker.index], serves = worker.take()
                    finished += 1
                    progress(finished / len(tasks))
                    if serves and waiting:
                        worker.give(*waiting.popleft(), limits)
                    else:
                        workers.remove(worker)
                        worker.end()
            yield done.pop(index)
    finally:
        gc.unfreeze()
        for worker in workers:
            worker.end()


class _Worker:
    """A worker process, and the `index` of the task that it works on until the `deadline`."""

    def __init__(self, work: Callable[[_Task], bytes], limits: Limits) -> None:
        """Start the process. Raises OSError where the system has no room for it."""
        self.index, self.deadline = -1, 0.0
        context: Any = get_context(START_METHOD)
        with _interrupts_held(), warnings.catch_warnings():
            # Threads of a library for matrices do nothing at this moment.
            warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
            self.line, its_end = context.Pipe()
            with its_end:
                self._process = context.Process(target=_serve, args=(its_end, work, limits), daemon=True)
                self._process.start()

    def give(self, index: int, task: object, limits: Limits) -> None:
        self.index, self.deadline = index, time.monotonic() + limits.seconds + GRACE[START_METHOD]
        with contextlib.suppress(OSError):  # it has ended, which is seen when it is read from
            self.line.send(task)

    def take(self) -> tuple[Result, bool]:
        """What has come of its task, and whether it may have another."""
        try:
            if not self.line.poll():
                return ENDS["SIGALRM"], False
            message = self.line.recv_bytes()
            return message[1:], message[:1] == b"+"
        except (EOFError, OSError):
            self._process.kill()
            self._process.join()
            code = self._process.exitcode
            name = next((each.name for each in signal.Signals if each == -code), code)
            return ENDS.get(name, Unreadable("not_allowed", "the process that judged it was stopped")), False

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._process.close()
        self.line.close()


def _ready(workers: Sequence[_Worker]) -> list[_Worker]:
    """Wait for workers that have a result, have ended, or are past their deadline."""
    soonest = min(worker.deadline for worker in workers)
    ready = wait([worker.line for worker in workers], max(0.0, soonest - time.monotonic()))
    now = time.monotonic()
    return [worker for worker in workers if worker.line in ready or worker.deadline <= now]


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """A context in which SIGINT is blocked, in this process and in one that is started within."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(line: Connection, work: Callable[[_Task], bytes], limits: Limits) -> None:
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
            data = work(task)
            stop_clock()
            if len(data) > limits.handed:
                code = TOO_LONG
                return
            has_room = (address_space() or 0) - start < limits.memory / 8  # for the next task
            line.send_bytes((b"+" if has_room else b"-") + data)
    except EOFError:
        code = 0
    except MemoryError:
        code = OUT_OF_MEMORY
    finally:
        os._exit(code)
