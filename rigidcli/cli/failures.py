"""Messages on standard error: notes, failures with their exit code, and the progress of long work."""

from __future__ import annotations

import contextlib
import io
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import typer

from rigidcli.errors import ComputationError, DocumentError, Problem, RigidError, UsageError, ValueProblem

LESS = "ask for fewer samples or smaller inputs, or allow more memory"
"""Advice where memory was not enough."""


def complain(text: str) -> None:
    """Print a note or an error, on standard error."""
    # Without a standard error, print would turn to standard output.
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr or io.StringIO(), flush=True)


def tell_notes(source: str, notes: Sequence[str], quiet: bool) -> None:
    """Print the notes on a source, unless the user wants none."""
    for note in () if quiet else notes:
        # A note on a file that is the body by itself begins with its name, too.
        complain(str(Problem(source, f"note: {note.removeprefix(f'{source}: ')}")))


@contextlib.contextmanager
def bad_parameter(option: str | None = None) -> Iterator[None]:
    """A context in which an error about the value of an option, or an argument, is a BadParameter."""
    try:
        yield
    except (UsageError, ValueProblem) as error:
        message = f"{error.message} ({error.hint})" if error.hint else error.message
        raise typer.BadParameter(message, param_hint=option and f"'{option}'") from None


class Failure(NamedTuple):
    """The message of an error, its exit code, and in a sweep the `place` where it occurred."""

    text: str
    code: int
    place: str = ""


def failure(error: RigidError | MemoryError, source: str) -> Failure:
    """The failure of `source` by this error."""
    if isinstance(error, MemoryError):
        return Failure(
            str(Problem(source, "there is too little memory", hint=LESS)), ComputationError.exit_code
        )
    # The problems of a document name its source themselves.
    is_named = isinstance(error, DocumentError)
    text = error.message if is_named else str(Problem(source, error.message, hint=error.hint))
    return Failure(text, error.exit_code)


class Failures:
    """Reports errors instead of raising them, file by file; `code` is the worst exit code so far."""

    def __init__(self) -> None:
        self.code = 0
        self._last = ""
        self._again = 0

    def tell(self, failure: Failure) -> None:
        """Report a failure once; when it occurs again, as in a sweep, it is only counted."""
        self.code = max(self.code, failure.code)
        if failure.text == self._last:
            self._again += bool(failure.place)
            return
        self.end()
        self._last = failure.text
        complain(f"at {failure.place}: {failure.text}" if failure.place else failure.text)

    def end(self) -> None:
        """Report how often the last failure occurred again."""
        if self._again:
            complain(f"the same at {self._again:,} more value{'s' * (self._again != 1)}")
        self._last, self._again = "", 0

    @contextlib.contextmanager
    def of(self, source: str) -> Iterator[None]:
        """A context in which a RigidError is a failure of `source`."""
        try:
            yield
        except (RigidError, MemoryError) as error:
            self.tell(failure(error, source))


def fresh(notes: Sequence[str], printed: set[str]) -> list[str]:
    """The notes that were not printed yet, which are added to the printed ones: a sweep repeats its notes."""
    new = [note for note in notes if note not in printed]
    printed.update(new)
    return new


@contextlib.contextmanager
def progress(pulse: float | None = None) -> Iterator[Callable[[float], None]]:
    """A context in which long work shows the share that is done, on standard error if that is a terminal.

    With a `pulse` (s), the elapsed time is shown again after each such interval, also without a new share.
    """
    terminal = sys.stderr
    if terminal is None or not terminal.isatty():
        yield lambda fraction: None
        return
    begin, done, share, text = time.monotonic(), threading.Event(), "", ""

    def show(fraction: float | None = None) -> None:
        nonlocal share, text
        share = share if fraction is None else f"{fraction:4.0%}"
        text = f"{share} {time.monotonic() - begin:.0f} s"
        print(f"\r{text}\r", end="", file=terminal, flush=True)

    def beat() -> None:
        while not done.wait(pulse):
            show()

    heart = threading.Thread(target=beat, daemon=True)
    if pulse is not None:
        heart.start()
    try:
        yield show
    finally:
        done.set()
        if pulse is not None:
            heart.join()
        if text:
            print(" " * len(text), end="\r", file=terminal, flush=True)


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


SOON = 4.0
"""Seconds of a run below which it is not worth telling how long it takes."""


def forecast() -> Callable[[int, int], None]:
    """A function of starts that are done, and of all: once, on a terminal, it tells how long all take."""
    begin, finished, is_open = time.monotonic(), 0, sys.stderr is not None and sys.stderr.isatty()

    def count(done: int, total: int) -> None:
        nonlocal finished, is_open
        finished += done
        elapsed = time.monotonic() - begin
        if is_open and elapsed > SOON / 2:
            is_open = False
            if (whole := elapsed * total / finished) > SOON:
                complain(f"{total:,} starts: about {whole:.0f} s")

    return count
