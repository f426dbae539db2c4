"""Random trees of expressions, and their values with 50 digits: the truth that the algebra is held to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import mpmath
from hypothesis import strategies as st

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.language import tree, words
from rigidcli.language.parser import read
from rigidcli.language.text import text

NAMES = ("a", "b", "x", "y")

EDGE = 1e-20
"""A value so near to where a function ends, jumps or becomes infinite may be there exactly."""

CONTEXT = mpmath.mp.clone()
CONTEXT.dps = 50

POINTS = [
    dict(zip(NAMES, values, strict=True))
    for values in [
        (Fraction("1.3"), Fraction("0.7"), Fraction("2.1"), Fraction("0.45")),
        (Fraction("-1.1"), Fraction("0.6"), Fraction("-0.8"), Fraction("1.9")),
        (Fraction("0.35"), Fraction("-2.3"), Fraction("-1.7"), Fraction("-0.55")),
        (Fraction(0), Fraction("1.2"), Fraction("-0.9"), Fraction("-1.4")),
        (Fraction("-0.75"), Fraction("-1.6"), Fraction(0), Fraction("0.8")),
    ]
]


class NoValueError(Exception):
    """There is no value, or it is not certain that there is one."""


def value(node: tree.Node, point: Mapping[str, Fraction], edge: float = EDGE) -> Any:
    """The value of a tree from its operations alone, none of them within `edge` of where it ends."""
    match node:
        case tree.Name(name):
            known = point[name]
            return CONTEXT.mpf(known.numerator) / known.denominator if isinstance(known, Fraction) else known
        case tree.Number(text, _):
            number = Fraction(text)
            return CONTEXT.mpf(number.numerator) / number.denominator
        case tree.Constant():
            return +CONTEXT.pi
        case tree.Negative(operand):
            return -value(operand, point, edge)
        case tree.Sum(terms):
            return certain(sum(value(term, point, edge) for term in terms), edge)
        case tree.Product(factors):
            product = CONTEXT.mpf(1)
            for factor in factors:
                product *= value(factor, point, edge)
            return certain(product, edge)
        case tree.Reciprocal(operand):
            return 1 / away(value(operand, point, edge), edge)
        case tree.Power(base, exponent):
            return power(value(base, point, edge), value(exponent, point, edge), edge)
        case tree.Call(function, arguments):
            return call(function, [value(argument, point, edge) for argument in arguments], edge)


def certain(number: Any, edge: float) -> Any:
    if abs(number) > 1 / edge:
        raise NoValueError
    return number


def away(number: Any, edge: float) -> Any:
    if abs(number) < edge:
        raise NoValueError
    return number


def power(base: Any, exponent: Any, edge: float) -> Any:
    whole = exponent == int(exponent)
    if not whole and base < edge and base != 0:
        raise NoValueError
    if not whole and abs(exponent - round(exponent)) < edge:
        raise NoValueError
    if exponent < 0 or (not whole and exponent < edge):
        away(base, edge)
    if base != 0 and exponent * CONTEXT.log(abs(base)) > -math.log(edge):
        raise NoValueError
    if base == 0 and exponent == 0:
        raise NoValueError
    return certain(CONTEXT.power(base, exponent), edge)


def call(function: str, arguments: list[Any], edge: float) -> Any:
    first = arguments[0]
    if function == "atan2":
        away(arguments[0], edge)
    if function in ("sign", "log"):
        away(first, edge)
    if function in ("asin", "acos", "atanh") and abs(first) > 1 - edge:
        raise NoValueError
    if function == "acosh" and first < 1 + edge:
        raise NoValueError
    if function in ("log", "sqrt") and first < edge and first != 0:
        raise NoValueError
    if function in ("sinh", "cosh", "exp") and abs(first) > -math.log(edge):
        raise NoValueError
    if function == "tan":
        away(CONTEXT.cos(first), edge)
    found = {"abs": "fabs"}.get(function, function)
    return certain(getattr(CONTEXT, found)(*arguments), edge)


def number(text: str) -> tree.Number:
    """A number as it is written."""
    return tree.Number(text, float(text))


LEAVES = st.one_of(
    st.sampled_from(NAMES).map(tree.Name),
    st.sampled_from(["0", "1", "2", "3", "4", "8", "0.5", "1.5", "12"]).map(number),
    st.just(tree.Constant("pi")),
)

EXPONENTS: st.SearchStrategy[tree.Node] = st.sampled_from(
    [
        number("2"),
        number("3"),
        number("4"),
        number("0.5"),
        tree.Negative(number("1")),
        tree.Negative(number("2")),
        tree.Negative(number("0.5")),
        tree.Product((number("3"), tree.Reciprocal(number("2")))),
        tree.Product((number("1"), tree.Reciprocal(number("3")))),
        tree.Name("a"),
        tree.Negative(tree.Name("b")),
    ]
)

POWERS = st.sampled_from(["2", "3", "0.5", "1.5", "2.25", "17", "40"]).map(number)


def trees(
    leaves: st.SearchStrategy[tree.Node],
    exponents: st.SearchStrategy[tree.Node] | None = None,
    most: int = 12,
) -> st.SearchStrategy[tree.Node]:
    """Trees of all operations; of powers, those with these exponents only, if there are some."""

    def grown(nodes: st.SearchStrategy[tree.Node]) -> st.SearchStrategy[tree.Node]:
        powers = st.one_of(POWERS, POWERS.map(tree.Negative), nodes) if exponents is None else exponents
        signed = st.one_of(nodes, nodes.map(tree.Negative))
        terms, factors = (
            st.lists(members, min_size=2, max_size=4).map(tuple)
            for members in (signed, st.one_of(signed, nodes.map(tree.Reciprocal)))
        )
        unary = [name for name, function in words.FUNCTIONS.items() if function.arity == 1]
        return st.one_of(
            nodes.map(tree.Negative),
            nodes.map(tree.Reciprocal),
            terms.map(tree.Sum),
            factors.map(tree.Product),
            st.builds(tree.Power, nodes, powers),
            st.builds(lambda name, node: tree.Call(name, (node,)), st.sampled_from(unary), nodes),
            st.tuples(nodes, nodes).map(lambda both: tree.Call("atan2", both)),
        )

    return st.recursive(leaves, grown, max_leaves=most)


TREES = trees(LEAVES, EXPONENTS, most=9)
"""Trees with the powers that the algebra has rules for."""


def expression(words: str) -> Expr:
    """The exact expression of a text."""
    return from_tree(read(words)[0])


def written(e: Expr) -> str:
    """The text of an exact expression."""
    return text(to_tree(e))


def matrix(*rows: str) -> list[list[Expr]]:
    """A matrix by its rows, the entries parted by commas."""
    return [[expression(entry) for entry in row.split(",")] for row in rows]
