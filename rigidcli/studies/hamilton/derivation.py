"""From what a document says of a system to its momenta and Hamiltonian, checked at random points."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from rigidcli.algebra.arithmetic import inequality
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, has_degrees
from rigidcli.algebra.expressions import ZERO, Expr, number, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import plain_tree
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
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
)
from rigidcli.mechanics.legendre import Momenta, canonical_momenta, legendre_transform
from rigidcli.mechanics.particles import squares, velocity
from rigidcli.mechanics.phase_space import TIME, Phase, equations, is_constant_in, linear, steps
from rigidcli.studies.hamilton.system import SystemFunctions, known_values, system_functions

# A residual of the equations of motion beyond this, in units of their size, is no rounding error.
MOST_RESIDUAL = 1e-6
# The number of random points at which the equations of motion are compared.
CHECKED_POINTS = 3
# The most nodes of H and of the velocities together that are worked with: about ten pages of text.
MOST_NODES_OF_H = 3_000
NO_MOMENTA = Momenta((), ())
# The name of a Cartesian coordinate: its axis, and the number of the particle.
_CARTESIAN = re.compile(r"([xyz])_?(\d*)")
# The last system that was derived, and the values of its parameters, by all of its document but these.
_LAST = dict[str, "tuple[Derivation, Mapping[str, Expr]]"]()


@dataclass(frozen=True, eq=False)
class Derivation:
    """A system, and all that follows from its Lagrangian or Hamiltonian.

    `momenta` are empty where only H is given. `branches` are the solutions of p = dL/dv for the velocities
    that passed the check at random points. H has the form shown where all `conditions` are positive.
    `residual` is the largest relative difference between Hamilton's equations and those of Euler and Lagrange
    at these points; None where there is nothing to compare.
    """

    phase: Phase
    velocity_names: tuple[str, ...]
    system: SystemFunctions
    momenta: Momenta = NO_MOMENTA
    branches: tuple[Branch, ...] = ()
    residual: float | None = None
    notes: tuple[str, ...] = ()
    conditions: tuple[Expr, ...] = ()

    @property
    def sample_keys(self) -> list[tuple[str, str]]:
        """The keys of each coordinate and its momentum in a table of samples."""
        return [(f"q.{q}", f"p.{p}") for q, p in zip(self.phase.coordinates, self.phase.momenta, strict=True)]

    @property
    def branch(self) -> Branch | None:
        """The solution of p = dL/dv for the velocities, if it is the only one."""
        return self.branches[0] if len(self.branches) == 1 else None

    @cached_property
    def are_linear(self) -> bool:
        """Whether the momenta are linear functions of the velocities."""
        polynomials = (coefficients(p, self.velocity_names) for p in self.momenta.definitions)
        return all(has_degrees(polynomial, 0, 1) for polynomial in polynomials)

    @property
    def definitions(self) -> dict[str, Expr]:
        """The momenta as functions of the velocities, by their names; none where only H is given."""
        return dict(zip(self.phase.momenta, self.momenta.definitions, strict=False))

    @property
    def rates(self) -> dict[str, Expr]:
        """The velocities as functions of the momenta, by their names; none where there is no formula."""
        return dict(zip(self.velocity_names, self.equations or (), strict=False))

    @property
    def velocity_of(self) -> dict[str, str]:
        """The names of the velocities, by the coordinates."""
        return dict(zip(self.phase.coordinates, self.velocity_names, strict=True))

    @property
    def energy_of_velocities(self) -> Expr | None:
        """The sum of p v, less L: H as a function of the velocities."""
        if self.system.lagrangian is None:
            return None
        pairs = zip(self.definitions.values(), self.velocity_names, strict=True)
        return total([*(p * symbol(v) for p, v in pairs), -self.system.lagrangian])

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
        size = len(self.phase.coordinates)
        forces = self.forces_of(dict(zip(self.velocity_names, free, strict=False)))
        return (*free[:size], *(rate + force for rate, force in zip(free[size:], forces, strict=True)))

    @cached_property
    def linear(self) -> tuple[Array, Array] | None:
        """A and b where the equations are z' = A z + b; None where they are not linear, or not written."""
        parts = None
        with suppress(ExpressionError):
            if self.equations is not None and not self.system.constraints:
                parts = linear(self.equations, self.phase.names)
        return parts and (np.array(parts[0], dtype=object), np.array(parts[1], dtype=object))

    def forces_of(self, rates: Mapping[str, Expr]) -> list[Expr]:
        """The forces beside L or H where the velocities are these, such as functions of the momenta."""
        return [tidy(substitute(force, rates)) for force in self.system.forces]

    @cached_property
    def lagrange(self) -> LagrangeEquations | None:
        """Lagrange's equations; None where only H is given."""
        lagrangian, names = self.system.lagrangian, tuple(map(acceleration, self.phase.coordinates))
        if lagrangian is None:
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
        return fixed(self.system.constraints, self.velocity_of)

    @property
    def accelerations(self) -> tuple[Expr, ...] | None:
        """Accelerations in coordinates, velocities and t; None where they are too long to read."""
        free, limits = None if self.lagrange is None else self.lagrange.accelerations, self.system.constraints
        return free if free is None or not limits else self.with_multipliers(free)

    def with_multipliers(self, expressions: Iterable[Expr]) -> tuple[Expr, ...] | None:
        """Expressions with the multipliers put in, and with the variables that constraints fix; or None."""
        if self.multipliers is None:
            return None
        names = (one.name for one in self.system.constraints)
        known = self._fixed | dict(zip(names, self.multipliers, strict=True))
        return tuple(tidy(substitute(e, known)) for e in expressions)

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
        rates = self.rates or {name: symbol(name) for name in self.velocity_names}
        work = total(force * v for force, v in zip(self.forces_of(rates), rates.values(), strict=True))
        if limits := self.system.constraints:
            work = substitute(work, dict.fromkeys((one.name for one in limits), ZERO))
            work -= total(one.multiplier * one.rest for one in limits)
        if not self.rates:
            work = substitute(work, self.definitions)
        return derivative(self.generator, TIME) + work

    @property
    def invariants(self) -> tuple[Expr, ...] | None:
        """What is conserved besides H and momenta of cyclic coordinates; None if nothing is looked for."""
        return None if self.named_invariants is None else tuple(e for e, _ in self.named_invariants)

    @cached_property
    def named_invariants(self) -> tuple[tuple[Expr, str | None], ...] | None:
        """The invariants with the names of those that have one."""
        if self.is_forced or self.hamiltonian is None or not self.is_short:
            return None
        if len(self.phase.coordinates) == 1 or self.jumps:
            return ()
        from rigidcli.mechanics.invariants import conserved_quantities, with_names

        found = conserved_quantities(self.hamiltonian, self.phase, [symbol(f"p_{q}") for q in self.cyclic])
        return with_names(found, self.phase, list(self._cartesian_paths()))

    def _cartesian_paths(self) -> Iterator[dict[str, tuple[Expr, Expr]]]:
        """The Cartesian coordinates of each particle with their momenta, by the names of the axes."""
        system, phase = self.system, self.phase
        if system.particles and self.rates:
            rates = self.velocity_of
            for one in system.particles:
                if one.mass is not None:
                    moved = [
                        one.mass * substitute(velocity(path, rates), self.rates) for path in one.position
                    ]
                    yield dict(zip("xyz", zip(one.position, moved, strict=True), strict=False))
            return
        found: dict[str, dict[str, tuple[Expr, Expr]]] = {}
        for q, p in zip(phase.coordinates, phase.momenta, strict=True):
            if (axis := _CARTESIAN.fullmatch(q)) is not None:
                found.setdefault(axis[2], {})[axis[1]] = symbol(q), symbol(p)
        yield from found.values()

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
        kinetic, potential, energy = self.system.kinetic, self.system.potential, self.energy_of_velocities
        if kinetic is None or potential is None or energy is None:
            return None
        at_rest = excess = kinetic + potential - energy
        with suppress(ExpressionError):
            at_rest = substitute(excess, dict.fromkeys(self.velocity_names, ZERO))
        return tidy(at_rest if is_zero(excess - at_rest) else excess)


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
        if key not in _LAST:
            _LAST.clear()
            _LAST[key] = _worked(document, values), values
        derivation, known = _LAST[key]
        if not derivation.definitions or known == values:
            return derivation
        if not derivation.branches or any(branch.region for branch in derivation.branches):
            return _worked(document, values)
        _require_regular(derivation, values)
        return derivation
    except ExpressionError as error:
        raise ComputationError(f"the momenta cannot be worked out: {error.message}") from error


