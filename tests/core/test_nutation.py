"""Nutation against quadratures and roots at 60 digits, and against the equations of motion in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mpmath
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rigidcli.core.arithmetic import FLOAT
from rigidcli.core.nutation import Nutation, nutation
from rigidcli.core.precession import sleeping, steady
from tests.core.tops import MOMENTS, RATES, SPINS, TILTS, WEIGHTS, Start

fewest = settings(max_examples=15)


def limits(start: Sequence[Any], digits: int = 60) -> dict[str, Any]:
    """The limits of the tilt by the roots of Goldstein's cubic in u, and the integrand between them."""
    with mpmath.workdps(digits):
        lambda1, lambda3, spin, tilt, precession, rate, weight = map(mpmath.mpf, start)
        u0, sine = mpmath.cos(tilt), mpmath.sin(tilt)
        a, beta = lambda3 * spin / lambda1, 2 * weight / lambda1
        b = precession * sine**2 + a * u0
        alpha = rate**2 + precession**2 * sine**2 + beta * u0
        cubic = [beta, -alpha - a * a, 2 * a * b - beta, alpha - b * b]
        if beta == 0:
            cubic = cubic[1:]
        roots = mpmath.polyroots(cubic, maxsteps=2000, extraprec=800)
        assert all(abs(mpmath.im(root)) < mpmath.mpf(10) ** (-digits // 2) for root in roots)
        u1, u2, *third = sorted(mpmath.re(root) for root in roots)
        theta_min, theta_max = mpmath.acos(min(u2, 1)), mpmath.acos(u1)
        return {
            "theta_min": theta_min,
            "theta_max": theta_max,
            "phi_dot_at_theta_min": (b - a * u2) / (1 - u2 * u2),
            "phi_dot_at_theta_max": (b - a * u1) / (1 - u1 * u1),
            "near": min(1 - u2, 1 + u1),
            "closing": (third[0] - u2) / (third[0] - u1) if third else 1,
            "middle": (u1 + u2) / 2,
            "half": (u2 - u1) / 2,
            "speed": lambda u: mpmath.sqrt(beta * (third[0] - u) if third else alpha + a * a),
            "beta": beta,
            "poles": (b - a, b + a),
        }


def reference(start: Start, digits: int = 60) -> dict[str, Any]:
    """The same, with the period and the advance of phi by Legendre's integrals."""
    with mpmath.workdps(digits):
        found = limits(start, digits)
        low, high = found["middle"] - found["half"], found["middle"] + found["half"]
        whole = found["speed"](low)
        m = found["half"] * 2 * found["beta"] / whole**2
        down = found["poles"][0] / (1 - low) * mpmath.ellippi((high - low) / (1 - low), m)
        up = found["poles"][1] / (1 + low) * mpmath.ellippi((low - high) / (1 + low), m)
        period, advance = 4 * mpmath.ellipk(m) / whole, 2 * (down + up) / whole
        return {**found, "period": period, "precession_per_nutation": advance}


LIMITS = ("theta_min", "theta_max", "phi_dot_at_theta_min", "phi_dot_at_theta_max")


def roundings(start: Start, digits: int) -> dict[str, float]:
    """How far the limits move, relatively, when each number of the start grows by 2^-52 of it."""
    exact, sums = limits(start, digits), dict.fromkeys(LIMITS, mpmath.mpf(0))
    for place in range(len(start)):
        with mpmath.workdps(digits):
            values = [mpmath.mpf(x) for x in start]
            values[place] *= 1 + mpmath.mpf(2) ** -80
            moved = limits(values, digits)
            for name in LIMITS:
                sums[name] += ((moved[name] - exact[name]) / (exact[name] or 1)) ** 2
    return {name: float(mpmath.sqrt(square) * 2**28) for name, square in sums.items()}


def require_nutation(found: Nutation, start: Start, digits: int = 60) -> dict[str, Any]:
    """Limits are within ten roundings of the start, period and advance to 1e-13."""
    expected, effect = reference(start, digits), roundings(start, digits)
    for name in (*LIMITS, "period", "precession_per_nutation"):
        within = max(1e-13, 10 * effect.get(name, 0.0))
        assert getattr(found, name) == pytest.approx(float(expected[name]), rel=within, abs=1e-30), name
    assert found.period is not None
    assert found.precession_per_nutation is not None
    assert found.mean_rate == pytest.approx(found.precession_per_nutation / found.period, rel=1e-14)
    return expected


@st.composite
def starts(draw: st.DrawFn) -> Start:
    lambda1 = draw(MOMENTS)
    lambda3 = lambda1 * draw(st.floats(0.01, 2))
    return (lambda1, lambda3, *draw(st.tuples(SPINS, TILTS, RATES, RATES)), draw(WEIGHTS))


@fewest
@given(starts())
@example((1.0, 0.5, 50.0, 0.5, 0.0, 0.0, 1.0))
@example((1.0, 0.5, 50.0, 0.5, -0.3, 0.0, 1.0))
@example((1.0, 0.5, 50.0, 0.5, 0.0, -0.3, 1.0))
@example((1.0, 0.5, 0.0, 2.5, 0.7, 0.0, 1.0))
@example((1.0, 1.9, 3.0, 1.0, 2.0, 1.0, 0.0))
def test_any_nutation(start: Start) -> None:
    found = nutation(*start)
    assume(found.kind not in ("steady", "none") and (start[2] != 0 or start[4] != 0))
    around = limits(start)
    assume(around["near"] > 1e-8 and around["closing"] > 1e-12)
    require_nutation(found, start)
    one, two = float(around["phi_dot_at_theta_min"]), float(around["phi_dot_at_theta_max"])
    if min(abs(one), abs(two)) > 1e-6 * max(abs(one), abs(two)):
        assert found.kind == ("looping" if one * two < 0 else "wavy")
    else:
        assume(min(abs(one), abs(two)) < 1e-20)
        assert found.kind == "cuspidal"


@pytest.mark.parametrize("spin", [1e3, -1e8])
@pytest.mark.parametrize("precession", [0.0, 1e-3, -1e-3])
def test_a_fast_top_keeps_the_digits_of_its_small_nutation(spin: float, precession: float) -> None:
    start = (1.0, 0.5, spin, 0.7, precession / spin, 0.0, 3.0)
    found = nutation(*start)
    require_nutation(found, start, 120)
    # Its fall is 2 M g R sin(theta) lambda1/(lambda3 spin)^2 (Goldstein, (5.71) in other words).
    fall = 2 * 3 * math.sin(0.7) / (0.5 * spin) ** 2
    assert found.theta_max - found.theta_min == pytest.approx(fall, rel=1e-2, abs=1e-15)
    assert found.mean_rate == pytest.approx(3 / (0.5 * spin), rel=1e-2)
    ahead = precession * spin * 1.0
    assert found.kind == ("cuspidal" if precession == 0 else "wavy" if ahead * spin > 0 else "looping")


@pytest.mark.parametrize("branch", ["slow", "fast"])
@pytest.mark.parametrize(("spin", "tilt"), [(-9.0, 0.4), (0.0, 2.0), (3.0, math.pi / 2)])
def test_the_rates_of_steady_precession_are_steady(branch: str, spin: float, tilt: float) -> None:
    rate = getattr(steady(1.0, 0.8, spin, tilt, 2.0, FLOAT), branch)
    if rate is None:
        return
    found = nutation(1.0, 0.8, spin, tilt, rate, 0.0, 2.0)
    assert found.kind == "steady"
    assert (found.theta_min, found.theta_max, found.mean_rate) == (tilt, tilt, rate)
    # A little off, the period is about the same.
    nearer = nutation(1.0, 0.8, spin, tilt, rate * (1 + 1e-9), 0.0, 2.0)
    assert nearer.kind == "wavy"
    assert nearer.period == pytest.approx(found.period, rel=1e-7)
    assert nearer.precession_per_nutation == pytest.approx(found.precession_per_nutation, rel=1e-7)
    start = (1.0, 0.8, spin, tilt, rate * (1 + 1e-9), 0.0, 2.0)
    require_nutation(nearer, start, 120)


def test_a_cusp_and_its_neighbours() -> None:
    kinds = [nutation(1.0, 0.5, 50.0, 0.5, rate, 0.0, 1.0).kind for rate in (-1e-9, -1e-15, 0, 1e-15, 1e-9)]
    assert kinds == ["looping", "cuspidal", "cuspidal", "cuspidal", "wavy"]


# --- through the vertical


def test_a_plane_pendulum() -> None:
    # Half of its period is that of the nutation: 4 K(sin(amplitude/2))/w there and back.
    found = nutation(2.0, 0.5, 0.0, 1.0, 0.0, 0.0, 3.0)
    amplitude = math.pi - 1.0
    expected = 2 * mpmath.ellipk(mpmath.sin(amplitude / 2) ** 2) / mpmath.sqrt(1.5)
    assert found.period == pytest.approx(float(expected), rel=1e-14)
    assert (found.theta_min, found.theta_max, found.kind) == (1.0, math.pi, "cuspidal")
    assert (found.precession_per_nutation, found.mean_rate) == (0, 0)


def test_a_pendulum_that_goes_over_the_top() -> None:
    # theta-dot^2 = 2 (E - M g R cos theta)/lambda1; from 0 to pi and back.
    found = nutation(2.0, 0.5, 0.0, 1.0, 0.0, -4.0, 3.0)
    excess = 16 + 3 * math.cos(1.0)
    time = 2 * mpmath.quad(lambda x: 1 / mpmath.sqrt(excess - 3 * mpmath.cos(x)), [0, mpmath.pi])
    assert found.period == pytest.approx(float(time), rel=1e-14)
    assert (found.theta_min, found.theta_max) == (0, math.pi)
    assert found.mean_rate == 0


@pytest.mark.parametrize("spin", [-1.0, 30.0])
def test_an_upright_top_with_a_push(spin: float) -> None:
    found = nutation(1.0, 0.5, spin, 0.0, 123.0, 0.4, 1.0)
    assert found.theta_min == 0
    assert found.phi_dot_at_theta_min == spin / 4
    assert found.kind == "wavy"
    # phi-dot = a/(1 + u) between u = 1 and the root of (1 + u)(alpha - beta u) = a^2 (1 - u)
    a, alpha = 0.5 * spin, 2 + 0.4**2
    linear = alpha - 2 + a * a
    u = (linear - math.sqrt(linear**2 + 8 * (alpha - a * a))) / 4
    assert found.theta_max == pytest.approx(math.acos(u), rel=1e-13)
    assert found.phi_dot_at_theta_max == pytest.approx(a / (1 + u), rel=1e-13)
    # Passing the vertical on either side, phi makes half a turn more, or less.
    assert found.precession_per_nutation is not None
    for precession in (1.0, -1.0):
        near = nutation(1.0, 0.5, spin, 1e-13, math.copysign(1, spin) * precession * 100, 0.4, 1.0)
        assert near.period == pytest.approx(found.period, rel=1e-12)
        assert near.theta_max == pytest.approx(found.theta_max, rel=1e-12)
        assert near.precession_per_nutation == pytest.approx(
            found.precession_per_nutation + math.copysign(1, spin) * precession * math.pi, rel=1e-12
        )


@pytest.mark.parametrize("tilt", [0.0, math.pi])
@pytest.mark.parametrize("spin", [0.0, 100.0])
def test_a_vertical_axis_rests(tilt: float, spin: float) -> None:
    found = nutation(1.0, 0.5, spin, tilt, 5.0, 0.0, 1.0)
    assert found == Nutation(tilt, tilt, None, None, None, None, None, "none")


def test_an_axis_that_nothing_moves_rests() -> None:
    found = nutation(1.0, 0.5, 30.0, 1.0, 0.0, 0.0, 0.0)
    assert found == Nutation(1, 1, 0, 0, None, None, 0, "none")


@pytest.mark.parametrize("tilt", [1e-3, 1e-100])
def test_a_stable_top_near_the_vertical(tilt: float) -> None:
    # Let go at rest, z = A exp(i W1 t) + B exp(i W2 t): |z| has the period of the beat.
    found = nutation(1.0, 0.5, 10.0, tilt, 0.0, 0.0, 1.0)
    one, two = sleeping(1.0, 0.5, 10.0, 1.0, FLOAT).frequencies or (0, 0)
    assert found.theta_min == tilt
    assert found.theta_max == pytest.approx(tilt * (two + one) / (two - one), rel=max(1e-14, tilt))
    assert found.period == pytest.approx(2 * math.pi / (two - one), rel=max(1e-14, tilt))
    assert found.phi_dot_at_theta_max == pytest.approx(2 * one * two / (two + one), rel=max(1e-14, tilt))
    assert found.kind == "cuspidal"


@pytest.mark.parametrize(
    ("tilt", "push", "precession"), [(1e-8, 0.5, 0.7), (1e-20, -1e3, 0.0), (1e-70, 0.0, 0.7)]
)
def test_an_unstable_top_near_the_vertical(tilt: float, push: float, precession: float) -> None:
    start = (1.0, 0.5, 1.0, tilt, precession, push * tilt, 1.0)
    found = nutation(*start)
    digits = 60 + 6 * round(-math.log10(tilt))
    require_nutation(found, start, digits)
