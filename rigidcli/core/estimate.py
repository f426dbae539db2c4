"""What an integrator may step over, and how many digits of its solution are right.

An integrator looks at the equations at a few times in a step. A pulse, a wall or a jump hides between them.
It is where the argument of a function passes zero, as x does in tanh(x/w), or is largest or smallest, as
-(x/w)^2 in exp(-(x/w)^2). Where this argument depends on the time alone, it is looked at before the start,
and a step ends there: its last slope shows what is sudden, and the error of the step makes the next ones
short. Where the argument depends on the motion, a second solution has such steps, and differs from the first.

This second solution has a larger tolerance, too. The digits that both share are right. Where they share few,
a third is compared with the second, and so on, until two have found the same walls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import MOST_STEPS, Flow, Solution, Stopped, TooManySteps
from rigidcli.errors import ComputationError

TO_A_FLOAT = 11
"""Rounds in which a place is narrowed down beyond the digits of a float."""

ENDS = (0.0, 0.02, 0.04, 0.96, 0.98, 1.0)
"""Places in a step, near its ends, in units of its length."""

POLYNOMIALS = np.linalg.inv(np.vander(ENDS, increasing=True))
"""The coefficients (rows) of Lagrange's polynomials of these places (columns)."""

MISSED = 1e-5
"""The difference of two solutions, in units of their size, from which on one may have missed a wall."""

MOST_TURNS = 24
"""The most solutions that are compared, one with the next: each may find another wall."""

PROGRESS = 0.05
"""By how much of the span two solutions must agree for longer than the two before, or no wall was missed."""

Indices: TypeAlias = NDArray[np.int_]


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
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
    if len(places) > MOST_STEPS:
        raise TooManySteps(name, 0, 0.0, end, MOST_STEPS)
    return places, longest


def _grid(count: int, end: float) -> Floats:
    # So uneven a beginning leaves no extremum between two equal values.
    return np.concatenate([[0.0], (np.arange(count) + 0.381966) * (end / count), [end]])


def columns(flow: Flow) -> Callable[..., Floats]:
    """The values of a flow (m by k) as a function of times (k) and variables (k), NaN where there is none."""
    f = flow(np)

    def values(times: Floats, *state: Floats) -> Floats:
        with np.errstate(all="ignore"):
            rows = f(times, *state)
        return np.array([np.broadcast_to(row, times.shape) for row in rows]).reshape(len(rows), *times.shape)

    return values


def landmarks(
    values: Callable[[Floats], Floats], grid: Floats, most: int = MOST_STEPS, rounds: int = TO_A_FLOAT
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

    Beside them are times at which the value differs by about 1, as the slope of a peak is zero at its top.
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
    near = solution.sample((knots[far, None] + steps[far, None] * ENDS).ravel()).reshape(
        len(far), len(ENDS), -1
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
        powers = share[:, None] ** np.arange(len(ENDS))
        return values(times, *np.einsum("ki,kij->jk", powers @ POLYNOMIALS, near[place]))

    # A time is as uncertain as the solution is: fewer rounds reach its digits.
    found = (landmarks(along, grid(np.sort(order[:256])), 32, 7), landmarks(between, grid(far), 32, 7))
    return np.concatenate(found)


def compared(
    first: Solution,
    again: Callable[[float, Sequence[float]], Solution],
    watched: Watched,
    stops: Floats,
    distance: Callable[[Floats, Floats], Floats],
    times: Floats,
) -> tuple[Solution, float, float | None]:
    """The `first` solution or a better one, its error at `times` (k), and when it loses its last digit.

    `again` solves the problem of the `first` to a tolerance, in steps that end at given times, among which
    are the `stops` of the first. The error is the largest difference from a second solution, to a hundred
    times the tolerance, or a hundredth where this would be too crude. `distance` gives how far states
    (k by n) are from each other, in units of their size or in rad: from 0.1 on they share no digit.

    Where the second differs by more than MISSED, the first may have gone over a wall. Then a third solution,
    to the first tolerance, also stops where the second has found something narrow, and takes the place of
    the first if it is nearer to the second; and so on, wall by wall.
    """
    if not first.steps:
        return first, 0.0, None
    coarse = first.tolerance * (100 if first.tolerance <= 1e-5 else 0.01)
    looks = np.linspace(times[0], times[-1], 257)
    best, error, lost, reached = first, 1.0, None, 0.0
    before, places = first, {*stops.tolist()}
    for turn in range(MOST_TURNS):
        more = {*walls(watched, before).tolist()} - places
        if turn and not more:
            break
        places |= more
        try:
            after = again(first.tolerance if turn % 2 else coarse, sorted(places))
        except ComputationError as stop:
            if not turn:
                lost = stop.time if isinstance(stop, Stopped) else float(times[0])
            break
        apart = np.nan_to_num(distance(before.at(times), after.at(times)), nan=1.0)
        far, now = np.flatnonzero(apart > 0.1), float(apart.max(initial=0.0))
        if turn or now > MISSED:
            on_the_way = np.nan_to_num(distance(before.at(looks), after.at(looks)), nan=1.0)
            until = float(looks[max(1, int(np.argmax(np.append(on_the_way, 1.0) > 0.1))) - 1])
            if turn and not (now < error / 10 or until > reached + PROGRESS * times[-1]):
                break
            reached = until
        best, error = after if turn % 2 else best, 1.0 if len(far) else now
        lost = float(times[far[0]]) if len(far) else None
        # Other methods have the same steps again, whatever the tolerance, and would agree with themselves.
        if error <= MISSED or first.engine != "runge-kutta":
            break
        before = after
    return best, error, lost


def rounding(solution: Solution, stops: Floats) -> float:
    """The error of a solution by rounding, which a second one has, too, in units of its size.

    In each step it is of either sign; and at each stop, a sudden change comes a few units in the last place
    too early or too late.
    """
    return EPS * (math.sqrt(solution.steps) + 4 * len(stops))


def unshared(section: str, lost: float, may_be_chaotic: bool) -> str:
    """The note on a solution that another one leaves at the time `lost`."""
    reason = "the motion may be chaotic, or " if may_be_chaotic else ""
    return (
        f"from t = {lost:.4g} on, integrations in other steps do not agree, and no digit is certain: "
        f"{reason}steps may go over something narrow, which a small `{section}.max_step` prevents"
    )
