"""The pages of `explain`, as wide as the terminal."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from textwrap import indent
from typing import NamedTuple

from rigidcli.errors import UsageError, ValueProblem, shown
from rigidcli.fields.words import shapes_called
from rigidcli.suggestions import did_you_mean, nearest

WIDTH = 80  # characters in a line of a page that no terminal shows
# In wider terminals lines stay as short as people like to read; in narrower ones two columns need as much.
LEAST_WIDTH, MOST_WIDTH = 60, 120
LONGEST_NAME = 32  # characters of a name that stands beside what it is
ENTRIES = Path(__file__).with_name("entries.json")  # the file with all entries
EXAMPLE_PATHS = ("body", "body.shape.cone", "motion.omega", "axes.groups", "rpm", "atan2", "sign_error")


class Entry(NamedTuple):
    """What is explained: the way to it from a topic, a text, further facts by their names, and an example.

    The page of the entry above lists it under the heading `group`, with the text of its `row`, which mostly
    is the same. It is also found by `other_names`.
    """

    path: tuple[str, ...]
    text: str = ""
    group: str = ""
    facts: Mapping[str, str] = {}
    other_names: Sequence[str] = ()
    row: str = ""
    example: str = ""


@cache
def stored() -> list[Entry]:
    """All entries, as they stand in entries.json."""
    return [Entry(tuple(path), *rest) for path, *rest in json.loads(ENTRIES.read_text("utf-8"))]


def width_for(terminal: int | None) -> int:
    """The width of pages in a terminal of so many columns; None is no terminal."""
    return WIDTH if terminal is None else min(max(terminal, LEAST_WIDTH), MOST_WIDTH)


def overview(width: int = WIDTH) -> str:
    """The page of `explain` without a path: the topics, and examples."""
    topics = [(entry.path[0], entry.text) for entry in stored() if len(entry.path) == 1]
    return _page(
        _paragraph(
            "`rigidcli explain PATH` explains a key, shape, unit, function, result, mistake or subject.",
            width,
        ),
        _rows(topics, width),
        "Examples:\n" + "\n".join(f"  rigidcli explain {example}" for example in EXAMPLE_PATHS),
    )


def explain(path: str, width: int = WIDTH) -> str:
    """The pages of a path, or of all that has this name. Raises UsageError for an unknown name.

    Indices of lists may stand in the path, and so may the way to a body within another one.
    """
    typed = "body.shape" if path == "shapes" else path
    steps = tuple(step for step in typed.split(".") if not step.isdecimal()) or (path,)
    every, plain = stored(), _plain(path)
    subjects = [
        entry for entry in every if entry.path[0] == "subjects" and plain in map(_plain, entry.other_names)
    ]
    while not (matches := _called(steps)) and len(steps) > 1 and _called(steps[:1]):
        steps = steps[1:]
    # A page of one sentence that a subject repeats is not shown once more.
    repeated = {text for subject in subjects for text in subject.facts.values()}
    matches = subjects + [entry for entry in matches if entry not in subjects and entry.text not in repeated]
    if not matches and len(steps) == 1:
        with suppress(ValueProblem):
            matches = [_unit(path)]
    shapes = [("body", "shape", shape) for shape in shapes_called(path)]
    if matches := matches or [entry for entry in every if entry.path[1:] in shapes]:
        return "\n".join(_pages(matches, width))
    raise UsageError(
        f"nothing is called {shown(path)}{did_you_mean(_near(path))}",
        hint="`rigidcli explain` lists what there is",
    )


def _near(path: str) -> str | None:
    """The path of an entry that is spelled nearly so: a key at the same place, a topic, or a subject."""
    *above, last = path.split(".")
    every, parents = stored(), {entry.path for entry in _called(tuple(above))} if above else set()
    names = {entry.path[-1] for entry in every for parent in parents if entry.path[: len(parent)] == parent}
    of_files = ("document", "assignment", "answers")
    keys = [each.path[-1] for each in every if len(each.path) == 1 or each.path[0] in of_files]
    subjects = [name for entry in every if entry.path[0] == "subjects" for name in entry.other_names]
    alike = [name for name in subjects if name[0] == last[:1].casefold()]
    near = nearest(last, sorted(names)) if names else nearest(last, sorted({*keys})) or nearest(last, alike)
    return near and ".".join((*above, near))


def _plain(name: str) -> str:
    """A name in small letters, without hyphens and the endings of plurals."""
    words = re.split(r"[-_\s]+", name.strip().casefold().replace("\N{RIGHT SINGLE QUOTATION MARK}", "'"))
    return " ".join(word.removesuffix("'s").removesuffix("s") for word in words if word != "the")


def _unit(name: str) -> Entry:
    """The entry of a unit, with a prefix or without. Raises ValueProblem for another name."""
    from rigidcli.fields.units import TABLE, parse_unit

    parsed = parse_unit(name)
    dimension = str(parsed.dimension)
    facts = {"is": f"{parsed.scale:.12g} {dimension.partition('(')[2].rstrip(')') or dimension}"}
    facts["names"] = next((names for names, *_ in TABLE if name in names.split() and names != name), "")
    return Entry(("units", name), f"measures {dimension}", facts=facts)


def _called(steps: tuple[str, ...]) -> list[Entry]:
    """The entries at a path: a topic, else from the top of a topic, else those whose path ends so."""
    every, name = stored(), steps[0] if len(steps) == 1 else None
    return (
        [entry for entry in every if entry.path == steps]
        or [entry for entry in every if entry.path[1:] == steps]
        or [e for e in every if e.path[-len(steps) :] == steps or name in e.other_names]
    )


def _pages(matches: Sequence[Entry], width: int) -> list[str]:
    """The pages of entries; those that say the same share one."""
    alike: dict[str, list[str]] = {}
    for entry in matches:
        depth = len(entry.path)
        below = [other for other in stored() if other.path[:depth] == entry.path and len(other.path) > depth]
        if entry.path != ("assignment",):  # its page shows the keys of all its sections
            below = [other for other in below if len(other.path) == depth + 1]
        groups = [
            (f"{_paragraph(group, width)}\n" if group else "")
            + _rows(
                [
                    (".".join(other.path[depth:]), other.row or other.text)
                    for other in below
                    if other.group == group
                ],
                width,
            )
            for group in dict.fromkeys(other.group for other in below)
        ]
        facts = _rows([fact for fact in entry.facts.items() if fact[1]], width)
        example = entry.example and f"Example:\n{indent(entry.example, '  ')}"
        heads = alike.setdefault(_page(_paragraph(entry.text, width), *groups, facts, example), [])
        is_plain = entry.path[0] in ("document", "results", "subjects")
        head = ".".join(entry.path[1:] if is_plain else entry.path)
        heads.append(head or entry.path[0])
    return [
        _page(_paragraph(", ".join(dict.fromkeys(heads)), width), page[:-1]) for page, heads in alike.items()
    ]


def _paragraph(text: str, width: int) -> str:
    return textwrap.fill(" ".join(text.split()), width, break_on_hyphens=False)


def _rows(entries: Sequence[tuple[str, str]], width: int) -> str:
    """Names and what they are, side by side; a name that is longer than others has a line of its own."""
    widest = max((len(name) for name, _ in entries if len(name) <= LONGEST_NAME), default=0)
    margin = " " * (widest + 4)
    lines = []
    for name, text in entries:
        words = " ".join(text.split())
        filled = textwrap.wrap(words, width - len(margin), break_on_hyphens=False) or [""]
        first = [] if len(name) > widest and text else [f"  {name:{widest}}  {filled.pop(0)}".rstrip()]
        lines += [*(first or [f"  {name}"]), *(margin + line for line in filled)]
    return "\n".join(lines)


def _page(*parts: str) -> str:
    return "\n\n".join(part for part in parts if part) + "\n"
