"""Precession by formulas: tops under their weight, symmetric bodies left to themselves, planets under tides.

Of tops, `lambda1` (> 0) and `lambda3` are the moments about the fixed pivot, across and along the
symmetry axis (kg m^2); `spin` is the component of omega along that axis, of either sign (rad/s);
`weight_moment` is M g R >= 0 (N m), the axis pointing from the pivot to the centre of mass; `tilt` is the
angle theta of the axis from the upward vertical, from 0 to pi (rad). phi is the angle of the axis about
the vertical, right-handed.

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7.

All formulas take floats and exact numbers alike. Exact numbers may contain symbols without a value. What
depends on them comes out as the formula of the general case, valid where its square roots are real and its
denominators not zero; a choice that has no formula is None.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

from rigidcli.core.arithmetic import EPS, Arithmetic, Scalar
from rigidcli.errors import ComputationError

# Relative difference below which two floats count as equal: a few roundings leave as much.
SAME_NUMBER = 4 * EPS
JULIAN_YEAR = 36525 * 864  # 365.25 days of 86,400 seconds (s).

Stability: TypeAlias = Literal["stable", "marginal", "unstable"]


class Steady(NamedTuple):
    """The rates of precession at constant tilt (rad/s), and the least |spin| that allows any (rad/s).

    `slow` is the smaller in magnitude, the negative one of a tie; None where there is none. Where
    both are complex, `complex_roots` holds them as (re, im). `minimum_spin` is 0 when every spin will do.
    """

    slow: Scalar | None
    fast: Scalar | None
    complex_roots: tuple[tuple[Scalar, Scalar], ...]
    minimum_spin: Scalar | None


class Sleeping(NamedTuple):
    """The top spinning upright.

    `threshold` is the |spin| (rad/s) above which that is stable, `growth_rate` (1/s) that of a
    small deviation: None when stable, 0 when marginal. `frequencies` are the two rates (rad/s,
    signed, the smaller in magnitude first) at which a small deviation goes round; None when unstable.
    """

    threshold: Scalar | None
    stability: Stability | None
    growth_rate: Scalar | None
    frequencies: tuple[Scalar, Scalar] | None


def cosine(angle: Scalar, n: Arithmetic) -> Scalar:
    """cos(angle), and 0 for an angle (rad) that is a right angle but for its rounding."""
    value = n.cos(angle)
    return 0 * value if not n.exact and abs(value) <= SAME_NUMBER else value


def sine(angle: Scalar, n: Arithmetic) -> Scalar:
    """sin(angle), and 0 for an angle (rad) that is pi but for its rounding."""
    value = n.sin(angle)
    straight = n.sign(n.pi - angle) == 0 if n.exact else abs(angle - n.pi) <= SAME_NUMBER
    return 0 * value if straight else value


def gyroscopic_rate(lambda3: Scalar, spin: Scalar, weight_moment: Scalar, n: Arithmetic) -> Scalar | None:
    """Precession of a fast top, M g R / (lambda3 spin) (rad/s, signed); None without spin."""
    momentum = lambda3 * spin
    return None if n.sign(momentum) == 0 else weight_moment / momentum


def steady(
    lambda1: Scalar, lambda3: Scalar, spin: Scalar, tilt: Scalar, weight_moment: Scalar, n: Arithmetic
) -> Steady:
    """Steady precession: lambda1 cos(theta) W^2 - lambda3 spin W + M g R = 0.

    A horizontal top has one root, none without spin. A hanging one has two of opposite sign. At theta = 0
    and pi the roots are the limits of those at a small tilt.
    """
    upward = cosine(tilt, n)
    side, momentum = n.sign(upward), lambda3 * spin
    if side == 0:
        rate = gyroscopic_rate(lambda3, spin, weight_moment, n)
        if rate is None and n.sign(weight_moment) == 0:
            rate = weight_moment  # no torque, no precession
        return Steady(rate, None, (), 0 * lambda1)
    first, second, are_real = _roots(lambda1 * upward, momentum, weight_moment, n)
    least = 0 * lambda1 if side == -1 else _threshold(lambda1 * upward, lambda3, weight_moment, n)
    if not are_real:
        return Steady(None, None, ((first, -second), (first, second)), least)
    return Steady(first, second, (), least)


def sleeping(
    lambda1: Scalar, lambda3: Scalar, spin: Scalar, weight_moment: Scalar, n: Arithmetic
) -> Sleeping:
    """Stability of the upright top.

    Near the vertical z = x + i y of the axis obeys lambda1 z'' - i lambda3 spin z' - M g R z = 0, and
    z = exp(i W t) turns this into the equation of steady precession at theta = 0. A spin within
    rounding of the threshold is marginal.
    """
    momentum = lambda3 * spin
    threshold = _threshold(lambda1, lambda3, weight_moment, n)
    first, second, are_real = _roots(lambda1, momentum, weight_moment, n)
    if not are_real:
        return Sleeping(threshold, "unstable", second, None)
    rates = first, second
    sign, root = _root_of_discriminant(lambda1, momentum, weight_moment, n)
    if sign is None:
        growth = n.sqrt(n.tidied(-(root**2))) / (2 * lambda1)
        return Sleeping(threshold, None, n.tidied(growth), rates)
    if sign == 0:
        return Sleeping(threshold, "marginal", 0 * lambda1, rates)
    return Sleeping(threshold, "stable", None, rates)


def _roots(a: Scalar, s: Scalar, p: Scalar, n: Arithmetic) -> tuple[Scalar, Scalar, bool]:
    """The roots of a W^2 - s W + p = 0 for p >= 0 and a other than 0, and whether they are real.

    The smaller in magnitude is first. Where they are not real, it is the real and the imaginary part of one.
    """
    sign, root = _root_of_discriminant(a, s, p, n)
    if sign == -1:
        return n.tidied(s / (2 * a)), n.tidied(root / (2 * a)), False
    turn = n.sign(s)
    if turn is None:
        # The root of the same sign as s, whichever that is.
        double = s * (1 + n.sqrt(n.tidied(1 - 4 * a * p / s**2)))
    else:
        double = s + root if turn > 0 else s - root
    if n.sign(double) == 0:
        return p, p, True  # p = 0 here
    return n.tidied(2 * p / double), n.tidied(double / (2 * a)), True


def _root_of_discriminant(a: Scalar, s: Scalar, p: Scalar, n: Arithmetic) -> tuple[int | None, Scalar]:
    """The sign of D = s^2 - 4 a p and the root of |D|; of D where the sign depends on symbols.

    Floats take D by its factors, which neither overflow nor cancel more than the data do.
    """
    if n.exact:
        square = n.tidied(s**2 - 4 * a * p)
        sign = n.sign(square)
        return sign, n.sqrt(-square if sign == -1 else square)
    bound = 2 * n.sqrt(abs(a)) * n.sqrt(p)
    if a < 0:
        root = n.hypot(s, bound)
        return n.sign(root), root
    excess = abs(s) - bound
    if abs(excess) <= SAME_NUMBER * bound:
        return 0, 0.0
    return n.sign(excess), n.sqrt(abs(excess)) * n.sqrt(abs(s) + bound)


def _threshold(a: Scalar, lambda3: Scalar, p: Scalar, n: Arithmetic) -> Scalar | None:
    """The spin at which the roots are equal, 2 sqrt(a p) / lambda3; None where no spin is enough."""
    bound = 2 * n.sqrt(a * p) if n.exact else 2 * n.sqrt(a) * n.sqrt(p)
    if n.sign(lambda3) == 0:
        return bound if n.sign(bound) == 0 else None
    return n.tidied(bound / lambda3)


class Free(NamedTuple):
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
    return Free(
        body_rate,
        period(body_rate, n),
        space_rate,
        period(space_rate, n),
        -body_rate,
        None if n.sign(along) == 0 else space_rate / abs(along),
        n.atan2(across, along) if turning else None,
        n.atan2(abs(flattening * along * across), across * across + along * parallel) if moving else None,
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
