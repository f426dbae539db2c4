"""How much memory can still be had, so that what needs more is refused before it is asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rigidcli.errors import ComputationError
from rigidcli.sandbox import address_space

A_NUMBER = 28
"""Bytes that a number of a table takes while a study fills it: 8 for itself, the rest on the way there.

This is measured, as is the next one.
"""

ITS_TEXT = 60
"""Bytes that the text of a number takes where all is written at once: 20 digits, three times over."""


def require(rows: int, columns: int, size: int = A_NUMBER) -> None:
    """Raise ComputationError where there is too little for the samples, with numbers of `size` bytes."""
    needed, left = rows * columns * size, available()
    if needed > left:
        about, had = (f"{x / 1e9:.1f} GB" if x >= 1e9 else f"{x / 1e6:.0f} MB" for x in (needed, left))
        raise ComputationError(
            f"{rows:,} samples need about {about} of memory, and {had} can be had",
            hint="ask for fewer samples, for csv instead of json, or allow more memory",
        )


def available() -> float:
    """The bytes that this process can still get, as far as the platform knows; else infinite."""
    return max(0.0, min(_limits(), default=math.inf))


def _limits() -> Iterator[float]:
    """What each limit leaves: that of the process, that of its group of processes, that of the machine."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            yield most - (address_space() or 0)
    # Linux keeps the limits of a group of processes, as of a container, in one of these, by its version.
    for limit, used in (
        ("memory.max", "memory.current"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
    ):
        with suppress(OSError, ValueError):  # `max` is no number
            group = Path("/sys/fs/cgroup")
            yield int((group / limit).read_text()) - int((group / used).read_text())
    with suppress(OSError, ValueError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        kilobytes = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
        yield 1024.0 * (kilobytes["MemAvailable"] + kilobytes["SwapFree"])
