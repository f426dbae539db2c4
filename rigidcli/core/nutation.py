"""The nutation of a heavy symmetric top: the limits between which its tilt moves, and how fast.

    lambda1, lambda3   moments across and along the symmetry axis about the pivot (kg m^2)
    spin               component of omega along that axis (rad/s)
    M g R              the weight times the distance from the pivot to the centre of mass (N m)
    theta, u           angle of the axis from the upward vertical (rad), and its cosine
    L_z                vertical component of the angular momentum (kg m^2/s)

    a = lambda3 spin/lambda1,   b = L_z/lambda1,   beta = 2 M g R/lambda1
    alpha = theta-dot^2 + sin^2(theta) phi-dot^2 + beta u, which is constant as the energy is
    u'^2 = f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2,       u1 <= u2 <= 1 <= u3 the roots of f

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7. Unlike there, the roots of f are
differences from the initial u0, which keeps the digits of a small nutation, and beside the vertical they
follow from Vieta's products, as f(1) = -(b - a)^2 and f(-1) = -(b + a)^2.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, TypeAlias

from rigidcli.core.elliptic import beyond_first, complete
from rigidcli.core.precession import SAME_NUMBER

NutationKind: TypeAlias = Literal["looping", "cuspidal", "wavy", "steady", "none"]

CUSP = 1e-12  # phi-dot below this at a limit of theta, in units of what it varies by, is zero.


class Start(NamedTuple):
    """The state of the axis at t = 0, with time in units of 1/unit for some unit of rates.

    `poles` are b - a and b + a, zero where only rounding makes them differ from it. `turning` is b - a u0,
    `slope` u-dot but for its sign, `energy` alpha - beta u0, `down` 1 - u0 and `up` 1 + u0.
    """

    poles: tuple[float, float]
    a: float
    beta: float
    turning: float
    slope: float
    energy: float
    down: float
    up: float


class Swing(NamedTuple):
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
    def modulus(self) -> float:
        """k of the elliptic functions."""
        return math.sqrt(self.beta * self.width / self.rise)

    @property
    def complement(self) -> float:
        """k' of the elliptic functions, 0 where the top takes infinite time to rise upright."""
        return math.sqrt(self.gap / self.rise)

    @property
    def quarter(self) -> float:
        """K, infinite for k' = 0."""
        return complete(self.complement, 1.0, 1.0, 1.0) if self.gap else math.inf


def swing(start: Start, slack: float = 0.0) -> Swing:
    """The swing of u = cos(theta) about its initial value.

    The tilt is constant where f is zero at u0 and its slope there is at most `slack`, in units of the terms
    of that slope.
    """
    a, beta, turning, down, up = start.a, start.beta, start.turning, start.down, start.up
    top, bottom = start.poles
    # f(u0 + x) = c0 + c1 x + c2 x^2 + beta x^3, and c1 is the sum of three terms.
    terms = 2 * turning * a, (down - up) * start.energy, -beta * down * up
    c0, c1 = start.slope**2, sum(terms)
    c2 = (up - down) * beta - start.energy - a**2
    if c0 == 0 and abs(c1) <= slack * sum(map(abs, terms)):
        rise = -c2 if c2 < 0 else 1.0  # of an unstable top nothing moves, in any unit
        both = (turning, turning)
        return Swing((0.0, 0.0), (down, down), (up, up), both, start.poles, beta, rise, rise, rise)
    low, high = _turning_points(c0, c1, c2, beta, -up)
    down1 = down - low  # 1 - u1
    down2, third, gap = _below_vertical(start, down1)
    # 1 - u2 from the difference to u0 or from the vertical, whichever cancels nothing; likewise 1 + u1.
    if 2 * high <= down:
        down2 = down - high
    else:
        high = down - down2
    up2 = up + high
    up1 = up + low if -2 * low <= up else bottom / up2 * (bottom / (third + 2 * beta))
    # b - a u from its value at u0 or at the vertical.
    turning1 = _better((turning, -a * low), (bottom, -a * up1))
    turning2 = _better((turning, -a * high), (top, a * down2))
    return Swing(
        x=(low, high),
        down=(down1, down2),
        up=(up1, up2),
        turning=(turning1, turning2),
        poles=(top if down2 else 0.0, bottom if up1 else 0.0),
        beta=beta,
        third=third,
        gap=gap,
        rise=gap + beta * (high - low),
    )


