"""Motions in closed form: free bodies, from one start or many, and symmetric tops under their weight."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from rigidcli.core import free_body, heavy_top, rotation
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.solution import digits
from rigidcli.core.tensor import Inertia
from rigidcli.document.document import Document
from rigidcli.document.motion import QUATERNION, RATES
from rigidcli.report import Column
from rigidcli.studies.common import report
from rigidcli.studies.ensembles import Found, Sampling
from rigidcli.studies.euler.columns import trajectory_table
from rigidcli.studies.euler.initial import InitialValueProblem, initial_value_problem
from rigidcli.studies.euler.trajectory import Trajectory, drift_of
from rigidcli.studies.results import told

CLOSED_FORM = "closed form"
"""The name of the method where nothing is integrated."""

SYMMETRIC = 1e-14
"""How far rounding takes the tensor of a symmetric top from its form, in units of its largest entry."""


def closed_form(problem: InitialValueProblem) -> Trajectory | None:
    """The trajectory of a free body, or of a symmetric top under its weight; None for other motions."""
    if problem.torque is not None:
        return None
    return _heavy_top(problem) if problem.weight.any() else _free(problem)


def _trajectory(
    problem: InitialValueProblem,
    omega: Floats,
    orientation: Floats,
    error: float,
    free: free_body.Periods | None = None,
) -> Trajectory:
    """A trajectory in closed form; one rounding of the input turns its orientation by `error` (rad)."""
    beginning = problem.times == 0
    omega[beginning], orientation[beginning] = problem.omega, problem.orientation
    drift = drift_of(problem, omega, orientation)
    return Trajectory(problem, omega, orientation, free, CLOSED_FORM, 0, _digits(error), drift)


def _digits(error: float) -> float:
    """Trusted digits where the inputs' rounding makes this error (rad), and that of the formulas as much."""
    return digits(2 * error)


def along_entries(problem: InitialValueProblem) -> tuple[Inertia, Floats, Floats]:
    """The body, omega (1, 3) and orientation (1, 4) along the axes of the tensor's entries."""
    body = problem.inertia
    turned = rotation.compose(problem.orientation, rotation.as_quaternion(body.axes))
    return body, (problem.omega @ body.axes)[None], turned[None]


def _free(problem: InitialValueProblem) -> Trajectory:
    """The trajectory of a body on which no torque acts, by Jacobi's elliptic functions."""
    body, omegas, _ = given = along_entries(problem)
    free = free_body.periods(body, omegas[0])
    error = float(free_body.sensitivity(*given, problem.times)[0])
    omega, orientation = free_body.motions(*given, problem.times)
    turn = rotation.as_quaternion(body.axes)
    orientation = rotation.compose(orientation[0], turn * [1, -1, -1, -1])
    return _trajectory(problem, omega[0] @ body.axes.T, orientation, error, free)


def _heavy_top(problem: InitialValueProblem) -> Trajectory | None:
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
    motion = heavy_top.heavy_motion(*given)
    omega, orientation = motion.at(problem.times)
    orientation = rotation.continuous(rotation.compose(orientation, turn * [1, -1, -1, -1]))
    error = math.hypot(heavy_top.sensitivity(*given, problem.times), motion.rounding(problem.times))
    return _trajectory(problem, omega @ axes.T, orientation, error)


def together(document: Document, sampling: Sampling) -> Callable[[range], Iterator[Found]] | None:
    """What works the free motions from some starts as arrays; None for driven ones, and for a linear body."""
    problem = initial_value_problem(document.start(0, **sampling))
    driven = problem.torque is not None or problem.weight.any() or problem.angles is not None
    if driven or not problem.frame.moments[0] > 0:
        return None
    return partial(_samples, document, sampling)


def _samples(document: Document, sampling: Sampling, places: range) -> Iterator[Found]:
    """The samples of the motions from the starts at these places.

    Where the `sampling` is changed, for a summary, the digits that can be trusted are told, too.
    """
    problem = initial_value_problem(document.start(places.start, **sampling))
    body, times = problem.inertia, problem.times
    omegas, orientations = _starts(document, problem, places)
    turn = rotation.as_quaternion(body.axes)
    given = (body, omegas @ body.axes, rotation.compose(orientations, turn), times)
    omega, orientation = free_body.motions(*given)
    omega = omega @ body.axes.T
    orientation = rotation.compose(orientation, turn * [1, -1, -1, -1])
    omega[:, times == 0], orientation[:, times == 0] = omegas[:, None], orientations[:, None]
    every = replace(problem, times=np.tile(times, len(places)))
    unknown = digits(0.0)  # nothing is rounded for people here
    samples = trajectory_table(
        Trajectory(every, omega.reshape(-1, 3), orientation.reshape(-1, 4), None, CLOSED_FORM, 0, unknown, {})
    )
    start = Column("start", np.repeat(np.array(places), len(times)), ("start",))
    table = replace(samples, columns=(start, *samples.columns))
    fields = []
    if sampling:
        largest = float(free_body.sensitivity(*given).max())
        fields.append(told("euler", "trusted_digits", _digits(largest), diagnostic=True))
    title = "motion by Euler's equations"
    yield places.start, report(document, "rigidcli.euler/1", title, fields, problem.notes, (table,))


def _starts(document: Document, problem: InitialValueProblem, places: range) -> tuple[Floats, Floats]:
    """omega (m, 3) and orientation (m, 4) at the starts of an ensemble, along the document's axes."""
    ensemble, motion = document.ensemble, document.motion
    assert ensemble is not None
    assert motion is not None
    values, names = ensemble.values[places.start : places.stop], list(ensemble.names)
    omegas = values[:, [names.index(name) for name in RATES]]
    if motion.basis == "principal":
        omegas = omegas @ (document.physical.axes @ problem.frame.axes.T).T
    if QUATERNION[0] not in names:
        return omegas, np.tile(problem.orientation, (len(places), 1))
    given = values[:, [names.index(name) for name in QUATERNION]]
    scaled = given / np.abs(given).max(axis=1, keepdims=True)
    return omegas, scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
