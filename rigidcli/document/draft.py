"""A document as it is written: its values, where each of them stands, and what is changed from outside."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Self

from rigidcli.document.syntax import decimal, read_tree, read_value
from rigidcli.errors import (
    UNKNOWN,
    DocumentError,
    Excerpt,
    Path,
    Problem,
    UsageError,
    ValueProblem,
    shown,
)
from rigidcli.fields.texts import ending

if TYPE_CHECKING:
    from rigidcli.bodies.robots.links import Link

NEAR = 20
"""A value begins within so many lines of its key, or the line is not shown."""

BODY_FILES = dict.fromkeys((".glb", ".obj", ".off", ".ply", ".stl"), "mesh") | dict.fromkeys(
    (".csv", ".npy", ".xyz"), "points"
)
"""The key under which a document names a body that is a file, by the ending of the file's name."""

SWEEP = "--sweep"
"""The option that gives values one after the other."""

_SETTING = re.compile(r"([^=.]+(?:\.[^=.]+)*)=(.*)", re.DOTALL)
"""Keys joined by points, and the value after the first `=`."""


def body_form(name: str) -> str | None:
    """The key of the body that the file of this name is by itself; None for the file of a document."""
    return BODY_FILES.get(ending(name))


def split_setting(
    text: str, option: str = "--set", expected: str = "KEY=VALUE", example: str = 'body.mass="3 kg"'
) -> tuple[Path, str]:
    """`a.0.b=value` as path and text of the value. Raises UsageError, which names the option, for others."""
    found = _SETTING.fullmatch(text)
    if found is None:
        message = f"{option}: read {shown(text)}, expected {expected}"
        raise UsageError(message, hint=f"as in {option} {example}")
    key, value = found.groups()
    return _steps(key), value


@lru_cache(maxsize=64)
def _steps(key: str) -> Path:
    """The path that a key means; a sweep asks for the same one at every value."""
    steps = re.sub(r"\[(\d+)\]", r".\1", key).split(".")  # `size[0]` is `size.0`
    return tuple(int(step) if step.isdecimal() else step for step in map(str.strip, steps))


def put(tree: Any, path: Path, value: object) -> tuple[Any, Path]:
    """A tree with another value at the end of `path`, and the path with the indices of entries in lists.

    What is not on the way is shared with the given tree, which stays as it is. Raises ValueProblem where
    there is no such place.
    """
    root = place = copy(tree)
    way: list[str | int] = []
    for done, step in enumerate(path, start=1):
        if not isinstance(place, dict):
            step = _index(place, step)
        else:
            step = str(step)
            if step not in place and done < len(path):
                if isinstance(path[done], int):
                    whole = ".".join(map(str, path[:done]))
                    hint = f"give it whole, as in `--set {whole}=[0, 0, 1]`"
                    raise ValueProblem(f"there is no list `{whole}`", hint=hint)
                place[step] = {}
        way.append(step)
        place[step] = value if done == len(path) else copy(place[step])
        place = place[step]
    return root, tuple(way)


def _index(place: Any, step: str | int) -> int:
    """The entry of a list that a step of a path means. Raises ValueProblem where there is none."""
    entries = place if isinstance(place, list) else []
    if isinstance(step, int) and step < len(entries):
        return step
    hint = f"its entries are 0 to {len(entries) - 1}" if entries else None
    raise ValueProblem(f"there is no {shown(str(step))} in {shown(place)}", hint=hint)


