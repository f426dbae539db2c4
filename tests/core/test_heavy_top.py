"""The heavy symmetric top against a truth of its own.

For many nutations it is continued with the period and the advances of phi and psi, by integrals in mpmath.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

import mpmath
import numpy as np
import pytest

from rigidcli.core import rotation
from tests.core.rigid_motion import Motion, State, by_series, effect_of_rounding, leaning
from tests.tables import rows_of


def top(
    lambda1: float,
    lambda3: float,
    weight: float,
    omega: Sequence[float],
    orientation: Sequence[float],
    times: Sequence[float] = (0.7, 3.1),
) -> Motion:
    return Motion(np.diag(np.array([lambda1, lambda1, lambda3], float)), omega, orientation, times, weight)


HALF = [0.5, 0.5, 0.5, 0.5]
"""The axis along y, horizontal."""

UPRIGHT, HANGING = [0.6, 0, 0, 0.8], [0, 0.6, 0.8, 0]

THROUGH = 1.5 * math.tan(0.5)
"""w2 of an axis at 1 rad with L_z = L_3 = 1.5, which goes through the vertical; b - a u = w2 sin(theta)."""

CASES: dict[str, Motion] = {
    **{
        f"octant {x:+d}{y:+d}{z:+d}": top(1, 0.7, 2, [1.1 * x, 0.4 * y, 2.3 * z], [0.3, x, -0.5 * y, 0.8 * z])
        for x, y, z in ((1, 1, 1), (1, -1, 1), (-1, 1, -1), (-1, -1, -1))
    },
    "cuspidal": top(1, 0.5, 1, [0, 0, 10], leaning(0.5)),
    "looping": top(1, 0.5, 1, [0, -0.3, 10], leaning(0.5)),
    "wavy": top(1, 0.5, 1, [0, 0.3, 10], leaning(0.5)),
    "spun backwards": top(1, 0.5, 1, [0.2, 0.3, -10], leaning(0.5, 1, 2)),
    "very fast": top(1, 0.5, 1, [0.3, 0.4, 300], leaning(0.5, 1, 2), (0.2, -0.1)),
    "prolate": top(1, 1e-3, 1, [0.3, 0.4, 30], leaning(0.5, 1, 2)),
    "flat": top(1, 2, 1, [0.3, 0.4, 3], leaning(0.5, 1, 2)),
    "spherical": top(1, 1, 1, [0.3, 0.4, 3], leaning(0.5, 1, 2)),
    "spherical pendulum": top(1, 0.5, 1, [0.3, 0.4, 0], leaning(2.5, 1, 2)),
    "pendulum from rest": top(1, 0.5, 1, [0, 0, 0], leaning(0.5)),
    "rotating pendulum": top(1, 0.5, 1, [3, 0, 0], leaning(2.5)),
    "pendulum rotating the other way": top(1, 0.5, 1, [-3, 0, 0], leaning(0.5)),
    "hanging": top(1, 0.5, 1, [0, 0, 3], HANGING),
    "hanging, pushed": top(1, 0.5, 1, [0.3, 0.1, 3], HANGING),
    **{f"upright, spin {spin}": top(1, 0.5, 1, [0, 0, spin], UPRIGHT) for spin in (4, 2)},
    **{f"upright, pushed, spin {s}": top(1, 0.5, 1, [0.3, 0.1, s], UPRIGHT) for s in (10, 2, 0, -3)},
    "through the top": top(1, 0.5, 1, [0.7, THROUGH, 3], leaning(1.0)),
    "through the bottom": top(1, 0.5, 1, [0.7, 1.5 / math.tan(0.5) * -1, 3], leaning(1.0)),
    "almost through the top": top(1, 0.5, 1, [2.7, THROUGH + 1e-9, 3], leaning(1.0)),
    "almost through the bottom": top(1, 1.6, 12.5, [0, 0, -8e-7], [0, -1.25, 0.02, -1.23], (0.99, -2.0)),
    "steady, slow": top(1, 0.5, 2, [0, 1.0, 6], [math.sqrt(0.75), 0.5, 0, 0]),
    "steady, horizontal": top(1, 0.5, 1.5, [0, 1, 3], HALF),
    "steady, conical pendulum": top(1, 0.5, 2, [0, 1.5, 0], leaning(2.0)),
    **{
        f"{where} but for 1e{k}, spin {spin}, {how}": top(
            1,
            0.5,
            1,
            [3 * push, 2 * push, spin],
            [1, e, 0.3 * e, 0.2] if where == "upright" else [e, 1, 0.2, 0],
        )
        for k in (-8, -40)
        for e in (10.0**k,)
        for where, spin, how, push in (
            ("upright", 2, "pushed", e),
            ("upright", -3, "released", 0.0),
            ("hanging", 3, "pushed", e),
        )
    },
    "nearly hanging, fast through the bottom": top(1, 0.5, 1, [2.5, -0.2, 0], [1e-77, -1e-79, -0.07, 0]),
    "nearly hanging, with spin, through the bottom": top(1, 0.05, 12, [-0.4, 0, -2], [-3e-88, 1, 0.2, 3e-78]),
    "nearest to the top": top(1, 0.5, 1.94, [5e-5, 0, 0.49], [-1.5, 0, 1e-8, 0]),
    "plane but for 1e-76": top(1, 0.3, 1, [0, 1e-76, 0], [1e-4, 3e-4, 1e-7, -1]),
    "falling over from 1e-12": top(1, 0.5, 1, [0, 0, 2], [1, 1e-12, 0, 0], (30.0, 40.0)),
    "falling over from 1e-40": top(1, 0.5, 1, [0, 0, 0.5], [1, 1e-40, 0, 0], (93.0, 96.0)),
    # beta (1 - u) = omega^2 and b = a, exactly in floats: it rises to the vertical forever.
    **{
        f"homoclinic {x:+d}{name}": top(1, 0.5, 12.5, [x * w1, 4 * y, 8 * y], HALF, (0.3, 5.0, -1.0, -6.0))
        for x in (1, -1)
        for name, w1, y in (("", 3, 1), (", spun backwards", 3, 1), (" pendulum", 5, 0))
    },
    **{
        f"beside the homoclinic {e:+.0e}": top(1, 0.5, 12.5, [3 + e, 4, 8], HALF, (0.3, 3.0, -6.0))
        for e in (1e-15, -1e-12, 1e-8, -1e-3)
    },
    # Of 8,300 random tops, those in which the formulas lost most, or might: phi jumps again and again.
    "let go beside the top, without spin": top(0.75, 0.0278, 29.8, [-4.7e-6, 7.4e-6, 0], leaning(8e-7)),
    "let go beside the top, with a little spin": top(1, 0.5, 1, [0, 1e-7, 1e-6], leaning(1e-5)),
    "pendulum nearly in a plane": top(0.131, 0.242, 0.21, [0.194, 2.4e-6, 0], leaning(2.38)),
    "turning nearly in a plane": top(0.33, 7e-4, 0.17, [49, 6e-4, 1e-5], leaning(1.57)),
    "hanging, hit hard": top(1.26, 0.0104, 20.7, [5.2, 0.3, 0], HANGING),
    "just able to sleep": top(1, 0.5, 1, [1e-6, 2e-6, 4.01], leaning(1e-6)),
    "just unable to sleep": top(1, 0.5, 1, [1e-6, 2e-6, 3.9], leaning(1e-6)),
    "cuspidal, without much spin": top(1, 0.05, 8, [0, 0, 0.6], leaning(2.0)),
    "nearly steady": top(1, 0.5, 2, [0, 1 + 1e-9, 6], [math.sqrt(0.75), 0.5, 0, 0]),
    "beside the homoclinic, past the top": top(1, 0.5, 12.5, [3, 4 + 1e-9, 8], HALF, (3.0, -6.0)),
    "beside the plane homoclinic": top(1, 0.5, 0.5, [1, 1e-20, 0], HALF, (20.0, -30.0)),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_against_direct_integration_in_decimals(case: Motion) -> None:
    case.require()


@pytest.mark.parametrize(("mass", "rate"), [(1e-150, 1e50), (1e100, 1e-70)])
@pytest.mark.parametrize("name", ["looping", "through the top"])
def test_units_do_not_matter(name: str, mass: float, rate: float) -> None:
    # Powers of two scale without rounding: the attitude is the same, and omega is scaled.
    case, m, r = CASES[name], math.frexp(mass)[1], math.frexp(rate)[1]
    scaled = case._replace(
        inertia=np.ldexp(case.inertia, m),
        weight=math.ldexp(case.weight, m + 2 * r),
        omega=np.ldexp(case.omega, r),
    )
    times = np.array([-6.1, 0.7, 300.0])
    omega, orientation = case.found(times.tolist())
    found, turned = scaled.found(np.ldexp(times, -r).tolist())
    assert np.ldexp(found, -r) == pytest.approx(omega, rel=1e-13, abs=1e-13)
    assert rotation.angles_between(orientation, turned).max() < 1e-13


# --- many nutations


def nutation(case: Motion) -> tuple[Any, Any, Any]:
    """The period and what phi and psi advance by in it; each jumps by pi where the axis is vertical.

    H. Goldstein, Classical Mechanics, section 5.7: phi' = (b - a u)/(1 - u^2) and psi' = w3 - u phi'.
    """
    l1, l3, weight = (mpmath.mpf(float(x)) for x in case.inputs[:3])
    w1, w2, w3 = (mpmath.mpf(float(x)) for x in case.omega)
    q = [mpmath.mpf(float(x)) for x in case.orientation]
    length = mpmath.sqrt(sum(x * x for x in q))
    q0, q1, q2, q3 = (x / length for x in q)
    u = q0**2 + q3**2 - q1**2 - q2**2
    a, beta = l3 * w3 / l1, 2 * weight / l1
    b = a * u + w1 * 2 * (q1 * q3 - q0 * q2) + w2 * 2 * (q2 * q3 + q0 * q1)
    alpha = w1**2 + w2**2 + beta * u
    cubic = [beta, -alpha - a * a, 2 * a * b - beta, alpha - b * b]
    low, high, third = sorted(map(mpmath.re, mpmath.polyroots(cubic, maxsteps=200, extraprec=200)))
    whole = mpmath.sqrt(beta * (third - low))
    m = (high - low) / (third - low)
    rounding = mpmath.mpf("1e-30")
    down = up = mpmath.mpf(0)
    if 1 - high > rounding:
        down = (b - a) / (1 - low) * mpmath.ellippi((high - low) / (1 - low), m)
    if 1 + low > rounding:
        up = (b + a) / (1 + low) * mpmath.ellippi((low - high) / (1 + low), m)
    period, phi = 4 * mpmath.ellipk(m) / whole, 2 * (down + up) / whole
    psi = (w3 - a) * period - 2 * (down - up) / whole
    jump = mpmath.pi if max(high, -low) >= 1 - rounding else 0
    return period, phi + jump, psi + jump


def about_z(turn: Any) -> Any:
    c, s = mpmath.cos(turn), mpmath.sin(turn)
    return mpmath.matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


LONG = rows_of(__file__, "long")


def after(case: Motion, count: int) -> tuple[State, float]:
    """The state some time after so many nutations, and the time."""
    with mpmath.workdps(60):
        period, phi, psi = nutation(case)
        time = float(period * (count + 0.3))
        rest = Decimal(mpmath.nstr(mpmath.mpf(time) - count * period, 40))
        ((spin, attitude),) = by_series(case, [rest])
        turn = about_z(count * psi)
        return (list(turn.T * mpmath.matrix(spin)), about_z(count * phi) * attitude * turn), time


@pytest.mark.parametrize("name", LONG)
def test_many_nutations(name: str) -> None:
    for count in (1, 100, -10_000, 1_000_000):
        true, time = after(CASES[name], count)
        CASES[name].require([true], [time])


@pytest.mark.parametrize("name", CASES)
def test_there_is_always_a_number(name: str) -> None:
    times = [0.0, 1e-300, -1e-300, 1e-8, 400.0, -400.0, 1e9, 1e12]
    omega, orientation = CASES[name].found(times)
    assert np.isfinite(omega).all()
    assert np.linalg.norm(orientation, axis=1) == pytest.approx(1, abs=1e-15)


def test_the_homoclinic_top_rises_forever() -> None:
    # 1 - u falls as exp(-2 rate t): after 100 s nothing of it is left, and the top sleeps.
    omega, orientation = CASES["homoclinic +1"].found([100.0, 1e4])
    assert np.abs(orientation[:, 1:3]).max() < 1e-100
    assert omega == pytest.approx(np.array([[0, 0, 8.0]] * 2), abs=1e-100)


# --- what the inputs themselves leave open


def test_the_sensitivity_is_what_rounding_of_the_inputs_does() -> None:
    case = CASES["octant +1-1+1"]
    expected = effect_of_rounding(case, lambda top: by_series(top, [5.0]))
    assert expected / 2.1 < case.sensitivity([5.0]) < expected * 1.1


def test_the_sensitivity_of_what_rounding_decides() -> None:
    assert 10 * CASES["homoclinic +1"].sensitivity([0.0, 20.0]) > 1
    assert CASES["upright, spin 2"].sensitivity([0.0, 20.0]) < 1e-12
