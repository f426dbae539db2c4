"""Decimals and pairs of floats against mpmath, and against rational numbers where the answer is exact."""

from __future__ import annotations

import itertools
import math
from decimal import Decimal, localcontext
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.core.high_precision import CONTEXT, PI, Cycle, decimals, norm, principal_axes

Floats = NDArray[np.float64]

few = settings(max_examples=100, deadline=None)

COMPONENTS = st.floats(-1e150, 1e150)


def test_pi() -> None:
    with mpmath.workdps(110):
        assert abs(mpmath.mpf(str(PI)) - mpmath.pi) < mpmath.mpf(10) ** -93


@few
@given(st.lists(COMPONENTS, min_size=3, max_size=3))
def test_vectors_are_taken_without_rounding_and_have_a_length(values: list[float]) -> None:
    found = decimals(values)
    assert [Fraction(x) for x in found] == [Fraction(x) for x in values]
    square = sum(Fraction(x) ** 2 for x in values)
    with localcontext(CONTEXT):
        assert abs(Fraction(norm(found) ** 2) - square) <= square * Fraction(1, 10**78)


def test_nothing_over_or_underflows() -> None:
    with localcontext(CONTEXT):
        assert norm(decimals([5e-324, 0, 0])) ** 16 > 0
        assert (norm(decimals([1.7e308, 0, 0])) ** 16).is_finite()


# --- principal axes


TENSORS: dict[str, list[list[float]]] = {
    "full": [[2.0, -0.3, 0.1], [-0.3, 3.0, 0.7], [0.1, 0.7, 1.5]],
    "nearly diagonal": [[1.0, 1e-30, 0], [1e-30, 2.0, 1e-200], [0, 1e-200, 3.0]],
    "two equal": [[2.0, -1.0, 0], [-1.0, 2.0, 0], [0, 0, 1.0]],
    "a gap of one rounding": [[1.0, 2.0**-52, 0], [2.0**-52, 1.0, 0], [0, 0, 2.0]],
    "linear": [[1.0, 1.0, 0], [1.0, 1.0, 0], [0, 0, 2.0]],
    "huge": [[2e300, -3e299, 1e299], [-3e299, 3e300, 7e299], [1e299, 7e299, 1.5e300]],
    "tiny": [[2e-300, -3e-301, 1e-301], [-3e-301, 3e-300, 7e-301], [1e-301, 7e-301, 1.5e-300]],
    "of many sizes": [[1e-20, 1e-12, 0], [1e-12, 1.0, 1e-3], [0, 1e-3, 1e10]],
}


@pytest.mark.parametrize("rows", TENSORS.values(), ids=TENSORS.keys())
def test_principal_axes_diagonalise(rows: list[list[float]]) -> None:
    with localcontext(CONTEXT):
        exact = decimals(rows)
        moments, axes = principal_axes(exact)
        assert np.abs(axes @ axes.T - decimals(np.eye(3))).max() < Decimal("1e-75")
        defect = axes @ exact @ axes.T - np.diag(moments)
        assert np.abs(defect).max() < np.abs(exact).max() * Decimal("1e-69")
        assert abs(np.cross(axes[0], axes[1]) @ axes[2] - 1) < Decimal("1e-75")
    assert list(moments) == sorted(moments)
    with mpmath.workdps(70):
        values = sorted(mpmath.eigsy(mpmath.matrix(rows), eigvals_only=True))
        size = max(map(abs, values))
        for found, value in zip(moments, values, strict=True):
            assert abs(mpmath.mpf(str(found)) - value) < size * mpmath.mpf(10) ** -64


@pytest.mark.parametrize("order", list(itertools.permutations([0.3, 1.1, 2.0])))
def test_a_diagonal_tensor_is_exact(order: tuple[float, ...]) -> None:
    moments, axes = principal_axes(decimals(np.diag(order)))
    assert moments.tolist() == decimals([0.3, 1.1, 2.0]).tolist()
    for moment, axis in zip(moments, axes, strict=True):
        assert [abs(x) for x in axis] == [int(Decimal(value) == moment) for value in order]
    assert np.cross(axes[0], axes[1]).tolist() == axes[2].tolist()


def test_moments_apart_by_rounding_stay_apart_and_equal_ones_are_equal() -> None:
    with localcontext(CONTEXT):
        (low, middle, _), _ = principal_axes(decimals(np.diag([1.0, math.nextafter(1.0, 2), 3.0])))
        assert Fraction(middle - low) == Fraction(1, 2**52)
        (low, middle, high), _ = principal_axes(decimals(TENSORS["two equal"]))
        assert low == middle == 1
        assert abs(high - 3) < Decimal("1e-75")
        (low, middle, high), _ = principal_axes(decimals(np.zeros((3, 3))))
        assert low == middle == high == 0


# --- cycles


def cycle(period: Decimal) -> Cycle:
    with localcontext(CONTEXT):
        return Cycle.of(period)


def two_floats(found: Cycle) -> Fraction:
    return Fraction(found.high) + Fraction(found.low)


@pytest.mark.parametrize("exponent", [-280, -150, -1, 0, 1, 150, 305])
def test_a_period_has_twice_the_digits(exponent: int) -> None:
    period = PI.scaleb(exponent)
    found = cycle(period)
    assert found.high == float(period)
    assert abs(two_floats(found) - Fraction(period)) <= Fraction(period) * Fraction(1, 2**105)


@few
@given(
    st.floats(0.1, 10),
    st.integers(-250, 250),
    st.floats(-1, 1),
    st.integers(0, 14),
    st.floats(-0.5, 0.5),
)
def test_times_are_reduced_as_if_exactly(
    mantissa: float, exponent: int, share: float, magnitude: int, offset: float
) -> None:
    with localcontext(CONTEXT):
        found = Cycle.of((Decimal(mantissa) * PI).scaleb(exponent))
    period = two_floats(found)
    time, shift = share * 10.0**magnitude * found.high, offset * found.high
    (count,), (rest,) = found.reduce(np.array([time]), shift)
    assert count == int(count)
    assert abs(rest) <= found.high * (0.5 + 1e-15)
    missed = Fraction(time) + Fraction(shift) - int(count) * period - Fraction(float(rest))
    assert abs(missed) <= period * Fraction(4, 2**53)


@pytest.mark.parametrize("period", [1e-280, 1e-100, 1.0, 1e100, 1e301, 1.2e308])
def test_halves_and_wholes_of_periods(period: float) -> None:
    found = Cycle(period, 0.0)
    times = period * np.array([0.0, 0.25, -0.25, 0.5, 0.75, -0.75, 1.0, 1.25])
    counts, rests = found.reduce(times)
    assert counts.tolist() == [0, 0, 0, 0, 1, -1, 1, 1]
    assert rests / period == pytest.approx([0, 0.25, -0.25, 0.5, -0.25, 0.25, 0, 0.25], abs=3e-16)
    assert found.reduce(np.array([]))[1].shape == (0,)


def test_a_negative_period() -> None:
    # The turn of a phase that falls.
    counts, rests = Cycle(-2.0, 0.0).reduce(np.array([0.5, 1.5, 5.0, -3.5]))
    assert (-2 * counts + rests).tolist() == [0.5, 1.5, 5.0, -3.5]
    assert np.abs(rests).max() <= 1


def test_without_a_period_times_stay() -> None:
    for found in (cycle(Decimal("Infinity")), cycle(Decimal("1e400"))):
        counts, rests = found.reduce(np.array([0.0, -3.0, 1e300]), 0.5)
        assert counts.tolist() == [0, 0, 0]
        assert rests.tolist() == [0.5, -2.5, 1e300]
