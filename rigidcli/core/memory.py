"""How much memory can still be had, so that what needs more is refused before it is asked for."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rigidcli.errors import ComputationError

MEGABYTE = 1_000_000
"""Bytes, as storage is sold and memory is told to people."""


def require(needed: float, what: str, hint: str) -> None:
    """Raise ComputationError, with the `hint`, where less is available than what is `needed` (bytes)."""
    left = available()
    if needed > left:
        raise ComputationError(
            f"{what} need about {_told(needed)} of memory, of which {_told(left)} can be had", hint=hint
        )


def available() -> float:
    """The bytes that this process can still get, as far as the platform tells them; else infinite."""
    return max(0.0, min(_limits(), default=math.inf))


def _limits() -> Iterator[float]:
    """What each limit leaves: that of the process, that of its group of processes, that of the machine."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            yield most - pages * os.sysconf("SC_PAGE_SIZE")
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        yield float((group / "memory.max").read_text()) - int((group / "memory.current").read_text())
    with suppress(OSError, ValueError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        kilobytes = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
        yield 1024.0 * (kilobytes["MemAvailable"] + kilobytes["SwapFree"])


def _told(size: float) -> str:
    """A number of bytes as people say it."""
    return f"{size / MEGABYTE / 1000:.1f} GB" if size >= 1000 * MEGABYTE else f"{size / MEGABYTE:.0f} MB"
