"""The nutation of a heavy symmetric top: what its axis does between the limits of its tilt, and for how long.

For the names of arguments see `core.top`; the source is the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Literal, TypeAlias

from rigidcli.core.elliptic import complete_first, complete_third
from rigidcli.core.high_precision import CONTEXT, NOISE, PI
from rigidcli.core.pairs import Long, exactly, rounded
from rigidcli.core.swing import Start, Swing, swing
from rigidcli.core.top import ROUNDING
from rigidcli.errors import ComputationError

_ZERO, _TWO = Decimal(0), Decimal(2)

CANCELLED = Decimal("1e-40")
"""A sum below this, in units of its terms, is zero, or has lost too many of 80 digits beside the vertical."""

CUSP = 1e-12
"""phi-dot below this at a limit of theta, in units of what it varies by, is zero."""

_TOUCHING = Decimal("1e-50")
"""A limit closer to the vertical than this, in units of its distance at the start, goes through it."""

NutationKind: TypeAlias = Literal["looping", "cuspidal", "wavy", "steady", "none"]


@dataclass(frozen=True, slots=True)
class Nutation:
    """The motion of the axis between two tilts (rad), in which theta and phi-dot have one period (s).

    `amplitude` is theta_max - theta_min, to full relative accuracy (rad); `precession_per_nutation` is what
    phi advances by in a period (rad), `mean_rate` the mean of phi-dot (rad/s). At the two limits phi-dot has
    opposite signs when `looping`, the same sign when `wavy`, and is zero at one when `cuspidal`: so it
    is for a pendulum in a plane, where it is zero always. `steady`: theta is constant, and the period
    is that of an infinitesimal nutation. `none`: the axis is at rest.

    Where the axis goes through the vertical, phi jumps by half a turn: that is not counted, and phi-dot
    there is its limit, +- lambda3 spin/(2 lambda1). None stands for the infinite period of a top that
    takes forever to rise, with what belongs to it, and for the phi of an axis that rests vertically.
    """

    theta_min: float
    theta_max: float
    amplitude: float
    phi_dot_at_theta_min: float | None
    phi_dot_at_theta_max: float | None
    period: float | None
    precession_per_nutation: float | None
    mean_rate: float | None
    kind: NutationKind


@dataclass(frozen=True, slots=True)
class _Limit:
    """A limit of the motion: x = u - u0, 1 - u, 1 + u, theta, phi-dot, and whether the last is zero."""

    x: Long
    down: Long
    up: Long
    theta: float
    rate: Long
    resting: bool


def nutation(
    lambda1: float,
    lambda3: float,
    spin: float,
    tilt: float,
    precession: float,
    nutation: float,
    weight_moment: float,
    is_steady: bool = False,
) -> Nutation:
    """The nutation of a top that starts at `tilt` with phi-dot `precession` and theta-dot `nutation` (rad/s).

    All is done with 80 digits, from the sines of the given floats: see `swing`.

    Without weight this is the free precession of the body about L, in which theta varies too. A start
    with the rates of `steady`, but for rounding, is steady. So is one that `is_steady` by what is asked, if
    theta-dot is zero: at a horizontal axis, the rounding of a quarter turn weighs the more the slower the
    spin is.
    """
    with localcontext(CONTEXT):
        down, up = _distances(tilt)
        square = down * up
        a = exactly(lambda3) * exactly(spin) / exactly(lambda1)
        beta = 2 * exactly(weight_moment) / exactly(lambda1)
        turning, slope = exactly(precession) * square, exactly(nutation) * square.sqrt()
        energy = exactly(nutation) ** 2 + exactly(precession) * turning
        start = Start(a, beta, turning, slope, energy, down, up)
        found = swing(start, _TWO if is_steady else 4 * Decimal(ROUNDING))
        if found.low == found.high:
            return _constant_tilt(tilt, precession if square else None, found.rise)
        return _between(start, tilt, found)


def _constant_tilt(tilt: float, rate: float | None, stiffness: Long) -> Nutation:
    """The axis at rest, or in steady precession; `stiffness` is the squared rate of a small nutation."""
    if not rate:
        return Nutation(tilt, tilt, 0.0, rate, rate, None, None, rate, "none")
    period = 2 * PI / stiffness.sqrt()
    advance = rounded(exactly(rate) * period)
    return Nutation(tilt, tilt, 0.0, rate, rate, rounded(period), advance, rate, "steady")


def _between(start: Start, tilt: float, swing: Swing) -> Nutation:
    """The nutation of a tilt that is not constant."""
    variation = abs(start.a) * (swing.high - swing.low)
    lower, upper = (_limit(x, start, tilt, variation) for x in (swing.low, swing.high))
    period = advance = mean = None
    if swing.complement:
        exact_mean = _mean_rate(start, lower, upper, swing.complement)
        exact_period = 4 * complete_first(swing.complement) / swing.rise.sqrt()
        mean, period, advance = (
            rounded(each) for each in (exact_mean, exact_period, exact_mean * exact_period)
        )
    kind: NutationKind = "looping" if (lower.rate > 0) != (upper.rate > 0) else "wavy"
    return Nutation(
        min(upper.theta, tilt),
        max(lower.theta, tilt),
        _amplitude(lower, upper),
        rounded(upper.rate),
        rounded(lower.rate),
        period,
        advance,
        mean,
        "cuspidal" if lower.resting or upper.resting else kind,
    )


def _limit(x: Long, start: Start, tilt: float, variation: Long) -> _Limit:
    """The limit at x, exactly vertical where it comes within rounding of that.

    phi-dot = (b - a u)/(1 - u^2). `variation` is that of b - a u between the limits.
    """
    down, up = start.down - x, start.up + x
    if down <= _TOUCHING * (start.down + abs(x)):
        return _Limit(x, _ZERO, _TWO, 0.0, start.a / 2, start.a == 0)
    if up <= _TOUCHING * (start.up + abs(x)):
        return _Limit(x, _TWO, _ZERO, math.pi, -start.a / 2, start.a == 0)
    theta = tilt if x == 0 else 2 * math.atan2(rounded(down.sqrt()), rounded(up.sqrt()))
    turning = start.turning - start.a * x
    resting = abs(turning) <= Decimal(CUSP) * (abs(start.turning) + variation)
    return _Limit(x, down, up, theta, turning / (down * up), resting)


def _amplitude(lower: _Limit, upper: _Limit) -> float:
    """The angle between two limits, by the sine and cosine of its half."""
    sine = (upper.x - lower.x) / ((lower.down * upper.up).sqrt() + (lower.up * upper.down).sqrt())
    twice_cosine = (lower.up * upper.up).sqrt() + (lower.down * upper.down).sqrt()
    return 2 * math.atan2(rounded(2 * sine), rounded(twice_cosine))


def _mean_rate(start: Start, lower: _Limit, upper: _Limit, complement: Long) -> Long:
    """The mean of phi-dot in time, by partial fractions ((b - a)/(1 - u) + (b + a)/(1 + u))/2.

    In u = u1 + (u2 - u1) sn^2 the mean of each lies between its values at the limits, at a
    share that is an integral of the third kind. Its numerator is zero where a limit is its pole.

    Without weight the two cancel where the vertical is outside the cone about L. With weight they never do.
    Raises ComputationError where they differ by less than 80 digits can tell.
    """
    fractions = (
        (start.turning - start.a * start.down, lower.down, upper.down),
        (start.turning + start.a * start.up, lower.up, upper.up),
    )
    terms = []
    for numerator, first, last in fractions:
        if first and last:
            share = complete_third(complement, (last / first).sqrt())
            terms.append(numerator * ((1 - share) / first + share / last) / 2)
    mean = sum(terms, _ZERO)
    if abs(mean) > CANCELLED * sum(map(abs, terms), _ZERO) or not any(terms):
        return mean
    if start.beta:
        raise ComputationError(
            "the top spins so fast that 80 digits do not tell its mean precession",
            hint="leave out `tilt`: the gyroscopic rate holds to all digits of so fast a top",
        )
    return _ZERO


def _distances(tilt: float) -> tuple[Long, Long]:
    """1 - cos(tilt) and 1 + cos(tilt), each to all digits; a tilt of pi but for its rounding is pi."""
    if abs(tilt - math.pi) <= ROUNDING:
        return _TWO, _ZERO
    half = exactly(tilt) / 2
    return 2 * _sine(half) ** 2, 2 * _sine(PI / 2 - half) ** 2


def _sine(x: Long) -> Long:
    """The sine of 0 <= x <= pi/2, by its series."""
    term, total, power = x, x, 1
    while abs(term) > NOISE * total:
        power += 2
        term = -term * x * x / (power * (power - 1))
        total = total + term
    # Terms of alternating signs: the rest is less than the last.
    return total
