"""The words of formulas: functions and constants, the names of a question, and the table of readings."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from rigidcli.errors import ExpressionError, shown
from rigidcli.suggestions import did_you_mean, nearest


def table(beside: str, name: str) -> list[list[str]]:
    """The rows of a file .csv or .tsv beside another one, without the heads of its columns."""
    lines = Path(beside).with_name(name).read_text("utf-8").splitlines()
    return [line.split("," if name.endswith(".csv") else "\t") for line in lines[1:]]


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


class Function(NamedTuple):
    """A function: for floats, by its name in numpy and its sign in LaTeX, with its derivative, and in words.

    The sign in LaTeX is a command, a name in upright letters, or a pattern around the argument. The
    derivative is one by x; those of atan2, which has two arguments, are in `algebra.calculus`.
    """

    real: Callable[..., float]
    numpy: str
    latex: str
    slope: str
    says: str
    arity: int = 1


_REAL = {"abs": math.fabs, "sign": _sign}  # functions that `math` has by another name, or lacks
FUNCTIONS: dict[str, Function] = {
    name: Function(_REAL.get(name) or getattr(math, name), numpy, latex, slope, says, int(arity))
    for name, arity, numpy, latex, slope, says in table(__file__, "functions.tsv")
}
# Functions that heyoka does not have: a Taylor series does not see a corner ahead.
WITH_CORNERS = frozenset(["abs", "sign"])
# Further names that books use for functions; before an argument only; elsewhere they are letters.
SHORT = {
    "tg": "tan", "ctg": "cot", "cotg": "cot", "sh": "sinh", "ch": "cosh", "th": "tanh", "sgn": "sign",
    "lg": "lg", "log10": "lg", "sen": "sin", "Abs": "abs",
    "CubeRoot": "cbrt", "root": "sqrt", "Wurzel": "sqrt", "wurzel": "sqrt", "raiz": "sqrt", "racine": "sqrt",
}  # fmt: skip
# Further names of functions, which are read and never written.
ALIASES = SHORT | {
    "ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctg": "atan", "arcsinh": "asinh",
    "arccosh": "acosh", "arctanh": "atanh", "arsinh": "asinh", "arcosh": "acosh", "artanh": "atanh",
}  # fmt: skip
# Functions that are read as others and never written, by their formulas and parameters. Powers stand so
# in programs, before a bracket only.
DEFINED = {
    "cot": ("cos(x)/sin(x)", "x"), "sec": ("1/cos(x)", "x"), "csc": ("1/sin(x)", "x"),
    "lg": ("log(x)/log(10)", "x"), "cbrt": ("x**(1/3)", "x"),
    **dict.fromkeys(("pow", "power", "Power", "POWER", "POW"), ("x**y", "x", "y")),
    **dict.fromkeys(("sqr", "square"), ("x**2", "x")),
}  # fmt: skip
_QUOTIENTS = ("cot", "sec", "csc")
CONSTANTS: dict[str, float] = {"pi": math.pi}

# Names that stand before arguments.
CALLED: frozenset[str] = frozenset({*FUNCTIONS, *ALIASES, *_QUOTIENTS, "cbrt"})
# Names that a document cannot give to a parameter of its own; `t` is time.
RESERVED: frozenset[str] = frozenset({*FUNCTIONS, "ln", *_QUOTIENTS, *CONSTANTS, "t"})

# --- the words of people


_SAID = {meaning: words.split() for meaning, words in table(__file__, "words.csv")}


def said(*meanings: str) -> str:
    """The pattern of the words with any of these meanings, in all languages."""
    words = sorted((word for meaning in meanings for word in _SAID[meaning]), key=len, reverse=True)
    return rf"(?:(?:{'|'.join(map(re.escape, words)).replace('_', '[ ]')})(?!\w))"


_COUNTS = [meaning for meaning in _SAID if meaning[0].isdigit()]
_PARTS = [meaning for meaning in _SAID if meaning[0] == "/"]
_IN_DIGITS = {word: meaning for meaning in (*_COUNTS, *_PARTS) for word in _SAID[meaning]}
_COUNT = rf"{said(*_COUNTS)}|{said('a')}"
# A number in words, with which a text begins: `three tenths`, `one and a half`, `zwei`.
_IN_WORDS = re.compile(
    rf"(?i)\A(?:(?:(?P<whole>{_COUNT})[ ]{said('and')}[ ])?(?:(?P<count>{_COUNT})[ -])?"
    rf"(?P<part>{said(*_PARTS)})|(?P<number>{said(*_COUNTS)}))(?=[\s.!]|\Z)"
)


def in_digits(text: str) -> str:
    """The text with digits for a number in words at its beginning: `1/3 m` for `one third m`."""

    def digits(match: re.Match[str]) -> str:
        if match["number"]:
            return _IN_DIGITS[match["number"].lower()]
        count = _IN_DIGITS.get((match["count"] or "").lower(), "1")  # an article, or nothing, is a one
        fraction = f"{count}{_IN_DIGITS[match['part'].lower()]}"
        whole = match["whole"] and _IN_DIGITS.get(match["whole"].lower(), "1")
        return f"({whole} + {fraction})" if whole else fraction

    return _IN_WORDS.sub(digits, text)


# --- the names of a question

# The most letters of names that are run together: more is a sentence, and no product.
LONGEST_PRODUCT = 40
MOST_LISTED = 40  # names in a message


@dataclass(frozen=True, eq=False)
class Words:
    """The names that a formula may hold.

    Of `spellings`, each means a name. Underscores may be left out or added where that leaves one meaning.
    `moving` are the names that depend on the time, and may be written as `x(t)`. Where the list `is_open`, as
    that of a document, another name is taken whole.
    """

    names: Sequence[str]
    spellings: Mapping[str, str] = field(default_factory=dict)
    moving: Collection[str] = ()
    is_open: bool = field(default=False, kw_only=True)

    @cached_property
    def _meanings(self) -> dict[str, str]:
        if self.is_open:
            return {name: name for name in self.names}
        bare: dict[str, set[str]] = {}
        for word, name in (*((name, name) for name in self.names), *self.spellings.items()):
            bare.setdefault(word.replace("_", ""), set()).add(name)
        single = {word: meant.pop() for word, meant in bare.items() if len(meant) == 1}
        return single | dict(self.spellings) | {name: name for name in self.names}

    def meaning(self, word: str) -> str | None:
        """The name that a word is, or None."""
        meanings = self._meanings
        return meanings.get(word) or (None if self.is_open else meanings.get(word.replace("_", "")))

    def products(self, word: str, calls: bool = False) -> list[tuple[str, ...]]:
        """The products of names and functions, or pi, that a word spells: at most two that differ.

        The last may be a function where the word `calls` one: what stands behind it is its argument.

        From the end of the word: what its last letters spell is a name times what is spelled behind that.
        """
        end = len(word)
        spelled: dict[int, list[tuple[str, ...]]] = {end: [()]}
        for start in reversed(range(end if end <= LONGEST_PRODUCT else 0)):
            products: dict[tuple[str, ...], tuple[str, ...]] = {}
            for cut in range(start + 1, end + 1):
                part = word[start:cut]
                meant = part if part in CALLED or part in CONSTANTS else self.meaning(part)
                is_called = meant in CALLED  # and needs an argument behind it
                if meant is None or part[0] == "_" or (is_called and cut == end and not (calls and start)):
                    continue
                for rest in spelled[cut]:
                    if not (is_called and rest and CALLED.issuperset(rest)):
                        products.setdefault(tuple(sorted((meant, *rest))), (meant, *rest))
            spelled[start] = list(products.values())[:2]
        ways = spelled.get(0, [])
        return [way for way in ways if not self.is_open or way[0] in CALLED or CALLED.isdisjoint(way)]


def unknown(word: str, words: Words) -> ExpressionError:
    """The error for a name that the question does not have."""
    near = nearest(word, words.names) if len(word) <= LONGEST_PRODUCT else None
    listed = ", ".join(f"`{name}`" for name in words.names[:MOST_LISTED]) or "none"
    more = ", ..." if len(words.names) > MOST_LISTED else ""
    message = f"read {shown(word)}{did_you_mean(near and f'`{near}`')}"
    return ExpressionError(message, hint=f"the symbols are {listed}{more}", code="unknown_symbol")


# --- the table of readings: what people type, and what it usually means, the most usual first


class Notation(NamedTuple):
    """A text that people type, a formula or a quantity, with its usual `readings` in their order.

    In a document the `first` is taken, or the one that `fits` its names and dimensions; of several that fit
    none is. What answers only may hold is `refused`.
    """

    of: str
    document: str
    typed: str
    readings: list[str]


NOTATION = [
    Notation(of, document, typed, readings)
    for of, document, typed, *readings in table(__file__, "notation.tsv")
]


DOTS = "\N{COMBINING DOT ABOVE}\N{COMBINING DIAERESIS}"
_DOTTED = re.compile(r"([^\W\d_](?:\w{0,9}\d)?)(\u0308|\u0307\u0307|\u0307)(_?\d+)?")


def undotted(text: str) -> str:
    """A text with names for letters that have dots: xdot and x_1ddot for x and x_1 with one dot and two."""
    marks = str.maketrans("\N{DOT ABOVE}\N{DIAERESIS}", DOTS)
    letters = unicodedata.normalize("NFD", text.translate(marks))
    if not any(dots in letters for dots in DOTS):
        return text
    return _DOTTED.sub(lambda m: f"{m[1]}{m[3] or ''}{'dot' if m[2] == DOTS[0] else 'ddot'}", letters)
