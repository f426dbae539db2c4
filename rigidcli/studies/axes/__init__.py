"""`axes`: principal moments and axes, the class of the body, and how it turns at a given angular velocity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rigidcli.core import principal
from rigidcli.core.arithmetic import Arithmetic, Array, Scalar
from rigidcli.core.principal import PrincipalFrame
from rigidcli.core.rotation import as_quaternion
from rigidcli.core.tensor import ROUNDING_OF_SUM, rounded_off
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError
from rigidcli.report import Field, Report, Step
from rigidcli.studies.body import (
    axis_fields,
    body_frame,
    inertia_fields,
    lost_digits,
    mesh_fields,
    require_one_start,
)
from rigidcli.studies.common import if_known, report, value_of
from rigidcli.studies.pictures import drawn
from rigidcli.studies.results import field_of

SCHEMA = "rigidcli.axes/1"

CLASSES = {
    "point": "a point: no moment at all",
    "linear": "linear: no moment about e1, equal moments across",
    "spherical": "spherical top: all moments equal, every axis is principal",
    "oblate": "oblate symmetric top: lambda1 = lambda2 < lambda3",
    "prolate": "prolate symmetric top: lambda1 < lambda2 = lambda3",
    "asymmetric": "asymmetric top: three different moments",
    None: "a symmetric top, oblate or prolate as the parameters are",
}


@np.errstate(over="ignore", invalid="ignore")
def run(document: Document, *, steps: bool = False, picture: str | None = None) -> Report:
    """Find the principal axes of the document's body about the point O, and L, T and wobble at its omega.

    Raises DocumentError for an ensemble of angular velocities, and ComputationError where floats cannot hold
    a result or the motion needs exact axes that have no short form.
    """
    n = document.arithmetic
    require_one_start(document, "axes")
    inertia_results = inertia_fields(document)
    tensor = value_of(inertia_results, "tensor")
    motion, frame, notes = document.motion, None, []
    try:
        frame = body_frame(document)
        if not frame.ordered:
            notes.append("the order of the moments depends on the parameters")
        notes += lost_digits("lambda1", frame.moments[0], frame.axes[0], tensor)
    except ComputationError as error:
        if not n.exact or (motion is not None and motion.omega is not None and motion.basis == "principal"):
            raise
        notes.append(error.message)
    fields = [*inertia_results, *_frame_fields(frame, tensor, n), *_plane_angle(frame, tensor, n)]
    if motion is not None and motion.omega is not None:
        own = frame if motion.basis == "principal" else None
        axes = document.physical.axes if own is None else own.axes
        fields += _motion(axes.T @ n.array(motion.omega), tensor, frame, n)
    about_axis, more_notes = axis_fields(document)
    rounding = None if document.body is None else document.body.rounding
    if rounding is not None:
        from rigidcli.studies.axes.rotor import rotor_fields

        rotor, rotor_notes = rotor_fields(document, rounding)
        if document.about == "com":  # equal moments differ by the rounding of coordinates
            kind = rotor[0].value
            fields = [
                field.with_value(kind, CLASSES[kind]) if field.key == "class" else field for field in fields
            ]
        about_axis, more_notes = (*about_axis, *rotor), (*more_notes, *rotor_notes)
    working: list[Step] = []
    if steps:
        from rigidcli.studies.axes.steps import axes_steps, motion_step
        from rigidcli.studies.inertia.steps import inertia_steps

        working += inertia_steps(document, tensor)
        working += axes_steps(tensor, frame, n, frozenset(document.parameters or ()))
        if motion is not None and motion.omega is not None:
            working.append(motion_step(tensor, fields, n))
    title, pictures = "principal moments and axes", drawn("axes", picture, document)
    fields += [*about_axis, *mesh_fields(document)]
    return report(document, SCHEMA, title, fields, [*notes, *more_notes], (), working, pictures)


def _frame_fields(frame: PrincipalFrame | None, tensor: Array, n: Arithmetic) -> list[Field]:
    """Moments, axes and class; null, and not shown to people, where there is no frame."""
    keys = ("moments", "axes", "groups", "class", "orientation", "residual")
    if frame is None:
        return [field_of("axes", key, None, title="") for key in keys]
    kind = principal.body_class(frame)
    groups = [list(group) for group in frame.groups]
    orientation = None if n.exact else as_quaternion(frame.axes.T)
    values = (frame.moments, frame.axes, groups, kind, orientation, _residual(tensor, frame, n))
    words = {"class": CLASSES[kind]}
    fields = (
        field_of("axes", key, value, words.get(key, "")) for key, value in zip(keys, values, strict=True)
    )
    return [if_known(field) for field in fields]


def _plane_angle(frame: PrincipalFrame | None, tensor: Array, n: Arithmetic) -> Iterator[Field]:
    """The turn theta (rad, -pi/2 to pi/2) of e1 of a flat body in a plane of two coordinates.

    Across z, Izz = Ixx + Iyy. The moment in the direction theta, (Ixx + Iyy)/2 + (Ixx - Iyy)/2 cos(2 theta)
    + Ixy sin(2 theta), is least where tan(2 theta) = 2 Ixy/(Ixx - Iyy).
    """
    if frame is None or not frame.ordered:
        return
    least = 1e-12 * abs(n.size(frame.moments[2]))

    def is_zero(entry: Scalar) -> bool:
        return abs(n.size(entry)) <= least

    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        is_plane = is_zero(tensor[i, k]) and is_zero(tensor[j, k]) and not is_zero(tensor[i, j])
        if is_plane and is_zero(tensor[i, i] + tensor[j, j] - tensor[k, k]):
            angle = n.atan2(-2 * tensor[i, j], n.tidied(tensor[j, j] - tensor[i, i])) / 2
            yield field_of("axes", "plane_angle", angle, title=f"angle from {'xyz'[i]} to e1")


def _residual(tensor: Array, frame: PrincipalFrame, n: Arithmetic) -> object:
    """The error of I e = lambda e; zero for exact axes. Raises ComputationError where these have an error."""
    if not n.exact:
        return principal.residual(tensor, frame)
    error = tensor @ frame.axes.T - frame.axes.T * frame.moments
    if any(abs(n.size(entry)) > 1e-12 * abs(n.size(frame.moments[2])) for entry in error.flat):
        raise ComputationError("the exact principal axes could not be verified")
    return 0 * n.pi


def _motion(omega: Array, tensor: Array, frame: PrincipalFrame | None, n: Arithmetic) -> tuple[Field, ...]:
    """L = I omega and T = omega.L/2 at this angular velocity, and whether the body wobbles."""
    omega = n.tidy(omega)
    momentum = n.tidy(tensor @ omega)
    if not n.exact:  # a linear body that turns about its line has no L
        momentum = rounded_off(momentum, ROUNDING_OF_SUM * np.abs(tensor) @ np.abs(omega))
    energy = n.tidied(omega @ momentum / 2)
    largest = frame.moments[2] if frame else max(tensor.flat, key=lambda entry: abs(n.size(entry)))
    angle, wobbles = _wobble(omega, momentum, largest, n)
    torque = _holding_torque(omega, momentum, n) if wobbles or n.exact else np.zeros(3)
    return (
        field_of("axes", "omega", omega),
        field_of("axes", "angular_momentum", momentum),
        field_of("axes", "kinetic_energy", energy),
        field_of("axes", "angle", angle),
        field_of("axes", "wobbles", wobbles, words=_WOBBLES[wobbles]),
        if_known(field_of("axes", "holding_torque", torque)),
    )


def _holding_torque(omega: Array, momentum: Array, n: Arithmetic) -> Array | None:
    """omega x L (3, N m), which keeps omega constant in the body; None where floats lose the digits."""
    torque = n.tidy(np.cross(omega, momentum))
    if n.exact:
        return torque
    terms = np.outer(np.abs(omega), np.abs(momentum))
    rounding = ROUNDING_OF_SUM * (terms + terms.T)[[1, 2, 0], [2, 0, 1]]
    torque = np.where(np.abs(torque) <= rounding, 0.0, torque)
    lost = 0 < np.abs(torque).max() < np.finfo(np.float64).tiny
    return None if lost else torque


_WOBBLES = {
    True: "yes: omega is not along a principal axis, and turns about L",
    False: "no: L is along omega, which stays as it is",
}


def _wobble(omega: Array, momentum: Array, largest: Scalar, n: Arithmetic) -> tuple[object, bool]:
    """The angle between omega and L (rad; None when one is zero), and whether omega x L differs from zero.

    `largest` is the largest moment of inertia (kg m^2), or one of the same size.
    """
    fastest = max(omega, key=lambda component: abs(n.size(component)))
    if fastest == 0 or largest == 0:
        return None, False
    # In units of the largest, so that squares of very small numbers do not vanish.
    turning, momentum = n.tidy(omega / abs(fastest)), n.tidy(momentum / largest / abs(fastest))
    across = n.tidy(np.cross(turning, momentum))
    along = n.tidied(turning @ momentum)
    sine = n.hypot(*across)
    if along == 0:
        return None, False
    if n.exact:
        return n.atan2(sine, along), bool(sine != 0)
    return (n.atan2(sine, along), True) if sine > 1e-12 else (0.0, False)  # rounding leaves less
