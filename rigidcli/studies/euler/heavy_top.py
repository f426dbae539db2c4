"""The motion of a symmetric top under its weight (Lagrange's top), in closed form."""

from __future__ import annotations

import numpy as np

from rigidcli.core import lagrange, rotation
from rigidcli.core.arithmetic import FLOAT
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, closed_form

SYMMETRIC = 1e-14
"""How far rounding takes the tensor of a symmetric top from its form, in units of its largest entry."""


def heavy_top_trajectory(problem: InitialValueProblem) -> Trajectory | None:
    """The trajectory of a body under its weight, where it is a symmetric top about the arm; else None."""
    axes = rotation.onto(tuple(problem.weight), FLOAT)
    local = problem.inertia.turned(axes.T).in_space().entries
    lambda1, lambda3 = float(local[0, 0] + local[1, 1]) / 2, float(local[2, 2])
    off = np.abs(local - np.diag([lambda1, lambda1, lambda3])).max()
    if off > SYMMETRIC * np.abs(local).max() or lambda1 <= 0:
        return None
    turn = rotation.as_quaternion(axes)
    given = (
        lambda1,
        lambda3,
        FLOAT.hypot(*problem.weight),
        axes.T @ problem.omega,
        rotation.compose(problem.orientation, turn),
    )
    omega, orientation = lagrange.at(lagrange.heavy_motion(*given), problem.times)
    orientation = rotation.continuous(rotation.compose(orientation, turn * [1, -1, -1, -1]))
    return closed_form(problem, omega @ axes.T, orientation, lagrange.sensitivity(*given, problem.times))
