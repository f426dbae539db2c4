"""What is written: results, to files that are whole or not at all, and messages on standard error."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, NamedTuple, Self

import typer

from rigidcli.errors import ComputationError, DocumentError, Problem, RigidError, UsageError, ValueProblem

# --- messages

LESS = "ask for fewer samples or smaller inputs, or allow more memory"  # advice where memory was not enough


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
        problem = Problem(source, "there is too little memory", hint=LESS)
        return Failure(str(problem), ComputationError.exit_code)
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


@contextlib.contextmanager
def progress(pulse: float | None = None, is_shown: bool = True) -> Iterator[Callable[[float], None]]:
    """A context in which long work shows the share that is done, and about how long all of it takes.

    It is shown on standard error if that is a terminal. With a `pulse` (s), the elapsed time is shown again
    after each such interval, also without a new share.
    """
    terminal = sys.stderr
    if terminal is None or not terminal.isatty() or not is_shown:
        yield lambda fraction: None
        return
    begin, done, share, whole, text = time.monotonic(), threading.Event(), "", "", ""

    def show(fraction: float | None = None) -> None:
        nonlocal share, whole, text
        elapsed = time.monotonic() - begin
        if fraction:
            share, whole = f"{fraction:4.0%}", f" of about {elapsed / fraction:.0f} s"
        text = f"{share} {elapsed:.0f} s{whole}".ljust(len(text))
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
def counted(total: int) -> Iterator[Callable[[float], None]]:
    """A context that counts steps, or shares of them, and shows each further percent on a terminal."""
    with progress() as show:
        count = 0.0

        def done(share: float) -> None:
            nonlocal count
            before, count = count, count + share
            if int(100 * before / total) < int(100 * count / total) < 100:
                show(count / total)

        yield done


# --- results

# Advice where the output would overwrite a file that is read.
OTHER_NAME = "choose another name for the output"


def is_file(path: str) -> bool:
    """Whether there is a regular file of this name; no file can have some names, such as one with a NUL."""
    with contextlib.suppress(OSError, ValueError):
        return Path(path).is_file()
    return False


def is_folder(path: str | None) -> bool:
    """Whether output goes to a folder: the path ends in a slash, or the folder exists."""
    return path is not None and (path.endswith(("/", "\\")) or Path(path).is_dir())


class Output:
    """Standard output, or the file of an `option`, which a context writes whole or not at all."""

    def __init__(self, path: str | None, option: str = "-o") -> None:
        self._path = None if path == "-" else path
        self._option = option
        self._whole = contextlib.ExitStack()
        self._file: BinaryIO | None = None
        if isinstance(sys.stdout, io.TextIOWrapper):
            # The same input gives the same bytes, whatever the locale.
            sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")

    def protect(self, *files: str | Path) -> None:
        """Raise UsageError where the output would overwrite one of these files, by whatever name."""
        if self._path is None or not is_file(self._path):
            return
        for file in files:
            with contextlib.suppress(OSError, ValueError):  # a file that is not there is not lost
                if Path(file).samefile(self._path):
                    problem = f"`{self._option}` would overwrite `{file}`, which is read"
                    raise UsageError(problem, hint=OTHER_NAME)

    def write(self, piece: str | bytes) -> None:
        """Write a piece of text, or of the bytes of a file."""
        if self._path is not None:
            with _failures_of(self._path):
                if self._file is None:
                    if is_folder(self._path):  # also one that is not there
                        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
                    self._file = self._whole.enter_context(_replacing(Path(self._path)))
                self._file.write(_encoded(piece))
            return
        try:
            if sys.stdout is None:
                raise OSError(errno.EBADF, "it is closed")
            sys.stdout.write(str(piece))
            sys.stdout.flush()
        except OSError as failure:
            if sys.stdout is not None:
                # It takes no more: what is still buffered is discarded.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            if isinstance(failure, BrokenPipeError):
                raise typer.Exit from None
            raise _failed("standard output", failure) from None

    def terminal(self) -> tuple[int | None, bool]:
        """The width of the terminal that gets the output, or None, and whether it may show colours."""
        if self._path is not None or sys.stdout is None or not sys.stdout.isatty():
            return None, False
        colour = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        return shutil.get_terminal_size().columns, colour

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with _failures_of(self._path or ""):
            self._whole.__exit__(kind, error, trace)


class Folder(Output):
    """A folder in which all pages are written, or none; other files in it stay as they are."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self._folder = Path(path)
        self._files: dict[str, list[bytes]] = {}
        self._pieces: list[bytes] = []

    def begin(self, name: str) -> None:
        """Begin a file of this name, which gets all further pieces."""
        self._pieces = self._files[name] = []

    def write(self, piece: str | bytes) -> None:
        """Write a piece of text into the file that was begun last."""
        self._pieces.append(_encoded(piece))

    def protect(self, *files: str | Path) -> None:
        """Raise UsageError for a page in the folder that is read."""
        for file in map(Path, files):
            if file.suffix == ".html" and file.resolve().parent == self._folder.resolve():
                raise UsageError(f"`-o` would overwrite `{file}`, which is read", hint=OTHER_NAME)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None or not self._files:
            return
        from tempfile import TemporaryDirectory

        with _failures_of(str(self._folder)):
            self._folder.mkdir(exist_ok=True)
            with TemporaryDirectory(prefix=".rigidcli-", dir=self._folder) as stage:
                for name, pieces in self._files.items():
                    Path(stage, name).write_bytes(b"".join(pieces))
                    if (self._folder / name).is_dir() and not (self._folder / name).is_symlink():
                        raise IsADirectoryError(errno.EISDIR, f"`{name}` in it is a folder")
                for name in self._files:
                    Path(stage, name).replace(self._folder / name)


def _encoded(piece: str | bytes) -> bytes:
    return piece.encode() if isinstance(piece, str) else piece


@contextlib.contextmanager
def _failures_of(path: str) -> Iterator[None]:
    """A context in which a file that cannot be written ends the program with a message."""
    try:
        yield
    except OSError as failure:
        raise _failed(path, failure) from None


def _failed(name: str, failure: OSError) -> typer.Exit:
    complain(str(Problem(name, f"cannot be written: {failure.strerror or failure}")))
    return typer.Exit(UsageError.exit_code)


@contextlib.contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    """A file that replaces `path` in one step: another reader sees either the old or the new content.

    After an error nothing is left of the new content.
    """
    if path.exists() and not path.is_file():
        with path.open("wb") as device:  # a device or a pipe has no old content to keep
            yield device
        return
    from tempfile import mkstemp

    path = path.resolve()
    umask = os.umask(0)
    os.umask(umask)
    mode = stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o666 & ~umask
    descriptor, name = mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file
        temporary.chmod(mode)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
