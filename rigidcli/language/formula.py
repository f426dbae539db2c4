"""Formulas that show numbers in their places, and are not worked out: 0.3*9.8*0.05*sin(0.5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import ClassVar

from rigidcli.language.tree import Node, Number, Power, Product, Reciprocal, Sum, rebuilt


@dataclass(frozen=True, slots=True)
class Formula:
    """A tree as it is to be written; renderers round its numbers to the digits that people ask for.

    The numbers of one that is `exact` stay as they are.
    """

    root: Node
    exact: bool = False

    names: ClassVar[frozenset[str]] = frozenset(("units",))
    """Something, as the numbers in a formula have units of their own."""

    def tree(self, digits: int | None = None) -> Node:
        """The tree, its numbers rounded to so many significant digits."""
        return self.root if digits is None or self.exact else _rounded(self.root, digits)


def _rounded(node: Node, digits: int) -> Node:
    if isinstance(node, Number):
        return Number(f"{node.value:.{digits}g}", node.value)
    return rebuilt(node, lambda operand: _rounded(operand, digits))


@dataclass(frozen=True, slots=True)
class Style:
    """How trees of exact arithmetic are written.

    With `decimal`, fractions that end are decimals. A sum that stands first in a pair of `sums` is written as
    the second, R + r as r + R. Where this has the other sign, that is done under even powers only:
    (R - r)**2 is written (r - R)**2.
    """

    decimal: bool = False
    sums: tuple[tuple[Sum, Sum], ...] = ()

    def of(self, node: Node) -> Node:
        """The tree as it is to be written."""
        if self.sums:
            typed = {frozenset(sum_.terms): sum_ for _, sum_ in self.sums}
            node = _ordered(node, dict(self.sums), typed)
        return _in_decimals(node) if self.decimal else node


def _ordered(node: Node, squared: Mapping[Sum, Sum], typed: Mapping[frozenset[Node], Sum]) -> Node:
    """A tree with the sums as they are `typed`, by their terms; under even powers by their squares, too."""
    match node:
        case Power(Sum() as base, exponent) if is_even(exponent):
            node = Power(squared.get(base, base), exponent)
        case Sum(terms):
            node = typed.get(frozenset(terms), node)
    return rebuilt(node, lambda operand: _ordered(operand, squared, typed))


def is_even(exponent: Node) -> bool:
    """Whether it is an even number."""
    return isinstance(exponent, Number) and exponent.value % 2 == 0


MOST_DIGITS = 15
"""The most digits of a coefficient: a float holds so many, and nobody types more."""


def _in_decimals(node: Node) -> Node:
    """A tree of exact arithmetic with decimals for its fractions, where these end: x/0.74 for 50 x/37.

    Halves, quarters and the like with numerator one stay fractions, and so do 2/3, 4/3, and exponents.
    """
    match node:
        case Power(base, exponent):
            return Power(_in_decimals(base), exponent)
        case Product(factors):
            return _product([_in_decimals(factor) for factor in factors])
        case _:
            return rebuilt(node, _in_decimals)


def _product(factors: list[Node]) -> Node:
    """A product as `algebra.trees` makes them: numbers first, the denominator last."""
    above, below = list(factors), list[Node]()
    if isinstance(last := above[-1], Reciprocal):
        above.pop()
        below = list(last.operand.factors if isinstance(last.operand, Product) else [last.operand])
    ratio = _taken(above) / _taken(below)
    if decimal := _digits(ratio):
        over, under = decimal, "1"
    elif ratio.numerator % 5 == 0 and (decimal := _digits(1 / ratio)):
        over, under = "1", decimal
    else:
        over, under = str(ratio.numerator), str(ratio.denominator)
    if over != "1" or not above:
        above.insert(0, Number(over, float(over)))
    if under != "1":
        below.insert(0, Number(under, float(under)))
    if below:
        above.append(Reciprocal(below[0] if len(below) == 1 else Product(tuple(below))))
    return above[0] if len(above) == 1 else Product(tuple(above))


def _taken(factors: list[Node]) -> Fraction:
    """The number at the head of the factors, which is taken off."""
    if not factors or not isinstance(first := factors[0], Number):
        return Fraction(1)
    del factors[0]
    return Fraction(first.text)


def _digits(ratio: Fraction) -> str | None:
    """The ratio as a decimal; None where it has no end, or is better read as a fraction."""
    denominator = ratio.denominator
    if ratio.numerator == 1 and denominator & (denominator - 1) == 0 and denominator > 1:
        return None
    value = Decimal(ratio.numerator) / Decimal(denominator)
    if len(value.as_tuple().digits) > MOST_DIGITS:
        value = value.normalize()  # without the zeros at the end
    ends = Fraction(value) == ratio and len(value.as_tuple().digits) <= MOST_DIGITS
    return str(value).lower().replace("e+", "e") if ends else None
