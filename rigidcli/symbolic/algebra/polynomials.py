"""Exact division of polynomials whose variables are the atoms of an expression."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Atom
from rigidcli.symbolic.algebra.expressions import Expr, gathered, total
from rigidcli.symbolic.algebra.roots import Rational, bounded

_Terms = dict[tuple[int, ...], Rational]


def quotient(numerator: Expr, denominator: Expr, allowance: Allowance) -> Expr | None:
    """The polynomial that times `denominator` is `numerator`, both multiplied out; None if there is none.

    Raises:
        ExpressionError: it is too much work.
    """
    atoms = sorted(dict.fromkeys(numerator.atoms + denominator.atoms), key=lambda atom: atom.key)
    remainder, divisor = _terms(numerator, atoms), _terms(denominator, atoms)
    if remainder is None or not divisor:
        return None
    leading = max(divisor)
    first = Fraction(divisor[leading])
    found: _Terms = {}
    while remainder:
        allowance.spend(len(remainder) + len(divisor) * len(atoms))
        highest = max(remainder)
        powers = tuple(a - b for a, b in zip(highest, leading, strict=True))
        if min(powers, default=0) < 0:
            return None
        factor = found[powers] = bounded(remainder[highest] / first)
        for exponents, coefficient in divisor.items():
            place = tuple(a + b for a, b in zip(powers, exponents, strict=True))
            rest = remainder.get(place, 0) - factor * coefficient
            if rest:
                remainder[place] = rest
            else:
                del remainder[place]
    return total(gathered(c, dict(zip(atoms, powers, strict=True))) for powers, c in found.items())


def _terms(e: Expr, atoms: Sequence[Atom]) -> _Terms | None:
    """The coefficients by the exponents of the atoms; None if an exponent is not natural."""
    terms: _Terms = {}
    for monomial, coefficient in e.terms.items():
        exponents = dict(monomial)
        powers = [exponents.get(atom, 0) for atom in atoms]
        if any(power.denominator != 1 or power < 0 for power in powers):
            return None
        terms[tuple(map(int, powers))] = coefficient
    return terms
