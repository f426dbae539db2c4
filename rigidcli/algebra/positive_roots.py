"""Roots of products as they are written where the symbols under them are positive.

For r > 0 the root of r^2 is r, and for k and m > 0 sqrt(k*m)/m is sqrt(k/m). A square may be multiplied out:
sqrt(u^4 + 2 u^2 v^2 + v^4) is u^2 + v^2.
"""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.expansion import MAX_STEPS
from rigidcli.algebra.expressions import Expr, product, symbol
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute, with_powers
from rigidcli.errors import ExpressionError


def for_positive_symbols(e: Expr, others: Collection[str] = ()) -> tuple[Expr, list[str]]:
    """The form that an expression has if the symbols under its roots are positive, and their names.

    It is taken where it is shorter. Symbols whose names are among the `others` may have any sign.
    """
    e = shortest([e, tidy(_in_factors(e))])
    names = sorted(_under_roots(e) - {*others})
    with_signs = tidy(substitute(e, {name: symbol(name, positive=True) for name in names}))
    changed = substitute(with_signs, {name: symbol(name) for name in names})
    return (changed, names) if len(str(changed)) < len(str(e)) else (e, [])


def _in_factors(e: Expr) -> Expr:
    """The expression with the sums under fractional powers in factors, as far as these are found."""

    def factored(atom: Atom, n: Rational) -> Expr | None:
        if isinstance(atom, Group) and atom.plain and n.denominator > 1:
            with suppress(ExpressionError):
                return product(factor**k for factor, k in factors(atom.inner, Allowance(MAX_STEPS))) ** n
        return None

    return with_powers(e, factored)


def _under_roots(e: Expr) -> set[str]:
    """The names of the symbols in products under fractional powers, at any depth."""
    found: set[str] = set()
    for monomial in e.terms:
        for atom, n in monomial:
            if isinstance(atom, Group):
                is_product = not atom.plain and n.denominator > 1
                found |= atom.names if is_product else _under_roots(atom.inner)
            elif isinstance(atom, Applied):
                found.update(*map(_under_roots, atom.arguments))
    return found
