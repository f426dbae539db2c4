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
from typing import NamedTuple, TypeAlias

from rigidcli.errors import UsageError, ValueProblem, shown
from rigidcli.fields.words import shapes_called
from rigidcli.suggestions import did_you_mean, nearest

# Characters in a line of a page: without a terminal, in the narrowest one, and in the widest.
WIDTH, LEAST_WIDTH, MOST_WIDTH = 80, 60, 120
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


Rows: TypeAlias = tuple[str, tuple[tuple[str, str], ...]]  # a heading; names, and beside each what it is
Block: TypeAlias = Rows | str  # a text is filled, unless it has lines of its own


def explain(path: str | None, terminal: int | None = None) -> str:
    """The pages of a path, or of all that has this name; for a terminal of so many columns.

    Without a path, it is the page of the topics. Indices of lists may stand in the path, and so may the way
    to a body within another one. Raises UsageError for an unknown name.
    """
    width = WIDTH if terminal is None else min(max(terminal, LEAST_WIDTH), MOST_WIDTH)
    pages = [_overview()] if path is None else _pages(_matches(path))
    laid_out = ([_laid_out(block, width) for block in page] for page in pages)
    return "\n".join("\n\n".join(filter(None, page)) + "\n" for page in laid_out)


def _overview() -> list[Block]:
    return [
        "`rigidcli explain PATH` explains a key, shape, unit, function, result, mistake or subject.",
        ("", tuple((entry.path[0], entry.text) for entry in stored() if len(entry.path) == 1)),
        "\n  rigidcli explain ".join(["Examples:", *EXAMPLE_PATHS]),
    ]


def _matches(path: str) -> Sequence[Entry]:
    """The entries of a path. Raises UsageError."""
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
        return matches
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


def _pages(matches: Sequence[Entry]) -> list[list[Block]]:
    """The pages of entries; those that say the same share one."""
    alike: dict[tuple[Block, ...], list[str]] = {}
    for entry in matches:
        depth = len(entry.path)
        below = [other for other in stored() if other.path[:depth] == entry.path and len(other.path) > depth]
        if entry.path != ("assignment",):  # its page shows the keys of all its sections
            below = [other for other in below if len(other.path) == depth + 1]
        blocks: list[Block] = [" ".join(entry.text.split())]
        for group in dict.fromkeys(other.group for other in below):
            rows = [other for other in below if other.group == group]
            pairs = ((".".join(other.path[depth:]), other.row or other.text) for other in rows)
            blocks.append((group, tuple(pairs)))
        blocks.append(("", tuple(fact for fact in entry.facts.items() if fact[1])))
        blocks.append(entry.example and f"Example:\n{indent(entry.example, '  ')}")
        is_plain = entry.path[0] in ("document", "results", "subjects")
        head = ".".join(entry.path[1:] if is_plain else entry.path) or entry.path[0]
        alike.setdefault(tuple(blocks), []).append(head)
    return [[", ".join(dict.fromkeys(heads)), *blocks] for blocks, heads in alike.items()]


def _laid_out(block: Block, width: int) -> str:
    if isinstance(block, str):
        return block if "\n" in block else textwrap.fill(block, width, break_on_hyphens=False)
    heading, pairs = block
    widest = max((len(name) for name, _ in pairs if len(name) <= LONGEST_NAME), default=0)
    margin = " " * (widest + 4)
    lines = [_laid_out(heading, width)] if heading else []
    for name, text in pairs:
        words = " ".join(text.split())
        filled = textwrap.wrap(words, width - len(margin), break_on_hyphens=False) or [""]
        first = [] if len(name) > widest and text else [f"  {name:{widest}}  {filled.pop(0)}".rstrip()]
        lines += [*(first or [f"  {name}"]), *(margin + line for line in filled)]
    return "\n".join(lines)
