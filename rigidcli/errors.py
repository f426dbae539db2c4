"""What can go wrong, each kind with its exit code.

Messages carry no final period and put backquotes round literals; a hint is one more sentence
that says what to do about it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, ClassVar, NamedTuple, Self, TypeAlias

# What the exit codes of the program mean; of several FILES the worst one is returned.
EXIT_CODES = {
    0: "done",
    1: "`check` judged something not correct",
    2: "wrong usage: an option, an argument, or a file that cannot be written",
    3: "a document was refused: syntax, keys, values that no body has, unsafe expressions",
    4: "the computation cannot be done, or has no closed form where one is asked for",
    130: "interrupted",
}
Path: TypeAlias = tuple[str | int, ...]  # the way to a value in a document: keys, and indices of lists


class RigidError(Exception):
    """Base of every error that a user may see; never shown with a traceback."""

    exit_code: ClassVar[int] = 4

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class UsageError(RigidError):
    """The command line is wrong."""

    exit_code = 2

    def __str__(self) -> str:
        return self.message if self.hint is None else f"{self.message}\n  hint: {self.hint}"


class ComputationError(RigidError):
    """The document is fine, but what was asked cannot be computed."""


UNKNOWN_KEY = "unknown_key"  # the code of a problem with a key that no document has
UNSETTLED = "unsettled"  # the code of a problem that follows from that of a parameter, and is not shown


class ValueProblem(RigidError, ValueError):  # noqa: N818 - it becomes a `Problem` of a document
    """A value that cannot be what the document says it is.

    It is a `ValueError`, so that pydantic gathers it with the other problems of a document. `path` leads to
    the value: keys of mappings and indices of lists. `typed` is a text in the document that the message shows
    with its line. `code` names the kind of problem. What stands under a wrong key is read at the place in the
    same section where it was `meant` to stand.
    """

    exit_code = 3

    def __init__(
        self,
        message: str,
        *,
        path: Path = (),
        hint: str | None = None,
        typed: str | None = None,
        code: str = "",
        meant: Path = (),
    ) -> None:
        super().__init__(message, hint=hint)
        self.path = path
        self.typed = typed
        self.code = code
        self.meant = meant

    def below(self, *path: str | int) -> Self:
        """The same problem, as seen from further up the document."""
        self.path = (*path, *self.path)
        return self


@contextmanager
def at(*path: str | int) -> Iterator[None]:
    """A context in which the problem of a value gets the path that leads to the value."""
    try:
        yield
    except ValueProblem as problem:
        problem.below(*path)
        raise


@contextmanager
def gathered(problems: list[ValueProblem], *path: str | int) -> Iterator[None]:
    """A context that ends at the problem of a value, which is added to `problems` with its path."""
    try:
        yield
    except ValueProblem as problem:
        problems.append(problem.below(*path))


class ExpressionError(ValueProblem):
    """A text that is not an expression, or one that has no value.

    `column` counts characters from 1, and stands in the message; None where no single place is to blame.
    """

    def __init__(self, message: str, *, column: int | None = None, **details: Any) -> None:
        super().__init__(message if column is None else f"{message} at column {column}", **details)
        self.column = column


class Excerpt(NamedTuple):
    """A line of a document as it is typed, and the column (from 1) of the mistake."""

    text: str
    column: int

    @classmethod
    def of(cls, typed: str, column: int) -> Self:
        """The part of a long line round a column."""
        start = max(0, column - LONGEST_SHOWN)
        return cls(typed[start : start + 2 * LONGEST_SHOWN - 50], column - start)

    def __str__(self) -> str:
        blanks = " " * len(printable(self.text[: self.column - 1]))
        return f"    {printable(self.text)}\n    {blanks}^"


@dataclass(frozen=True, slots=True, repr=False)
class Problem:
    """One thing that is wrong with a document, and where; `code` names its kind for programs."""

    source: str
    message: str
    line: int | None = None
    key: str = ""
    hint: str | None = None
    code: str = ""
    excerpt: Excerpt | None = None

    def __repr__(self) -> str:
        return f"Problem({str(self)!r})"

    def __str__(self) -> str:
        place = self.source if self.line is None else f"{self.source}:{self.line}"
        text = ": ".join(printable(part) for part in (place, shortened(self.key), self.message) if part)
        text += f"\n{self.excerpt}" if self.excerpt else ""
        return text if self.hint is None else f"{text}\n  hint: {printable(self.hint)}"


MOST_PROBLEMS = 200  # the most problems of a document that its message lists: more help nobody


class DocumentError(RigidError):
    """A document that is refused, with all that is wrong with it."""

    exit_code = 3

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems[:MOST_PROBLEMS]]
        if len(self.problems) > MOST_PROBLEMS:
            lines.append(f"{self.problems[0].source}: {len(self.problems) - MOST_PROBLEMS:,} more problems")
        super().__init__("\n".join(lines))


def printable(text: str) -> str:
    """`text` without what could steer a terminal: control characters and marks of direction are escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, most: int = 200) -> str:
    """`text`, or as much of its beginning as there is room for."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


MOST_LISTED = 20  # the most names that a message lists: two lines of them
LONGEST_SHOWN = 60  # the most characters of a value that a message repeats, so that it fits on a line


def first_few(texts: Sequence[str], show: Callable[[str], str] = str) -> str:
    """As many of some texts as a message has room for, and how many more there are."""
    more = f" and {len(texts) - MOST_LISTED} more" if len(texts) > MOST_LISTED else ""
    return ", ".join(map(show, texts[:MOST_LISTED])) + more


def shown(raw: object) -> str:
    """A value as read, short and safe to print: backquotes round it, control characters escaped."""
    if isinstance(raw, dict):
        return "a mapping"
    if isinstance(raw, list | tuple):
        return f"a list of {len(raw)}" if raw else "an empty list"
    if raw is None:
        return "nothing"
    text = in_yaml(raw)
    if not text.isprintable():
        import json

        text = json.dumps(text)
    return f"`{shortened(text, LONGEST_SHOWN)}`"


def in_yaml(value: object) -> str:
    """A value as it is written in one line of a document: `[1, 2 cm]`, `{x: 1}`, `null`."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {in_yaml(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(in_yaml, value))}]"
    if isinstance(value, Decimal):
        return str(value).replace("E+", "e").replace("E", "e")  # as most people type it
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def with_article(noun: str) -> str:
    """The noun after `a` or `an`: `a mass`, `an angle`."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"
