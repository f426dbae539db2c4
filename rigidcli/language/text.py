r"""Trees as text: for programs, for people in a terminal, and for LaTeX.

    root, _ = read("p_x^2/(2*m) - k*cos(theta)^2")
    text(root)        # p_x**2/(2*m) - k*cos(theta)**2
    reading(root)     # p_x^2/(2 m) - k cos(theta)^2
    latex(root)       # \frac{p_{x}^{2}}{2 m} - k \cos^{2}\theta

A tree is written from its leaves upwards and without recursion: what is derived from a text may be
deeper than any text that can be read.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Sequence
from enum import IntEnum
from functools import partial
from typing import Any, NamedTuple, TypeAlias

from rigidcli.language import tree
from rigidcli.language.tokens import GREEK


def text(node: tree.Node, power: str = "**") -> str:
    """A tree in the expression language: `parser.read` reads it back as a tree with the same value.

    Operations keep their order, so that the values agree to the last bit. There are no parentheses that
    could be left out, but for those of `x**(-2)`. A tree beyond the bounds of `parser.read` is written
    all the same. Other languages may have another sign for a `power`.
    """
    return _folded(node, partial(_plain, times="*", power=power))


def reading(node: tree.Node) -> str:
    """A tree as a person would write it: `M a^2/12`, `x/(2 m)`, `a (b + c)`, `10*2^(1/3)`."""
    return _folded(node, partial(_plain, times=" ", power="^"))


def latex(node: tree.Node) -> str:
    r"""A tree as LaTeX for math mode; it needs the package amsmath.

    A function of a single name or number goes without parentheses, at the end of its product:
    `x \sin\theta`.
    """
    return _folded(node, _latex).replace("(", r"\left(").replace(")", r"\right)")


class _Strength(IntEnum):
    """How tightly a written expression holds together."""

    SUM = 0
    PRODUCT = 1
    POWER = 2
    ATOM = 3


class _Piece(NamedTuple):
    """A part of the tree, written."""

    text: str
    """Without its sign."""
    strength: _Strength
    negative: bool = False
    is_open: bool = False
    """Whether it ends in what a further factor would seem to belong to: a divisor, a bare argument."""


_Writing: TypeAlias = Generator[tree.Node, _Piece, _Piece]
"""The writing of a node: it yields each of its operands, is sent the written one, and returns its own."""


def _folded(root: tree.Node, write: Callable[[tree.Node], _Writing]) -> str:
    """The text of the root, written by `write` from its written operands, as these are from theirs."""
    pending = [write(root)]
    done: Any = None
    while pending:
        try:
            pending.append(write(pending[-1].send(done)))
            done = None
        except StopIteration as end:
            done = end.value
            pending.pop()
    return _signed(done)


def _each(operands: Iterable[tree.Node]) -> Generator[tree.Node, _Piece, list[_Piece]]:
    """All operands, one after the other."""
    written: list[_Piece] = []
    for operand in operands:
        written += [(yield operand)]
    return written


def _signed(piece: _Piece) -> str:
    if not piece.negative:
        return piece.text
    return f"-{_within(piece, _Strength.PRODUCT)}"


def _within(piece: _Piece, least: _Strength) -> str:
    """A piece without its sign, in parentheses if it is weaker than `least`."""
    return piece.text if piece.strength >= least else f"({piece.text})"


def _whole(piece: _Piece, least: _Strength) -> str:
    """A piece with its sign, in parentheses if it has one or is weaker than `least`."""
    return f"({_signed(piece)})" if piece.negative else _within(piece, least)


def _sum(terms: Sequence[_Piece]) -> _Piece:
    written = [_signed(terms[0])]
    for term in terms[1:]:
        written.append("-" if term.negative else "+")
        written.append(_within(term, _Strength.PRODUCT))
    return _Piece(" ".join(written), _Strength.SUM)


def _plain(node: tree.Node, *, times: str, power: str) -> _Writing:
    """A node in one line of plain text."""
    match node:
        case tree.Name(word) | tree.Number(word, _) | tree.Constant(word):
            return _Piece(word, _Strength.ATOM)
        case tree.Negative(operand):
            piece = yield operand
            return piece._replace(negative=not piece.negative)
        case tree.Sum(terms):
            return _sum((yield from _each(terms)))
        case tree.Reciprocal():
            return (yield from _line([node], times))
        case tree.Product(factors):
            return (yield from _line(factors, times))
        case tree.Power():
            base, exponent = yield from _each((node.base, node.exponent))
            # Powers group from the right: a**b**c is a**(b**c).
            word = f"{_whole(base, _Strength.ATOM)}{power}{_whole(exponent, _Strength.POWER)}"
            return _Piece(word, _Strength.POWER)
        case tree.Call(function, arguments):
            parts = yield from _each(arguments)
            return _Piece(f"{function}({', '.join(map(_signed, parts))})", _Strength.ATOM)


def _line(factors: Sequence[tree.Node], times: str) -> _Writing:
    """A product from left to right, its reciprocals as divisions."""
    written, negative, is_open = "", False, False
    for factor in factors:
        part = yield factor.operand if isinstance(factor, tree.Reciprocal) else factor
        negative ^= part.negative
        if isinstance(factor, tree.Reciprocal):
            written = f"{written or '1'}/{_within(part, _Strength.POWER)}"
            is_open = True
        elif written:
            right = _within(part, _Strength.POWER)
            # `a/b c` would be taken for a/(b c), and `2 3` for a number.
            written += ("*" if is_open or _starts_with_number(right) else times) + right
        else:
            written, is_open = _within(part, _Strength.PRODUCT), part.is_open
    return _Piece(written, _Strength.PRODUCT, negative, is_open)


def _starts_with_number(written: str) -> bool:
    return written[0].isdigit() or written[0] == "."


_LATEX_FUNCTIONS = {
    **{name: rf"\{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    **{f"a{name}": rf"\arc{name}" for name in ("sin", "cos", "tan")},
    **{f"a{name}": rf"\operatorname{{ar{name}}}" for name in ("sinh", "cosh", "tanh")},
    "atan2": r"\operatorname{atan2}",
    "log": r"\ln",
    "sign": r"\operatorname{sgn}",
}
"""The names of functions that stand before their arguments: all but the three of `_LATEX_SHAPES`."""

_LATEX_SHAPES = {
    "abs": (r"\left|{}\right|", _Strength.ATOM),
    "sqrt": (r"\sqrt{{{}}}", _Strength.POWER),
    "exp": (r"\mathrm{{e}}^{{{}}}", _Strength.POWER),
}
"""Functions with a notation of their own. An upright e is told from a name, which would be in italics."""

_WORD_AT_END = re.compile(r"(?<!_\{)\\mathrm\{\w{2,}\}+$")
_WORD_AT_START = re.compile(r"(?:\\d?dot\{)?\\mathrm\{\w{2,}\}")
_SMALL_FRACTION = re.compile(r"(-?)\\frac\{(\w+)\}\{(\w+)\}")


def _latex(node: tree.Node) -> _Writing:
    """A node as LaTeX, but with plain parentheses."""
    match node:
        case tree.Number(word, _):
            return _latex_number(word)
        case tree.Constant(name) | tree.Name(name):
            return _Piece(latex_name(name), _Strength.ATOM)
        case tree.Negative() | tree.Product() | tree.Reciprocal():
            over, under, negative = _fraction(node)
            parts = yield from _each([*over, *under])
            negative ^= sum(part.negative for part in parts) % 2 == 1
            return _latex_fraction(parts[: len(over)], parts[len(over) :])._replace(negative=negative)
        case tree.Sum(terms):
            return _sum((yield from _each(terms)))
        case tree.Power(tree.Call(function, (argument,)), tree.Number(digits, _)) if _is_raised(
            function, digits
        ):
            return _latex_call(f"{_LATEX_FUNCTIONS[function]}^{{{digits}}}", [(yield argument)])
        case tree.Power():
            base, exponent = yield from _each((node.base, node.exponent))
            # A fraction in small type is hard to read.
            small = _SMALL_FRACTION.fullmatch(_signed(exponent))
            raised = "{}{}/{}".format(*small.groups()) if small else _signed(exponent)
            return _Piece(f"{_whole(base, _Strength.ATOM)}^{{{raised}}}", _Strength.POWER)
        case tree.Call(tree.UnknownFunction() as function, arguments):
            written = ", ".join(map(_signed, (yield from _each(arguments))))
            return _Piece(f"{_latex_unknown(function)}({written})", _Strength.POWER)
        case tree.Call(function, arguments) if function in _LATEX_SHAPES:
            shape, strength = _LATEX_SHAPES[function]
            return _Piece(shape.format(_signed((yield arguments[0]))), strength)
        case tree.Call(function, arguments):
            return _latex_call(_LATEX_FUNCTIONS[function], (yield from _each(arguments)))


def _latex_unknown(function: tree.UnknownFunction) -> str:
    """The name of an unknown function: with primes if it is one of one parameter, else with fractions."""
    name, order = latex_name(function.base), len(function.by)
    if len(function.parameters) == 1 or not order:
        return name + "'" * order
    over = rf"\partial^{{{order}}}" if order > 1 else r"\partial "
    under = " ".join(rf"\partial {latex_name(function.parameters[place])}" for place in function.by)
    return rf"\frac{{{over}{name}}}{{{under}}}"


def _latex_number(word: str) -> _Piece:
    digits, e, exponent = word.lower().partition("e")
    if not e:
        return _Piece(digits, _Strength.ATOM)
    return _Piece(rf"{digits} \times 10^{{{int(exponent)}}}", _Strength.PRODUCT)


def _fraction(node: tree.Node) -> tuple[list[tree.Node], list[tree.Node], bool]:
    """The factors of the numerator and of the denominator, and whether minus stands before them.

    A fraction in the denominator stays one.
    """
    over: list[tree.Node] = []
    under: list[tree.Node] = []
    negative = False
    pending = [(node, over)]
    while pending:
        factor, side = pending.pop()
        match factor:
            case tree.Negative(operand):
                negative = not negative
                pending.append((operand, side))
            case tree.Product(factors) if side is over or not any(
                isinstance(f, tree.Reciprocal) for f in factors
            ):
                pending.extend((inner, side) for inner in reversed(factors))
            case tree.Reciprocal(operand) if side is over:
                pending.append((operand, under))
            case _:
                side.append(factor)
    return over, under, negative


def _latex_fraction(over: Sequence[_Piece], under: Sequence[_Piece]) -> _Piece:
    if not under:
        return _latex_product(over)
    numerator, denominator = _latex_product(over), _latex_product(under)
    return _Piece(rf"\frac{{{numerator.text}}}{{{denominator.text}}}", _Strength.PRODUCT)


def _latex_product(factors: Sequence[_Piece]) -> _Piece:
    """The factors side by side, those that end in a bare argument last."""
    needed = [factor for factor in factors if factor.text != "1"] or [_Piece("1", _Strength.ATOM)]
    if len(needed) == 1:
        return needed[0]
    needed.sort(key=lambda factor: factor.is_open)
    written = _within(needed[0], _Strength.PRODUCT)
    for factor in needed[1:]:
        right = _within(factor, _Strength.PRODUCT)
        written += _latex_times(written, right) + right
    return _Piece(written, _Strength.PRODUCT, is_open=needed[-1].is_open)


def _latex_times(left: str, right: str) -> str:
    """What keeps two factors apart: LaTeX would run two words into one."""
    if _starts_with_number(right):
        return r" \cdot "
    return r" \, " if _WORD_AT_END.search(left) or _WORD_AT_START.match(right) else " "


def _is_raised(function: str, exponent: str) -> bool:
    r"""Whether a power is written on the name of its function; `\sin^{-1}` would be the inverse."""
    return function in _LATEX_FUNCTIONS and exponent.isdigit() and exponent not in ("0", "1")


def _latex_call(head: str, arguments: Sequence[_Piece]) -> _Piece:
    first = arguments[0]
    if len(arguments) > 1 or first.negative or first.strength < _Strength.ATOM:
        return _Piece(f"{head}({', '.join(map(_signed, arguments))})", _Strength.POWER)
    blank = " " if head[-1].isalpha() and not first.text.startswith("\\") else ""
    return _Piece(f"{head}{blank}{first.text}", _Strength.POWER, is_open=True)


_LATIN = {
    "omicron": "o", "Alpha": "A", "Beta": "B", "Epsilon": "E", "Zeta": "Z", "Eta": "H", "Iota": "I",
    "Kappa": "K", "Mu": "M", "Nu": "N", "Omicron": "O", "Rho": "P", "Tau": "T", "Chi": "X",
}  # fmt: skip
"""Greek letters that look like Latin ones, for which LaTeX has no commands."""

_COMMANDS = {*GREEK, *map(str.capitalize, GREEK), "hbar", "ell"} - _LATIN.keys()
"""Names that are LaTeX commands as they stand."""

_DECORATED = re.compile(r"(?P<letters>[A-Za-z]+)(?P<digits>[0-9]*)(?P<indices>(?:_[A-Za-z0-9]+)*)")


def latex_name(name: str) -> str:
    r"""An identifier as LaTeX: `omega_x` is `\omega_{x}`, `x1dot` is `\dot{x}_{1}`, `mass` is upright."""
    dots = next((dots for dots in ("ddot", "dot") if name.endswith(dots) and name != dots), "")
    parts = _DECORATED.fullmatch(name.removesuffix(dots))
    if parts is None:
        return rf"\mathrm{{{name}}}".replace("_", r"\_")
    letters = _latex_letters(parts["letters"])
    if dots:
        letters = rf"\{dots}{{{letters}}}"
    indices = [index for index in (parts["digits"], *parts["indices"].split("_")) if index]
    written = ",".join(index if index.isdigit() else latex_name(index) for index in indices)
    return f"{letters}_{{{written}}}" if written else letters


def _latex_letters(letters: str) -> str:
    if letters in _COMMANDS:
        return rf"\{letters}"
    if letters in _LATIN:
        return rf"\mathrm{{{_LATIN[letters]}}}"
    return letters if len(letters) == 1 or letters.isdigit() else rf"\mathrm{{{letters}}}"
