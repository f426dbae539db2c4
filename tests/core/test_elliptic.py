"""Elliptic functions and integrals against mpmath, whose theta series and duplication are its own."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidcli.core.elliptic import beyond_first, carlson_rf, carlson_rj, complete, growth, jacobi, lag

Floats = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)

few = settings(max_examples=60, deadline=None)

COMPLEMENTS = [1.0, 1 - 1e-12, 0.99, 0.7, 0.1, 1e-3, 1e-9, 1e-20, 1e-140]

WIDE = st.builds(lambda digits, power: digits * 10.0**power, st.floats(1, 10), st.integers(-30, 3))


def quarter(complement: float) -> float:
    with mpmath.workdps(30):
        # K = pi / (2 agm(1, k')), Gauss.
        return float(mpmath.pi / (2 * mpmath.agm(1, mpmath.mpf(complement))))


def digits_for(complement: float) -> int:
    """Enough of them to tell 1 - k'^2 from 1, and some more."""
    return 40 + 2 * math.ceil(-math.log10(complement))


def column(value: float) -> Floats:
    return np.array([value])


# --- Jacobi's functions


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_jacobi_against_mpmath(complement: float) -> None:
    u = quarter(complement) * np.array([-1.3, -0.93, -0.5, -1e-3, 1e-12, 1e-200, 0.01, 0.2, 0.5, 0.77, 1.5])
    found = jacobi(u, complement)
    with mpmath.workdps(digits_for(complement)):
        m = 1 - mpmath.mpf(complement) ** 2
        for argument, values in zip(u, zip(*found, strict=True), strict=True):
            x = mpmath.mpf(argument)
            sn, cn, dn = (mpmath.ellipfun(name, x, m=m) for name in ("sn", "cn", "dn"))
            # All digits, but for a few times those that one unit in the last place of u is worth.
            slopes = (cn * dn / sn, sn * dn / cn, m * sn * cn / dn)
            for value, true, slope in zip(values, (sn, cn, dn), slopes, strict=True):
                assert abs(value / true - 1) < (6 + 4 * abs(x * slope)) * EPS


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_jacobi_next_to_the_quarter_period(complement: float) -> None:
    K = quarter(complement)
    _, cn, dn = jacobi(column(K), complement)
    assert dn[0] == pytest.approx(complement, rel=1e-15, abs=0)
    # cn falls through its zero with the slope -k': it is as small as K is well rounded.
    assert abs(cn[0]) <= complement * 6 * K * EPS


def test_jacobi_of_modulus_0_and_1() -> None:
    u = np.array([-400.0, -2.0, 0.0, 0.5, 3.0, 800.0])
    sn, cn, dn = jacobi(u[1:5], 1.0)
    assert sn == pytest.approx(np.sin(u[1:5]), rel=1e-15)
    assert cn == pytest.approx(np.cos(u[1:5]), rel=1e-15)
    assert dn.tolist() == [1, 1, 1, 1]
    sn, cn, dn = jacobi(u, 0.0)
    assert sn == pytest.approx(np.tanh(u), rel=8 * EPS)
    # Beyond u = 340 nothing is left of it.
    assert cn == pytest.approx([float(mpmath.sech(x)) for x in u], rel=8 * EPS, abs=1e-146)
    assert dn == pytest.approx(cn, rel=8 * EPS)


# --- symmetric integrals


def close(found: Floats, true: Any) -> bool:
    return bool(abs(float(found[0]) / true - 1) < 12 * EPS)


@few
@given(WIDE, WIDE, WIDE)
def test_rf_against_mpmath(x: float, y: float, z: float) -> None:
    with mpmath.workdps(40):
        true = mpmath.elliprf(*(mpmath.mpf(root) ** 2 for root in (x, y, z)))
        assert close(carlson_rf(column(x), column(y), column(z)), true)


@few
@given(st.lists(WIDE, min_size=4, max_size=4).map(sorted), st.booleans())
def test_rj_against_mpmath(roots: list[float], last: bool) -> None:
    x, p, y, z = roots if not last else (roots[0], roots[3], roots[1], roots[2])
    with mpmath.workdps(60):
        true = mpmath.elliprj(*(mpmath.mpf(root) ** 2 for root in (x, y, z, p)))
        assert close(carlson_rj(column(x), column(y), column(z), column(p)), true)


