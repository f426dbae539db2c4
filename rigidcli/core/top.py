"""The heavy symmetric top: steady precession, the sleeping top and nutation.

Throughout, `lambda1` (> 0) and `lambda3` are the moments about the fixed pivot, across and along the
symmetry axis (kg m^2); `spin` is the component of omega along that axis, of either sign (rad/s);
`weight_moment` is M g R >= 0 (N m), the axis pointing from the pivot to the centre of mass; `tilt` is the
angle theta of the axis from the upward vertical, from 0 to pi (rad). phi is the angle of the axis about
the vertical, right-handed.

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7.

Exact numbers may contain symbols without a value. What depends on them comes out as the formula of the
general case, valid where its square roots are real and its denominators not zero; a choice that has
no formula is None.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.elliptic import complete_first, complete_third
from rigidcli.core.groups import UnfitError
from rigidcli.core.high_precision import CONTEXT, PI
from rigidcli.core.many_arithmetic import MANY
from rigidcli.core.pairs import Long, Pairs, exactly, exceeds, rounded, settled, widened
from rigidcli.errors import ComputationError

ROUNDING = 4 * 2.0**-52
"""The largest difference of two equal numbers, in units of either, that a few roundings leave."""

CANCELLED = Decimal("1e-40")
"""A sum below this, in units of its terms, is zero, or has lost too many of 80 digits beside the vertical."""

CUSP = 1e-12
"""phi-dot below this at a limit of theta, in units of what it varies by, is zero."""

Stability: TypeAlias = Literal["stable", "marginal", "unstable"]

NutationKind: TypeAlias = Literal["looping", "cuspidal", "wavy", "steady", "none"]


@dataclass(frozen=True, slots=True)
class Steady:
    """The rates of precession at constant tilt (rad/s), and the least |spin| that allows any (rad/s).

    `slow` is the smaller in magnitude, the negative one of a tie; None where there is none. Where
    both are complex, `complex_roots` holds them as (re, im). `minimum_spin` is 0 when every spin will do.
    """

    slow: Scalar | None
    fast: Scalar | None
    complex_roots: tuple[tuple[Scalar, Scalar], ...]
    minimum_spin: Scalar | None


@dataclass(frozen=True, slots=True)
class Sleeping:
    """The top spinning upright.

    `threshold` is the |spin| (rad/s) above which that is stable, `growth_rate` (1/s) that of a
    small deviation: None when stable, 0 when marginal. `frequencies` are the two rates (rad/s,
    signed, the smaller in magnitude first) at which a small deviation goes round; None when unstable.
    """

    threshold: Scalar | None
    stability: Stability | None
    growth_rate: Scalar | None
    frequencies: tuple[Scalar, Scalar] | None


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


def cosine(angle: Scalar, n: Arithmetic) -> Scalar:
    """cos(angle), and 0 for an angle (rad) that is a right angle but for its rounding."""
    value = n.cos(angle)
    return 0 * value if not n.exact and abs(value) <= ROUNDING else value


def sine(angle: Scalar, n: Arithmetic) -> Scalar:
    """sin(angle), and 0 for an angle (rad) that is pi but for its rounding."""
    value = n.sin(angle)
    straight = n.sign(n.pi - angle) == 0 if n.exact else abs(angle - n.pi) <= ROUNDING
    return 0 * value if straight else value


def gyroscopic_rate(lambda3: Scalar, spin: Scalar, weight_moment: Scalar, n: Arithmetic) -> Scalar | None:
    """Precession of a fast top, M g R / (lambda3 spin) (rad/s, signed); None without spin."""
    momentum = lambda3 * spin
    return None if n.sign(momentum) == 0 else weight_moment / momentum


def gyroscopic_error(
    lambda1: Scalar, lambda3: Scalar, spin: Scalar, tilt: Scalar, slow: Scalar | None, n: Arithmetic
) -> Scalar | None:
    """Relative error of `gyroscopic_rate` for the `slow` rate of the same top; None without either.

    M g R / S / W - 1 = -lambda1 cos(theta) W / S by the equation of W, and this form cancels nothing.
    """
    momentum = lambda3 * spin
    if slow is None or n.sign(momentum) == 0:
        return None
    return _tidy(-lambda1 * cosine(tilt, n) * slow / momentum, n)


def steady(
    lambda1: Scalar, lambda3: Scalar, spin: Scalar, tilt: Scalar, weight_moment: Scalar, n: Arithmetic
) -> Steady:
    """Steady precession: lambda1 cos(theta) W^2 - lambda3 spin W + M g R = 0.

    A horizontal top has one root, none without spin. A hanging one has two of opposite sign. At theta = 0
    and pi the roots are the limits of those at a small tilt.
    """
    upward = cosine(tilt, n)
    side, momentum = n.sign(upward), lambda3 * spin
    if side == 0:
        rate = gyroscopic_rate(lambda3, spin, weight_moment, n)
        if rate is None and n.sign(weight_moment) == 0:
            rate = weight_moment  # no torque, no precession
        return Steady(rate, None, (), 0 * lambda1)
    rates = _roots(lambda1 * upward, momentum, weight_moment, n)
    least = 0 * lambda1 if side == -1 else _threshold(lambda1 * upward, lambda3, weight_moment, n)
    if isinstance(rates, _Complex):
        return Steady(None, None, ((rates.re, -rates.im), (rates.re, rates.im)), least)
    return Steady(*rates, (), least)


def sleeping(
    lambda1: Scalar, lambda3: Scalar, spin: Scalar, weight_moment: Scalar, n: Arithmetic
) -> Sleeping:
    """Stability of the upright top.

    Near the vertical z = x + i y of the axis obeys lambda1 z'' - i lambda3 spin z' - M g R z = 0, and
    z = exp(i W t) turns this into the equation of steady precession at theta = 0. A spin within
    rounding of the threshold is marginal.
    """
    momentum = lambda3 * spin
    threshold = _threshold(lambda1, lambda3, weight_moment, n)
    rates = _roots(lambda1, momentum, weight_moment, n)
    if isinstance(rates, _Complex):
        return Sleeping(threshold, "unstable", rates.im, None)
    sign, root = _root_of_discriminant(lambda1, momentum, weight_moment, n)
    if sign is None:
        growth = n.sqrt(_tidy(-(root**2), n)) / (2 * lambda1)
        return Sleeping(threshold, None, _tidy(growth, n), rates)
    if sign == 0:
        return Sleeping(threshold, "marginal", 0 * lambda1, rates)
    return Sleeping(threshold, "stable", None, rates)


@dataclass(frozen=True, slots=True)
class _Complex:
    re: Scalar
    im: Scalar


def _roots(a: Scalar, s: Scalar, p: Scalar, n: Arithmetic) -> tuple[Scalar, Scalar] | _Complex:
    """The roots of a W^2 - s W + p = 0 for p >= 0 and a other than 0, the smaller in magnitude first."""
    sign, root = _root_of_discriminant(a, s, p, n)
    if sign == -1:
        return _Complex(_tidy(s / (2 * a), n), _tidy(root / (2 * a), n))
    turn = n.sign(s)
    if turn is None:
        # The root of the same sign as s, whichever that is.
        double = s * (1 + n.sqrt(_tidy(1 - 4 * a * p / s**2, n)))
    else:
        double = s + root if turn > 0 else s - root
    if n.sign(double) == 0:
        return p, p  # p = 0 here
    return _tidy(2 * p / double, n), _tidy(double / (2 * a), n)


def _root_of_discriminant(a: Scalar, s: Scalar, p: Scalar, n: Arithmetic) -> tuple[int | None, Scalar]:
    """The sign of D = s^2 - 4 a p and the root of |D|; of D where the sign depends on symbols.

    Floats take D by its factors, which neither overflow nor cancel more than the data do.
    """
    if n.exact:
        square = _tidy(s**2 - 4 * a * p, n)
        sign = n.sign(square)
        return sign, n.sqrt(-square if sign == -1 else square)
    bound = 2 * n.sqrt(abs(a)) * n.sqrt(p)
    if a < 0:
        root = n.hypot(s, bound)
        return n.sign(root), root
    excess = abs(s) - bound
    if abs(excess) <= ROUNDING * bound:
        return 0, 0.0
    return n.sign(excess), n.sqrt(abs(excess)) * n.sqrt(abs(s) + bound)


def _threshold(a: Scalar, lambda3: Scalar, p: Scalar, n: Arithmetic) -> Scalar | None:
    """The spin at which the roots are equal, 2 sqrt(a p) / lambda3; None where no spin is enough."""
    bound = 2 * n.sqrt(a * p) if n.exact else 2 * n.sqrt(a) * n.sqrt(p)
    if n.sign(lambda3) == 0:
        return bound if n.sign(bound) == 0 else None
    return _tidy(bound / lambda3, n)


def _tidy(x: Scalar, n: Arithmetic) -> Scalar:
    short: Scalar = n.tidy(n.array([x]))[0] if n.exact else x
    return short


_ZERO, _TWO = Decimal(0), Decimal(2)

_CLEARLY = Decimal("1.001")
"""A sum of terms is larger than another one, with which it is often equal, beyond this."""

_BRACKET = Decimal("1e-26")
"""The relative error of a root of pairs: so near to it, they still tell the signs on either side."""

_TOUCHING = Decimal("1e-50")
"""A limit closer to the vertical than this, in units of its distance at the start, goes through it."""

_SEPARATRIX = Decimal("1e-30")
"""Where u3 - u2 is less than this, in units of u3 - u0, the top takes infinite time to rise upright."""


@dataclass(frozen=True, slots=True)
class Start:
    """a, beta, b - a u, u-dot but for its sign, and alpha - beta u of the source, 1 - u and 1 + u, at u0."""

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


def swing(start: Start, slack: Long = _ZERO) -> Swing:
    """The swing of u = cos(theta) about its initial value u0, to some 70 digits; within CONTEXT.

    u-dot^2 = f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2, and the cubic f has roots u1 <= u2 <= 1 <= u3.
    Unlike in the source, f is expanded about u0: x = u - u0 keeps its digits however small the nutation is,
    and a start at a limit is the root x = 0. The tilt is constant where f is zero at u0 and its slope there
    is at most `slack`, in units of the terms of that slope.
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
    theta = tilt if x == 0 else 2 * MANY.atan2(rounded(down.sqrt()), rounded(up.sqrt()))
    turning = start.turning - start.a * x
    resting = abs(turning) <= Decimal(CUSP) * (abs(start.turning) + variation)
    return _Limit(x, down, up, theta, turning / (down * up), resting)


