"""Pairs of floats with a proved bound on their error: 100 bits for many numbers at once.

A `Pairs` stands where a decimal of 80 digits does, for arrays of numbers. Each operation bounds its error, so
that a comparison, and the rounding to a float, is either certain to be that of the exact number, or is
said to be uncertain: then the number is for decimals. This is the rounding test of A. Ziv, ACM Trans. Math.
Softw. 17 (1991) 410; so a float that comes out is the one that decimals give, to the last bit.

Source of the operations: T. J. Dekker, Numer. Math. 18 (1971) 224; bounds of their errors: M. Joldes,
J.-M. Muller, V. Popescu, ACM Trans. Math. Softw. 44 (2017) 15res, and V. Lefevre and others, ACM Trans. Math.
Softw. 49 (2023) 2 for the square root. None of theirs is above 15 * 2^-106.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.groups import agreed
from rigidcli.core.high_precision import CONTEXT, NOISE, SPLITTER, decimals
from rigidcli.core.many import Many

ERROR = 32 * 2.0**-106
"""The relative error of one operation, twice what is proved: room for the rounding of the bounds."""

WIDER = 1 + 2.0**-40
"""The factor for bounds that are sums and products of floats, each of which may be rounded down."""

ALMOST = Decimal("1e-28")
"""Iterations and sums end at steps below this, in units of the result: pairs have little more."""

LEAST, MOST = 1e-130, 1e130
"""A smaller number is uncertain by that much, as parts of products may be lost; a larger one entirely."""

Long: TypeAlias = Any
"""A decimal, or pairs in its place."""


class Pairs:
    """The sum of `high` and `low` (n each, or one number), known to `radius` (the same)."""

    __slots__ = ("high", "low", "radius")

    def __init__(self, high: Any, low: Any, radius: Any) -> None:
        self.high, self.low, self.radius = high, low, radius

    def __add__(self, other: Any) -> Pairs:
        high, low, radius = _parts(other)
        s, s_error = _two_sum(self.high, high)
        t, t_error = _two_sum(self.low, low)
        s, s_error = _fast_two_sum(s, s_error + t)
        return _bounded(*_fast_two_sum(s, s_error + t_error), self.radius + radius)

    __radd__ = __add__

    def __neg__(self) -> Pairs:
        return Pairs(-self.high, -self.low, self.radius)

    def __sub__(self, other: Long) -> Pairs:
        return self.__add__(-Pairs(*_parts(other)))

    def __rsub__(self, other: Long) -> Pairs:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Pairs:
        high, low, radius = _parts(other)
        p, error = _two_product(self.high, high)
        error = error + (self.high * low + self.low * high)
        spread = _size(self) * radius + abs(high) * WIDER * self.radius + self.radius * radius
        return _bounded(*_fast_two_sum(p, error), spread)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Pairs:
        high, low, radius = _parts(other)
        q = self.high / high
        p, error = _two_product(q, high)
        rest = ((self.high - p) - error) + (self.low - q * low)
        q, q_low = _fast_two_sum(q, rest / high)
        least = abs(high) / WIDER - radius
        spread = (self.radius + abs(q) * WIDER * radius) / np.where(least > 0, least, np.nan)
        return _bounded(q, q_low, spread)

    def __rtruediv__(self, other: Any) -> Pairs:
        return Pairs(*_parts(other)) / self

    def __pow__(self, count: int) -> Pairs:
        power = self
        for _ in range(count - 1):
            power = power * self
        return power

    def sqrt(self) -> Pairs:
        """The square root; uncertain where the number may be negative."""
        root = np.sqrt(self.high)
        p, error = _two_product(root, root)
        rest = (self.high - p) - error + self.low
        divisor = np.where(root > 0, root, 1.0)
        high, low = _fast_two_sum(root, rest / (2 * divisor))
        # sqrt(x + r) - sqrt(x) is at most r/sqrt(x), of either sign, for r up to x.
        spread = np.where(self.radius <= self.high / WIDER, self.radius / divisor * WIDER, np.nan)
        return _bounded(high, low, spread)

    def __abs__(self) -> Pairs:
        sign = np.where(self.high < 0, -1.0, 1.0)
        return Pairs(sign * self.high, sign * self.low, self.radius)

    def __bool__(self) -> bool:
        return self != 0

    def __gt__(self, other: Any) -> bool:
        value, radius = _difference(self, other)
        return agreed(value > 0, _is_told(value, radius))

    def __lt__(self, other: Any) -> bool:
        return Pairs(*_parts(other)) > self

    def __ge__(self, other: Any) -> bool:
        return not self < other

    def __le__(self, other: Any) -> bool:
        return not self > other

    def __eq__(self, other: object) -> bool:
        value, radius = _difference(self, other)
        return agreed(value == 0, _is_told(value, radius))

    __hash__ = None  # type: ignore[assignment]


def _bounded(high: Any, low: Any, radius: Any) -> Pairs:
    """The result of an operation whose operands make it uncertain by `radius`, with its own error."""
    size = abs(high)
    radius = (radius + ERROR * size) * WIDER
    if np.min(size) < LEAST or not np.max(size) < MOST:
        # A zero has no error of its own: factors so small that they vanish are uncertain themselves.
        radius = np.where((size > 0) & (size < LEAST), radius + LEAST, radius)
        radius = np.where(size < MOST, radius, np.inf)
    return Pairs(high, low, radius)


def _parts(number: Any) -> tuple[Any, Any, Any]:
    if isinstance(number, Pairs):
        return number.high, number.low, number.radius
    return _constant(Decimal(number))


@lru_cache(maxsize=256)
def _constant(number: Decimal) -> tuple[float, float, float]:
    """A decimal as a pair."""
    with localcontext(CONTEXT):
        high = float(number)
        low = float(number - Decimal(high))
        exact = Decimal(high) + Decimal(low) == number
    return high, low, 0.0 if exact else ERROR * abs(high)


def _size(pairs: Pairs) -> Any:
    return abs(pairs.high) * WIDER


def _difference(one: Pairs, other: Any) -> tuple[Any, Any]:
    """The difference, rounded to floats of the right sign, and a bound on the error of its pairs."""
    less = one - other
    return less.high, less.radius


def _is_told(value: Any, radius: Any) -> Any:
    """Whether a number of this value and radius has a certain sign; 0 is certain where it is exact."""
    return (abs(value) > radius * WIDER) | (radius == 0)


def _two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """a + b rounded, and the rest, exactly (D. Knuth)."""
    s = a + b
    own = s - a
    return s, (a - (s - own)) + (b - own)


def _fast_two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The same for |a| >= |b|."""
    s = a + b
    return s, b - (s - a)