def _worked(document: Document, values: Mapping[str, Expr]) -> Derivation:
    functions, system = system_functions(document), document.system
    assert system is not None
    if functions.hamiltonian is not None and functions.constraints:
        # Constraints are conditions on velocities. L is to H as H is to L: the same transform leads back.
        found = legendre_transform(functions.hamiltonian, system.momenta, system.velocities)
        if len(found) != 1:
            raise ComputationError(
                "H has no one Lagrangian in closed form, which constraints need",
                hint="give a `lagrangian` instead of the `hamiltonian`",
            )
        functions = functions._replace(lagrangian=found[0].hamiltonian, hamiltonian=None)
    derivation = Derivation(Phase(system.coordinates, system.momenta), system.velocities, functions)
    if functions.lagrangian is None:
        return derivation
    momenta = canonical_momenta(functions.lagrangian, system.velocities)
    derivation = replace(derivation, momenta=momenta)
    _require_regular(derivation, values)
    return _inverted(derivation, values)


def on_this_side(derivation: Derivation, values: Mapping[str, float]) -> Derivation:
    """The derivation again, if one of its branches is written for other signs than these values have."""
    if all(e.evaluate(**values) > 0 for branch in derivation.branches for e in branch.region):
        return derivation
    return _inverted(derivation, {name: number(Fraction(value)) for name, value in values.items()})


