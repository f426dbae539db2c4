"""Changes of variables in phase space: are they canonical, where, and what becomes of H?

A change is canonical if and only if the fundamental Poisson brackets stay what they are,
{Q_i, Q_j} = {P_i, P_j} = 0 and {Q_i, P_j} = delta_ij. Where the old variables are given as functions of the
new ones, the same is asked the other way round, of the brackets of the old ones by the new ones: one follows
from the other. Where the change holds the time, the new Hamiltonian is K = H + R, with a function R that
makes the new variables move at fixed old ones. Source: H. Goldstein, C. Poole, J. Safko, Classical
Mechanics, 3rd edition, sections 9.1, 9.4 and 9.5.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import combinations

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import MAX_STEPS
from rigidcli.algebra.expressions import ONE, ZERO, Expr, product, symbol, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.integration import antiderivative
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute, with_powers
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.energies import TIME
from rigidcli.mechanics.hamilton_equations import Phase, bracket


def brackets(values: Mapping[str, Expr], pairs: Phase, phase: Phase) -> dict[tuple[str, str], Expr]:
    """All fundamental brackets of the variables `pairs`, whose `values` are functions on `phase`."""
    return {(a, b): bracket(values[a], values[b], phase) for a, b in combinations(pairs.names, 2)}


def expected(a: str, b: str, pairs: Phase) -> Expr:
    """What the bracket of two variables is, if they are canonical."""
    conjugate = b in pairs.momenta and a in pairs.coordinates
    return ONE if conjugate and pairs.coordinates.index(a) == pairs.momenta.index(b) else ZERO


def wrong_brackets(found: Mapping[tuple[str, str], Expr], pairs: Phase) -> Sequence[tuple[str, str]]:
    """The pairs whose bracket is not what a canonical change has."""
    return [(a, b) for (a, b), value in found.items() if not is_zero(value - expected(a, b, pairs))]


def added_by_forces(
    forces: Sequence[Expr], old: Mapping[str, Expr], phase: Phase, new: Phase
) -> Sequence[Expr]:
    """What generalized forces on the `old` variables add to the equations of the new ones (2n).

    With canonical variables dQ/dp = -dq/dP and dP/dp = dq/dQ, so that F_i adds -F_i dq_i/dP_j to the rate of
    Q_j, and F_i dq_i/dQ_j to that of P_j.
    """
    there = [(substitute(f, old), old[q]) for f, q in zip(forces, phase.coordinates, strict=True)]

    def along(name: str) -> Expr:
        return tidy(total(f * derivative(q, name) for f, q in there))

    return [*(-along(name) for name in new.momenta), *(along(name) for name in new.coordinates)]


def positive_names(expressions: Iterable[Expr], variables: Sequence[str]) -> tuple[str, ...] | None:
    """The names that must be positive for all the expressions to vanish; None if that is not enough.

    Conditions on parameters are preferred to those on `variables`.
    """
    left = [e for e in expressions if not is_zero(e)]
    if not left:
        return ()
    parameters = sorted({name for e in left for name in e.names}.difference(variables))

    def vanish(names: Sequence[str]) -> bool:
        positive = {name: symbol(name, positive=True) for name in names}
        with suppress(ExpressionError):
            return all(is_zero(substitute(e, positive)) for e in left)
        return False

    needed = [*variables, *parameters]
    if not vanish(needed):
        return None
    for name in tuple(needed):
        fewer = [kept for kept in needed if kept != name]
        if vanish(fewer):
            needed = fewer
    return tuple(needed)


def added_gradient(old: Mapping[str, Expr], old_phase: Phase, new: Phase) -> list[Expr]:
    """The derivatives of R by the new variables (2n), for old variables as functions of these and the time.

    The new variables Z move at fixed old ones as J dR/dZ. With z(Z, t) that is
    dR/dZ_k = sum_i dq_i/dZ_k dp_i/dt - dp_i/dZ_k dq_i/dt.
    """
    pairs = [(old[q], old[p]) for q, p in zip(old_phase.coordinates, old_phase.momenta, strict=True)]
    return [
        tidy(
            total(
                derivative(q, name) * derivative(p, TIME) - derivative(p, name) * derivative(q, TIME)
                for q, p in pairs
            )
        )
        for name in new.names
    ]


def potential_of(gradient: Sequence[Expr], names: Sequence[str]) -> Expr | None:
    """The function with this gradient by the names, but for a function of other names; None if not found."""
    found = ZERO
    for name, slope in reversed([*zip(names, gradient, strict=True)]):
        part = antiderivative(tidy(slope - derivative(found, name)), name)
        if part is None:
            return None
        found += part
    is_right = all(
        is_zero(slope - derivative(found, name)) for name, slope in zip(names, gradient, strict=True)
    )
    return found if is_right else None


def for_positive_symbols(e: Expr, others: Collection[str] = ()) -> tuple[Expr, list[str]]:
    """The form that an expression has if the symbols under its roots are positive, and their names.

    For r > 0 the root of r^2 is r, and for k and m > 0 sqrt(k*m)/m is sqrt(k/m); a square may be multiplied
    out. The form is taken where it is shorter. Symbols whose names are among the `others` may have any sign.
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