def _two_product(a: Any, b: Any) -> tuple[Any, Any]:
    """a b rounded, and the rest, exactly (T. J. Dekker), where neither is near the ends of the floats."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _split(a), _split(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Any) -> tuple[Any, Any]:
    """Halves of 26 bits."""
    lifted = SPLITTER * a
    high = lifted - (lifted - a)
    return high, a - high


def exactly(number: Any) -> Long:
    """A float as a decimal, many as pairs, without rounding; an array of them as an array of such numbers."""
    if not isinstance(number, Many):
        return decimals(number) if np.ndim(number) else Decimal(number)
    if number.ndim:
        return np.array([exactly(entry) for entry in number])
    size = abs(number.values)
    fits = (size == 0) | ((size > LEAST) & (size < MOST))
    return Pairs(number.values, np.zeros_like(size), np.where(fits, 0.0, np.inf))


def rounded(number: Long) -> Any:
    """The float nearest to a decimal, or many to pairs. Raises PartedError where some are uncertain."""
    if not isinstance(number, Pairs):
        return float(number)
    high, low = np.asarray(number.high), np.asarray(number.low)
    reach = number.radius * WIDER + abs(low) * 2.0**-50
    agreed(np.isfinite(high), (high + (low + reach) == high) & (high + (low - reach) == high))
    return Many(high)


def exceeds(one: Long, other: Long) -> bool:
    """Whether one number is greater than another; of pairs, whether some are."""
    if isinstance(one, Pairs) or isinstance(other, Pairs):
        value, _ = _difference(Pairs(*_parts(one)), other)
        return bool((value > 0).any())
    return bool(one > other)


def widened(number: Long, by: Long) -> Long:
    """A number that is off by less than `by` > 0: decimals, whose digits are enough, stay as they are."""
    if not isinstance(number, Pairs):
        return number
    return Pairs(number.high, number.low, (number.radius + by.high + by.radius) * WIDER)


def settled(number: Long) -> Decimal:
    """The size, in units of a sum, of terms that may be left out, for numbers with the digits of this one."""
    return ALMOST if isinstance(number, Pairs) else NOISE
