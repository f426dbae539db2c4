"""What a person must look at in the text of an answer, whatever its value is.

    doubt_of_words("not: 20.8 rad/s")               # words that take the value back
    doubt_of_sides("2 L = (0, 2, 12)", unit, is_right)  # the value of another quantity than L
    told_apart("H = T + V where V = m g z")         # ("H = T + V", {"V": "m g z"})

A name before the value is no doubt, nor are words that only announce it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress

from rigidcli.errors import ExpressionError, shown
from rigidcli.fields.units import Unit
from rigidcli.homework.numbers import UNITS_OF, fits, is_product_in, may_be_in, no_name
from rigidcli.language.latex import plain
from rigidcli.language.tree import Node
from rigidcli.language.typed import (
    LONGEST_DECORATED,
    cut,
    divisor,
    is_enclosed,
    is_label,
    is_name,
    slopes,
    statements,
    undecorated,
    without_arguments,
)
from rigidcli.language.words import said

# --- words ahead of the value

# What stands before the value: all words up to a number, a bracket, a colon or a sign of equality.
_HEAD = re.compile(r"[^\d\[({:=√\\]{0,400}+")
_DENIED = re.compile(
    rf"(?i)(?<![\w-])(?:{said('not', 'denied')}(?<!\bno)(?!-)|no(?=\s*(?:[:,;=]|\Z)|\s+{said('is')}))"
    r"|n['’]t(?!\w)"
)
# A factor or a relation before the name of the value, where no number is meant by it, as in `half: 3` and
# `twice the rate is 3`; a double pendulum and a half axis are things.
_SCALED = re.compile(
    rf"(?i)(?<![\w-]){said('scaled')}(?!-)(?!\s*(?:pendulum|dot|prime|derivative|angle|axis|axes|cone|root))"
    rf"(?:.*(?<!\w){said('is')}\s*.?\Z|[^:=]*[:=])"
)
_UNEQUAL = re.compile(r"[^=≠]*?(?:≠|!=|=/=|[-+/]=|<>|\\neq?(?![A-Za-z])|\\not\s*=)")


def _taken_back(text: str) -> bool:
    """Whether words before the value say that it is not the answer, or is a multiple or a bound of it."""
    head = _HEAD.match(text)
    assert head is not None
    return bool(_DENIED.search(head[0]) or _SCALED.search(text[: head.end() + 1]) or _UNEQUAL.match(text))


def doubt_of_words(text: str) -> str:
    """Why a person must look at an answer for the words before its value; empty if for none."""
    lines = [line for line in text.splitlines() if line.strip()]
    is_doubtful = any(_taken_back(line) for line in {*lines[:1], *lines[-1:]})
    return f"words may take the answer back: {shown(text)}" if is_doubtful else ""


# --- what stands left of `=`


_ARROW = re.compile("=>|->")


def _chains(text: str) -> list[list[str]]:
    """The members of each chain of equalities in a text."""
    with suppress(ExpressionError):
        parts = map(statements, cut(plain(undecorated(text)), _ARROW))
        return [members for part in parts for members in part if len(members) > 1]
    return []


def doubt_of_sides(text: str, unit: Unit, is_right: Callable[[str], bool]) -> str:
    """Why a person must look at a list for what stands left of `=`, where that must name what has this unit.

    The list itself may stand there, too: `is_right`; and so may the names of its entries.
    """
    for side, *_, last in _chains(told_apart(text)[0]):
        names = cut(side.strip()[1:-1], re.compile(",")) if is_enclosed(side) else [side]
        are_names = all(is_name(each) or divisor(each) for each in names)
        # What is zero is so with any factor: `(λ-2)(λ-5) = 0 => λ = 2, 5`.
        is_meant = are_names or is_right(side) or (unit.text and is_product_in(side, unit))
        if side.strip() and not is_meant and last.strip() != "0":
            return no_name(side)
    return ""


def doubt_of_name(text: str, asked: Unit | Node) -> str:
    """Why a person must look at a quantity in this unit, or this formula, with the name of another quantity.

    As in `period: 3 rad/s`, and `T = sqrt(g/l)`.
    """
    # A formula may itself begin with a letter.
    head = re.match(rf"{_HEAD.pattern}(?={'.' if isinstance(asked, Unit) else ':'})", text)
    *_, (side, *_) = _chains(text) or [[head[0] if head else ""]]
    side = slopes(re.sub(rf"(?i)\b{said('is', 'about')}", "", without_arguments(side)))
    # `Mass` in `centre of mass`, `f` in `v_f` and `1` in `v1` are no names of their own.
    side = re.sub(rf"(?i)(?:(?<=\w)\s+{said('of')}|\bin\b).*|(?<=[^\W\d_])(?:_?\d|_(?!d?dot))\w*", "", side)
    name = next(reversed(re.findall(r"[^\W\d]+", side)), "") if is_label(side) else ""
    units = UNITS_OF.get(name) or UNITS_OF.get(name.lower() * (len(name) > 1), [])
    if isinstance(asked, Unit):
        is_own = not asked.text or any(fits(each, asked) for each in units) or is_product_in(side, asked)
    else:
        is_own = may_be_in(units, asked)
    return f"this is the name of another quantity: {shown(name)}" if units and not is_own else ""


# --- definitions behind an answer

_WHERE = re.compile(rf"[\s,;.]\(?{said('where')}[\s:]+(?=[^=]*=)", re.IGNORECASE)
# A letter that is explained in words: `where h is the distance`, `with M the mass`.
_EXPLAINED = re.compile(
    rf"(?i)(?<=[\w)\]}}²³])[\s,;.]{{1,4}}{said('where')}\s+[^\W\d]\w{{0,5}},?\s+(?:{said('is')}|{said('article')})\s"
    rf"(?![^\n]*{said('not', 'denied', 'wrong')})[^\d=]*\Z"
)
_NEXT = re.compile(rf"[\n;]|(?:,|\s{said('and')})\s*(?=[^=,;]*=)")
_NAME = re.compile(r"\s*([^\W\d_]\w*)\s*")


def told_apart(text: str) -> tuple[str, dict[str, str]]:
    """An answer without what defines its letters behind `where` or `with`, and these definitions by name.

    A text that begins with such a word has its answer behind it, and is left whole.
    """
    where = _WHERE.search(text)
    # What may be a formula has a digit, a sign of equality or a single letter.
    if where is None or not re.search(r"[=\d]|(?<![^\W_])[^\W\d_](?![^\W_])", text[: where.start()]):
        return _EXPLAINED.sub("", text), {}
    defined = dict[str, str]()
    with suppress(ExpressionError):
        for each in cut(plain(_WHERE.sub(", ", text[where.end() :])), _NEXT):
            left, *_, right = each.split("=") if "=" in each else ("", "")
            if name := _NAME.fullmatch(left):
                defined[name[1]] = right.strip(" .")
    return text[: where.start()], defined


def with_definitions(text: str, defined: dict[str, str]) -> str:
    """The answer with its letters written out as they are defined. Raises ExpressionError."""
    left, equals, right = plain(text).rpartition("=")
    for name, meaning in defined.items():
        parts = re.split(rf"(?<![^\W\d]){re.escape(name)}(?!\w)", right)
        right = f"({meaning})".join(parts)
        if len(right) > LONGEST_DECORATED:  # each definition may double it
            raise ExpressionError("it is too long with its definitions")
    return f"{left}{equals}{right}"


def is_defined_again(text: str, defined: dict[str, str]) -> bool:
    """Whether a definition behind an answer has the name that the answer has."""
    return any(name.strip() in defined for name, *_ in _chains(text))
