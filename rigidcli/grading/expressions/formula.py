"""Expressions in answers: read with the names of a question, and compared as functions.

    names = Vocabulary({"m": "positive", "x": "real"})
    tree = read("m*x^2", names)                   # raises Unreadable
    points = draw(names, 40)                      # the same ones every time
    points.at(tree)                               # its values, and how far rounding may have led them astray

`agreement` tells whether two of them are the same function.
"""

from __future__ import annotations

import math
import random
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.errors import ExpressionError, nearest, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.values import Points
from rigidcli.language import parser
from rigidcli.language.tokens import MAX_TEXT
from rigidcli.language.tree import Call, Name, Negative, Node, Power, Product, Reciprocal, Sum, bound

Domain: TypeAlias = Literal["positive", "real"]

MOST_LISTED = 40
"""Names that a message lists."""

# --- reading


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The names that an answer may use.

    `domains` has the independent ones. `derived` has names that stand for expressions in these and in the
    derived names before them. `other` has further spellings, such as `px` for `p_x`. A student who uses
    another name is `told` these, but for those that are `unlisted`: they are known, and belong elsewhere.
    """

    domains: Mapping[str, Domain]
    derived: Mapping[str, Node] = field(default_factory=dict)
    other: Mapping[str, str] = field(default_factory=dict)
    told: bool = True
    unlisted: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """All names, in the spelling of the question."""
        return (*self.domains, *self.derived)


_NUMBERED = re.compile(r"(?P<letters>.*[A-Za-z])_?(?P<digits>[0-9]+)")


def spellings(names: Iterable[str], momenta: Sequence[str], velocities: Sequence[str]) -> dict[str, str]:
    """Other spellings that can mean one thing only, and what they mean.

    `px` or, of one momentum, `p` for `p_x`; `p1` or `p_1` for `p_theta1`; `x_dot` for `xdot`; and with or
    without an underscore before the last digits, `theta_1` for `theta1`.
    """
    names = tuple(names)
    pairs = [(other, name) for name in names for other in _numbered(name)]
    for name in momenta:
        sign, _, coordinate = name.partition("_")
        number = _NUMBERED.fullmatch(coordinate)
        pairs += [(f"{sign}{each}", name) for each in (coordinate, *_numbered(coordinate))]
        pairs += [] if number is None else [(f"p{dash}{number['digits']}", name) for dash in ("", "_")]
        pairs += [("p", name)] if len(momenta) == 1 else []
    for name in velocities:
        coordinate = name.removesuffix("dot")
        if coordinate == name:
            continue
        pairs += [(f"{each}{dot}", name) for each in _numbered(coordinate) for dot in ("dot", "_dot")]
        pairs.append((f"{coordinate}_dot", name))
    found: dict[str, set[str]] = {}
    for other, name in pairs:
        found.setdefault(other, set()).add(name)
    return {other: meant.pop() for other, meant in found.items() if len(meant) == 1 and other not in names}


def _numbered(name: str) -> tuple[str, ...]:
    """A name that ends with a number, with an underscore before that or without it: the other of the two."""
    match = _NUMBERED.fullmatch(name)
    both = () if match is None else tuple(f"{match['letters']}{dash}{match['digits']}" for dash in ("", "_"))
    return tuple(each for each in both if each != name)


_DOTS = "\N{COMBINING DOT ABOVE}\N{COMBINING DIAERESIS}"
"""Over a letter, as blackboards have them for time derivatives."""

_LABEL = re.compile(rf"\s*[^\W\d][\w{_DOTS}]*\s*(\([\w\s,{_DOTS}]*\)\s*)?=(?!=)")
"""What may stand before an expression: `H =`, `H(x, p) =`."""

_PRIMED = re.compile(r"([^\W\d]\w*)(?:(''|\"|\N{DOUBLE PRIME})|['\N{PRIME}\N{RIGHT SINGLE QUOTATION MARK}])")
"""A name with one prime, or with two: what stands for two is found."""

_BOUNDS = (("nested deeper", "too_deep"), ("at most", "too_large"))
"""How the reader of expressions says that a text is beyond its bounds."""


def read(answer: Tree, vocabulary: Vocabulary | None, place: str = "", *, label: bool = True) -> Node:
    """The tree of an answer in names of the vocabulary, or in any; `H =` may stand before it as a `label`.

    Raises Unreadable.
    """
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected an expression", place=place)
    if len(answer) > MAX_TEXT:
        raise Unreadable("too_large", f"{len(answer)} characters", place=place)
    text = _PRIMED.sub(lambda found: found[1] + ("ddot" if found[2] else "dot"), answer)
    head = _LABEL.match(text) if label else None
    text = text if head is None else " " * head.end() + text[head.end() :]
    try:
        node, names = parser.read(text)
    except ExpressionError as error:
        code = next((code for words, code in _BOUNDS if words in error.message), "parse_error")
        hint = error.hint or _hint(text, error.column)
        told = f"{error.message} ({hint})" if hint else error.message
        raise Unreadable(code, told, place=place) from None
    if vocabulary is None:
        return node
    respelled: dict[str, Node] = {
        name: Name(vocabulary.other[name]) for name in names & vocabulary.other.keys()
    }
    known = set(vocabulary.names)
    for name in sorted(names - known - respelled.keys()):
        raise Unreadable("unknown_symbol", _unknown(name, vocabulary), place=place)
    return bound(node, respelled) if respelled else node


def _hint(text: str, column: int | None) -> str:
    """What to type in place of a letter with dots at a column."""
    letter = "" if column is None else unicodedata.normalize("NFD", text[column - 1 : column])
    if set(letter).isdisjoint(_DOTS):
        return ""
    return "a time derivative is spelled `xdot`, a second one `xddot`"


def _unknown(name: str, vocabulary: Vocabulary) -> str:
    if not vocabulary.told:
        return f"read {shown(name)}"
    known = [each for each in vocabulary.names if each not in vocabulary.unlisted]
    near = nearest(name, known)
    listed = ", ".join(f"`{each}`" for each in known[:MOST_LISTED]) or "none"
    more = ", ..." if len(known) > MOST_LISTED else ""
    hint = "" if near is None else f" (did you mean `{near}`?)"
    return f"read {shown(name)}{hint}, the symbols are {listed}{more}"


def parts_of(node: Node) -> tuple[Node, ...]:
    """What a node is made of."""
    match node:
        case Negative(operand) | Reciprocal(operand):
            return (operand,)
        case Sum(members) | Product(members) | Call(_, members):
            return members
        case Power(base, exponent):
            return base, exponent
        case _:
            return ()


def names_in(node: Node) -> frozenset[str]:
    """The names in a tree."""
    if isinstance(node, Name):
        return frozenset((node.name,))
    return frozenset().union(*map(names_in, parts_of(node)))


def independent(derived: Mapping[str, Node], names: Iterable[str]) -> frozenset[str]:
    """The names on which the `names` depend that are not derived from others."""
    found, pending = frozenset[str](), frozenset(names)
    while pending:
        found |= pending
        pending = frozenset().union(*(names_in(derived[name]) for name in pending if name in derived)) - found
    return found - derived.keys()


def size_of(node: Node) -> int:
    """How many nodes a tree has."""
    return 1 + sum(map(size_of, parts_of(node)))


# --- points

Scale: TypeAlias = tuple[float, float]

SCALES: Sequence[Scale] = ((0.5, 2.0), (0.1, 10.0), (0.5, 2.0), (0.2, 5.0), (0.02, 50.0))
"""Between which sizes random values lie, point after point; real ones have either sign."""


def draw(vocabulary: Vocabulary, count: int, seed: int = 1, scales: Sequence[Scale] = SCALES) -> Points:
    """Random points: the same for the same names, count and seed."""
    chance = random.Random(seed)  # noqa: S311 - a probe needs no secrecy
    values: dict[str, list[float]] = {name: [] for name in vocabulary.domains}
    for place in range(count):
        low, high = (math.log(bound) for bound in scales[place % len(scales)])
        for name, domain in vocabulary.domains.items():
            size = math.exp(chance.uniform(low, high))
            sign = -1 if domain == "real" and chance.random() < 0.5 else 1
            values[name].append(sign * size)
    return Points({name: np.array(each) for name, each in values.items()}, vocabulary.derived, count)
