"""What a process may do that works on untrusted text: compute, read files, and answer; nothing else.

The limits on memory, processor time and files are those of POSIX. Where there are none, Python itself still
refuses what it would do to anything outside the process.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

if sys.platform != "win32":
    import resource


@dataclass(frozen=True, slots=True)
class Limits:
    """What a process may take.

    `seconds` of time, and as many of a processor; bytes of `memory`, besides what it begins with; bytes that
    it has `handed` over in the end; and `files` that are open at a time.
    """

    seconds: float = 10.0
    memory: int = 2**30
    handed: int = 4_000_000
    files: int = 32


LIMITS = Limits()


class ForbiddenError(PermissionError):
    """Something that is not computing was tried."""


_FORBIDDEN = (
    "ctypes.",
    "fcntl.",
    "ftplib.",
    "http.",
    "mmap.",
    "os.chdir",
    "os.chflags",
    "os.chmod",
    "os.chown",
    "os.exec",
    "os.fork",
    "os.kill",
    "os.link",
    "os.lockf",
    "os.mkdir",
    "os.posix_spawn",
    "os.remove",
    "os.rename",
    "os.rmdir",
    "os.setxattr",
    "os.spawn",
    "os.startfile",
    "os.symlink",
    "os.system",
    "os.truncate",
    "os.utime",
    "pty.",
    "resource.",
    "shutil.",
    "signal.",
    "smtplib.",
    "socket.",
    "sqlite3.",
    "subprocess.",
    "syslog.",
    "tempfile.",
    "urllib.",
    "webbrowser.",
    "winreg.",
)
"""Beginnings of what Python announces before it starts, changes or reaches something outside the process."""

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_TRUNC


def confine(limits: Limits, keep: int) -> None:
    """Bind this process to `limits`, for good; of what is open, only the descriptor `keep` stays so.

    When its time is up, it ends by a signal.
    """
    _close_all_but(keep)
    _bind(limits)
    sys.dont_write_bytecode = True
    sys.addaudithook(_audit)


def stop_clock() -> None:
    """Let the time count no more: the work is done, and may wait to be fetched."""
    if sys.platform != "win32":
        signal.setitimer(signal.ITIMER_REAL, 0)


def _close_all_but(keep: int) -> None:
    nothing = os.open(os.devnull, os.O_RDWR)
    for standard in {0, 1, 2} - {keep}:
        os.dup2(nothing, standard)
    with contextlib.suppress(OSError):
        for descriptor in [int(entry.name) for entry in Path("/dev/fd").iterdir()]:
            if descriptor > 2 and descriptor != keep:
                # The one by which this list was read is closed already.
                with contextlib.suppress(OSError):
                    os.close(descriptor)


def _bind(limits: Limits) -> None:
    """Set the limits that the system can watch over."""
    if sys.platform == "win32":
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started this process ends it
    for ending in (signal.SIGALRM, signal.SIGXCPU):
        signal.signal(ending, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    signal.setitimer(signal.ITIMER_REAL, limits.seconds)
    # When memory runs out for all, this process is in the way, and not another.
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_bytes(b"1000")
    seconds = math.ceil(limits.seconds)
    bounds = {
        resource.RLIMIT_CORE: (0, 0),
        resource.RLIMIT_CPU: (seconds, seconds + 1),
        resource.RLIMIT_FSIZE: (0, 0),
        resource.RLIMIT_NOFILE: (limits.files, limits.files),
        resource.RLIMIT_NPROC: (0, 0),
    }
    if (used := _address_space()) is not None:
        bounds[resource.RLIMIT_AS] = (used + limits.memory, used + limits.memory)
    for name, bound in bounds.items():
        # A lower limit that is there already stays.
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(name, bound)


def _address_space() -> int | None:
    """Bytes that this process has mapped; None where the system does not tell."""
    try:
        pages = Path("/proc/self/statm").read_bytes().split()[0]
    except OSError:
        return None
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


def _audit(event: str, arguments: tuple[object, ...]) -> None:
    """Refuse what reaches out of the process."""
    if event == "open":
        flags = arguments[2]
        if isinstance(flags, int) and flags & _WRITING:
            raise ForbiddenError(errno.EPERM, "no file is written here")
    elif event.startswith(_FORBIDDEN):
        raise ForbiddenError(errno.EPERM, f"{event} is not allowed here")
