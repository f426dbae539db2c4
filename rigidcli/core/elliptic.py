"""Jacobi's elliptic functions and elliptic integrals, for numbers and arrays that broadcast.

The modulus k is given by the complementary modulus k' = sqrt(1 - k^2), which tells moduli near 1 apart.
For k' = 0 the functions are tanh and sech.

Sources: NIST Digital Library of Mathematical Functions (DLMF), chapters 19 and 22; R. Bulirsch, Numer.
Math. 7 (1965) 78 for the functions and 13 (1969) 305 for the complete integrals; B. C. Carlson, Numer.
Algorithms 10 (1995) 13 for the symmetric integrals. scipy.special has all of them, but importing it takes
longer than most runs of the program, and its `ellipj` is wrong for moduli near 1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats

# The k' that stands for 0: up to u = 340, where sech is below 1e-147, the functions are then the hyperbolic
# ones to all digits.
LEAST_COMPLEMENT = 1e-150
# Quadratic convergence squares the error of this last step, which is then below the rounding.
CONVERGED = 1e-8


def to_first_quarter(u: Any, quarter: Any) -> tuple[Any, Any]:
    """`u` less half periods 2K, within a quarter period K of 0, and the factor +-1 of its sn and cn."""
    half = 2 * np.where(np.isfinite(quarter), quarter, 1.0)
    halves = np.where(np.isfinite(quarter), np.rint(u / half), 0.0)
    return u - halves * half, 1 - 2 * np.mod(halves, 2)


def jacobi(u: Any, complement: Any) -> tuple[Any, Any, Any]:
    """sn(u), cn(u), dn(u) for k' = `complement` >= 0, of `u` within some quarter periods of 0.

    By Gauss's (descending Landen) transformation, DLMF 22.7(i), for sn and cn up to a common factor: dn is
    the quotient of sums of squares, in which 1 - k1 is a number of its own. So cn and dn keep their digits
    near the quarter period and for small k'.
    """
    k_prime, shrink, steps = np.maximum(complement, LEAST_COMPLEMENT), 1.0, []
    while np.max(1 - k_prime) > EPS:
        shrink = shrink * (1 + k_prime) / 2
        steps.append(((1 - k_prime) / (1 + k_prime), 2 * k_prime / (1 + k_prime)))
        k_prime = 2 * np.sqrt(k_prime) / (1 + k_prime)
    if np.any(np.equal(complement, 0)):
        u = np.where(np.equal(complement, 0), np.clip(u, -340, 340), u)
    angle = u * shrink
    sn, cn, dn = np.sin(angle), np.cos(angle), np.ones_like(angle)
    for k1, rest in reversed(steps):
        sn2, cn2 = sn * sn, cn * cn
        sn, cn = (1 + k1) * sn, cn * dn
        dn = (rest * sn2 + cn2) / ((1 + k1) * sn2 + cn2)
    length = np.hypot(sn, cn)
    return sn / length, cn / length, dn


def complete(complement: Any, p: Any, a: Any, b: Any) -> Any:
    """Bulirsch's complete integral, over x from 0 to pi/2, for p > 0 and k' > 0 (DLMF 19.2.11):

    (a cos^2 x + b sin^2 x) / ((cos^2 x + p sin^2 x) sqrt(cos^2 x + k'^2 sin^2 x)).

    With sn = sin x it is the integral of (a cn^2 + b sn^2)/(cn^2 + p sn^2) over a quarter period, and K for
    p = a = b = 1. Where a and b have one sign, only terms of one sign are added.
    """
    # Calls of numpy would take ten times as long as the arithmetic of single numbers.
    is_one = isinstance(complement, float)
    sqrt, most = (math.sqrt, float) if is_one else (np.sqrt, np.max)
    kc = e = (max if is_one else np.maximum)(complement, LEAST_COMPLEMENT)
    m, p = 1.0, sqrt(p)
    b = b / p
    while True:
        g = e / p
        a, b = a + b / p, 2 * (b + a * g)
        p = p + g
        last, m = m, m + kc
        if most(abs(last - kc) - CONVERGED * last) <= 0:
            return math.pi / 2 * (b + a * m) / (m * (m + p))
        kc = 2 * sqrt(e)
        e = kc * m


def beyond_first(k: float, complement: float, p: float) -> float:
    """p Pi - K for p > 0 and k' > 0, with Pi the integral of 1/(cn^2 + p^2 sn^2) over a quarter period.

    It vanishes as k^2. This is (p - 1) times `complete` with a = 1 and b = -p, in which b + a m = r is
    carried in place of b, and m - k' by its own formula: so nothing is lost for small k.
    """
    root, kc, m, less, a, r = p, complement, 1.0, k * k / (1 + complement), 1.0, 0.0
    least = CONVERGED * less
    while True:
        r, a = r * (2 + (m + kc) / p) - a * less * (1 + m / p), a + (r - a * m) / p
        p = p + kc * m / p
        if less <= least:
            m = m + kc
            return (root - 1) * math.pi / 2 * r / (m * (m + p))
        less = (less / (math.sqrt(m) + math.sqrt(kc))) ** 2
        m, kc = m + kc, 2 * math.sqrt(m * kc)


def carlson_rf(x: Any, y: Any, z: Any) -> Any:
    """Carlson's R_F(x^2, y^2, z^2) of numbers >= 0, of which one at most is 0 in a place.

    It takes the roots of the usual arguments, so that tiny ones do not underflow. By duplication,
    DLMF 19.26.18 and 19.36.1, until the arguments are so close to their mean that the series up to 7th powers
    leaves out no more than rounding.
    """
    while True:
        product = x * y + y * z + z * x
        x2, y2, z2 = ((root * root + product) / 4 for root in (x, y, z))
        mean = (x2 + y2 + z2) / 3
        dx, dy = 1 - x2 / mean, 1 - y2 / mean
        if not max(np.max(np.abs(dx)), np.max(np.abs(dy))) >= 5e-3:  # NaN ends it too
            break
        x, y, z = np.sqrt(x2), np.sqrt(y2), np.sqrt(z2)
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    series = e2 * (-1 / 10 + e2 * (1 / 24 - e2 * 5 / 208 + e3 / 16) - e3 * 3 / 44) + e3 * (
        1 / 14 + e3 * 3 / 104
    )
    return (1 + series) / np.sqrt(mean)


def carlson_rj(x: Any, y: Any, z: Any, p: Any) -> Any:
    """Carlson's R_J(x^2, y^2, z^2, p^2) of numbers >= 0, of which x at most is 0 in a place.

    It takes the roots of the usual arguments, as `carlson_rf`, in the order x <= p <= y <= z, or p above
    all three: all its R_C are arctangents then. By duplication, DLMF 19.26.20 and 19.36.2
    (the series up to 7th powers), with the R_C as in Carlson's equations 2.20 to 2.24.
    """
    total, weight = 0.0, 1.0
    while True:
        d = (p + x) * (p + y) * (p + z)
        # R_C(1, 1 + e) = atan(sqrt(e))/sqrt(e) for e >= 0 up to rounding, DLMF 19.2.18.
        root = np.sqrt(np.maximum((p - x) * (p - y) * (p - z) / d, 1e-40))
        total = total + 6 * weight / d * (np.arctan(root) / root)
        product = x * y + y * z + z * x
        x2, y2, z2, p2 = ((root * root + product) / 4 for root in (x, y, z, p))
        weight /= 4
        mean = (x2 + y2 + z2 + 2 * p2) / 5
        dx, dy, dz = 1 - x2 / mean, 1 - y2 / mean, 1 - z2 / mean
        if not max(np.max(np.abs(dx)), np.max(np.abs(dy)), np.max(np.abs(dz))) >= 5e-3:
            break
        x, y, z, p = np.sqrt(x2), np.sqrt(y2), np.sqrt(z2), np.sqrt(p2)
    dp = -(dx + dy + dz) / 2
    e2 = dx * dy + dx * dz + dy * dz - 3 * dp * dp
    e3 = dx * dy * dz + 2 * e2 * dp + 4 * dp**3
    e4 = (2 * dx * dy * dz + e2 * dp + 3 * dp**3) * dp
    e5 = dx * dy * dz * dp * dp
    series = (
        e2 * (-3 / 14 + e2 * (9 / 88 - e2 / 16 + e3 * 45 / 272) - e3 * 9 / 52)
        + e3 * (1 / 6 + e3 * 3 / 40)
        + e4 * (-3 / 22 + e2 * 3 / 20 - e3 * 9 / 68)
        + e5 * (3 / 26 - e2 * 9 / 68)
    )
    return total + weight * (1 + series) / (mean * np.sqrt(mean))


def growth(n: Any, k: Any, complement: Any, sn: Floats, cn: Floats, dn: Floats) -> Any:
    """G(u), the integral from 0 to u of cn^2 / (1 + n sn^2) for n >= 0, of u within a quarter period of 0.

    G = atan(W sn cn/dn)/W + k'^2/(3 (1+n)) sn^3 R_J(cn^2, dn^2, 1, cn^2 + k'^2 sn^2/(1+n)), where
    W^2 = n (n+k^2)/(1+n). This is the integral in Carlson's form, DLMF 19.25(i), with the change of parameter
    DLMF 19.21.12. All terms have the sign of u, so that nothing is lost for any n, as it is
    between the terms of the usual form (the third kind with 1 + n sn^2, and the first).
    """
    cn, dn = np.maximum(np.abs(cn), LEAST_COMPLEMENT), np.maximum(dn, LEAST_COMPLEMENT)
    width = np.maximum(np.sqrt(n * ((n + k * k) / (1 + n))), LEAST_COMPLEMENT)  # n may be 0
    part = complement / np.sqrt(1 + n)
    third = carlson_rj(cn, dn, np.ones_like(sn), np.hypot(cn, part * sn))
    return np.arctan(width * sn * cn / dn) / width + part * part / 3 * sn**3 * third


def lag(n: Any, rest: Any, sn: Floats, cn: Floats, dn: Floats) -> Any:
    """The integral from 0 to u of n sn^2/(1 - n sn^2), with 1 - n = `rest`, for k^2 <= n < 1.

    It is (n/3) sn^3 R_J(cn^2, dn^2, 1, 1 - n sn^2), DLMF 19.25.14.
    """
    cn, dn = np.maximum(np.abs(cn), LEAST_COMPLEMENT), np.maximum(dn, LEAST_COMPLEMENT)
    return n / 3 * sn**3 * carlson_rj(cn, dn, np.ones_like(sn), np.hypot(cn, np.sqrt(rest) * sn))
