"""Exact expressions as trees of the expression language, in the order in which people write them.

Trees lead to all else that expressions become outside of the algebra: text, LaTeX, numbers, those of sympy. A
`Style` writes the order of terms, sums as they were typed, and decimals for fractions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import TypeAlias

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol, Terms, in_order
from rigidcli.algebra.bounds import Rational, content, magnitude
from rigidcli.language import tree
from rigidcli.language.text import text


def to_tree(e: Terms) -> tree.Node:
    """The tree of an expression: positive terms first, denominators gathered in one."""
    if not e.terms:
        return _number("0")
    terms = [_term(monomial, coefficient) for monomial, coefficient in e.ordered]
    for place, term in enumerate(terms):
        if not isinstance(term, tree.Negative):
            terms.insert(0, terms.pop(place))
            break
    flat = [inner for term in terms for inner in (term.terms if isinstance(term, tree.Sum) else [term])]
    return flat[0] if len(flat) == 1 else tree.Sum(tuple(flat))


@lru_cache(4096)
def plain_tree(e: Terms) -> tree.Node:
    """The tree of an expression term by term, for values alone: it looks for no shorter way to write it."""
    terms = list[tree.Node]()
    for monomial, coefficient in e.terms.items():
        sides = list[tree.Node](), list[tree.Node]()
        for atom, exponent in monomial:
            sides[exponent < 0].append(_power(_atom(atom, plain_tree), magnitude(exponent)))
        terms.append(_fraction(coefficient, *sides))
    return tree.Sum(tuple(terms)) if len(terms) > 1 else terms[0] if terms else _number("0")


def _fraction(coefficient: Rational, above: list[tree.Node], below: list[tree.Node]) -> tree.Node:
    term = _quotient(str(abs(coefficient.numerator)), str(coefficient.denominator), above, below)
    return tree.Negative(term) if coefficient < 0 else term


def _quotient(over: str, under: str, above: list[tree.Node], below: list[tree.Node]) -> tree.Node:
    """A product over another one, each with a number before it that is not 1."""
    if over != "1" or not above:
        above.insert(0, _number(over))
    if under != "1":
        below.insert(0, _number(under))
    if below:
        above.append(tree.Reciprocal(_product(below)))
    return _product(above)


def _number(text: str) -> tree.Number:
    return tree.Number(text, float(text))


@lru_cache(4096)
def _term(monomial: Monomial, coefficient: Rational) -> tree.Node:
    """A term; what divides a sum is written inside it where that is shorter."""
    best = _written(monomial, coefficient)
    for way in _moved_inside(monomial):
        # Further sums of the product follow from there.
        other = _term(way, coefficient)
        if len(text(other)) < len(text(best)):
            best = other
    return best


def _moved_inside(monomial: Monomial) -> Iterator[Monomial]:
    """The same product with divisors taken into a sum that has them in some terms: (c p + q)^2/c^2."""
    for atom, n in monomial:
        if not isinstance(atom, Group) or not atom.plain or n < 1 or n.denominator != 1:
            continue
        divisors = ((a, -k / Fraction(n)) for a, k in monomial if k < 0)
        moved = {a: power for a, k in divisors if (power := _power_inside(atom, n, a, k))}
        if moved and (atom.has_rates or all(any(a in moved for a, _ in term) for term in atom.inner.terms)):
            inner = Terms({_multiplied(term, moved): c for term, c in atom.inner.terms.items()})
            outside = dict(_multiplied(monomial, {a: -n * power for a, power in moved.items()}))
            del outside[atom]
            yield in_order([*outside.items(), (Group(inner, plain=True), n)])


def _power_inside(group: Group[Terms], n: Rational, divisor: Atom, k: Rational) -> Rational:
    """The power of a divisor that comes into the n-th power of a sum, which is divided by the n k-th.

    A sum that is linear in momenta takes in what stands at a momentum, which may be left by itself. Others
    take in sums and functions, but never if kinetic energy and potential came into one sum by this, and
    without momenta only where each term loses one.
    """
    degrees = {term: _degree(term) for term in group.inner.terms}
    is_linear = 1 in degrees.values() and {*degrees.values()} <= {0, 1}
    powers = {dict(term).get(divisor, 0) for term, degree in degrees.items() if degree or not is_linear} - {0}
    if is_linear:
        return -min(powers) if powers and 0 < min(powers) <= k else 0
    is_mixed = len({degree > 0 for degree in degrees.values()}) > 1
    return 0 if n > 1 or is_mixed or not powers or isinstance(divisor, Symbol) else -k


def _degree(term: Monomial) -> Rational:
    rates = (n for atom, n in term if isinstance(atom, Symbol) and atom.is_rate)
    return sum(rates) + sum(2 for atom, _ in term if isinstance(atom, Group) and atom.has_rates)


def _multiplied(monomial: Monomial, powers: Mapping[Atom, Rational]) -> Monomial:
    exponents = dict(monomial)
    for atom, n in powers.items():
        exponents[atom] = exponents.get(atom, 0) + n
    return in_order((atom, n) for atom, n in exponents.items() if n)


def _written(monomial: Monomial, coefficient: Rational) -> tree.Node:
    monomial = _under_one_root(monomial)
    above, below, surds = list[tree.Node](), list[tree.Node](), dict[Rational, int]()
    negative = coefficient < 0
    turned = _turned(monomial) if negative else None
    for atom, exponent in monomial:
        if isinstance(atom, Surd):
            surds[exponent] = surds.get(exponent, 1) * atom.value
            continue
        share, coefficient = _taken_out(atom, exponent, coefficient)
        if isinstance(atom, Group) and not atom.plain and exponent in surds:
            surd = surds.pop(exponent)  # sqrt(2)*sqrt(x/y) is sqrt(2*x/y), and half of it sqrt(x/(2*y))
            divides = exponent == Fraction(1, 2) and coefficient.denominator % surd == 0
            coefficient *= surd if divides else 1
            base = to_tree(_times(atom.inner, 1 / Fraction(surd) if divides else surd))
        elif isinstance(atom, Group) and share != 1:
            base = to_tree(_times(atom.inner, 1 / Fraction(share)))
        else:
            base = _atom(atom)
        if isinstance(atom, Group) and atom is turned:
            base, negative = to_tree(_times(atom.inner, -1 / Fraction(share))), False
        (above if exponent > 0 else below).append(_power(base, magnitude(exponent)))
    above[:0] = [_power(_number(str(value)), exponent) for exponent, value in surds.items()]
    size = magnitude(coefficient)
    return _fraction(-size if negative else size, above, below)


def _under_one_root(monomial: Monomial) -> Monomial:
    """The same product, with one root of all that is under square roots: sqrt(k)/sqrt(m) is sqrt(k/m)."""
    roots = {a: n for a, n in monomial if abs(n) == Fraction(1, 2) and not isinstance(a, (Surd, Pi))}
    inside: dict[Atom, Rational] = {}
    kept = [(a, n) for a, n in monomial if a not in roots]
    for a, n in roots.items():
        if not isinstance(a, Group) or len(a.inner.terms) > 1:
            inside[a] = inside.get(a, 0) + 2 * n
        elif n > 0 and [*a.inner.terms.values()] == [1]:
            inside = dict(_multiplied(tuple(inside.items()), dict(*a.inner.terms)))
        else:
            kept.append((a, n))
    if len(roots) - sum(a in roots for a, _ in kept) < 2:
        return monomial
    root = Group(Terms({in_order(inside.items()): 1}), plain=False)
    return in_order([*kept, (root, Fraction(1, 2))])


def _times(e: Terms, factor: Rational) -> Terms:
    return Terms({monomial: coefficient * factor for monomial, coefficient in e.terms.items()})


def _taken_out(atom: Atom, exponent: Rational, coefficient: Rational) -> tuple[Rational, Rational]:
    """The factor to take out of a sum below its power, and the coefficient with it."""
    share = _share(atom, abs(exponent) == 1)
    if share == 1 or exponent.denominator > 2:
        return 1, coefficient
    if exponent.denominator == 1:
        return share, coefficient * Fraction(share) ** int(exponent)
    above, below = math.isqrt(share.numerator), math.isqrt(share.denominator)
    if above**2 != share.numerator or below**2 != share.denominator:
        return 1, coefficient
    return share, coefficient * Fraction(above, below) ** exponent.numerator


@lru_cache(4096)
def _share(atom: Atom, is_alone: bool) -> Rational:
    """The number taken out of a sum so that its momentum or velocity has the coefficient 1: 2 (p + q*B/2).

    With several momenta this is done only for one that has no other factor, where all other numbers are 1:
    2 p_y + x p_z becomes p_y + x p_z/2 under a square, but not where the sum `is_alone`, without a power.
    Otherwise it is the common number of all terms as they are written: 4 of 4 (p + q*B/2)^2 + 4 m^2.
    """
    if not isinstance(atom, Group) or not atom.has_rates:
        return 1
    moving = [
        (monomial, coefficient)
        for monomial, coefficient in atom.inner.terms.items()
        if any(not isinstance(part, Symbol) or part.is_rate for part, _ in monomial)
    ]
    alone = [(m, c) for m, c in moving if len(m) == 1 and m[0][1] == 1]
    others = {magnitude(c) for m, c in atom.inner.terms.items() if (m, c) not in alone}
    if len(alone) == 1 and (len(moving) == 1 or (others == {1} and not is_alone)):
        return magnitude(alone[0][1]) if atom.plain else 1
    return content([_as_written(monomial, c) for monomial, c in atom.inner.terms.items()])


def _as_written(monomial: Monomial, coefficient: Rational) -> Rational:
    """The coefficient that a term shows after numbers have been taken out of its sums."""
    for atom, exponent in monomial:
        coefficient = _taken_out(atom, exponent, coefficient)[1]
    return coefficient


def _turned(monomial: Monomial) -> Atom | None:
    """The sum that takes in a minus sign, above the fraction bar if one does.

    It has terms of both signs: -(a - b) is written b - a, and -1/(a - b) is 1/(b - a), but -(a + b) stays.
    """
    mixed = {
        atom: n
        for atom, n in monomial
        if isinstance(atom, Group) and atom.plain and n % 2 == 1 and min(atom.inner.terms.values()) < 0
    }
    return next((atom for atom, n in mixed.items() if n > 0), next(iter(mixed), None))


def _product(factors: list[tree.Node]) -> tree.Node:
    return factors[0] if len(factors) == 1 else tree.Product(tuple(factors))


def _atom(atom: Atom, written: Callable[[Terms], tree.Node] = to_tree) -> tree.Node:
    match atom:
        case Symbol(name=name):
            return tree.Name(name)
        case Surd(value=value):
            return _number(str(value))
        case Group(inner=inner):
            return written(inner)
        case Applied(function="pow", arguments=(base, exponent)):
            return tree.Power(written(base), written(exponent))
        case Applied(function=function, arguments=arguments):
            return tree.Call(function, tuple(map(written, arguments)))
        case Pi():
            return tree.Constant("pi")
        case _:
            raise AssertionError(atom)


def _power(base: tree.Node, exponent: Rational) -> tree.Node:
    if exponent == 1:
        return base
    if exponent == Fraction(1, 2):
        return tree.Call("sqrt", (base,))
    return tree.Power(base, _term((), exponent))


# --- the style in which people have typed


@dataclass(frozen=True, slots=True)
class Style:
    """How trees of exact arithmetic are written.

    With `decimal`, fractions that end are decimals. A sum that stands first in a pair of `sums` is written as
    the second, R + r as r + R. Where this has the other sign, that is done under even powers only:
    (R - r)**2 is written (r - R)**2. Other sums are written in the order of the `coordinates`.
    """

    decimal: bool = False
    sums: tuple[tuple[tree.Sum, tree.Sum], ...] = ()
    coordinates: tuple[str, ...] = ()

    def of(self, node: tree.Node) -> tree.Node:
        """The tree as it is to be written."""
        if self.sums:
            typed = {frozenset(sum_.terms): sum_ for _, sum_ in self.sums}
            node = _ordered(node, dict(self.sums), typed)
        if self.coordinates:
            variables, kept = _variables(self.coordinates), {sum_ for _, sum_ in self.sums}
            node = _by_coordinates(node, variables, kept)
            node = _from_coordinates(node, variables, kept.union(_without_even_power(node)))
        return _in_decimals(node) if self.decimal else node


def _ordered(
    node: tree.Node, squared: Mapping[tree.Sum, tree.Sum], typed: Mapping[frozenset[tree.Node], tree.Sum]
) -> tree.Node:
    """A tree with the sums as they are `typed`, by their terms; under even powers by their squares, too."""
    match node:
        case tree.Power(tree.Sum() as base, exponent) if is_even(exponent):
            node = tree.Power(squared.get(base, base), exponent)
        case tree.Sum(terms):
            node = typed.get(frozenset(terms), node)
    return tree.rebuilt(node, lambda operand: _ordered(operand, squared, typed))


def is_even(exponent: tree.Node) -> bool:
    """Whether it is an even number."""
    return isinstance(exponent, tree.Number) and exponent.value % 2 == 0


_Variables: TypeAlias = Mapping[str, tuple[int, float]]  # coordinate number and degree by name

# Products of coordinates are of lower degree than a velocity, and those of velocities than an acceleration.
OF_COORDINATE, OF_VELOCITY, OF_ACCELERATION = 0.001, 1, 100


@lru_cache(1)
def _variables(coordinates: tuple[str, ...]) -> _Variables:
    degrees = {"{}": OF_COORDINATE, "p_{}": OF_VELOCITY, "{}dot": OF_VELOCITY, "{}ddot": OF_ACCELERATION}
    return {form.format(q): (k, n) for form, n in degrees.items() for k, q in enumerate(coordinates)}


def _by_coordinates(node: tree.Node, variables: _Variables, typed: Collection[tree.Sum]) -> tree.Node:
    """A tree with the terms of its sums by falling degree in the variables; `typed` sums stay.

    Of one degree, terms without functions come first, then those of earlier coordinates. A sum does not begin
    with a minus sign if a term is positive, but for that of an acceleration. Velocities and momenta in a
    product stand in the order of their coordinates.
    """
    node = tree.rebuilt(node, lambda operand: _by_coordinates(operand, variables, typed))
    match node:
        case tree.Sum(terms) if node not in typed:
            ordered = sorted(terms, key=lambda term: _place(term, variables))
            has_acceleration = _degree_in(ordered[0], variables)[0] >= OF_ACCELERATION
            return tree.Sum(tuple(ordered)) if has_acceleration else _from_positive(ordered)
        case tree.Product(factors):
            places = [_rate(factor, variables) for factor in factors]
            moving = [k for k, place in enumerate(places) if place is not None]
            following = iter(sorted(moving, key=lambda k: places[k] or ()))
            return tree.Product(
                tuple(factors[next(following)] if k in moving else f for k, f in enumerate(factors))
            )
    return node


def _from_positive(terms: list[tree.Node]) -> tree.Sum:
    first = next((k for k, term in enumerate(terms) if not isinstance(term, tree.Negative)), 0)
    return tree.Sum((terms.pop(first), *terms))


def _from_coordinates(
    node: tree.Node, variables: _Variables, kept: Collection[tree.Sum], around: Collection[tree.Node] = ()
) -> tree.Node:
    """A tree with (x - d)^2 for (d - x)^2, where x is a coordinate; sums that are `kept` stay.

    A square whose negative terms stand in the sum around it takes their signs: a - b - sqrt((a - b)^2 - c).
    """
    match node:
        case tree.Power(tree.Sum(terms) as base, exponent) if is_even(exponent) and base not in kept:
            ordered = sorted(terms, key=lambda term: _place(term, variables))
            is_turned = isinstance(ordered[0], tree.Negative) and _degree_in(base, variables)[0] < OF_VELOCITY
            if is_turned or all(-term in around for term in terms):
                return tree.Power(_from_positive([-term for term in ordered]), exponent)
        case tree.Sum(terms):
            around = {*around, *terms}
    return tree.rebuilt(node, lambda operand: _from_coordinates(operand, variables, kept, around))


def _without_even_power(node: tree.Node) -> Iterator[tree.Sum]:
    """The sums in a tree that do not stand right under an even power."""
    if isinstance(node, tree.Power) and is_even(node.exponent):
        node = node.base
    elif isinstance(node, tree.Sum):
        yield node
    for operand in tree.operands(node):
        yield from _without_even_power(operand)


def _rate(factor: tree.Node, variables: _Variables) -> tuple[float, int] | None:
    """Where a factor stands that is a power of a velocity, momentum or acceleration; None of others."""
    base = factor.base if isinstance(factor, tree.Power) else factor
    place, degree = variables.get(base.name, (0, 0)) if isinstance(base, tree.Name) else (0, 0)
    return (-degree, place) if degree >= OF_VELOCITY else None


def _place(term: tree.Node, variables: _Variables) -> tuple[float, bool, float, float]:
    degree, first, last = _degree_in(term, variables)
    return -degree, _has_function(term), first, last


def _degree_in(node: tree.Node, variables: _Variables) -> tuple[float, float, float]:
    """The degree of a tree in velocities and momenta, and the first and last of their coordinates.

    They are those of coordinates where there is no velocity or momentum. Divisors do not count, nor do
    coordinates beside velocities.
    """
    match node:
        case tree.Name(name) if name in variables:
            place, weight = variables[name]
            return weight, place, place
        case tree.Negative(operand):
            return _degree_in(operand, variables)
        case tree.Call("sqrt", (operand,)):
            degree, first, last = _degree_in(operand, variables)
            return degree / 2, first, last
        case tree.Power(base, tree.Number(value=exponent)):
            degree, first, last = _degree_in(base, variables)
            return degree * exponent, first, last
        case tree.Sum(members) | tree.Product(members):
            parts = [_degree_in(member, variables) for member in members]
            moving = [part for part in parts if part[0] >= OF_VELOCITY / 2] or parts
            degrees, firsts, lasts = zip(*moving, strict=True)
            return (max if isinstance(node, tree.Sum) else sum)(degrees), min(firsts), max(lasts)
    return 0, math.inf, -math.inf


def _has_function(node: tree.Node) -> bool:
    """Whether a factor of a term is a function other than a root."""
    match node:
        case tree.Negative(inner) | tree.Reciprocal(inner) | tree.Power(inner, _):
            return _has_function(inner)
        case tree.Product(factors):
            return any(map(_has_function, factors))
        case tree.Call(function, _):
            return function != "sqrt"
    return False


MOST_DIGITS = 15  # the most digits of a coefficient: a float holds so many, and nobody types more


def _in_decimals(node: tree.Node) -> tree.Node:
    """A tree of exact arithmetic with decimals for its fractions, where these end: x/0.74 for 50 x/37.

    Halves, quarters and the like with numerator one stay fractions, and so do 2/3, 4/3, and exponents.
    """
    match node:
        case tree.Power(base, exponent):
            return tree.Power(_in_decimals(base), exponent)
        case tree.Product(factors):
            return _product_in_decimals([_in_decimals(factor) for factor in factors])
        case _:
            return tree.rebuilt(node, _in_decimals)


def _product_in_decimals(factors: list[tree.Node]) -> tree.Node:
    """A product with its number, which stands first, and its denominator, which stands last, in decimals."""
    above, below = list(factors), list[tree.Node]()
    if isinstance(last := above[-1], tree.Reciprocal):
        above.pop()
        below = list(last.operand.factors if isinstance(last.operand, tree.Product) else [last.operand])
    ratio = _taken(above) / _taken(below)
    if decimal := _digits(ratio):
        over, under = decimal, "1"
    elif ratio.numerator % 5 == 0 and (decimal := _digits(1 / ratio)):
        over, under = "1", decimal
    else:
        over, under = str(ratio.numerator), str(ratio.denominator)
    return _quotient(over, under, above, below)


def _taken(factors: list[tree.Node]) -> Fraction:
    if not factors or not isinstance(first := factors[0], tree.Number):
        return Fraction(1)
    del factors[0]
    return Fraction(first.text)


def _digits(ratio: Fraction) -> str | None:
    """The ratio as a decimal; None where that has no end, and for 1/2, 1/4 and the like."""
    denominator = ratio.denominator
    if ratio.numerator == 1 and denominator & (denominator - 1) == 0 and denominator > 1:
        return None
    value = Decimal(ratio.numerator) / Decimal(denominator)
    if len(value.as_tuple().digits) > MOST_DIGITS:
        value = value.normalize()  # without the zeros at the end
    ends = Fraction(value) == ratio and len(value.as_tuple().digits) <= MOST_DIGITS
    return str(value).lower().replace("e+", "e") if ends else None
