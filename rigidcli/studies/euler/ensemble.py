"""Free motions of one body from many starts, in closed form and as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from rigidcli.core import freebodies, rotation
from rigidcli.core.solution import digits
from rigidcli.document.document import Document
from rigidcli.document.motion import QUATERNION, RATES
from rigidcli.report import Column
from rigidcli.studies.common import report
from rigidcli.studies.ensembles import Found, Sampling
from rigidcli.studies.euler.columns import trajectory_table
from rigidcli.studies.euler.initial import initial_value_problem
from rigidcli.studies.euler.trajectory import CLOSED_FORM, Trajectory
from rigidcli.studies.results import told

SCHEMA = "rigidcli.euler/1"


def together(document: Document, sampling: Sampling) -> Callable[[range], Iterator[Found]] | None:
    """What works the free motions from some starts; None for driven ones, and for a linear body."""
    problem = initial_value_problem(document.start(0, **sampling))
    driven = problem.torque is not None or problem.weight.any() or problem.angles is not None
    if driven or not problem.frame.moments[0] > 0:
        return None
    return partial(_samples, document, sampling)


def _samples(document: Document, sampling: Sampling, places: range) -> Iterator[Found]:
    """The samples of the motions from the starts at these places, and what is wrong with others.

    Where the `sampling` is changed, for a summary, the digits that can be trusted are told, too.
    """
    problem = initial_value_problem(document.start(places.start, **sampling))
    ensemble, body, motion = document.ensemble, problem.inertia, document.motion
    assert ensemble is not None
    assert motion is not None
    own = slice(places.start, places.stop)
    names = list(ensemble.names)
    omegas = ensemble.values[own][:, [names.index(name) for name in RATES]]
    if motion.basis == "principal":
        axes = document.physical.axes @ problem.frame.axes.T
        omegas = np.array([axes @ along for along in omegas])
    orientations = np.tile(problem.orientation, (len(places), 1))
    if QUATERNION[0] in names:
        told_of = ensemble.values[own][:, [names.index(name) for name in QUATERNION]]
        scaled = told_of / np.abs(told_of).max(axis=1, keepdims=True)
        orientations = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    turn, times = rotation.as_quaternion(body.axes), problem.times
    given = (body, omegas @ body.axes, rotation.compose(orientations, turn), times)
    omega, orientation, failures = freebodies.motions(*given)
    omega = omega @ body.axes.T
    orientation = rotation.compose(orientation, turn * [1, -1, -1, -1])
    omega[:, times == 0] = omegas[:, None]
    orientation[:, times == 0] = orientations[:, None]
    for place, error in failures.items():
        yield places[place], error
    kept = np.setdiff1d(np.arange(len(places)), list(failures))
    if not len(kept):
        return
    together = Trajectory(
        replace(problem, times=np.tile(times, len(kept))),
        omega[kept].reshape(-1, 3),
        orientation[kept].reshape(-1, 4),
        None,
        CLOSED_FORM,
        0,
        digits(0.0),
        {},
    )
    samples = trajectory_table(together)
    start = Column("start", np.repeat(places.start + kept, len(times)), ("start",))
    table = replace(samples, columns=(start, *samples.columns))
    fields = []
    if sampling:
        largest = float(np.nanmax(freebodies.sensitivity(*given)))
        fields.append(told("euler", "trusted_digits", digits(largest), diagnostic=True))
    yield (
        places.start,
        report(document, SCHEMA, "motion by Euler's equations", fields, problem.notes, (table,)),
    )