def _amplitude(lower: _Limit, upper: _Limit) -> float:
    """The angle between two limits, by the sine and cosine of its half."""
    sine = (upper.x - lower.x) / ((lower.down * upper.up).sqrt() + (lower.up * upper.down).sqrt())
    twice_cosine = (lower.up * upper.up).sqrt() + (lower.down * upper.down).sqrt()
    return 2 * MANY.atan2(rounded(2 * sine), rounded(twice_cosine))


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


def _turning_points(c0: Long, c1: Long, c2: Long, c3: Long, bottom: Long) -> tuple[Long, Long]:
    """The roots low <= 0 <= high between which f = c0 + c1 x + c2 x^2 + c3 x^3 >= 0, for c0 >= 0, c3 >= 0.

    At `bottom`, below the roots, f is negative, concave and rising.
    """
    if c0 == 0:
        other = _near_root(c1, c2, c3)
        return min(other, _ZERO), max(other, _ZERO)
    low, last = bottom, 2 * bottom
    while exceeds(low - last, -low * settled(low)):
        # Newton's method goes up to the lowest root; this form of the step does not cancel for tiny roots.
        last, low = low, ((2 * c3 * low + c2) * low**2 - c0) / ((3 * c3 * low + 2 * c2) * low + c1)
    low = _between_signs(low, lambda x: c0 + x * (c1 + x * (c2 + x * c3)))
    g0 = -c0 / low
    # The linear coefficient of f/(x - low), from the lower or the higher terms: as less cancels.
    from_below = (abs(c2) + abs(c3 * low)) * -low > _CLEARLY * (g0 + abs(c1))
    return low, _near_root(g0, (g0 - c1) / low if from_below else c2 + c3 * low, c3)


