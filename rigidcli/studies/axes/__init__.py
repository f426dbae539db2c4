"""`axes`: principal moments and axes, the class of a body, its motion at a given omega, and rotors."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rigidcli.core import principal
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Scalar
from rigidcli.core.principal import PrincipalFrame
from rigidcli.core.rotation import as_quaternion
from rigidcli.core.tensor import ROUNDING_OF_SUM, rounded_off
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError
from rigidcli.report import Field, Report
from rigidcli.studies.body import axis_fields, inertia_fields, lost_digits, mesh_fields, require_one_start
from rigidcli.studies.common import TINY, field_of, if_known, report, worked
from rigidcli.studies.pictures import drawn


@np.errstate(over="ignore", invalid="ignore")
def run(document: Document, *, steps: bool = False, picture: str | None = None) -> Report:
    """Find the principal axes of the document's body about the point O, and L, T and wobble at its omega.

    Raises DocumentError for an ensemble of angular velocities. Raises ComputationError where floats cannot
    hold a result, or the motion needs exact axes that have no short form.
    """
    n = document.arithmetic
    require_one_start(document, "axes")
    of_inertia = inertia_fields(document)
    tensor = of_inertia["tensor"].value
    motion, frame, notes = document.motion, None, []
    try:
        frame = document.physical.frame
        if not frame.ordered:
            notes.append("the order of the moments depends on the parameters")
        notes += lost_digits("lambda1", frame.moments[0], frame.axes[0], tensor)
    except ComputationError as error:
        if not n.exact or (motion is not None and motion.omega is not None and motion.basis == "principal"):
            raise
        notes.append(error.message)
    fields = [*of_inertia.values(), *_frame_fields(frame, tensor, n), *_plane_angle(frame, tensor, n)]
    if motion is not None and motion.omega is not None:
        own = frame if motion.basis == "principal" else None
        axes = document.physical.axes if own is None else own.axes
        fields += _motion(axes.T @ n.array(motion.omega), tensor, frame, n)
    about_axis, more_notes = axis_fields(document)
    rounding = None if document.body is None else document.body.rounding
    if rounding is not None:
        rotor, rotor_notes = _rotor_fields(document, rounding)
        if document.about == "com":  # equal moments differ by the rounding of coordinates
            kind = rotor[0].value
            fields = [field_of("axes", "class", kind) if field.key == "class" else field for field in fields]
        about_axis, more_notes = (*about_axis, *rotor), (*more_notes, *rotor_notes)
    fields += [*about_axis, *mesh_fields(document)]
    working, pictures = worked("axes", steps, document, frame, fields), drawn("axes", picture, document)
    return report(document, "axes", fields, [*notes, *more_notes], (), working, pictures)


def _frame_fields(frame: PrincipalFrame | None, tensor: Array, n: Arithmetic) -> list[Field]:
    """Moments, axes and class; null, and not shown to people, where there is no frame."""
    keys = ("moments", "axes", "groups", "class", "orientation", "residual")
    if frame is None:
        return [field_of("axes", key, None, title="") for key in keys]
    kind = principal.body_class(frame)
    groups = [list(group) for group in frame.groups]
    orientation = None if n.exact else as_quaternion(frame.axes.T)
    values = (frame.moments, frame.axes, groups, kind, orientation, _residual(tensor, frame, n))
    return [if_known(field_of("axes", key, value)) for key, value in zip(keys, values, strict=True)]


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
        field_of("axes", "wobbles", wobbles),
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
    return None if 0 < np.abs(torque).max() < TINY else torque


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


# --- molecules as rotors

# The Planck constant (J s), exact since 2019 (BIPM, The International System of Units, 9th edition).
PLANCK = 6.62607015e-34
LIGHT = 299_792_458.0  # the speed of light (m/s), exact
LARGEST_CONSTANT = 1e6  # a rotational constant (GHz) that no molecule has


def _rotor_fields(document: Document, rounding: float) -> tuple[tuple[Field, ...], tuple[str, ...]]:
    """The results for a molecule with coordinates that may be off by `rounding` (m), and notes on them.

    Rotational constants are h/(8 pi^2 I) as frequencies and h/(8 pi^2 c I) as wavenumbers (G. Herzberg,
    Infrared and Raman Spectra, chapter I), and kappa is that of B. S. Ray, Z. Physik 78 (1932) 74.
    """
    body = document.physical.properties
    assert body.mass is not None
    mass, moments = float(body.mass), principal.principal_frame(body.tensor).moments
    kind, notes = _rotor(moments, mass, rounding), []
    spread = math.sqrt(moments.sum() / 2 / mass)
    if document.about == "origin" and FLOAT.hypot(*body.com) > 1e-3 * spread:
        notes.append(
            "moments, axes and class are about the origin, rotational constants about the centre of mass; "
            "`--set about=com` gives all of them about the centre of mass"
        )
    is_line = kind in ("point", "linear")
    if is_line and moments[0] > 0:
        size = f"{moments[0] / moments[2]:.1g}"
        notes.append(f"the moment about the line counts as none: {size} of the others may be rounding")
    for place, (pair, other) in enumerate((("A and B", "oblate"), ("B and C", "prolate"))):
        off = 1 - moments[place] / moments[place + 1] if kind in ("spherical", other) else 0.0
        if off > principal.EQUAL_MOMENTS:
            notes.append(f"{pair} count as equal: they differ by {off:.1g}, which may be rounding")
    fields = [field_of("axes", "rotor", kind)]
    for key, per_hertz in (("ghz", 1e-9), ("per_cm", 0.01 / LIGHT)):
        for letter, moment in zip("ABC", moments, strict=True):
            is_known = moment > 0 and not (is_line and letter == "A")
            value = PLANCK / (8 * math.pi**2 * float(moment)) * per_hertz if is_known else None
            if key == "ghz" and value is not None and value > LARGEST_CONSTANT:
                large = f"{letter} is {value:.3g} GHz, and that of H2 is 1,824 GHz"
                notes.append(f"{large}: are the places right?")
            fields.append(if_known(field_of("axes", f"rotational_constants_{key}.{letter}", value)))
    kappa = None
    if kind in ("oblate", "prolate", "asymmetric"):
        a, b, c = moments[0] / moments  # as the constants are to each other
        kappa = float(((b - a) + (b - c)) / (a - c))
    return (*fields, if_known(field_of("axes", "asymmetry_parameter", kappa))), tuple(notes)


def _rotor(moments: Floats, mass: float, rounding: float) -> principal.BodyClass:
    """The kind of rotor; moments are equal where the rounding of coordinates may be the difference.

    `moments` (3, kg m^2) are ascending and about the centre of mass. Where atoms at distances d move by at
    most e, no moment changes by more than the sum of m (2 d e + e^2). The Cauchy-Schwarz inequality bounds
    this sum. The moment about a line of atoms is at most the sum of m e^2.
    """
    if moments[2] == 0:
        return "point"
    moved = math.sqrt(3) * rounding
    if moments[0] <= mass * moved**2:
        return "linear"
    change = 2 * moved * math.sqrt(mass * moments.sum() / 2) + mass * moved**2
    lower, upper = (bool(gap <= 2 * change) for gap in np.diff(moments))
    if lower and upper:
        return "spherical"
    return "oblate" if lower else "prolate" if upper else "asymmetric"
