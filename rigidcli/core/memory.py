"""The memory that is left: what needs more is refused before it begins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rigidcli.errors import ComputationError
from rigidcli.sandbox import address_space

# Bytes (measured) of a number of a table while a study fills it: 8 for the number, the rest for copies.
BYTES_OF_A_NUMBER = 28
# Bytes (measured) of the text of a number where all is written at once: 20 digits, three times.
BYTES_OF_ITS_TEXT = 60


def require(rows: int, columns: int, size: int = BYTES_OF_A_NUMBER) -> None:
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
    """The bytes that the limits of the process, of its group of processes and of the machine leave."""
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
