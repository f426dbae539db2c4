"""The pages of `explain`, for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from contextlib import suppress

from rigidcli.errors import UsageError, ValueProblem, did_you_mean, nearest, shown
from rigidcli.fields.words import shapes_called
from rigidcli.reference.results import Entry, results

WIDTH = 80
"""Characters in a line of a page, as in the narrowest terminal that people use."""

EXAMPLES = ("body", "body.shape.cone", "motion.omega", "axes.groups", "rpm", "atan2", "sign_error")


def overview() -> str:
    """The page of `explain` without a path: the topics, and examples."""
    from rigidcli.reference.entries import entries

    topics = [(entry.path[0], entry.text) for entry in entries() if len(entry.path) == 1]
    return _page(
        _paragraph("`rigidcli explain PATH` explains a key, shape, unit, function, result or mistake."),
        _rows(topics),
        "Examples:\n" + "\n".join(f"  rigidcli explain {example}" for example in EXAMPLES),
    )


def explain(path: str) -> str:
    """The pages of a path, or of all that has this name. Raises UsageError for an unknown name.

    Indices of lists may stand in the path, and so may the way to a body within another one.
    """
    typed = "body.shape" if path == "shapes" else path
    steps = tuple(step for step in typed.split(".") if not step.isdecimal()) or (path,)
    every = list(results())
    if matches := [entry for entry in every if entry.path[1:] == steps]:
        return "\n".join(_pages(matches, every))
    from rigidcli.reference.entries import entries, unit

    every = entries()
    while not (matches := _called(steps, every)) and len(steps) > 1 and _called(steps[:1], every):
        steps = steps[1:]
    if not matches and len(steps) == 1:
        with suppress(ValueProblem):
            matches = [unit(path)]
    shapes = [("body", "shape", shape) for shape in shapes_called(path)]
    if matches := matches or [entry for entry in every if entry.path[1:] in shapes]:
        return "\n".join(_pages(matches, every))
    above = tuple(path.split("."))[:-1]
    parents = {entry.path for entry in _called(above, every)} if above else set()
    names = {entry.path[-1] for entry in every for path in parents if entry.path[: len(path)] == path} or {
        entry.path[-1]
        for entry in every
        if len(entry.path) == 1 or entry.path[0] in ("document", "assignment", "answers")
    }
    near = nearest(path.split(".")[-1], sorted(names))
    meant = did_you_mean(near and ".".join((*above, near)))
    raise UsageError(f"nothing is called {shown(path)}{meant}", hint="`rigidcli explain` lists what there is")


def _called(steps: tuple[str, ...], every: Sequence[Entry]) -> list[Entry]:
    """The entries at a path: a topic, else from the top of a topic, else those whose path ends so."""
    name = steps[0] if len(steps) == 1 else None
    return (
        [entry for entry in every if entry.path == steps]
        or [entry for entry in every if entry.path[1:] == steps]
        or [e for e in every if e.path[-len(steps) :] == steps or name in e.other_names]
    )


def _pages(matches: Sequence[Entry], every: Sequence[Entry]) -> list[str]:
    """The pages of entries; those that say the same share one."""
    alike: dict[str, list[str]] = {}
    for entry in matches:
        depth = len(entry.path)
        below = [other for other in every if other.path[:depth] == entry.path and len(other.path) > depth]
        if entry.path != ("assignment",):  # its page shows the keys of all its sections
            below = [other for other in below if len(other.path) == depth + 1]
        groups = [
            (f"{_paragraph(group)}\n" if group else "")
            + _rows(
                [
                    (".".join(other.path[depth:]), other.row or other.text)
                    for other in below
                    if other.group == group
                ]
            )
            for group in dict.fromkeys(other.group for other in below)
        ]
        facts = _rows([fact for fact in entry.facts.items() if fact[1]])
        heads = alike.setdefault(_page(_paragraph(entry.text), *groups, facts), [])
        head = ".".join(entry.path[1:] if entry.path[0] in ("document", "results") else entry.path)
        heads.append(head or entry.path[0])
    return [_page(_paragraph(", ".join(dict.fromkeys(heads))), page[:-1]) for page, heads in alike.items()]


def _paragraph(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), WIDTH, break_on_hyphens=False)


def _rows(entries: Sequence[tuple[str, str]], most: int = 32) -> str:
    """Names and what they are, side by side; a name longer than `most` has a line of its own."""
    widest = max((len(name) for name, _ in entries if len(name) <= most), default=0)
    margin = " " * (widest + 4)
    lines = []
    for name, text in entries:
        filled = textwrap.wrap(" ".join(text.split()), WIDTH - len(margin), break_on_hyphens=False) or [""]
        first = [] if len(name) > widest and text else [f"  {name:{widest}}  {filled.pop(0)}".rstrip()]
        lines += [*(first or [f"  {name}"]), *(margin + line for line in filled)]
    return "\n".join(lines)


def _page(*parts: str) -> str:
    """Parts with an empty line between them."""
    return "\n\n".join(part for part in parts if part) + "\n"
