"""The text of an answer file -> its answers by question, each as it was typed, or what is wrong with it.

Where a file is no YAML, its answers are read one by one: each begins at a key that is indented no deeper than
the first, and ends before the next.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from rigidcli.document.syntax import read_tree
from rigidcli.errors import DocumentError, Problem, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable

Answers: TypeAlias = dict[str, Tree | Unreadable]
"""Answers by the names of questions; one that cannot be read is what is wrong with it."""

MOST_ANSWERS = 1000
"""Answers of a file that are read one by one."""

QUOTED = "write the answer in quotes"
"""What helps against an answer that is no YAML, if nothing else is known."""

UNLIKE_UNITS = frozenset("'\"{}#:,[")
"""Characters that no unit has."""

_KEY = re.compile(r"\s*(?P<name>(?!#|-\s)\S.*?):(?:\s(?P<value>.*))?$")


def read_answers(text: str, source: str, known: Collection[str] = ()) -> Answers:
    """The answers in a text, by the names as they are spelled; `known` are those of questions.

    Raises Unreadable where no answer can be told.
    """
    try:
        return _answers(read_tree(text, source, typed=True))
    except DocumentError as error:
        problem = error.problems[0]
        section = None if problem.code == "too_large" else _section(text)
        if section is None:
            raise _unreadable(problem) from None
    try:
        if answers := _answers(section.tree()):
            return answers
    except (DocumentError, Unreadable):
        pass
    entries = list(section.entries())
    if not 0 < len(entries) <= MOST_ANSWERS:
        raise _unreadable(problem)
    answers = {}
    others = {folded(name) for name in known} - {folded(entry.name) for entry in entries}
    for entry in entries:
        for part in entry.parts(others):
            twice = Unreadable("duplicate_key", f"line {part.first}: the key {shown(part.name)} stands twice")
            answers[part.name] = twice if part.name in answers else part.answer()
    return answers


def folded(id: str) -> str:
    """The name of a question, however it is spelled."""
    return id.strip().casefold()


def _answers(tree: Tree) -> Answers:
    """The answers of a file that is YAML. Raises Unreadable."""
    if isinstance(tree, dict) and tree.get("answers") is None and tree.keys() <= {"student", "answers"}:
        return {}
    answers = tree.get("answers") if isinstance(tree, dict) else None
    if not isinstance(answers, dict):
        raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")
    return answers


def _unreadable(problem: Problem) -> Unreadable:
    """A problem of YAML, told as one of an answer, with what helps."""
    place = "" if problem.line is None else f"line {problem.line}: "
    return Unreadable(
        problem.code or "parse_error", ": ".join(filter(None, [place + problem.message, problem.hint]))
    )


def _section(text: str) -> _Lines | None:
    """The lines of `answers`, to the next key at the margin; None where it is not clear which they are."""
    lines = text.splitlines()
    keys = ((place, _key(line)) for place, line in enumerate(lines) if line[:1].strip())
    margins = [(place, key[0]) for place, key in keys if key and key[0].isidentifier()]
    begins = [place for place, name in margins if name == "answers"]
    if len(begins) != 1 or any(line.startswith(("---", "...")) for line in lines[1:]):
        return None
    end = next((place for place, _ in margins if place > begins[0]), len(lines))
    return _Lines("answers", begins[0] + 1, lines[begins[0] : end])


def _key(line: str) -> tuple[str, str] | None:
    """The key of a line and what is behind it, where there is one."""
    found = _KEY.match(line)
    return found and (
        found["name"].strip().strip("'\""),
        f" {found['value'] or ''}".partition(" #")[0].strip(),
    )


@dataclass(frozen=True, slots=True)
class _Lines:
    """Lines of a file, of which the first has the key `name`; `first` is its number."""

    name: str
    first: int
    lines: Sequence[str]

    def tree(self) -> Tree:
        """What they are in YAML. Raises DocumentError."""
        return read_tree("".join(f"{line}\n" for line in self.lines), "", typed=True)

    def entries(self) -> Iterator[_Lines]:
        """The entries of the mapping below the first line, if there is nothing but the key in it."""
        keys = [(place, key[0]) for place, line in enumerate(self.lines) if (key := _key(line))]
        depths = {place: len(line) - len(line.lstrip(" ")) for place, line in enumerate(self.lines)}
        depth = next((depths[place] for place, _ in keys if depths[place]), 0)
        if _key(self.lines[0]) == (self.name, ""):
            yield from self._cut([each for each in keys if 0 < depths[each[0]] <= depth])

    def parts(self, others: Collection[str]) -> Iterator[_Lines]:
        """The entry; if it is no YAML, also the `others` that stand in it, at a wrong indentation."""
        cuts = [(0, self.name)]
        if isinstance(self._read(), Problem):
            keys = ((place, _key(line)) for place, line in enumerate(self.lines[1:], start=1))
            cuts += [(place, key[0]) for place, key in keys if key and folded(key[0]) in others]
        yield from self._cut(cuts)

    def answer(self) -> Tree | Unreadable:
        """The value of the key, or what is wrong with it."""
        found = self._read()
        if not isinstance(found, Problem):
            return found
        _, value = _key(self.lines[0]) or ("", "")
        text = " ".join([value, *map(str.strip, self.lines[1:])]).strip()
        if list_and_unit(text)[1]:
            return text
        hint = _cure(text, found) if found.code == "parse_error" else found.hint
        line = self.first - 1 + min(found.line or 1, len(self.lines))
        return _unreadable(replace(found, line=line, hint=hint))

    def _read(self) -> Tree | Problem:
        try:
            (value,) = self.tree().values()
        except DocumentError as error:
            return error.problems[0]
        return value

    def _cut(self, cuts: Sequence[tuple[int, str]]) -> Iterator[_Lines]:
        ends = [*(place for place, _ in cuts[1:]), len(self.lines)]
        for (place, name), end in zip(cuts, ends, strict=bool(cuts)):
            yield _Lines(name, self.first + place, self.lines[place:end])


def _cure(text: str, found: Problem) -> str:
    """What helps against an answer that is no YAML."""
    if text.startswith(("'", '"')):
        return "quotation marks stand round the whole answer"
    is_plain = text[:1].isalnum() or text.startswith(("[", "{"))
    return (found.hint if is_plain else None) or QUOTED


def list_and_unit(text: str) -> tuple[str, str]:
    """A list and the unit behind it, as in `[1, 2, 3] cm`; the unit is empty in any other text."""
    items, bracket, unit = text.rpartition("]")
    balanced = items.count("[") == items.count("]") + 1
    is_list = text.startswith("[") and balanced and UNLIKE_UNITS.isdisjoint(unit)
    return (items + bracket, unit.strip()) if is_list else (text, "")
