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

from rigidcli.core.elliptic import carlson_rf, carlson_rj, complete, jacobi

Floats = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)

few = settings(max_examples=30)

COMPLEMENTS = [1.0, 0.7, 1e-3, 1e-20, 1e-140]

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
@pytest.mark.parametrize("p", [1e-12, 0.3, 1.0, 1e10])
def test_complete_integrals(complement: float, p: float) -> None:
    with mpmath.workdps(digits_for(complement)):
        cosines, sines = third_kind(mpmath.mpf(p), 1 - mpmath.mpf(complement) ** 2)
        for a, b in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (2.0, 0.5)):
            assert float(complete(complement, p, a, b)) == pytest.approx(
                float(a * cosines + b * sines), rel=8 * EPS
            )
