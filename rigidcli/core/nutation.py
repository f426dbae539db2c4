"""The nutation of a heavy symmetric top: the limits between which its tilt moves, and how fast.

`lambda1`, `lambda3` (kg m^2), `spin` (rad/s) and `weight_moment` M g R (N m) are as in `core.precession`.
With u = cos(theta)

    a = lambda3 spin/lambda1,   b = L_z/lambda1,   beta = 2 M g R/lambda1
    u'^2 = f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2,       u1 <= u2 <= 1 <= u3

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7. A fast top nutates little, and one that
rises almost upright stays there for long: small differences decide. So f is formed in fractions, without
rounding, its roots are whole numbers of a tiny unit, and what is needed of them are plain differences.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.elliptic import beyond_first, complete
from rigidcli.core.precession import ROUNDING

NutationKind: TypeAlias = Literal["looping", "cuspidal", "wavy", "steady", "none"]

CUSP = 1e-12
"""phi-dot below this at a limit of theta, in units of what it varies by, is zero."""


BITS = 768
"""Bits after the point of the roots, and more for small numbers. Half of them are left where two roots are
nearly one: more than the differences of exact products of a few floats have."""


@dataclass(frozen=True, slots=True)
class Start:
    """The motion of the axis at u0, in units of time: a, beta, b - a u, alpha - beta u and 1 - u there."""

    a: Fraction
    beta: Fraction
    turning: Fraction
    energy: Fraction
    down: Fraction


@dataclass(frozen=True, slots=True)
class Swing:
    """The limits between which u moves, each as a pair (at u1, at u2).

    `x` has u - u0, `down` 1 - u, `up` 1 + u, and `turning` b - a u. `poles` are b - a and b + a, zero where
    u2 = 1 and u1 = -1. `third` is beta (u3 - 1), `gap` beta (u3 - u2), and `rise` beta (u3 - u1).
    """

    x: tuple[float, float]
    down: tuple[float, float]
    up: tuple[float, float]
    turning: tuple[float, float]
    poles: tuple[float, float]
    beta: float
    third: float
    gap: float
    rise: float

    @property
    def width(self) -> float:
        """u2 - u1."""
        return self.x[1] - self.x[0]

    @property
    def complement(self) -> float:
        """k' of the elliptic functions, 0 where the top takes infinite time to rise upright."""
        return math.sqrt(self.gap / self.rise)

    @property
    def quarter(self) -> float:
        """K, infinite for k' = 0."""
        return float(complete(self.complement, 1.0, 1.0, 1.0)) if self.gap else math.inf


def swing(start: Start, slack: float = 0.0) -> Swing:
    """The swing of u = cos(theta) about its initial value.

    The tilt is constant where f is zero at u0 and its slope there is at most `slack`, in units of the terms
    of that slope.
    """
    a, beta, turning, energy, down = start.a, start.beta, start.turning, start.energy, start.down
    up = 2 - down
    # The coefficients of f as a polynomial in x = u - u0.
    terms = 2 * turning * a, (down - up) * energy, -beta * down * up
    c0, c1, c2 = energy * down * up - turning**2, sum(terms, Fraction()), (up - down) * beta - energy - a**2
    least = min(abs(number) for number in (a, beta, turning, energy, down, up) if number)
    bits = BITS + 4 * max(0, least.denominator.bit_length() - least.numerator.bit_length())

    def whole(number: Fraction) -> int:
        return (number.numerator << bits) // number.denominator

    def rounded(number: int) -> float:
        # What is so small is but an error of the roots.
        return number / (1 << bits) if abs(number) >> bits // 2 + 64 else 0.0

    below, above, turn, along, pull = map(whole, (down, up, turning, a, beta))
    if c0 == 0 and abs(c1) <= slack * sum(map(abs, terms), Fraction()):
        low = high = 0
        third = gap = rise = whole(-c2) if c2 < 0 else 1 << bits  # of an unstable top nothing moves
    else:
        low, high, gap = _roots(whole(c0), whole(c1), whole(c2), pull, bits)
        rise = gap + ((high - low) * pull >> bits)
        third = gap - ((below - high) * pull >> bits)
    nearest, bottom = rounded(below - high), rounded(above + low)
    return Swing(
        (rounded(low), rounded(high)),
        (rounded(below - low), nearest),
        (bottom, rounded(above + high)),
        (rounded(turn - (along * low >> bits)), rounded(turn - (along * high >> bits))),
        (float(turning - a * down) if nearest else 0.0, float(turning + a * up) if bottom else 0.0),
        float(beta),
        *map(rounded, (third, gap, rise)),
    )


