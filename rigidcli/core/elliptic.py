"""Jacobi's elliptic functions and elliptic integrals, with all their digits for every modulus.

The modulus k is given by the complementary modulus k' = sqrt(1 - k^2), which tells moduli near 1 apart.

Sources: NIST Digital Library of Mathematical Functions (DLMF), chapters 19 and 22;
B. C. Carlson, Numer. Algorithms 10 (1995) 13, for the symmetric integrals. Arrays of float64 are worked
by duplication and Landen's transformation, decimals by the arithmetic-geometric mean. scipy.special has
Carlson's integrals with the same digits and speed, but importing it takes two to four times as long as numpy,
its arguments underflow below 1e-160, and its `ellipj` is wrong for moduli near 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from functools import lru_cache

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.high_precision import CONTEXT, LONG, NOISE, PI
from rigidcli.core.pairs import Long

NEGLIGIBLE = Decimal("1e-18")
"""Where 1 - k' is less than this, 1 - k^2 rounds to 1, and the elliptic functions are the circular ones."""

SMALL_COMPLEMENT = 1e-9
"""Where k' is less than this, 1 + k'^2 K rounds to 1, and `growth` is that of k = 1."""

BLOCK = 8192
"""The number of times that are evaluated at once, so that their arrays stay in the cache of a processor."""

SPREAD = 5e-3
"""Duplication ends when arguments are this close to their mean: the series leaves out its 8th power."""


def jacobi(u: Floats, complement: float | Floats) -> tuple[Floats, Floats, Floats]:
    """sn(u), cn(u), dn(u) (each n) for k' = `complement`, of `u` (n) within some quarter periods of 0.

    The complements may also be an array > 0 that is broadcast with `u`.

    By Gauss's (descending Landen) transformation, DLMF 22.7(i), for sn and cn up to a common factor, as in
    R. Bulirsch, Numer. Math. 7 (1965) 78: dn is the quotient of sums of squares, in which 1 - k1 is a
    number of its own. So cn and dn keep their digits near the quarter period and for k' down to 1e-300,
    and errors grow from step to step only as those of u do.
    """
    shrink: float | Floats
    steps: Sequence[tuple[float | Floats, float | Floats]]
    if isinstance(complement, np.ndarray):
        shrink, steps = _descents(complement)
    elif complement == 0:
        fading = np.exp(-np.abs(u))
        sech = 2 * fading / (1 + fading * fading)
        return np.tanh(u), sech, sech
    else:
        shrink, steps = _descent(complement)
    angle = u * shrink
    sn, cn, dn = np.sin(angle), np.cos(angle), np.ones_like(u)
    for k1, rest in steps:
        sn2, cn2 = sn * sn, cn * cn
        sn, cn = (1 + k1) * sn, cn * dn
        dn = (rest * sn2 + cn2) / ((1 + k1) * sn2 + cn2)
    length = np.hypot(sn, cn)
    return sn / length, cn / length, dn


@lru_cache(maxsize=256)
def _descent(complement: float) -> tuple[float, tuple[tuple[float, float], ...]]:
    """What Landen's steps down to k = 0 multiply u with, and their k1 and 1 - k1, the last step first."""
    with localcontext(CONTEXT):
        shrink, steps, k_prime = Decimal(1), [], Decimal(complement)
        while 1 - k_prime > NEGLIGIBLE:
            shrink *= (1 + k_prime) / 2
            steps.append((float((1 - k_prime) / (1 + k_prime)), float(2 * k_prime / (1 + k_prime))))
            k_prime = 2 * k_prime.sqrt() / (1 + k_prime)
        return float(shrink), tuple(reversed(steps))


def _descents(complement: Floats) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """The same for an array of complements > 0, each number of its shape."""
    k_prime = complement.astype(LONG)
    shrink, steps = np.ones_like(k_prime), []
    while (1 - k_prime > float(NEGLIGIBLE)).any():
        shrink *= (1 + k_prime) / 2
        steps.append(((1 - k_prime) / (1 + k_prime), 2 * k_prime / (1 + k_prime)))
        k_prime = 2 * np.sqrt(k_prime) / (1 + k_prime)
    pairs = [(k1.astype(np.float64), rest.astype(np.float64)) for k1, rest in reversed(steps)]
    return shrink.astype(np.float64), pairs


def carlson_rf(x: Floats, y: Floats, z: Floats) -> Floats:
    """Carlson's R_F(x^2, y^2, z^2) of arrays >= 0, of which one at most is 0 in a place.

    It takes the roots of the usual arguments, so that tiny ones do not underflow. By duplication,
    DLMF 19.26.18 and 19.36.1 (the series up to 7th powers).
    """
    while True:
        product = x * y + y * z + z * x
        x2, y2, z2 = ((root * root + product) / 4 for root in (x, y, z))
        mean = (x2 + y2 + z2) / 3
        dx, dy = 1 - x2 / mean, 1 - y2 / mean
        if not max(np.abs(dx).max(), np.abs(dy).max()) >= SPREAD:  # NaN ends it too
            break
        x, y, z = np.sqrt(x2), np.sqrt(y2), np.sqrt(z2)
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    series = e2 * (-1 / 10 + e2 * (1 / 24 - e2 * 5 / 208 + e3 / 16) - e3 * 3 / 44) + e3 * (
        1 / 14 + e3 * 3 / 104
    )
    return (1 + series) / np.sqrt(mean)