def _inverted(derivation: Derivation, values: Mapping[str, Expr]) -> Derivation:
    """Add the solutions of p = dL/dv for the velocities that pass the check at random points."""
    phase, velocities, system = derivation.phase, derivation.velocity_names, derivation.system
    assert system.lagrangian is not None
    branches, residuals = list[Branch](), list[float]()
    moving = squares(system.particles, phase.coordinates)
    for branch in legendre_transform(
        system.lagrangian, velocities, phase.momenta, values, derivation.momenta, moving, system.sums
    ):
        decided = [e.names for e in branch.region if e.names <= values.keys()]
        fixed = {name: values[name].evaluate() for names in decided for name in names}
        residual = _residual_of(derivation, branch, fixed)
        if residual is None or residual < MOST_RESIDUAL:
            branches.append(branch)
            residuals += [] if residual is None else [residual]
    conditions = [e for e in (branches[0].region if branches else ()) if not e.names <= values.keys()]
    notes = [f"H is written for {inequality(e)}" for e in conditions]
    if not branches and derivation.are_linear:
        notes.append("H is too long to be worked out in symbols; orbits solve for accelerations in numbers")
    elif not branches:
        notes.append("no closed form of the velocities in the momenta was found, so that H is not written")
    elif not _is_short(branches[0]):
        notes.append("Hamilton's equations are too long to be worked out in symbols")
    return replace(
        derivation,
        branches=tuple(branches),
        residual=max(residuals, default=None),
        notes=tuple(notes),
        conditions=tuple(conditions),
    )


def _require_regular(derivation: Derivation, values: Mapping[str, Expr]) -> None:
    """Raise ComputationError if the mass matrix is singular, for all values of the parameters or these."""
    definitions, matrix = derivation.momenta
    names = {name for row in matrix for entry in row for name in entry.names}
    fixed, size = {name: value for name, value in values.items() if name in names}, len(matrix)
    mass_rank = rank(matrix, {})
    if mass_rank is not None and mass_rank < size:
        phase, velocities = derivation.phase, derivation.velocity_names
        limits = primary_constraints(matrix, definitions, velocities, phase.momenta)
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
    return sum(e.nodes for e in (branch.hamiltonian, *branch.velocities)) <= MOST_NODES_OF_H


def _residual_of(derivation: Derivation, branch: Branch, fixed: Mapping[str, float]) -> float | None:
    """The largest relative error of a branch at random points; None if no point has values.

    Letters without a `fixed` value are random. The branch must give back v from p = dL/dv, and -dH/dq must be
    dL/dq; or H must be p v - L, where H is long. Points that lie on another branch are left out.
    """
    phase, velocities, lagrangian = derivation.phase, derivation.velocity_names, derivation.system.lagrangian
    energy, v = derivation.energy_of_velocities, [symbol(name) for name in velocities]
    assert lagrangian is not None
    assert energy is not None
    if _is_short(branch):
        expected = [derivative(lagrangian, q) for q in phase.coordinates]
        from_branch = [-derivative(branch.hamiltonian, q) for q in phase.coordinates]
    else:
        expected, from_branch = [energy], [branch.hamiltonian]
    both = [*v, *expected], [*branch.velocities, *from_branch]
    # Where L has no value, as beyond a limiting speed, p may have one: L is worked out, too.
    trees = [plain_tree(e) for e in (*both[0], *both[1], *branch.conditions, *branch.region, lagrangian)]
    names = lagrangian.names | branch.hamiltonian.names
    shared = [*sorted(names - {*phase.names, *velocities, TIME}), TIME, *phase.coordinates, *velocities]
    momenta = [(name, plain_tree(p)) for name, p in derivation.definitions.items()]
    function, residuals = code.function(trees, shared, {}, momenta)(math), list[float]()
    for place, point in enumerate(sample_points(shared, fixed)):
        if place % 2:
            point |= {name: -point[name] for name in velocities}
        try:
            values = np.array(function(*point.values()))[:-1]
        except NO_VALUE:
            continue
        known, reached, signs = np.split(values, [len(both[0]), 2 * len(both[0])])
        if not np.isfinite(values).all() or (signs <= 0).any():
            continue
        miss = max(_miss(known[part], reached[part]) for part in (slice(len(v)), slice(len(v), None)))
        if not branch.conditions or miss <= MOST_RESIDUAL:
            residuals.append(miss)
        if len(residuals) == CHECKED_POINTS:
            break
    return max(residuals, default=None)


def _miss(a: Floats, b: Floats) -> float:
    scale = max(np.abs(a).max(), np.abs(b).max())
    return float(np.abs(a - b).max() / scale) if scale else 0.0
