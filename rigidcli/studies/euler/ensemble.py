"""Free motions of one body from many starts, in closed form and as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from rigidcli.core import freebodies, rotation
from rigidcli.core.solution import digits
from rigidcli.model.document import Document
from rigidcli.model.motion import QUATERNION, RATES
from rigidcli.report import Column, Report, Table
from rigidcli.studies.common import report
from rigidcli.studies.ensembles import Found
from rigidcli.studies.euler.columns import trajectory_table
from rigidcli.studies.euler.initial import initial_value_problem
from rigidcli.studies.euler.trajectory import CLOSED_FORM, Trajectory

SCHEMA = "rigidcli.euler/1"


def is_free(document: Document) -> bool:
    """Whether the motion of a document with one start is worked here: it is free, and of no linear body."""
    problem = initial_value_problem(document)
    driven = problem.torque is not None or problem.weight.any() or problem.angles is not None
    return not driven and bool(problem.frame.moments[0] > 0)


def samples_of(document: Document, places: range, sampling: Mapping[str, object]) -> Iterator[Found]:
    """The samples of the motions from the starts at these places, and what is wrong with others."""
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
        given = ensemble.values[own][:, [names.index(name) for name in QUATERNION]]
        given = given / np.abs(given).max(axis=1, keepdims=True)
        orientations = given / np.linalg.norm(given, axis=1, keepdims=True)
    turn, times = rotation.as_quaternion(body.axes), problem.times
    omega, orientation, failures = freebodies.motions(
        body, omegas @ body.axes, rotation.compose(orientations, turn), times
    )
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
    yield places.start, _report(document, replace(samples, columns=(start, *samples.columns)), problem.notes)


def _report(document: Document, samples: Table, notes: tuple[str, ...]) -> Report:
    return report(document, SCHEMA, "motion by Euler's equations", (), notes, (samples,))
