"""Lagrange's equations, solved for the accelerations, and the multipliers of constraints.

    d/dt dL/dv_i - dL/dq_i - Q_i = 0,    which is    sum_j M_ij a_j + r_i(q, v, t) = 0

with the mass matrix M_ij = d^2 L/dv_i dv_j and generalized forces Q_i beside L. Source:
H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 1.4.

Where the rank r of M is less than n, the velocities do not follow from the momenta, which obey n - r primary
constraints: combinations of them that hold no velocity. Source: P. A. M. Dirac, Lectures on Quantum
Mechanics, lecture 1.

A constraint is f(q, t) = 0, or is linear in the velocities: sum_i a_i(q, t) v_i + b(q, t) = 0. The first kind
has the rate sum_i df/dq_i v_i + df/dt, so that both kinds have slopes a_i and a rest b. With the mass matrix
M, what else stands in Lagrange's equations r, and A the matrix of the slopes,

    M dv/dt + r = A^T lambda,        A dv/dt + c = 0,        c = (d(A v + b)/dq) v + d(A v + b)/dt,

the second line being the rates of the constraints differentiated by the time. So

    lambda = (A M^-1 A^T)^-1 (A M^-1 r - c).

Source: Goldstein, section 2.4. There the multipliers are found case by case; the matrix form is that of
E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, section IV.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, polynomial_sum
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.simplification import apart, over_shared_sums, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero, sampled
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.legendre import Momenta
from rigidcli.mechanics.particles import velocity
from rigidcli.mechanics.phase_space import TIME, Phase, linear


@dataclass(frozen=True)
class LagrangeEquations:
    """The mass matrix M (n by n) and the `rest` r (n); `names` call the accelerations (n)."""

    matrix: Sequence[Sequence[Expr]]
    rest: tuple[Expr, ...]
    names: tuple[str, ...]

    @cached_property
    def equations(self) -> tuple[Expr, ...]:
        """Expressions that vanish along every motion."""
        sums = matrices.times(self.matrix, list(map(symbol, self.names)))
        return tuple(over_shared_sums(e + r) for e, r in zip(sums, self.rest, strict=True))

    @cached_property
    def accelerations(self) -> tuple[Expr, ...] | None:
        """a = -M^-1 r; None where the inverse would be too large to read."""
        inverse = matrices.inverse(self.matrix, matrices.FEW_TERMS)
        return None if inverse is None else tuple(tidy(-e) for e in matrices.times(inverse, self.rest))


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
        e = moved - derivative(lagrangian, q)
        # Each product of velocities stands by itself, and what is free of them by its functions.
        if e.names.isdisjoint(velocities):
            e = -apart(tidy(-e))  # Hamilton's equations have this slope, so that it is known already
        elif (polynomial := coefficients(e, velocities)) is None:
            e = tidy(e)
        else:
            parts = {n: tidy(c) if any(n) else apart(tidy(c)) for n, c in polynomial.items()}
            e = polynomial_sum(parts, list(map(symbol, velocities)))
        rest.append(e - substitute(force, defined))
    return LagrangeEquations(momenta.mass_matrix, tuple(rest), tuple(names))


NONE = 1e-13  # a singular value below this is rounding, where entries are of the order of 1


def rank(matrix: matrices.Matrix, fixed: Mapping[str, Expr]) -> int | None:
    """The rank of a symmetric matrix almost everywhere, with these values; None where it has no value."""
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
    """The linear primary constraints: what vanishes of coordinates and of the momenta, called `names`."""
    still = dict.fromkeys(velocities, ZERO)
    constraints = []
    for vector in matrices.null_vectors(matrix):
        if any(not entry.names.isdisjoint(velocities) for entry in vector):
            continue
        with suppress(ExpressionError):  # L may not be differentiable at rest
            at_rest = total(x * substitute(p, still) for x, p in zip(vector, definitions, strict=True))
            there = total(x * symbol(p) for x, p in zip(vector, names, strict=True))
            constraints.append(tidy(there - at_rest))
    return constraints


NOISE = 1e-10  # sums below this share of their terms are rounding


class Constraint(NamedTuple):
    """A constraint, by the name of its multiplier. The `expression` vanishes, and so does its `rate`.

    The rate is linear in the velocities, with the `slopes` (n), and is the `rest` where all is still.
    Differentiated once more, it is the slopes times the accelerations, plus `turning`. It is `holonomic`
    if it is the rate of a function of coordinates and time, perhaps after it is multiplied by a factor.
    """

    name: str
    expression: Expr
    rate: Expr
    slopes: tuple[Expr, ...]
    rest: Expr
    turning: Expr
    holonomic: bool

    @property
    def has_velocities(self) -> bool:
        """Whether it is a condition on velocities, as that of rolling is."""
        return self.expression == self.rate

    @property
    def multiplier(self) -> Expr:
        """The multiplier as a symbol."""
        return symbol(self.name)


def constraint(name: str, e: Expr, velocities: Mapping[str, str]) -> Constraint:
    """The constraint by which an expression vanishes; `velocities` names that of each coordinate.

    Raises ExpressionError where neither coordinates nor velocities are in it, or it is not linear in these.
    """
    names, moving = tuple(velocities), tuple(velocities.values())
    rate = e
    if e.names.isdisjoint(moving):
        rate = velocity(e, velocities)
        if is_zero(e) or all(is_zero(derivative(e, q)) for q in names):
            raise ExpressionError("there is no coordinate and no velocity in it, so that it is no constraint")
    parts = linear([rate], moving)
    if parts is None:
        raise ExpressionError(
            "it is not linear in the velocities",
            hint="a constraint holds coordinates and the time, or velocities in the first power",
        )
    (slopes,), (rest,) = parts
    if all(is_zero(slope) for slope in slopes):
        raise ExpressionError("the velocities in it cancel, so that it is no constraint")
    form = dict(zip((*names, TIME), (*slopes, rest), strict=True))
    is_whole = rate is not e or _is_integrable(form)
    return Constraint(name, e, rate, tuple(slopes), rest, velocity(rate, velocities), is_whole)


def _is_integrable(form: Mapping[str, Expr]) -> bool:
    """Whether a form w is a factor times a differential: w dw = 0 (Frobenius), tried at random points."""
    size = len(form)
    slopes = [derivative(e, x) for e in form.values() for x in form]
    rows = sampled([*form.values(), *slopes], {}, signed=form)
    if rows is None:
        return False
    w, slope = rows[:, :size], rows[:, size:].reshape(-1, size, size)
    turned = slope.transpose(0, 2, 1) - slope
    parts = np.einsum("pi,pjk->pijk", w, turned)
    # w_i (dw)_jk + w_j (dw)_ki + w_k (dw)_ij
    whole = parts + parts.transpose(0, 3, 1, 2) + parts.transpose(0, 2, 3, 1)
    return bool(np.abs(whole).max() <= NOISE * np.abs(parts).max())


def first_dependent(constraints: Sequence[Constraint]) -> int | None:
    """The place of the first constraint that follows from those before it; None if all are independent."""
    rows = sampled([e for one in constraints for e in one.slopes], {})
    if rows is None:
        return None
    at_points = rows.reshape(len(rows), len(constraints), -1)
    at_points /= np.abs(at_points).max(axis=2, keepdims=True)
    for place in range(1, len(constraints)):
        if np.linalg.matrix_rank(at_points[:, : place + 1], tol=NOISE).max() <= place:
            return place
    return None


def reactions(constraints: Sequence[Constraint], size: int) -> list[Expr]:
    """The generalized forces of the constraints (n), sum_j lambda_j a_ji, with the multipliers as symbols."""
    return [total(one.multiplier * one.slopes[i] for one in constraints) for i in range(size)]


def multipliers(
    constraints: Sequence[Constraint], masses: matrices.Matrix, rest: Sequence[Expr]
) -> tuple[Expr, ...] | None:
    """The multipliers in coordinates, velocities and the time; None where they are too long to read.

    `masses` is the mass matrix, `rest` (n) what else stands in Lagrange's equations without the multipliers.
    """
    inverse = matrices.inverse(masses, matrices.FEW_TERMS)
    if inverse is None:
        return None
    rows = [one.slopes for one in constraints]
    lighter = matrices.product(rows, inverse)
    couplings = matrices.product(lighter, [*zip(*rows, strict=True)])
    solved = matrices.inverse([[tidy(e) for e in row] for row in couplings], matrices.FEW_TERMS)
    if solved is None:
        return None
    right = [tidy(e - one.turning) for e, one in zip(matrices.times(lighter, rest), constraints, strict=True)]
    return tuple(map(tidy, matrices.times(solved, right)))


def fixed(constraints: Sequence[Constraint], velocities: Mapping[str, str]) -> dict[str, Expr]:
    """Coordinates and velocities that a constraint fixes by itself, as r - l fixes r, and rdot with it."""
    known: dict[str, Expr] = {}
    for one in constraints:
        names = [name for name in (*velocities, *velocities.values()) if name in one.expression.names]
        parts = linear([one.expression], names) if len(names) == 1 else None
        if parts is not None:
            (((slope,),), (rest,)), (name,) = parts, names
            known[name] = tidy(-rest / slope)
            if name in velocities:
                known[velocities[name]] = tidy(derivative(known[name], TIME))
    return known
