"""Where a function of the time and the state passes zero along a solution.

The function is evaluated at several times in each step, and at more of them near minima of its size, so that
it cannot pass zero and come back unseen. Each pass is then narrowed down by the signs at times in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import Solution

LOOKS_IN_A_STEP = 16  # Times in each step at which the function is evaluated at least.
MOST_LOOKS = 1 << 18  # Those in all steps in which the function is fast have no more times.
VALLEY_ROUNDS = 7  # Rounds in which a minimum of the size is narrowed down, each 8 times.
# Bits of the time by which a pass is narrowed down, and the times at which that is done at once at least:
# calls of numpy take longer than the arithmetic of fewer.
BITS_OF_A_PASS, LOOKS_AT_ONCE = 52, 64


class Events(NamedTuple):
    """The times of passes (k), whether each goes upwards, and the times (m) at which zero is only touched.

    The first time without a finite value is `gap`; None where there is none.
    """

    times: Floats
    upwards: NDArray[np.bool_]
    touched: Floats
    gap: float | None


def events(function: Callable[[Floats, Floats], Floats], solution: Solution, near: float) -> Events:
    """The zeros of a function of times (k) and states (k by n) along a solution.

    What comes `near` to zero, in units of its largest size, and goes back touches it, and does not pass; nor
    does a zero at the start. Of two passes a thousandth of a step apart none is missed.
    """

    def values(times: Floats) -> Floats:
        flat = times.ravel()
        return function(flat, solution.at(flat)).reshape(times.shape)

    grid, at = _looks(values, solution.knots)
    finite = np.isfinite(at)
    gap = None if finite.all() else float(grid[np.argmin(finite)])
    grid, at = grid[finite], at[finite]
    none = np.empty(0)
    if len(grid) < 2 or not np.any(at):
        return Events(none, none > 0, none, gap)
    near *= float(np.abs(at).max())
    # A zero has the sign of the value before it, or at the start that of the next.
    known = np.flatnonzero(np.abs(at) > 4 * EPS * np.abs(at).max())
    before = np.searchsorted(known, np.arange(len(at)), side="right") - 1
    signs = np.sign(at)[known[np.maximum(before, 0)]]
    places, least, depth = valleys(values, grid, at * signs, signs)
    is_touch = np.abs(depth) <= near
    # The start is no place where anything passes or touches.
    touched = least[is_touch & (least > grid[min(1, len(grid) - 1)])]
    twice = depth < -near
    before, after = grid[np.maximum(places - 1, 0)], grid[np.minimum(places + 1, len(grid) - 1)]
    passes = np.flatnonzero(signs[1:] != signs[:-1])
    low = np.concatenate([grid[passes], before[twice], least[twice]])
    high = np.concatenate([grid[passes + 1], least[twice], after[twice]])
    first = np.concatenate([signs[passes], signs[places[twice]], -signs[places[twice]]])
    times = _narrowed(values, low, high, first)
    # At a pole the function changes its sign, too, but is largest there.
    ends = np.maximum(np.abs(values(low)), np.abs(values(high)))
    is_pass = (np.abs(values(times)) <= ends) & (times > grid[0] + 1e-9 * (grid[1] - grid[0]))
    order = np.argsort(times[is_pass], kind="stable")
    return Events(times[is_pass][order], (first < 0)[is_pass][order], touched, gap)


def _looks(values: Callable[[Floats], Floats], knots: Floats) -> Floats:
    """Times in each step, ascending, and the values there (2 by k).

    They are more where the function turns, and every second one of them does not show it, or turns often.
    """
    low, high, looks = knots[:-1], knots[1:], LOOKS_IN_A_STEP
    found = [np.array([knots[-1:], values(knots[-1:])])]
    while len(low):
        even = np.arange(looks + 1) / looks
        # At even distances, what turns once from each look to the next would seem to rest.
        times = low[:, None] + (high - low)[:, None] * (even + np.sin(2 * np.pi * even) / 20)
        at = values(times)
        slopes = (np.diff(some, axis=1) for some in (at, at[:, ::2]))
        turns, fewer = (np.count_nonzero(np.diff(np.sign(some), axis=1), axis=1) for some in slopes)
        is_fast = ((turns > fewer) | (turns > looks // 4)) & (looks * len(low) < MOST_LOOKS)
        found.append(np.stack([times, at])[:, ~is_fast, :-1].reshape(2, -1))
        low, high, looks = low[is_fast], high[is_fast], 2 * looks
    every = np.concatenate(found, axis=1)
    ascending: Floats = every[:, every[0].argsort()]
    return ascending


def valleys(
    values: Callable[[Floats], Floats], grid: Floats, sizes: Floats, signs: Floats
) -> tuple[NDArray[np.int_], Floats, Floats]:
    """Places in a grid (k) where the size is less than beside, and where between its neighbours it is least.

    `values` times `signs` (k) are the `sizes` (k) at the grid. With these times (m) comes what is left of the
    size there: it is negative where the sign is another one.
    """
    beside = np.concatenate([[np.inf], sizes, [np.inf]])
    same = np.concatenate([[True], signs[1:] == signs[:-1], [True]])
    is_low = (sizes < beside[:-2]) & (sizes <= beside[2:]) & same[:-1] & same[1:]
    places = np.flatnonzero(is_low)
    low, high = grid[np.maximum(places - 1, 0)], grid[np.minimum(places + 1, len(grid) - 1)]
    every, least, depth = np.arange(len(places)), grid[places], sizes[places]
    for _ in range(VALLEY_ROUNDS if len(places) else 0):
        times = np.linspace(low, high, LOOKS_IN_A_STEP + 1, axis=-1)
        inner = np.nan_to_num(values(times) * signs[places, None], nan=np.inf)
        best = inner.argmin(axis=1)
        least, depth = times[every, best], inner[every, best]
        low, high = times[every, np.maximum(best - 1, 0)], times[every, np.minimum(best + 1, LOOKS_IN_A_STEP)]
    return places, least, depth


def _narrowed(values: Callable[[Floats], Floats], low: Floats, high: Floats, first: Floats) -> Floats:
    """The times (k) between `low` and `high` until which the function has the sign `first`.

    Of the two neighbouring floats, it is the one where the function is nearer to zero.
    """
    every, parts = np.arange(len(low)), max(2, LOOKS_AT_ONCE // max(1, len(low)))
    for _ in range(math.ceil(BITS_OF_A_PASS / math.log2(parts)) if len(low) else 0):
        times = np.linspace(low, high, parts + 1, axis=-1)
        is_before = values(times[:, 1:-1]) * first[:, None] > 0
        place = np.column_stack([is_before, np.zeros(len(low), bool)]).argmin(axis=1)
        low, high = times[every, place], times[every, place + 1]
    return np.where(np.abs(values(low)) < np.abs(values(high)), low, high)
