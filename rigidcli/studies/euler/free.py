"""Torque-free motion, in closed form."""

from __future__ import annotations

from rigidcli.core import freebody
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, closed_form


def free_trajectory(problem: InitialValueProblem) -> Trajectory:
    """The trajectory of a body on which no torque acts, by Jacobi's elliptic functions."""
    given = (problem.tensor, problem.omega, problem.orientation)
    free = freebody.free_motion(*given)
    error = freebody.sensitivity(*given, problem.times)
    return closed_form(problem, *freebody.at(free, problem.times), error, free)
