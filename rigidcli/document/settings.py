"""`--set KEY=VALUE` and `--sweep`: values of a document that are given from outside it."""

from __future__ import annotations

import re
from copy import copy
from functools import lru_cache
from typing import Any

from rigidcli.errors import UNKNOWN, DocumentError, Path, Problem, UsageError, nearest, shown

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


def put(tree: Any, path: Path, value: object, source: str, option: str) -> tuple[Any, Path]:
    """A tree with another value at the end of `path`, and the path with the indices of entries in lists.

    What is not on the way is shared with the given tree, which stays as it is. Raises DocumentError, which
    names the option, where there is no such place.
    """
    root = place = copy(tree)
    way: list[str | int] = []
    for done, step in enumerate(path, start=1):
        if not isinstance(place, dict):
            step = _index(place, step, path, source, option)
        else:
            step = str(step)
            if step not in place and done < len(path):
                if isinstance(path[done], int):
                    whole = ".".join(map(str, path[:done]))
                    hint = f"give it whole, as in `--set {whole}=[0, 0, 1]`"
                    raise _nowhere(path, source, option, f"there is no list `{whole}`", hint)
                place[step] = {}
        way.append(step)
        place[step] = value if done == len(path) else copy(place[step])
        place = place[step]
    return root, tuple(way)


def _nowhere(path: Path, source: str, option: str, what: str, hint: str | None) -> DocumentError:
    """The error of a path that leads nowhere."""
    message = f"{option} {'.'.join(map(str, path))}: {what}"
    return DocumentError([Problem(source, message, hint=hint, code=UNKNOWN)])


def _index(place: Any, step: str | int, path: Path, source: str, option: str) -> int:
    """The entry of a list that a step of the path means, by its index or its name. Raises DocumentError."""
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
    raise _nowhere(path, source, option, what, hint)
