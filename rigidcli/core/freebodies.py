"""Torque-free motions of one body from many starts at once, in the closed form of `core.polhode`.

What depends on the body alone is worked out once. The constants of each motion are formed of arrays, of
differences that are exact, with the digits of the longest float of the platform. Where that has 64 bits or
more, a motion agrees with that of `core.freebody` to some roundings over 1e3 turns. Motions near the
separatrix need all 80 digits, and are left to that module. A constant omega is a case of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import freebody
from rigidcli.core.arithmetic import Floats
from rigidcli.core.elliptic import BLOCK, carlson_rf, complete_third
from rigidcli.core.high_precision import CONTEXT, LONG, PI, Cycle, Decimals, decimals
from rigidcli.core.polhode import Polhode, State, along_momentum, circle
from rigidcli.core.rotation import angles_between, as_quaternion, compose, continuous
from rigidcli.core.sensitivity import LEAST
from rigidcli.core.tensor import Inertia
from rigidcli.errors import ComputationError

NEAR = 1e-5
"""A motion whose complementary modulus is less is near the separatrix, and needs the 80 digits."""

LONG_PI = LONG(float(PI)) + LONG(float(PI - Decimal(float(PI))))
"""Pi to the digits of the longest float."""

WITHIN = (1e-100, 1e100)
"""Moments (kg m^2) and products of moments and omega (kg^2 m^4/s^2) beyond which powers leave the floats."""

MANY_TURNS = 16
"""Where the parts of the rate about L are so many times larger than it, their sum needs the 80 digits."""

EPSILON = float(np.finfo(np.float64).eps)
"""The relative rounding of a float."""

EPS = float(np.finfo(LONG).eps)
"""The relative rounding of the longest float."""

Longs = NDArray[np.longdouble]


def motions(
    body: Inertia, omegas: Floats, orientations: Floats, times: Floats
) -> tuple[Floats, Floats, dict[int, ComputationError]]:
    """omega (m by n by 3, rad/s, body axes) and orientation (m by n by 4, body to space) at `times` (n, s).

    The m motions begin at t = 0 with `omegas` (m by 3) and `orientations` (m by 4); all else is as in
    `freebody.free_motion` and `freebody.at`. A start from which there is no motion has NaN; its error is
    told by its place.
    """
    count = len(omegas)
    omega = np.full((count, len(times), 3), np.nan)
    orientation = np.full((count, len(times), 4), np.nan)
    failures: dict[int, ComputationError] = {}
    with localcontext(CONTEXT):
        state = State.of(body, omegas[0])
        rates: Decimals = decimals(omegas) @ state.axes.T
        apart = _constant(state, rates)
    steady, circling = np.flatnonzero(apart), np.flatnonzero(~apart)
    left: list[int] = []
    if not WITHIN[0] < state.moments[0] <= state.moments[2] < WITHIN[1]:
        steady, circling, left = steady[:0], circling[:0], list(range(count))
    for places in _blocks(steady, len(times)):
        omega[places], orientation[places] = _turning(omegas[places], orientations[places], times)
    for places, path in _circulations(state, rates, circling, left):
        placed = _placed(path, orientations[places])
        for part in _blocks(np.arange(len(places)), len(times)):
            omega[places[part]], turned = _along(path, part, times)
            orientation[places[part]] = turned @ placed[part]
    for place in left:
        try:
            motion = freebody.free_motion(body, omegas[place], orientations[place])
            omega[place], orientation[place] = freebody.at(motion, times)
        except ComputationError as error:
            failures[place] = error
    begun = np.concatenate([orientations[:, None], orientation], axis=1)
    return omega, continuous(begun)[:, 1:], failures


def sensitivity(body: Inertia, omegas: Floats, orientations: Floats, times: Floats) -> Floats:
    """`freebody.sensitivity` of each motion (m, rad); NaN where there is none."""
    tensor = body.without_noise()
    unit = 2 * np.linalg.norm(omegas, axis=1) * EPSILON if body.is_turned else np.zeros(len(omegas))
    _, reference, _ = motions(body, omegas, orientations, times)
    squares = np.zeros(reference.shape[:2])

    def add(changed: Inertia, rates: Floats) -> None:
        _, moved, _ = motions(changed, rates, orientations, times)
        angles = angles_between(reference.reshape(-1, 4), moved.reshape(-1, 4))
        np.add(squares, angles.reshape(squares.shape) ** 2, out=squares)

    for row, column in zip(*np.triu_indices(3), strict=True):
        if tensor[row, column]:
            entries = tensor.copy()
            entries[row, column] = np.nextafter(
                entries[row, column], np.copysign(np.inf, tensor[row, column])
            )
            entries[column, row] = entries[row, column]
            add(replace(body, entries=entries), omegas)
    for axis in range(3):
        rates = omegas.copy()
        given = rates[:, axis]
        rates[:, axis] = np.where(
            unit > 0, given + unit, np.where(given, np.nextafter(given, np.copysign(np.inf, given)), given)
        )
        add(body, rates)
    errors: Floats = np.clip(np.sqrt(squares.max(axis=1)), LEAST, np.pi)
    return errors


def _blocks(places: NDArray[np.int_], size: int) -> Iterator[NDArray[np.int_]]:
    """Parts of the places such that their samples, of that number each, stay in the cache."""
    step = max(1, BLOCK // max(size, 1))
    for first in range(0, len(places), step):
        yield places[first : first + step]


def _constant(state: State, rates: Decimals) -> NDArray[np.bool_]:
    """Of which of the `rates` (m by 3, along principal axes) the omega is constant: L x omega is 0."""
    I1, I2, I3 = state.moments
    moving = np.zeros(len(rates), dtype=bool)
    for gap, i, j in ((I3 - I2, 1, 2), (I3 - I1, 2, 0), (I2 - I1, 0, 1)):
        if gap:
            moving |= (rates[:, i] != 0) & (rates[:, j] != 0)
    return ~moving


def _turning(omegas: Floats, orientations: Floats, times: Floats) -> tuple[Floats, Floats]:
    """The motions with a constant omega."""
    size = np.abs(omegas).max(axis=1, keepdims=True)
    unit = omegas.astype(LONG) / np.where(size > 0, size, 1.0)
    length = np.sqrt((unit * unit).sum(axis=1, keepdims=True))
    speed = length * size
    rests = speed[:, 0] == 0
    axis = np.divide(unit, length, out=np.zeros_like(unit), where=length > 0).astype(np.float64)
    period = _cycle(2 * LONG_PI / np.where(speed > 0, speed, 1))
    half = speed.astype(np.float64) * period.reduce(times)[1] / 2
    half[rests] = 0.0
    turned = np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * axis[:, None]], axis=-1)
    constant = np.broadcast_to(omegas[:, None], (*half.shape, 3))
    return constant, compose(orientations[:, None], turned)


def _circulations(
    state: State, rates: Decimals, circling: NDArray[np.int_], left: list[int]
) -> Iterator[tuple[NDArray[np.int_], Polhode]]:
    """The motions in which omega circulates, by the axes a, b, c: their places and constants (m by 1 each).

    Those that need more digits are added to what is `left`.
    """
    with localcontext(CONTEXT):
        I1, I2, I3 = state.moments
        squares = rates[circling] ** 2
        more, less = I3 * (I3 - I2) * squares[:, 2], I1 * (I2 - I1) * squares[:, 0]
        excess = _long(more - less)
        total = _long(more + less)
    own = _long(rates[circling])
    fit: NDArray[np.bool_] = (excess != 0) & (WITHIN[0] < total) & (total < WITHIN[1])
    is_low = (excess < 0).astype(bool)
    signs = np.sign(own[:, [0, 2]])
    signs[signs == 0] = 1
    for low in (False, True):
        for first in (1, -1):
            for last in (1, -1):
                chosen = (is_low == low) & (signs == (first, last)).all(axis=1) & fit
                if not chosen.any():
                    continue
                with localcontext(CONTEXT):
                    path = _polhodes(state, own[chosen], excess[chosen], (first, last), low=low)
                near: NDArray[np.bool_] = path.complement[:, 0] < NEAR
                left += circling[chosen][near].tolist()
                if not near.all():
                    yield circling[chosen][~near], _part(path, ~near)
    left += circling[~fit].tolist()


def _polhodes(state: State, rates: Longs, excess: Longs, signs: tuple[int, int], *, low: bool) -> Polhode:
    """The constants as `polhode.polhode` has them, as columns (m by 1), without the placing; within CONTEXT.

    The `signs` of the rates about the axes of least and greatest moment are the same for all.
    """
    flips = np.array([signs[0], signs[0] * signs[1], signs[1]])
    axes, moments, own = flips[:, None] * state.axes, state.moments, flips * rates
    if low:
        turn = np.array([1, -1, 1])
        axes, moments, own = turn[:, None] * axes[::-1], moments[::-1], turn * own[:, ::-1]
    exact_a, exact_b, exact_c = moments
    exact_n = exact_c * (exact_b - exact_a) / (exact_a * (exact_c - exact_b))
    Ia, Ib, Ic = _long(moments)
    cb, ca, ba = _long(np.array([exact_c - exact_b, exact_c - exact_a, exact_b - exact_a]))
    wa, wb, wc = own.T[:, :, None]
    d2 = excess[:, None]
    A = Ib * cb * wb * wb + Ia * ca * wa * wa
    B = Ib * ba * wb * wb + Ic * ca * wc * wc
    k, complement = np.sqrt(ba * A / (cb * B)), np.sqrt(ca * d2 / (cb * B))
    n = LONG(float(exact_n))
    rate = np.sqrt(cb * B / (Ia * Ib * Ic))
    a1, a3 = np.sqrt(A / (Ia * ca)), np.sqrt(B / (Ic * ca))
    a2 = np.copysign(np.sqrt(A / (Ib * cb)), cb)
    momentum = np.sqrt((Ia * wa) ** 2 + (Ib * wb) ** 2 + (Ic * wc) ** 2)
    swing = momentum * ba / (Ia * Ib * rate)
    kept = np.maximum(complement, LONG(NEAR))  # those below are worked elsewhere
    first, mean_growth = _complete(kept, kept / np.sqrt(1 + n))
    mean_rate = momentum / Ib + swing * rate * mean_growth
    for place in np.flatnonzero(swing * rate > MANY_TURNS * mean_rate):
        exact = (_decimal(kept[place, 0]), _decimal(kept[place, 0]) / (1 + exact_n).sqrt())
        mean_growth[place] = _long(np.array([complete_third(*exact)]))
        mean_rate[place] = momentum[place] / Ib + swing[place] * rate[place] * mean_growth[place]
    sn, cn, dn = (np.asarray(part, dtype=np.float64) for part in (wb / a2, wa / a1, wc / a3))
    amplitudes = np.stack([a1, a2, a3], axis=-1)
    single = np.float64
    return Polhode(
        axes=axes.astype(single),
        amplitudes=amplitudes.astype(single),
        shares=(np.stack([Ia, Ib, Ic]) * amplitudes / momentum[..., None]).astype(single),
        k=k.astype(single),
        complement=complement.astype(single),
        n=float(n),
        rate=rate.astype(single),
        start=sn * carlson_rf(cn, dn, np.ones_like(sn)) / rate.astype(single),
        half=_cycle(2 * first / rate),
        turn=_cycle(2 * LONG_PI / mean_rate),
        mean_rate=mean_rate.astype(single),
        swing=swing.astype(single),
        mean_growth=mean_growth.astype(single),
        placing=np.eye(4),
    )


def _complete(complement: Longs, p: Longs) -> tuple[Longs, Longs]:
    """`elliptic.complete_first` and `complete_third` of arrays > 0."""
    a: Longs = np.ones_like(p)
    g, q, total = complement, np.ones_like(p), np.ones_like(p)
    while (np.abs(a - g) > 4 * EPS * a).any() or (np.abs(q) > EPS).any():
        square, product = p * p, a * g
        q = q * (square - product) / (2 * (square + product))
        total = total + q
        p = (square + product) / (2 * p)
        a, g = np.asarray((a + g) / 2, dtype=LONG), np.sqrt(product)
    return np.asarray(LONG_PI / (a + g), dtype=LONG), total / 2


def _along(path: Polhode, part: NDArray[np.int_], times: Floats) -> tuple[Floats, Floats]:
    """omega in body axes, and the quaternions from the axes a, b, c to those along L, of some motions."""
    mine = _part(path, part)
    circling, angle = circle(mine, times)
    return (mine.amplitudes * circling) @ path.axes, along_momentum(mine.shares * circling, angle)


def _placed(path: Polhode, orientations: Floats) -> Floats:
    """The `placing` (m by 4 by 4) of motions that begin with these orientations (m by 4)."""
    frame = as_quaternion(path.axes)
    _, turned = _along(path, np.arange(len(orientations)), np.zeros(1))
    initial = turned[:, 0]
    before = compose(orientations, compose(initial, frame) * [1, -1, -1, -1])
    return compose(compose(before[:, None], np.eye(4)), frame)


def _part(path: Polhode, chosen: NDArray[np.int_] | NDArray[np.bool_]) -> Polhode:
    """The constants of some of the motions."""
    taken = {
        name: getattr(path, name)[chosen]
        for name in (
            *("amplitudes", "shares", "k", "complement", "rate", "start"),
            *("mean_rate", "swing", "mean_growth"),
        )
    }
    half, turn = (Cycle(cycle.high[chosen], cycle.low[chosen]) for cycle in (path.half, path.turn))
    return Polhode(axes=path.axes, n=path.n, half=half, turn=turn, placing=path.placing, **taken)


def _cycle(period: Longs) -> Cycle:
    """Periods to the digits that they have."""
    high = period.astype(np.float64)
    return Cycle(high, (period - high).astype(np.float64))


def _decimal(value: np.longdouble) -> Decimal:
    """A long float without rounding; within CONTEXT."""
    high = float(value)
    return Decimal(high) + Decimal(float(value - LONG(high)))


def _long(values: Decimals) -> Longs:
    """Decimals as the longest floats."""
    high = values.astype(np.float64)
    low = (values - decimals(high)).astype(np.float64)
    long: Longs = high.astype(LONG) + low
    return long