def test_symmetric_integrals_with_a_zero() -> None:
    # R_F(0, 1, 2) is the lemniscate constant of DLMF 19.20.2.
    root2 = column(math.sqrt(2))
    zero, one = np.zeros(1), np.ones(1)
    assert carlson_rf(zero, one, root2) == pytest.approx(1.31102877714605990523, rel=4e-16)
    # Complete integrals of equal arguments, DLMF 19.20.8: R_J(0, y, y, p) = 3 pi/(2 (y sqrt p + p sqrt y)).
    assert carlson_rj(zero, one, one, column(3.0)) == pytest.approx(3 * math.pi / (2 * (3 + 9)), rel=1e-15)
    # R_J(x, x, x, x) = x^(-3/2), DLMF 19.20.6.
    assert carlson_rj(root2, root2, root2, root2) == pytest.approx(2**-1.5, rel=1e-15)


def test_rf_of_roots_whose_squares_underflow() -> None:
    # R_F(x, x, 1) = arctanh(sqrt(1 - x)) / sqrt(1 - x), about ln(2 / sqrt x): DLMF 19.2.20.
    tiny = column(1e-300)
    assert carlson_rf(tiny, tiny, np.ones(1)) == pytest.approx(math.log(2) + 300 * math.log(10), rel=1e-15)


# --- Legendre's integrals


def third_kind(p: Any, m: Any) -> tuple[Any, Any]:
    """The integrals of cn^2/(cn^2 + p sn^2) and of sn^2/(cn^2 + p sn^2) over a quarter period."""
    K = mpmath.ellipk(m)
    if p == 1:
        sines = (K - mpmath.ellipe(m)) / m if m else mpmath.pi / 4
        return K - sines, sines
    whole = mpmath.ellippi(1 - p, m)
    sines = (whole - K) / (1 - p)
    return whole - sines, sines


@pytest.mark.parametrize("complement", COMPLEMENTS)
@pytest.mark.parametrize("p", [1e-12, 1e-4, 0.3, 1.0, 5.0, 1e10])
def test_complete_integrals(complement: float, p: float) -> None:
    with mpmath.workdps(digits_for(complement)):
        cosines, sines = third_kind(mpmath.mpf(p), 1 - mpmath.mpf(complement) ** 2)
        for a, b in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (2.0, 0.5)):
            assert float(complete(complement, p, a, b)) == pytest.approx(
                float(a * cosines + b * sines), rel=8 * EPS
            )


@pytest.mark.parametrize("k", [1e-9, 1e-4, 0.1, 0.7, 0.999, 1 - 1e-9])
@pytest.mark.parametrize("p", [1e-6, 0.3, 0.99, 1.5, 40.0])
def test_what_the_third_kind_is_beyond_the_first(k: float, p: float) -> None:
    with mpmath.workdps(60):
        m = mpmath.mpf(k) ** 2
        complement = float(mpmath.sqrt(1 - m))
        true = mpmath.mpf(p) * sum(third_kind(mpmath.mpf(p) ** 2, m)) - mpmath.ellipk(m)
    assert beyond_first(k, complement, p) == pytest.approx(float(true), rel=40 * EPS / complement**0.5, abs=0)


@pytest.mark.parametrize("complement", [1.0, 0.7, 1e-3, 1e-9])
@pytest.mark.parametrize("n", [0.0, 1e-9, 0.3, 0.999999999, 40.0])
def test_incomplete_integrals_by_quadrature(complement: float, n: float) -> None:
    """Over x with sn = sin(x): of cn^2/(1 + n sn^2), and for k^2 <= n < 1 of n sn^2/(1 - n sn^2)."""
    k = math.sqrt((1 - complement) * (1 + complement))
    for x in (0.3, -1.2, math.pi / 2 - 1e-3):
        sn, cn = column(math.sin(x)), column(math.cos(x))
        dn = np.hypot(cn, complement * sn)

        def root(y: Any) -> Any:
            return mpmath.sqrt(mpmath.cos(y) ** 2 + (complement * mpmath.sin(y)) ** 2)

        def rising(y: Any) -> Any:
            return mpmath.cos(y) ** 2 / (1 + n * mpmath.sin(y) ** 2) / root(y)

        def lagging(y: Any) -> Any:
            return n * mpmath.sin(y) ** 2 / (1 - n * mpmath.sin(y) ** 2) / root(y)

        with mpmath.workdps(30):
            parts = [*(x * (1 - mpmath.mpf(2) ** -k) for k in range(12)), x]
            grown, lagged = (mpmath.quad(f, parts) for f in (rising, lagging))
        assert growth(n, k, complement, sn, cn, dn)[0] == pytest.approx(float(grown), rel=1e-13)
        if k * k <= n < 1:
            assert lag(n, 1 - n, sn, cn, dn)[0] == pytest.approx(float(lagged), rel=1e-12, abs=0)
