"""Equations in answers: mappings from derivatives to expressions, or texts `left = right`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rigidcli.errors import shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.functions.formula import Vocabulary, names_in, read
from rigidcli.grading.outcome import Unreadable
from rigidcli.symbolic.tree import Name, Negative, Node, Sum

MOST_EQUATIONS = 200
"""In one answer."""

MOST_TEXT = 40_000
"""Characters of all equations of an answer."""

LONGEST_PLACE = 40
"""Characters of a key that names its equation as it stands."""

_EQUALS = re.compile(r"==?")
_DIFFERENTIAL = re.compile(r"\bd2?[A-Za-z_]\w*/\(?dt\b")


@dataclass(frozen=True, slots=True)
class Text:
    """Both sides of an equation as typed. A `label` is a left side that was the key of a mapping."""

    place: str
    left: str
    right: str
    label: bool = False


@dataclass(frozen=True, slots=True)
class Equation:
    """An equation that has been read."""

    place: str
    left: Node
    right: Node

    @property
    def residual(self) -> Node:
        """What is zero where the equation is true."""
        return Sum((self.left, Negative(self.right)))

    @property
    def names(self) -> frozenset[str]:
        """The names in it."""
        return names_in(self.left) | names_in(self.right)


def texts(answer: Tree) -> list[Text]:
    """The equations of an answer, side by side. Raises Unreadable."""
    found = list(_texts(answer))
    if not found:
        raise Unreadable("wrong_shape", "expected equations, such as {xdot: ...} or [xdot = ...]")
    if len(found) > MOST_EQUATIONS:
        raise Unreadable("too_large", f"{len(found)} equations")
    length = sum(len(text.left) + len(text.right) for text in found)
    if length > MOST_TEXT:
        raise Unreadable("too_large", f"{length} characters")
    return found


def _texts(answer: Tree) -> Iterator[Text]:
    if isinstance(answer, dict):
        yield from _of_mapping(answer)
    elif isinstance(answer, list):
        for place, entry in enumerate(answer, 1):
            if isinstance(entry, dict):
                yield from _of_mapping(entry)
            else:
                yield _sides(entry, f"equation {place}")
    elif isinstance(answer, str):
        lines = [line for line in re.split(r"[\n;]", answer) if line.strip()]
        for place, line in enumerate(lines, 1):
            yield _sides(line, f"equation {place}" if len(lines) > 1 else "")
    else:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected equations")


def _of_mapping(answer: dict[str, Tree]) -> Iterator[Text]:
    for key, value in answer.items():
        place = key if key.isidentifier() and len(key) <= LONGEST_PLACE else shown(key)
        if not isinstance(value, str):
            raise Unreadable("wrong_shape", f"read {shown(value)}, expected an expression", place=place)
        yield _sides(value, place) if "=" in value else Text(place, key, value, label=True)


def _sides(text: Tree, place: str) -> Text:
    if not isinstance(text, str):
        raise Unreadable("wrong_shape", f"read {shown(text)}, expected `left = right`", place=place)
    signs = list(_EQUALS.finditer(text))
    if len(signs) != 1:
        read = "no `=`" if not signs else "more than one `=`"
        raise Unreadable("parse_error", f"{read} in {shown(text)}, expected `left = right`", place=place)
    # Blanks keep the columns of messages those of the whole text.
    return Text(place, text[: signs[0].start()], " " * signs[0].end() + text[signs[0].end() :])


def equations(answer: Tree, vocabulary: Vocabulary, tops: dict[str, str]) -> list[Equation]:
    """The equations of an answer. Raises Unreadable.

    In a mapping whose keys are all functions, `x` stands for its derivative, which `tops` has.
    """
    found = texts(answer)
    spelled = vocabulary.other
    keys = [spelled.get(text.left.strip(), text.left.strip()) for text in found]
    short = all(text.label and key in tops for text, key in zip(found, keys, strict=True))
    result = []
    for text, key in zip(found, keys, strict=True):
        left = Name(tops[key]) if short else _side(text.left, vocabulary, text.place)
        result.append(Equation(text.place, left, _side(text.right, vocabulary, text.place)))
    return result


def _side(text: str, vocabulary: Vocabulary, place: str) -> Node:
    try:
        return read(text, vocabulary, place, label=False)
    except Unreadable as unreadable:
        finding = unreadable.finding
        if finding.code == "unknown_symbol" and _DIFFERENTIAL.search(text.replace(" ", "")):
            detail = f"{finding.detail}; a time derivative is spelled `xdot`, a second one `xddot`"
            raise Unreadable(finding.code, detail, place=place) from None
        raise
