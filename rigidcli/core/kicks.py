"""Kicks: pulses, walls and jumps, which an integrator may step over.

An integrator looks at the equations at a few times in a step, and a kick hides between them. It is where the
argument of a function passes zero, as x does in tanh(x/w), or is largest or smallest, as -(x/w)^2 in
exp(-(x/w)^2). Where this argument depends on the time alone, such times are found before the start, and a
step ends at each: its last slope shows the kick, and the error of the step makes the next ones short. Where
the argument depends on the motion, they are found along a solution, and a second solution has steps that end
there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import MOST_STEPS, Flow, Solution, TooManySteps, columns

ROUNDS_TO_A_FLOAT = 11  # Rounds in which a time is narrowed down beyond the digits of a float.
ROUNDS_TO_A_SOLUTION = 7  # Rounds in which a time is narrowed down to the digits of a solution.
NEAR_ENDS = (0.0, 0.02, 0.04, 0.96, 0.98, 1.0)  # Places in a step, near its ends, in units of its length.
# The coefficients (rows) of Lagrange's polynomials of these places (columns).
POLYNOMIALS = np.linalg.inv(np.vander(NEAR_ENDS, increasing=True))

Indices: TypeAlias = NDArray[np.int_]


class Watched(NamedTuple):
    """The arguments of functions in the equations, as flows.

    Something sudden may be where the `timed` ones, of the time alone, and the `moving` ones, of time and
    state, pass zero or turn. The `phases`, of the time alone, are arguments of sines and cosines.
    """

    timed: Flow
    phases: Flow
    moving: Flow


def foreseen(watched: Watched, end: float, name: str) -> tuple[Floats, float]:
    """Times from 0 to `end` at which something sudden may happen, and the longest step that sees all else.

    That step is a quarter of the shortest period of a sine or cosine of the time. The equations are looked at
    at 4,096 times at least, and at four in such a quarter.

    Raises TooManySteps where there are too many of either.
    """
    timed, phases = (columns(flow) for flow in (watched.timed, watched.phases))
    grid, longest = _grid(4096, end), math.inf
    for _ in range(2):  # a sine of a sine shows how fast it is when the inner one is resolved
        with np.errstate(all="ignore"):
            rates = np.abs(np.diff(phases(grid)) / np.diff(grid))
        rate = float(rates.max(initial=0.0, where=np.isfinite(rates)))
        longest = math.pi / 2 / rate if rate * end > math.pi / 2 else math.inf
        if end > MOST_STEPS * longest:
            raise TooManySteps(name, 0, 0.0, end, MOST_STEPS)
        grid = _grid(max(4096, math.ceil(4 * end / longest)), end)
    places = landmarks(timed, grid)
    if len(places):  # on either side of a peak that no time of the grid has seen, a value may pass zero
        places = landmarks(timed, np.sort(np.concatenate([grid, places])))
    if len(places) > MOST_STEPS:
        raise TooManySteps(name, 0, 0.0, end, MOST_STEPS)
    return places, longest


def _grid(count: int, end: float) -> Floats:
    # So uneven a beginning leaves no extremum between two equal values.
    return np.concatenate([[0.0], (np.arange(count) + 0.381966) * (end / count), [end]])


def landmarks(
    values: Callable[[Floats], Floats], grid: Floats, most: int = MOST_STEPS, rounds: int = ROUNDS_TO_A_FLOAT
) -> Floats:
    """The times at which one of the `values` (m by k at times k) passes zero, or is largest or smallest.

    They are looked for between the times of the `grid` (k, ascending), and narrowed down 30 times in each of
    so many `rounds`. Of more than `most` the ones where the grid is coarsest are taken.
    """
    at = values(grid)
    with np.errstate(all="ignore"):
        change = np.diff(at)
        passed = np.sign(at[:, 1:]) * np.sign(at[:, :-1]) < 0
        # Smaller changes are rounding errors, and no extremum.
        sharp = np.abs(change[:, 1:]) + np.abs(change[:, :-1]) > 1e-13 * np.abs(at[:, 1:-1])
        turned = (np.sign(change[:, 1:]) * np.sign(change[:, :-1]) < 0) & sharp
    rows, first = np.hstack([np.nonzero(passed), np.nonzero(turned)])
    # Where a quantity passes zero, its size is smallest; else it is largest, or its negative is.
    up = np.repeat([0.0, 1.0], [passed.sum(), turned.sum()]) * np.sign(change)[rows, first]
    last = first + 1 + (up != 0)
    best = np.argsort(grid[first] - grid[last], kind="stable")[:most]
    places = [_narrowed(values, rows[some], up[some], grid[first[some]], grid[last[some]], rounds)
              for some in np.array_split(best, 1 + len(best) // 2048)]  # fmt: skip
    times = np.array(sorted({*np.concatenate(places).tolist()}))  # `np.unique` loads masked arrays
    inside: Floats = times[(times > grid[0]) & (times < grid[-1])]
    return inside


def _narrowed(
    values: Callable[[Floats], Floats], rows: Indices, up: Floats, low: Floats, high: Floats, rounds: int
) -> Floats:
    """The times (k) between `low` and `high` at which `up` times a value is largest, or its size smallest.

    Also the flanks of each peak, where its value has changed by 1.
    """
    every = np.arange(len(rows))

    def chosen(times: Floats) -> Floats:
        return values(times.ravel())[rows[:, None], np.arange(times.size).reshape(times.shape)]

    begin, end = low, high
    for _ in range(rounds):
        times = np.linspace(begin, end, 64, axis=-1)
        value = chosen(times)
        place = np.nan_to_num(np.where(up[:, None] == 0, -np.abs(value), up[:, None] * value), nan=-np.inf)
        best = place.argmax(axis=1)
        begin, end = times[every, np.maximum(best - 1, 0)], times[every, np.minimum(best + 1, 63)]
    top, beside = times[every, best], []
    distances = 2.0 ** np.arange(12, -52, -1)  # in units of the way to the next time of the grid
    for side in (low, high):
        times = top[:, None] + (side - top)[:, None] * distances
        far = np.abs(chosen(times) - value[every, best][:, None]) >= 1
        nearest = len(distances) - 1 - far[:, ::-1].argmax(axis=1)
        beside.append(times[every, nearest][far.any(axis=1)])
    return np.concatenate([top, *beside])


def walls(watched: Watched, solution: Solution) -> Floats:
    """At most 64 times in the longest steps of a solution at which something sudden may happen.

    In 256 steps it is looked for along the solution, and in 16 along a polynomial through its states near
    both ends of the step, as a wall bends the solution beside it.
    """
    values, knots = columns(watched.moving), solution.knots
    if not len(values(knots[:1], *solution.sample(knots[:1]).T)):
        return np.empty(0)
    steps = np.diff(knots)
    order = np.argsort(-steps, kind="stable")
    far = np.sort(order[:16])
    near = solution.sample((knots[far, None] + steps[far, None] * NEAR_ENDS).ravel()).reshape(
        len(far), len(NEAR_ENDS), -1
    )

    def grid(places: Indices) -> Floats:
        inside = knots[places, None] + steps[places, None] * np.arange(8) / 8
        return np.append(inside.ravel(), knots[places[-1:] + 1])

    def along(times: Floats) -> Floats:
        times = np.clip(times, knots[0], knots[-1])
        return values(times, *solution.sample(times).T)

    def between(times: Floats) -> Floats:
        place = np.clip(np.searchsorted(knots[far], times, side="right") - 1, 0, len(far) - 1)
        share = np.minimum((times - knots[far[place]]) / steps[far[place]], 1.0)
        powers = share[:, None] ** np.arange(len(NEAR_ENDS))
        return values(times, *np.einsum("ki,kij->jk", powers @ POLYNOMIALS, near[place]))

    ways = (along, np.sort(order[:256])), (between, far)
    return np.concatenate([landmarks(way, grid(places), 32, ROUNDS_TO_A_SOLUTION) for way, places in ways])
