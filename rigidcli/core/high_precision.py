"""More digits than a float has: decimals for the constants of a motion, pairs of floats for its times.

A phase `rate * t` after 1e6 turns has lost six digits in floats, however good the rate is. So constants
are worked out once, with 80 digits, from the exact values of the floats that are given; and
times are reduced modulo a period that is known to twice the digits of a float.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.core.principal import diagonal_form

CONTEXT = Context(prec=80, Emax=MAX_EMAX, Emin=MIN_EMIN)
"""80 digits: a product of four floats is exact, and nothing over- or underflows."""

PI = Decimal(
    "3.1415926535897932384626433832795028841971693993751058209749445923078164062862089986280348253421"
)

NOISE = Decimal("1e-70")
"""A sum below this, in units of its terms, may be a zero that the rounding of 80 digits hides."""

Decimals: TypeAlias = NDArray[np.object_]
"""An array of decimals. Its products and sums are to be formed within CONTEXT."""

LONG = np.longdouble
"""A float of more digits, where the platform has one: 64 bits on x86, 113 on most others, 53 on some."""

SPLITTER = 2.0**27 + 1
"""It splits a float into two halves of 26 bits: T. J. Dekker, Numer. Math. 18 (1971) 224, section 5."""


def decimals(values: object) -> Decimals:
    """Floats, nested to any depth, as decimals without rounding."""
    exact: Decimals = np.frompyfunc(Decimal, 1, 1)(np.asarray(values, dtype=np.float64).astype(object))
    return exact


def norm(v: Decimals) -> Decimal:
    """The length of a vector."""
    square: Decimal = v @ v
    return square.sqrt()


def principal_axes(tensor: Decimals) -> tuple[Decimals, Decimals]:
    """Moments (3, ascending) and right-handed axes (rows) of a symmetric tensor (3 by 3), to some 70 digits.

    The axes are a signed permutation, and the moments exact, for a diagonal tensor. Unlike
    `core.principal.principal_frame`, moments that differ only by rounding stay apart, and are not
    cleared of noise. Call within CONTEXT.
    """
    moments, axes = diagonal_form(tensor, decimals(np.eye(3)), NOISE)
    order = np.argsort(moments, kind="stable")
    low, middle, high = moments[order]
    scale = abs(high)
    low = middle if middle - low <= NOISE * scale else low
    high = middle if high - middle <= NOISE * scale else high
    first, second = axes[order[:2]]
    return np.array([low, middle, high]), np.array([first, second, np.cross(first, second)])


@dataclass(frozen=True, slots=True)
class Cycle:
    """A period as the sum of two floats, high + low; or finite ones (arrays), broadcast with the times."""

    high: Any
    low: Any

    @classmethod
    def of(cls, period: Decimal) -> Cycle:
        """The period to twice the digits of a float; it may be infinite. Call within CONTEXT."""
        high = float(period)
        return cls(high, float(period - Decimal(high)) if np.isfinite(high) else 0.0)

    def reduce(self, times: Floats, offset: float = 0.0) -> tuple[Floats, Floats]:
        """Counts N (n) and rests (n), within half a period of 0, with times + offset = N period + rest.

        The rest is right to the rounding of a period, for up to some 1e15 periods.
        """
        if not np.isfinite(self.high).all():
            return np.zeros_like(times), times + offset
        counts = np.rint((times + offset) / self.high)
        whole, error = _two_product(counts, self.high)
        rests = ((times - whole) - error) - counts * self.low + offset
        # The quotient may be rounded to the wrong side of a half.
        again = np.rint(rests / self.high)
        return counts + again, rests - again * self.high


def _two_product(a: Floats, b: Any) -> tuple[Floats, Floats]:
    """p and e with p = fl(a b) and p + e = a b exactly (T. J. Dekker, section 5)."""
    product = a * b
    lifted = SPLITTER * a
    a_high = lifted - (lifted - a)
    a_low = a - a_high
    mantissa, exponent = np.frexp(b)  # SPLITTER b would be infinite for a period of 1e301
    b_high = np.ldexp(np.trunc(mantissa * 2**26), exponent - 26)
    b_low = b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error
