"""Exact expressions as trees of the expression language, in the order in which people write them.

Trees lead to all else that expressions become outside of the algebra: text, LaTeX, numbers, those of sympy.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any, Self

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol, Terms, key_of_atom
from rigidcli.algebra.bounds import Rational
from rigidcli.algebra.roots import content, magnitude
from rigidcli.algebra.style import Style
from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.expression import SIGNS, Expression, numbers
from rigidcli.language.text import latex, text
from rigidcli.language.tree import Node, fold


def to_tree(e: Terms) -> tree.Node:
    """The tree of an expression: positive terms first, denominators gathered in one."""
    if not e.terms:
        return _number(0)
    terms = _in_one_sign([_term(monomial, coefficient) for monomial, coefficient in e.ordered], e)
    for place, term in enumerate(terms):
        if not isinstance(term, tree.Negative):
            terms.insert(0, terms.pop(place))
            break
    flat = [inner for term in terms for inner in (term.terms if isinstance(term, tree.Sum) else [term])]
    return flat[0] if len(flat) == 1 else tree.Sum(tuple(flat))


def _in_one_sign(terms: list[tree.Node], e: Terms) -> list[tree.Node]:
    """The terms of a sum, no sum beside its negative: a/(p - q) + b/(q - p) is a/(p - q) - b/(p - q)."""
    turned = [k for k, (_, c) in enumerate(e.ordered) if c < 0 and not isinstance(terms[k], tree.Negative)]
    if turned and any(c > 0 for _, c in e.ordered):
        sums = [{part for part in tree.nodes([term]) if isinstance(part, tree.Sum)} for term in terms]
        for k in turned:
            monomial, coefficient = e.ordered[k]
            opposite = _term(monomial, -coefficient)
            beside = set[tree.Node]().union(*sums[:k], *sums[k + 1 :])
            if not beside.isdisjoint({*tree.nodes([opposite])} - sums[k]):
                terms[k] = -opposite
    return terms


@lru_cache(4096)
def plain_tree(e: Terms) -> tree.Node:
    """The tree of an expression term by term, for values alone: it looks for no shorter way to write it."""
    terms: list[tree.Node] = []
    for monomial, coefficient in e.terms.items():
        sides: tuple[list[tree.Node], list[tree.Node]] = ([], [])
        for atom, exponent in monomial:
            sides[exponent < 0].append(_power(_atom(atom, plain_tree), magnitude(exponent)))
        terms.append(_fraction(coefficient, *sides))
    return tree.Sum(tuple(terms)) if len(terms) > 1 else terms[0] if terms else _number(0)


def _fraction(coefficient: Rational, above: list[tree.Node], below: list[tree.Node]) -> tree.Node:
    """A number times factors above and below the bar."""
    numerator, denominator = abs(coefficient.numerator), coefficient.denominator
    if numerator != 1 or not above:
        above.insert(0, _number(numerator))
    if denominator != 1:
        below.insert(0, _number(denominator))
    if below:
        above.append(tree.Reciprocal(_product(below)))
    term = _product(above)
    return tree.Negative(term) if coefficient < 0 else term


def _number(value: int) -> tree.Number:
    try:
        near = float(value)
    except OverflowError:
        near = math.inf
    return tree.Number(str(value), near)


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
            yield tuple(sorted([*outside.items(), (Group(inner, plain=True), n)], key=key_of_atom))


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
    """The degree of a term in momenta and velocities."""
    rates = (n for atom, n in term if isinstance(atom, Symbol) and atom.is_rate)
    return sum(rates) + sum(2 for atom, _ in term if isinstance(atom, Group) and atom.has_rates)


def _multiplied(monomial: Monomial, powers: Mapping[Atom, Rational]) -> Monomial:
    exponents = dict(monomial)
    for atom, n in powers.items():
        exponents[atom] = exponents.get(atom, 0) + n
    return tuple(sorted(((atom, n) for atom, n in exponents.items() if n), key=key_of_atom))


def _written(monomial: Monomial, coefficient: Rational) -> tree.Node:
    monomial = _under_one_root(monomial)
    above: list[tree.Node] = []
    below: list[tree.Node] = []
    negative = coefficient < 0
    surds: dict[Rational, int] = {}
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
    above[:0] = [_power(_number(value), exponent) for exponent, value in surds.items()]
    size = magnitude(coefficient)
    return _fraction(-size if negative else size, above, below)


def _under_one_root(monomial: Monomial) -> Monomial:
    """The same product, with one root of all that is under square roots: sqrt(k)/sqrt(m) is sqrt(k/m).

    Products that stand under a root already come under the same one.
    """
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
    root = Group(Terms({tuple(sorted(inside.items(), key=key_of_atom)): 1}), plain=False)
    return tuple(sorted([*kept, (root, Fraction(1, 2))], key=key_of_atom))


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
    """The coefficient of a term as it is written, with what its sums leave to it."""
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


def _product(factors: Iterable[tree.Node]) -> tree.Node:
    factors = tuple(factors)
    return factors[0] if len(factors) == 1 else tree.Product(factors)


def _atom(atom: Atom, written: Callable[[Terms], tree.Node] = to_tree) -> tree.Node:
    match atom:
        case Symbol(name=name):
            return tree.Name(name)
        case Surd(value=value):
            return _number(value)
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


PLAIN = Style()
"""Expressions as the algebra orders them, with fractions."""


class Exported(Terms):
    """A sum with its ways out. `expressions.Expr` adds the arithmetic."""

    style: Style = PLAIN
    """How it is written. Equal expressions may have different styles."""

    def __str__(self) -> str:
        return _text(self, self.style)

    __repr__ = __str__

    def _repr_latex_(self) -> str:
        return f"${latex(self.tree())}$"

    def tree(self, digits: int | None = None) -> Node:
        """The tree in which it is written, exact for any number of digits."""
        return self.style.of(to_tree(self))

    def styled(self, style: Style) -> Self:
        """The same expression, written in a style."""
        written = type(self)(self.terms)
        written.style = style
        return written

    def __float__(self) -> float:
        """Raises ExpressionError where a symbol is in it, or the value is too large."""
        known = self.as_number
        try:
            return float(self.evaluate() if known is None else known)
        except OverflowError as error:
            raise ExpressionError("the value is too large") from error

    def evaluate(self, **values: Any) -> Any:
        """The value where the symbols have these values: a float, or an array as soon as one of these is.

        Raises:
            ExpressionError: a symbol has no value, or numbers lead to no finite real value.
        """
        import numpy as np

        arrays = {name: np.asarray(value) if np.ndim(value) else value for name, value in values.items()}
        return Expression("", to_tree(self), self.names).evaluate(arrays)

    def to_sympy(self) -> Any:
        """The same as an expression of sympy, which must be installed. Its symbols are real or positive."""
        import sympy

        positive = {atom.name for atom in self.everywhere() if isinstance(atom, Symbol) and atom.positive}

        def called(function: str, values: list[Any]) -> Any:
            if not isinstance(function, tree.UnknownFunction):
                return getattr(sympy, "Abs" if function == "abs" else function)(*values)
            places = sympy.symbols(f"x:{len(values)}", cls=sympy.Dummy)
            slope = sympy.Function(function.base)(*places).diff(*(places[k] for k in function.by))
            return sympy.Subs(slope, places, values).doit()

        kind = numbers(
            number=lambda text, value: sympy.pi if text == "pi" else sympy.Rational(text),
            power=operator.pow,
            call=called,
            joined=lambda left, sign, right: SIGNS[sign](int(left) if left in (0.0, 1.0) else left, right),
        )
        return fold(to_tree(self), lambda n: sympy.Symbol(n, real=True, positive=n in positive or None), kind)

    _sympy_ = to_sympy  # by this name sympy's own functions take it


@lru_cache
def _text(e: Exported, style: Style) -> str:
    """The text of an expression; the style tells apart equal ones that are written in two ways.

    Results of one system at many values of its parameters have the same texts.
    """
    return text(e.tree())
