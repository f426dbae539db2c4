"""Torque-free motion of a rigid body: Euler's equations without a torque, and the attitude, in closed form.

The body moves about its centre of mass, or about a fixed point at which every outer force acts. Its
omega is constant, or it follows a polhode (see `core.polhode`). Constants are worked out with 80 digits
from the exact values of the given floats, and times are reduced modulo the periods: the error is
that of the rounding of one period, however long the span, and the cost is that of the samples alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.high_precision import CONTEXT, PI, Cycle, decimals, norm
from rigidcli.core.pairs import rounded
from rigidcli.core.polhode import Circulation, Polhode, State, circulation, follow, polhode
from rigidcli.core.principal import EQUAL_MOMENTS
from rigidcli.core.rotation import compose, continuous
from rigidcli.core.sensitivity import representative, to_rounding
from rigidcli.core.tensor import ROUNDING, Inertia
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

EPS = Decimal(2) ** -52

TURNED_NOISE = 8 * EPS
"""The relative rounding error of a tensor that is not diagonal, or of an omega that was turned."""


@dataclass(frozen=True, slots=True, eq=False)
class Steady:
    """A constant omega (3, body axes, rad/s) along `axis` (3, unit), at `rate`, and `turn`, its period."""

    omega: Floats
    axis: Floats
    rate: float
    turn: Cycle
    orientation: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Periods:
    """What characterises a torque-free motion.

    `period` (s) is that of omega as seen in the body, None if omega is constant or the period is infinite.
    `flip_interval` (s) of an asymmetric body is half of it: the time in which the
    intermediate component of omega changes its sign. `mean_space_rate` (rad/s) is the mean rate at
    which the body turns about L; None at rest. Moments within EQUAL_MOMENTS of each other count as equal
    in all this, while the path is that of the moments as they are.
    """

    regime: Regime
    period: float | None
    flip_interval: float | None
    mean_space_rate: float | None


@dataclass(frozen=True, slots=True, eq=False)
class FreeMotion(Periods):
    """A torque-free motion, with its `path` for `at`."""

    path: Steady | Polhode


def periods(body: Inertia, omega: Floats) -> Periods:
    """What characterises the motion from a state at t = 0, which is as in `free_motion`."""
    with localcontext(CONTEXT):
        state = State.of(body, omega)
        regime = _regime(state)
        asymmetric = regime in ("about_lowest", "about_highest")
        return Periods(regime, *_periods(regime, state, circulation(state) if asymmetric else None))


def free_motion(body: Inertia, omega: Floats, orientation: Floats) -> FreeMotion:
    """The motion from a state at t = 0.

    The `body` is taken about the fixed point or the centre of mass. The motion is along the axes of its
    entries: so are `omega` (3, rad/s), and `orientation` (4), the unit quaternion, scalar first, from these
    axes to space.

    Raises ComputationError for motion about an axis without a moment: of a linear body about its
    line, beyond rounding, and of a point.
    """
    with localcontext(CONTEXT):
        state = State.of(body, omega)
        regime = _regime(state)
        is_steady = regime in ("rest", "linear", "principal") or _is_constant(state)
        motion = None if is_steady else circulation(state)
        path = _steady(omega, orientation) if motion is None else polhode(motion, orientation)
        return FreeMotion(regime, *_periods(regime, state, motion), path)


def at(motion: FreeMotion, times: Floats) -> tuple[Floats, Floats]:
    """omega (n by 3, rad/s, body axes) and orientation (n by 4, body to space) at `times` (n, s, any sign).

    The sign of the quaternions, which means nothing, is that of the orientation at t = 0 for
    the first time, and changes as little as possible from each time to the next.
    """
    omega, orientation = _evaluate(motion.path, times)
    start = _evaluate(motion.path, np.zeros(1))[1]
    return omega, continuous(np.concatenate([start, orientation]))[1:]


def sensitivity(body: Inertia, omega: Floats, orientation: Floats, times: Floats) -> float:
    """How far (rad, at most pi) the attitude moves when tensor and omega change by their rounding.

    The largest over `times` (n, s), or some of them: see `sensitivity.to_rounding`. Each component of an
    omega that was turned is off by a unit or two in the last place of |omega|, however small it is.
    """
    sample, tensor = representative(times), body.without_noise()
    upper = np.triu_indices(3)
    unit = 2 * FLOAT.hypot(*omega) if body.is_turned else 0.0
    given = np.ones(3) if unit else omega

    def orientations(values: Floats) -> Floats:
        changed = np.zeros((3, 3))
        changed[upper] = values[:6]
        changed.T[upper] = values[:6]
        rates = omega + (values[6:] - 1) * unit if unit else values[6:]
        with localcontext(CONTEXT):
            path = _path(State.of(replace(body, entries=changed), rates), rates, orientation)
        return _evaluate(path, sample)[1]

    _, reference = _evaluate(free_motion(body, omega, orientation).path, sample)
    return to_rounding(orientations, np.concatenate([tensor[upper], given]), reference)


def _regime(state: State) -> Regime:
    """Which kind of motion it is; within CONTEXT."""
    low, middle, high = state.moments
    speed = state.speed()
    if speed == 0:
        return "rest"
    if high <= 0:
        raise ComputationError(
            "a point has no moment of inertia, and no angular velocity follows from its angular momentum",
            hint="give a body with some extent, or set `omega` to zero",
        )
    if low <= 0:
        if abs(state.rates[0]) > Decimal(ROUNDING) * speed:
            raise ComputationError(
                "the body is linear: it has no moment about its line, and cannot turn about it",
                hint="make `omega` perpendicular to the line",
            )
        return "linear"
    gap = Decimal(EQUAL_MOMENTS) * high
    lower, upper = middle - low <= gap, high - middle <= gap
    if lower and upper:
        return "sphere"
    if _is_steady(state, rounded=True):
        return "principal"
    if lower or upper:
        return "oblate" if lower else "prolate"
    more, less = state.excess()
    if abs(more - less) <= _excess_noise(state):
        return "separatrix"
    return "about_highest" if more > less else "about_lowest"


def _is_steady(state: State, *, rounded: bool = False) -> bool:
    """Whether L x omega is 0, or may be so when what is `rounded` is off by that; within CONTEXT.

    A tensor turns its axes when it is off, and omega itself moves away from them, so that each component of
    L x omega is off in proportion to the difference of two moments.
    """
    low, middle, high = state.moments
    tensor = TURNED_NOISE * high if rounded and state.coupled else Decimal(0)
    omega = TURNED_NOISE / 2 if rounded and state.turned else Decimal(0)
    gaps = (high - middle, high - low, middle - low)
    square = state.speed() ** 2
    return all(abs(x) <= (tensor + omega * gap) * square for x, gap in zip(state.torque(), gaps, strict=True))


def _excess_noise(state: State) -> Decimal:
    """How far d2 = L^2 - 2 T I2 moves, at worst, when each input is off by its rounding; within CONTEXT.

    The rounding is half a unit in the last place of what was given, and a few of a tensor that was computed.
    """
    I1, I2, I3 = state.moments
    w1, _, w3 = (rate * rate for rate in state.rates)
    more, less = state.excess()
    slopes = abs(2 * I3 - I2) * I3 * w3 + (I3 * w3 + I1 * w1) * I2 + abs(I2 - 2 * I1) * I1 * w1
    noise: Decimal = (TURNED_NOISE if state.coupled or state.turned else EPS / 2) * (
        slopes + 2 * (more + less)
    )
    return noise


def _periods(
    regime: Regime, state: State, motion: Circulation | None
) -> tuple[float | None, float | None, float | None]:
    """The period of omega in the body (s), its half where that is the time from flip to flip, and the mean
    rate of the turn about L (rad/s); within CONTEXT."""
    low, middle, high = state.moments
    period, flip = math.inf, None
    if regime == "rest":
        return None, None, None
    if regime in ("oblate", "prolate"):
        # Of the two moments that count as equal, the mean is taken.
        along, across, spin = (high, low + middle, 2) if regime == "oblate" else (low, middle + high, 0)
        wobble = abs((2 * along - across) * state.rates[spin]) / across
        period = rounded(2 * PI / wobble) if wobble else math.inf
        rate = rounded(2 * state.momentum() / across)
    elif regime == "separatrix":
        rate = rounded(state.momentum() / middle)
    elif regime in ("about_lowest", "about_highest") and motion is not None:
        period, rate = 2 * rounded(motion.half), rounded(motion.mean_rate)
        flip = period / 2
    else:
        rate = rounded(state.speed())
    return (None, None, rate) if period == math.inf else (period, flip, rate)


def _path(state: State, omega: Floats, orientation: Floats) -> Steady | Polhode:
    """The motion of the body exactly as it is given, but for a linear one's line; within CONTEXT."""
    if _is_constant(state):
        return _steady(omega, orientation)
    return polhode(circulation(state), orientation)


def _is_constant(state: State) -> bool:
    """Whether omega is constant, the body being exactly as it is given; within CONTEXT."""
    return bool(state.moments[0] <= 0) or _is_steady(state)


def _steady(omega: Floats, orientation: Floats) -> Steady:
    """The motion with a constant omega; within CONTEXT."""
    exact = decimals(omega)
    speed = norm(exact)
    if speed == 0:
        return Steady(omega, np.zeros(3), 0.0, Cycle(math.inf, 0.0), orientation)
    axis = (exact / speed).astype(np.float64)
    return Steady(omega, axis, float(speed), Cycle.of(2 * PI / speed), orientation)


def _evaluate(path: Steady | Polhode, times: Floats) -> tuple[Floats, Floats]:
    """As `at`, with any sign of each quaternion."""
    if isinstance(path, Polhode):
        return follow(path, times)
    half = path.rate * path.turn.reduce(times)[1] / 2
    turned = np.column_stack([np.cos(half), np.sin(half)[:, None] * path.axis])
    return np.tile(path.omega, (len(times), 1)), compose(path.orientation, turned)
