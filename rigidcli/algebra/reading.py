"""Trees of the expression language, worked out as exact expressions."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from rigidcli.algebra.expressions import PI, Expr, number, power, product, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import MAX_BITS, bounded
from rigidcli.errors import ExpressionError
from rigidcli.language import tree

_NOTHING: Mapping[str, Expr] = {}


def from_tree(node: tree.Node, values: Mapping[str, Expr] = _NOTHING) -> Expr:
    """The expression of a tree; names without a value become symbols.

    Decimal numbers are the fractions that they spell.

    Raises:
        ExpressionError: it has no real value, or is too large.
    """
    match node:
        case tree.Name(name):
            return values[name] if name in values else symbol(name)
        case tree.Number(text, value):
            return number(_spelled(text, value))
        case tree.Constant():
            return PI
        case tree.Negative(operand):
            return -from_tree(operand, values)
        case tree.Sum(terms):
            return total([from_tree(term, values) for term in terms])
        case tree.Product(factors):
            return product([from_tree(factor, values) for factor in factors])
        case tree.Reciprocal(operand):
            return power(from_tree(operand, values), -1)
        case tree.Power(base, exponent):
            return from_tree(base, values) ** from_tree(exponent, values)
        case tree.Call(function, arguments):
            return apply(function, *[from_tree(argument, values) for argument in arguments])


def _spelled(text: str, value: float) -> Fraction:
    _, _, exponent = text.lower().partition("e")
    if abs(int(exponent or 0)) > MAX_BITS:
        raise ExpressionError("the value is too large")
    fraction = Fraction(text)
    bounded(fraction)
    return fraction
