"""The swing of a heavy symmetric top: the limits between which its tilt moves, and how fast it does.

For lambda1, lambda3, the spin and M g R see `core.top`. With u = cos(theta)

    u-dot^2 = f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2
    a = lambda3 spin/lambda1,   b = L_z/lambda1,   beta = 2 M g R/lambda1

and the cubic f has roots u1 <= u2 <= 1 <= u3.

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7. Unlike there, f is expanded about the
initial value u0: x = u - u0 keeps its digits however small the nutation is, and a start at a limit is
the root x = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from rigidcli.core.high_precision import NOISE
from rigidcli.core.pairs import Long

_ZERO = Decimal(0)

_SEPARATRIX = Decimal("1e-30")
"""Where u3 - u2 is less than this, in units of u3 - u0, the top takes infinite time to rise upright."""

_CLEARLY = Decimal("1.001")
"""A sum of terms is larger than another one, with which it is often equal, beyond this."""

_BRACKET = Decimal("1e-26")
"""The relative error of a root of pairs: so near to it, they still tell the signs on either side."""


@dataclass(frozen=True, slots=True)
class Start:
    """a, beta, b - a u, u-dot but for its sign, and alpha - beta u, 1 - u and 1 + u, at u0."""

    a: Long
    beta: Long
    turning: Long
    slope: Long
    energy: Long
    down: Long
    up: Long


@dataclass(frozen=True, slots=True)
class Swing:
    """The limits `low` <= 0 <= `high` of x = u - u0 in a nutation; both are 0 at a constant tilt.

    `rise` is beta (u3 - u1), in 1/s^2, and `complement` the k' of its elliptic functions: 0 where the
    top takes infinite time to rise upright.
    """

    low: Long
    high: Long
    rise: Long
    complement: Long


def swing(start: Start, slack: Long = _ZERO) -> Swing:
    """The swing of u = cos(theta) about its initial value u0, to some 70 digits; within CONTEXT.

    The tilt is constant where f is zero at u0 and its slope there is at most `slack`, in units of the terms
    of that slope.
    """
    a, beta, down, up = start.a, start.beta, start.down, start.up
    terms = (2 * start.turning * a, (down - up) * start.energy, -beta * down * up)
    c0, c1, c2 = start.slope**2, sum(terms, _ZERO), (up - down) * beta - start.energy - a * a
    if c0 == 0 and abs(c1) <= slack * sum(map(abs, terms), _ZERO):
        # Of an unstable top the rise is not positive, and nothing moves in its units.
        return Swing(_ZERO, _ZERO, -c2 if c2 < 0 else Decimal(1), Decimal(1))
    low, high = _turning_points(c0, c1, c2, beta, -up)
    # beta (u3 - u0) by Vieta's product: the sum of the roots loses it beside the vertical.
    third = -c0 / (low * high) if c0 else c1 / (low + high)
    gap = third - beta * high
    if gap <= _SEPARATRIX * third:
        gap, high = _ZERO, down
    rise = gap + beta * (high - low)
    return Swing(low, high, rise, (gap / rise).sqrt())


def _turning_points(c0: Long, c1: Long, c2: Long, c3: Long, bottom: Long) -> tuple[Long, Long]:
    """The roots low <= 0 <= high between which f = c0 + c1 x + c2 x^2 + c3 x^3 >= 0, for c0 >= 0, c3 >= 0.

    At `bottom`, below the roots, f is negative, concave and rising.
    """
    if c0 == 0:
        other = _near_root(c1, c2, c3)
        return min(other, _ZERO), max(other, _ZERO)
    low, last = bottom, 2 * bottom
    while low - last > -low * NOISE:
        # Newton's method goes up to the lowest root; this form of the step does not cancel for tiny roots.
        last, low = low, ((2 * c3 * low + c2) * low**2 - c0) / ((3 * c3 * low + 2 * c2) * low + c1)
    g0 = -c0 / low
    # The linear coefficient of f/(x - low), from the lower or the higher terms: as less cancels.
    from_below = (abs(c2) + abs(c3 * low)) * -low > _CLEARLY * (g0 + abs(c1))
    return low, _near_root(g0, (g0 - c1) / low if from_below else c2 + c3 * low, c3)


def _near_root(g0: Long, g1: Long, g2: Long) -> Long:
    """A root of g0 + g1 x + g2 x^2, g2 >= 0: the smaller positive one for g0 > 0, else the negative one.

    Neither form cancels.
    """
    root = max(g1 * g1 - 4 * g0 * g2, _ZERO).sqrt()
    return 2 * g0 / (root - g1) if g1 <= 0 else -(g1 + root) / (2 * g2)
