"""From what a document says of a system to its momenta and Hamiltonian, checked at random points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, lru_cache

import numpy as np

from rigidcli.algebra.arithmetic import inequality
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, number, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import plain_tree
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
from rigidcli.document.system import System
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.lagrange_equations import (
    LagrangeEquations,
    fixed,
    lagrange_equations,
    multipliers,
    primary_constraints,
    rank,
    reactions,
)
from rigidcli.mechanics.legendre import Momenta, canonical_momenta, legendre_transform
from rigidcli.mechanics.particles import squares
from rigidcli.mechanics.phase_space import TIME, Phase, equations, is_constant_in, linear, steps
from rigidcli.studies.hamilton.system import SystemFunctions, known_values, system_functions

# A residual of the equations of motion beyond this, in units of their size, is no rounding error.
MOST_RESIDUAL = 1e-6
# The number of random points at which the equations of motion are compared.
CHECKED_POINTS = 3
# The most nodes of H and of the velocities together that are worked with: about ten pages of text.
MOST_NODES_OF_H = 3_000


@dataclass(frozen=True, eq=False)
class Derivation:
    """A system, and all that follows from its Lagrangian or Hamiltonian.

    `momenta` is None where only H is given. `branches` are the solutions of p = dL/dv for the velocities that
    passed the check at random points. H has the form shown where all `conditions` are positive. `residual` is
    the largest relative difference between Hamilton's equations and those of Euler and Lagrange at these
    points; None where there is nothing to compare.
    """

    phase: Phase
    velocity_names: tuple[str, ...]
    system: SystemFunctions
    momenta: Momenta | None = None
    branches: tuple[Branch, ...] = ()
    residual: float | None = None
    notes: tuple[str, ...] = ()
    conditions: tuple[Expr, ...] = ()

    @property
    def branch(self) -> Branch | None:
        """The solution of p = dL/dv for the velocities, if it is the only one."""
        return self.branches[0] if len(self.branches) == 1 else None

    @cached_property
    def are_linear(self) -> bool:
        """Whether the momenta are linear functions of the velocities."""
        return self.momenta is not None and self.momenta.are_linear(self.velocity_names)

    @property
    def hamiltonian(self) -> Expr | None:
        """H(q, p, t), if it is given or has one closed form."""
        return self.system.hamiltonian if self.branch is None else self.branch.hamiltonian

    @property
    def is_short(self) -> bool:
        """Whether H has a closed form of at most MOST_NODES_OF_H."""
        return self.hamiltonian is not None and (self.branch is None or _is_short(self.branch))

    @cached_property
    def equations(self) -> tuple[Expr, ...] | None:
        """The derivatives of coordinates and momenta by time; None without an H, or if it is too long."""
        if self.hamiltonian is None or not self.is_short:
            return None
        solved = None if self.branch is None else self.branch.velocities
        free = equations(self.hamiltonian, self.phase, solved)
        velocities = free[: len(self.phase.coordinates)]
        rates = zip(free[len(velocities) :], self.forces_of(velocities), strict=True)
        return (*velocities, *(rate + force for rate, force in rates))

    @cached_property
    def linear(self) -> tuple[list[list[Expr]], list[Expr]] | None:
        """A and b where the equations are z' = A z + b; None where they are not linear, or not written."""
        with suppress(ExpressionError):
            if self.equations is not None and not self.system.constraints:
                return linear(self.equations, self.phase.names)
        return None

    def forces_of(self, velocities: Sequence[Expr]) -> list[Expr]:
        """The forces beside L or H where the velocities are these, such as functions of the momenta."""
        known = dict(zip(self.velocity_names, velocities, strict=True))
        return [tidy(substitute(force, known)) for force in self.system.forces]

    @property
    def velocities(self) -> tuple[Expr, ...] | None:
        """The velocities as functions of the momenta."""
        return None if self.equations is None else self.equations[: len(self.phase.coordinates)]

    @cached_property
    def lagrange(self) -> LagrangeEquations | None:
        """Lagrange's equations; None where only H is given, or the name of an acceleration is taken."""
        lagrangian, names = self.system.lagrangian, tuple(map(acceleration, self.phase.coordinates))
        taken = {*self.phase.names, *self.velocity_names}
        if lagrangian is None or self.momenta is None or not (taken | lagrangian.names).isdisjoint(names):
            return None
        forces = self.system.forces
        return lagrange_equations(lagrangian, self.momenta, self.phase, self.velocity_names, names, forces)

    @cached_property
    def multipliers_anywhere(self) -> tuple[Expr, ...] | None:
        """The multipliers in coordinates, velocities and t, also off the constraints; None if too long."""
        limits, lagrange = self.system.constraints, self.lagrange
        with suppress(ExpressionError):
            if lagrange is not None:
                free = dict.fromkeys((one.name for one in limits), ZERO)
                return multipliers(limits, lagrange.matrix, [substitute(e, free) for e in lagrange.rest])
        return None

    @cached_property
    def multipliers(self) -> tuple[Expr, ...] | None:
        """The multipliers, simplified by the values of coordinates and velocities that constraints fix."""
        found = self.multipliers_anywhere
        return None if found is None else tuple(tidy(substitute(e, self._fixed)) for e in found)

    @cached_property
    def _fixed(self) -> dict[str, Expr]:
        names = zip(self.phase.coordinates, self.velocity_names, strict=True)
        return fixed(self.system.constraints, dict(names))

    @property
    def accelerations(self) -> tuple[Expr, ...] | None:
        """Accelerations in coordinates, velocities and t; None where they are too long to read."""
        free, limits = None if self.lagrange is None else self.lagrange.accelerations, self.system.constraints
        if free is None or not limits:
            return free
        if self.multipliers is None:
            return None
        return tuple(tidy(substitute(e, self._of_constraints)) for e in free)

    @cached_property
    def constraint_forces(self) -> tuple[Expr, ...] | None:
        """The generalized forces of the constraints, with the multipliers put in."""
        if self.multipliers is None:
            return None
        free = reactions(self.system.constraints, len(self.phase.coordinates))
        return tuple(tidy(substitute(e, self._of_constraints)) for e in free)

    @property
    def _of_constraints(self) -> dict[str, Expr]:
        """The values of the multipliers, and of the coordinates and velocities that constraints fix."""
        names = (one.name for one in self.system.constraints)
        return self._fixed | dict(zip(names, self.multipliers or (), strict=False))

    @property
    def generator(self) -> Expr:
        """H, or -L where H is not worked with: their derivatives by coordinates and time are the same."""
        if self.hamiltonian is not None and self.is_short:
            return self.hamiltonian
        assert self.system.lagrangian is not None
        return -self.system.lagrangian

    @cached_property
    def cyclic(self) -> tuple[str, ...]:
        """Coordinates on which L and H do not depend."""
        return tuple(q for q in self.phase.coordinates if is_constant_in(self.generator, q))

    @cached_property
    def jumps(self) -> tuple[Expr, ...]:
        """Functions f for which sign(f) stands in H (or in L): H has a step where f = 0."""
        return steps(self.generator, {*self.phase.names, *self.velocity_names})

    @cached_property
    def conserved_momenta(self) -> tuple[str, ...]:
        """Cyclic coordinates on which no force acts: their momenta are conserved."""
        forces = dict(zip(self.phase.coordinates, self.system.forces, strict=True))
        return tuple(q for q in self.cyclic if is_zero(forces[q]))

    @property
    def moves_alone(self) -> bool:
        """Whether one coordinate moves by itself: the others are cyclic, and H is constant."""
        changes = self.is_forced or self.explicit_time or self.system.constraints
        return not changes and len(self.phase.coordinates) - len(self.cyclic) == 1

    @property
    def is_forced(self) -> bool:
        """Whether generalized forces act besides those of L or H."""
        return any(not force.is_zero for force in self.system.forces)

    @cached_property
    def power(self) -> Expr:
        """dH/dt, which is the partial derivative of H (or -L) by the time, plus the power of the forces.

        A function of coordinates and momenta where there is an H; else of velocities, too. Constraints are
        A v + b = 0, so that the power of their forces, (A^T lambda) v, is -lambda b.
        """
        velocities = self.velocities or [symbol(name) for name in self.velocity_names]
        limits = self.system.constraints
        pairs = zip(self.forces_of(velocities), velocities, strict=True)
        work = total(force * velocity for force, velocity in pairs)
        if limits:
            work = substitute(work, dict.fromkeys((one.name for one in limits), ZERO))
            work -= total(one.multiplier * one.rest for one in limits)
        if self.velocities is None and self.momenta is not None:
            work = substitute(work, dict(zip(self.phase.momenta, self.momenta.definitions, strict=True)))
        return derivative(self.generator, TIME) + work

    @property
    def energy_rate(self) -> Expr | None:
        """dH/dt where there is an H."""
        return tidy(self.power) if self.is_short else None

    @property
    def conserved(self) -> list[str]:
        """The names of conserved momenta, and of H if that is conserved."""
        return [f"p_{name}" for name in self.conserved_momenta] + ([] if self.energy_changes else ["H"])

    @cached_property
    def energy_changes(self) -> bool:
        """Whether H is not conserved."""
        return self.explicit_time or not is_zero(self.power)

    @cached_property
    def explicit_time(self) -> bool:
        """Whether H depends on the time by itself."""
        return not is_constant_in(self.generator, TIME)

    @cached_property
    def energy_excess(self) -> Expr | None:
        """T + V - H as a function of coordinates and velocities; None without T and V."""
        system = self.system
        known = system.kinetic, system.potential, system.lagrangian
        if self.momenta is None or any(e is None for e in known):
            return None
        pairs = zip(self.momenta.definitions, self.velocity_names, strict=True)
        excess = total([*(e for e in known if e is not None), *(-p * symbol(v) for p, v in pairs)])
        at_rest = excess
        with suppress(ExpressionError):
            at_rest = substitute(excess, dict.fromkeys(self.velocity_names, ZERO))
        return tidy(at_rest if is_zero(excess - at_rest) else excess)

    @cached_property
    def energy(self) -> Expr | None:
        """T + V as a function of coordinates and momenta."""
        excess, hamiltonian = self.energy_excess, self.hamiltonian
        if excess is None or hamiltonian is None or self.velocities is None or excess.is_zero:
            return None if excess is None else hamiltonian
        solved = dict(zip(self.velocity_names, self.velocities, strict=True))
        return tidy(hamiltonian + substitute(excess, solved))