@dataclass(frozen=True, eq=False)
class Draft:
    """What is written, as a tree of mappings, lists and scalars, and how it is to be read.

    `lines` has the line of every key and entry in the `text`; files that the document names are looked for
    in `folder`. `settings` are texts `KEY=VALUE`, as after `--set`, which are still to be put into the tree;
    `options` has the keys of those that an option of its own has given, with its name. `changed` has the
    paths to values that have been put there, each with its option, and `typed` these settings. `exact` makes
    decimals rationals and parameters without a value symbols. A file that is a body by itself has the key of
    that as its `form`; a link of a robot is `link`.
    """

    source: str
    tree: Any
    text: str = ""
    lines: Mapping[Path, int] = field(default_factory=dict)
    folder: str = ""
    exact: bool = False
    settings: Sequence[str] = ()
    options: Mapping[str, str] = field(default_factory=dict)
    changed: Mapping[Path, str] = field(default_factory=dict)
    typed: tuple[str, ...] = ()
    form: str | None = None
    link: Link | None = None

    @property
    def whole(self) -> str:
        """The text, and below it, in comments, what is given from outside."""
        return f"{self.text.rstrip()}\n" + "".join(f"# with {setting}\n" for setting in self.typed)

    @property
    def has_symbols(self) -> bool:
        """Whether a parameter stands without a value."""
        parameters = self.tree.get("parameters") if isinstance(self.tree, dict) else None
        return isinstance(parameters, dict) and None in parameters.values()

    def absolute(self) -> Self:
        """The same draft for a process in another folder, which reads the files that the document names."""
        return replace(self, folder=str(pathlib.Path(self.folder).absolute()))

    def changed_by(self, settings: Sequence[str], option: str = "--set") -> Self:
        """The same with values changed or added by texts `KEY=VALUE`. Raises DocumentError and UsageError."""
        if not settings:
            return self
        tree, changed = self.tree, dict(self.changed)
        for setting in settings:
            path, text = split_setting(setting)
            key = ".".join(map(str, path))
            own = self.options.get(key)
            value = read_value(text, own or f"{option} {key}")
            try:
                tree, place = put(tree, path, value)
            except ValueProblem as problem:
                message = f"{option} {key}: {problem.message}"
                refused = Problem(self.source, message, hint=problem.hint, code=UNKNOWN)
                raise DocumentError([refused]) from None
            changed[place] = own or option
        return replace(self, tree=tree, changed=changed, typed=(*self.typed, *settings))

    def place(self, path: Path) -> tuple[str, int | None]:
        """The source and line of a value, or of what is nearest above it; without a line if set outside."""
        for changed, option in reversed([*self.changed.items()]):
            if path[: len(changed)] == changed:
                return f"{self.source} with {option}", None
        above = (path[:end] for end in range(len(path), -1, -1))
        return self.source, next((self.lines[path] for path in above if path in self.lines), None)

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem, at the place of its value."""
        source, line = self.place(problem.path)
        key = ".".join(map(str, problem.path))
        if self.form is not None:
            return self._of_file(problem, source, key)
        if source == self.source:
            line = line or 1  # that of the document itself
        excerpt, typed = None, (problem.typed or "").partition("\n")[0].strip()
        if typed and line is not None:
            below = enumerate(self.text.splitlines()[line - 1 : line + NEAR], start=line)
            line, text = next(((number, text) for number, text in below if typed in text), (line, ""))
            excerpt = Excerpt.of(text, text.index(typed) + 1) if text else None
        if self.link is not None:
            if problem.path[:1] == ("body",) and source == self.source:
                # What stands in the file of a robot has no keys of documents.
                key = str(problem.path[-1]) if problem.path[-1] in ("mass", "position", "rotation") else ""
            key = f"link {self.link.name}: {key}".removesuffix(": ")
        return Problem(source, problem.message, line, key, problem.hint, problem.code, excerpt)

    def _of_file(self, problem: ValueProblem, source: str, key: str) -> Problem:
        """The problem of a body that is a file: at the line of that with which its message may begin."""
        file = re.escape(str(pathlib.PurePath(self.folder, str(self.tree["body"][self.form]))))
        in_file = re.fullmatch(rf"{file}(?::(\d+))?: (.*)", problem.message, re.DOTALL)
        if in_file is not None:
            line, message = in_file.groups()
            return Problem(source, message, int(line) if line else None, hint=problem.hint)
        hint = problem.hint
        if source == self.source and hint is None and problem.message.startswith(("missing", "neither")):
            example = "body.density=7850" if key == "body" else f"{key}=VALUE"
            hint = f"the file is the body of a document, which settings complete, as `--set {example}`"
        return Problem(source, problem.message, key=key, hint=hint, code=problem.code)


def of_text(text: str, source: str, folder: str = "", **options: Any) -> Draft:
    """What is written in a text of YAML. Raises DocumentError."""
    lines: dict[Path, int] = {}
    return Draft(source, read_tree(text, source, decimal, lines), text, lines, folder, **options)
