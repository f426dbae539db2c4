"""What a document is read from: a text, a file that is a body by itself, or a link of a robot.

`--set KEY=VALUE` and `--sweep` change values of it from outside.
"""

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
    nearest,
    shown,
)

if TYPE_CHECKING:
    from rigidcli.bodies.robots.links import Link

NEAR = 20
"""A value begins within so many lines of its key, or the line is not shown."""

LONGEST_LINE = 2000
"""The longest line (characters) that is searched for a slip: nobody would find the place in a longer one."""

MOST_LINKS = 1000
"""The most links of a robot, which take two seconds to read as documents; the largest robots have 200."""

BODY_FILES = dict.fromkeys((".glb", ".gltf", ".obj", ".off", ".ply", ".stl"), "mesh") | dict.fromkeys(
    (".csv", ".npy", ".xyz"), "points"
)
"""The key under which a document names a body that is a file, by the ending of the file's name."""


def body_form(name: str) -> str | None:
    """The key of the body that the file of this name is by itself; None for the file of a document."""
    return BODY_FILES.get(pathlib.PurePath(name).suffix.lower())


SWEEP = "--sweep"
"""The option that gives values one after the other."""

_SETTING = re.compile(r"([^=.]+(?:\.[^=.]+)*)=(.*)", re.DOTALL)
"""Keys joined by points, and the value after the first `=`."""


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
    """The entry of a list that a step of a path means, by its index or its name. Raises ValueProblem."""
    entries = place if isinstance(place, list) else []
    if isinstance(step, int) and step < len(entries):
        return step
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
    if names.count(str(step)) == 1:
        return names.index(str(step))
    known = [name for name in names if isinstance(name, str)]
    near = nearest(str(step), known)
    what = f"there is no {shown(str(step))} in {shown(place)}{f' (did you mean {near}?)' if near else ''}"
    if str(step) in names:
        what = f"{names.count(str(step))} entries have the name {shown(str(step))}"
    hint = f"its entries are 0 to {len(entries) - 1}" if entries else None
    if known and hint is not None:
        hint += f", or by their names: {', '.join(known)}"
    raise ValueProblem(what, hint=hint)


@dataclass(frozen=True)
class Origin:
    """What is written, as a tree of mappings, lists and scalars, and where each value stands.

    `lines` has the line of every key and entry; files that the document names are looked for in `folder`.
    `changed` has the paths to values that are given from outside, each with the option that gave it, and
    `settings` has these as they are typed.
    """

    source: str
    folder: pathlib.Path
    tree: Any
    text: str = ""
    lines: Mapping[Path, int] = field(default_factory=dict)
    changed: Mapping[Path, str] = field(default_factory=dict)
    settings: tuple[str, ...] = ()

    @property
    def whole(self) -> str:
        """The text, and below it, in comments, what is given from outside."""
        return f"{self.text.rstrip()}\n" + "".join(f"# with {setting}\n" for setting in self.settings)

    def changed_by(
        self, settings: Sequence[str], options: Mapping[str, str] | None = None, option: str = "--set"
    ) -> Self:
        """The same with values replaced or added by `settings`, texts `KEY=VALUE`; this one stays as it is.

        `options` has the keys that an option of its own has given. Raises DocumentError, or UsageError.
        """
        if not settings:
            return self
        tree, changed = self.tree, dict(self.changed)
        for setting in settings:
            path, text = split_setting(setting)
            key = ".".join(map(str, path))
            own = (options or {}).get(key)
            value = read_value(text, own or f"{option} {key}")
            try:
                tree, place = put(tree, path, value)
            except ValueProblem as problem:
                message = f"{option} {key}: {problem.message}"
                raise DocumentError(
                    [Problem(self.source, message, hint=problem.hint, code=UNKNOWN)]
                ) from None
            changed[place] = own or option
        return replace(self, tree=tree, changed=changed, settings=(*self.settings, *settings))

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
        if source == self.source:
            line = line or 1  # that of the document itself
        excerpt, typed = None, (problem.typed or "").partition("\n")[0].strip()
        if typed and line is not None:
            for number, text in enumerate(self.text.splitlines()[line - 1 : line + NEAR], start=line):
                if len(text) <= LONGEST_LINE and typed in text:
                    line, excerpt = number, Excerpt.of(text, text.index(typed) + 1)
                    break
        key = ".".join(map(str, problem.path))
        return Problem(source, problem.message, line, key, problem.hint, problem.code, excerpt)


def of_text(text: str, source: str, folder: pathlib.Path | None = None) -> Origin:
    """What is written in a text of YAML. Raises DocumentError."""
    lines: dict[Path, int] = {}
    return Origin(source, folder or pathlib.Path(), read_tree(text, source, decimal, lines), text, lines)


@dataclass(frozen=True)
class BodyFile(Origin):
    """A file that is a body by itself. Nothing has a line but what stands in the file."""

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem, at the line of the file where its message begins with one, and else with a setting."""
        source, _ = self.place(problem.path)
        (name,) = (value for key, value in self.tree["body"].items() if key in BODY_FILES.values())
        file = re.escape(str(self.folder / str(name)))
        in_file = re.fullmatch(rf"{file}(?::(\d+))?: (.*)", problem.message, re.DOTALL)
        if in_file is not None:
            line, message = in_file.groups()
            return Problem(source, message, int(line) if line else None, hint=problem.hint)
        key, hint = ".".join(map(str, problem.path)), problem.hint
        if source == self.source and hint is None and problem.message.startswith(("missing", "neither")):
            example = "body.density=7850" if key == "body" else f"{key}=VALUE"
            hint = f"the file is the body of a document, which settings complete, as `--set {example}`"
        return Problem(source, problem.message, key=key, hint=hint, code=problem.code)


@dataclass(frozen=True)
class LinkOrigin(Origin):
    """A link of a robot. Problems name it."""

    link: Link = field(kw_only=True)

    def problem(self, problem: ValueProblem) -> Problem:
        """The problem at the place of its value, with the name of the link and what it is about."""
        placed, key = super().problem(problem), f"link {self.link.name}"
        about = ".".join(map(str, problem.path))
        if problem.path[:1] == ("body",) and placed.source == self.source:
            # What stands in the file has no keys of documents.
            about = str(problem.path[-1]) if problem.path[-1] in ("mass", "position", "rotation") else ""
        return replace(placed, key=f"{key}: {about}" if about else key)


def links(text: str, source: str, folder: pathlib.Path) -> tuple[list[LinkOrigin], list[str]]:
    """The links of the robot in `text` that have a mass or a problem, and notes.

    Raises DocumentError for what is no robot.
    """
    from rigidcli.bodies.robots import read_robot
    from rigidcli.bodies.robots.links import listed

    robot = read_robot(text, source, folder)
    if len(robot.links) > MOST_LINKS:
        problem = f"there are {len(robot.links):,} links, expected at most {MOST_LINKS:,}"
        raise DocumentError([Problem(source, problem)])
    origins, without = [], dict[str, list[str]]()
    for link in robot.links:
        if link.without:
            without.setdefault(link.without, []).append(f"{link.name} (line {link.line})")
            continue
        lines: dict[Path, int] = {(): link.line, ("body",): link.line_of("inertia")}
        lines |= {("body", key): line for key, line in link.lines.items()}
        tree = {"name": link.name, "body": link.body}
        origins.append(LinkOrigin(link.source, folder, tree, text, lines, link=link))
    notes = [
        f"{len(names)} link{'s have' if len(names) > 1 else ' has'} {reason}: {listed(names)}"
        for reason, names in without.items()
    ]
    return origins, [*robot.notes, *notes]
