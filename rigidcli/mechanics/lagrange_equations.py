"""Lagrange's equations: written out, and solved for the second derivatives of the coordinates.

    d/dt dL/dv_i - dL/dq_i - Q_i = 0,    which is    sum_j M_ij a_j + r_i(q, v, t) = 0

with the mass matrix M_ij = d^2 L/dv_i dv_j and generalized forces Q_i beside L. Source:
H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 1.4.

Where the rank r of M is less than n, the velocities do not follow from the momenta, which obey n - r primary
constraints: combinations of them that hold no velocity. Source: P. A. M. Dirac, Lectures on Quantum
Mechanics, lecture 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, ZERO, Expr, product, symbol, total
from rigidcli.algebra.simplification import apart, over_shared_sums, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import sampled
from rigidcli.mechanics.legendre import Momenta
from rigidcli.mechanics.phase_space import TIME, Phase


@dataclass(frozen=True)
class LagrangeEquations:
    """The mass matrix M (n by n) and the `rest` r (n); `names` call the accelerations (n)."""

    matrix: Sequence[Sequence[Expr]]
    rest: tuple[Expr, ...]
    names: tuple[str, ...]

    @cached_property
    def equations(self) -> tuple[Expr, ...]:
        """Expressions that vanish along every motion."""
        a = [symbol(name) for name in self.names]
        sums = (total(m * x for m, x in zip(row, a, strict=True) if m) for row in self.matrix)
        return tuple(over_shared_sums(e + r) for e, r in zip(sums, self.rest, strict=True))

    @cached_property
    def accelerations(self) -> tuple[Expr, ...] | None:
        """a = -M^-1 r; None where the inverse would be too large to read."""
        inverse = matrices.inverse(self.matrix, matrices.FEW_TERMS)
        if inverse is None:
            return None
        return tuple(tidy(total(-m * r for m, r in zip(row, self.rest, strict=True) if m)) for row in inverse)


def lagrange_equations(
    lagrangian: Expr,
    momenta: Momenta,
    phase: Phase,
    velocities: Sequence[str],
    names: Sequence[str],
    forces: Sequence[Expr],
) -> LagrangeEquations:
    """The equations of a Lagrangian with these `momenta`; `names` call the accelerations.

    The generalized `forces` (n) may hold momenta, too.
    """
    defined = dict(zip(phase.momenta, momenta.definitions, strict=True))
    moving = [*zip(phase.coordinates, map(symbol, velocities), strict=True), (TIME, ONE)]
    rest = []
    for p, q, force in zip(momenta.definitions, phase.coordinates, forces, strict=True):
        moved = total(derivative(p, name) * rate for name, rate in moving if name in p.names)
        slope = derivative(lagrangian, q)
        rest.append(by_velocities(moved - slope, velocities) - substitute(force, defined))
    return LagrangeEquations(momenta.mass_matrix, tuple(rest), tuple(names))


def by_velocities(e: Expr, velocities: Sequence[str]) -> Expr:
    """A function with each product of velocities by itself, and what is free of them by its functions."""
    if e.names.isdisjoint(velocities):
        return -apart(tidy(-e))  # Hamilton's equations have this slope, so that it is known already
    polynomial = coefficients(e, velocities)
    if polynomial is None:
        return tidy(e)
    parts = []
    for powers, factor in polynomial.items():
        moving = product(symbol(v) ** n for v, n in zip(velocities, powers, strict=True))
        parts.append(tidy(factor) * moving if any(powers) else apart(tidy(factor)))
    return total(parts)


NONE = 1e-13
"""A singular value below this is rounding: it belongs to a matrix with entries of the order of 1."""


def rank(matrix: matrices.Matrix, fixed: Mapping[str, Expr]) -> int | None:
    """The rank of a symmetric matrix (n by n) of expressions almost everywhere; None where it has no value.

    Names have their `fixed` values, others any.
    """
    there = sampled([substitute(entry, fixed) for row in matrix for entry in row], {})
    if there is None:
        return None
    there = there.reshape(-1, len(matrix), len(matrix))
    # Rows and columns are divided by the square roots of their sizes.
    sizes = np.sqrt(np.abs(there).max(axis=2, keepdims=True))
    sizes[sizes == 0] = 1.0
    balanced = there / sizes / sizes.transpose(0, 2, 1)
    return int(np.linalg.matrix_rank(balanced, tol=NONE).max())


def primary_constraints(
    matrix: matrices.Matrix, definitions: Sequence[Expr], velocities: Sequence[str], names: Sequence[str]
) -> list[Expr]:
    """Primary constraints: expressions in the momenta, called `names`, and coordinates that vanish.

    Others than linear ones are not looked for.
    """
    at_rest = dict.fromkeys(velocities, ZERO)
    constraints = []
    for vector in matrices.null_vectors(matrix):
        if any(not entry.names.isdisjoint(velocities) for entry in vector):
            continue
        still = total(entry * substitute(p, at_rest) for entry, p in zip(vector, definitions, strict=True))
        moving = total(entry * symbol(name) for entry, name in zip(vector, names, strict=True))
        constraints.append(tidy(moving - still))
    return constraints
