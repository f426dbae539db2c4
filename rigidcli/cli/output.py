"""Where results and error messages are written, and the exit code of the program."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import typer

from rigidcli.errors import DocumentError, Problem, RigidError, UsageError


def complain(text: str) -> None:
    """Print a note or an error, on standard error."""
    # Without a standard error, print would turn to standard output.
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr or io.StringIO(), flush=True)


class Failures:
    """Reports errors instead of raising them, file by file; `code` is the worst exit code so far."""

    def __init__(self) -> None:
        self.code = 0

    @contextlib.contextmanager
    def of(self, source: str) -> Iterator[None]:
        """A context in which a RigidError is a failure of `source`."""
        try:
            yield
        except RigidError as error:
            # The problems of a document name its source themselves.
            complain(
                error.message
                if isinstance(error, DocumentError)
                else str(Problem(source, error.message, hint=error.hint))
            )
            self.code = max(self.code, error.exit_code)


class Output:
    """Standard output, or a file that is written whole or not at all; a context that ends the writing."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path == "-" else path
        self._pieces: list[str] = []
        if isinstance(sys.stdout, io.TextIOWrapper):
            # The same input gives the same bytes, whatever the locale.
            sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")

    def write(self, piece: str) -> None:
        """Write a piece of text that is complete in itself."""
        if self._path is not None:
            self._pieces.append(piece)
            return
        try:
            if sys.stdout is None:
                raise OSError(errno.EBADF, "it is closed")
            sys.stdout.write(piece)
            sys.stdout.flush()
        except OSError as failure:
            if sys.stdout is not None:
                # It takes no more: what is still buffered is discarded.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            if isinstance(failure, BrokenPipeError):
                raise typer.Exit from None
            raise _failed("standard output", failure) from None

    def terminal(self) -> tuple[int | None, bool]:
        """The width of the terminal that is written to, or None, and whether it may show colours."""
        if self._path is not None or sys.stdout is None or not sys.stdout.isatty():
            return None, False
        colour = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        return shutil.get_terminal_size().columns, colour

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._path is None or error is not None or not self._pieces:
            return
        write_whole(self._path, "".join(self._pieces).encode())


def write_whole(path: str, data: bytes) -> None:
    """Write a file whole or not at all; raises typer.Exit, after a message, where it cannot be written."""
    try:
        _replace(Path(path), data)
    except OSError as failure:
        raise _failed(path, failure) from None


def require_apart(option: str, path: str | None, others: Sequence[str]) -> None:
    """Raise UsageError where the file that an option writes is one of the others, by whatever name."""
    for other in others if path not in (None, "-") else ():
        with contextlib.suppress(OSError):
            if path == other or Path(str(path)).samefile(other):
                raise UsageError(f"{option}: `{path}` is one of the files that are read, and stays as it is")


def _failed(name: str, failure: OSError) -> typer.Exit:
    complain(str(Problem(name, f"cannot be written: {failure.strerror or failure}")))
    return typer.Exit(UsageError.exit_code)


def _replace(path: Path, data: bytes) -> None:
    """Put `data` at `path` in one step: another reader sees the old file or the new one."""
    if path.exists() and not path.is_file():
        path.write_bytes(data)  # a device or a pipe has no old content to keep
        return
    path = path.resolve()
    umask = os.umask(0)
    os.umask(umask)
    mode = stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o666 & ~umask
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        temporary.chmod(mode)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def progress() -> Iterator[Callable[[float], None]]:
    """A context in which long work reports its progress, on standard error if that is a terminal."""
    terminal = sys.stderr if sys.stderr is not None and sys.stderr.isatty() else io.StringIO()
    last = ""

    def show(fraction: float) -> None:
        nonlocal last
        last = f"\r{fraction:4.0%}\r"
        print(last, end="", file=terminal, flush=True)

    try:
        yield show
    finally:
        if last:
            print("    ", end="\r", file=terminal, flush=True)