@dataclass(frozen=True, slots=True)
class _Task:
    """A document to derive, known by its `key`: all of it but the values of its parameters."""

    key: str
    document: Document = field(compare=False)
    values: Mapping[str, Expr] = field(compare=False)


def derive(document: Document) -> Derivation:
    """Derive Hamilton's equations, or take the last ones where only values of parameters differ.

    Raises DocumentError where there is no system, ComputationError where its Lagrangian is degenerate.
    """
    try:
        values = known_values(document)
        derived = {name: e for name, e in document.definitions.items() if e is not None and e.names}
        # Roots of positive parameters are shorter, so that signs count.
        negative = [name for name, e in values.items() if float(e) <= 0]
        key = repr((document.system, derived, *values, negative))
        derivation, known = _last(_Task(key, document, values))
        if derivation.momenta is None or known == values:
            return derivation
        if not derivation.branches or any(branch.region for branch in derivation.branches):
            return _worked(document, values)
        _require_regular(derivation.momenta, derivation.phase, derivation.velocity_names, values)
        return derivation
    except ExpressionError as error:
        raise ComputationError(f"the momenta cannot be worked out: {error.message}") from error


@lru_cache(maxsize=1)
def _last(task: _Task) -> tuple[Derivation, Mapping[str, Expr]]:
    """A derivation, and the values of parameters for which it was made."""
    return _worked(task.document, task.values), task.values


