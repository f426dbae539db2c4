"""The heavy symmetric top against two independent truths, and its laws.

One truth is a Taylor series of Euler's equations with the vertical and the quaternion, summed in
decimals of 40 digits step by step; for many nutations it is continued with the period and the advances of
phi and psi by quadrature in mpmath, which know nothing of elliptic functions. The other is the program's
integrator, whose own tests do not use the closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Context, Decimal, localcontext
from operator import mul
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.core import rotation
from rigidcli.core.integrate import integrate
from rigidcli.core.lagrange import at, heavy_motion, sensitivity
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.tree import ONE, ZERO, Name, minus, number
from rigidcli.symbolic.mechanics import rigid_body

Floats = NDArray[np.float64]

few = settings(max_examples=20, deadline=None)

WIDE = Context(prec=40, Emax=10**9, Emin=-(10**9))
ORDER = 24
PRECISE = Decimal("1e-24")
"""What a step of the series leaves out, in units of the state."""


class Case(NamedTuple):
    """lambda1, lambda3, M g R, omega and orientation, and the times at which to look."""

    lambda1: float
    lambda3: float
    weight: float
    omega: Sequence[float]
    orientation: Sequence[float]
    times: Sequence[float] = (0.7, 3.1)

    def found(self, times: Sequence[float]) -> tuple[Floats, Floats]:
        motion = heavy_motion(*self[:3], np.array(self.omega, float), np.array(self.orientation, float))
        return at(motion, np.array(times, float))

    def limit(self, times: Sequence[float]) -> float:
        """What rounding of the inputs may do, ten times over."""
        omega, orientation = np.array(self.omega, float), np.array(self.orientation, float)
        return 10 * sensitivity(*self[:3], omega, orientation, np.array(times, float)) + 1e-13


def leaning(theta: float, phi: float = 0.0, psi: float = 0.0) -> list[float]:
    """The quaternion of these Euler angles (zxz)."""
    c, s = math.cos(theta / 2), math.sin(theta / 2)
    total, difference = (phi + psi) / 2, (phi - psi) / 2
    return [c * math.cos(total), s * math.cos(difference), s * math.sin(difference), c * math.sin(total)]


# --- the first truth: Taylor series in decimals


def convolution(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    return sum(map(mul, a, reversed(b)), Decimal(0))


def series(state: Sequence[Decimal], spin: Decimal, gyro: Decimal, fall: Decimal) -> list[list[Decimal]]:
    """The coefficients of w1, w2, the vertical z1..z3 in the body, and q0..q3.

    w1' = (1 - lambda3/lambda1) w3 w2 + fall z2 and so on, z' = z x w, q' = q (0, w)/2.
    """
    terms = w1, w2, z1, z2, z3, a, b, c, d = [[x] for x in state]
    for n in range(ORDER):
        slopes = (
            gyro * w2[n] + fall * z2[n],
            -gyro * w1[n] - fall * z1[n],
            spin * z2[n] - convolution(z3, w2),
            convolution(z3, w1) - spin * z1[n],
            convolution(z1, w2) - convolution(z2, w1),
            -(convolution(b, w1) + convolution(c, w2) + spin * d[n]) / 2,
            (convolution(a, w1) + spin * c[n] - convolution(d, w2)) / 2,
            (convolution(a, w2) - spin * b[n] + convolution(d, w1)) / 2,
            (spin * a[n] + convolution(b, w2) - convolution(c, w1)) / 2,
        )
        for part, slope in zip(terms, slopes, strict=True):
            part.append(slope / (n + 1))
    return terms


def summed(coefficients: Sequence[Decimal], h: Decimal) -> Decimal:
    value = Decimal(0)
    for coefficient in reversed(coefficients):
        value = value * h + coefficient
    return value


def taylor(case: Case, times: Sequence[float | Decimal]) -> list[tuple[list[Decimal], list[Decimal]]]:
    """omega and quaternion at `times`, each reached from the one before."""
    with localcontext(WIDE):
        first, third, weight = (Decimal(float(x)) for x in case[:3])
        w1, w2, spin = (Decimal(float(x)) for x in case.omega)
        q = [Decimal(float(x)) for x in case.orientation]
        length = sum((x * x for x in q), Decimal(0)).sqrt()
        a, b, c, d = q = [x / length for x in q]
        state = [w1, w2, 2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c, *q]
        gyro, fall = (1 - third / first) * spin, weight / first
        t, states = Decimal(0), []
        for time in times:
            target = +Decimal(time)
            while t != target:
                terms = series(state, spin, gyro, fall)
                # A tiny deviation from the vertical, which may grow, has its own scale.
                rate = fall.sqrt()
                size = min(rate, rate * (abs(state[2]) + abs(state[3]))) + abs(state[0]) + abs(state[1])
                scales = [size, size, size / rate, size / rate] + [Decimal(1)] * 5
                h = target - t
                for n in (ORDER - 1, ORDER):
                    last = max(
                        abs(part[n]) / scale for part, scale in zip(terms, scales, strict=True) if scale
                    )
                    if last:
                        h = min(abs(h), ((PRECISE / last).ln() / n).exp()).copy_sign(h)
                state = [summed(part, h) for part in terms]
                t = target if h == target - t else t + h
            states.append(([state[0], state[1], spin], state[5:]))
        return states


def angle(found: Floats, true: Sequence[Decimal]) -> float:
    """The angle (rad) between two orientations."""
    with localcontext(WIDE):
        a, b, c, d = (Decimal(float(x)) for x in found)
        e, f, g, h = true
        across = [a * f - b * e - c * h + d * g, a * g - c * e - d * f + b * h, a * h - d * e - b * g + c * f]
        along = abs(a * e + b * f + c * g + d * h)
        return 2 * math.atan2(float(sum((x * x for x in across), Decimal(0)).sqrt()), float(along))


def require(case: Case, times: Sequence[float], true: Sequence[tuple[Any, Any]], limit: float) -> None:
    """Attitude (rad) and omega (in units of its scale) are within `limit` of the truth."""
    omega, orientation = case.found(times)
    size = math.sqrt(case.weight / case.lambda1) + max(abs(float(x)) for spin, _ in true for x in spin)
    for w, q, (spin, attitude) in zip(omega, orientation, true, strict=True):
        assert angle(q, attitude) <= limit
        assert max(abs(x - float(y)) for x, y in zip(w, spin, strict=True)) <= limit * size
        assert abs(float(np.linalg.norm(q)) - 1) < 1e-15


HALF = [0.5, 0.5, 0.5, 0.5]
"""The axis along y, horizontal."""

UPRIGHT, HANGING = [0.6, 0, 0, 0.8], [0, 0.6, 0.8, 0]

THROUGH = 1.5 * math.tan(0.5)
"""w2 of an axis at 1 rad with L_z = L_3 = 1.5, which goes through the vertical; b - a u = w2 sin(theta)."""

CASES: dict[str, Case] = {
    **{
        f"octant {x:+d}{y:+d}{z:+d}": Case(
            1, 0.7, 2, [1.1 * x, 0.4 * y, 2.3 * z], [0.3, x, -0.5 * y, 0.8 * z]
        )
        for x in (1, -1)
        for y in (1, -1)
        for z in (1, -1)
    },
    "cuspidal": Case(1, 0.5, 1, [0, 0, 10], leaning(0.5)),
    "looping": Case(1, 0.5, 1, [0, -0.3, 10], leaning(0.5)),
    "wavy": Case(1, 0.5, 1, [0, 0.3, 10], leaning(0.5)),
    "spun backwards": Case(1, 0.5, 1, [0.2, 0.3, -10], leaning(0.5, 1, 2)),
    "very fast": Case(1, 0.5, 1, [0.3, 0.4, 300], leaning(0.5, 1, 2), (0.2, -0.1)),
    "prolate": Case(1, 1e-3, 1, [0.3, 0.4, 30], leaning(0.5, 1, 2)),
    "flat": Case(1, 2, 1, [0.3, 0.4, 3], leaning(0.5, 1, 2)),
    "spherical": Case(1, 1, 1, [0.3, 0.4, 3], leaning(0.5, 1, 2)),
    "spherical pendulum": Case(1, 0.5, 1, [0.3, 0.4, 0], leaning(2.5, 1, 2)),
    "swinging pendulum": Case(1, 0.5, 1, [1, 0, 0], leaning(2.5)),
    "pendulum from rest": Case(1, 0.5, 1, [0, 0, 0], leaning(0.5)),
    "rotating pendulum": Case(1, 0.5, 1, [3, 0, 0], leaning(2.5)),
    "pendulum rotating the other way": Case(1, 0.5, 1, [-3, 0, 0], leaning(0.5)),
    "hanging": Case(1, 0.5, 1, [0, 0, 3], HANGING),
    "hanging at rest": Case(1, 0.5, 1, [0, 0, 0], HANGING),
    "hanging, pushed": Case(1, 0.5, 1, [0.3, 0.1, 3], HANGING),
    "hanging without spin, pushed": Case(1, 0.5, 1, [0.3, 0.1, 0], HANGING),
    "hanging but for rounding": Case(1, 0.5, 1, [0, 0, 3], leaning(math.pi)),
    **{f"upright, spin {spin}": Case(1, 0.5, 1, [0, 0, spin], UPRIGHT) for spin in (10, 4, 2, 0, -3)},
    **{f"upright, pushed, spin {s}": Case(1, 0.5, 1, [0.3, 0.1, s], UPRIGHT) for s in (10, 4, 2, 0, -3)},
    "through the top": Case(1, 0.5, 1, [0.7, THROUGH, 3], leaning(1.0)),
    "through the bottom": Case(1, 0.5, 1, [0.7, 1.5 / math.tan(0.5) * -1, 3], leaning(1.0)),
    "almost through the top": Case(1, 0.5, 1, [2.7, THROUGH + 1e-9, 3], leaning(1.0)),
    "almost through the bottom": Case(1, 1.6, 12.5, [0, 0, -8e-7], [0, -1.25, 0.02, -1.23], (0.99, -2.0)),
    "steady, slow": Case(1, 0.5, 2, [0, 1.0, 6], [math.sqrt(0.75), 0.5, 0, 0]),
    "steady, horizontal": Case(1, 0.5, 1.5, [0, 1, 3], HALF),
    "steady, conical pendulum": Case(1, 0.5, 2, [0, 1.5, 0], leaning(2.0)),
    **{
        f"{where} but for 1e{k}, spin {spin}, {how}": Case(
            1,
            0.5,
            1,
            [3 * push, 2 * push, spin],
            [1, e, 0.3 * e, 0.2] if where == "upright" else [e, 1, 0.2, 0],
        )
        for k in (-8, -40, -150)
        for e in (10.0**k,)
        for where, spin, how, push in (
            ("upright", 10, "pushed", e),
            ("upright", 0, "released", 0.0),
            ("upright", 2, "pushed", e),
            ("upright", -3, "released", 0.0),
            ("hanging", 0, "pushed", e),
            ("hanging", 3, "pushed", e),
        )
    },
    "nearly hanging, fast through the bottom": Case(1, 0.5, 1, [2.5, -0.2, 0], [1e-77, -1e-79, -0.07, 0]),
    "nearly hanging, with spin, through the bottom": Case(
        1, 0.05, 12, [-0.4, 0, -2], [-3e-88, 1, 0.2, 3e-78]
    ),
    "nearest to the top": Case(1, 0.5, 1.94, [5e-5, 0, 0.49], [-1.5, 0, 1e-8, 0]),
    "plane but for 1e-76": Case(1, 0.3, 1, [0, 1e-76, 0], [1e-4, 3e-4, 1e-7, -1]),
    "falling over from 1e-12": Case(1, 0.5, 1, [0, 0, 2], [1, 1e-12, 0, 0], (30.0, 40.0)),
    "falling over from 1e-40": Case(1, 0.5, 1, [0, 0, 0.5], [1, 1e-40, 0, 0], (93.0, 96.0)),
    # beta (1 - u) = omega^2 and b = a, exactly in floats: it rises to the vertical forever.
    **{
        f"homoclinic {x:+d}{name}": Case(1, 0.5, 12.5, [x * w1, 4 * y, 8 * y], HALF, (0.3, 5.0, -1.0, -6.0))
        for x in (1, -1)
        for name, w1, y in (("", 3, 1), (", spun backwards", 3, 1), (" pendulum", 5, 0))
    },
    **{
        f"beside the homoclinic {e:+.0e}": Case(1, 0.5, 12.5, [3 + e, 4, 8], HALF, (0.3, 3.0, -6.0))
        for size in (1e-15, 1e-12, 1e-8, 1e-3)
        for e in (size, -size)
    },
    "beside the homoclinic, past the top": Case(1, 0.5, 12.5, [3, 4 + 1e-9, 8], HALF, (3.0, -6.0)),
    "beside the plane homoclinic": Case(1, 0.5, 0.5, [1, 1e-20, 0], HALF, (20.0, -30.0)),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_against_direct_integration_in_decimals(case: Case) -> None:
    for times in ([t for t in case.times if t > 0], [t for t in case.times if t < 0]):
        if times:
            require(case, times, taylor(case, times), case.limit(times))


@pytest.mark.parametrize("mass", [1e-150, 1e-40, 1e100])
@pytest.mark.parametrize("rate", [1e-70, 1e-20, 1e50])
@pytest.mark.parametrize("name", ["octant +1-1+1", "looping", "through the top", "upright, pushed, spin 2"])
def test_units_do_not_matter(name: str, mass: float, rate: float) -> None:
    # Powers of two scale without rounding: the attitude is the same, and omega is scaled.
    case, m, r = CASES[name], math.frexp(mass)[1], math.frexp(rate)[1]
    scaled = Case(
        math.ldexp(case.lambda1, m),
        math.ldexp(case.lambda3, m),
        math.ldexp(case.weight, m + 2 * r),
        np.ldexp(case.omega, r).tolist(),
        case.orientation,
    )
    times = np.array([-6.1, 0.7, 300.0])
    omega, orientation = case.found(times.tolist())
    found, turned = scaled.found(np.ldexp(times, -r).tolist())
    assert np.ldexp(found, -r) == pytest.approx(omega, rel=1e-13, abs=1e-13)
    assert rotation.angles_between(orientation, turned).max() < 1e-13


# --- many nutations


def nutation(case: Case) -> tuple[Any, Any, Any]:
    """The period and what phi and psi advance by in it; each jumps by pi where the axis is vertical.

    With u = m - h cos x between the roots of f = (1-u^2)(alpha - beta u) - (b - a u)^2 all three are
    integrals of periodic analytic functions of x, for which the midpoint rule converges geometrically.
    """
    l1, l3, weight = (mpmath.mpf(float(x)) for x in case[:3])
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
    middle, half = (low + high) / 2, (high - low) / 2
    points, sums = 300, [mpmath.mpf(0)] * 3
    for k in range(points):
        u = middle - half * mpmath.cos((k + mpmath.mpf(0.5)) * mpmath.pi / points)
        dt = 1 / mpmath.sqrt(beta * (third - u))
        phi = (b - a * u) / (1 - u * u)
        sums = [x + dt * y for x, y in zip(sums, (1, phi, w3 - u * phi), strict=True)]
    period, phi, psi = (2 * mpmath.pi / points * x for x in sums)
    jump = mpmath.pi if max(high, -low) > 1 - mpmath.mpf("1e-30") else 0
    return period, phi + jump, psi + jump


def product(p: Sequence[Any], q: Sequence[Any]) -> list[Any]:
    a, b, c, d = p
    e, f, g, h = q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g + c * e + d * f - b * h,
        a * h + d * e + b * g - c * f,
    ]


def about_z(turn: Any) -> list[Any]:
    return [mpmath.cos(turn / 2), mpmath.mpf(0), mpmath.mpf(0), mpmath.sin(turn / 2)]


LONG = [
    "octant +1-1+1",
    "octant -1-1-1",
    "cuspidal",
    "looping",
    "wavy",
    "spun backwards",
    "flat",
    "spherical pendulum",
    "hanging, pushed",
    "upright, pushed, spin 10",
]


@pytest.mark.parametrize("name", LONG)
def test_many_nutations(name: str) -> None:
    case = CASES[name]
    with mpmath.workdps(45):
        period, phi, psi = nutation(case)
        for count in (1, 10_000, -10_000, 1_000_000):
            time = float(period * (count + 0.3))
            rest = Decimal(mpmath.nstr(mpmath.mpf(time) - count * period, 40))
            ((spin, attitude),) = taylor(case, [rest])
            w1, w2, w3 = (mpmath.mpf(str(x)) for x in spin)
            c, s = mpmath.cos(count * psi), mpmath.sin(count * psi)
            turned = [c * w1 + s * w2, c * w2 - s * w1, w3]
            q = product(
                product(about_z(count * phi), [mpmath.mpf(str(x)) for x in attitude]), about_z(count * psi)
            )
            true = [Decimal(mpmath.nstr(x, 40)) for x in q]
            # Not with the limit of the inputs: for what the numbers say exactly, nothing is lost with time.
            require(case, [time], [(turned, true)], 1e-13)


# --- the second truth: the program's integrator


def integrated(case: Case, times: Floats) -> tuple[Floats, Floats]:
    q = [Name(name) for name in rigid_body.STATE[1:5]]
    down = [minus(part) for part in rigid_body.rotated(q, (ZERO, ZERO, ONE), back=True)]
    torque = rigid_body.cross([ZERO, ZERO, number(case.weight)], down)
    moments = np.array([case.lambda1, case.lambda1, case.lambda3])
    flow = code.function(rigid_body.equations(moments, torque), rigid_body.STATE, {})
    start = np.array(case.orientation) / np.linalg.norm(case.orientation)
    solution = integrate(
        flow,
        np.concatenate([start, moments * case.omega]),
        (0.0, float(times[-1])),
        tolerance=1e-14,
        blocks=(4, 3),
        engine="runge-kutta",
    )
    states = solution.at(times)
    return states[:, 4:] / moments, states[:, :4]


@pytest.mark.parametrize("name", ["octant +1-1+1", "looping", "rotating pendulum", "through the top", "flat"])
@pytest.mark.parametrize("span", [60.0, -60.0])
def test_against_the_integrator(name: str, span: float) -> None:
    times = np.linspace(0, span, 500)
    omega, orientation = CASES[name].found(times.tolist())
    other, turned = integrated(CASES[name], times)
    assert rotation.angles_between(orientation, turned).max() < 2e-12
    assert omega == pytest.approx(other, abs=1e-11)


# --- laws

NUMBERS = st.floats(-3, 3).map(lambda x: 0.0 if abs(x) < 1e-9 else x)
TOPS = st.builds(
    Case,
    st.just(1.0),
    st.floats(0.05, 2),
    st.floats(0.1, 5),
    st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS).filter(lambda q: math.hypot(*q) > 0.1),
)
TIMES = st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=20)


@few
@given(TOPS, TIMES)
def test_energy_and_both_momenta_are_kept(case: Case, times: list[float]) -> None:
    # By the attitude as it is: that of t = 0 is first found, not given.
    omega, orientation = case.found([0.0, *times])
    vertical = rotation.turned(orientation * [1, -1, -1, -1], np.broadcast_to([0.0, 0.0, 1.0], omega.shape))
    momentum = omega * [case.lambda1, case.lambda1, case.lambda3]
    energy = np.einsum("ij,ij->i", omega, momentum) / 2 + case.weight * vertical[:, 2]
    upward = np.einsum("ij,ij->i", momentum, vertical)
    assert energy == pytest.approx(energy[0], abs=1e-13 * (abs(energy[0]) + 2 * case.weight + 1))
    assert upward == pytest.approx(upward[0], abs=1e-13 * (np.abs(momentum).max() + 1))
    assert omega[:, 2].tolist() == [case.omega[2]] * len(omega)
    assert np.linalg.norm(orientation, axis=1) == pytest.approx(1, abs=1e-15)


@few
@given(TOPS)
def test_it_begins_as_it_is_given(case: Case) -> None:
    omega, orientation = case.found([0.0])
    given_turn = np.array([case.orientation]) / np.linalg.norm(case.orientation)
    assert rotation.angles_between(orientation, given_turn)[0] < 1e-14
    assert omega[0] == pytest.approx(case.omega, abs=1e-13)


@few
@given(TOPS, st.floats(-30, 30), st.floats(-30, 30))
def test_motions_go_on_from_where_they_are(case: Case, first: float, second: float) -> None:
    omega, orientation = case.found([first, first + second])
    onward = case._replace(omega=omega[0].tolist(), orientation=orientation[0].tolist())
    later, turned = onward.found([second])
    # The state in between is rounded.
    limit = 2 * onward.limit([second]) + 2 * case.limit([first, first + second])
    if limit < 1e-6:
        assert rotation.angles_between(turned, orientation[1:])[0] < limit
        assert later[0] == pytest.approx(omega[1], abs=10 * limit)


@few
@given(TOPS, st.lists(st.floats(-100, 100), min_size=1, max_size=10))
def test_time_reversal(case: Case, times: list[float]) -> None:
    # With omega reversed, the top goes back along its own way.
    omega, orientation = case.found(times)
    back = case._replace(omega=[-x for x in case.omega])
    reversed_omega, turned = back.found([-t for t in times])
    limit = case.limit(times) + back.limit([-t for t in times])
    if limit < 1e-6:
        assert rotation.angles_between(orientation, turned).max() < limit
        assert reversed_omega == pytest.approx(-omega, abs=10 * limit)


@pytest.mark.parametrize("name", CASES)
def test_there_is_always_a_number(name: str) -> None:
    times = [0.0, 1e-300, -1e-300, 1e-8, 400.0, -400.0, 1e9, 1e15]
    omega, orientation = CASES[name].found(times)
    assert np.isfinite(omega).all()
    assert np.linalg.norm(orientation, axis=1) == pytest.approx(1, abs=1e-15)


def test_the_homoclinic_top_rises_forever() -> None:
    # 1 - u falls as exp(-2 rate t): after 100 s nothing of it is left, and the top sleeps.
    omega, orientation = CASES["homoclinic +1"].found([100.0, 1e4])
    assert np.abs(orientation[:, 1:3]).max() < 1e-100
    assert omega == pytest.approx(np.array([[0, 0, 8.0]] * 2), abs=1e-100)


def test_samples_do_not_depend_on_each_other() -> None:
    case, times = CASES["looping"], np.linspace(-1e4, 1e4, 20_001)
    omega, orientation = case.found(times.tolist())
    for k in (0, 8191, 8192, 16384, 20_000):
        one_omega, one = case.found([float(times[k])])
        assert one_omega[0] == pytest.approx(omega[k], abs=1e-14)
        assert one[0] == pytest.approx(orientation[k], abs=1e-14)
    none = case.found([])
    assert (none[0].shape, none[1].shape) == ((0, 3), (0, 4))


# --- what the inputs themselves leave open


def test_the_sensitivity_is_what_rounding_of_the_inputs_does() -> None:
    case, times, share = CASES["octant +1-1+1"], np.array([0.0, 100.0]), 2.0**-20
    reference = integrated(case, times)[1]
    changed = [
        case._replace(lambda1=case.lambda1 * (1 + share)),
        case._replace(lambda3=case.lambda3 * (1 + share)),
        case._replace(weight=case.weight * (1 + share)),
        *(
            case._replace(omega=[x * (1 + share * (i == k)) for i, x in enumerate(case.omega)])
            for k in range(3)
        ),
        *(
            case._replace(orientation=[x * (1 + share * (i == k)) for i, x in enumerate(case.orientation)])
            for k in range(4)
        ),
    ]
    angles = [rotation.angles_between(reference, integrated(other, times)[1]) for other in changed]
    # One unit in the last place is between eps/2 and eps of a number.
    expected = float(np.linalg.norm(angles, axis=0).max()) / share * 2.0**-52
    found = sensitivity(*case[:3], np.array(case.omega), np.array(case.orientation), times)
    assert expected / 2.1 < found < expected * 1.1


def test_the_sensitivity_of_what_rounding_decides() -> None:
    assert CASES["homoclinic +1"].limit([0.0, 20.0]) > 1
    assert CASES["upright, spin 2"].limit([0.0, 20.0]) < 1e-12
