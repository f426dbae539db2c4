"""Names of files that are handed in: what Canvas and Moodle put before them, and what a student chose."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from rigidcli.errors import printable, shown

SUFFIXES = frozenset([".yaml", ".yml", ".json"])
"""Ends of the names of answer files, in small letters or capitals."""

MOST_NAMED = 20
"""Names that a message lists."""

# Moodle puts this before the name of a file, or into that of a folder: Jane Doe_4711_assignsubmission_file_
MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>[0-9]+)_assignsubmission_(?:file|onlinetext)(?:_(?P<own>.*))?")
# And Canvas, with a number for each file: doejane_LATE_4711_98765_homework.yaml
CANVAS = re.compile(r"(?P<name>[^_]+)(?:_LATE)?_(?P<id>[0-9]+)_(?P<number>[0-9]+)_(?P<own>.+)")


def is_answer(name: str) -> bool:
    """Whether a file has the name of an answer file."""
    return Path(name).suffix.lower() in SUFFIXES


def submitted(name: str, forms: Sequence[re.Pattern[str]] = (CANVAS, MOODLE)) -> tuple[str, str]:
    """The student, and the student's own name of a file, where Canvas or Moodle has joined the two.

    The student is empty in any other name. The first form that fits counts: a student may put another one
    into the rest.
    """
    found = next(filter(None, (form.fullmatch(name) for form in forms)), None)
    return (f"{found['name']}_{found['id']}", found["own"] or "") if found else ("", name)


def uncounted(name: str) -> str:
    """A name without the count that Canvas adds where a file is handed in again: `orbit-1.csv`."""
    return re.sub(r"-[0-9]+(?=\.[^.]*$)", "", name).casefold()


def listed(names: Sequence[str]) -> str:
    """Names in a message, short and safe to print."""
    first = ", ".join(shown(printable(name)) for name in names[:MOST_NAMED])
    return first if len(names) <= MOST_NAMED else f"{first} and {len(names) - MOST_NAMED} more"


def noted(what: str, names: Sequence[str]) -> list[str]:
    """A note on some students or files; none if there are none."""
    return [f"{what}: {listed(sorted(names))}"] if names else []