def _below_vertical(start: Start, down1: float) -> tuple[float, float, float]:
    """1 - u2, beta (u3 - 1) and beta (u3 - u2), from 1 - u1 = `down1`.

    By Vieta's product at u = 1, 1 - u2 and 1 - u3 are the roots v of beta v^2 - m v = (b - a)^2/(1 - u1), and
    by Vieta's sum m is as below. The difference of the roots is gap/beta.
    """
    top, beta = start.poles[0], start.beta
    m = 2 * (start.a * top - start.energy + beta * start.down) / down1 + (top / down1) ** 2
    gap = math.hypot(m, 2 * math.sqrt(beta / down1) * top)
    if m < 0:
        return 2 * top / down1 * (top / (gap - m)), (gap - m) / 2, gap
    down2 = (m + gap) / (2 * beta)
    return down2, top / down1 * (top / down2) if down2 else 0.0, gap


def _better(*sums: tuple[float, ...]) -> float:
    """The same number from one of several sums: that with the smallest terms, which loses least."""
    return sum(min(sums, key=lambda terms: sum(map(abs, terms))))


def _turning_points(c0: float, c1: float, c2: float, c3: float, bottom: float) -> tuple[float, float]:
    """The roots low <= 0 <= high between which f = c0 + c1 x + c2 x^2 + c3 x^3 >= 0, for c0 >= 0, c3 >= 0.

    At `bottom`, below the roots, f is negative, concave and rising.
    """
    if c0 == 0:
        other = _near_root(c1, c2, c3)
        return min(other, 0.0), max(other, 0.0)
    low, last = bottom, -math.inf
    while low > last:
        # Newton's method goes up to the lowest root; this form of the step does not cancel for tiny roots.
        last, low = low, ((2 * c3 * low + c2) * low**2 - c0) / ((3 * c3 * low + 2 * c2) * low + c1)
    g0 = -c0 / last
    # The linear coefficient of f/(x - low), from the lower or from the higher terms.
    return last, _near_root(g0, _better((g0 / last, -c1 / last), (c2, c3 * last)), c3)


def _near_root(g0: float, g1: float, g2: float) -> float:
    """A root of g0 + g1 x + g2 x^2, g2 >= 0: the smaller positive one for g0 > 0, else the negative one.

    Neither form cancels.
    """
    root = math.sqrt(max(g1 * g1 - 4 * g0 * g2, 0.0))
    return 2 * g0 / (root - g1) if g1 <= 0 else -(g1 + root) / (2 * g2)


