"""`--set KEY=VALUE`: values of a document that are given from outside it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, TypeAlias

from rigidcli.errors import DocumentError, Path, Problem, UsageError, shown

Change: TypeAlias = tuple[Path, object]
"""The path to a value, and what is to stand there."""

_SETTING = re.compile(r"([^=.]+(?:\.[^=.]+)*)=(.*)", re.DOTALL)
"""Keys joined by points, and the value after the first `=`."""


def split_setting(text: str) -> tuple[Path, str]:
    """`a.0.b=value` as path and text of the value. Raises UsageError for anything else."""
    found = _SETTING.fullmatch(text)
    if found is None:
        raise UsageError(
            f"--set: read {shown(text)}, expected KEY=VALUE", hint='as in --set body.mass="3 kg"'
        )
    key, value = found.groups()
    return tuple(int(step) if step.isdecimal() else step for step in key.split(".")), value


def apply(tree: Any, changes: Sequence[Change], source: str) -> Any:
    """`tree` with values replaced or added. Raises DocumentError where there is no such place."""
    for path, value in changes:
        place = tree
        for done, step in enumerate(path, start=1):
            if isinstance(place, dict):
                step = str(step)
                place.setdefault(step, {})
            elif not (isinstance(place, list) and isinstance(step, int) and step < len(place)):
                key = ".".join(map(str, path))
                problem = f"--set {key}: there is no {shown(str(step))} in {shown(place)}"
                raise DocumentError([Problem(source, problem)])
            if done == len(path):
                place[step] = value
            place = place[step]
    return tree
