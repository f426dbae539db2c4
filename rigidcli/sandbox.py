"""What a process may do that works on untrusted text: compute, read files, and answer; nothing else.

The limits on memory and files are those of POSIX, and a clock bounds the time of each piece of work. Where
there are none, Python itself still refuses what it would do to anything outside the process.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from threading import current_thread, main_thread
from typing import NamedTuple

if sys.platform != "win32":
    import resource


class Limits(NamedTuple):
    """What one piece of work may take in a process that may serve many.

    `seconds` of time; bytes of `memory`, besides what the process begins with; bytes that it has `handed`
    over in the end; and `files` that are open at a time.
    """

    seconds: float = 10.0
    memory: int = 2**30
    handed: int = 4_000_000
    files: int = 32


LIMITS = Limits()

MOST_FILES = 65_536  # more than a process has open


def usable_cores() -> int:
    """Processors that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class ForbiddenError(PermissionError):
    """Something that is not computing was tried."""


# Beginnings of what Python announces before it starts, changes or reaches something outside the process.
_FORBIDDEN = (
    "ctypes.", "fcntl.", "ftplib.", "http.", "mmap.", "os.chdir", "os.chflags", "os.chmod", "os.chown",
    "os.exec", "os.fork", "os.kill", "os.link", "os.lockf", "os.mkdir", "os.posix_spawn", "os.remove",
    "os.rename", "os.rmdir", "os.setxattr", "os.spawn", "os.startfile", "os.symlink", "os.system",
    "os.truncate", "os.utime", "pty.", "resource.", "shutil.", "signal.", "smtplib.", "socket.", "sqlite3.",
    "subprocess.", "syslog.", "tempfile.", "urllib.", "webbrowser.", "winreg.",
)  # fmt: skip

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_TRUNC


def confine(limits: Limits, *keep: int) -> None:
    """Bind this process to `limits`, for good; of what is open, only the descriptors `keep` stay so."""
    _close_all_but(sorted(keep))
    _bind(limits)
    sys.dont_write_bytecode = True
    sys.addaudithook(_audit)


class LateError(BaseException):
    """Some work has taken its time. No handler of mere errors on the way may catch it."""


@contextlib.contextmanager
def timed(seconds: float) -> Iterator[None]:
    """A context in which work may take so many seconds of the processor; then LateError ends it.

    Only between two steps of Python, and not on Windows: what hangs elsewhere is ended with its process.
    """
    if sys.platform == "win32" or current_thread() is not main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        raise LateError

    before = signal.signal(signal.SIGVTALRM, end)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def start_clock(seconds: float) -> None:
    """Let the time count: when it is up, this process ends by a signal."""
    if sys.platform != "win32":
        signal.setitimer(signal.ITIMER_REAL, seconds)


def stop_clock() -> None:
    """Let the time count no more: the work is done, and may wait to be fetched."""
    start_clock(0)


def _close_all_but(keep: Sequence[int]) -> None:
    # Closed before anything is opened: whoever started this process may have used all that there are.
    for last, following in pairwise([2, *keep, MOST_FILES]):
        os.closerange(max(last, 2) + 1, following)
    nothing = os.open(os.devnull, os.O_RDWR)
    for standard in {0, 1, 2} - {*keep}:
        os.dup2(nothing, standard)
    if nothing > 2:
        os.close(nothing)


def _bind(limits: Limits) -> None:
    """Set the limits that the system can watch over."""
    if sys.platform == "win32":
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started this process ends it
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    # When memory runs out for all, this process is in the way, and not another.
    with contextlib.suppress(OSError):
        file = os.open("/proc/self/oom_score_adj", os.O_WRONLY)
        os.write(file, b"1000")
        os.close(file)
    bounds = dict.fromkeys((resource.RLIMIT_CORE, resource.RLIMIT_FSIZE, resource.RLIMIT_NPROC), (0, 0))
    bounds[resource.RLIMIT_NOFILE] = (limits.files, limits.files)
    if (used := address_space()) is not None:
        bounds[resource.RLIMIT_AS] = (used + limits.memory, used + limits.memory)
    for name, bound in bounds.items():
        # A lower limit that is there already stays.
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(name, bound)


def address_space() -> int | None:
    """Bytes that this process has mapped; None where the system does not say."""
    try:
        # A process that was forked pays for each object of Python that it uses first, such as a file.
        file = os.open("/proc/self/statm", os.O_RDONLY)
    except OSError:
        return None
    pages = int(os.read(file, 100).split()[0])
    os.close(file)
    return pages * os.sysconf("SC_PAGE_SIZE")


def _audit(event: str, arguments: tuple[object, ...]) -> None:
    """Refuse what reaches out of the process."""
    if event == "open":
        flags = arguments[2]
        if isinstance(flags, int) and flags & _WRITING:
            raise ForbiddenError(errno.EPERM, "no file is written here")
    elif event.startswith(_FORBIDDEN):
        raise ForbiddenError(errno.EPERM, f"{event} is not allowed here")
