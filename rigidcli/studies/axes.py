"""`axes`: principal moments and axes, the class of the body, and how it turns at a given angular velocity."""

from __future__ import annotations

import numpy as np

from rigidcli.core import principal
from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Scalar
from rigidcli.core.principal import PrincipalFrame
from rigidcli.errors import ComputationError
from rigidcli.model.document import Document
from rigidcli.report import Field, Report
from rigidcli.studies.body import body_frame, inertia_fields
from rigidcli.studies.common import report
from rigidcli.studies.results import told

SCHEMA = "rigidcli.axes/1"

STEADY = 1e-12
"""Where omega and L are parallel, rounding leaves |omega x L| below this, in units of lambda3 omega^2."""

NO_MOMENTUM = 2 * principal.ZERO_MOMENT
"""Where I omega is zero, rounding leaves |L| below this, in units of the largest |I_ij| and |omega_k|."""

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
def run(document: Document) -> Report:
    """Find the principal axes of the document's body about its point O, and what its motion is there."""
    n = document.arithmetic
    known = inertia_fields(document)
    tensor = next(field.value for field in known if field.key == "tensor")
    motion, frame, notes = document.motion, None, []
    try:
        frame = body_frame(document)
        if not frame.ordered:
            notes.append("the order of the moments depends on the parameters")
    except ComputationError as error:
        if not n.exact or (motion is not None and motion.omega is not None and motion.basis == "principal"):
            raise
        notes.append(error.message)
    fields = [*known, *_frame_fields(frame, tensor, n)]
    if motion is not None and motion.omega is not None:
        own = frame if motion.basis == "principal" else None
        axes = document.physical.axes if own is None else own.axes
        fields += _motion(axes.T @ n.array(motion.omega), tensor, frame, n)
    return report(document, SCHEMA, "principal moments and axes", fields, notes)


def _frame_fields(frame: PrincipalFrame | None, tensor: Array, n: Arithmetic) -> list[Field]:
    """Moments, axes and class; null, and not shown to people, where there is no frame to tell."""
    keys = ("moments", "axes", "groups", "class", "residual")
    if frame is None:
        return [told("axes", key, None, title="") for key in keys]
    kind = principal.body_class(frame)
    groups = [list(group) for group in frame.groups]
    values = (frame.moments, frame.axes, groups, kind, _residual(tensor, frame, n))
    words = {"class": CLASSES[kind]}
    return [
        told("axes", key, value, words=words.get(key, "")) for key, value in zip(keys, values, strict=True)
    ]


def _residual(tensor: Array, frame: PrincipalFrame, n: Arithmetic) -> object:
    """The error of I e = lambda e; zero for exact axes. Raises ComputationError where it is not."""
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
    if not n.exact and _is_about_massless_axis(tensor, omega):
        momentum = np.zeros(3)
    energy = n.tidy(n.array([omega @ momentum / 2]))[0]
    largest = frame.moments[2] if frame else max(tensor.flat, key=lambda entry: abs(n.size(entry)))
    angle, wobbles = _wobble(omega, momentum, largest, n)
    return (
        told("axes", "omega", omega),
        told("axes", "angular_momentum", momentum),
        told("axes", "kinetic_energy", energy),
        told("axes", "angle", angle),
        told("axes", "wobbles", wobbles, words=_WOBBLES[wobbles]),
    )


def _is_about_massless_axis(tensor: Floats, omega: Floats) -> bool:
    """Whether a linear body turns about its line, so that L is zero but for rounding."""
    largest, fastest = np.abs(tensor).max(), np.abs(omega).max()
    return bool(largest > 0 and fastest > 0) and bool(
        np.abs(tensor / largest @ (omega / fastest)).max() <= NO_MOMENTUM
    )


_WOBBLES = {
    True: "yes: omega is not along a principal axis, and turns about L",
    False: "no: L is along omega, which stays as it is",
}


def _wobble(omega: Array, momentum: Array, largest: Scalar, n: Arithmetic) -> tuple[object, bool]:
    """The angle between omega and L (rad; None when one is zero), and whether omega x L differs from zero.

    `largest` is a moment of inertia (kg m^2) of the size of the largest.
    """
    fastest = max(omega, key=lambda component: abs(n.size(component)))
    if fastest == 0 or largest == 0:
        return None, False
    # In units of the largest, so that squares of very small numbers do not vanish.
    turning, momentum = n.tidy(omega / abs(fastest)), n.tidy(momentum / largest / abs(fastest))
    across = n.tidy(np.cross(turning, momentum))
    along = n.tidy(n.array([turning @ momentum]))[0]
    sine = n.hypot(*across)
    if along == 0:
        return None, False
    wobbles = bool(sine != 0) if n.exact else bool(sine > STEADY)
    return n.atan2(sine, along), wobbles
