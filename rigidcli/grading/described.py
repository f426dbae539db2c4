"""What answers are read as, in words, without a key: for students who check a file before they hand it in."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from rigidcli.errors import ExpressionError, shown
from rigidcli.grading.answers import list_and_unit
from rigidcli.grading.asked import Tree
from rigidcli.grading.files import read_beside
from rigidcli.grading.numbers import read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.units import read_unit
from rigidcli.language.expression import parse

MOST_NAMES = 12
"""Names that a description lists."""

WORDS = re.compile(r"[^\W\d_][\w'-]*+(?:\s+[^\W\d_][\w'-]*+)*+\.?")
"""Words without a number or a sign of arithmetic among them."""

STARTS_NUMBER = re.compile(r"[-+.\s]*[0-9]+[^-+*/^()]*")
"""What was probably meant as a number with a unit."""

PAIR = {"moment", "axis"}
"""The keys of a principal moment with its axis."""


def described(answer: Tree | Unreadable, path: Path) -> str | Unreadable:
    """What an answer in the file at `path` is read as, or what is wrong with it."""
    try:
        return answer if isinstance(answer, Unreadable) else describe(answer, path)
    except Unreadable as unreadable:
        return unreadable


def describe(answer: Tree, path: Path) -> str:
    """What an answer in the file at `path` is read as. Raises Unreadable where it is nothing."""
    if isinstance(answer, list):
        if answer and all(isinstance(row, list) for row in answer):
            return _rows(answer, path)
        each = [_inside(f"entry {number}", entry, path) for number, entry in enumerate(answer, 1)]
        if answer and all(isinstance(entry, dict) and set(entry) == PAIR for entry in answer):
            return f"{len(answer)} pairs of a moment and an axis"
        return f"a list of {len(answer)}, each {_several(each)}" if answer else "an empty list"
    if isinstance(answer, dict):
        if answer and answer.keys() <= {"file", "csv"}:
            text = answer["csv"] if "csv" in answer else read_beside(answer["file"], path)
            head, *rows = [line for line in str(text).splitlines() if line.strip()] or [""]
            return f"a table with {len(rows)} rows of {_listed(head.split(',')) if head else 'nothing'}"
        each = [_inside(name, entry, path) for name, entry in answer.items()]
        return f"{_listed(answer)}: each {_several(each)}" if answer else "an empty mapping"
    return _text(answer or "")


def _rows(rows: list[list[Tree]], path: Path) -> str:
    """A matrix. Raises Unreadable."""
    each = [_inside(f"row {number}", entry, path) for number, row in enumerate(rows, 1) for entry in row]
    if len({len(row) for row in rows}) > 1:
        raise Unreadable("wrong_shape", "its rows have different lengths")
    return f"{len(rows)} rows of {len(rows[0])}, each {_several(each)}"


def _inside(place: str, answer: Tree, path: Path) -> str:
    try:
        return describe(answer, path)
    except Unreadable as unreadable:
        found = unreadable.finding
        told = ", ".join(filter(None, [place, found.place]))
        raise Unreadable(found.code, found.detail, place=told) from None


def _several(descriptions: Iterable[str]) -> str:
    return " or ".join(dict.fromkeys(descriptions))


def _text(text: str) -> str:
    if not text.strip():
        return "no answer"
    items, unit = list_and_unit(text)
    if unit:
        read_unit(unit)
        return f"a list of {items.count(',') + 1} with the unit `{unit}`"
    try:
        number = read_written(text)
    except Unreadable as unreadable:
        if STARTS_NUMBER.fullmatch(text):
            raise
        return f"the text {shown(text)}" if WORDS.fullmatch(text.strip()) else _formula(text, unreadable)
    if number.unit is None:
        return "a number"
    read_unit(number.unit)
    return f"a number with the unit `{number.unit}`"


def _formula(text: str, otherwise: Unreadable) -> str:
    """An expression, or an equation of two; `otherwise` is what it is without a name. Raises Unreadable."""
    names = set[str]()
    for side in text.split("="):
        try:
            names |= parse(side).names
        except ExpressionError as error:
            if text.lstrip("+-. ")[:1].isdigit():
                raise otherwise from None
            message = f"read {shown(text)}: {error.message}"
            raise Unreadable("parse_error", ": ".join(filter(None, [message, error.hint]))) from None
    if not names:
        raise otherwise
    return f"an {'equation' if '=' in text else 'expression'} in {_listed(sorted(names))}"


def _listed(names: Iterable[str]) -> str:
    told = [shown(name.strip()) for name in names]
    return ", ".join(told[:MOST_NAMES]) + (f" and {len(told) - MOST_NAMES} more" if told[MOST_NAMES:] else "")
