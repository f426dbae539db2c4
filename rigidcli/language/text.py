r"""Trees as text: for programs, for people in a terminal, and for LaTeX.

    root, _ = read("p_x^2/(2*m) - k*cos(theta)^2")
    text(root)        # p_x**2/(2*m) - k*cos(theta)**2
    reading(root)     # p_x^2/(2 m) - k cos(theta)^2
    latex(root)       # \frac{p_{x}^{2}}{2 m} - k \cos^{2}\theta

Pieces know how tightly they hold together, so that only the parentheses that are needed are written.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from rigidcli.language import tree
from rigidcli.language.tokens import GREEK, rewritten, rules
from rigidcli.language.tree import Kind, Parts, fold
from rigidcli.language.words import CONSTANTS, FUNCTIONS


def text(node: tree.Node, power: str = "**") -> str:
    """A tree in the expression language: `parser.read` reads it back as a tree with the same value.

    Operations keep their order, so that the values agree to the last bit. There are no parentheses that
    could be left out, but for those of `x**(-2)`. A tree beyond the bounds of `parser.read` is written
    all the same. Other languages may have another sign for a `power`.
    """
    return _signed(fold(node, _atom, _plain("*", power)))


def reading(node: tree.Node) -> str:
    """A tree as a person would write it: `M a^2/12`, `x/(2 m)`, `a (b + c)`, `10*2^(1/3)`."""
    return _signed(fold(node, _atom, _plain(" ", "^")))


_DOUBTFUL = rules(
    (r"\ba(?=(?:sin|cos|tan)h?\()", "arc"),  # an amplitude
    (r"(?<=\d)\^([A-Za-z]\w*(?:\^\w+)*)(?=/)", r"^(\1)"),  # 2^x/b would be read as one exponent,
    (r"(?:(?<=\))\^(\d+)|\^(\d*[13579]))/(?=\d)", r"^\1\2 * 1/"),  # and so would x^3/2, but not x^2/2
)


def without_doubt(node: tree.Node) -> str:
    """A tree as a person would write it, in a form with one reading: `arcsin(x)`, as a may be a factor."""
    return rewritten(reading(node), _DOUBTFUL)


def latex(node: tree.Node) -> str:
    r"""A tree as LaTeX for math mode; it needs the package amsmath.

    A function of a single name or number goes without parentheses, at the end of its product:
    `x \sin\theta`.
    """
    written = fold(node, lambda name: _atom(latex_name(name)), _LATEX)
    return _signed(written).replace("(", r"\left(").replace(")", r"\right)")


_SUM, _PRODUCT, _POWER, _ATOM = range(4)  # how tightly a written expression holds together


class _Piece(NamedTuple):
    text: str  # without its sign
    strength: int
    negative: bool = False
    is_open: bool = False  # whether it ends in what a further factor would seem to belong to, as a divisor
    # The sign and the argument of a function, in LaTeX: a power of it may be written on its sign.
    called: tuple[str, Any] | None = None


def _atom(word: str) -> _Piece:
    return _Piece(word, _ATOM)


def _signed(piece: _Piece) -> str:
    return f"-{_unsigned(piece, _PRODUCT)}" if piece.negative else piece.text


def _unsigned(piece: _Piece, least: int) -> str:
    """A piece without its sign, in parentheses if it is weaker than `least`."""
    return piece.text if piece.strength >= least else f"({piece.text})"


def _bracketed(piece: _Piece, least: int) -> str:
    """A piece with its sign, in parentheses if it has one or is weaker than `least`."""
    return f"({_signed(piece)})" if piece.negative else _unsigned(piece, least)


def _turned(written: Any) -> Any:
    return written._replace(negative=not written.negative)


def _sum(terms: Parts) -> _Piece:
    written = ""
    for is_subtracted, term in terms:
        is_negative = is_subtracted != term.negative
        if written:
            written += f" {'-' if is_negative else '+'} {_unsigned(term, _PRODUCT)}"
        else:
            written = _signed(term._replace(negative=is_negative))
    return _Piece(written, _SUM)


@lru_cache
def _plain(times: str, power: str) -> Kind:
    def product(factors: Parts) -> _Piece:
        """From left to right, with divisions."""
        written, negative, is_open = "", False, False
        for divides, part in factors:
            negative ^= part.negative
            right = _unsigned(part, _POWER)
            if divides:
                # x^1/2 is read as a root.
                written = f"({written})" if written.endswith(f"{power}1") else written
                written, is_open = f"{written or '1'}/{right}", True
            elif written:
                # `a/b c` would be taken for a/(b c), and `2 3` for a number.
                written += ("*" if is_open or _starts_with_number(right) else times) + right
            else:
                written, is_open = _unsigned(part, _PRODUCT), part.is_open
        return _Piece(written, _PRODUCT, negative, is_open)

    def raised(base: _Piece, exponent: _Piece) -> _Piece:
        """Powers group from the right: a**b**c is a**(b**c)."""
        parts = _bracketed(base, _ATOM), _bracketed(exponent, _POWER)
        return _Piece(power.join(parts), _POWER)

    def call(function: str, arguments: list[_Piece]) -> _Piece:
        return _atom(f"{function}({', '.join(map(_signed, arguments))})")

    return Kind(lambda word, _: _atom(word), _turned, _sum, product, raised, call)


def _starts_with_number(written: str) -> bool:
    return written[0].isdigit() or written[0] == "."


def _latex_number(word: str, value: float) -> _Piece:
    if word in CONSTANTS:
        return _atom(latex_name(word))
    digits, e, exponent = word.lower().partition("e")
    return _Piece(rf"{digits} \times 10^{{{int(exponent)}}}", _PRODUCT) if e else _atom(digits)


def _latex_factors(factors: Parts) -> _Piece:
    """The product as one fraction; a fraction in it stays one."""
    over, under = ([factor for divides, factor in factors if divides == side] for side in (False, True))
    written = _latex_product(over)
    if under:
        written = _Piece(rf"\frac{{{written.text}}}{{{_latex_product(under).text}}}", _PRODUCT)
    return written._replace(negative=sum(factor.negative for _, factor in factors) % 2 == 1)


def _latex_power(base: _Piece, exponent: _Piece) -> _Piece:
    raised = _signed(exponent)
    # `\sin^{-1}` would be the inverse.
    if base.called and not base.negative and raised.isdigit() and raised not in ("0", "1"):
        head, argument = base.called
        return _latex_call(f"{head}^{{{raised}}}", [argument])
    # A fraction in small type is hard to read.
    small = re.fullmatch(r"(-?)\\frac\{(\w+)\}\{(\w+)\}", raised)
    raised = "{}{}/{}".format(*small.groups()) if small else raised
    return _Piece(f"{_bracketed(base, _ATOM)}^{{{raised}}}", _POWER)


def _latex_function(function: str, arguments: list[_Piece]) -> _Piece:
    written = ", ".join(map(_signed, arguments))
    if isinstance(function, tree.UnknownFunction):
        return _Piece(f"{_latex_unknown(function)}({written})", _POWER)
    shape = FUNCTIONS[function].latex
    if "{}" in shape:  # a notation of its own, such as a root
        strength = _ATOM if function == "abs" else _POWER
        return _Piece(shape.format(written), strength)
    head = shape if shape.startswith("\\") else rf"\operatorname{{{shape}}}"
    called = (head, arguments[0]) if len(arguments) == 1 else None
    return _latex_call(head, arguments)._replace(called=called)


# LaTeX, but with plain parentheses.
_LATEX = Kind(_latex_number, _turned, _sum, _latex_factors, _latex_power, _latex_function)


def _latex_unknown(function: tree.UnknownFunction) -> str:
    """The name of an unknown function: with primes if it is one of one parameter, else with fractions."""
    name, order = latex_name(function.base), len(function.by)
    if len(function.parameters) == 1 or not order:
        return name + "'" * order
    over = rf"\partial^{{{order}}}" if order > 1 else r"\partial "
    under = " ".join(rf"\partial {latex_name(function.parameters[place])}" for place in function.by)
    return rf"\frac{{{over}{name}}}{{{under}}}"


def _latex_product(factors: Sequence[_Piece]) -> _Piece:
    """The factors side by side, those that end in a bare argument last."""
    needed = [factor for factor in factors if factor.text != "1"] or [_atom("1")]
    if len(needed) == 1:
        return needed[0]
    needed.sort(key=lambda factor: factor.is_open)
    written = _unsigned(needed[0], _PRODUCT)
    for factor in needed[1:]:
        right = _unsigned(factor, _PRODUCT)
        written += _latex_times(written, right) + right
    return _Piece(written, _PRODUCT, is_open=needed[-1].is_open)


def _latex_times(left: str, right: str) -> str:
    """What keeps two factors apart: LaTeX would run two words into one."""
    if _starts_with_number(right):
        return r" \cdot "
    ends_in_word = re.search(r"(?<!_\{)\\mathrm\{\w{2,}\}+$", left)
    return r" \, " if ends_in_word or re.match(r"(?:\\d?dot\{)?\\mathrm\{\w{2,}\}", right) else " "


def _latex_call(head: str, arguments: Sequence[_Piece]) -> _Piece:
    first = arguments[0]
    if len(arguments) > 1 or first.negative or first.strength < _ATOM:
        return _Piece(f"{head}({', '.join(map(_signed, arguments))})", _POWER)
    blank = " " if head[-1].isalpha() and not first.text.startswith("\\") else ""
    return _Piece(f"{head}{blank}{first.text}", _POWER, is_open=True)


# Greek letters that look like Latin ones, for which LaTeX has no commands.
_LATIN = {
    "omicron": "o", "Alpha": "A", "Beta": "B", "Epsilon": "E", "Zeta": "Z", "Eta": "H", "Iota": "I",
    "Kappa": "K", "Mu": "M", "Nu": "N", "Omicron": "O", "Rho": "P", "Tau": "T", "Chi": "X",
}  # fmt: skip
# Names that are LaTeX commands as they stand.
_COMMANDS = {*GREEK, *map(str.capitalize, GREEK), "hbar", "ell"} - _LATIN.keys()
_DECORATED = re.compile(r"(?P<letters>[A-Za-z]+)(?P<digits>[0-9]*)(?P<indices>(?:_[A-Za-z0-9]+)*)")


def latex_name(name: str) -> str:
    r"""An identifier as LaTeX: `omega_x` is `\omega_{x}`, `x1dot` is `\dot{x}_{1}`, `mass` is upright."""
    dots = next((dots for dots in ("ddot", "dot") if name.endswith(dots) and name != dots), "")
    parts = _DECORATED.fullmatch(name.removesuffix(dots))
    if parts is None:
        return rf"\mathrm{{{name}}}".replace("_", r"\_")
    letters = parts["letters"]
    if letters in _COMMANDS:
        letters = rf"\{letters}"
    elif len(letters) > 1:
        letters = rf"\mathrm{{{_LATIN.get(letters, letters)}}}"
    if dots:
        letters = rf"\{dots}{{{letters}}}"
    indices = [index for index in (parts["digits"], *parts["indices"].split("_")) if index]
    written = ",".join(index if index.isdigit() else latex_name(index) for index in indices)
    return f"{letters}_{{{written}}}" if written else letters
