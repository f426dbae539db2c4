"""Values that are given to no purpose: `--set` and `--sweep` with keys that no FILE has or uses."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rigidcli.cli.work import Work
from rigidcli.errors import UNKNOWN, DocumentError, Path, UsageError

if TYPE_CHECKING:
    from rigidcli.document.draft import Draft
    from rigidcli.document.sweeps import Sweep

IDLE = {
    "inertia": "motion top tide system orbit equilibrium transform",
    "axes": "top tide system orbit equilibrium transform",
    "precess": "system orbit equilibrium transform",
    "euler": "tide system orbit equilibrium transform",
    "hamilton": "body about axis frame motion top tide",
}
"""The keys at the top of a document that a command does not read."""


def require_used(work: Work, files: Sequence[str], sweep: Sweep | None) -> None:
    """Raise UsageError for a key that is set or swept, and that no FILE has or uses.

    Nothing is said where a FILE can be read only once, as standard input and pipes.
    """
    from rigidcli.document.draft import SWEEP, split_setting

    first = [] if sweep is None else sweep.settings(sweep.point(0))
    given = [("--set", text) for text in work.settings] + [(SWEEP, text) for text in first]
    for option, text in given:
        path, _ = split_setting(text)
        key = ".".join(map(str, path))
        if key not in work.named and all(_is_idle(work, file, path, first) for file in files):
            hint = f"`{work.command.name}` does not read `{path[0]}`"
            if path[0] == "parameters":
                hint = "a parameter is used where its name stands in the document"
            raise UsageError(f"{option} {key}: no FILE has this key, or uses it", hint=hint)


def _is_idle(work: Work, file: str, path: Path, first: Sequence[str]) -> bool:
    """Whether no document of a file has what the path leads to, nor does the command use it there."""
    if not os.path.isfile(file):  # noqa: PTH113 - as typed
        return False
    try:
        return all(_is_idle_in(draft, work, path, first) for draft in work.drafts(file).each)
    except DocumentError:
        return False  # it is told when the file is worked


def _is_idle_in(draft: Draft, work: Work, path: Path, first: Sequence[str]) -> bool:
    from rigidcli.document.load import read

    tree, rest = draft.tree, list(path)
    while rest and isinstance(tree, dict) and rest[0] in tree:
        tree = tree[rest.pop(0)]
    is_parameter = path[0] == "parameters"
    if not rest or not (is_parameter or path[0] in IDLE[work.command.name].split()):
        return False
    try:
        return not is_parameter or path[-1] in read(draft, first).unused
    except DocumentError as error:  # a key that no document has is told when the file is worked
        return not is_parameter and UNKNOWN not in {problem.code for problem in error.problems}
