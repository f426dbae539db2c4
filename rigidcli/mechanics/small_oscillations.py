"""Small oscillations: the equations of motion near an equilibrium, to first order in the displacement y.

    M y'' + C y' + K y = 0

M is the mass matrix there. Without forces beside L or H, C is antisymmetric: it comes from terms linear in
the velocities, as of magnetic fields and rotating frames. K is the matrix of the second derivatives of the
potential, with centrifugal terms. Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition,
sections 6.1 and 6.2. Differences: C, and forces, are not there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase, linear
from rigidcli.mechanics.lagrange_equations import LagrangeEquations
from rigidcli.mechanics.linear_motion import LinearMotion


def forces_at_rest(lagrange: LagrangeEquations, velocities: Sequence[str]) -> list[Expr]:
    """The generalized forces on a system at rest, as functions of the coordinates."""
    still = dict.fromkeys(velocities, ZERO)
    return [-substitute(rest, still) for rest in lagrange.rest]


def of_lagrange(
    lagrange: LagrangeEquations, phase: Phase, velocities: Sequence[str], place: Mapping[str, Expr]
) -> LinearMotion:
    """Lagrange's equations near the equilibrium at the coordinates `place`."""
    there = {**place, **dict.fromkeys(velocities, ZERO)}

    def slopes(names: Sequence[str]) -> list[list[Expr]]:
        return [[tidy(substitute(derivative(r, name), there)) for name in names] for r in lagrange.rest]

    masses = [[tidy(substitute(entry, there)) for entry in row] for row in lagrange.matrix]
    return LinearMotion(masses, slopes(velocities), slopes(phase.coordinates))


def momenta_at_rest(velocities: Sequence[Expr], phase: Phase) -> dict[str, Expr] | None:
    """The momenta of a system at rest, as functions of the coordinates; `velocities` are dH/dp.

    None where the velocities are not linear in the momenta, and no momenta are not it, either.
    """
    parts = linear(velocities, phase.momenta)
    if parts is not None:
        inverse = _inverse(parts[0])
        if inverse is None:
            return None
        values = [tidy(total(-a * b for a, b in zip(row, parts[1], strict=True))) for row in inverse]
        return dict(zip(phase.momenta, values, strict=True))
    still = dict.fromkeys(phase.momenta, ZERO)
    return still if all(is_zero(substitute(v, still)) for v in velocities) else None


def of_hamilton(equations: Sequence[Expr], phase: Phase, place: Mapping[str, Expr]) -> LinearMotion | None:
    """Hamilton's equations near the equilibrium at the coordinates and momenta `place`.

    With y' = A y + B z, z' = D y + E z the momenta are z = M (y' - A y), where M = B^-1: None without it.
    """
    size = len(phase.coordinates)
    slopes = [[tidy(substitute(derivative(e, name), place)) for name in phase.names] for e in equations]
    first, second = range(size), range(size, 2 * size)
    a, b = matrices.part(slopes, first, first), matrices.part(slopes, first, second)
    d, e = matrices.part(slopes, second, first), matrices.part(slopes, second, second)
    masses = _inverse(b)
    if masses is None:
        return None
    carried, turned = matrices.product(masses, a), matrices.product(e, masses)
    rates = [[tidy(-x - y) for x, y in zip(*rows, strict=True)] for rows in zip(carried, turned, strict=True)]
    back = matrices.product(turned, a)
    stiffness = [[tidy(x - y) for x, y in zip(*rows, strict=True)] for rows in zip(back, d, strict=True)]
    return LinearMotion(masses, rates, stiffness)


def _inverse(matrix: Matrix) -> Matrix | None:
    """The inverse; None where there is none, or it is too large."""
    try:
        return matrices.inverse(matrix)
    except ExpressionError:
        return None