class Nutation(NamedTuple):
    """The motion of the axis between two tilts (rad), in which theta and phi-dot have one period (s).

    `precession_per_nutation` is what phi advances by in a period (rad), `mean_rate` the mean of phi-dot
    (rad/s). At the two limits phi-dot has opposite signs when `looping`, the same sign when `wavy`, and is
    zero at one when `cuspidal`: so it is for a pendulum in a plane, where it is zero always. `steady`: theta
    is constant, and the period is that of an infinitesimal nutation. `none`: the axis is at rest.

    Where the axis goes through the vertical, phi jumps by half a turn: that is not counted, and phi-dot
    there is its limit, +- lambda3 spin/(2 lambda1). None stands for the infinite period of a top that
    takes forever to rise, with what belongs to it, and for the phi of an axis that rests vertically.
    """

    theta_min: float
    theta_max: float
    phi_dot_at_theta_min: float | None
    phi_dot_at_theta_max: float | None
    period: float | None
    precession_per_nutation: float | None
    mean_rate: float | None
    kind: NutationKind


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
    given = lambda1, lambda3, spin, tilt, precession, nutation, weight_moment
    lambda1, lambda3, spin, tilt, precession, nutation, weight_moment = map(float, given)
    unit = rate_unit(lambda3 * spin / lambda1, precession, nutation, math.sqrt(2 * weight_moment / lambda1))
    a, beta = lambda3 * (spin / unit) / lambda1, 2 * (weight_moment / unit / unit) / lambda1
    phi_dot, theta_dot = precession / unit, nutation / unit
    down, up = 2 * math.sin(tilt / 2) ** 2, 2 * math.cos(tilt / 2) ** 2
    if abs(tilt - math.pi) <= SAME_NUMBER:
        down, up = 2.0, 0.0
    square = down * up
    turning, slope = phi_dot * square, theta_dot * math.sqrt(square)
    energy = theta_dot**2 + phi_dot * turning
    # A pole that may be rounding alone is zero.
    terms = (turning, -a * down), (turning, a * up)
    top, bottom = (x + y if abs(x + y) > SAME_NUMBER * (abs(x) + abs(y)) else 0.0 for x, y in terms)
    start = Start((top, bottom), a, beta, turning, slope, energy, down, up)
    limits = swing(start, 2.0 if is_steady else 4 * SAME_NUMBER)
    if not any(limits.x):
        rate = precession if square else None
        if not rate:
            return Nutation(tilt, tilt, rate, rate, None, None, rate, "none")
        period = 2 * math.pi / (math.sqrt(limits.rise) * unit)
        return Nutation(tilt, tilt, rate, rate, period, rate * period, rate, "steady")
    angles = [2 * math.atan2(math.sqrt(d), math.sqrt(e)) for d, e in zip(limits.down, limits.up, strict=True)]
    largest, least = (tilt if x == 0 else angle for x, angle in zip(limits.x, angles, strict=True))
    lower, upper = (_phi_dot(limits, a, end) * unit for end in (0, 1))
    variation = CUSP * (abs(turning) + abs(a) * limits.width)
    rests = any(abs(turning) <= variation for turning in limits.turning) and 0 not in limits.poles
    kind: NutationKind = "looping" if (lower > 0) != (upper > 0) else "wavy"
    if rests or not lower or not upper:
        kind = "cuspidal"
    ends = (min(least, tilt), max(largest, tilt), upper, lower)
    if not limits.gap:
        return Nutation(*ends, None, None, None, kind)
    quarter = limits.quarter
    mean, period = _mean_rate(limits, quarter) * unit, 4 * quarter / (math.sqrt(limits.rise) * unit)
    return Nutation(*ends, period, mean * period, mean, kind)


def rate_unit(*rates: float) -> float:
    """The power of two about the largest of the rates, in units of which no square vanishes or overflows."""
    return math.ldexp(1.0, math.frexp(max(map(abs, rates)))[1])


def _phi_dot(limits: Swing, a: float, end: int) -> float:
    """phi-dot = (b - a u)/(1 - u^2) at u1 or u2, by its limit at the vertical."""
    if not limits.down[end]:
        return a / 2
    if not limits.up[end]:
        return -a / 2
    return limits.turning[end] / (limits.down[end] * limits.up[end])


def _mean_rate(limits: Swing, quarter: float) -> float:
    """The mean of phi-dot = ((b - a)/(1 - u) + (b + a)/(1 + u))/2 in time.

    By f(1) and f(-1), |b -+ a| is sqrt(beta (u3 -+ 1) (1 -+ u1)(1 -+ u2)), and the mean of the root of
    (1 -+ u1)(1 -+ u2) over 1 -+ u is 1 without weight. So a fast top, whose b - a and b + a are almost
    opposite, loses nothing.
    """
    signs = [(pole > 0) - (pole < 0) for pole in limits.poles]
    top, bottom = (
        beyond_first(limits.modulus, limits.complement, math.sqrt(last / first)) / quarter if sign else 0.0
        for sign, (first, last) in zip(signs, (limits.down, limits.up), strict=True)
    )
    less, more = math.sqrt(limits.third), math.sqrt(limits.third + 2 * limits.beta)
    if signs[0] * signs[1] < 0:
        return signs[1] * (limits.beta / (less + more) * (1 + bottom) + less * (bottom - top) / 2)
    return (signs[0] * less * (1 + top) + signs[1] * more * (1 + bottom)) / 2
