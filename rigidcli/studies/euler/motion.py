"""The motion that a document asks for, as an initial-value problem, and the trajectory that solves it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from rigidcli.bodies.form import Quaternion
from rigidcli.core import rotation
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.free_body import Periods
from rigidcli.core.precession import cosine, sine, steady
from rigidcli.core.principal import PrincipalFrame, principal_frame
from rigidcli.core.tensor import rotate, without_rounding
from rigidcli.document.document import Document
from rigidcli.document.motion import Motion, OwnTorque, Top, Weight
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ComputationError, DocumentError
from rigidcli.report import NOISE, Column, Table
from rigidcli.studies.body import principal_omega, require_spin
from rigidcli.studies.common import RESULTS, noise, require_values

# The work and the impulse of a torque until each time (n, 4), in given units of L and of omega.
Gained: TypeAlias = Callable[[float, float], Floats]
# The results at each time, in the order of their columns.
QUANTITIES = tuple(field for field in RESULTS["euler"] if field.key.startswith("trajectory."))
# The quantities that people see only if they ask for them.
HIDDEN_QUANTITIES = {"angular_momentum", "orientation", "angular_momentum_space"}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class InitialValueProblem:
    """The problem for Euler's equations, in components along the document's axes, which the body carries.

    `tensor` is about O, `orientation` (4) turns the document's axes to those of space at t = 0. `weight`
    is M g R (3, N m), the arm from O to the centre of mass times the weight; zero for none. `shown` (3 by
    3) has as columns the axes of the results, and `frame` is the principal frame along these. `third` (3)
    is the axis (ux, uy, uz) in a torque: that of a top, or e3 as it is printed. `carried` has as columns
    (3 by 3) the axes whose Euler angles are asked for: the axes of the results, or of a top, the last
    along its symmetry axis. `angles` is the sequence of these angles, None for none.
    """

    tensor: Floats
    omega: Floats
    orientation: Floats
    weight: Floats
    torque: OwnTorque | None
    times: Floats
    shown: Floats
    frame: PrincipalFrame
    third: Floats
    carried: Floats
    angles: str | None
    tolerance: float
    notes: tuple[str, ...]


def initial_value_problem(document: Document) -> InitialValueProblem:
    """The problem that a document poses by its `motion.omega`, or by its `top`.

    Raises DocumentError where it poses none, or one that a body cannot have.
    """
    motion = document.motion or Motion()
    require_values(document, "a motion in time")
    if motion.omega is not None:
        return _of_body(document, motion)
    if document.top is not None:
        return _of_top(document, motion, document.top)
    missing = "body" if document.body is None else "motion.omega"
    raise document.refusal("missing", missing, hint="`euler` needs a `body` and `motion.omega`, or a `top`")


def _of_body(document: Document, motion: Motion) -> InitialValueProblem:
    if document.body is None:
        raise document.refusal("missing, expected a body", "body")
    physical, frame = document.physical, document.physical.frame
    axes = physical.axes @ frame.axes.T
    along = principal_omega(document, frame)
    omega = axes @ along if motion.basis == "principal" else np.array(motion.omega)
    notes: list[str] = []
    if document.top is not None:
        notes.append("`motion.omega` is given, so that `top` is not used")
    weight = np.zeros(3)
    if isinstance(motion.torque, Weight):
        body = physical.properties
        if body.mass is None:
            raise document.refusal("missing: a weight needs it", "body.mass")
        weight = (body.com - physical.point) * body.mass * motion.torque.gravity
        if not weight.any():
            notes.append("the body is held at its centre of mass, so that its weight has no torque")
    torque = motion.torque if isinstance(motion.torque, OwnTorque) else None
    if len(frame.groups[-1]) > 1 and torque is not None and torque.names & {"ux", "uy", "uz"}:
        notes.append("e3 is not unique, as its moment equals another: `ux uy uz` are the one that is printed")
    orientation = rotation.as_quaternion(physical.orientation)
    if isinstance(motion.orientation, Quaternion):  # which keeps the sign that is given
        given = np.array(motion.orientation.quaternion)
        orientation = given / FLOAT.hypot(*given)
    return _problem(
        motion,
        None,
        bool(weight.any()),
        notes,
        tensor=physical.tensor,
        omega=omega,
        orientation=orientation,
        weight=weight,
        torque=torque,
        shown=physical.axes,
        frame=frame,
        third=axes[:, 2],
        carried=physical.axes,
        angles=motion.angles,
    )


def _of_top(document: Document, motion: Motion, section: Top) -> InitialValueProblem:
    """The problem of a top with phi = psi = 0 at t = 0, so that it leans towards -y of space."""
    from rigidcli.core.nutation import nutation

    top, tilt = document.physical.heavy_top, section.tilt
    lambda1, lambda3, spin = top.lambda1, top.lambda3, section.spin
    if tilt is None or lambda1 is None:
        missing = [key for key, value in (("tilt", tilt), ("lambda1", lambda1)) if value is None]
        raise DocumentError([document.problem("missing: `euler` needs it", f"top.{key}") for key in missing])
    if motion.orientation is not None or isinstance(motion.torque, Weight):
        key = "orientation" if motion.orientation is not None else "torque.gravity"
        raise document.refusal("the `top` tells this already", f"motion.{key}")
    require_spin(document, section, top)
    fall, precession = top.mass * section.gravity * top.distance, section.precession
    if precession is None:
        rates = steady(lambda1, lambda3, spin, tilt, fall, FLOAT)
        precession = rates.slow
        if precession is None:
            raise ComputationError(
                "there is no steady precession at this spin and tilt",
                hint=f"it takes a spin of {rates.minimum_spin:.6g} rad/s" if rates.minimum_spin else None,
            )
    across, upward = sine(tilt, FLOAT), cosine(tilt, FLOAT)
    omega = np.array([section.nutation, precession * across, spin])
    axes = rotation.onto(tuple(top.axis), FLOAT)
    tilted = np.array([[1.0, 0, 0], [0, upward, -across], [0, across, upward]])
    tensor = without_rounding(rotate(np.diag([lambda1, lambda1, lambda3]), axes))
    period = nutation(lambda1, lambda3, spin, tilt, precession, section.nutation, fall).period
    physical = document.physical
    return _problem(
        motion,
        period,
        period is not None,
        top.remarks,
        tensor=tensor,
        omega=axes @ omega,
        orientation=rotation.as_quaternion(tilted @ axes.T),
        weight=top.axis * fall,
        torque=motion.torque if isinstance(motion.torque, OwnTorque) else None,
        shown=physical.axes,
        frame=principal_frame(physical.along_axes(tensor)),
        third=axes[:, 2],
        carried=axes,
        angles=motion.angles or "zxz",
    )


def _problem(
    motion: Motion, nutation: float | None, pulled: bool, notes: Sequence[str], **state: Any
) -> InitialValueProblem:
    """The problem of a body in this `state`, with the times to show, and a note where these are not given.

    By default a top whose `nutation` has a period (s) moves for three of these, enough to see it repeat.
    Another body makes ten turns, or moves for a second where it does not turn yet. A body at rest that
    nothing has `pulled` needs no note.
    """
    rate, duration, words = FLOAT.hypot(*state["omega"]), 1.0, "1 s is"
    if nutation is not None:
        duration, words = 3 * nutation, "3 nutations are"
    elif rate:
        duration, words = 2 * math.pi * 10 / rate, "10 turns are"
    elif state["torque"] is None and not pulled:
        words = ""
    if words and motion.duration is None and motion.times is None:
        notes = (*notes, f"`motion.duration` is not given: {words} shown")
    tolerance = motion.tolerance or DEFAULT_TOLERANCE
    times = motion.instants(duration)
    return InitialValueProblem(times=times, tolerance=tolerance, notes=tuple(notes), **state)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """omega along the document's axes (n, 3) and orientation (n, 4) at the times (n) of the problem.

    `free` has the kind and the periods of the motion where no torque acts. `drift` has the largest errors of
    the balances of energy and of angular momentum about O, in units of the largest of these, and of the
    length of the quaternions.
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
        return self.omega @ self.problem.tensor

    @cached_property
    def momentum_in_space(self) -> Floats:
        """Angular momentum about O (n, 3), along the axes of space."""
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
                hidden = key in HIDDEN_QUANTITIES or (key == "kinetic_energy" and self.free is not None)
                cells = tuple(field.cells)
                columns.append(Column(key, values[key], cells, field.unit, symbols, hidden, size))
        own = "the body" if np.array_equal(axes, np.eye(3)) else "`frame`"
        title = f"the motion: 1, 2, 3 are the axes x, y, z of {own}, which turn with it"
        return Table("trajectory", title, tuple(columns), data=True)


