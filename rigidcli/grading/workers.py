"""Work on many untrusted things at a time, each in a process of its own that `sandbox` confines.

Where that is safe (Linux), a process is a fork: it has at once what is loaded and worked out, for a few
milliseconds. Elsewhere it starts anew, and gets its work pickled; what comes back is bytes everywhere.
"""

from __future__ import annotations

import contextlib
import gc
import math
import os
import select
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

from rigidcli.errors import ComputationError
from rigidcli.sandbox import Limits, confine, start_clock, stop_clock

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

_Task = TypeVar("_Task")

METHOD = "fork" if sys.platform == "linux" else "spawn"
"""How processes start."""

START = {"fork": 0.5, "spawn": 60.0}
"""Seconds, besides those of the work, after which a process is late that has not ended by itself."""

_CHUNK = getattr(select, "PIPE_BUF", 4096) - 4
"""Bytes that go through a pipe in one piece, with four more for its length: nobody waits for half a piece."""


@dataclass(frozen=True, slots=True)
class Ended:
    """Work that came to nothing: a code of CODES, and what more there is to say."""

    code: str
    detail: str = ""


_LATE = Ended("timeout")
_NO_MEMORY = Ended("too_large", "it takes too much memory")
_TOO_MUCH = Ended("too_large", "there is too much to say of it")
_STOPPED = Ended("not_allowed", "the process that judged it was stopped")

_SIGNALS = {
    "SIGALRM": _LATE,
    "SIGXCPU": _LATE,
    "SIGABRT": _NO_MEMORY,
    "SIGBUS": _NO_MEMORY,
    "SIGKILL": _NO_MEMORY,
    "SIGSEGV": Ended("too_deep", "the process that judged it broke down"),
}
"""What it means when a signal ends a process; the system kills one when memory runs out for all."""

_EXITS = {64: _NO_MEMORY, 65: _TOO_MUCH, 66: _STOPPED}
"""Exit codes of processes that have nothing to hand over."""

_CODES = {ended: code for code, ended in _EXITS.items()}

Result: TypeAlias = bytes | Ended
"""What comes of work: what it hands over, or why that is nothing."""


def usable_cores() -> int:
    """Processors that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def each(
    work: Callable[[_Task], bytes],
    tasks: Sequence[_Task],
    jobs: int,
    limits: Limits,
    progress: Callable[[float], None],
) -> Iterator[Result]:
    """What `work` makes of each task, in the order of tasks, whatever is done first; `jobs` run at a time.

    One more process is there, which waits for its turn: to start one takes as long as some work does.
    `progress` is told the share that is done. Raises ComputationError where no process can be started.
    """
    running: list[_Running] = []
    done: dict[int, Result] = {}
    begun = finished = 0
    try:
        with _kept_shared():
            for index in range(len(tasks)):
                while True:
                    trouble = None
                    while begun < len(tasks) and len(running) <= jobs and trouble is None:
                        trouble = _start(running, begun, work, tasks[begun], limits)
                        begun += trouble is None
                        _release(running[:jobs], limits)
                    if index in done:
                        break
                    if trouble is not None and not running:
                        # When others run, there may be room as they end.
                        reason = trouble.strerror or trouble
                        raise ComputationError(f"no process can be started: {reason}")
                    for process in _wait(running, jobs, limits):
                        done[process.index] = process.result
                        finished += 1
                        progress(finished / len(tasks))
                yield done.pop(index)
    finally:
        for process in running:
            process.end()


@contextlib.contextmanager
def _kept_shared() -> Iterator[None]:
    """A context in which the collection of garbage leaves alone what is there, so that forks can share it."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@dataclass(slots=True)
class _Fork:
    """A process that is a fork of this one, with what is needed here of a Process of multiprocessing."""

    pid: int
    exitcode: int | None = None

    def kill(self) -> None:
        """End it at once, if it has not been seen to end."""
        if self.exitcode is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def join(self) -> None:
        """Wait for its end, and see how it ended, which the system may not tell."""
        if self.exitcode is None:
            with contextlib.suppress(ChildProcessError):
                self.exitcode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


