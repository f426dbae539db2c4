"""What a person must look at in the text of an answer, whatever its value is.

    doubt_of_words("not: 20.8 rad/s")               # words that take the value back
    doubt_of_sides("l w = sqrt(g/l)", is_right, is_list=False)  # the value of another quantity than w
    told_apart("H = T + V where V = m g z")         # ("H = T + V", {"V": "m g z"})

A name before the value is no doubt, nor are words that only announce it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import chain

from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework.numbers import scale_in
from rigidcli.language import tree
from rigidcli.language.latex import plain
from rigidcli.language.tokens import GREEK
from rigidcli.language.typed import (
    LONGEST_DECORATED,
    cut,
    expressions,
    is_label,
    slopes,
    statements,
    undecorated,
)
from rigidcli.language.words import said, table

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

# A letter, or the name of a Greek one, with its index or dots. What is no letter is a word.
_LETTER = re.compile(rf"(?:{'|'.join([*GREEK, *map(str.capitalize, GREEK)])}|[^\W\d_])(?:d?dot|_\w+|\d)*")
# Letters in one word, as in `lω`; while `pθ` and `Fθ` are names with an index.
_RUN_TOGETHER = re.compile(rf"[IMRgklmr]{{1,2}}(?:{'|'.join(GREEK)})(?:d?dot)?")
_CHANGE = frozenset(["d", "delta", "Delta", "A"])  # what stands before one name, or is an article
_RATE = re.compile(r"[A-Z](?:_\w+)?d{1,2}ot")
# Two energies whose sum, or difference, is an energy.
_ENERGIES = re.compile(r"\s*(?:[TKE]\w*\s*[-+]\s*[VUE]\w*|[VU]\w*\s*\+\s*[TK]\w*)\s*")
_ARGUMENTS = re.compile(r"(?<=[\w'])\s*[(\[][^()\[\]]*[)\]]\s*\Z")


def _is_name(side: str) -> bool:
    """Whether what stands left of `=` names one quantity: no number, product, sum, power or derivative.

    Words are a name, and so is a letter with its arguments: `the slow rate`, `H(x, p)`.
    """
    side = slopes(side.replace("'", "")).strip(" |<>")  # `I'` is another inertia
    side = _ARGUMENTS.sub("", side) if is_label(side) else side
    try:
        root = expressions(side, None, leading=False)[0]
    except ExpressionError:
        return is_label(side)
    names = tree.names_in(root)
    match root:
        case tree.Name(name):
            return not (_RUN_TOGETHER.fullmatch(name) or _RATE.fullmatch(name))
        case tree.Product(factors) if all(isinstance(factor, tree.Name) for factor in factors):
            return not all(map(_LETTER.fullmatch, names)) or not names.isdisjoint(_CHANGE)
        case tree.Sum():
            return _ENERGIES.fullmatch(side) is not None
    return False


_ARROW = re.compile("[=-]>")


def _chains(text: str) -> list[list[str]]:
    """The members of each chain of equalities in a text."""
    with suppress(ExpressionError):
        several = chain.from_iterable(map(statements, cut(plain(undecorated(text)), _ARROW)))
        return [members for members in several if len(members) > 1]
    return []


def _is_told_twice(chains: Sequence[Sequence[str]]) -> bool:
    """Whether a name with an index has two values: `L_x = 0, L_x = 2`; for `I = 2, I = 3` it has none."""
    values = dict[str, str]()
    for name, *_, value in chains:
        own = value.strip(" .,;")
        is_single = re.fullmatch(r"\s*[^\W\d_]+(?:\d|_[^\W_]+)\s*", name) and not re.search(r"[,(\[]", own)
        if is_single and values.setdefault(name.strip(), own) != own:
            return True
    return False


def doubt_of_sides(text: str, is_right: Callable[[str], bool], *, is_list: bool) -> str:
    """Why a person must look at an answer for what stands left of `=`, where that must be a name.

    The answer itself may stand there, too: `is_right`. Of one value the last statement alone is the answer.
    """
    chains = _chains(told_apart(text)[0])
    for side, *_ in chains if is_list else chains[-1:]:
        if side.strip() and not (_is_name(side) or is_right(side)):
            return f"what stands before `=` is no name: {shown(side.strip())}"
    return "two values of the same name" if _is_told_twice(chains) else ""


# The units of quantities by the names that usually have no other meaning.
_UNITS = {
    name: units.split("|") for units, names in table(__file__, "quantities.csv") for name in names.split()
}


def doubt_of_name(text: str, unit: Unit) -> str:
    """Why a person must look at a quantity in this unit with the name of another one: `period: 3 rad/s`."""
    head = re.match(rf"{_HEAD.pattern}(?=.)", text)
    *_, (side, *_) = _chains(text) or [[head[0] if head else ""]]
    side = re.sub(rf"(?i)\b{said('is', 'about')}", "", _ARGUMENTS.sub("", side))
    name = next(reversed(re.findall(r"[^\W\d_]+", side)), "") if is_label(side) else ""
    units = _UNITS.get(name) or _UNITS.get(name.lower() * (len(name) > 1), [])
    for each in units:
        with suppress(ValueProblem):
            scale_in(parse_unit(each), unit)
            return ""
    return f"this is the name of another quantity: {shown(name)}" if units else ""


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