def _roots(c0: int, c1: int, c2: int, c3: int, bits: int) -> tuple[int, int, int]:
    """The roots x1 <= x2 between which f = c0 + c1 x + c2 x^2 + c3 x^3 >= 0, and c3 (x3 - x2), for c3 >= 0.

    All numbers are in units of 2^-bits.
    """
    # f is largest between x1 and x2, at y = 0, and there it is height - bend y^2 + c3 y^3.
    bend = math.isqrt(max(c2 * c2 - 3 * c1 * c3, 0))
    middle = (c1 << bits) // max(bend - c2, 1) if c2 <= 0 else -((bend + c2) << bits) // (3 * c3)
    height = c0 + (middle * (c1 + (middle * (c2 + (c3 * middle >> bits)) >> bits)) >> bits)
    low, last = middle - math.isqrt((max(height, 0) << 2 * bits) // max(bend, 1)) - 1, -math.inf
    while low > last:  # Newton's method goes up to x1 from a place below, where f is concave and rises
        p = c2 + (c3 * low >> bits)
        q = c1 + (p * low >> bits)
        value, slope = c0 + (q * low >> bits), q + ((p + (c3 * low >> bits)) * low >> bits)
        last = low
        if value < 0 < slope:
            low -= (value << bits) // slope
    # What is left of f is c3 x^2 + p x + q.
    gap = math.isqrt(max(p * p - 4 * q * c3, 0))
    return low, (2 * q << bits) // max(gap - p, 1), gap


@dataclass(frozen=True, slots=True)
class Nutation:
    """The motion of the axis between two tilts (rad), in which theta and phi-dot have one period (s).

    `amplitude` is theta_max - theta_min, to full relative accuracy (rad); `precession_per_nutation` is what
    phi advances by in a period (rad), `mean_precession_rate` the mean of phi-dot (rad/s). At the two limits
    phi-dot has opposite signs when `looping`, the same sign when `wavy`, and is zero at one when `cuspidal`:
    so it is for a pendulum in a plane, where it is zero always. `steady`: theta is constant, and the period
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
    nutation_period: float | None
    precession_per_nutation: float | None
    mean_precession_rate: float | None
    nutation_kind: NutationKind


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

    Without weight this is the free precession of the body about L, in which theta varies too. A start
    with the rates of steady precession, but for rounding, is steady. So is one that `is_steady` by what is
    asked, if theta-dot is zero: at a horizontal axis, the rounding of a quarter turn weighs the more the
    slower the spin is.
    """
    unit = rate_unit(lambda3 * spin / lambda1, precession, nutation, math.sqrt(2 * weight_moment / lambda1))
    down, up = (Fraction(2 * half(tilt / 2) ** 2) for half in (math.sin, math.cos))
    if abs(tilt - math.pi) <= ROUNDING:
        up = Fraction(0)
    # Of two numbers that are 2 together, the smaller has the digits.
    down, up = (down, 2 - down) if down < up else (2 - up, up)
    square = down * up
    along = Fraction(lambda3 * (spin / unit) / lambda1)
    beta = Fraction(2 * (weight_moment / unit / unit) / lambda1)
    turning = Fraction(precession / unit) * square
    for pole in (along * down, -along * up):
        # The axis passes the vertical where only rounding keeps it away.
        if abs(turning - pole) <= ROUNDING * (abs(turning) + abs(pole)):
            turning = pole
    energy = Fraction(nutation / unit) ** 2 + (turning**2 / square if square else 0)
    start, a = Start(along, beta, turning, energy, down), float(along)
    limits = swing(start, 2.0 if is_steady else 4 * ROUNDING)
    if not any(limits.x):
        rate = precession if square else None
        if not rate:
            return Nutation(tilt, tilt, 0.0, rate, rate, None, None, rate, "none")
        period = 2 * math.pi / math.sqrt(limits.rise) / unit
        return Nutation(tilt, tilt, 0.0, rate, rate, period, rate * period, rate, "steady")
    angles = [2 * math.atan2(math.sqrt(d), math.sqrt(e)) for d, e in zip(limits.down, limits.up, strict=True)]
    largest, least = (tilt if x == 0 else angle for x, angle in zip(limits.x, angles, strict=True))
    lower, upper = _phi_dot(limits, a, 0), _phi_dot(limits, a, 1)
    variation = CUSP * (abs(float(turning)) + abs(a) * limits.width)
    rests = any(abs(turning) <= variation for turning in limits.turning) and 0 not in limits.poles
    kind: NutationKind = "looping" if (lower > 0) != (upper > 0) else "wavy"
    if rests or not lower or not upper:
        kind = "cuspidal"
    ends = (min(least, tilt), max(largest, tilt), _amplitude(limits), upper * unit, lower * unit)
    if not limits.gap:
        return Nutation(*ends, None, None, None, kind)
    quarter = limits.quarter
    mean, period = _mean_rate(limits, quarter), 4 * quarter / math.sqrt(limits.rise)
    return Nutation(*ends, period / unit, mean * period, mean * unit, kind)


def rate_unit(*rates: float) -> float:
    """The power of two about the largest of the rates, in units of which no square vanishes or overflows."""
    return math.ldexp(1.0, math.frexp(max(map(abs, rates)))[1])


def _phi_dot(limits: Swing, a: float, end: Literal[0, 1]) -> float:
    """phi-dot = (b - a u)/(1 - u^2) at u1 or u2, by its limit at the vertical."""
    if not limits.down[end]:
        return a / 2
    if not limits.up[end]:
        return -a / 2
    return limits.turning[end] / (limits.down[end] * limits.up[end])


def _amplitude(limits: Swing) -> float:
    """The angle between the limits, by the sine and cosine of its half."""
    (d1, d2), (e1, e2) = limits.down, limits.up
    return 2 * math.atan2(
        2 * limits.width / (math.sqrt(d1 * e2) + math.sqrt(e1 * d2)), math.sqrt(e1 * e2) + math.sqrt(d1 * d2)
    )


def _mean_rate(limits: Swing, quarter: float) -> float:
    """The mean of phi-dot = ((b - a)/(1 - u) + (b + a)/(1 + u))/2 in time.

    By f(1) and f(-1), |b -+ a| is sqrt(beta (u3 -+ 1) (1 -+ u1)(1 -+ u2)), and the mean of the root of
    (1 -+ u1)(1 -+ u2) over 1 -+ u is 1 without weight. So a fast top, whose b - a and b + a are almost
    opposite, loses nothing.
    """
    k = math.sqrt(limits.beta * limits.width / limits.rise)
    signs = [(pole > 0) - (pole < 0) for pole in limits.poles]
    top, bottom = (
        beyond_first(k, limits.complement, math.sqrt(last / first)) / quarter if sign else 0.0
        for sign, (first, last) in zip(signs, (limits.down, limits.up), strict=True)
    )
    less, more = math.sqrt(limits.third), math.sqrt(limits.third + 2 * limits.beta)
    if signs[0] * signs[1] < 0:
        return signs[1] * (limits.beta / (less + more) * (1 + bottom) + less * (bottom - top) / 2)
    return (signs[0] * less * (1 + top) + signs[1] * more * (1 + bottom)) / 2


def effective_potential(
    lambda1: float,
    lambda3: float,
    spin: float,
    tilt: float,
    precession: float,
    nutation: float,
    weight_moment: float,
) -> tuple[Callable[[Floats], Floats], float]:
    """The potential (J) in which the tilt moves, as a function of tilts (n, rad), and the energy (J).

    V(theta) = (p_phi - p_psi cos theta)^2/(2 lambda1 sin^2 theta) + M g R cos theta, for a start as in
    `nutation`; the energy is without the constant lambda3 spin^2/2. With delta = cos(tilt) - cos(theta),
    p_phi - p_psi cos theta = lambda1 sin^2(tilt) phi-dot + p_psi delta.
    """
    along, turning = lambda3 * spin, lambda1 * np.sin(tilt) ** 2 * precession

    def at(theta: Floats) -> Floats:
        # The difference of two cosines as a product, which keeps its digits beside the start.
        difference = 2 * np.sin((theta + tilt) / 2) * np.sin((theta - tilt) / 2)
        centrifugal = (turning + along * difference) ** 2 / (2 * lambda1 * np.sin(theta) ** 2)
        potential: Floats = centrifugal + weight_moment * np.cos(theta)
        return potential

    kinetic = lambda1 * (nutation**2 + (np.sin(tilt) * precession) ** 2) / 2
    return at, float(kinetic + weight_moment * np.cos(tilt))
