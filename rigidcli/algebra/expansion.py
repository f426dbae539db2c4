"""Exact expressions multiplied out, and their coefficients as polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    return _Expansion(allowance or Allowance()).of(e)


class _Expansion:
    """The atoms that are known multiplied out, and the steps that may be taken."""

    __slots__ = ("allowance", "known")

    def __init__(self, allowance: Allowance) -> None:
        self.known: dict[Atom, Expr] = {}
        self.allowance = allowance

    def of(self, e: Expr) -> Expr:
        if all(isinstance(atom, Symbol) for atom in e.atoms):
            return e
        return total([self.of_term(monomial, coefficient) for monomial, coefficient in e.terms.items()])

    def of_term(self, monomial: Monomial, coefficient: Rational) -> Expr:
        self.allowance.spend(1 + len(monomial))
        sums = []
        others = [number(coefficient)]
        for atom, exponent in monomial:
            base = self.of_atom(atom)
            if len(base.terms) > 1 and exponent.denominator == 1 and exponent > 0:
                self.allowance.spend(int(exponent))
                sums.extend([base] * int(exponent))
            else:
                others.append(power(base, exponent))
        result = product(others)
        if len(result.terms) > 1 and sums:
            sums.append(result)
            result = ONE
        for factor in sums:
            result = self.times(result, factor)
        if any(_is_open(atom, exponent) for inner in result.terms for atom, exponent in inner):
            return self.of(result)
        return result

    def of_atom(self, atom: Atom) -> Expr:
        if atom not in self.known:
            self.known[atom] = rebuilt(atom, self.of)
        return self.known[atom]

    def times(self, left: Expr, right: Expr) -> Expr:
        weight = 2 + max(map(len, left.terms), default=0) + max(map(len, right.terms), default=0)
        self.allowance.spend(len(left.terms) * len(right.terms) * weight)
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
