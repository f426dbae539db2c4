"""The motion of the heavy symmetric top in closed form: omega and orientation at any time.

With u = cos(theta), 1 - u and 1 + u as in `swing`, in units of 1/s,

    a = lambda3 w3 / lambda1,   b = L_z / lambda1,   beta = 2 M g R / lambda1
    u'^2 = f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2,       u1 <= u2 <= 1 <= u3
    u = u1 + (u2 - u1) sn^2 v,     v = rate t + v0
    rate = sqrt(beta (u3 - u1))/2,     k'^2 = (u3 - u2)/(u3 - u1)
    (phi + psi)' = w3 - a + (b + a)/(1 + u),     (phi - psi)' = a - w3 + (b - a)/(1 - u)

Sources: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7; F. Klein, A. Sommerfeld, Über die
Theorie des Kreisels, for the sum and the difference of phi and psi. Their halves are the phases of
q0 + i q3 = cos(theta/2) exp(i (phi + psi)/2) and q1 + i q2 = sin(theta/2) exp(i (phi - psi)/2). Each has one
pole only, where the axis goes through the vertical and its component through zero, so that,
unlike with Euler angles, nothing is lost there.

Constants are worked out with 80 digits and times reduced modulo the periods, as in `polhode`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.core.elliptic import BLOCK, argument, carlson_rj, complete_first, complete_third, growth, jacobi
from rigidcli.core.high_precision import CONTEXT, PI, Cycle, decimals
from rigidcli.core.sensitivity import representative, to_rounding
from rigidcli.core.swing import Start, swing

Complexes: TypeAlias = NDArray[np.complex128]

PASSING = 1e-3
"""The axis is passing the vertical where it is there within this time, in units of 1/rate."""

TOUCHING = Decimal("1e-40")
"""A limit closer to the vertical than this goes through it: 1e-20 of the angle in a time of 1/rate."""


@dataclass(frozen=True, slots=True, eq=False)
class Phase:
    """An angle (rad): `mean` t, where `turn` is the period in which that grows by 4 pi, plus `swing` S(v).

    S is an integral of the third kind with parameter `n`, less its mean growth `growth` v.
    """

    mean: float
    turn: Cycle
    swing: float
    n: float
    growth: float


@dataclass(frozen=True, slots=True, eq=False)
class HeavyMotion:
    """The constants of the motion; the letters are those of the module's docstring.

    `down`, `up` and `turning` have 1 - u, 1 + u and b - a u at u1 and at u2; `width` is u2 - u1. `half` is
    half the period of sn, and `start` is v0 / rate (s). `total` is phi + psi and `difference` phi - psi, but
    for their values at t = 0: `leads` are the two factors exp(i/2 ...) that these make.
    """

    spin: float
    down: tuple[float, float]
    up: tuple[float, float]
    turning: tuple[float, float]
    width: float
    k: float
    complement: float
    rate: float
    start: float
    half: Cycle
    total: Phase
    difference: Phase
    leads: tuple[complex, complex] = (1, 1)


def heavy_motion(
    lambda1: float, lambda3: float, weight_moment: float, omega: Floats, orientation: Floats
) -> HeavyMotion:
    """The motion of a top with moments lambda1 across and lambda3 along its axis about the pivot (kg m^2).

    `weight_moment` is M g R > 0 (N m). `omega` (3, rad/s) and `orientation` (4, to axes of space with z
    upward) at t = 0 are in axes of the body, the third of which points from the pivot to the centre of mass.
    """
    with localcontext(CONTEXT):
        w1, w2, w3 = decimals(omega)
        q0, q1, q2, q3 = decimals(orientation)
        length = q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3
        down, up = 2 * (q1 * q1 + q2 * q2) / length, 2 * (q0 * q0 + q3 * q3) / length
        z1, z2 = 2 * (q1 * q3 - q0 * q2) / length, 2 * (q2 * q3 + q0 * q1) / length
        a = Decimal(lambda3) * w3 / Decimal(lambda1)
        beta = 2 * Decimal(weight_moment) / Decimal(lambda1)
        turning, slope, energy = w1 * z1 + w2 * z2, w2 * z1 - w1 * z2, w1 * w1 + w2 * w2
        found = swing(Start(a, beta, turning, slope, energy, down, up))
        low, high, complement = found.low, found.high, found.complement
        downs = down - low, _distance(down - high, (down - low) * complement * complement)
        ups = _distance(up + low, up + high), up + high
        rate, width = found.rise.sqrt() / 2, high - low
        motion = HeavyMotion(
            spin=float(w3),
            down=(float(downs[0]), float(downs[1])),
            up=(float(ups[0]), float(ups[1])),
            # At the vertical itself they are zero, which rounding must not hide.
            turning=(
                float(turning - a * low) if ups[0] else 0.0,
                float(turning - a * high) if downs[1] else 0.0,
            ),
            width=float(width),
            k=float((beta * width / found.rise).sqrt()),
            complement=float(complement),
            rate=float(rate),
            start=_start(low, high, slope, complement) / float(rate),
            half=Cycle.of(2 * complete_first(complement) / rate),
            total=_phase(w3 - a, turning + a * up, *ups, rate, complement),
            difference=_phase(a - w3, turning - a * down, *downs, rate, complement),
        )
    return replace(motion, leads=_leads(motion, omega, orientation))


def _distance(distance: Decimal, scale: Decimal) -> Decimal:
    """The `distance` of a limit from the vertical, in u, or 0 beside the `scale` of a passage through it."""
    return Decimal(0) if distance <= TOUCHING * scale else distance


def _start(low: Decimal, high: Decimal, slope: Decimal, complement: Decimal) -> float:
    """v0, within a quarter period of 0: where u is on its way from u1 = u0 + low to u2 = u0 + high."""
    if low == high:
        return 0.0
    s = (-low / (high - low)).sqrt().copy_sign(slope)
    c = (high / (high - low)).sqrt()
    d = (c * c + complement * complement * s * s).sqrt()
    return argument(s, c, d)


def _phase(
    constant: Decimal, numerator: Decimal, first: Decimal, last: Decimal, rate: Decimal, complement: Decimal
) -> Phase:
    """The phase that grows at the rate constant + numerator/d, where d is 1 + u or 1 - u.

    At u1 and u2 d is `first` and `last`. For 1 + u, d = first (1 + n sn^2), and S is `growth`; for 1 - u,
    d = first (1 - n sn^2), and S is `_lag`. A phase whose d goes to zero has no such term.
    """
    swing = n = mean = Decimal(0)
    if first and last and first <= last:
        n = last / first - 1
        mean = complete_third(complement, complement / (1 + n).sqrt())
        swing = numerator * n / (last * rate)
        constant += numerator * (1 + n * mean) / last
    elif first and last:
        n = 1 - last / first
        mean = n * first / last * complete_third(complement, (last / first).sqrt())
        swing = numerator / (first * rate)
        constant += numerator * (1 + mean) / first
    turn = Cycle.of(4 * PI / constant if constant else Decimal("inf"))
    return Phase(float(constant), turn, float(swing), float(n), float(mean))


def _leads(motion: HeavyMotion, omega: Floats, orientation: Floats) -> tuple[complex, complex]:
    """The factors of the two pairs of components of the quaternion that make the motion begin as it does.

    Of a pair that passes through zero then, as the axis is at the vertical, omega tells; not so where the
    axis lingers there.
    """
    q0, q1, q2, q3 = orientation
    cosine, sine, across = (complex(part[0]) for part in _parts(motion, np.zeros(1)))
    first, last = _unit(complex(q0, q3), cosine), _unit(complex(q1, q2), sine)
    velocity = complex(omega[1], omega[0])
    if abs(sine) * motion.rate < PASSING * abs(velocity):
        last = _unit(across * first, velocity)
    elif abs(cosine) * motion.rate < PASSING * abs(velocity):
        first = _unit(velocity, across / last)
    return first, last


def _unit(wanted: complex, found: complex) -> complex:
    """The factor of length 1 that turns what was found to what is wanted; 1 where either is zero."""
    return wanted / found / abs(wanted / found) if wanted and found else 1


def at(motion: HeavyMotion, times: Floats) -> tuple[Floats, Floats]:
    """omega (n by 3, rad/s) and orientation (n by 4), in the axes of `heavy_motion`, at `times` (n, s)."""
    omega, orientation = np.empty((len(times), 3)), np.empty((len(times), 4))
    first, last = motion.leads
    for begin in range(0, len(times), BLOCK):
        part = slice(begin, begin + BLOCK)
        cosine, sine, across = _parts(motion, times[part])
        cosine, sine, across = first * cosine, last * sine, first * np.conj(last) * across
        orientation[part] = np.column_stack([cosine.real, sine.real, sine.imag, cosine.imag])
        omega[part] = np.column_stack([across.imag, across.real, np.full(len(cosine), motion.spin)])
    return omega, orientation


def sensitivity(
    lambda1: float, lambda3: float, weight_moment: float, omega: Floats, orientation: Floats, times: Floats
) -> float:
    """How far (rad, at most pi) the attitude moves when the numbers given change by their rounding.

    The largest over `times` (n, s), or some of them: see `sensitivity.to_rounding`.
    """
    sample = representative(times)

    def orientations(values: Floats) -> Floats:
        first, third, weight, *rest = values
        changed = heavy_motion(first, third, weight, np.array(rest[:3]), np.array(rest[3:]))
        return at(changed, sample)[1]

    inputs = np.array([lambda1, lambda3, weight_moment, *omega, *orientation])
    return to_rounding(orientations, inputs, orientations(inputs))


def _parts(motion: HeavyMotion, times: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """q0 + i q3, q1 + i q2 and omega2 + i omega1 (each n), but for the leads.

    These are cos(theta/2) exp(i (phi + psi)/2), sin(theta/2) exp(i (phi - psi)/2) and
    (phi-dot sin(theta) + i theta-dot) exp(i psi).
    """
    halves, rest = motion.half.reduce(times, motion.start)
    v = motion.rate * rest
    sn, cn, dn = jacobi(v, motion.complement)
    cn = np.abs(cn)  # rounding may put v beyond a quarter period, where the integrals do not go
    total = _angle(motion.total, times, v, growth(motion.total.n, motion.k, motion.complement, sn, cn, dn))
    near = math.sqrt(motion.down[1] / motion.down[0]) if motion.down[0] else 0.0
    difference = _angle(motion.difference, times, v, _lag(motion.difference, near, sn, cn, dn))
    sign = 1 - 2 * np.mod(halves, 2)
    sn, cn = sign * sn, sign * cn
    # cos(theta/2) and sin(theta/2) in units of their largest values; they change sign at the vertical.
    low = math.sqrt(motion.up[0] / motion.up[1]) if motion.up[1] else 0.0
    rising, falling = np.hypot(sn, low * cn) if low else sn, np.hypot(cn, near * sn) if near else cn
    tilting = _tilting(motion, rising, falling, sn, cn, dn) * np.exp(0.5j * (total - difference))
    cosine = math.sqrt(motion.up[1] / 2) * rising * np.exp(0.5j * total)
    sine = math.sqrt(motion.down[0] / 2) * falling * np.exp(0.5j * difference)
    return cosine, sine, tilting


def _tilting(
    motion: HeavyMotion, rising: Floats, falling: Floats, sn: Floats, cn: Floats, dn: Floats
) -> Complexes:
    """phi-dot sin(theta) + i theta-dot = (b - a u - i u-dot)/sin(theta): zeros cancel in the quotients."""
    scale = math.sqrt(motion.down[0] * motion.up[1])
    if not scale:
        return np.zeros(len(sn), dtype=complex)
    down, up = (cn / falling if motion.down[1] else 1.0), (sn / rising if motion.up[0] else 1.0)
    turning: Complexes = np.zeros(len(sn), dtype=complex)
    if motion.turning[0]:
        turning += motion.turning[0] * down * (cn / rising)
    if motion.turning[1]:
        turning += motion.turning[1] * up * (sn / falling)
    turning = turning - 2j * motion.width * motion.rate * dn * down * up
    return turning / scale


def _angle(phase: Phase, times: Floats, v: Floats, integral: Floats) -> Floats:
    """The angle at `times`, but for whole 4 pi."""
    angle: Floats = phase.mean * phase.turn.reduce(times)[1] + phase.swing * (integral - phase.growth * v)
    return angle


def _lag(phase: Phase, near: float, sn: Floats, cn: Floats, dn: Floats) -> Floats:
    """The integral of n sn^2/(1 - n sn^2) from 0 to v, (n/3) sn^3 R_J(cn^2, dn^2, 1, 1 - n sn^2).

    DLMF 19.25.14; `near`^2 is 1 - n.
    """
    if not phase.swing:
        return np.zeros_like(sn)
    third = carlson_rj(cn, dn, np.ones_like(sn), np.hypot(cn, near * sn))
    integral: Floats = phase.n / 3 * sn**3 * third
    return integral
