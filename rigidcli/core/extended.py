"""More digits than a float has: decimals for the constants of a motion, pairs of floats for its times.

A phase `rate * t` after 1e6 turns has lost six digits in floats, however good the rate is. So constants
are worked out once, with 80 digits, from the exact values of the floats that are given; and
times are reduced modulo a period that is known to twice the digits of a float.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats

CONTEXT = Context(prec=80, Emax=MAX_EMAX, Emin=MIN_EMIN)
"""80 digits: a product of four floats is exact, and nothing over- or underflows."""

PI = Decimal(
    "3.1415926535897932384626433832795028841971693993751058209749445923078164062862089986280348253421"
)

NOISE = Decimal("1e-70")
"""What the rounding of 80 digits may leave of a zero, in units of the terms that cancel."""

Vector: TypeAlias = tuple[Decimal, Decimal, Decimal]

SPLITTER = 2.0**27 + 1
"""Splits a float into two halves of 26 bits: T. J. Dekker, Numer. Math. 18 (1971) 224, section 5."""


def vector(values: Sequence[float] | Floats) -> Vector:
    """Three floats as decimals, without rounding."""
    x, y, z = (Decimal(float(value)) for value in values)
    return x, y, z


def dot(a: Vector, b: Vector) -> Decimal:
    """a . b; call within CONTEXT."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The cross product of a and b; call within CONTEXT."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def principal_axes(tensor: Floats) -> tuple[Vector, tuple[Vector, Vector, Vector]]:
    """Moments (ascending) and right-handed axes (rows) of a symmetric tensor (3 by 3), to some 70 digits.

    By Jacobi's rotations (G. Golub, C. Van Loan, Matrix Computations, section 8.5). The axes are a
    signed permutation, and the moments exact, for a diagonal tensor. Unlike
    `core.principal.principal_frame`, moments that differ only by rounding stay apart, and are not
    cleared of noise. Call within CONTEXT.
    """
    rows = [list(vector(row)) for row in tensor]
    axes = [[Decimal(int(i == j)) for j in range(3)] for i in range(3)]
    scale = max(abs(entry) for row in rows for entry in row)
    while any(abs(rows[p][q]) > NOISE * scale for p, q in ((0, 1), (0, 2), (1, 2))):
        for p, q, r in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
            _annihilate(rows, axes, p, q, r)
    order = sorted(range(3), key=lambda k: rows[k][k])
    low, middle, high = (rows[k][k] for k in order)
    if middle - low <= NOISE * scale:
        low = middle
    if high - middle <= NOISE * scale:
        high = middle
    first, second = _row(axes[order[0]]), _row(axes[order[1]])
    return (low, middle, high), (first, second, cross(first, second))


def _row(values: list[Decimal]) -> Vector:
    x, y, z = values
    return x, y, z


def _annihilate(rows: list[list[Decimal]], axes: list[list[Decimal]], p: int, q: int, r: int) -> None:
    """Turn in the plane (p, q) so that the entry (p, q) of the matrix vanishes; `axes` are turned along."""
    if rows[p][q] == 0:
        return
    cotangent = (rows[q][q] - rows[p][p]) / (2 * rows[p][q])
    tangent = 1 / (abs(cotangent) + (cotangent * cotangent + 1).sqrt()).copy_sign(cotangent)
    c = 1 / (tangent * tangent + 1).sqrt()
    s = tangent * c
    shift = tangent * rows[p][q]
    rows[p][p] -= shift
    rows[q][q] += shift
    rows[p][q] = rows[q][p] = Decimal(0)
    a, b = rows[p][r], rows[q][r]
    rows[p][r] = rows[r][p] = c * a - s * b
    rows[q][r] = rows[r][q] = s * a + c * b
    for k in range(3):
        a, b = axes[p][k], axes[q][k]
        axes[p][k], axes[q][k] = c * a - s * b, s * a + c * b


@dataclass(frozen=True, slots=True)
class Cycle:
    """A period as the sum of two floats, high + low."""

    high: float
    low: float

    @classmethod
    def of(cls, period: Decimal) -> Cycle:
        """The period to twice the digits of a float; it may be infinite. Call within CONTEXT."""
        high = float(period)
        return cls(high, float(period - Decimal(high)) if np.isfinite(high) else 0.0)

    def reduce(self, times: Floats, offset: float = 0.0) -> tuple[Floats, Floats]:
        """Counts N (n) and rests (n), within half a period of 0, with times + offset = N period + rest.

        The rest is right to the rounding of a period, for up to some 1e15 periods.
        """
        if not np.isfinite(self.high):
            return np.zeros_like(times), times + offset
        counts = np.rint((times + offset) / self.high)
        whole, error = _two_product(counts, self.high)
        rests = ((times - whole) - error) - counts * self.low + offset
        # The quotient may be rounded to the wrong side of a half.
        again = np.rint(rests / self.high)
        return counts + again, rests - again * self.high


def _two_product(a: Floats, b: float) -> tuple[Floats, Floats]:
    """p and e with p = fl(a b) and p + e = a b exactly (T. J. Dekker, section 5)."""
    product = a * b
    lifted = SPLITTER * a
    a_high = lifted - (lifted - a)
    a_low = a - a_high
    mantissa, exponent = math.frexp(b)  # SPLITTER b would be infinite for a period of 1e301
    b_high = math.ldexp(int(mantissa * 2**26), exponent - 26)
    b_low = b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error
