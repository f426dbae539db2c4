"""Steady precession and the sleeping top against roots of many digits, and the equations of motion."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rigidcli.algebra import arithmetic, expressions
from rigidcli.algebra.arithmetic import EXACT
from rigidcli.core import precession
from rigidcli.core.arithmetic import FLOAT
from rigidcli.core.precession import sleeping, steady
from tests.core.tops import MOMENTS, SPINS, TILTS, WEIGHTS

few = settings(max_examples=30)
many = settings(max_examples=80)

# An expression stands where the formulas say float.
ex: Any = expressions
work: Any = arithmetic


def test_the_sine_of_a_hanging_top_is_zero_and_every_other_keeps_its_digits() -> None:
    assert (
        precession.sine(math.pi, FLOAT)
        == precession.sine(math.radians(180), FLOAT)
        == precession.sine(0.0, FLOAT)
        == 0
    )
    assert precession.sine(ex.PI, EXACT) == 0
    for angle in (1e-300, 1e-20, 1e-8, 1.0, 3.0, math.pi - 1e-8, math.pi - 1e-14):
        assert precession.sine(angle, FLOAT) == pytest.approx(float(mpmath.sin(angle)), rel=1e-15, abs=0)


# --- rates


def test_the_gyroscopic_rate_has_the_sign_of_the_spin_and_needs_one() -> None:
    assert precession.gyroscopic_rate(2.0, -5.0, 3.0, FLOAT) == -0.3
    assert precession.gyroscopic_rate(2.0, 0.0, 3.0, FLOAT) is None
    assert precession.gyroscopic_rate(0.0, 7.0, 3.0, FLOAT) is None


def reference_rates(lambda1: float, lambda3: float, spin: float, tilt: float, weight: float) -> list[Any]:
    with mpmath.workdps(900):
        a = mpmath.mpf(lambda1) * mpmath.cos(mpmath.mpf(tilt))
        s = mpmath.mpf(lambda3) * mpmath.mpf(spin)
        root = mpmath.sqrt(s * s - 4 * a * mpmath.mpf(weight))
        return sorted([(s + root) / (2 * a), (s - root) / (2 * a)], key=lambda z: (abs(z), z.real, z.imag))


@many
@given(MOMENTS, MOMENTS, SPINS, TILTS, WEIGHTS)
@example(1.0, 0.5, 1e9, 0.3, 1.0)
@example(1.0, 0.5, -1e9, 2.9, 1e-9)
@example(1.0, 0.5, 0.0, 2.5, 4.0)
@example(1.0, 0.5, 0.0, 0.5, 4.0)
@example(1.0, 0.5, 1e-170, 2.5, 4e-300)
@example(1e-200, 1e-200, 1e200, 0.5, 1e-200)
@example(3.0, 2.0, -5.0, math.pi / 2 - 1e-12, 7.0)
def test_the_rates_are_the_roots(
    lambda1: float, lambda3: float, spin: float, tilt: float, weight: float
) -> None:
    assume(tilt != math.pi / 2)
    found = steady(lambda1, lambda3, spin, tilt, weight, FLOAT)
    one, two = reference_rates(lambda1, lambda3, spin, tilt, weight)
    # cos(tilt) is known to eps, which the distance of the roots divides.
    with mpmath.workdps(60):
        spread = abs(two - one) / max(abs(one), abs(two)) if two else mpmath.mpf(1)
    assume(spread > 1e-6)
    wide = 4e-15 * float(1 + 1 / spread**2) + 4e-16 * abs(math.tan(tilt))
    if isinstance(one, mpmath.mpc) and one.imag != 0:
        assert found.slow is None
        assert found.fast is None
        low, high = found.complex_roots
        assert low == (high[0], -high[1])
        assert high[1] > 0
        assert high[0] == pytest.approx(float(one.real), rel=wide)
        assert high[1] == pytest.approx(abs(float(one.imag)), rel=wide)
        return
    assert found.complex_roots == ()
    assert found.slow == pytest.approx(float(one.real), rel=wide, abs=0)
    assert found.fast == pytest.approx(float(two.real), rel=wide, abs=0)


@pytest.mark.parametrize(
    "tilt", [math.pi / 2, math.radians(90), math.nextafter(math.pi / 2, 2), math.asin(1)]
)
def test_a_horizontal_top_has_one_rate(tilt: float) -> None:
    found = steady(3.0, 2.0, -5.0, tilt, 7.0, FLOAT)
    assert tuple(found) == (-0.7, None, (), 0.0)
    assert steady(3.0, 2.0, 0.0, tilt, 7.0, FLOAT).slow is None
    assert steady(3.0, 2.0, 0.0, tilt, 0.0, FLOAT).slow == 0


def test_without_weight_there_is_rest_and_free_precession() -> None:
    found = steady(3.0, 2.0, 5.0, math.pi / 3, 0.0, FLOAT)
    assert found.slow == 0
    assert found.fast == pytest.approx(10 / 1.5, rel=1e-15)
    assert found.minimum_spin == 0
    at_rest = steady(3.0, 2.0, 0.0, 2.0, 0.0, FLOAT)
    assert (at_rest.slow, at_rest.fast, at_rest.complex_roots) == (0, 0, ())


@many
@given(MOMENTS, MOMENTS, st.floats(0, 1.5), st.floats(0.01, 50), st.sampled_from([1, -1]))
def test_the_least_spin_is_where_the_two_rates_meet(
    lambda1: float, lambda3: float, tilt: float, weight: float, sense: int
) -> None:
    least = steady(lambda1, lambda3, 1.0, tilt, weight, FLOAT).minimum_spin
    assert least is not None
    at = steady(lambda1, lambda3, sense * least, tilt, weight, FLOAT)
    assert at.slow is not None
    assert at.slow == pytest.approx(at.fast, rel=1e-13)
    above = steady(lambda1, lambda3, sense * least * (1 + 1e-10), tilt, weight, FLOAT)
    assert above.slow is not None
    assert above.fast is not None
    assert abs(above.slow) < abs(above.fast)
    below = steady(lambda1, lambda3, sense * least * (1 - 1e-10), tilt, weight, FLOAT)
    assert below.slow is None
    assert len(below.complex_roots) == 2


# --- the sleeping top


def eigenvalues(lambda1: float, lambda3: float, spin: float, weight: float) -> list[Any]:
    """Of the linear equations of the axis (x, y, x', y'), from the two components of the torque law."""
    q, p = lambda3 * spin / lambda1, weight / lambda1
    with mpmath.workdps(40):
        # x'' = -q y' + p x and y'' = q x' + p y
        matrix = mpmath.matrix([[0, 0, 1, 0], [0, 0, 0, 1], [p, 0, 0, -q], [0, p, q, 0]])
        return list(mpmath.eig(matrix, left=False, right=False))


@few
@given(MOMENTS, MOMENTS, SPINS.filter(lambda s: abs(s) < 100), st.floats(0.01, 50))
def test_the_sleeping_top_has_the_eigenvalues_of_its_linear_equations(
    lambda1: float, lambda3: float, spin: float, weight: float
) -> None:
    found = sleeping(lambda1, lambda3, spin, weight, FLOAT)
    assert found.threshold is not None
    assume(abs(abs(spin) / found.threshold - 1) > 1e-4)
    values = eigenvalues(lambda1, lambda3, spin, weight)
    growth = max(float(value.real) for value in values)
    if found.stability == "unstable":
        assert abs(spin) < found.threshold
        assert found.frequencies is None
        assert found.growth_rate == pytest.approx(growth, rel=1e-10)
        return
    assert found.stability == "stable"
    assert abs(spin) > found.threshold
    assert growth < 1e-15 * abs(spin) * (1 + lambda3 / lambda1)
    assert found.growth_rate is None
    assert found.frequencies is not None
    magnitudes = sorted(abs(float(value.imag)) for value in values)
    assert [abs(rate) for rate in found.frequencies] == pytest.approx(
        [magnitudes[0], magnitudes[-1]], rel=1e-7
    )
    assert all(rate * spin > 0 for rate in found.frequencies)


@pytest.mark.parametrize("lambda1", [1.0, 1e-40])
def test_the_threshold_itself_is_marginal(lambda1: float) -> None:
    threshold = sleeping(lambda1, 0.3 * lambda1, 0.0, 2 * lambda1, FLOAT).threshold
    assert threshold is not None
    assert threshold == pytest.approx(2 * math.sqrt(2) / 0.3, rel=1e-14)
    for sense in (1, -1):
        found = sleeping(lambda1, 0.3 * lambda1, sense * threshold, 2 * lambda1, FLOAT)
        assert found.stability == "marginal"
        assert found.growth_rate == 0
        assert found.frequencies == pytest.approx((sense * math.sqrt(2),) * 2, rel=1e-14)
    for factor, name in ((1 + 2e-15, "stable"), (1 - 2e-15, "unstable")):
        assert sleeping(lambda1, 0.3 * lambda1, factor * threshold, 2 * lambda1, FLOAT).stability == name


# --- exact numbers

A, C, W, P = (ex.symbol(name, True) for name in "ACWP")
SPIN, THETA = (ex.symbol(name) for name in ("s", "theta"))


@pytest.mark.parametrize("tilt", [ex.PI / 3, ex.PI / 2, 2 * ex.PI / 3, ex.number(0)])
@pytest.mark.parametrize("spin", [-10, 0, 1])
def test_exact_numbers_agree_with_floats(tilt: Any, spin: int) -> None:
    exact: Any = steady(ex.number(2), ex.number(1), ex.number(spin), tilt, ex.number(3), EXACT)
    floats = steady(2.0, 1.0, float(spin), float(tilt), 3.0, FLOAT)
    for name in ("slow", "fast", "minimum_spin"):
        a, b = getattr(exact, name), getattr(floats, name)
        assert b == (None if a is None else pytest.approx(float(a), rel=1e-14))
    assert [float(x) for pair in exact.complex_roots for x in pair] == pytest.approx(
        [x for pair in floats.complex_roots for x in pair], rel=1e-14
    )
    upright: Any = sleeping(ex.number(2), ex.number(1), ex.number(spin), ex.number(3), EXACT)
    sleeper = sleeping(2.0, 1.0, float(spin), 3.0, FLOAT)
    assert upright.stability == sleeper.stability
    assert float(upright.threshold) == pytest.approx(sleeper.threshold, rel=1e-14)


def value(expression: Any, values: dict[Any, Any]) -> float:
    e = ex.expr(expression)
    return float(e.evaluate(**{str(name): float(v) for name, v in values.items() if str(name) in e.names}))


@pytest.mark.parametrize(("spin", "tilt"), [(W, THETA), (SPIN, THETA), (SPIN, 3)])
@pytest.mark.parametrize("sense", [1, -1])
def test_formulas_with_symbols_hold_for_their_values(spin: Any, tilt: Any, sense: int) -> None:
    found = steady(A, C, spin, tilt, P, EXACT)
    values = {A: 2, C: 3, W: 7, SPIN: 7 * sense, THETA: ex.number(Fraction(1, 2)), P: 5}
    turn, angle = value(spin, values), value(tilt, values)
    expected = steady(2.0, 3.0, turn, angle, 5.0, FLOAT)
    assert value(found.slow, values) == pytest.approx(expected.slow, rel=1e-13)
    assert value(found.fast, values) == pytest.approx(expected.fast, rel=1e-13)
    assert value(found.minimum_spin, values) == pytest.approx(expected.minimum_spin, rel=1e-14)


def test_what_symbols_leave_open_is_none_or_a_formula() -> None:
    found = sleeping(A, C, SPIN, P, EXACT)
    assert found.stability is None
    assert work.tidy(found.threshold - 2 * work.sqrt(A * P) / C) == 0
    assert value(found.growth_rate, {A: 1, C: 1, P: 4, SPIN: 1}) == pytest.approx(
        sleeping(1.0, 1.0, 1.0, 4.0, FLOAT).growth_rate, rel=1e-14
    )
    assert found.frequencies is not None
    rates = [value(rate, {A: 1, C: 1, P: 4, SPIN: -9}) for rate in found.frequencies]
    assert rates == pytest.approx(sleeping(1.0, 1.0, -9.0, 4.0, FLOAT).frequencies, rel=1e-14)
