"""How many digits of a solution are right: those that it shares with a second solution, in other steps.

The second solution has a larger tolerance, and steps that end at the kicks which the first may have missed.
Where both share few digits, a third solution is compared with the second, and so on, until two have found the
same kicks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.kicks import Watched, walls
from rigidcli.core.solution import Solution, Stopped
from rigidcli.errors import ComputationError

# The difference of two solutions, in units of their size, from which on one may have missed a wall.
MISSED = 1e-5
# The difference of two solutions, in units of their size, from which on they share no digit.
NO_DIGIT_SHARED = 0.1
MOST_SOLUTIONS = 24  # The most solutions that are compared, one with the next: each may find another wall.
# By how much of the span two solutions must agree for longer than the two before, or no wall was missed.
LEAST_GAIN = 0.05


def other_tolerance(tolerance: float) -> float:
    """The tolerance of the second solution: 100 times the first, or a hundredth of a crude one."""
    return tolerance * (100 if tolerance <= 1e-5 else 0.01)


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
    are the `stops` of the first. The error is the largest difference from a second solution. `distance` gives
    how far states (k by n) are from each other, in units of their size or in rad.

    Where the second differs by more than MISSED, the first may have gone over a wall. Then a third solution,
    to the first tolerance, also stops where the second has found something narrow, and takes the place of
    the first if it is nearer to the second; and so on, wall by wall.
    """
    if not first.steps:
        return first, 0.0, None
    coarse = other_tolerance(first.tolerance)
    looks = np.linspace(times[0], times[-1], 257)
    best, error, lost, reached = first, 1.0, None, 0.0
    before, places = first, {*stops.tolist()}
    for turn in range(MOST_SOLUTIONS):
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
        far, now = np.flatnonzero(apart > NO_DIGIT_SHARED), float(apart.max(initial=0.0))
        if turn or now > MISSED:
            on_the_way = np.nan_to_num(distance(before.at(looks), after.at(looks)), nan=1.0)
            until = float(looks[max(1, int(np.argmax(np.append(on_the_way, 1.0) > NO_DIGIT_SHARED))) - 1])
            if turn and not (now < error / 10 or until > reached + LEAST_GAIN * times[-1]):
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
