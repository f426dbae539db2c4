"""The motion of a heavy symmetric top in closed form: omega and orientation at any time.

    phi, theta, psi   Euler angles zxz of the axes of the body, the third along the symmetry axis
    omega1, omega2    components of omega (rad/s) across the symmetry axis, along axes of the body
    v                 argument of Jacobi's elliptic functions sn, cn, dn, of modulus k, k' = sqrt(1 - k^2)

Further letters are those of `core.nutation`:

    u = u1 + (u2 - u1) sn^2 v,   v = rate t + v0
    rate = sqrt(beta (u3 - u1))/2,   k'^2 = (u3 - u2)/(u3 - u1)
    (phi + psi)' = spin - a + (b + a)/(1 + u),     (phi - psi)' = a - spin + (b - a)/(1 - u)

Sources: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7; F. Klein, A. Sommerfeld, Über die
Theorie des Kreisels, for the sum and the difference of phi and psi. Their halves are the phases of
q0 + i q3 = cos(theta/2) exp(i (phi + psi)/2) and q1 + i q2 = sin(theta/2) exp(i (phi - psi)/2). Each has one
pole only, where the axis goes through the vertical and its component through zero, so that, unlike with
Euler angles, nothing is lost there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.elliptic import carlson_rf, complete, growth, jacobi, lag, to_first_quarter
from rigidcli.core.free_body import SAMPLES_AT_ONCE
from rigidcli.core.nutation import Start, Swing, rate_unit, swing
from rigidcli.core.rotation import ULPS_MOVED, representative, to_rounding

Complexes: TypeAlias = NDArray[np.complex128]

PASSING = 1e-3  # The axis is passing the vertical where it is there within this time, in units of 1/rate.


class PhaseAngle(NamedTuple):
    """An angle (rad): `mean` t plus `swing` S(v).

    S is an `integral` as a function of sn v, cn v and dn v, less its mean growth `growth` v.
    """

    mean: float
    swing: float = 0.0
    growth: float = 0.0
    integral: Callable[..., Floats] | None = None

    def at(self, times: Floats, v: Floats, functions: Sequence[Floats]) -> Floats:
        """The angle at times, where the argument is v and Jacobi's `functions` have these values."""
        if self.integral is None:
            return self.mean * times
        return self.mean * times + self.swing * (self.integral(*functions) - self.growth * v)


