"""The trajectory that solves an initial-value problem, and how well it keeps the conservation laws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.free_body import Periods
from rigidcli.studies.euler.initial import InitialValueProblem


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
        return _kinetic(self.omega, self.momentum)


def drift_of(problem: InitialValueProblem, omega: Floats, orientation: Floats) -> dict[str, float]:
    """The drift of a motion (n, 3 and n, 4) without torque, or under weight alone.

    What is conserved is the energy, and the angular momentum in space; under weight, its vertical component.
    """
    momentum = problem.inertia.momentum(omega)
    fast, size = np.abs(omega).max(), np.abs(momentum).max()
    if not size:
        return {"energy": 0.0, "angular_momentum": 0.0, "quaternion": 0.0}
    omega, momentum = omega / fast, momentum / size  # squares of tiny numbers would vanish
    kinetic = _kinetic(omega, momentum)
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


def _kinetic(omega: Floats, momentum: Floats) -> Floats:
    energy: Floats = np.einsum("ij,ij->i", omega, momentum) / 2
    return energy
