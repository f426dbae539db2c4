"""Equations in answers: mappings from derivatives to expressions, or texts `left = right`."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, replace

from rigidcli.algebra.expressions import Expr
from rigidcli.errors import shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.expressions.formula import Vocabulary, names_in, read
from rigidcli.grading.outcome import Unreadable
from rigidcli.language.tree import Name, Negative, Node, Sum

MOST_EQUATIONS = 200
"""In one answer."""

MOST_TEXT = 40_000
"""Characters of all equations of an answer."""

LONGEST_PLACE = 40
"""Characters of a key that names its equation as it stands."""

DERIVATIVES = "a time derivative is spelled `xdot`, a second one `xddot`"
"""What is said where a derivative is spelled as it cannot be read."""

_EQUALS = re.compile(r"==?")
_BETWEEN = " \t\r\n;,"
_PRIMES = re.compile("([^\\W\\d]\\w*)(['\N{PRIME}\N{RIGHT SINGLE QUOTATION MARK}]{1,2})")
"""A derivative as `x'` or `x''`."""

_DERIVATIVE = re.compile(r"\\d?dot\b|\bd2?\w*/\(?dt2?\b")
"""In TeX, or of differentials, where blanks and `^` are left out."""


@dataclass(frozen=True, slots=True)
class Text:
    """Both sides of an equation as typed. A `label` is a left side that was the key of a mapping."""

    place: str
    left: str
    right: str
    label: bool = False


@dataclass(frozen=True, slots=True)
class Equation:
    """An equation that has been read, with its `exact` residual as far as there is one."""

    place: str
    left: Node
    right: Node
    exact: Expr | None = None

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
    found = [replace(text, left=_dotted(text.left), right=_dotted(text.right)) for text in _texts(answer)]
    if not found:
        raise Unreadable("wrong_shape", "expected equations, such as {xdot: ...} or [xdot = ...]")
    if len(found) > MOST_EQUATIONS:
        raise Unreadable("too_large", f"{len(found)} equations")
    length = sum(len(text.left) + len(text.right) for text in found)
    if length > MOST_TEXT:
        raise Unreadable("too_large", f"{length} characters")
    return found


def _dotted(text: str) -> str:
    """A side of an equation with primes as dots."""
    plain = text.replace("\N{DOUBLE PRIME}", "''")
    return _PRIMES.sub(lambda found: found[1] + "d" * (len(found[2]) - 1) + "dot", plain)


def _texts(answer: Tree) -> Iterator[Text]:
    if isinstance(answer, dict):
        yield from _of_mapping(answer)
    elif isinstance(answer, list):
        pieces = [piece for entry in answer for piece in _pieces(entry) or [entry]]
        for place, piece in enumerate(pieces, 1):
            if isinstance(piece, dict):
                yield from _of_mapping(piece)
            else:
                yield _sides(piece, f"equation {place}")
    elif isinstance(answer, str):
        pieces = _pieces(answer)
        for place, piece in enumerate(pieces, 1):
            yield _sides(piece, f"equation {place}" if len(pieces) > 1 else "")
    else:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected equations")


def _pieces(text: Tree) -> list[Tree]:
    """The equations of one text: between the ends of lines, semicolons, and commas outside of parentheses.

    Only one equation is as long as the text. At a comma one ends only if another follows: not the one in
    `xdot = 0,5*x`.
    """
    if not isinstance(text, str):
        return []
    if len(_EQUALS.findall(text)) < 2:
        only = text.rstrip(_BETWEEN)
        return [only] if only else []
    found: list[Tree] = []
    for line in re.split(r"[\n;]", text):
        whole: list[str] = []
        for part in _between_commas(line):
            if whole and part.strip() and "=" not in part:
                whole[-1] += f",{part}"
            elif part.strip():
                whole.append(part)
        found += whole
    return found


def _between_commas(line: str) -> Iterator[str]:
    depth, start = 0, 0
    for place, sign in enumerate(line):
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth <= 0:
            yield line[start:place]
            start = place + 1
    yield line[start:]


def _of_mapping(answer: dict[str, Tree]) -> Iterator[Text]:
    for key, value in answer.items():
        place = key if key.isidentifier() and len(key) <= LONGEST_PLACE else shown(key)
        if not isinstance(value, str):
            raise Unreadable("wrong_shape", f"read {shown(value)}, expected an expression", place=place)
        pieces = _pieces(value) if "=" in value else []
        for number, piece in enumerate(pieces, 1):
            yield _sides(piece, place if len(pieces) == 1 else f"{place}, equation {number}")
        if not pieces:
            yield Text(place, key, value, label=True)


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
        # A superscript has a digit as its compatible form.
        plain = re.sub(r"[\s^]", "", unicodedata.normalize("NFKD", text))
        is_open = finding.code in ("parse_error", "unknown_symbol") and DERIVATIVES not in finding.detail
        if is_open and _DERIVATIVE.search(plain):
            raise Unreadable(finding.code, f"{finding.detail}; {DERIVATIVES}", place=place) from None
        raise
