"""Exact expressions multiplied out, and their coefficients as polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Symbol, key_of_atom
from rigidcli.algebra.expressions import ONE, Expr, gathered, multiplied, number, power, product, total
from rigidcli.algebra.roots import Rational, bounded
from rigidcli.algebra.substitution import rebuilt


def expand(e: Expr, allowance: Allowance | None = None) -> Expr:
    """Everything multiplied out that stands in a product or under a natural power, at any depth.

    Raises:
        ExpressionError: the result is too large.
    """
    steps = allowance or Allowance()

    def of(e: Expr) -> Expr:
        if all(isinstance(atom, Symbol) for atom in e.atoms):
            return e
        return total([of_term(monomial, coefficient) for monomial, coefficient in e.terms.items()])

    @cache
    def of_atom(atom: Atom) -> Expr:
        return rebuilt(atom, of)

    def of_term(monomial: Monomial, coefficient: Rational) -> Expr:
        steps.spend(1 + len(monomial))
        sums = []
        others = [number(coefficient)]
        for atom, exponent in monomial:
            base = of_atom(atom)
            if len(base.terms) > 1 and exponent.denominator == 1 and exponent > 0:
                steps.spend(int(exponent))
                sums.extend([base] * int(exponent))
            else:
                others.append(power(base, exponent))
        result = product(others)
        if len(result.terms) > 1 and sums:
            sums.append(result)
            result = ONE
        for factor in sums:
            result = _times(result, factor, steps)
        if any(_is_open(atom, exponent) for inner in result.terms for atom, exponent in inner):
            return of(result)
        return result

    return of(e)


def _times(left: Expr, right: Expr, allowance: Allowance) -> Expr:
    """The product of two sums, term by term."""
    weight = 2 + max(map(len, left.terms), default=0) + max(map(len, right.terms), default=0)
    allowance.spend(len(left.terms) * len(right.terms) * weight)
    if not (_is_settled(left) and _is_settled(right)):
        return total(
            multiplied(first, second, a * b)
            for first, a in left.terms.items()
            for second, b in right.terms.items()
        )
    terms: dict[Monomial, Rational] = {}
    for first, a in left.terms.items():
        for second, b in right.terms.items():
            exponents = dict(first)
            for atom, exponent in second:
                exponents[atom] = exponents.get(atom, 0) + exponent
            factors = [factor for factor in exponents.items() if factor[1]]
            factors.sort(key=key_of_atom)
            monomial = tuple(factors)
            terms[monomial] = terms.get(monomial, 0) + a * b
    return total([Expr({monomial: bounded(c) for monomial, c in terms.items() if c})])


def _is_settled(e: Expr) -> bool:
    """Whether powers of its atoms never come to anything simpler."""
    return all(isinstance(atom, (Symbol, Pi)) or _is_smooth(atom) for atom in e.atoms)


def _is_smooth(atom: Atom) -> bool:
    return isinstance(atom, Applied) and atom.function != "abs"


def _is_open(atom: Atom, exponent: Rational) -> bool:
    return isinstance(atom, Group) and atom.plain and exponent.denominator == 1 and exponent > 0


Polynomial: TypeAlias = dict[tuple[int, ...], Expr]
"""Coefficients by the exponents of some symbols."""

_STEPS_TO_MULTIPLY = 10
"""Steps for the product of two coefficients, which is a sum of products itself."""


def coefficients(e: Expr, names: Sequence[str]) -> Polynomial | None:
    """The coefficients as a polynomial in some symbols, by the exponents of these; None if it is none.

    Only what holds the symbols is multiplied out.

    Raises:
        ExpressionError: the polynomial has too many terms.
    """
    places = {name: place for place, name in enumerate(names)}
    return _polynomial(e, places, Allowance())


def _polynomial(e: Expr, places: Mapping[str, int], allowance: Allowance) -> Polynomial | None:
    names = places.keys()
    constant = (0,) * len(places)
    if e.names.isdisjoint(names):
        return {constant: e} if e.terms else {}
    gathered_terms: dict[tuple[int, ...], list[Expr]] = {}
    for monomial, coefficient in e.terms.items():
        powers = list(constant)
        kept: dict[Atom, Rational] = {}
        groups: list[Polynomial] = []
        for atom, exponent in monomial:
            if atom.names.isdisjoint(names):
                kept[atom] = exponent
                continue
            if exponent.denominator != 1 or exponent < 0:
                return None
            if isinstance(atom, Symbol):
                powers[places[atom.name]] += int(exponent)
                continue
            inner = _polynomial(atom.inner, places, allowance) if isinstance(atom, Group) else None
            if inner is None:
                return None
            allowance.spend(int(exponent))
            groups.extend([inner] * int(exponent))
        part = {tuple(powers): gathered(coefficient, kept)}
        for factor in groups:
            size = sum(len(value.terms) for value in part.values())
            allowance.spend(_STEPS_TO_MULTIPLY * size * len(factor))
            part = _multiplied(part, factor)
        for exponents, value in part.items():
            gathered_terms.setdefault(exponents, []).append(value)
    return _totals(gathered_terms)


def _multiplied(left: Polynomial, right: Polynomial) -> Polynomial:
    parts: dict[tuple[int, ...], list[Expr]] = {}
    for first, a in left.items():
        for second, b in right.items():
            parts.setdefault(tuple(map(sum, zip(first, second, strict=True))), []).append(a * b)
    return _totals(parts)


def _totals(parts: Mapping[tuple[int, ...], Sequence[Expr]]) -> Polynomial:
    sums = {exponents: total(values) for exponents, values in parts.items()}
    return {exponents: value for exponents, value in sums.items() if value.terms}
