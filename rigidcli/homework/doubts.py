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

from rigidcli.errors import ExpressionError, shown
from rigidcli.language.latex import plain
from rigidcli.language.typed import LONGEST_DECORATED, cut, slopes, statements, undecorated
from rigidcli.language.words import said

# --- words ahead of the value

# What stands before the value: all words up to a number, a bracket, a colon or a sign of equality.
_HEAD = re.compile(r"[^\d\[({:=√\\]{0,400}")
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


# --- what stands left of `=`

_GREEK = (
    "alpha beta gamma delta epsilon eta theta lambda mu nu omega phi psi rho sigma tau xi zeta "
    "Gamma Theta Lambda Omega Phi Psi"
)
_LETTER = rf"(?:{'|'.join(_GREEK.split())}|[^\W\d_])(?:d?dot|_\w+|\d)?'*"
_INDEXED = re.compile(r"\s*[^\W\d_]+(?:\d|_[^\W_]+)\s*")
# Two letters or more: the name of one quantity has one letter, or is a word.
_PRODUCT = re.compile(rf"\s*(?!(?:d|Delta|[ΔδA]|delta)\s){_LETTER}(?:[\s*·]+{_LETTER})+\s*")
# As in `lω`, while `pθ` and `Fθ` are names with an index.
_RUN_TOGETHER = re.compile(rf"\s*[IMRgklmr]{{1,2}}(?:{'|'.join(_GREEK.split())})(?:d?dot)?\s*")
_RATE = re.compile(r"\s*[A-Z](?:_\w+)?d{1,2}ot\s*(?:\([\w, ]*\))?\s*")
# Energies, whose sum is an energy; of other letters it is not clear what a sum is.
_ENERGIES = re.compile(r"\s*(?:[TKE]\w*\s*\+\s*[VUE]\w*|[VU]\w*\s*\+\s*[TK]\w*|[TKE]\w*\s*-\s*[VUE]\w*)\s*")
_SUM = re.compile(r"\s*[A-Z](?:_\w+)?\s*[-+]\s*[A-Z](?:_\w+)?\s*")
# A factor, a divisor, a sign or a power beside a name, where numbers are listed on the right.
_CHANGED_NAME = re.compile(
    rf"\s*(?:-\s*|\d+\s*\*?\s*){_LETTER}\s*|\s*{_LETTER}\s*(?:\*\*|\^)\s*\(?\s*(?:-?\s*[\dT])\s*\)?\s*"
    rf"|\s*[\d.]+\s*|\s*[^\W\d][\w\s*']*/[\w\s^*()/]+"
)


def _is_changed(side: str, *, is_list: bool) -> bool:
    """Whether what stands left of `=` is a product, a sum, a power or a derivative, and no name."""
    is_rate = "'" not in side and _RATE.fullmatch(slopes(side))  # `I'` is another inertia
    side = slopes(side)
    is_other = _PRODUCT.fullmatch(side) or _RUN_TOGETHER.fullmatch(side) or is_rate
    is_sum = _SUM.fullmatch(side) and not _ENERGIES.fullmatch(side)
    return bool(is_other or is_sum or (is_list and _CHANGED_NAME.fullmatch(side)))


def _chains(text: str) -> list[list[str]]:
    """The members of each chain of equalities in a text."""
    text = undecorated(text)
    with suppress(ExpressionError):
        return [members for members in statements(plain(text)) if len(members) > 1]
    with suppress(ExpressionError):  # rows of LaTeX on the right
        left, equals, right = text.partition("=")
        return [[plain(left), right]] if equals else []
    return []


def _is_told_twice(chains: Sequence[Sequence[str]]) -> bool:
    """Whether a name with an index has two values: `L_x = 0, L_x = 2`; for `I = 2, I = 3` it has none."""
    values = dict[str, str]()
    for name, *_, value in chains:
        own = value.strip(" .,;")
        is_single = _INDEXED.fullmatch(name) and not re.search(r"[,(\[]", own)
        if is_single and values.setdefault(name.strip(), own) != own:
            return True
    return False


def doubt_of_words(text: str) -> str:
    """Why a person must look at an answer for the words before its value; empty if for none."""
    lines = [line for line in text.splitlines() if line.strip()]
    is_doubtful = any(_taken_back(line) for line in {*lines[:1], *lines[-1:]})
    return f"words may take the answer back: {shown(text)}" if is_doubtful else ""


def doubt_of_sides(text: str, is_right: Callable[[str], bool], *, is_list: bool) -> str:
    """Why a person must look at an answer for what stands left of `=`, where that must be a name.

    The answer itself may stand there, too: `is_right`. Of a list (`is_list`), no judge compares a factor or
    a power of a name with the right side.
    """
    chains = _chains(text)
    for side, *_ in chains:
        if _is_changed(side, is_list=is_list) and not is_right(side):
            return f"what stands before `=` is no name: {shown(side.strip())}"
    return "two values of the same name" if _is_told_twice(chains) else ""


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
