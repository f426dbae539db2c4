"""A document before validation: the tree of its values with their lines, and the settings of options."""

from __future__ import annotations

import pathlib
import re
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Self

from rigidcli.document.yaml_reader import TITLES, decimal, read_tree, read_value
from rigidcli.errors import (
    UNKNOWN_KEY,
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
    from rigidcli.bodies.robots import Link

LINES_BELOW_KEY = 20  # lines below a key in which its value is searched, to show it in a message

BODY_FILES = dict.fromkeys((".glb", ".obj", ".off", ".ply", ".stl"), "mesh") | dict.fromkeys(
    (".csv", ".npy", ".xyz"), "points"
)
"""The key under which a document names a body that is a file, by the ending of the file's name."""

VECTORS = ("about", "axis", "com", "omega", "position")  # keys of three components that may be left out
SWEEP = "--sweep"  # the option under which a key runs over several values
# Keys joined by points, and the value after the first `=`.
_SETTING = re.compile(r"([^=.]+(?:\.[^=.]+)*)=(.*)", re.DOTALL)


def body_form(name: str) -> str | None:
    """The key of `body` under which a document names this file; None where it is no body by itself."""
    return BODY_FILES.get(ending(name))


def split_setting(
    text: str, option: str = "--set", expected: str = "KEY=VALUE", example: str = 'body.mass="3 kg"'
) -> tuple[Path, str]:
    """The path and the text of the value in `a.0.b=value`. Raises UsageError, which names the option."""
    setting = _SETTING.fullmatch(text)
    if setting is None:
        message = f"{option}: read {shown(text)}, expected {expected}"
        raise UsageError(message, hint=f"as in {option} {example}")
    key, value = setting.groups()
    return _steps(key), value


@lru_cache(maxsize=64)
def _steps(key: str) -> Path:
    # A sweep asks for the same path at every value. `size[0]` is `size.0`.
    steps = re.sub(r"\[(\d+)\]", r".\1", key).split(".")
    return tuple(int(step) if step.isdecimal() else step for step in map(str.strip, steps))


def _is_parameter(path: Path, tree: Any) -> bool:
    # The document has such a parameter, or uses one that it does not declare.
    if len(path) > 1 or not isinstance(tree, dict) or path[0] in tree:
        return False
    return path[0] in (tree.get("parameters") or ()) or path[0] in names_in(tree)


def names_in(tree: Any) -> set[str]:
    """The names in the expressions of a tree: in its texts, but for titles and keys."""
    if isinstance(tree, str):
        return {*re.findall(r"[^\W\d]\w*", tree)}
    values = tree if isinstance(tree, list) else ()
    if isinstance(tree, dict):
        values = [value for key, value in tree.items() if key not in TITLES]
    return set[str]().union(*map(names_in, values))


def put(tree: Any, path: Path, value: object, above: Path = ()) -> tuple[Any, Path]:
    """A copy of the tree with another value at `path`, and the path with names of entries as indices.

    The copy shares what does not change. The path `above` leads to the tree. Raises ValueProblem if there is
    no such place.
    """
    if not path:
        return value, ()
    step, rest = path[0], path[1:]
    if isinstance(tree, dict):
        step = str(step)
        inner = tree.get(step, {})
        if step not in tree and rest and isinstance(rest[0], int):
            whole = ".".join(map(str, (*above, step)))
            hint = f"set one of the keys there: {', '.join(map(str, tree))}" if tree else None
            if step in VECTORS and len(rest) == 1:
                hint = f"give it whole, as in `--set {whole}=[0, 0, 1]`"
            raise ValueProblem(f"there is no list `{whole}`", hint=hint)
    else:
        entries = tree if isinstance(tree, list) else []
        names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
        count = names.count(step)
        step = names.index(step) if count == 1 else step
        if not (isinstance(step, int) and step < len(entries)):
            cure = f"its entries are 0 to {len(entries) - 1}" if entries else None
            if given := [str(name) for name in names if name is not None]:
                cure = f"{cure}, by name {', '.join(given)}"
            if count > 1:
                cure = f"the name stands {count} times: say which by its number, such as {names.index(step)}"
            raise ValueProblem(f"there is no {shown(str(step))} in {shown(tree)}", hint=cure)
        inner = entries[step]
    inner, way = put(inner, rest, value, (*above, step))
    changed = copy(tree)
    changed[step] = inner
    return changed, (step, *way)


@dataclass(frozen=True, eq=False)
class Draft:
    """The tree of mappings, lists and scalars in a document, and the way in which it is to be read.

    `lines`: the line of every key and entry in the `text`. `folder`: names of files are relative to it.
    `exact`: decimals are rationals, and parameters without a value are symbols.
    `options`: the names of options that set a key, by the key.
    `changed`: the options that have set values in the tree, by their paths; `typed`: these settings.
    `form`: the key of `body` for a file that is a body. `link`: a link of a robot.
    """

    source: str
    tree: Any
    text: str = ""
    lines: Mapping[Path, int] = field(default_factory=dict)
    folder: str = ""
    exact: bool = False
    options: Mapping[str, str] = field(default_factory=dict)
    changed: Mapping[Path, str] = field(default_factory=dict)
    typed: tuple[str, ...] = ()
    form: str | None = None
    link: Link | None = None

    @property
    def whole(self) -> str:
        """The text, and below it, in comments, the values that options have set."""
        return f"{self.text.rstrip()}\n" + "".join(f"# with {setting}\n" for setting in self.typed)

    @property
    def has_symbols(self) -> bool:
        """Whether a parameter has no value."""
        parameters = self.tree.get("parameters") if isinstance(self.tree, dict) else None
        return isinstance(parameters, dict) and None in parameters.values()

    def absolute(self) -> Self:
        """The same draft with an absolute folder, for a process in another folder."""
        return replace(self, folder=str(pathlib.Path(self.folder).absolute()))

    def changed_by(self, settings: Sequence[str], option: str = "--set") -> Self:
        """The draft with these values of `KEY=VALUE` in its tree. Raises DocumentError and UsageError."""
        if not settings:
            return self
        tree, changed = self.tree, dict(self.changed)
        for setting in settings:
            path, text = split_setting(setting)
            key = ".".join(map(str, path))
            if _is_parameter(path, tree):
                path = ("parameters", *path)
            own = self.options.get(key)
            value = read_value(text, own or f"{option} {key}")
            try:
                tree, place = put(tree, path, value)
            except ValueProblem as problem:
                message = f"{option} {key}: {problem.message}"
                refused = Problem(self.source, message, hint=problem.hint, code=UNKNOWN_KEY)
                raise DocumentError([refused]) from None
            changed[place] = own or option
        return replace(self, tree=tree, changed=changed, typed=(*self.typed, *settings))

    def place(self, path: Path) -> tuple[str, int | None]:
        """The source and line of a value, or of the nearest key above; values of options have no line."""
        for changed, option in reversed([*self.changed.items()]):
            if path[: len(changed)] == changed:
                return f"{self.source} with {option}", None
        above = (path[:end] for end in range(len(path), -1, -1))
        return self.source, next((self.lines[path] for path in above if path in self.lines), None)

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem of a value with its source, line and key."""
        source, line = self.place(problem.path)
        key = ".".join(map(str, problem.path))
        if self.form is not None:
            return self._of_file(problem, source, key)
        if source == self.source:
            line = line or 1  # a problem of the whole document
        excerpt, typed = None, (problem.typed or "").partition("\n")[0].strip()
        if typed and line is not None:
            below = enumerate(self.text.splitlines()[line - 1 : line + LINES_BELOW_KEY], start=line)
            line, text = next(((number, text) for number, text in below if typed in text), (line, ""))
            excerpt = Excerpt.of(text, text.index(typed) + 1) if text else None
        if self.link is not None:
            if problem.path[:1] == ("body",) and source == self.source:
                # A robot description has no keys of documents.
                key = str(problem.path[-1]) if problem.path[-1] in ("mass", "position", "rotation") else ""
            key = f"link {self.link.name}: {key}".removesuffix(": ")
        return Problem(source, problem.message, line, key, problem.hint, problem.code, excerpt)

    def _of_file(self, problem: ValueProblem, source: str, key: str) -> Problem:
        """The problem of a file that is a body by itself, at the line with which the message may begin."""
        file = re.escape(str(pathlib.PurePath(self.folder, str(self.tree["body"][self.form]))))
        in_file = re.fullmatch(rf"{file}(?::(\d+))?: (.*)", problem.message, re.DOTALL)
        if in_file is not None:
            return Problem(source, in_file[2], int(in_file[1]) if in_file[1] else None, hint=problem.hint)
        hint = problem.hint
        if source == self.source and hint is None and problem.message.startswith(("missing", "neither")):
            example = "body.density=7850" if key == "body" else f"{key}=VALUE"
            hint = f"the file is the body of a document, which settings complete, as `--set {example}`"
        return Problem(source, problem.message, key=key, hint=hint, code=problem.code)


def of_text(text: str, source: str, folder: str = "", settings: Sequence[str] = (), **options: Any) -> Draft:
    """The draft of a text in YAML with these settings. Raises DocumentError and UsageError."""
    lines: dict[Path, int] = {}
    tree = read_tree(text, source, decimal, lines)
    return Draft(source, tree, text, lines, folder, **options).changed_by(settings)
