"""The trajectory that solves an initial-value problem, its samples, and the drift of what is conserved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.free_body import Periods
from rigidcli.report import NOISE, Column, Table
from rigidcli.studies.common import noise
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.results import RESULTS

QUANTITIES = tuple(field for field in RESULTS["euler"] if field.key.startswith("trajectory."))
"""The results at each time, in the order of their columns."""

HIDDEN = {"angular_momentum", "orientation", "angular_momentum_space"}
"""The quantities that people are not shown, unless they ask for them."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """omega along the document's axes (n, 3) and orientation (n, 4) at the times (n) of the problem.

    `free` has the kind and the periods of the motion where no torque acts. `drift` is the largest error of
    the energy balance, in units of the largest energy, that of the balance of angular momentum about O, in
    units of the largest, and that of the length of the quaternions.
    """

    problem: InitialValueProblem
    omega: Floats
    orientation: Floats
    free: Periods | None
    method: str
    steps: int
    trusted_digits: float
    drift: dict[str, float]

    @cached_property
    def momentum(self) -> Floats:
        """Angular momentum about O (n, 3), along the document's axes."""
        return self.problem.inertia.momentum(self.omega)

    @cached_property
    def momentum_in_space(self) -> Floats:
        """The same along the axes of space."""
        return rotation.turned(self.orientation, self.momentum)

    @cached_property
    def energy(self) -> Floats:
        """Kinetic energy (n, J)."""
        return np.asarray(np.einsum("ij,ij->i", self.omega, self.momentum) / 2)

    def samples(self) -> Table:
        """The table of the samples, with body components along the axes of the results."""
        problem, axes = self.problem, self.problem.shown
        values = {
            "t": problem.times,
            "omega": self.omega @ axes,
            "angular_momentum": self.momentum @ axes,
            "kinetic_energy": self.energy,
            "orientation": rotation.compose(self.orientation, rotation.as_quaternion(axes)),
            "angular_momentum_space": self.momentum_in_space,
        }
        if problem.angles is not None:
            carried = rotation.compose(self.orientation, rotation.as_quaternion(problem.carried))
            values["angles"] = rotation.euler_angles(carried, problem.angles)
        error, columns = noise(self.trusted_digits), []
        for field in QUANTITIES:
            key = field.key.removeprefix("trajectory.")
            if key in values:
                symbols, size = tuple(field.symbol.split(", ")), NOISE if key == "t" else error
                cells, hidden = tuple(field.cells), key in HIDDEN
                columns.append(Column(key, values[key], cells, field.unit, symbols, hidden, size))
        own = "the body" if np.array_equal(axes, np.eye(3)) else "`frame`"
        title = f"the motion: 1, 2, 3 are the axes x, y, z of {own}, which turn with it"
        return Table("trajectory", title, tuple(columns), data=True)


def drift_of(problem: InitialValueProblem, omega: Floats, orientation: Floats) -> dict[str, float]:
    """The drift of a motion (n, 3 and n, 4) without torque, or under weight alone.

    The energy is conserved, and the angular momentum in space; under weight, its vertical component is.
    """
    momentum = problem.inertia.momentum(omega)
    fast, size = np.abs(omega).max(), np.abs(momentum).max()
    if not size:
        return {"energy": 0.0, "angular_momentum": 0.0, "quaternion": 0.0}
    omega, momentum = omega / fast, momentum / size  # squares of tiny numbers would vanish
    kinetic = np.einsum("ij,ij->i", omega, momentum) / 2
    space = rotation.turned(orientation, momentum)
    potential = np.zeros_like(kinetic)
    if problem.weight.any():
        potential = rotation.turned(orientation, problem.weight / size / fast)[:, 2]
        space = space[:, 2:]
    change = kinetic - kinetic[0] + potential - potential[0]
    scale = np.abs(kinetic).max() + np.abs(potential - potential[0]).max()
    return {
        "energy": float(np.abs(change).max() / scale),
        "angular_momentum": float(np.linalg.norm(space - space[0], axis=1).max()),
        "quaternion": float(np.abs(np.linalg.norm(orientation, axis=1) - 1).max()),
    }
