"""From what a document says of a system to its momenta and Hamiltonian, checked at random points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.studies.hamilton.system import Given, known_values, stated
from rigidcli.symbolic.algebra import samples
from rigidcli.symbolic.algebra.calculus import derivative, substitute
from rigidcli.symbolic.algebra.expressions import PI, ZERO, Expr, symbol, total
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.mechanics import constraints, energies, mass_matrix
from rigidcli.symbolic.mechanics.hamilton_equations import Phase, equations
from rigidcli.symbolic.mechanics.legendre import Branch, Momenta, branches, momenta

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.model.system import System

TIME = energies.TIME

FALSE = 1e-6
"""A residual of the equations of motion beyond this, in units of their size, is no rounding error."""

CHECKS = 3
"""Random points at which the equations of motion are compared."""


PLAIN = {"0": ZERO, "pi/2": PI / 2, "pi": PI}
"""Values of coordinates at which a mass matrix is looked at."""


@dataclass(frozen=True, eq=False)
class Derivation:
    """A system and what follows from it; `momenta` is None where only H is given, `branches` are checked.

    `residual` is the largest difference at random points between Hamilton's equations and those of
    Euler and Lagrange, in units of their size; None where there is nothing to compare.
    """

    phase: Phase
    velocity_names: tuple[str, ...]
    given: Given
    momenta: Momenta | None
    branches: tuple[Branch, ...]
    residual: float | None
    notes: tuple[str, ...] = ()

    @property
    def branch(self) -> Branch | None:
        """The one way from momenta to velocities, if there is just one in closed form."""
        return self.branches[0] if len(self.branches) == 1 else None

    @property
    def hamiltonian(self) -> Expr | None:
        """H(q, p, t), if it is given or has one closed form."""
        return self.given.hamiltonian if self.branch is None else self.branch.hamiltonian

    @cached_property
    def equations(self) -> tuple[Expr, ...] | None:
        """The derivatives of coordinates and momenta by time."""
        if self.hamiltonian is None:
            return None
        solved = None if self.branch is None else self.branch.velocities
        return equations(self.hamiltonian, self.phase, solved)

    @cached_property
    def velocities(self) -> tuple[Expr, ...] | None:
        """The velocities as functions of the momenta."""
        if self.equations is None:
            return None
        return self.equations[: len(self.phase.coordinates)]

    @property
    def mover(self) -> Expr:
        """H, or L where H is not known: coordinates and the time are missing in both or in none."""
        known = self.hamiltonian if self.hamiltonian is not None else self.given.lagrangian
        assert known is not None
        return known

    @cached_property
    def cyclic(self) -> tuple[str, ...]:
        """Coordinates on which nothing depends: their momenta are conserved."""
        return tuple(q for q in self.phase.coordinates if is_zero(derivative(self.mover, q)))

    @cached_property
    def explicit_time(self) -> bool:
        """Whether H depends on the time by itself."""
        return not is_zero(derivative(self.mover, TIME))

    @cached_property
    def excess(self) -> Expr | None:
        """T + V - H as a function of coordinates and velocities; None where T and V are not known."""
        given, definitions = self.given, self.momenta
        if (
            given.kinetic is None
            or given.potential is None
            or given.lagrangian is None
            or definitions is None
        ):
            return None
        carried = total(
            p * symbol(v) for p, v in zip(definitions.definitions, self.velocity_names, strict=True)
        )
        excess = tidy(given.kinetic + given.potential + given.lagrangian - carried)
        return ZERO if is_zero(excess) else excess

    @cached_property
    def energy(self) -> Expr | None:
        """T + V as a function of coordinates and momenta."""
        if self.excess is None or self.hamiltonian is None or self.velocities is None:
            return None
        solved = dict(zip(self.velocity_names, self.velocities, strict=True))
        return (
            self.hamiltonian
            if self.excess.is_zero
            else tidy(self.hamiltonian + substitute(self.excess, solved))
        )


def derive(document: Document) -> Derivation:
    """Everything up to Hamilton's equations.

    Raises DocumentError where there is no system, ComputationError where its Lagrangian is degenerate.
    """
    given = stated(document)
    system = document.system
    assert system is not None
    try:
        return _derived(system, given, known_values(document))
    except ExpressionError as error:
        raise ComputationError(f"the momenta cannot be worked out: {error.message}") from error


def _derived(system: System, given: Given, values: Mapping[str, Expr]) -> Derivation:
    phase = Phase(system.coordinates, system.momenta)
    if given.lagrangian is None:
        return Derivation(phase, system.velocities, given, None, (), None)
    found = momenta(given.lagrangian, system.velocities)
    _require_regular(system, found, values)
    ways = branches(given.lagrangian, system.velocities, system.momenta)
    checked = [(branch, _residual(given.lagrangian, found, branch, phase, system)) for branch in ways]
    good = [(branch, residual) for branch, residual in checked if residual is None or residual < FALSE]
    residuals = [residual for _, residual in good if residual is not None]
    notes = tuple(_singular_points(found, phase))
    if not good:
        notes += ("the velocities have no closed form in the momenta, so that H is not written",)
    return Derivation(
        phase,
        system.velocities,
        given,
        found,
        tuple(branch for branch, _ in good),
        max(residuals, default=None),
        notes,
    )


def _singular_points(found: Momenta, phase: Phase) -> Iterator[str]:
    """Notes on plain values of coordinates at which the momenta do not tell the velocities."""
    for block in mass_matrix.blocks(found.mass_matrix):
        if len(block) > mass_matrix.LARGEST:
            continue
        determinant = tidy(mass_matrix.minor(mass_matrix.part(found.mass_matrix, block, block)))
        for name in phase.coordinates:
            if name not in determinant.names:
                continue
            for shown, value in PLAIN.items():
                with suppress(ExpressionError):
                    if is_zero(substitute(determinant, {name: value})):
                        yield f"the mass matrix is singular where {name} = {shown}"


def _require_regular(system: System, found: Momenta, values: Mapping[str, Expr]) -> None:
    """Raise ComputationError if the velocities do not follow from the momenta."""
    size = len(system.coordinates)
    reached = constraints.rank(found.mass_matrix, {})
    if reached is not None and reached < size:
        limits = constraints.primary_constraints(
            found.mass_matrix, found.definitions, system.velocities, system.momenta
        )
        told = "; ".join(f"{text(to_tree(limit))} = 0" for limit in limits)
        raise ComputationError(
            f"the Lagrangian is degenerate: its mass matrix has rank {reached} of {size}"
            + (f"; primary constraints: {told}" if told else ""),
            hint="the momenta do not tell the velocities, so that there is no Hamiltonian of this kind",
        )
    names = {name for row in found.mass_matrix for entry in row for name in entry.names}
    fixed = {name: value for name, value in values.items() if name in names}
    reached = constraints.rank(found.mass_matrix, fixed) if fixed else size
    if reached is not None and reached < size:
        shown = ", ".join(f"{name} = {text(to_tree(value))}" for name, value in fixed.items())
        raise ComputationError(
            f"the mass matrix has rank {reached} of {size} at the given values ({shown}), "
            "so that the momenta do not tell the velocities"
        )


def _residual(lagrangian: Expr, found: Momenta, branch: Branch, phase: Phase, system: System) -> float | None:
    """How far a branch is from the Euler-Lagrange equations at random points; None if it has no value at any.

    There p = dL/dv must lead back to v, and -dH/dq be dL/dq. A point on another branch says nothing.
    """
    forces = [derivative(lagrangian, q) for q in phase.coordinates]
    ahead = [*found.definitions, *forces]
    back = [*branch.velocities, *(-derivative(branch.hamiltonian, q) for q in phase.coordinates)]
    parameters = sorted(
        {name for e in (lagrangian, branch.hamiltonian) for name in e.names}
        - {*phase.names, *system.velocities, TIME}
    )
    shared = [*parameters, TIME, *phase.coordinates]
    there = code.function([to_tree(e) for e in ahead], [*shared, *system.velocities], {})(math)
    again = code.function([to_tree(e) for e in (*back, *branch.conditions)], [*shared, *phase.momenta], {})(
        math
    )
    size, worst, seen = len(phase.coordinates), 0.0, 0
    for point in samples.points([*shared, *system.velocities], {}):
        v = np.array([point[name] for name in system.velocities])
        try:
            known = np.array(there(*point.values()))
            reached = again(*(point[name] for name in shared), *known[:size])
        except NO_VALUE:
            continue
        if not np.isfinite([*known, *reached]).all() or min(reached[2 * size :], default=1) <= 0:
            continue
        miss = max(
            _miss(v, np.array(reached[:size])), _miss(known[size:], np.array(reached[size : 2 * size]))
        )
        if len(branch.conditions) and miss > FALSE:
            continue
        worst, seen = max(worst, miss), seen + 1
        if seen == CHECKS:
            break
    return worst if seen else None


def _miss(a: Floats, b: Floats) -> float:
    scale = max(np.abs(a).max(), np.abs(b).max())
    return float(np.abs(a - b).max() / scale) if scale else 0.0
