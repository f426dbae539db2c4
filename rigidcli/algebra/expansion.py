"""Exact expressions multiplied out, and their coefficients as polynomials."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import TypeAlias, TypeGuard

from rigidcli.algebra.atoms import Atom, Group, Monomial, Symbol
from rigidcli.algebra.bounds import Allowance, Rational
from rigidcli.algebra.expressions import ONE, ZERO, Expr, gathered, multiplied, number, power, product, total
from rigidcli.algebra.substitution import rebuilt


def expand(e: Expr, allowance: Allowance | None = None, holding: frozenset[str] | None = None) -> Expr:
    """Everything multiplied out that stands in a product or under a natural power, at any depth.

    With names, only the sums `holding` one of them are.
    """
    steps = allowance or Allowance()

    def is_kept(part: Expr | Atom) -> bool:
        return holding is not None and holding.isdisjoint(part.names)

    def of(e: Expr) -> Expr:
        if is_kept(e) or all(isinstance(atom, Symbol) for atom in e.atoms):
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
            if len(base.terms) > 1 and _is_natural(exponent) and not is_kept(atom):
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
        factors = (factor for inner in result.terms for factor in inner)
        if any(isinstance(a, Group) and a.plain and _is_natural(n) and not is_kept(a) for a, n in factors):
            return of(result)
        return result

    return of(e)


def _times(left: Expr, right: Expr, allowance: Allowance) -> Expr:
    weight = 2 + max(map(len, left.terms), default=0) + max(map(len, right.terms), default=0)
    allowance.spend(len(left.terms) * len(right.terms) * weight)
    return total(
        multiplied(first, second, a * b)
        for first, a in left.terms.items()
        for second, b in right.terms.items()
    )


def _is_natural(exponent: Rational) -> bool:
    return exponent.denominator == 1 and exponent > 0


def free_of(names: Iterable[str], e: Expr) -> Expr:
    """The terms of a sum that hold none of these names."""
    known = frozenset(names)
    return Expr({m: c for m, c in e.terms.items() if all(known.isdisjoint(a.names) for a, _ in m)})


Polynomial: TypeAlias = dict[tuple[int, ...], Expr]  # coefficients by the exponents of some symbols


def coefficients(e: Expr, names: Sequence[str]) -> Polynomial | None:
    """The coefficients as a polynomial in some symbols, by the exponents of these; None if it is none.

    Only what holds the symbols is multiplied out.
    """
    variables, parts = frozenset(names), dict[tuple[int, ...], list[Expr]]()
    for monomial, c in expand(e, holding=variables).terms.items():
        powers = {atom.name: n for atom, n in monomial if isinstance(atom, Symbol) and atom.name in variables}
        kept = {atom: n for atom, n in monomial if atom.names.isdisjoint(variables)}
        if len(powers) + len(kept) < len(monomial) or not all(map(_is_natural, powers.values())):
            return None
        exponents = tuple(int(powers.get(name, 0)) for name in names)
        parts.setdefault(exponents, []).append(gathered(c, kept))
    sums = {exponents: total(values) for exponents, values in parts.items()}
    return {exponents: value for exponents, value in sums.items() if value.terms}


def polynomial_sum(polynomial: Polynomial, variables: Sequence[Expr]) -> Expr:
    """The sum of the terms of a polynomial in some variables."""
    return total(
        product([e, *(x**n for x, n in zip(variables, powers, strict=True))])
        for powers, e in polynomial.items()
    )


def coefficient(polynomial: Polynomial, size: int, *places: int) -> Expr:
    """The coefficient of the product of the variables at these places, of `size` variables in all."""
    return polynomial.get(tuple(map(places.count, range(size))), ZERO)


def has_degrees(polynomial: Polynomial | None, *degrees: int) -> TypeGuard[Polynomial]:
    """Whether it is a polynomial, with terms of these degrees only."""
    return polynomial is not None and {sum(powers) for powers in polynomial} <= {*degrees}