@dataclass(eq=False, slots=True)
class _Running:
    """A process that works on the task `index`, when it is told to, and what has come from it."""

    index: int
    process: BaseProcess | _Fork
    line: Connection
    deadline: float = math.inf
    received: bytearray = field(default_factory=bytearray)
    result: Result = _LATE

    def release(self, limits: Limits) -> None:
        """Let the work begin, if it has not begun."""
        if self.deadline == math.inf:
            self.deadline = time.monotonic() + limits.seconds + START[METHOD]
            with contextlib.suppress(OSError):  # the process has ended, which is told when it is read from
                self.line.send_bytes(b"go")

    def take(self, limits: Limits) -> bool:
        """Take the next piece that has come, and tell whether it was the last."""
        try:
            piece = self.line.recv_bytes(_CHUNK)
        except (EOFError, OSError):
            self.process.kill()
            self.process.join()
            self.result = _reason(self.process.exitcode)
            return True
        if piece and len(self.received) + len(piece) <= limits.handed:
            if not self.received:
                # The work is done in time, whenever it is handed over.
                self.deadline = time.monotonic() + limits.seconds
            self.received += piece
            return False
        self.result = _TOO_MUCH if piece else bytes(self.received)
        return True

    def end(self) -> None:
        """End the process, and leave nothing of it behind."""
        self.process.kill()
        self.process.join()
        self.line.close()


def _release(running: Sequence[_Running], limits: Limits) -> None:
    for process in running:
        process.release(limits)


def _reason(exitcode: int | None) -> Ended:
    """Why a process ended before all was handed over."""
    if exitcode is None or exitcode >= 0:
        return _EXITS.get(exitcode or 0, _STOPPED)
    try:
        return _SIGNALS.get(signal.Signals(-exitcode).name, _STOPPED)
    except ValueError:
        return _STOPPED


def _wait(running: list[_Running], jobs: int, limits: Limits) -> Iterator[_Running]:
    """Wait, and take those from among the `running` that are done, or late, and let others begin."""
    from multiprocessing.connection import wait

    soonest = min(process.deadline for process in running)
    ready = wait([process.line for process in running], max(0.0, soonest - time.monotonic()))
    for process in tuple(running):
        if process.take(limits) if process.line in ready else process.deadline <= time.monotonic():
            running.remove(process)
            # The next one works while this one is taken apart.
            _release(running[:jobs], limits)
            process.end()
            yield process


def _start(
    running: list[_Running], index: int, work: Callable[[_Task], bytes], task: _Task, limits: Limits
) -> OSError | None:
    """Start a process and put it among the `running`, or tell why the system has no room for one."""
    from multiprocessing import get_context

    context: Any = get_context(METHOD)
    try:
        line, its_end = context.Pipe()
    except OSError as error:
        return error
    with its_end, _interrupts_held(), warnings.catch_warnings():
        # Threads of a library for matrices do nothing at this moment.
        warnings.filterwarnings("ignore", ".*multi-?threaded.*", DeprecationWarning)
        process: Any
        try:
            if METHOD == "fork":
                process = _Fork(os.fork())
                if not process.pid:
                    _child(its_end, work, task, limits)
            else:
                process = context.Process(target=_child, args=(its_end, work, task, limits), daemon=True)
                process.start()
        except OSError as error:
            line.close()
            return error
        running.append(_Running(index, process, line))
    return None


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


def _child(line: Connection, work: Callable[[_Task], bytes], task: _Task, limits: Limits) -> NoReturn:
    """Do the work when told to, hand over the result in pieces and an empty one, and end this process.

    It ends at once, so that nothing is done or written that belongs to the process it is a fork of.
    """
    code = _CODES[_STOPPED]
    try:
        confine(limits, line.fileno())
        line.recv_bytes()
        start_clock(limits.seconds)
        data = work(task)
        stop_clock()
        if len(data) > limits.handed:
            os._exit(_CODES[_TOO_MUCH])
        for begin in range(0, len(data), _CHUNK):
            line.send_bytes(data[begin : begin + _CHUNK])
        line.send_bytes(b"")
        code = 0
    except MemoryError:
        code = _CODES[_NO_MEMORY]
    finally:
        os._exit(code)