def carlson_rj(x: Floats, y: Floats, z: Floats, p: Floats) -> Floats:
    """Carlson's R_J(x^2, y^2, z^2, p^2) of arrays >= 0, of which x at most is 0 in a place.

    It takes the roots of the usual arguments, as `carlson_rf`, in the order x <= p <= y <= z, or p above
    all three: all its R_C are arctangents then. By duplication, DLMF 19.26.20 and 19.36.2
    (the series up to 7th powers), with the R_C as in Carlson's equations 2.20 to 2.24.
    """
    total, weight = np.zeros_like(p), 1.0
    while True:
        d = (p + x) * (p + y) * (p + z)
        total += 6 * weight / d * _rc_beside_one((p - x) * (p - y) * (p - z) / d)
        product = x * y + y * z + z * x
        x2, y2, z2, p2 = ((root * root + product) / 4 for root in (x, y, z, p))
        weight /= 4
        mean = (x2 + y2 + z2 + 2 * p2) / 5
        dx, dy, dz = 1 - x2 / mean, 1 - y2 / mean, 1 - z2 / mean
        if not max(np.abs(dx).max(), np.abs(dy).max(), np.abs(dz).max()) >= SPREAD:
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
    integral: Floats = total + weight * (1 + series) / (mean * np.sqrt(mean))
    return integral


def _rc_beside_one(e: Floats) -> Floats:
    """R_C(1, 1 + e) for e >= 0 up to rounding, DLMF 19.2.18."""
    root = np.sqrt(np.maximum(e, 1e-40))
    integral: Floats = np.arctan(root) / root
    return integral


def growth(
    n: float, k: float | Floats, complement: float | Floats, sn: Floats, cn: Floats, dn: Floats
) -> Floats:
    """G(u), the integral from 0 to u of cn^2 / (1 + n sn^2) for n >= 0, of u within a quarter period of 0.

    G = atan(W sn cn/dn)/W + k'^2/(3 (1+n)) sn^3 R_J(cn^2, dn^2, 1, cn^2 + k'^2 sn^2/(1+n)), where
    W^2 = n (n+k^2)/(1+n). This is the integral in Carlson's form, DLMF 19.25(i), with the change of parameter
    DLMF 19.21.12. All terms have the sign of u, so that nothing is lost for any n, as it is
    between the terms of the usual form (the third kind with 1 + n sn^2, and the first).
    """
    if np.max(complement) < SMALL_COMPLEMENT:
        slope = math.sqrt(n)
        limit: Floats = np.arctan(slope * sn) / slope if n else sn
        return limit
    width = np.sqrt(n * (n + k**2) / (1 + n))
    part = complement / math.sqrt(1 + n)
    third = carlson_rj(np.abs(cn), dn, np.ones_like(sn), np.hypot(cn, part * sn))
    bent = np.arctan(width * sn * cn / dn) / width if n else sn * cn / dn
    integral: Floats = bent + part * part / 3 * sn**3 * third
    return integral


def argument(sn: Decimal, cn: Decimal, dn: Decimal) -> float:
    """u, within a quarter period of 0, from its elliptic functions: sn R_F(cn^2, dn^2, 1)."""
    s, c, d = (np.array([float(part)]) for part in (sn, cn, dn))
    return float((s * carlson_rf(c, d, np.ones(1)))[0])


def complete_first(complement: Long) -> Long:
    """K, the complete integral of the first kind, infinite for k' = 0 (DLMF 19.8.5); within CONTEXT."""
    if not complement:
        return Decimal("inf")
    a, g = Decimal(1), complement
    while abs(a - g) > NOISE * a:
        a, g = (a + g) / 2, (a * g).sqrt()
    # The mean lies between the two.
    return PI / (a + g)


def complete_third(complement: Long, p: Long) -> Long:
    """(p^2/3) R_J(0, k'^2, 1, p^2) / K for p > 0: the mean of p^2 sn^2/(1 - (1 - p^2) sn^2), 0 for k' = 0.

    From the means of DLMF 19.8.6: it is half the sum of their Q_n. Call within CONTEXT.
    """
    if not complement:
        return Decimal(0)
    a, g, q, total = Decimal(1), complement, Decimal(1), Decimal(1)
    while abs(a - g) > NOISE * a or abs(q) > NOISE:
        square, product = p * p, a * g
        q *= (square - product) / (2 * (square + product))
        total += q
        p = (square + product) / (2 * p)
        a, g = (a + g) / 2, product.sqrt()
    # The rest of the sum is less than the last term.
    return total / 2