def _between_signs(root: Long, f: Callable[[Long], Long]) -> Long:
    """A root < 0 at which f changes its sign from below, with a bound on its error where it has one."""
    if not isinstance(root, Pairs):
        return root
    # Errors on the way to the root do not matter: the signs tell where it is.
    root = Pairs(root.high, root.low, np.zeros_like(root.high))
    error = -root * _BRACKET
    if not f(root - error) < 0 < f(root + error):
        raise UnfitError
    return widened(root, error)


def _near_root(g0: Long, g1: Long, g2: Long) -> Long:
    """A root of g0 + g1 x + g2 x^2, g2 >= 0: the smaller positive one for g0 > 0, else the negative one.

    Neither form cancels.
    """
    root = max(g1 * g1 - 4 * g0 * g2, _ZERO).sqrt()
    return 2 * g0 / (root - g1) if g1 <= 0 else -(g1 + root) / (2 * g2)


def _distances(tilt: float) -> tuple[Long, Long]:
    """1 - cos(tilt) and 1 + cos(tilt), each to all digits; a tilt of pi but for its rounding is pi."""
    if abs(tilt - math.pi) <= ROUNDING:
        return _TWO, _ZERO
    half = exactly(tilt) / 2
    return 2 * _sine(half) ** 2, 2 * _sine(PI / 2 - half) ** 2


def _sine(x: Long) -> Long:
    """The sine of 0 <= x <= pi/2, by its series."""
    term, total, power = x, x, 1
    while exceeds(abs(term), settled(x) * total):
        power += 2
        term = -term * x * x / (power * (power - 1))
        total = total + term
    # Terms of alternating signs: the rest is less than the last.
    return widened(total, abs(term))
