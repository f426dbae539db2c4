"""The closed form of torque-free motion in which omega circulates, seen in the body, and of the separatrix.

In principal axes a, b, c (right-handed), of which c is the axis of largest or of smallest moment round
which omega circulates, and b the intermediate one, with w_a >= 0 and w_c >= 0 at t = 0:

    A = Ib (Ic-Ib) wb^2 + Ia (Ic-Ia) wa^2,      B = Ib (Ib-Ia) wb^2 + Ic (Ic-Ia) wc^2
    d2 = Ic (Ic-Ib) wc^2 - Ia (Ib-Ia) wa^2  (= L^2 - 2 T Ib)
    k^2 = (Ib-Ia) A / ((Ic-Ib) B),      k'^2 = (Ic-Ia) d2 / ((Ic-Ib) B),      n = Ic (Ib-Ia) / (Ia (Ic-Ib))
    omega = (a1 cn u, a2 sn u, a3 dn u),  u = rate t + u0,  rate^2 = (Ic-Ib) B / (Ia Ib Ic)

In space, c turns about the fixed L at the rate phi' = L (La^2/Ia + Lb^2/Ib) / (La^2 + Lb^2), so that

    phi = L t / Ib + L (Ib-Ia) / (Ia Ib rate) G(u),      G(u) = integral from 0 to u of cn^2 / (1 + n sn^2)

Sources: L. Landau, E. Lifshitz, Mechanics, section 37; R. van Zon, J. Schofield, J. Comput. Phys. 225
(2007) 145. Where this differs: d2, A and B are formed of differences of moments, not of L^2 and 2 T I; k'
is a number of its own; signs are put into the axes, so that one formula serves both kinds of
circulation; phi grows from L t / Ib and not from L t / Ic, as then what is added stays moderate for slender
and for nearly symmetric bodies too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.elliptic import BLOCK, argument, complete_first, complete_third, growth, jacobi
from rigidcli.core.high_precision import PI, Cycle, Decimals, norm, principal_axes
from rigidcli.core.pairs import Long, exactly, rounded
from rigidcli.core.rotation import as_quaternion, compose
from rigidcli.core.tensor import Inertia

VANISHING = Decimal("1e-60")
"""A sum below this, in units of its terms, is zero: the rest is the rounding of 80 digits."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A body (tensor, kg m^2) and its omega (rad/s) in body axes, exactly; `axes` are rows of principal axes.

    `rates` are the components of omega along them. The least moment is zero where it may be rounding alone.
    `coupled` says that the tensor is not diagonal, and `turned` that omega was given along other axes: then
    these are rounded. All of this is to be called within CONTEXT.
    """

    tensor: Decimals
    omega: Decimals
    moments: Decimals
    axes: Decimals
    rates: Decimals
    coupled: bool
    turned: bool

    @classmethod
    def of(cls, body: Inertia, omega: Floats) -> State:
        """From a `body` and its `omega` (3), both along the axes of its entries; many at once as pairs."""
        tensor = body.without_noise()
        exact, w = exactly(tensor), exactly(omega)
        moments, axes = principal_axes(exact)
        if rounded(moments[0]) <= body.noise_along(axes[0].astype(np.float64)):
            moments[0] = Decimal(0)
        coupled = bool((tensor != np.diag(tensor.diagonal())).any())
        return cls(exact, w, moments, axes, axes @ w, coupled, body.is_turned)

    def speed(self) -> Long:
        """|omega| (rad/s)."""
        return norm(self.omega)

    def momentum(self) -> Long:
        """|L| (kg m^2/s)."""
        return norm(self.moments * self.rates)

    def excess(self) -> tuple[Long, Long]:
        """The two terms of which d2 = L^2 - 2 T I2 (kg^2 m^4/s^2) is the difference."""
        low, middle, high = self.moments
        first, _, third = self.rates
        return high * (high - middle) * third * third, low * (middle - low) * first * first

    def torque(self) -> Decimals:
        """L x omega along the principal axes (kg m^2/s^2); omega is constant where it vanishes."""
        # A product of differences, unlike the cross product, is exactly zero where two moments are equal.
        (I1, I2, I3), (w1, w2, w3) = self.moments, self.rates
        return np.array([(I2 - I3) * w2 * w3, (I3 - I1) * w3 * w1, (I1 - I2) * w1 * w2])


@dataclass(frozen=True, slots=True, eq=False)
class Polhode:
    """The constants of a motion in which omega circulates; the letters are those of the module's docstring.

    `axes` are the rows a, b, c in body axes; `amplitudes` (a1, a2, a3) are those of omega, and `shares` those
    of the unit vector along L. `start` is u0 / rate (s). `half` is half the period of omega, and
    `turn` the period of the mean turn about L, at `mean_rate`. `swing` is L (Ib-Ia) / (Ia Ib rate), and
    `mean_growth` that of G with u. `placing` (4 by 4) takes the quaternion (a row) from the axes a, b, c
    to those along L to the quaternion from body to space. Several motions about the same axes have columns
    (m by 1) in place of numbers, but for n.
    """

    axes: Floats
    amplitudes: Floats
    shares: Floats
    k: Any
    complement: Any
    n: float
    rate: Any
    start: Any
    half: Cycle
    turn: Cycle
    mean_rate: Any
    swing: Any
    mean_growth: Any
    placing: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Circulation:
    """The constants of a motion with all their digits, about `axes` (rows a, b, c) with these `moments`.

    `start` has sn, cn and dn at t = 0, and `momentum` is |L|; for the others see `Polhode`.
    """

    axes: Decimals
    moments: Decimals
    amplitudes: Decimals
    start: tuple[Long, Long, Long]
    momentum: Long
    k: Long
    complement: Long
    n: Long
    rate: Long
    swing: Long
    mean_growth: Long

    @property
    def half(self) -> Long:
        """Half the period of omega (s), infinite on the separatrix."""
        return 2 * complete_first(self.complement) / self.rate

    @property
    def mean_rate(self) -> Long:
        """The mean rate of the turn about L (rad/s)."""
        return self.momentum / self.moments[1] + self.swing * self.rate * self.mean_growth


def circulation(state: State) -> Circulation:
    """The constants of the motion from `state`, in which omega is not constant; within CONTEXT."""
    axes, moments, (wa, wb, wc), d2 = _circulation(state)
    Ia, Ib, Ic = moments
    A = Ib * (Ic - Ib) * wb * wb + Ia * (Ic - Ia) * wa * wa
    B = Ib * (Ib - Ia) * wb * wb + Ic * (Ic - Ia) * wc * wc
    k = ((Ib - Ia) * A / ((Ic - Ib) * B)).sqrt()
    complement = ((Ic - Ia) * d2 / ((Ic - Ib) * B)).sqrt()
    n = Ic * (Ib - Ia) / (Ia * (Ic - Ib))
    rate = ((Ic - Ib) * B / (Ia * Ib * Ic)).sqrt()
    a1 = (A / (Ia * (Ic - Ia))).sqrt()
    a2 = (A / (Ib * (Ic - Ib))).sqrt()
    a2 = -a2 if Ic < Ib else a2
    a3 = (B / (Ic * (Ic - Ia))).sqrt()
    momentum = state.momentum()
    swing = momentum * (Ib - Ia) / (Ia * Ib * rate)
    mean_growth = complete_third(complement, complement / (1 + n).sqrt())
    start, amplitudes = (wb / a2, wa / a1, wc / a3), np.array([a1, a2, a3])
    return Circulation(axes, moments, amplitudes, start, momentum, k, complement, n, rate, swing, mean_growth)


def polhode(motion: Circulation, orientation: Floats) -> Polhode:
    """The motion with these constants, and from this `orientation` (4); within CONTEXT."""
    rate, mean_rate = float(motion.rate), motion.mean_rate
    free = Polhode(
        axes=motion.axes.astype(np.float64),
        amplitudes=motion.amplitudes.astype(np.float64),
        shares=(motion.moments * motion.amplitudes / motion.momentum).astype(np.float64),
        k=float(motion.k),
        complement=float(motion.complement),
        n=float(motion.n),
        rate=rate,
        start=argument(*motion.start) / rate,
        half=Cycle.of(motion.half),
        turn=Cycle.of(2 * PI / mean_rate),
        mean_rate=float(mean_rate),
        swing=float(motion.swing),
        mean_growth=float(motion.mean_growth),
        placing=np.eye(4),
    )
    frame = as_quaternion(free.axes)
    _, initial = follow(free, np.zeros(1))
    before = compose(orientation, compose(initial[0], frame) * [1, -1, -1, -1])
    return replace(free, placing=compose(compose(before, np.eye(4)), frame))


def _circulation(state: State) -> tuple[Decimals, Decimals, Decimals, Long]:
    """The axes a, b, c, the moments and the components of omega along them, and d2 (see the module)."""
    more, less = state.excess()
    d2 = more - less
    if abs(d2) <= VANISHING * (more + less):
        d2 = Decimal(0)
    axes, moments, rates = state.axes, state.moments, state.rates
    if d2 < 0:
        signs = np.array([1, -1, 1])
        axes, moments, rates = signs[:, None] * axes[::-1], moments[::-1], signs * rates[::-1]
    # Euler's equations stay as they are after half a turn about b, and after one about c.
    for index, signs in ((2, np.array([-1, 1, -1])), (0, np.array([-1, -1, 1]))):
        if rates[index] < 0:
            axes, rates = signs[:, None] * axes, signs * rates
    return axes, moments, rates, d2


def follow(path: Polhode, times: Floats) -> tuple[Floats, Floats]:
    """omega (n by 3, body axes, rad/s) and orientation (n by 4, body to space) at `times` (n, s)."""
    omega, orientation = np.empty((len(times), 3)), np.empty((len(times), 4))
    for start in range(0, len(times), BLOCK):
        part = slice(start, start + BLOCK)
        circling, angle = circle(path, times[part])
        omega[part] = (path.amplitudes * circling) @ path.axes
        orientation[part] = along_momentum(path.shares * circling, angle) @ path.placing
    return omega, orientation


def circle(path: Polhode, times: Floats) -> tuple[Floats, Floats]:
    """cn, sn, dn of u (n by 3) and phi (n), but for whole turns and a constant, at `times` (n, s).

    The numbers of the path may also be arrays that are broadcast with the times.
    """
    halves, rest = path.half.reduce(times, path.start)
    u = path.rate * rest
    sn, cn, dn = jacobi(u, path.complement)
    swaying = (
        growth(path.n, path.k, path.complement, sn, np.abs(cn), dn) - path.mean_growth * u
        if np.any(path.swing)
        else 0.0
    )
    angle = path.mean_rate * path.turn.reduce(times)[1] + path.swing * swaying
    sign = 1 - 2 * np.mod(halves, 2)
    return np.stack([sign * cn, sign * sn, dn], axis=-1), angle


def along_momentum(along: Floats, angle: Floats) -> Floats:
    """The quaternions (..., 4) from axes a, b, c to axes of which the third is along L.

    `along` (..., 3) is the unit vector along L in the axes a, b, c, with its third component >= 0. The
    rotation is Rz(angle) Rx(theta) Rz(psi), with half angles formed so that a small theta keeps its digits.
    """
    x, y, z = np.moveaxis(along, -1, 0)
    across = np.hypot(x, y)
    c = np.sqrt((1 + z) / 2)
    s = across / (2 * c)
    psi = np.arctan2(x, y)
    total, difference = (angle + psi) / 2, (angle - psi) / 2
    return np.stack(
        [c * np.cos(total), s * np.cos(difference), s * np.sin(difference), c * np.sin(total)], axis=-1
    )
