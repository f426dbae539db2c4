"""Trees of the expression language, worked out as exact expressions."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from rigidcli.algebra.bounds import MAX_BITS, bounded
from rigidcli.algebra.expressions import PI, Expr, number, power, product, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.tree import Kind, fold

_NOTHING: Mapping[str, Expr] = {}


def from_tree(node: tree.Node, values: Mapping[str, Expr] = _NOTHING) -> Expr:
    """The expression of a tree; names without a value become symbols, decimals the fractions they spell.

    Raises ExpressionError where it has no real value, or is too large.
    """
    e: Expr = fold(node, lambda name: values[name] if name in values else symbol(name), EXPRESSIONS)
    return e


def _number(text: str, value: float) -> Expr:
    if text == "pi":
        return PI
    exponent = text.lower().partition("e")[2]
    if abs(int(exponent or 0)) > MAX_BITS:
        raise ExpressionError("the value is too large")
    return number(bounded(Fraction(text)))


EXPRESSIONS = Kind(
    number=_number,
    negative=lambda e: -e,
    sum=lambda terms: total([-e if is_subtracted else e for is_subtracted, e in terms]),
    product=lambda factors: product([power(e, -1) if divides else e for divides, e in factors]),
    power=lambda base, exponent: base**exponent,
    call=lambda function, arguments: apply(function, *arguments),
)
