"""Where the values of a document stand: in the lines of a text, or in a file that is a body by itself."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from rigidcli.document.document import Place
from rigidcli.document.syntax import read_tree
from rigidcli.errors import Excerpt, Path, Problem, ValueProblem

NEAR = 20
"""A value begins within so many lines of its key, or the line is not shown."""

LONGEST_LINE = 2000
"""The longest line (characters) that is searched for a slip: nobody would find the place in a longer one."""

BODY_FILES = {
    ".csv": "points",
    ".glb": "mesh",
    ".gltf": "mesh",
    ".npy": "points",
    ".obj": "mesh",
    ".off": "mesh",
    ".ply": "mesh",
    ".stl": "mesh",
    ".xyz": "points",
}
"""The key under which a document names a body that is a file, by the ending of the file's name."""

COMPLETION = {"body": "body.density=7850"}
"""The setting that is an example of what a section lacks, where that is not the missing key itself."""


def body_form(name: str) -> str | None:
    """The key of the body that the file of this name is by itself; None for the file of a document."""
    return BODY_FILES.get(pathlib.PurePath(name).suffix.lower())


@dataclass
class Places:
    """Where the values of a text stand: its lines are looked up in a second pass, when first asked for.

    `changed` has the paths to values that are given from outside, each with the option that gave it, and
    `outside` says so in comments.
    """

    text: str
    source: str
    changed: dict[Path, str] = field(default_factory=dict)
    outside: str = ""

    @property
    def whole(self) -> str:
        """The text, and what is given from outside."""
        return f"{self.text.rstrip()}\n{self.outside}"

    def with_changes(self, changed: dict[Path, str], settings: Sequence[str]) -> Self:
        """The same places where values are `changed` by `settings`, which are texts `KEY=VALUE`."""
        if not (changed or settings):
            return self
        places = copy(self)
        places.changed = changed
        places.outside = "".join(f"# with {setting}\n" for setting in settings)
        return places

    def within(self, folder: pathlib.Path) -> Self:
        """The same places where files are named by their way from the root, which `folder` begins with."""
        return self

    def tree(self, decimal: Callable[[str], object]) -> Any:
        """The tree of the document, its decimals made by `decimal`. Raises DocumentError."""
        return read_tree(self.text, self.source, decimal)

    @cached_property
    def _lines(self) -> dict[Path, int]:
        lines: dict[Path, int] = {}
        read_tree(self.text, self.source, lines=lines)
        return lines

    @cached_property
    def _typed(self) -> list[str]:
        return self.text.splitlines()

    def of(self, path: Path) -> Place:
        """The source and line of a value, or of what is nearest above it; without a line if set outside."""
        for changed, option in reversed(self.changed.items()):
            if path[: len(changed)] == changed:
                return f"{self.source} with {option}", None
        known = (path[:end] for end in range(len(path), 0, -1) if path[:end] in self._lines)
        return self.source, self._lines.get(next(known, ()))

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem, at the place of its value."""
        source, line = self.of(problem.path)
        if source == self.source:
            line = line or 1  # that of the document itself
        excerpt = None
        if problem.typed is not None and line is not None:
            typed = problem.typed.partition("\n")[0].strip()
            for number, text in enumerate(self._typed[line - 1 : line + NEAR], start=line):
                if len(text) <= LONGEST_LINE and typed in text:
                    line, excerpt = number, Excerpt.of(text, text.index(typed) + 1)
                    break
        key = ".".join(map(str, problem.path))
        return Problem(source, problem.message, line, key, problem.hint, problem.code, excerpt)


class BodyPlaces(Places):
    """The places of a document that consists of one file, which is a body by itself.

    Nothing of the document is written anywhere, and nothing has a line but what stands in the file.
    """

    def __init__(self, name: str, source: str, form: str) -> None:
        super().__init__("", source)
        self._path = pathlib.Path(name)
        self._form = form

    def within(self, folder: pathlib.Path) -> Self:
        """The same places, of the file by its way from the root."""
        places = copy(self)
        places._path = folder / self._path.name
        return places

    def tree(self, decimal: Callable[[str], object]) -> Any:
        """The document that has the file as its body."""
        return {"body": {self._form: self._path.name}}

    @cached_property
    def _lines(self) -> dict[Path, int]:
        return {}

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem, at the line of the file where its message begins with one, and else with a setting."""
        source, _ = self.of(problem.path)
        in_file = re.fullmatch(rf"{re.escape(str(self._path))}(?::(\d+))?: (.*)", problem.message, re.DOTALL)
        if in_file is not None:
            line, message = in_file.groups()
            return Problem(source, message, int(line) if line else None, hint=problem.hint)
        key, hint = ".".join(map(str, problem.path)), problem.hint
        if source == self.source and hint is None and problem.message.startswith(("missing", "neither")):
            example = COMPLETION.get(key, f"{key}=VALUE")
            hint = f"the file is the body of a document, which settings complete, as `--set {example}`"
        return Problem(source, problem.message, key=key, hint=hint, code=problem.code)
