"""Free precession of a symmetric body, and the precession that tides drive.

All formulas take floats and exact numbers alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.top import cosine
from rigidcli.errors import ComputationError

JULIAN_YEAR = 36525 * 864
"""365.25 days of 86,400 seconds (s)."""


@dataclass(frozen=True, slots=True)
class Free:
    """How a symmetric body left to itself turns; rates in rad/s, periods in s, angles in rad.

    `body_rate` is that of omega about e3 as seen in the body, signed; `space_rate` that of e3 and omega about
    L, phi-dot; `spin_rate` that of the body about e3 besides, psi-dot: with z along L and zxz Euler
    angles, omega3 = psi-dot + phi-dot cos(theta). A period is None where its rate is zero.
    `wobble_to_spin_ratio` is space_rate/|omega3|, None where omega3 is zero. `body_cone_angle` lies between
    omega and e3, `space_cone_angle` between omega and L, `axis_angle` between e3 and L; None where one of
    the two vectors is zero.
    """

    body_rate: Scalar
    body_period: Scalar | None
    space_rate: Scalar
    space_period: Scalar | None
    spin_rate: Scalar
    wobble_to_spin_ratio: Scalar | None
    body_cone_angle: Scalar | None
    space_cone_angle: Scalar | None
    axis_angle: Scalar | None


def free(lambda1: Scalar, lambda3: Scalar, along: Scalar, across: Scalar, n: Arithmetic) -> Free:
    """Free precession at moments lambda1 > 0 across e3 and lambda3 along it.

    omega has the component `along` e3, and `across` = sqrt(omega1^2 + omega2^2) >= 0 (rad/s). Source:
    L. Landau, E. Lifshitz, Mechanics, sections 33 and 36. When a flat disc, lambda3 = 2 lambda1, wobbles
    little, the wobble is to the spin as 2 to 1: B. F. Chao, Physics Today 42 (1989) 15.
    """
    flattening = (lambda3 - lambda1) / lambda1
    parallel = lambda3 / lambda1 * along  # L/lambda1 has the components `across` and this one
    body_rate, space_rate = flattening * along, n.hypot(across, parallel)
    turning = not (n.sign(along) == 0 and n.sign(across) == 0)
    moving = turning and n.sign(space_rate) != 0
    # Floats are divided by |omega| and L/lambda1 before they are multiplied: tiny ones would vanish.
    omega, momentum = (n.hypot(across, along), space_rate) if moving and not n.exact else (1, 1)
    return Free(
        body_rate,
        period(body_rate, n),
        space_rate,
        period(space_rate, n),
        -body_rate,
        None if n.sign(along) == 0 else space_rate / abs(along),
        n.atan2(across, along) if turning else None,
        n.atan2(
            abs(flattening * (along / omega) * (across / momentum)),
            (across / omega) * (across / momentum) + (along / omega) * (parallel / momentum),
        )
        if moving
        else None,
        n.atan2(across, parallel) if moving else None,
    )


def period(rate: Scalar, n: Arithmetic) -> Scalar | None:
    """2 pi/|rate| (s); None for a rate of zero."""
    return None if n.sign(rate) == 0 else 2 * n.pi / abs(rate)


def gravitational_parameter(mass: Scalar) -> Scalar:
    """G m (m^3/s^2) of a mass (kg), with G = 6.674 30e-11 m^3/(kg s^2).

    CODATA 2018: E. Tiesinga and others, Rev. Mod. Phys. 93 (2021) 025010; uncertain by 2.2e-5 of it, and
    unchanged in 2022. As a ratio of integers it serves exact numbers too.
    """
    return mass * 667430 / 10**16


def ellipticity(moments: Sequence[Scalar]) -> Scalar:
    """Dynamical ellipticity (C - (A + B)/2)/C of principal moments A, B across and C along the spin axis.

    A rapid spin averages the equator of a triaxial body: its mean moment counts.
    """
    a, b, c = moments
    return ((c - a) + (c - b)) / (2 * c)


def tidal_rate(
    gm: Scalar,
    distance: Scalar,
    eccentricity: Scalar,
    inclination: Scalar,
    dynamical_ellipticity: Scalar,
    obliquity: Scalar,
    spin: Scalar,
    n: Arithmetic,
) -> Scalar:
    """Mean precession of a spinning planet by one perturber (rad/s); retrograde where positive and C > A.

    `gm` is G m of the perturber (m^3/s^2), `distance` the semi-major axis (m), `eccentricity` < 1,
    `inclination` that of the orbit to the plane on whose normal the `obliquity` is measured (rad),
    `spin` in rad/s, not 0. MacCullagh's torque is averaged over the orbit, which gives the mean of 1/r^3, and
    over the turn of the orbit's node; the spin is taken for all of the angular momentum. An
    obliquity of 90 degrees gives 0.

    Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.8, for a circular orbit in that plane.

    Raises ComputationError without spin.
    """
    if n.sign(spin) == 0:
        raise ComputationError("a planet without spin does not precess", hint="give a `spin` other than 0")
    orbit = gm / (distance * n.sqrt((1 - eccentricity) * (1 + eccentricity))) ** 3
    tilted = 1 - 3 * n.sin(inclination) ** 2 / 2
    return 3 * orbit * tilted * dynamical_ellipticity * cosine(obliquity, n) / (2 * spin)


def arcseconds_per_year(rate: Scalar, n: Arithmetic) -> Scalar:
    """A rate (rad/s) in seconds of arc a Julian year."""
    return rate * JULIAN_YEAR * 180 * 3600 / n.pi


def period_in_years(rate: Scalar, n: Arithmetic) -> Scalar | None:
    """The period of a rate (rad/s) in Julian years; None for a rate of zero."""
    seconds = period(rate, n)
    return None if seconds is None else seconds / JULIAN_YEAR
