"""How results of exact arithmetic are written: the order of terms, typed sums, decimals for fractions."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import TypeAlias

from rigidcli.language.tree import (
    Call,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
    operands,
    rebuilt,
)


@dataclass(frozen=True, slots=True)
class Style:
    """How trees of exact arithmetic are written.

    With `decimal`, fractions that end are decimals. A sum that stands first in a pair of `sums` is written as
    the second, R + r as r + R. Where this has the other sign, that is done under even powers only:
    (R - r)**2 is written (r - R)**2. Other sums are written in the order of the `coordinates`.
    """

    decimal: bool = False
    sums: tuple[tuple[Sum, Sum], ...] = ()
    coordinates: tuple[str, ...] = ()

    def of(self, node: Node) -> Node:
        """The tree as it is to be written."""
        if self.sums:
            typed = {frozenset(sum_.terms): sum_ for _, sum_ in self.sums}
            node = _ordered(node, dict(self.sums), typed)
        if self.coordinates:
            variables, kept = _variables(self.coordinates), {sum_ for _, sum_ in self.sums}
            node = _by_coordinates(node, variables, kept)
            node = _from_coordinates(node, variables, kept.union(_without_even_power(node)))
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


_Variables: TypeAlias = Mapping[str, tuple[int, float]]
"""The place of the coordinate of each variable, and the degree of it."""

OF_COORDINATE, OF_VELOCITY, OF_ACCELERATION = 0.001, 1, 100
"""The degrees of variables: products of coordinates are below a velocity, and those of velocities below an
acceleration."""


@lru_cache(1)
def _variables(coordinates: tuple[str, ...]) -> _Variables:
    degrees = {"{}": OF_COORDINATE, "p_{}": OF_VELOCITY, "{}dot": OF_VELOCITY, "{}ddot": OF_ACCELERATION}
    return {form.format(q): (k, n) for form, n in degrees.items() for k, q in enumerate(coordinates)}


def _by_coordinates(node: Node, variables: _Variables, typed: Collection[Sum]) -> Node:
    """A tree with the terms of its sums by falling degree in the variables; `typed` sums stay.

    Of one degree, terms without functions come first, then those of earlier coordinates. A sum does not begin
    with a minus sign if a term is positive, but for that of an acceleration. Velocities and momenta in a
    product stand in the order of their coordinates.
    """
    node = rebuilt(node, lambda operand: _by_coordinates(operand, variables, typed))
    match node:
        case Sum(terms) if node not in typed:
            ordered = sorted(terms, key=lambda term: _place(term, variables))
            has_acceleration = _degree(ordered[0], variables)[0] >= OF_ACCELERATION
            return Sum(tuple(ordered)) if has_acceleration else _from_positive(ordered)
        case Product(factors):
            places = [_rate(factor, variables) for factor in factors]
            moving = [k for k, place in enumerate(places) if place is not None]
            following = iter(sorted(moving, key=lambda k: places[k] or ()))
            return Product(
                tuple(factors[next(following)] if k in moving else f for k, f in enumerate(factors))
            )
    return node


def _from_positive(terms: list[Node]) -> Sum:
    """A sum whose first positive term is moved to its head."""
    first = next((k for k, term in enumerate(terms) if not isinstance(term, Negative)), 0)
    return Sum((terms.pop(first), *terms))


def _from_coordinates(
    node: Node, variables: _Variables, kept: Collection[Sum], around: Collection[Node] = ()
) -> Node:
    """A tree with (x - d)^2 for (d - x)^2, where x is a coordinate; sums that are `kept` stay.

    A square whose negative terms stand in the sum around it takes their signs: a - b - sqrt((a - b)^2 - c).
    """
    match node:
        case Power(Sum(terms) as base, exponent) if is_even(exponent) and base not in kept:
            ordered = sorted(terms, key=lambda term: _place(term, variables))
            is_turned = isinstance(ordered[0], Negative) and _degree(base, variables)[0] < OF_VELOCITY
            if is_turned or all(-term in around for term in terms):
                return Power(_from_positive([-term for term in ordered]), exponent)
        case Sum(terms):
            around = {*around, *terms}
    return rebuilt(node, lambda operand: _from_coordinates(operand, variables, kept, around))


def _without_even_power(node: Node) -> Iterator[Sum]:
    """The sums in a tree that do not stand right under an even power."""
    if isinstance(node, Power) and is_even(node.exponent):
        node = node.base
    elif isinstance(node, Sum):
        yield node
    for operand in operands(node):
        yield from _without_even_power(operand)


def _rate(factor: Node, variables: _Variables) -> tuple[float, int] | None:
    """Where a factor stands that is a power of a velocity, momentum or acceleration; None of others."""
    base = factor.base if isinstance(factor, Power) else factor
    place, degree = variables.get(base.name, (0, 0)) if isinstance(base, Name) else (0, 0)
    return (-degree, place) if degree >= OF_VELOCITY else None


def _place(term: Node, variables: _Variables) -> tuple[float, bool, float, float]:
    degree, first, last = _degree(term, variables)
    return -degree, _has_function(term), first, last


def _degree(node: Node, variables: _Variables) -> tuple[float, float, float]:
    """The degree of a tree in velocities and momenta, and the first and last of their coordinates.

    They are those of coordinates where there is no velocity or momentum. Divisors do not count, nor do
    coordinates beside velocities.
    """
    match node:
        case Name(name) if name in variables:
            place, weight = variables[name]
            return weight, place, place
        case Negative(operand):
            return _degree(operand, variables)
        case Call("sqrt", (operand,)):
            degree, first, last = _degree(operand, variables)
            return degree / 2, first, last
        case Power(base, Number(value=exponent)):
            degree, first, last = _degree(base, variables)
            return degree * exponent, first, last
        case Sum(members) | Product(members):
            parts = [_degree(member, variables) for member in members]
            moving = [part for part in parts if part[0] >= OF_VELOCITY / 2] or parts
            degrees, firsts, lasts = zip(*moving, strict=True)
            return (max if isinstance(node, Sum) else sum)(degrees), min(firsts), max(lasts)
    return 0, math.inf, -math.inf


def _has_function(node: Node) -> bool:
    """Whether a factor of a term is a function other than a root."""
    match node:
        case Negative(inner) | Reciprocal(inner) | Power(inner, _):
            return _has_function(inner)
        case Product(factors):
            return any(map(_has_function, factors))
        case Call(function, _):
            return function != "sqrt"
    return False


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
