"""Torque-free motion of a rigid body: Euler's equations without a torque, and the attitude, in closed form.

The body moves about its centre of mass, or about a fixed point at which every outer force acts. Its omega is
constant, or it circulates about the axis of the largest or of the smallest moment.

    a, b, c       principal axes, right-handed: omega circulates about c, the axis of the largest or of the
                  smallest moment, and b is the intermediate one
    Ia, Ib, Ic    moments about them (kg m^2); L angular momentum (kg m^2/s), T kinetic energy (J)
    wa, wb, wc    components of omega at t = 0 (rad/s), along axes whose signs make wa and wc >= 0
    a1, a2, a3    amplitudes of the components of omega (rad/s)
    cn, sn, dn    Jacobi's elliptic functions of the modulus k, with k' = sqrt(1 - k^2)
    u, u0, rate   their argument, its value at t = 0, and its rate of change (rad/s)
    phi, phi'     angle by which c has turned about L (rad), and its rate

    d2 = Ic (Ic-Ib) wc^2 - Ia (Ib-Ia) wa^2  (= L^2 - 2 T Ib)
    a1^2 = wa^2 + Ib (Ic-Ib)/(Ia (Ic-Ia)) wb^2,   a2^2 = wb^2 + Ia (Ic-Ia)/(Ib (Ic-Ib)) wa^2
    a3^2 = wc^2 + Ib (Ib-Ia)/(Ic (Ic-Ia)) wb^2,   omega = (a1 cn u, a2 sn u, a3 dn u),   u = rate t + u0
    k = sqrt(Ia (Ib-Ia)/(Ic (Ic-Ib))) a1/a3,      k' = sqrt(|d2|/(Ic |Ic-Ib|))/a3
    rate = sqrt((Ic-Ib) (Ic-Ia)/(Ia Ib)) a3,      n = Ic (Ib-Ia)/(Ia (Ic-Ib))

In space, c turns about the fixed L at the rate phi' = L (La^2/Ia + Lb^2/Ib)/(La^2 + Lb^2), so that

    phi = L t/Ib + L (Ib-Ia)/(Ia Ib rate) G(u),   G(u) = integral from 0 to u of cn^2/(1 + n sn^2)

Sources: L. Landau, E. Lifshitz, Mechanics, section 37; R. van Zon, J. Schofield, J. Comput. Phys. 225 (2007)
145. Where this differs: everything is formed of differences of moments, not of L^2 and 2 T I; k' is a number
of its own; signs are put into the axes, so that one formula serves both kinds of circulation; phi grows from
L t/Ib and not from L t/Ic, as then what is added stays moderate for slender and for nearly symmetric bodies.
Many motions of one body are the same formulas over a first axis of arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.elliptic import carlson_rf, complete, growth, jacobi, to_first_quarter
from rigidcli.core.principal import EQUAL_MOMENTS, principal_moments
from rigidcli.core.rotation import as_quaternion, compose, continuous, inverse, representative, to_rounding
from rigidcli.core.tensor import ROUNDING_OF_SUM, without_rounding
from rigidcli.errors import ComputationError

Regime: TypeAlias = (
    Literal["rest", "sphere", "principal", "linear", "oblate", "prolate", "about_lowest", "about_highest"]
    | Literal["separatrix"]
)

# Samples that are worked at a time, so that their arrays stay in the cache of a processor.
SAMPLES_AT_ONCE = 8192


class Periods(NamedTuple):
    """What characterises a torque-free motion; None for what it has not.

    `period` (s) is that of omega as seen in the body. `flip_interval` (s) of an asymmetric body is half of
    it: the time in which the intermediate component of omega changes its sign. `mean_space_rate` (rad/s) is
    the mean rate at which the body turns about L. Moments within EQUAL_MOMENTS of each other are classified
    as equal; the path uses the moments as given.
    """

    regime: Regime
    period: float | None = None
    flip_interval: float | None = None
    mean_space_rate: float | None = None


def periods(tensor: Floats, omega: Floats) -> Periods:
    """What characterises the motion from `omega` (3, rad/s) at t = 0 of a body with that `tensor` (kg m^2).

    Raises ComputationError for motion about an axis without a moment: of a linear body about its
    line, beyond rounding, and of a point.
    """
    state = State.of(tensor, omega[None])
    regime = _regime(state)
    (low, middle, high), rates = state.moments, state.rates[0] * state.speeds[0]
    momentum = float(np.hypot.reduce(rates * state.moments))
    if regime == "rest":
        return Periods(regime)
    if regime == "separatrix":
        return Periods(regime, mean_space_rate=momentum / middle)
    if regime in ("oblate", "prolate"):
        # Of the two moments that count as equal, the mean is taken.
        along, across, spin = (high, low + middle, 2) if regime == "oblate" else (low, middle + high, 0)
        wobble = abs((2 * along - across) * float(rates[spin])) / across
        return Periods(regime, 2 * math.pi / wobble if wobble else None, None, 2 * momentum / across)
    if regime in ("about_lowest", "about_highest"):
        path = circulation(tensor, omega)
        flip = float(2 * path.quarter[0, 0] / path.rate[0, 0])
        return Periods(regime, 2 * flip, flip, float(path.mean_rate[0, 0]))
    return Periods(regime, mean_space_rate=float(np.hypot.reduce(rates)))


def circulation(tensor: Floats, omega: Floats) -> Circulation:
    """The constants of the motion from `omega` (3), which is not constant."""
    [(_, path)] = circulations(State.of(tensor, omega[None]), np.array([True]))
    return path


def _regime(state: State) -> Regime:
    low, middle, high = state.moments
    if not state.rates.any():
        return "rest"
    if high <= 0:
        raise ComputationError(
            "a point has no moment of inertia, and no angular velocity follows from its angular momentum",
            hint="give a body with some extent, or set `omega` to zero",
        )
    if low <= 0:
        if abs(state.rates[0, 0]) > ROUNDING_OF_SUM * float(np.hypot.reduce(state.rates[0])):
            raise ComputationError(
                "the body is linear: it has no moment about its line, and cannot turn about it",
                hint="make `omega` perpendicular to the line",
            )
        return "linear"
    lower, upper = middle - low <= EQUAL_MOMENTS * high, high - middle <= EQUAL_MOMENTS * high
    if lower and upper:
        return "sphere"
    if state.steady(rounded=True)[0]:
        return "principal"
    if lower or upper:
        return "oblate" if lower else "prolate"
    excess, terms = (float(term[0]) for term in state.excess())
    # How far d2 moves, at worst, when each input is off by its rounding: that of a diagonal tensor as it is
    # given is half a unit in the last place, and the arithmetic of `excess` has as much.
    first, third = state.rates[0, [0, 2]] ** 2
    slopes = 2 * high * high * third + 2 * low * max(middle - low, low) * first
    noise = COUPLED_NOISE if state.coupled else EPS / 2
    if abs(excess) <= noise * (slopes + 2 * terms):
        return "separatrix"
    return "about_highest" if excess > 0 else "about_lowest"


def about_axes(moments: Floats, groups: Sequence[Sequence[int]]) -> list[tuple[bool | None, float | None]]:
    """Whether rotation about e1, e2, e3 is stable, each with the rate of a deviation in units of the spin.

    That is the frequency of a small wobble about a stable axis, and the rate of exponential growth about
    another one. An axis whose moment (of three, ascending) equals another one in `groups` is neutral: None,
    with the rate 0. Both are None for an axis without a moment of inertia.

    Linearising Euler's equations about the spin w along axis i gives
    x'' = -w^2 (I_i - I_j)(I_i - I_k) / (I_j I_k) x (L. Landau, E. Lifshitz, Mechanics, section 37). About
    an axis of equal moments the coefficient is zero, and nothing drives a deviation back or away.
    """
    equal = {index for group in groups if len(group) > 1 for index in group}
    found: list[tuple[bool | None, float | None]] = []
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        if moments[i] == 0 or i in equal:
            found.append((None, 0.0 if moments[i] else None))
        else:
            square = float((moments[i] - moments[j]) / moments[j] * ((moments[i] - moments[k]) / moments[k]))
            found.append((square > 0, math.sqrt(abs(square))))
    return found


def motions(
    tensor: Floats, omegas: Floats, orientations: Floats, times: Floats, *, rounded: bool = True
) -> tuple[Floats, Floats]:
    """omega (m, n, 3; rad/s, body axes) and orientation (m, n, 4; body to space) at `times` (n, s, any sign).

    The m motions begin at t = 0 with `omegas` (m, 3) and `orientations` (m, 4), unit quaternions, scalar
    first. All is along the axes of the `tensor` (3 by 3, kg m^2). The signs of the quaternions are continuous
    from t = 0 on. With `rounded`, an omega that is along a principal axis but for rounding is constant.
    """
    state = State.of(tensor, omegas)
    steady = state.steady(rounded=rounded)
    omega = np.empty((len(omegas), len(times), 3))
    orientation = np.empty((len(omegas), len(times), 4))
    if steady.any():
        omega[steady] = omegas[steady, None]
        orientation[steady] = _turning(omegas[steady], orientations[steady], times)
    for places, path in circulations(state, ~steady, max(1, SAMPLES_AT_ONCE // max(len(times), 1))):
        _, first = path.at(np.zeros(1))
        before = compose(orientations[places], inverse(compose(first[:, 0], path.frames)))
        # The products before * q * frame are linear in q: a matrix for each motion.
        placing = compose(compose(before[:, None], np.eye(4)), path.frames[:, None])
        for start in range(0, len(times), SAMPLES_AT_ONCE):
            part = slice(start, start + SAMPLES_AT_ONCE)
            omega[places, part], turned = path.at(times[part])
            orientation[places, part] = turned @ placing
    begun = np.concatenate([orientations[:, None], orientation], axis=1)
    return omega, continuous(begun)[:, 1:]


def _turning(omegas: Floats, orientations: Floats, times: Floats) -> Floats:
    """The orientations (m, n, 4) of motions with a constant omega."""
    speeds = np.hypot(np.hypot(*omegas.T[:2]), omegas.T[2])[:, None]
    half = (speeds * times / 2)[..., None]
    axis = omegas / np.where(speeds > 0, speeds, 1.0)
    return compose(orientations[:, None], np.concatenate([np.cos(half), np.sin(half) * axis[:, None]], -1))


def sensitivity(tensor: Floats, omegas: Floats, orientations: Floats, times: Floats) -> Floats:
    """How far (m, rad, at most pi) the attitude of each motion moves when tensor and omega are rounded.

    The largest over `times` (n, s), or some of them: see `rotation.to_rounding`.
    """
    sample, tensor = representative(times), without_rounding(tensor)
    rows, columns = np.triu_indices(3)

    def moved(inputs: Sequence[Any]) -> Floats:
        entries = np.zeros((3, 3))
        entries[rows, columns] = entries[columns, rows] = inputs[:6]
        omegas = np.stack(inputs[6:], axis=-1)
        return motions(entries, omegas, orientations, sample, rounded=False)[1]

    inputs = [*tensor[rows, columns], *omegas.T]
    return to_rounding(moved, inputs, motions(tensor, omegas, orientations, sample)[1])


COUPLED_NOISE = 8 * EPS  # The rounding error of a tensor that is not diagonal, in units of its largest entry.


class State(NamedTuple):
    """A body and the angular velocities at t = 0 of m motions.

    `moments` (3, ascending) are in units of the largest. `rates` (m, 3) are the components of omega along
    `axes` (rows), in units of `speeds` (m, rad/s), the largest component of each omega as it was given.
    `coupled` says that the tensor is not diagonal: then its axes are rounded.
    """

    moments: tuple[float, float, float]
    axes: Floats
    rates: Floats
    speeds: Floats
    coupled: bool

    @classmethod
    def of(cls, tensor: Floats, omegas: Floats) -> State:
        """From a tensor (3 by 3, kg m^2) and angular velocities (m, 3; rad/s) along the same axes."""
        tensor = without_rounding(tensor)
        moments, (first, second, _) = principal_moments(tensor)
        axes = np.array([first, second, np.cross(first, second)])
        low, middle, high = (moments / (moments[2] or 1.0)).tolist()
        speeds = np.abs(omegas).max(axis=1)
        speeds = np.where(speeds > 0, speeds, 1.0)
        coupled = bool((tensor != np.diag(tensor.diagonal())).any())
        return cls((low, middle, high), axes, omegas / speeds[:, None] @ axes.T, speeds, coupled)

    def excess(self) -> tuple[Floats, Floats]:
        """d2 = L^2 - 2 T I2 (m), and the sum of the two terms of which it is the difference."""
        low, middle, high = self.moments
        first, _, third = self.rates.T
        more, less = high * (high - middle) * third**2, low * (middle - low) * first**2
        return more - less, more + less

    def steady(self, *, rounded: bool) -> NDArray[np.bool_]:
        """Whether omega is constant (m): L x omega is zero, or may be so if the tensor is `rounded`.

        A tensor that is off turns its axes, so that each component of L x omega is off by as much.
        """
        low, middle, high = self.moments
        if low <= 0:
            return np.ones(len(self.rates), dtype=bool)
        noise = COUPLED_NOISE * high if rounded and self.coupled else 0.0
        square, constant = (self.rates**2).sum(axis=1), np.ones(len(self.rates), dtype=bool)
        for gap, i, j in ((high - middle, 1, 2), (high - low, 2, 0), (middle - low, 0, 1)):
            across = gap * np.abs(self.rates[:, i]) * np.abs(self.rates[:, j])
            constant &= across <= noise * square
        return constant


class Circulation(NamedTuple):
    """Motions in which omega circulates about one axis; the letters are those of the module's docstring.

    `axes` are the rows a, b, c in body axes, but for their signs in each motion. The quaternions `frames`
    (m, 4), whose signs mean nothing, turn the axes of the body to a, b, c. Per motion (m, 1): `start` is u0,
    `quarter` K, infinite on the separatrix; `mean_rate` is that of the turn about L (rad/s), `swing` is
    L (Ib-Ia)/(Ia Ib rate), and `mean_growth` the mean of G with u. `amplitudes` (m, 1, 3) are those of omega
    along `axes` (rad/s), `shares` (m, 1, 3) those of the unit vector along L along a, b, c.
    """

    axes: Floats
    frames: Floats
    amplitudes: Floats
    shares: Floats
    n: float
    k: Floats
    complement: Floats
    rate: Floats
    start: Floats
    quarter: Floats
    mean_rate: Floats
    swing: Floats
    mean_growth: Floats

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """omega (m, n, 3) in body axes, and quaternions (m, n, 4) from the axes a, b, c to those along L."""
        u, sign = to_first_quarter(self.rate * times + self.start, self.quarter)
        sn, cn, dn = jacobi(u, self.complement)
        angle = self.mean_rate * times
        if self.n:
            swaying = growth(self.n, self.k, self.complement, sn, cn, dn) - self.mean_growth * u
            angle = angle + self.swing * swaying
        turning = np.stack([sign * cn, sign * sn, dn], axis=-1)
        return self.amplitudes * turning @ self.axes, _along(self.shares * turning, angle)


def _circulation(state: State, about_low: bool) -> Circulation:
    (Ia, Ib, Ic), axes, rates, speeds, _ = state
    speeds = speeds[:, None]
    d = np.sqrt(np.abs(state.excess()[0]))[:, None]
    if about_low:
        turn = np.array([1, -1, 1])
        axes, rates, (Ia, Ib, Ic) = turn[:, None] * axes[::-1], turn * rates[:, ::-1], (Ic, Ib, Ia)
    c_sign = np.where(rates[:, 2] < 0, -1.0, 1.0)
    a_sign = np.where(rates[:, 0] < 0, -1.0, 1.0)
    # Euler's equations stay as they are after half a turn about an axis: two signs make the third.
    signs = np.stack([a_sign, a_sign * c_sign, c_sign], axis=-1)
    wa, wb, wc = (signs * rates).T[..., None]
    a1 = np.hypot(wa, math.sqrt(Ib / Ia * ((Ic - Ib) / (Ic - Ia))) * wb)
    a2 = np.hypot(wb, math.sqrt(Ia / Ib * ((Ic - Ia) / (Ic - Ib))) * wa) * (1 if Ic > Ib else -1)
    a3 = np.hypot(wc, math.sqrt(Ib / Ic * ((Ib - Ia) / (Ic - Ia))) * wb)
    k = math.sqrt(Ia / Ic * ((Ib - Ia) / (Ic - Ib))) * a1 / a3
    complement = np.minimum(d / math.sqrt(Ic * abs(Ic - Ib)) / a3, 1.0)
    n = Ic / Ia * ((Ib - Ia) / (Ic - Ib))
    rate = math.sqrt((Ic - Ib) / Ia * ((Ic - Ia) / Ib)) * a3
    amplitudes = np.stack([a1, a2, a3], axis=-1)
    momentum = np.sqrt(((rates * [Ia, Ib, Ic]) ** 2).sum(axis=1))[:, None]
    # Half a turn about a, b or c changes two signs.
    half_turns = np.where(a_sign < 0, np.where(c_sign < 0, 2, 3), np.where(c_sign < 0, 1, 0))
    quarter = np.where(complement > 0, complete(complement, 1.0, 1.0, 1.0), math.inf)
    mean_growth = complete(complement, 1 + n, 1.0, 0.0) / quarter
    swing = momentum * ((Ib - Ia) / Ia / Ib) / rate
    sn, cn, dn = wb / a2, wa / a1, wc / a3
    return Circulation(
        axes,
        compose(np.eye(4)[half_turns], as_quaternion(axes)),
        signs[:, None] * amplitudes * speeds[..., None],
        amplitudes * [Ia, Ib, Ic] / momentum[..., None],
        n,
        k,
        complement,
        rate * speeds,
        sn * carlson_rf(cn, dn, 1.0),
        quarter,
        (momentum / Ib + swing * rate * mean_growth) * speeds,
        swing,
        mean_growth,
    )


def _along(along: Floats, angle: Floats) -> Floats:
    """The quaternions (..., 4) from axes a, b, c to axes whose third is along L.

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


def circulations(
    state: State, moving: NDArray[np.bool_], most: int = 1
) -> Iterator[tuple[NDArray[np.int_], Circulation]]:
    """At most so many motions in which omega circulates at a time, about one axis: their places and paths."""
    excess, _ = state.excess()
    for about_low in (False, True):
        places = np.flatnonzero(moving & ((excess < 0) == about_low))
        for begin in range(0, len(places), most):
            chosen = places[begin : begin + most]
            part = state._replace(rates=state.rates[chosen], speeds=state.speeds[chosen])
            yield chosen, _circulation(part, about_low)
