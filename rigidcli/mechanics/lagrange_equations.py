"""Lagrange's equations: written out, and solved for the second derivatives of the coordinates.

    d/dt dL/dv_i - dL/dq_i - Q_i = 0,    which is    sum_j M_ij a_j + r_i(q, v, t) = 0

with the mass matrix M_ij = d^2 L/dv_i dv_j and generalized forces Q_i beside those that L holds. Source:
H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 1.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, Expr, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trigonometry import exponentials_merged
from rigidcli.mechanics.energies import TIME
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.mechanics.legendre import Momenta


@dataclass(frozen=True)
class LagrangeEquations:
    """The mass matrix M (n by n) and the `rest` r (n); `names` are those of the accelerations (n)."""

    matrix: Sequence[Sequence[Expr]]
    rest: tuple[Expr, ...]
    names: tuple[str, ...]

    @cached_property
    def equations(self) -> tuple[Expr, ...]:
        """Expressions that vanish along every motion."""
        a = [symbol(name) for name in self.names]
        pairs = zip(self.matrix, self.rest, strict=True)
        return tuple(total([*(m * x for m, x in zip(row, a, strict=True)), r]) for row, r in pairs)

    @cached_property
    def accelerations(self) -> tuple[Expr, ...] | None:
        """a = -M^-1 r; None where the inverse would be too large to read."""
        inverse = matrices.inverse(self.matrix, matrices.FEW_TERMS)
        if inverse is None:
            return None
        return tuple(map(self._combined, inverse))

    def _combined(self, row: Sequence[Expr]) -> Expr:
        """One acceleration, from its row of M^-1."""
        acting = [(-m, r) for m, r in zip(row, self.rest, strict=True) if m and r]
        found = total(m * r for m, r in acting)
        # One product of what is tidy is tidy, but for exponentials that cancel.
        is_tidy = len(acting) == len(found.terms) == 1 and len(acting[0][1].terms) == 1
        return found if is_tidy and exponentials_merged(found) == found else tidy(found)


def lagrange_equations(
    lagrangian: Expr,
    momenta: Momenta,
    phase: Phase,
    velocities: Sequence[str],
    names: Sequence[str],
    forces: Sequence[Expr],
) -> LagrangeEquations:
    """The equations of a Lagrangian with these `momenta`; `names` are those of the accelerations.

    The generalized `forces` (n) may hold momenta, too.
    """
    defined = dict(zip(phase.momenta, momenta.definitions, strict=True))
    moving = [*zip(phase.coordinates, map(symbol, velocities), strict=True), (TIME, ONE)]
    rest = []
    for p, q, force in zip(momenta.definitions, phase.coordinates, forces, strict=True):
        moved, slope = total(derivative(p, name) * rate for name, rate in moving), derivative(lagrangian, q)
        # Hamilton's equations have the tidied slope as it is, so that it is known already.
        free = tidy(moved - slope) if moved else -tidy(slope)
        rest.append(free - substitute(force, defined))
    return LagrangeEquations(momenta.mass_matrix, tuple(rest), tuple(names))
