"""Roots of products as they are written where the symbols under them are positive.

For r > 0 the root of r^2 is r, and for k and m > 0 sqrt(k*m)/m is sqrt(k/m).
"""

from __future__ import annotations

from collections.abc import Collection

from rigidcli.symbolic.algebra.atoms import Applied, Group
from rigidcli.symbolic.algebra.calculus import substitute
from rigidcli.symbolic.algebra.expressions import Expr, symbol
from rigidcli.symbolic.algebra.simplification import tidy


def for_positive_symbols(e: Expr, others: Collection[str] = ()) -> tuple[Expr, list[str]]:
    """The form that an expression has if the symbols under its roots are positive, and their names.

    It is taken where it is shorter. Symbols whose names are among the `others` may have any sign.
    """
    names = sorted(_under_roots(e) - {*others})
    with_signs = tidy(substitute(e, {name: symbol(name, positive=True) for name in names}))
    changed = substitute(with_signs, {name: symbol(name) for name in names})
    return (changed, names) if len(str(changed)) < len(str(e)) else (e, [])


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