def _worked(document: Document, values: Mapping[str, Expr]) -> Derivation:
    functions, system = system_functions(document), document.system
    assert system is not None
    if functions.lagrangian is None and functions.constraints:
        functions = _with_lagrangian(functions, system)
    derivation = Derivation(Phase(system.coordinates, system.momenta), system.velocities, functions)
    if functions.lagrangian is None:
        return derivation
    momenta = canonical_momenta(functions.lagrangian, system.velocities)
    _require_regular(momenta, derivation.phase, system.velocities, values)
    return _inverted(replace(derivation, momenta=momenta), values)


def _with_lagrangian(functions: SystemFunctions, system: System) -> SystemFunctions:
    """Add L to a system that is given by H: constraints are conditions on velocities.

    L is to H as H is to L: the transform that leads from one to the other leads back.
    """
    assert functions.hamiltonian is not None
    found = legendre_transform(functions.hamiltonian, system.momenta, system.velocities)
    if len(found) != 1:
        raise ComputationError(
            "H has no one Lagrangian in closed form, which constraints need",
            hint="give a `lagrangian` instead of the `hamiltonian`",
        )
    return functions._replace(lagrangian=found[0].hamiltonian, hamiltonian=None)


def on_this_side(derivation: Derivation, values: Mapping[str, float]) -> Derivation:
    """The derivation again, if one of its branches is written for other signs than these values have."""
    if all(e.evaluate(**values) > 0 for branch in derivation.branches for e in branch.region):
        return derivation
    return _inverted(derivation, {name: number(Fraction(value)) for name, value in values.items()})


