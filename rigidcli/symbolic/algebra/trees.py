"""Exact expressions as trees of the expression language, in the order in which people write them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

from rigidcli.symbolic.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol, Terms
from rigidcli.symbolic.algebra.roots import Rational, magnitude
from rigidcli.symbolic.language.tree import (
    Call,
    Constant,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
)


def to_tree(e: Terms) -> Node:
    """The tree of an expression: positive terms first, denominators gathered in one."""
    if not e.terms:
        return _number(0)
    terms = [_term(monomial, coefficient) for monomial, coefficient in e.ordered]
    for place, term in enumerate(terms):
        if not isinstance(term, Negative):
            terms.insert(0, terms.pop(place))
            break
    return terms[0] if len(terms) == 1 else Sum(tuple(terms))


def _number(value: int) -> Number:
    try:
        near = float(value)
    except OverflowError:
        near = math.inf
    return Number(str(value), near)


def _term(monomial: Monomial, coefficient: Rational) -> Node:
    above: list[Node] = []
    below: list[Node] = []
    negative = coefficient < 0
    surds: dict[Rational, int] = {}
    for atom, exponent in monomial:
        if isinstance(atom, Surd):
            surds[exponent] = surds.get(exponent, 1) * atom.value
            continue
        share = _share(atom) if exponent.denominator == 1 else 1
        coefficient *= Fraction(share) ** int(exponent) if share != 1 else 1
        if isinstance(atom, Group) and not atom.plain and exponent in surds:
            base = to_tree(_times(atom.inner, surds.pop(exponent)))  # sqrt(2)*sqrt(x/y) is sqrt(2*x/y)
        elif isinstance(atom, Group) and share != 1:
            base = to_tree(_times(atom.inner, 1 / Fraction(share)))
        else:
            base = _atom(atom)
        if negative and exponent > 0 and exponent % 2 == 1 and isinstance(atom, Group) and _is_mixed(atom):
            base, negative = to_tree(_times(atom.inner, -1 / Fraction(share))), False
        (above if exponent > 0 else below).append(_power(base, magnitude(exponent)))
    above[:0] = [_power(_number(value), exponent) for exponent, value in surds.items()]
    numerator, denominator = abs(coefficient.numerator), coefficient.denominator
    if numerator != 1 or not above:
        above.insert(0, _number(numerator))
    if denominator != 1:
        below.insert(0, _number(denominator))
    if below:
        above.append(Reciprocal(_product(below)))
    term = _product(above)
    return Negative(term) if negative else term


def _times(e: Terms, factor: Rational) -> Terms:
    return Terms({monomial: coefficient * factor for monomial, coefficient in e.terms.items()})


def _share(atom: Atom) -> Rational:
    """The factor to take out of a sum for its one momentum or velocity to stand by itself: p + q*B/2."""
    if not isinstance(atom, Group) or not atom.plain or not atom.has_rates:
        return 1
    moving = [
        (monomial, coefficient)
        for monomial, coefficient in atom.inner.terms.items()
        if any(not isinstance(part, Symbol) or part.is_rate for part, _ in monomial)
    ]
    if len(moving) == 1 and len(moving[0][0]) == 1 and moving[0][0][0][1] == 1:
        return magnitude(moving[0][1])
    return 1


def _is_mixed(group: Group[Terms]) -> bool:
    """Whether a sum has terms of both signs: -(a - b) is written b - a, but -(a + b) stays."""
    return group.plain and any(coefficient < 0 for coefficient in group.inner.terms.values())


def _product(factors: Iterable[Node]) -> Node:
    factors = tuple(factors)
    return factors[0] if len(factors) == 1 else Product(factors)


def _atom(atom: Atom) -> Node:
    match atom:
        case Symbol(name=name):
            return Name(name)
        case Surd(value=value):
            return _number(value)
        case Group(inner=inner):
            return to_tree(inner)
        case Applied(function="pow", arguments=(base, exponent)):
            return Power(to_tree(base), to_tree(exponent))
        case Applied(function=function, arguments=arguments):
            return Call(function, tuple(to_tree(argument) for argument in arguments))
        case Pi():
            return Constant("pi")
        case _:
            raise AssertionError(atom)


def _power(base: Node, exponent: Rational) -> Node:
    """A positive power."""
    if exponent == 1:
        return base
    if exponent == Fraction(1, 2):
        return Call("sqrt", (base,))
    return Power(base, _term((), exponent))
