"""Free precession against Euler's equations and matrices, tides against averaged torques, and the sky."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.algebra import expressions
from rigidcli.algebra.arithmetic import EXACT
from rigidcli.core import precession
from rigidcli.core.arithmetic import FLOAT
from rigidcli.core.precession import Free, free, tidal_rate
from tests.core.rigid_motion import Motion, angle, by_series, leaning, matrix

Floats = NDArray[np.float64]

few = settings(max_examples=40)
many = settings(max_examples=80)

# An expression stands where the formulas say float.
ex: Any = expressions

MOMENTS = st.floats(0.05, 20)
ALONG = st.sampled_from([0.0, 1.0, -1.0, 1e-100, -1e100]) | st.floats(-40, 40)
ACROSS = st.sampled_from([0.0, 1.0, 1e-100, 1e100]) | st.floats(0, 40)

# --- free precession


@many
@given(MOMENTS, st.floats(0, 2), ALONG, ACROSS)
@example(1.0, 2.0, 1.0, 1e-100)
@example(1.0, 1 + 1e-15, 1.0, 1e-8)
@example(1.0, 0.0, 1.0, 1e-100)
@example(1e-47, 2.0, 1e-100, 1e-101)
@example(1.0, 0.5, -1.0, 1e-12)
def test_rates_and_angles_at_high_precision(
    lambda1: float, ratio: float, along: float, across: float
) -> None:
    lambda3 = ratio * lambda1
    # What the answer itself would lose as a subnormal number is no fault of the formulas.
    assume(all(x == 0 or abs(x) > 1e-250 for x in (lambda3, along)) and (ratio == 0 or ratio > 1e-30))
    found = free(lambda1, lambda3, along, across, FLOAT)
    with mpmath.workdps(700):
        one, three, w3, w1 = map(mpmath.mpf, (lambda1, lambda3, along, across))
        momentum = mpmath.hypot(one * w1, three * w3)
        rates = {
            "body_rate": (three - one) / one * w3,
            "space_rate": momentum / one,
            "spin_rate": (one - three) / one * w3,
        }
        for name, rate in rates.items():
            assert getattr(found, name) == pytest.approx(float(rate), rel=1e-15, abs=0)
        if momentum == 0:
            return
        # As rotations in the plane of e3 and omega: angles add, and the body cone holds the axis.
        body, axis = mpmath.atan2(w1, w3), mpmath.atan2(one * w1, three * w3)
        assert found.body_cone_angle == pytest.approx(float(body), rel=1e-15, abs=0)
        assert found.axis_angle == pytest.approx(float(axis), rel=1e-15, abs=0)
        assert found.space_cone_angle == pytest.approx(float(abs(body - axis)), rel=2e-15, abs=0)


@few
@given(MOMENTS, MOMENTS, st.floats(-9, 9), st.floats(0.01, 9))
def test_euler_angles_at_these_rates_are_the_motion(
    lambda1: float, lambda3: float, along: float, across: float
) -> None:
    # With z along L: Euler angles (zxz) that begin as (0, axis_angle, 0).
    found = free(lambda1, lambda3, along, across, FLOAT)
    assert found.axis_angle is not None
    start = leaning(found.axis_angle)
    motion = Motion(np.diag([lambda1, lambda1, lambda3]), [0, across, along], start)
    for turns in (0.7, -2.0):
        t = turns / (abs(found.space_rate) + abs(found.spin_rate))
        ((omega, attitude),) = by_series(motion, [t])
        expected = leaning(found.axis_angle, found.space_rate * t, found.spin_rate * t)
        assert angle(matrix(expected), attitude) < 1e-14
        # In the body, omega goes round e3 at the body rate.
        seen = float(mpmath.atan2(omega[1], omega[0])) - math.pi / 2 - found.body_rate * t
        assert math.remainder(seen, 2 * math.pi) == pytest.approx(0, abs=1e-14)


def test_what_there_is_not_is_none() -> None:
    assert free(1.0, 2.0, 0.0, 0.0, FLOAT) == Free(0, None, 0, None, 0, None, None, None, None)
    sphere = free(1.0, 1.0, 3.0, 4.0, FLOAT)
    assert (sphere.body_rate, sphere.body_period, sphere.space_rate, sphere.space_cone_angle) == (
        0,
        None,
        5,
        0,
    )
    across = free(1.0, 2.0, 0.0, 3.0, FLOAT)
    assert (across.body_period, across.space_rate, across.wobble_to_spin_ratio) == (None, 3, None)
    assert (across.body_cone_angle, across.axis_angle, across.space_cone_angle) == (
        math.pi / 2,
        math.pi / 2,
        0,
    )
    rod = free(1.0, 0.0, 3.0, 0.0, FLOAT)
    assert (rod.space_rate, rod.space_period, rod.axis_angle, rod.space_cone_angle) == (0, None, None, None)
    assert rod.body_cone_angle == 0
    backwards = free(1.0, 2.0, -3.0, 0.0, FLOAT)
    assert (backwards.body_cone_angle, backwards.space_cone_angle) == (math.pi, 0)


@pytest.mark.parametrize(
    ("lambda3", "along", "across"),
    [(2, -3, 4), (1, 3, 4), (0, 3, 4), (2, 0, 4), (0, 3, 0)],
)
def test_exact_numbers_agree_with_floats(lambda3: int, along: int, across: int) -> None:
    exact = free(ex.number(1), ex.number(lambda3), ex.number(along), ex.number(across), EXACT)
    floats = free(1.0, float(lambda3), float(along), float(across), FLOAT)
    for a, b in zip(tuple(exact), tuple(floats), strict=True):
        assert b == (None if a is None else pytest.approx(float(a), rel=1e-14))


# --- tides

SUN = (1.32712e20, 1.495979e11, 0.0167, 0.0)


def test_mars() -> None:
    # W. Folkner and others, Science 278 (1997) 1749: -7.576 +- 0.035 arcsec a year, from which
    # C/(M R^2) = 0.3662; J2 = 1.96e-3.
    mars = (1.96e-3 / 0.3662, math.radians(25.19), 7.0882e-5)
    rate = tidal_rate(1.32712e20, 2.27939e11, 0.0934, 0.0, *mars, FLOAT)
    assert precession.arcseconds_per_year(rate, FLOAT) == pytest.approx(7.576, rel=5e-3)


def averaged_torque(
    parameter: float,
    distance: float,
    eccentricity: float,
    inclination: float,
    moments: tuple[float, float, float],
    obliquity: float,
) -> Floats:
    """MacCullagh's torque 3 G m/r^3 u x I u averaged over spin, orbit and node; z is the ecliptic's pole."""
    count = 16
    steps = 2 * np.pi * np.arange(count) / count
    anomaly = 2 * np.pi * np.arange(400) / 400  # eccentric: dM = (1 - e cos E) dE
    shrink = 1 - eccentricity * np.cos(anomaly)
    plane = np.stack(
        [
            np.cos(anomaly) - eccentricity,
            math.sqrt(1 - eccentricity**2) * np.sin(anomaly),
            np.zeros_like(anomaly),
        ]
    )
    total = np.zeros(3)
    for node in steps:
        tilt = about(2, node) @ about(0, inclination) @ about(2, 0.3)
        r = distance * tilt @ plane
        length = distance * shrink
        for spin in steps[: count // 2]:
            body = about(0, obliquity) @ about(2, spin)
            tensor = body @ np.diag(moments) @ body.T
            torque = 3 * parameter / length**5 * np.cross(r.T, (tensor @ r).T).T
            total += (torque * shrink).mean(axis=1)
    average: Floats = total / (count * (count // 2))
    return average


def about(axis: int, angle: float) -> Floats:
    return np.array(Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix())


@pytest.mark.parametrize(
    ("eccentricity", "inclination", "obliquity"), [(0.0, 0.4, 0.4), (0.3, 0.0, 1.4), (0.8, 2.0, 2.5)]
)
def test_the_rate_is_that_of_the_averaged_torque(
    eccentricity: float, inclination: float, obliquity: float
) -> None:
    moments, spin = (2.0, 2.3, 3.1), 7.0
    torque = averaged_torque(1.7, 5.0, eccentricity, inclination, moments, obliquity)
    # L = C spin s is carried round the ecliptic's pole: L' = W z x L.
    momentum = moments[2] * spin * about(0, obliquity) @ np.array([0, 0, 1.0])
    across = np.cross([0, 0, 1.0], momentum)
    expected = float(torque @ across / (across @ across))
    assert torque == pytest.approx(expected * across, abs=1e-13)
    rate = tidal_rate(
        1.7, 5.0, eccentricity, inclination, precession.ellipticity(moments), obliquity, spin, FLOAT
    )
    assert rate == pytest.approx(-expected, rel=1e-12)  # positive: retrograde


def test_retrograde_spin_and_prolate_planets_precess_the_other_way() -> None:
    forward = tidal_rate(*SUN, 0.003, 0.4, 1e-4, FLOAT)
    assert forward > 0
    assert tidal_rate(*SUN, 0.003, 0.4, -1e-4, FLOAT) == -forward
    assert tidal_rate(*SUN, -0.003, 0.4, 1e-4, FLOAT) == -forward
    assert tidal_rate(*SUN, 0.003, math.pi - 0.4, 1e-4, FLOAT) == pytest.approx(-forward, rel=1e-15)


def test_exact_tides() -> None:
    third, half, one = ex.PI / 3, ex.number(Fraction(1, 2)), ex.number(1)
    exact = tidal_rate(7 * one, 3 * one, 3 * one / 5, third / 2, one / 9, third, 2 * one, EXACT)
    by_hand = Fraction(3, 2) * 7 / Fraction(12, 5) ** 3 * Fraction(5, 8) / 9 / 2 / 2
    assert exact == by_hand
    assert tidal_rate(7 * one, 3 * one, half, third, half, 3 * third / 2, 2 * one, EXACT) == 0
    a_turn_a_year = 2 * ex.PI / ex.number(31_557_600)
    assert precession.arcseconds_per_year(a_turn_a_year, EXACT) == 1_296_000
    assert precession.period_in_years(a_turn_a_year, EXACT) == 1


def test_the_ellipticity_of_a_nearly_round_planet_keeps_its_digits() -> None:
    a, b, c = 1.0, 1.0 + 3 * 2.0**-52, 1.0 + 7 * 2.0**-52
    assert precession.ellipticity([a, b, c]) == pytest.approx(5.5 * 2.0**-52, rel=1e-15)
    assert precession.ellipticity([ex.number(k) for k in (2, 2, 3)]) == ex.number(Fraction(1, 3))