def _inverted(derivation: Derivation, values: Mapping[str, Expr]) -> Derivation:
    """Add the solutions of p = dL/dv for the velocities that pass the check at random points."""
    phase, velocities = derivation.phase, derivation.velocity_names
    lagrangian, momenta = derivation.system.lagrangian, derivation.momenta
    assert lagrangian is not None
    assert momenta is not None
    branches, residuals = list[Branch](), list[float]()
    moving, sums = squares(derivation.system.particles, phase.coordinates), derivation.system.sums
    for branch in legendre_transform(lagrangian, velocities, phase.momenta, values, momenta, moving, sums):
        decided = [e.names for e in branch.region if e.names <= values.keys()]
        fixed = {name: values[name].evaluate() for names in decided for name in names}
        residual = _residual_of(lagrangian, momenta, branch, phase, velocities, fixed)
        if residual is None or residual < MOST_RESIDUAL:
            branches.append(branch)
            residuals += [] if residual is None else [residual]
    conditions = [e for e in (branches[0].region if branches else ()) if not e.names <= values.keys()]
    notes = [f"H is written for {inequality(e)}" for e in conditions]
    if not branches and momenta.are_linear(velocities):
        notes.append("H is too long to be worked out in symbols; orbits solve for the velocities in numbers")
    elif not branches:
        notes.append("no closed form of the velocities in the momenta was found, so that H is not written")
    elif not _is_short(branches[0]):
        notes.append("Hamilton's equations are too long to be worked out in symbols")
    worst = max(residuals, default=None)
    return replace(
        derivation,
        branches=tuple(branches),
        residual=worst,
        notes=tuple(notes),
        conditions=tuple(conditions),
    )


