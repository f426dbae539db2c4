"""Documents in configs/ that move, against published figures, and against computations that share no code.

A published figure is met to the digits in which it is printed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rigidcli
from rigidcli.core import rotation
from rigidcli.report import Report
from tests.conftest import ROOT, Program, printed
from tests.euler_equations import Floats, Torque, integrated, same_turn
from tests.truths import require, truths

DAY = 86400.0
STANDARD_GRAVITY = 9.80665


@pytest.mark.parametrize("case", truths(Path(__file__).with_name("published.yaml")))
def test_figures(case: dict[str, Any], program: Program) -> None:
    require(case, program)


def document(name: str, *settings: str) -> Any:
    return rigidcli.load(ROOT / "configs" / f"{name}.yaml", settings=list(settings))


def precession(name: str, *settings: str) -> Report:
    return rigidcli.precess(document(name, *settings))


def motion(name: str, *settings: str) -> Report:
    return rigidcli.euler(document(name, *settings))


# --- tops


def axis_angles(report: Report) -> tuple[Floats, Floats, Floats]:
    """Times, theta, and phi without jumps of a top's trajectory."""
    trajectory = report["trajectory"]
    phi, theta, _ = np.asarray(trajectory["angles"]).T
    return np.asarray(trajectory["t"]), theta, np.unwrap(phi)


def lagrange(
    lambda1: float, spin_momentum: float, fall: float, tilt: float, precession: float, times: Floats
) -> tuple[Floats, Floats]:
    """theta and phi (less its start) by Lagrange's equations, with the conserved momenta eliminated."""
    a = spin_momentum / lambda1
    b = a * math.cos(tilt) + precession * math.sin(tilt) ** 2

    def rate(_: float, y: Floats) -> list[float]:
        theta, theta_dot, _phi = y
        sine, cosine = math.sin(theta), math.cos(theta)
        phi_dot = (b - a * cosine) / sine**2
        return [theta_dot, phi_dot * sine * (phi_dot * cosine - a) + fall / lambda1 * sine, phi_dot]

    start, span = [tilt, 0.0, 0.0], (0.0, float(times[-1]))
    solved = solve_ivp(rate, span, start, "DOP853", times, rtol=1e-13, atol=1e-14)
    return solved.y[0], solved.y[2]


@pytest.mark.parametrize(("name", "tilt"), [("bicycle_wheel", 90), ("openstax_gyroscope", 30)])
def test_a_gyroscope_goes_round_evenly_at_the_exact_rate(name: str, tilt: float) -> None:
    times, theta, phi = axis_angles(motion(name))
    np.testing.assert_allclose(theta, math.radians(tilt), atol=1e-10)
    slow = precession(name)["top"]["slow_rate"]
    np.testing.assert_allclose(phi - phi[0], slow * times, atol=1e-9)


# The top of the four documents: a disc on a stem, about the tip.
ACROSS = 0.09 * (0.03**2 / 4 + 0.01**2 / 12 + 0.04**2) + 0.01 * 0.06**2 / 3
ALONG = 0.09 * 0.03**2 / 2
FALL = STANDARD_GRAVITY * (0.09 * 0.04 + 0.01 * 0.03)
SPIN = 120 * math.pi

NODS = [("cuspidal", 0.0), ("looping", -2.0), ("wavy", 1.0)]


@pytest.mark.parametrize(
    ("name", "spin", "tilt", "start"),
    [
        *((f"top_{kind}", SPIN, 30, start) for kind, start in NODS),
        ("top_sleeping", 130 * math.pi / 3, 1, 0),
    ],
)
def test_the_axis_in_time_follows_lagranges_equations(
    name: str, spin: float, tilt: float, start: float
) -> None:
    times, theta, phi = axis_angles(motion(name))
    tilts, azimuths = lagrange(ACROSS, ALONG * spin, FALL, math.radians(tilt), start, times)
    np.testing.assert_allclose(theta, tilts, atol=1e-9)
    if name != "top_sleeping":  # close to the vertical, phi has few digits
        np.testing.assert_allclose(phi - phi[0], azimuths, atol=1e-8)
    top = precession(name)["top"]
    assert top["theta_max"] == pytest.approx(tilts.max(), rel=1e-3)
    assert top["theta_max"] >= tilts.max() - 1e-9


def test_rules_for_fast_tops() -> None:
    """Goldstein's: beta sin(theta)/a^2 for the nod, 2 pi/a for its period, beta/(2 a) for the precession."""
    top = precession("top_cuspidal")["top"]
    a, beta = ALONG * SPIN / ACROSS, 2 * FALL / ACROSS
    amplitude = beta * math.sin(math.pi / 6) / a**2
    assert amplitude / (top["theta_max"] - top["theta_min"]) - 1 == printed("-0.075")
    assert 2 * math.pi / a / top["nutation_period"] - 1 == printed("-0.051")
    assert beta / (2 * a) / top["mean_precession_rate"] - 1 == printed("-0.025")
    # Where cusps are drawn, (1 - u^2) beta = a^2 (u0 - u) at the lowest point, so that phi-dot = beta/a.
    assert top["phi_dot_at_theta_max"] == pytest.approx(2 * top["gyroscopic_rate"], rel=1e-13)
    # The faster the top, the better the rules: the error falls with the square of the spin.
    fast = precession("top_cuspidal", "top.spin=36000 rpm")["top"]
    assert fast["theta_max"] - fast["theta_min"] == pytest.approx(amplitude / 100, rel=1e-3)
    assert fast["nutation_period"] == pytest.approx(2 * math.pi / a / 10, rel=1e-3)
    assert fast["mean_precession_rate"] == pytest.approx(beta / (2 * a) / 10, rel=1e-3)


# --- motion in time, by another integrator


