"""Torque-free motion of a rigid body: Euler's equations without a torque, and the attitude, in closed form.

The body moves about its centre of mass, or about a fixed point at which every outer force acts. Its omega is
constant, or it circulates about the axis of the largest or of the smallest moment: see `core.circulation`.
Many motions of one body are the same formulas over a first axis of arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.circulation import COUPLED_NOISE, Circulation, State, circulations
from rigidcli.core.principal import EQUAL_MOMENTS
from rigidcli.core.rotation import compose, continuous, inverse
from rigidcli.core.sensitivity import representative, to_rounding
from rigidcli.core.tensor import ROUNDING_OF_SUM, without_rounding
from rigidcli.errors import ComputationError

Regime: TypeAlias = Literal[
    "rest",
    "sphere",
    "principal",
    "linear",
    "oblate",
    "prolate",
    "about_lowest",
    "about_highest",
    "separatrix",
]

SAMPLES_AT_ONCE = 8192
"""Samples that are worked at a time, so that their arrays stay in the cache of a processor."""


@dataclass(frozen=True, slots=True, eq=False)
class Periods:
    """What characterises a torque-free motion.

    `period` (s) is that of omega as seen in the body, None if omega is constant or the period is infinite.
    `flip_interval` (s) of an asymmetric body is half of it: the time in which the
    intermediate component of omega changes its sign. `mean_space_rate` (rad/s) is the mean rate at
    which the body turns about L; None at rest. Moments within EQUAL_MOMENTS of each other are classified as
    equal; the path uses the moments as given.
    """

    regime: Regime
    period: float | None
    flip_interval: float | None
    mean_space_rate: float | None


def periods(tensor: Floats, omega: Floats) -> Periods:
    """What characterises the motion from `omega` (3, rad/s) at t = 0 of a body with that `tensor` (kg m^2).

    Raises ComputationError for motion about an axis without a moment: of a linear body about its
    line, beyond rounding, and of a point.
    """
    state = State.of(tensor, omega[None])
    regime = _regime(state)
    speed, (low, middle, high), rates = float(state.speeds[0]), state.moments, state.rates[0]
    momentum = float(np.hypot.reduce(rates * state.moments)) * speed
    if regime == "rest":
        return Periods(regime, None, None, None)
    if regime == "separatrix":
        return Periods(regime, None, None, momentum / middle)
    if regime in ("oblate", "prolate"):
        # Of the two moments that count as equal, the mean is taken.
        along, across, spin = (high, low + middle, 2) if regime == "oblate" else (low, middle + high, 0)
        wobble = abs((2 * along - across) * float(rates[spin])) / across * speed
        return Periods(regime, 2 * math.pi / wobble if wobble else None, None, 2 * momentum / across)
    circling = circulation(tensor, omega)
    if regime not in ("about_lowest", "about_highest") or circling is None:
        return Periods(regime, None, None, float(np.hypot.reduce(rates)) * speed)
    flip = float(2 * circling.quarter[0, 0] / circling.rate[0, 0])
    period = 2 * flip if math.isfinite(flip) else None
    return Periods(regime, period, flip if period else None, float(circling.mean_rate[0, 0]))


def circulation(tensor: Floats, omega: Floats) -> Circulation | None:
    """The constants of the motion from `omega` (3), where it is not constant; else None."""
    state = State.of(tensor, omega[None])
    return next((motion for _, motion in circulations(state, ~state.steady(rounded=True))), None)


def _regime(state: State) -> Regime:
    """Which kind of motion it is."""
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
    slopes = abs(2 * high - middle) * high * third + (high * third + low * first) * middle
    slopes += abs(middle - 2 * low) * low * first
    noise = COUPLED_NOISE if state.coupled else EPS / 2
    if abs(excess) <= noise * (slopes + 2 * terms):
        return "separatrix"
    return "about_highest" if excess > 0 else "about_lowest"


@dataclass(frozen=True, slots=True)
class AxisStability:
    """Rotation about one principal axis.

    `rate_per_spin` is, in units of the spin, the frequency of a small wobble if `stable`, else the rate of
    its exponential growth. An axis whose moment equals another one is neutral: `stable` is None, and the rate
    0. Both are None for an axis without a moment of inertia.
    """

    stable: bool | None
    rate_per_spin: float | None


def about_axes(moments: Floats, groups: Sequence[Sequence[int]]) -> list[AxisStability]:
    """The stability of rotation about e1, e2, e3, from moments (3, ascending) and groups of equal ones.

    Linearising Euler's equations about the spin w along axis i gives
    x'' = -w^2 (I_i - I_j)(I_i - I_k) / (I_j I_k) x (L. Landau, E. Lifshitz, Mechanics, section 37). About
    an axis of equal moments the coefficient is zero, and nothing drives a deviation back or away.
    """
    equal = {index for group in groups if len(group) > 1 for index in group}
    stabilities = []
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        if moments[i] == 0:
            stabilities.append(AxisStability(None, None))
        elif i in equal:
            stabilities.append(AxisStability(None, 0.0))
        else:
            square = float((moments[i] - moments[j]) / moments[j] * ((moments[i] - moments[k]) / moments[k]))
            stabilities.append(AxisStability(square > 0, math.sqrt(abs(square))))
    return stabilities


def motions(
    tensor: Floats, omegas: Floats, orientations: Floats, times: Floats, *, rounded: bool = True
) -> tuple[Floats, Floats]:
    """omega (m, n, 3; rad/s, body axes) and orientation (m, n, 4; body to space) at `times` (n, s, any sign).

    The m motions begin at t = 0 with `omegas` (m, 3) and `orientations` (m, 4), unit quaternions, scalar
    first. All is along the axes of the `tensor` (3 by 3, kg m^2). The sign of the quaternions, which means
    nothing, is that of the orientation at t = 0 for the first time, and changes as little as possible from
    each time to the next. With `rounded`, an omega that may be along a principal axis but for
    rounding is constant.
    """
    state = State.of(tensor, omegas)
    steady = state.steady(rounded=rounded)
    omega = np.empty((len(omegas), len(times), 3))
    orientation = np.empty((len(omegas), len(times), 4))
    constant = np.flatnonzero(steady)
    if len(constant):
        omega[constant] = omegas[constant, None]
        orientation[constant] = _turning(omegas[constant], orientations[constant], times)
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

    The largest over `times` (n, s), or some of them: see `core.sensitivity`.
    """
    sample, tensor = representative(times), without_rounding(tensor)
    rows, columns = np.triu_indices(3)

    def moved(inputs: Sequence[Any]) -> Floats:
        entries = np.zeros((3, 3))
        entries[rows, columns] = entries[columns, rows] = inputs[:6]
        omegas = np.stack(inputs[6:], axis=-1)
        return motions(entries, omegas, orientations, sample, rounded=False)[1]

    inputs = [*tensor[rows, columns], *omegas.T]
    return to_rounding(moved, inputs, inputs, motions(tensor, omegas, orientations, sample)[1])
