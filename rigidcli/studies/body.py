"""Results that several studies of a body have: inertia about the point O, principal frame, omega."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core.arithmetic import EPS, Array, Scalar
from rigidcli.core.principal import PrincipalFrame
from rigidcli.core.tensor import LEAST_MOMENT, ROUNDING_OF_SUM
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError
from rigidcli.report import Field
from rigidcli.studies.common import SHOWN_DIGITS, field_of, if_known

if TYPE_CHECKING:
    from rigidcli.bodies.tops import HeavyTop
    from rigidcli.document.motion import Top

# Why an angular velocity along the line of a linear body is refused: no angular momentum determines it.
NO_SPIN = "the body is linear: it has no moment about its line, and cannot turn about it"
# What is smaller than this, in units of the largest number of its kind, is the rounding of a zero.
ON_AXIS = 1e-12


@np.errstate(over="ignore", invalid="ignore")
def inertia_fields(document: Document) -> dict[str, Field]:
    """The results of `inertia`, with which those of `axes` begin, by key; all along the axes of the results.

    The centre of mass and the tensor about it are None where only a tensor about another point is given.
    Raises DocumentError when there is no body, and ComputationError when floats cannot hold the tensor.
    """
    if document.body is None:
        raise document.refusal("missing, expected a body", "body")
    n, physical = document.arithmetic, document.physical
    axes, body, mass = physical.axes, physical.properties, None
    has_com = body.mass is not None or body.at_com
    com = n.tidy(axes.T @ body.com_from(0 * body.com)) if has_com else None
    about = com if document.about == "com" else n.tidy(axes.T @ physical.point)
    asked = physical.tensor if document.frame is None else n.tidy(physical.along_axes(physical.tensor))
    central = n.tidy(physical.along_axes(body.tensor)) if has_com else None
    if body.mass is not None:
        mass = n.tidied(body.mass)
        if not n.exact and not (math.isfinite(mass) and np.isfinite(asked).all()):
            raise ComputationError("the inertia tensor is beyond the range of floating-point numbers")
    values = {"mass": mass, "center_of_mass": com, "about": about, "tensor": asked, "tensor_com": central}
    fields = {key: field_of("inertia", key, value) for key, value in values.items()}
    if com is not None and about is not None and (about == com).all():
        fields["about"].words, fields["tensor_com"].diagnostic = "the centre of mass", True
    if (error := body.integrated) is not None:
        is_small = error <= 1e-9  # as for every smooth density
        fields["integration_error"] = field_of("inertia", "integration_error", error, diagnostic=is_small)
    return fields


def mesh_fields(document: Document) -> list[Field]:
    """The results for the mesh that the body consists of, if it is one."""
    report = document.body.report() if document.body else {}
    return [field_of("inertia", f"mesh.{key}", value) for key, value in report.items()]


def lost_digits(symbol: str, moment: Scalar, axis: Array, tensor: Array) -> Iterator[str]:
    """A note on a moment about an `axis` (3, unit) of which rounding of the tensor leaves few digits.

    Each entry I_ij is rounded by up to EPS |I_ij|, so that e.I e is off by up to EPS |e|.|I| |e|. This is as
    large as a small moment of a slender body that lies along none of the axes.
    """
    if tensor.dtype == object or moment == 0:
        return
    size = np.abs(axis)
    digits = math.log10(moment / (2 * EPS * size.dot(np.abs(tensor)).dot(size)))
    if digits < SHOWN_DIGITS:
        yield f"{symbol} has {digits:.0f} digits, as the slender body lies along none of the axes"


def axis_fields(document: Document) -> tuple[tuple[Field, ...], tuple[str, ...]]:
    """The moment about the axis that the document asks for, the body as a pendulum on it, and notes."""
    direction, n, mass = document.physical.direction, document.arithmetic, document.physical.properties.mass
    if direction is None:
        return (), ()
    tensor = document.physical.tensor
    moment = n.tidied(direction @ tensor @ direction)
    if not n.exact and moment <= LEAST_MOMENT * np.abs(tensor).max():
        moment = 0.0
    radius = None if mass is None else n.sqrt(n.tidied(moment / mass))
    missing = "the radius of gyration needs `body.mass`, which is not given"
    values = {"radius_of_gyration": radius, **_pendulum(document, direction, moment)}
    return (
        field_of("inertia", "axis_moment", moment),
        *(if_known(field_of("inertia", key, value)) for key, value in values.items()),
    ), (missing,) if mass is None else ()


def _pendulum(document: Document, u: Array, moment: Scalar) -> dict[str, Array | Scalar | None]:
    """The body as a pendulum on a horizontal axis through O along u (3, unit), about which it has a `moment`.

    With n from the axis to the centre of mass, at the distance d, and I about O: a blow J along u x n at the
    point O + l n + z u gives L = I omega = J (l u - z n) without a force on the axis, so that l = I_uu/(M d)
    and z = -I_un/(M d), and I omega has no component along u x n. J. L. Meriam, L. G. Kraige, Engineering
    Mechanics: Dynamics, section 6/4, has the plane case.
    """
    n, physical = document.arithmetic, document.physical
    body, keys = physical.properties, ("pendulum_length", "pendulum_period", "center_of_percussion")
    if body.mass is None:
        return dict.fromkeys(keys)
    arm = body.com - physical.point
    across = n.tidy(arm - (arm @ u) * u)
    distance = n.hypot(*across)
    largest = max(abs(n.size(part)) for part in (*body.com, *physical.point))
    if n.size(distance) <= (0 if n.exact else ON_AXIS * largest):
        return dict.fromkeys(keys)
    length = n.tidied(moment / (body.mass * distance))
    period = 2 * n.pi * n.sqrt(n.tidied(length / document.gravity))
    tensor, outward = physical.tensor, across / distance
    aside = n.tidied(np.cross(u, outward) @ tensor @ u)
    blow = None
    if abs(n.size(aside)) <= (0 if n.exact else ON_AXIS * np.abs(tensor).max()):
        place = physical.point + length * outward - (outward @ tensor @ u) / (body.mass * distance) * u
        blow = n.tidy(physical.axes.T @ place)
    return dict(zip(keys, (length, period, blow), strict=True))


def require_spin(document: Document, section: Top, top: HeavyTop) -> None:
    """Raise DocumentError where a top without a moment about its symmetry axis is to spin about it."""
    n = document.arithmetic
    if n.sign(section.spin) != 0 and n.sign(top.lambda3) in (-1, 0):
        raise document.refusal(NO_SPIN, "top.spin", hint="set it to zero for a pendulum")


def require_one_start(document: Document, study: str) -> None:
    """Raise DocumentError where the document has an ensemble of angular velocities, and a study takes one."""
    if document.motion is not None and document.motion.ensemble is not None:
        count = len(document.motion.ensemble)
        raise document.refusal(
            f"an ensemble of {count:,} starts, expected one: `{study}` takes one angular velocity",
            "motion.omega",
            hint="`rigidcli euler` follows them all; choose one by `--set motion.omega=[1, 2, 3]`",
        )


def principal_omega(document: Document, frame: PrincipalFrame) -> Array:
    """The angular velocity at t = 0 (3, rad/s) along e1, e2, e3 of the `frame`.

    Raises DocumentError where the document gives none, and where it has a component along an axis without a
    moment of inertia.
    """
    motion, n = document.motion, document.arithmetic
    if motion is None or motion.omega is None:
        raise document.refusal("missing, expected an angular velocity", "motion.omega")
    omega = n.array(motion.omega)
    if motion.basis == "body":
        omega = n.tidy(frame.axes @ document.physical.axes.T @ omega)
    noise = 0 if n.exact else ROUNDING_OF_SUM * n.hypot(*omega)
    massless = [n.sign(moment) == 0 for moment in frame.moments]
    if any(zero and abs(n.size(rate)) > noise for zero, rate in zip(massless, omega, strict=True)):
        if all(massless):
            problem = "the body is a point, which has no moment of inertia, and cannot turn"
            raise document.refusal(problem, "motion.omega", hint="give the body some extent")
        raise document.refusal(NO_SPIN, "motion.omega", hint="make `omega` perpendicular to the line")
    return omega