class HeavyMotion(NamedTuple):
    """The constants of the motion; the letters are those of the module's docstring.

    All rates are in units of `unit` (rad/s). `start` is v0. `total` is phi + psi and `difference` phi - psi,
    but for their values at t = 0: `leads` are the two factors exp(i/2 ...) that these make.
    """

    unit: float
    spin: float
    limits: Swing
    rate: float
    start: float
    total: PhaseAngle
    difference: PhaseAngle
    leads: tuple[complex, complex] = (1, 1)

    def rounding(self, times: Floats) -> float:
        """What the rounding of the phases turns the body by (rad) at the last of the `times` (n, s)."""
        growth = self.rate + abs(self.total.mean) + abs(self.difference.mean)
        return EPS * growth * self.unit * float(np.abs(times).max())

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """omega (n, 3; rad/s) and orientation (n, 4), in the axes of `heavy_motion`, at `times` (n, s)."""
        omega, orientation = np.empty((len(times), 3)), np.empty((len(times), 4))
        first, last = self.leads
        for begin in range(0, len(times), SAMPLES_AT_ONCE):
            part = slice(begin, begin + SAMPLES_AT_ONCE)
            cosine, sine, across = self.parts(times[part] * self.unit)
            cosine, sine, across = first * cosine, last * sine, first * np.conj(last) * across
            orientation[part] = np.column_stack([cosine.real, sine.real, sine.imag, cosine.imag])
            rates = np.column_stack([across.imag, across.real, np.full(len(cosine), self.spin)])
            omega[part] = rates * self.unit
        return omega, orientation

    def parts(self, times: Floats) -> tuple[Complexes, Complexes, Complexes]:
        """q0 + i q3, q1 + i q2 and omega2 + i omega1 (n), but for the leads, at times in units of 1/`unit`.

        These are cos(theta/2) exp(i (phi + psi)/2), sin(theta/2) exp(i (phi - psi)/2) and
        (phi-dot sin(theta) + i theta-dot) exp(i psi).
        """
        limits = self.limits
        v, sign = to_first_quarter(self.rate * times + self.start, limits.quarter)
        sn, cn, dn = jacobi(v, limits.complement)
        cn = np.abs(cn)  # rounding may put v beyond a quarter period
        total, difference = (angle.at(times, v, (sn, cn, dn)) for angle in (self.total, self.difference))
        sn, cn = sign * sn, sign * cn
        rising, falling = self._half_angle(sn, cn)
        across = self._across(rising, falling, sn, cn, dn) * np.exp(0.5j * (total - difference))
        cosine = math.sqrt(limits.up[1] / 2) * rising * np.exp(0.5j * total)
        sine = math.sqrt(limits.down[0] / 2) * falling * np.exp(0.5j * difference)
        return cosine, sine, across

    def _half_angle(self, sn: Floats, cn: Floats) -> tuple[Floats, Floats]:
        """cos(theta/2) and sin(theta/2), in units of their largest values.

        As 1 + u = (1 + u1) cn^2 + (1 + u2) sn^2, the first is the root of sn^2 + (1 + u1)/(1 + u2) cn^2. It
        is sn itself, with its sign, where the axis hangs at u1 = -1. So is the other one, by 1 - u.
        """
        (down1, down2), (up1, up2) = self.limits.down, self.limits.up
        rising = np.hypot(sn, math.sqrt(up1 / up2) * cn) if up1 and up2 else sn
        falling = np.hypot(cn, math.sqrt(down2 / down1) * sn) if down1 and down2 else cn
        return rising, falling

    def _across(self, rising: Floats, falling: Floats, sn: Floats, cn: Floats, dn: Floats) -> Complexes:
        """phi-dot sin(theta) + i theta-dot = (b - a u - i u-dot)/sin(theta).

        The numerator is (b - a u1) cn^2 + (b - a u2) sn^2 - 2 i (u2 - u1) rate sn cn dn, and sin(theta) is
        `rising` `falling` sqrt((1 - u1)(1 + u2)). At the vertical both vanish: there sn/rising or cn/falling
        is 1, and b - a u is zero at that limit.
        """
        limits = self.limits
        scale = math.sqrt(limits.down[0] * limits.up[1])
        if not scale:
            return np.zeros(len(sn), dtype=complex)
        across, along = (cn / falling if limits.down[1] else 1.0), (sn / rising if limits.up[0] else 1.0)
        turning: Complexes = np.asarray(-2j * limits.width * self.rate * dn * across * along)
        if limits.up[0]:
            turning = turning + limits.turning[0] * across * (cn / rising)
        if limits.down[1]:
            turning = turning + limits.turning[1] * along * (sn / falling)
        return turning / scale


def heavy_motion(
    lambda1: float, lambda3: float, weight_moment: float, omega: Floats, orientation: Floats
) -> HeavyMotion:
    """The motion of a top with moments lambda1 across and lambda3 along its axis about the pivot (kg m^2).

    `weight_moment` is M g R > 0 (N m). `omega` (3, rad/s) and `orientation` (4, to axes of space with z
    upward) at t = 0 are in axes of the body, the third of which points from the pivot to the centre of mass.
    """
    fall = math.sqrt(2 * weight_moment / lambda1)
    unit = rate_unit(fall, *omega, lambda3 * omega[2] / lambda1)
    start = _start(lambda1, lambda3, weight_moment / unit**2, omega / unit, orientation)
    limits = swing(start)
    w3 = float(omega[2] / unit)
    rate, own = math.sqrt(limits.rise) / 2, w3 * (lambda1 - lambda3) / lambda1
    first = _first_argument(limits, float(start.slope))
    turns = _total(own, limits, rate), _difference(-own, limits, rate)
    motion = HeavyMotion(unit, w3, limits, rate, first, *turns)
    return motion._replace(leads=_leads(motion, omega / unit, orientation))


