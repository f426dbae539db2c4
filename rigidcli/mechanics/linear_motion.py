"""Linear equations of motion M y'' + C y' + K y = 0, and the roots s of their solutions exp(s t).

Small oscillations obey such equations, to first order in the displacement y. M is the mass matrix at the
equilibrium. Without forces beside L or H, C is antisymmetric: it comes from terms linear in the velocities,
as of magnetic fields and rotating frames. K is the matrix of the second derivatives of the potential, with
centrifugal terms. Hamilton's linear equations z' = A z are the case M = 0, C = 1, K = -A.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, sections 6.1 and 6.2. Differences:
C, and forces, are not there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase, linear
from rigidcli.mechanics.lagrange_equations import LagrangeEquations

Vector: TypeAlias = "tuple[tuple[float | Expr, float | Expr], ...]"
"""The real and imaginary parts of the components."""


class LinearMotion(NamedTuple):
    """The matrices M, C and K (n by n each)."""

    masses: Matrix
    rates: Matrix
    stiffness: Matrix

    @classmethod
    def of_matrix(cls, matrix: Matrix) -> LinearMotion:
        """The motion z' = A z of coordinates q and their momenta p, without the momenta where that can be.

        With q' = A q + B p, p' = D q + E p they are p = M (q' - A q), where M = B^-1. Where B has no inverse,
        the motion stays one of first order, with M = 0, C = 1 and K = -A.
        """
        size, whole = len(matrix) // 2, _array(matrix)
        (a, b), (d, e) = (np.hsplit(rows, [size]) for rows in np.vsplit(whole, [size]))
        masses = inverse_of(b.tolist())
        if masses is None:
            one = [[ONE if i == j else ZERO for j in range(2 * size)] for i in range(2 * size)]
            return cls((0 * whole).tolist(), one, (-whole).tolist())
        back = matrices.product(e.tolist(), masses)
        rates = -_array(matrices.product(masses, a.tolist())) - _array(back)
        stiffness = _array(matrices.product(back, a.tolist())) - d
        return cls(masses, rates.tolist(), stiffness.tolist()).changed(tidy)

    @property
    def parts(self) -> tuple[Matrix, Matrix, Matrix]:
        """M, C and K."""
        return self.masses, self.rates, self.stiffness

    @property
    def entries(self) -> list[Expr]:
        """All entries of the matrices."""
        return [e for part in self.parts for row in part for e in row]

    @property
    def is_of_first_order(self) -> bool:
        """Whether there are no second derivatives."""
        return not any(e for row in self.masses for e in row)

    def pencil(self, s: Expr, square: Expr) -> list[list[Expr]]:
        """M s^2 + C s + K, which takes the vector of a motion y = Re(v exp(s t)) to zero."""
        rows = zip(*self.parts, strict=True)
        return [[m * square + c * s + k for m, c, k in zip(*row, strict=True)] for row in rows]

    def changed(self, change: Callable[[Expr], Expr]) -> LinearMotion:
        """This motion with every entry of its matrices changed."""
        return LinearMotion(*([[change(e) for e in row] for row in part] for part in self.parts))

    def blocks(self) -> list[tuple[list[int], LinearMotion]]:
        """The places that act on each other, with their motion."""
        blocks = matrices.connected(
            len(self.masses), lambda i, j: any(part[i][j] or part[j][i] for part in self.parts)
        )
        return [(b, LinearMotion(*(matrices.part(part, b, b) for part in self.parts))) for b in blocks]


class Root(NamedTuple):
    """A root s = `growth` + i `angular` of the determinant, with what it stands for.

    `growth` (1/s) is negative where motion decays. `is_stable` is None of a zero mode, which is displaced to
    another equilibrium and drifts there, and where the signs of symbols decide: the root is that for a
    positive `condition`. A root that counts several `times` has as many vectors if it `is_whole`. Of two
    conjugate roots that with `angular` >= 0 stands for both, and where -s is a root with s (`is_paired`),
    the one that grows.
    """

    growth: float | Expr
    angular: float | Expr
    is_stable: bool | None
    condition: Expr | None = None
    times: int = 1
    is_whole: bool = True
    is_paired: bool = True
    vectors: tuple[Vector, ...] = ()

    @property
    def rate(self) -> float | Expr:
        """The growth of an unstable mode; else the angular frequency, or the decay where it has none."""
        if self.is_stable is False and self.growth:
            return self.growth
        return -self.growth if self.growth and not self.angular else self.angular


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
        inverse = inverse_of(parts[0])
        if inverse is None:
            return None
        values = [tidy(total(-a * b for a, b in zip(row, parts[1], strict=True))) for row in inverse]
        return dict(zip(phase.momenta, values, strict=True))
    still = dict.fromkeys(phase.momenta, ZERO)
    return still if all(is_zero(substitute(v, still)) for v in velocities) else None


def of_hamilton(equations: Sequence[Expr], phase: Phase, place: Mapping[str, Expr]) -> LinearMotion:
    """Hamilton's equations near the equilibrium at the coordinates and momenta `place`."""
    return LinearMotion.of_matrix(
        [[tidy(substitute(derivative(e, name), place)) for name in phase.names] for e in equations]
    )


def _array(matrix: Matrix) -> Any:
    return np.array(matrix, dtype=object)


def inverse_of(matrix: Matrix) -> Matrix | None:
    """The inverse; None where there is none, or it is too large."""
    try:
        return matrices.inverse(matrix)
    except (ExpressionError, ZeroDivisionError):
        return None