def _require_regular(
    momenta: Momenta, phase: Phase, velocities: tuple[str, ...], values: Mapping[str, Expr]
) -> None:
    """Raise ComputationError if the mass matrix is singular, for all values of the parameters or these."""
    matrix, size = momenta.mass_matrix, len(velocities)
    names = {name for row in matrix for entry in row for name in entry.names}
    fixed = {name: value for name, value in values.items() if name in names}
    mass_rank = rank(matrix, {})
    if mass_rank is not None and mass_rank < size:
        limits = primary_constraints(matrix, momenta.definitions, velocities, phase.momenta)
        shown = "; ".join(f"{limit} = 0" for limit in limits)
        raise ComputationError(
            f"the Lagrangian is degenerate: its mass matrix has rank {mass_rank} of {size}"
            + (f"; primary constraints: {shown}" if shown else ""),
            hint="dL/dv cannot be solved for v: the mass matrix is singular, so that there is no Hamiltonian",
        )
    mass_rank = rank(matrix, fixed) if fixed else size
    if mass_rank is not None and mass_rank < size:
        shown = ", ".join(f"{name} = {value}" for name, value in fixed.items())
        raise ComputationError(
            f"the mass matrix has rank {mass_rank} of {size} at the given values ({shown}), "
            "so that dL/dv cannot be solved for v"
        )


def _is_short(branch: Branch) -> bool:
    """Whether H and the velocities have at most MOST_NODES_OF_H."""
    return sum(e.nodes for e in (branch.hamiltonian, *branch.velocities)) <= MOST_NODES_OF_H


def _residual_of(
    lagrangian: Expr,
    momenta: Momenta,
    branch: Branch,
    phase: Phase,
    velocities: tuple[str, ...],
    fixed: Mapping[str, float],
) -> float | None:
    """The largest relative error of a branch at random points; None if no point has values.

    Letters without a `fixed` value are random. The branch must give back v from p = dL/dv, and -dH/dq must be
    dL/dq; or H must be p v - L, where H is long. Points that lie on another branch are left out.
    """
    if _is_short(branch):
        expected = [derivative(lagrangian, q) for q in phase.coordinates]
        from_branch = [-derivative(branch.hamiltonian, q) for q in phase.coordinates]
    else:
        pairs = zip(momenta.definitions, velocities, strict=True)
        expected, from_branch = [total(p * symbol(v) for p, v in pairs) - lagrangian], [branch.hamiltonian]
    expected = [*momenta.definitions, *expected]
    from_branch = [*branch.velocities, *from_branch]
    names = lagrangian.names | branch.hamiltonian.names
    shared = [*sorted(names - {*phase.names, *velocities, TIME}), TIME, *phase.coordinates]
    # Where L has no value, as beyond a limiting speed, p may have one.
    trees = [plain_tree(e) for e in (*expected, lagrangian)]
    from_velocities = code.function(trees, [*shared, *velocities], {})(math)
    limits = (*branch.conditions, *branch.region)
    trees = [plain_tree(e) for e in (*from_branch, *limits)]
    from_momenta = code.function(trees, [*shared, *phase.momenta], {})(math)
    size, worst, seen = len(velocities), 0.0, 0
    for place, point in enumerate(sample_points([*shared, *velocities], fixed)):
        if place % 2:
            point |= {name: -point[name] for name in velocities}
        v = np.array([point[name] for name in velocities])
        try:
            known = np.array(from_velocities(*point.values()))[:-1]
            reached = np.array(from_momenta(*(point[name] for name in shared), *known[:size]))
        except NO_VALUE:
            continue
        values, signs = np.split(reached, [len(from_branch)])
        if not np.isfinite([*known, *reached]).all() or (signs <= 0).any():
            continue
        miss = max(_miss(v, values[:size]), _miss(known[size:], values[size:]))
        if not branch.conditions or miss <= MOST_RESIDUAL:
            worst, seen = max(worst, miss), seen + 1
        if seen == CHECKED_POINTS:
            break
    return worst if seen else None


def _miss(a: Floats, b: Floats) -> float:
    scale = max(np.abs(a).max(), np.abs(b).max())
    return float(np.abs(a - b).max() / scale) if scale else 0.0