def drift_of(
    problem: InitialValueProblem, omega: Floats, orientation: Floats, gained: Gained | None = None
) -> dict[str, float]:
    """The errors of the balances of a motion (n, 3 and n, 4), in units of the largest energy and |L|.

    `gained` gives the work and the impulse of a torque so far. Without it the energy is conserved, and the
    angular momentum in space, of which under weight the vertical component is.
    """
    momentum = omega @ problem.tensor
    fast, size = np.abs(omega).max(), np.abs(momentum).max()
    if not size:
        return {"energy": 0.0, "angular_momentum": 0.0, "quaternion": 0.0}
    omega, momentum = omega / fast, momentum / size  # squares of tiny numbers would vanish
    kinetic = np.einsum("ij,ij->i", omega, momentum) / 2
    space = rotation.turned(orientation, momentum)
    work = np.zeros_like(kinetic)
    if gained is not None:
        gains = gained(size, fast)
        work, space = gains[:, 0], space - gains[:, 1:]
    elif problem.weight.any():
        height = rotation.turned(orientation, problem.weight / size / fast)[:, 2]
        work, space = height[0] - height, space[:, 2:]
    change = kinetic - kinetic[0] - work
    scale = np.abs(kinetic).max() + np.abs(work).max()
    length = np.linalg.norm(orientation, axis=1)
    errors = np.abs(change) / scale, np.linalg.norm(space - space[0], axis=1), np.abs(length - 1)
    names = "energy", "angular_momentum", "quaternion"
    return {n: float(np.nan_to_num(e, nan=1.0).max()) for n, e in zip(names, errors, strict=True)}
