"""Where results and complaints go, and the exit code that comes of it."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import typer

from rigidcli.errors import DocumentError, RigidError, UsageError

INTERRUPTED = 130


def complain(text: str) -> None:
    """Print a note or an error, on standard error."""
    with contextlib.suppress(BrokenPipeError):
        print(text, file=sys.stderr, flush=True)  # noqa: T201 - this is where everything is printed


def silence_stdout() -> None:
    """Let what is still buffered go nowhere, when nobody reads standard output any more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
            # The problems of a document say themselves where they are.
            place = "" if isinstance(error, DocumentError) else f"{source}: "
            hint = f"\n  hint: {error.hint}" if error.hint else ""
            complain(f"{place}{error.message}{hint}")
            self.code = max(self.code, error.exit_code)


class Output:
    """Standard output, or a file that is written whole or not at all; a context that ends the writing."""

    def __init__(self, path: str | None) -> None:
        self._path = path
        self._pieces: list[str] = []
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(errors="backslashreplace", newline="\n")

    def write(self, piece: str) -> None:
        """Write a piece of text that is whole in itself."""
        if self._path is not None:
            self._pieces.append(piece)
            return
        try:
            sys.stdout.write(piece)
            sys.stdout.flush()
        except BrokenPipeError:
            silence_stdout()
            raise typer.Exit from None

    def terminal(self) -> tuple[int | None, bool]:
        """Width of the terminal that is written to, None if it is none, and whether it may have colours."""
        if self._path is not None or not sys.stdout.isatty():
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
        try:
            _replace(Path(self._path), "".join(self._pieces).encode())
        except OSError as failure:
            complain(f"{self._path}: cannot be written: {failure.strerror or failure}")
            raise typer.Exit(UsageError.exit_code) from None


def _replace(path: Path, data: bytes) -> None:
    """Put `data` at `path` in one step: another reader sees the old file or the new one."""
    path = path.resolve()
    if path.exists() and not path.is_file():
        path.write_bytes(data)  # a device or a pipe has no old content to keep
        return
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
