"""The initial-value problem of a document: the body, its state at t = 0, the torque, the times to show."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rigidcli.bodies.rotations import Quaternion
from rigidcli.core import rotation
from rigidcli.core import top as heavytop
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.principal import PrincipalFrame, principal_frame
from rigidcli.core.tensor import Inertia
from rigidcli.document.document import Document
from rigidcli.document.motion import Motion, OwnTorque, Weight
from rigidcli.document.precession import Top
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ComputationError, DocumentError
from rigidcli.studies.body import body_frame, principal_omega, require_spin
from rigidcli.studies.common import require_values

DEFAULT_TURNS = 10
"""Turns of the body that are shown where the document gives no duration: enough to see a wobble repeat."""

DEFAULT_NUTATIONS = 3
"""Nutations of a top that are shown instead, where its nutation has a period."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class InitialValueProblem:
    """What Euler's equations are solved for, in components along the document's axes, which the body carries.

    `inertia` is about O, `orientation` (4) turns the document's axes to those of space at t = 0.
    `weight` is M g R (3, N m), the arm from O to the centre of mass times the weight; zero for none. `shown`
    (3 by 3) has as columns the axes of the results, and `frame` is the principal frame along these. `third`
    (3) is the axis that a torque knows as ux, uy, uz: that of a top, or e3 as it is printed. `carried` has as
    columns (3 by 3) the axes whose Euler angles are told: those of the results, or of a top, the last along
    its symmetry axis. `angles` is their sequence, None for no angles.
    """

    inertia: Inertia
    omega: Floats
    orientation: Floats
    weight: Floats
    torque: OwnTorque | None
    times: Floats
    tolerance: float
    shown: Floats
    frame: PrincipalFrame
    third: Floats
    carried: Floats
    angles: str | None
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
    physical, frame = document.physical, body_frame(document)
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
    may_rest = torque is None and not weight.any()
    times, noted = _times(motion, None, FLOAT.hypot(*omega), may_rest)
    return InitialValueProblem(
        inertia=physical.inertia,
        omega=omega,
        orientation=orientation,
        weight=weight,
        torque=torque,
        times=times,
        tolerance=motion.tolerance or DEFAULT_TOLERANCE,
        shown=physical.axes,
        frame=frame,
        third=axes[:, 2],
        carried=physical.axes,
        angles=motion.angles,
        notes=(*notes, *noted),
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
        steady = heavytop.steady(lambda1, lambda3, spin, tilt, fall, FLOAT)
        precession = steady.slow
        if precession is None:
            raise ComputationError(
                "there is no steady precession at this spin and tilt",
                hint=f"it takes a spin of {steady.minimum_spin:.6g} rad/s" if steady.minimum_spin else None,
            )
    sine, cosine = heavytop.sine(tilt, FLOAT), heavytop.cosine(tilt, FLOAT)
    omega = np.array([section.nutation, precession * sine, spin])
    axes = rotation.onto(tuple(top.axis), FLOAT)
    tilted = np.array([[1.0, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    inertia = Inertia.of(np.diag([lambda1, lambda1, lambda3])).turned(axes)
    period = nutation(lambda1, lambda3, spin, tilt, precession, section.nutation, fall).period
    torque = motion.torque if isinstance(motion.torque, OwnTorque) else None
    may_rest = torque is None and period is None
    times, noted = _times(motion, period, FLOAT.hypot(*omega), may_rest)
    shown = document.physical.axes
    return InitialValueProblem(
        inertia=inertia,
        omega=axes @ omega,
        orientation=rotation.as_quaternion(tilted @ axes.T),
        weight=top.axis * fall,
        torque=torque,
        times=times,
        tolerance=motion.tolerance or DEFAULT_TOLERANCE,
        shown=shown,
        frame=principal_frame(inertia.turned(shown.T)),
        third=axes[:, 2],
        carried=axes,
        angles=motion.angles or "zxz",
        notes=(*top.remarks, *noted),
    )


def _times(
    motion: Motion, nutation: float | None, rate: float, may_rest: bool
) -> tuple[Floats, tuple[str, ...]]:
    """The times that are shown (n, s), and a note on a duration that the document does not give.

    It is some nutations of a top, if its `nutation` has a period (s), or some turns of a body that turns at a
    `rate` (rad/s), and a second of one that does not turn yet; nothing is noted of a body that rests.
    """
    duration, words = 1.0, "" if may_rest else "1 s is"
    if nutation is not None:
        duration, words = DEFAULT_NUTATIONS * nutation, f"{DEFAULT_NUTATIONS} nutations are"
    elif rate:
        duration, words = 2 * math.pi * DEFAULT_TURNS / rate, f"{DEFAULT_TURNS} turns are"
    given = motion.duration is not None or motion.times is not None
    note = f"`motion.duration` is not given: {words} shown"
    return motion.instants(duration), () if given or not words else (note,)
