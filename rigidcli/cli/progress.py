"""The progress of long work, on a terminal."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def progress(pulse: float | None = None) -> Iterator[Callable[[float], None]]:
    """A context in which long work reports its progress, on standard error if that is a terminal.

    Every `pulse` (s), if there is one, the time that has passed is shown, whatever the work reports.
    """
    terminal = sys.stderr
    if terminal is None or not terminal.isatty():
        yield lambda fraction: None
        return
    begin, done, share = time.monotonic(), threading.Event(), ""
    longest = 0

    def show() -> None:
        nonlocal longest
        text = f"{share} {time.monotonic() - begin:.0f} s"
        longest = max(longest, len(text))
        print(f"\r{text}\r", end="", file=terminal, flush=True)

    def report(fraction: float) -> None:
        nonlocal share
        share = f"{fraction:4.0%}"
        show()

    def beat() -> None:
        while not done.wait(pulse):
            show()

    heart = threading.Thread(target=beat, daemon=True)
    if pulse is not None:
        heart.start()
    try:
        yield report
    finally:
        done.set()
        if pulse is not None:
            heart.join()
        if longest:
            print(" " * longest, end="\r", file=terminal, flush=True)


@contextlib.contextmanager
def counted(total: int) -> Iterator[Callable[[], None]]:
    """A context that counts steps for the progress on a terminal; it shows nothing for 0 steps."""
    with progress() as show:
        counts = iter(range(1, total + 1))

        def done() -> None:
            count = next(counts, total)
            if total and 100 * count // total > 100 * (count - 1) // total:
                show(count / total)

        yield done
