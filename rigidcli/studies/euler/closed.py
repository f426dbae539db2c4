"""Motions in closed form: free bodies, from one start or many, and symmetric tops under their weight."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import free_body, heavy_top, rotation
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.solution import digits
from rigidcli.core.tensor import rotate
from rigidcli.document.document import Document
from rigidcli.document.motion import QUATERNION, RATES
from rigidcli.studies.common import field_of, report
from rigidcli.studies.ensembles import Form, StartReport, with_start
from rigidcli.studies.euler.motion import InitialValueProblem, Trajectory, drift_of, initial_value_problem

if TYPE_CHECKING:
    from rigidcli.studies.euler.driven import Samples, Starts

CLOSED_FORM = "closed form"  # the name of the method where nothing is integrated
# How far rounding takes the tensor of a symmetric top from its form, in units of its largest entry.
SYMMETRIC = 1e-14


def closed_form(problem: InitialValueProblem) -> Trajectory | None:
    """The trajectory of a free body, or of a symmetric top under its weight; None for other motions."""
    if problem.torque is not None:
        return None
    if problem.weight.any():
        return _heavy_top(problem)
    given = problem.tensor, problem.omega[None], problem.orientation[None], problem.times
    omega, orientation = free_body.motions(*given)
    free, error = free_body.periods(problem.tensor, problem.omega), free_body.sensitivity(*given)
    return _trajectory(problem, omega[0], orientation[0], float(error[0]), free)


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
    # The rounding of the formulas turns it by as much again.
    return Trajectory(problem, omega, orientation, free, CLOSED_FORM, 0, digits(2 * error), drift)


def _heavy_top(problem: InitialValueProblem) -> Trajectory | None:
    """The trajectory of a body under its weight, where it is a symmetric top about the arm; else None."""
    axes = rotation.onto(tuple(problem.weight), FLOAT)
    local = rotate(problem.tensor, axes.T)
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
    orientation = rotation.continuous(rotation.compose(orientation, rotation.inverse(turn)))
    error = math.hypot(heavy_top.sensitivity(*given, problem.times), motion.rounding(problem.times))
    return _trajectory(problem, omega @ axes.T, orientation, error)


def together(document: Document, form: Form) -> Callable[[range], Iterator[StartReport]] | None:
    """A function for free or driven motions from some starts as arrays; None where each is worked alone.

    The reports for a summary have the trusted digits, too.
    """
    if form == "starts":
        return None
    problem = initial_value_problem(document.start(0))
    if problem.angles is not None or not problem.frame.moments[0] > 0:
        return None
    starts = partial(_starts, document, problem)
    followed: Samples = partial(_free, starts, form)
    if problem.torque is not None or problem.weight.any():
        if problem.torque is None and _heavy_top(problem) is not None:
            return None
        from rigidcli.studies.euler import driven

        several = driven.together(document, problem, starts)
        if several is None:
            return None
        followed = several

    def samples(places: range) -> Iterator[StartReport]:
        omega, orientation, error, alone = followed(places)
        given, beginning = starts(places), problem.times == 0
        omega[:, beginning], orientation[:, beginning] = given.omega[:, None], given.orientation[:, None]
        for is_alone, group in groupby(range(len(places)), key=lambda index: bool(alone[index])):
            some = list(group)
            if is_alone:
                yield from ((places[index], None) for index in some)
                continue
            every = replace(problem, times=np.tile(problem.times, len(some)))
            states = omega[some].reshape(-1, 3), orientation[some].reshape(-1, 4)
            exactly = digits(0.0)  # nothing is rounded for people here
            table = Trajectory(every, *states, None, CLOSED_FORM, 0, exactly, {}).samples()
            fields = []
            if form == "few":
                least = digits(float(error[some].max()))
                fields.append(field_of("euler", "trusted_digits", least, diagnostic=True))
            tables = (with_start(table, np.array(places)[some]),)
            yield places[some[0]], report(document, "euler", fields, problem.notes, tables)

    return samples


def _free(starts: Starts, form: Form, places: range) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """What `together` of driven motions gives, of free ones; the errors are those for a summary."""
    some = starts(places)
    given = some.tensor, some.omega, some.orientation, some.times
    error = 2 * free_body.sensitivity(*given) if form == "few" else np.zeros(len(places))
    return *free_body.motions(*given), error, np.zeros(len(places), dtype=bool)


def _starts(document: Document, problem: InitialValueProblem, places: range) -> InitialValueProblem:
    """The problem with omega (m, 3) and orientation (m, 4) of the starts at these places."""
    ensemble, motion = document.ensemble, document.motion
    assert ensemble is not None
    assert motion is not None
    values, names = ensemble.values[places.start : places.stop], list(ensemble.names)
    omegas = values[:, [names.index(name) for name in RATES]]
    if motion.basis == "principal":
        omegas = omegas @ (document.physical.axes @ problem.frame.axes.T).T
    if QUATERNION[0] not in names:
        return replace(problem, omega=omegas, orientation=np.tile(problem.orientation, (len(places), 1)))
    given = values[:, [names.index(name) for name in QUATERNION]]
    scaled = given / np.abs(given).max(axis=1, keepdims=True)
    orientations = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return replace(problem, omega=omegas, orientation=orientations)