def moved(name: str) -> tuple[Any, Floats, Floats, Floats]:
    """Report, times, omega and quaternions of a document's motion."""
    report = motion(name)
    trajectory = report["trajectory"]
    t, omega, q = (np.asarray(trajectory[key]) for key in ("t", "omega", "orientation"))
    return report, t, omega, q


def drag(_: float, __: Floats, omega: Floats) -> Floats:
    return -0.05 * omega


def motor(_: float, __: Floats, ___: Floats) -> Floats:
    return np.array([0, 0, 2e-3])


def weight(_: float, q: Floats, __: Floats) -> Floats:
    return np.cross([0.5, 0, 0], rotation.turned(q * [1, -1, -1, -1], np.array([0, 0, -9.81])))


def handle() -> tuple[float, float, float]:
    """Moments of the T-handle about its centre of mass: along the bar, along the stem, across both."""
    bar, stem = (7850 * math.pi * r * r * h for r, h in ((0.006, 0.1), (0.005, 0.05)))
    reach = 0.006 + 0.025
    apart = bar * stem / (bar + stem) * reach**2
    bar_thin, bar_long = bar * 0.006**2 / 2, bar * (3 * 0.006**2 + 0.1**2) / 12
    stem_thin, stem_long = stem * 0.005**2 / 2, stem * (3 * 0.005**2 + 0.05**2) / 12
    return bar_thin + stem_long + apart, bar_long + stem_thin, bar_long + stem_long + apart


PLATE = 0.4 * 0.13**2 / 4
RACKET = (1.391e-3, 19.055e-3, 20.446e-3)
BAR, STEM, BOTH = handle()
GYRO = ((3 * 0.05**2 + 0.02**2) / 12, 0.05**2 / 2)
"""Moments of the disc of `driven_gyro` across and along its axis, for 1 kg."""

MOTIONS: list[tuple[str, Sequence[float], Sequence[float], Torque | None, float]] = [
    ("feynman_plate", (PLATE, PLATE, 2 * PLATE), (0.4 * math.pi, 0, 4 * math.pi), None, 1e-9),
    ("tennis_racket", RACKET, (1.5, 15.0, 1.5), None, 1e-8),
    ("t_handle", (STEM, BAR, BOTH), (4 * math.pi, 0.01, 0.01), None, 1e-6),
    ("toutatis", (3.0836, 3.235, 1), [math.radians(x) / DAY for x in (14.5, 33.7, -98.5)], None, 1e-9),
    ("damped_satellite", (90, 90, 120), (0.02, 0, 0.1), drag, 1e-9),
    ("driven_gyro", (GYRO[0], GYRO[0], GYRO[1]), (0.5, 0, 10), motor, 1e-8),
    ("kovalevskaya_top", (2, 2, 1), (1, 2, 3), weight, 1e-8),
]
"""Documents, with moments along their axes, the omega they begin with, their torque, and an error allowed."""


@pytest.mark.parametrize(
    ("name", "moments", "start", "torque", "tolerance"), MOTIONS, ids=[m[0] for m in MOTIONS]
)
def test_the_motion_is_that_of_another_integrator(
    name: str, moments: Sequence[float], start: Sequence[float], torque: Torque | None, tolerance: float
) -> None:
    _, t, omega, turned = moved(name)
    expected, turns = integrated(np.diag(moments), np.array(start), t, torque)
    np.testing.assert_allclose(omega, expected, atol=tolerance * float(np.abs(expected).max()))
    assert same_turn(turned, turns) < 2 * tolerance


# --- free


def test_the_wobble_of_the_plate_as_it_is_seen() -> None:
    """The plate's axis goes round L twice as fast as the plate turns; measured on the trajectory."""
    report, t, omega, turned = moved("feynman_plate")
    L = np.asarray(report["trajectory"]["angular_momentum_space"])
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=0, atol=1e-15)
    axis, up = rotation.turned(turned, np.array([0.0, 0, 1])), L[0] / np.linalg.norm(L[0])
    x = np.cross([0, 1, 0], up)
    x /= np.linalg.norm(x)
    azimuth = np.unwrap(np.arctan2(axis @ np.cross(up, x), axis @ x))
    wobble = np.polyfit(t, azimuth, 1)[0]
    assert wobble / omega[:, 2].mean() == pytest.approx(2 / math.cos(math.atan(0.05)), rel=1e-12)


def test_a_rigid_earth_wobbles() -> None:
    """Euler's 305 days; 433 are observed, as the Earth is not rigid.

    M. L. Smith, in IAU Symposium 78 (1980) 195, has about 305 days for a rigid Earth.
    """
    free = precession("earth")["free"]
    H = 0.00327379492
    turns = free["body_period"] * 7.292115e-5 / (2 * math.pi)
    assert turns == pytest.approx((1 - H) / H, rel=1e-10)
    assert turns == printed("304.5")
    assert turns == pytest.approx(305, abs=1)
    assert free["body_period"] / DAY < 433
    report, t, omega, _ = moved("earth")
    assert report["motion"] == "oblate"
    across = omega[:, 0] + 1j * omega[:, 1]
    phase = np.unwrap(np.angle(across))
    np.testing.assert_allclose(phase, t * 7.292115e-5 * H / (1 - H), atol=1e-9)
    np.testing.assert_allclose(np.abs(across), across[0].real, rtol=1e-12)


def test_the_racket_as_measured_is_no_body() -> None:
    """F. Bubbar, L. Zhu (2025): 1.391, 18.8 and 20.7 g m^2, within their errors, but 20.7 > 18.8 + 1.4."""
    measured = "body.moments=[1.391e-3, 18.8e-3, 20.7e-3]"
    with pytest.raises(rigidcli.errors.DocumentError, match=r"no body has this inertia tensor"):
        document("tennis_racket", measured)