def _start(lambda1: float, lambda3: float, weight_moment: float, omega: Floats, orientation: Floats) -> Start:
    w1, w2, w3 = omega.tolist()
    q0, q1, q2, q3 = orientation.tolist()
    square = q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3
    # z1, z2 are components of the upward vector along the first two axes of the body.
    z1, z2 = 2 * (q1 * q3 - q0 * q2) / square, 2 * (q2 * q3 + q0 * q1) / square
    down, up = 2 * (q1 * q1 + q2 * q2) / square, 2 * (q0 * q0 + q3 * q3) / square
    a, turning = lambda3 * w3 / lambda1, w1 * z1 + w2 * z2
    poles = turning - a * down, turning + a * up
    beta = 2 * weight_moment / lambda1
    return Start(poles, a, beta, turning, w2 * z1 - w1 * z2, w1 * w1 + w2 * w2, down, up)


def _first_argument(limits: Swing, slope: float) -> float:
    """v0, within a quarter period of 0: where u is on its way from u1 to u2."""
    low, high = limits.x
    if low == high:
        return 0.0
    s, c = math.copysign(math.sqrt(-low / limits.width), slope), math.sqrt(max(high, 0.0) / limits.width)
    return s * float(carlson_rf(c, math.hypot(c, limits.complement * s), 1.0))


def _total(own: float, limits: Swing, rate: float) -> PhaseAngle:
    """phi + psi, which grows at the rate own + (b + a)/(1 + u), where 1 + u = (1 + u1)(1 + n sn^2)."""
    pole, (first, last) = limits.poles[1], limits.up
    if not pole:
        return PhaseAngle(own)
    n = limits.width / first
    mean = float(complete(limits.complement, last / first, 1.0, 0.0)) / limits.quarter
    integral = partial(growth, n, limits.modulus, limits.complement)
    return PhaseAngle(own + pole * (1 + n * mean) / last, pole * n / (last * rate), mean, integral)


def _difference(own: float, limits: Swing, rate: float) -> PhaseAngle:
    """phi - psi, which grows at the rate own + (b - a)/(1 - u), where 1 - u = (1 - u1)(1 - n sn^2)."""
    pole, (first, last) = limits.poles[0], limits.down
    if not pole:
        return PhaseAngle(own)
    n, rest = limits.width / first, last / first
    mean = n * float(complete(limits.complement, rest, 0.0, 1.0)) / limits.quarter
    return PhaseAngle(own + pole * (1 + mean) / first, pole / (first * rate), mean, partial(lag, n, rest))


def _leads(motion: HeavyMotion, omega: Floats, orientation: Floats) -> tuple[complex, complex]:
    """The factors of the two pairs of components of the quaternion that make the motion begin as it does.

    Where a pair passes through zero then, as the axis is at the vertical, its factor follows from omega; but
    not where the axis lingers there.
    """
    q0, q1, q2, q3 = orientation.tolist()
    cosine, sine, across = (complex(part[0]) for part in motion.parts(np.zeros(1)))
    first, last = _unit(complex(q0, q3), cosine), _unit(complex(q1, q2), sine)
    velocity = complex(omega[1], omega[0])
    if abs(sine) * motion.rate < PASSING * abs(velocity):
        last = _unit(across * first, velocity)
    elif abs(cosine) * motion.rate < PASSING * abs(velocity):
        first = _unit(velocity, across / last)
    return first, last


def _unit(wanted: complex, computed: complex) -> complex:
    """The factor of length 1 that turns the computed number to the wanted one; 1 where either is zero."""
    return wanted / computed / abs(wanted / computed) if wanted and computed else 1


def sensitivity(
    lambda1: float, lambda3: float, weight_moment: float, omega: Floats, orientation: Floats, times: Floats
) -> float:
    """How far (rad, at most pi) the attitude moves when the numbers given change by their rounding.

    The largest over `times` (n, s), or some of them: see `rotation.to_rounding`.
    """
    sample, inputs = representative(times), [lambda1, lambda3, weight_moment, *omega, *orientation]

    def motion(values: Sequence[Any]) -> HeavyMotion:
        first, third, weight = map(float, values[:3])
        return heavy_motion(first, third, weight, np.array(values[3:6]), np.array(values[6:]))

    given = motion(inputs)
    # Time at the top goes as log(1/k'). There several roundings may change k'^2 by a large part of it: what
    # they do is no measure of what one does.
    ulps = 1 if given.limits.complement < 1e-6 else ULPS_MOVED
    orientations = given.at(sample)[1][None]
    return float(to_rounding(lambda moved: motion(moved).at(sample)[1][None], inputs, orientations, ulps)[0])
