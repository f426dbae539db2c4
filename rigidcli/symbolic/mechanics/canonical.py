"""Changes of variables in phase space: are they canonical, and what becomes of H?

A change is canonical if and only if the fundamental Poisson brackets stay what they are,
{Q_i, Q_j} = {P_i, P_j} = 0 and {Q_i, P_j} = delta_ij. Source: H. Goldstein, C. Poole, J. Safko, Classical
Mechanics, 3rd edition, section 9.5. Where the old variables are given as functions of the new ones, the same
is asked the other way round, of the brackets of the old ones by the new ones: one follows from the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from rigidcli.symbolic.algebra.calculus import derivative, substitute
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.mechanics import mass_matrix
from rigidcli.symbolic.mechanics.hamilton_equations import Phase, bracket, linear


def brackets(values: Mapping[str, Expr], pairs: Phase, phase: Phase) -> dict[tuple[str, str], Expr]:
    """All fundamental brackets of the variables `pairs`, whose `values` are functions on `phase`."""
    return {(a, b): tidy(bracket(values[a], values[b], phase)) for a, b in combinations(pairs.names, 2)}


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


def inverted(values: Mapping[str, Expr], new: Phase, old: Phase) -> dict[str, Expr] | None:
    """The `old` variables as functions of the `new` ones, whose `values` are linear; None if they are not."""
    parts = linear([values[name] for name in new.names], old.names)
    if parts is None or len(new.names) > mass_matrix.LARGEST:
        return None
    matrix, offset = parts
    determinant = mass_matrix.determinant(matrix)
    if is_zero(determinant):
        return None
    right = [symbol(name) - b for name, b in zip(new.names, offset, strict=True)]
    # Cramer's rule: the column of each variable is replaced by the right-hand side.
    return {
        name: tidy(
            mass_matrix.determinant(
                [[*row[:k], b, *row[k + 1 :]] for row, b in zip(matrix, right, strict=True)]
            )
            / determinant
        )
        for k, name in enumerate(old.names)
    }
