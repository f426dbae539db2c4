"""What acts for so short a while that an integrator may step over it: a thin wall, a pulse.

An integrator looks at the equations at a few times in each step. Something narrow depends on a quantity that
passes zero there, as x does in tanh(x/w), or is largest or smallest, as -(x/w)^2 in exp(-(x/w)^2). These
quantities tell where to look. Whether there is anything, the slopes tell at distances from there each half of
the one before: those of smooth equations differ by half as much each time, however far this goes on.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Elements, Flow, Solution, joined

REPETITIONS = 20
"""How often a solution is repeated for what is narrow."""

EDGE = 1e-3
"""The part of a step, at its beginning and its end, by which it is told whether a quantity grows there."""

MOST_PLACES = 32
"""The most places that are looked at closely: those in the longest steps, which overlook most."""

ROUNDS, PARTS = 5, 101
"""How often the time of such a place is narrowed down, and to one of how many parts: to 1e-8 of the step."""

DISTANCES = 0.5 ** np.arange(44)
"""Where slopes are looked at, in units of the way from the place to an end of its step."""

RESOLVED = 3
"""The number of those distances, from the largest, that the stages of a step are dense enough to see."""

CONTRAST = 10.0
"""The least ratio of what something narrow changes in the state to what changes at the resolved distances."""

MISSED = 100.0
"""The least change of the state that counts, relative to its size, in units of the tolerance."""

REACH = 8.0
"""Half the length of the span that is told, in units of the width of what is narrow."""


def solved(
    follow: Callable[[Floats, tuple[float, float]], Solution],
    flow: Flow,
    quantities: Flow,
    start: Floats,
    span: tuple[float, float],
    tolerance: float,
) -> tuple[Solution, Floats, Floats]:
    """The solution that goes over nothing narrow, the spans (k by 2) that are repeated for it, those left.

    For `follow` see `begun_anew`, for the rest `overlooked`. With each repetition more is found, as what is
    narrow changes what comes after it.
    """
    places = left = np.empty((0, 2))
    for _ in range(REPETITIONS):
        places = merged(places, left)
        solution = begun_anew(follow, start, span, places)
        left = overlooked(flow, quantities, solution, tolerance)
        if not len(left):
            break
    return solution, places, left


def begun_anew(
    follow: Callable[[Floats, tuple[float, float]], Solution],
    start: Floats,
    span: tuple[float, float],
    places: Floats,
) -> Solution:
    """The solution over `span` that begins with small steps at both ends of each of the `places` (k by 2).

    These are spans of time, in order; `follow` takes the state (n) at the beginning of a span, and the span.
    """
    parts: list[Solution] = []
    (begin, last), state = span, start
    for end in (*places.ravel().tolist(), last):
        if end <= begin and (parts or end < last):
            continue
        parts.append(follow(state, (begin, end)))
        state, begin = parts[-1].at(np.array([end]))[0], end
    return joined(parts)


def merged(*places: Floats) -> Floats:
    """The spans of all (k by 2 each), in order, without what they share."""
    spans = np.concatenate(places)
    apart: list[list[float]] = []
    for begin, end in spans[np.argsort(spans[:, 0], kind="stable")].tolist():
        begin = max(begin, apart[-1][1]) if apart else begin
        if end > begin:
            apart.append([begin, end])
    return np.array(apart).reshape(-1, 2)


@np.errstate(all="ignore")
def overlooked(flow: Flow, quantities: Flow, solution: Solution, tolerance: float) -> Floats:
    """Spans of time (k by 2), in order, in which something narrow acts that the `solution` has stepped over.

    The solution, ahead in time, is that of y' = f(t, y), the `flow`, to a `tolerance`. It is looked at where
    one of the `quantities`, functions of time and state, passes zero or is largest or smallest.
    """
    f, g, knots = flow(np), quantities(np), solution.knots
    steps, states = np.diff(knots), solution.sample(knots)
    slopes, values = _values(f, knots, states).T, _values(g, knots, states)
    after, before = knots[:-1] + EDGE * steps, knots[1:] - EDGE * steps
    rising = _values(g, after, states[:-1] + (EDGE * steps)[:, None] * slopes[:-1]) > values[:, :-1]
    still = _values(g, before, states[1:] - (EDGE * steps)[:, None] * slopes[1:]) < values[:, 1:]
    found = np.array([values[:, :-1] * values[:, 1:] < 0, rising != still]).nonzero()
    # An extremum is where `up` times the quantity is largest; where it passes zero, less its size is so.
    turning, which, step = np.array(found)[:, np.argsort(-steps[found[2]], kind="stable")[:MOST_PLACES]]
    if not len(step):
        return np.empty((0, 2))
    up, rows = np.where(rising[which, step], 1, -1)[:, None], np.arange(len(step))
    low, high = knots[step], knots[step + 1]
    for _ in range(ROUNDS):
        times = np.linspace(low, high, PARTS, axis=-1)
        value = _values(g, times, solution.sample(times.ravel()))[which, rows]
        best = np.where(turning[:, None], up * value, -np.abs(value)).argmax(axis=1)
        low, high = times[rows, np.maximum(best - 1, 0)], times[rows, np.minimum(best + 1, PARTS - 1)]
    place = times[rows, best]
    sizes = np.abs(states).max(axis=0)[:, None, None]
    spans = []
    for end in (knots[step], knots[step + 1]):
        way = np.abs(end - place)[:, None] * DISTANCES
        times = place[:, None] + np.sign(end - place)[:, None] * way
        slopes = _values(f, times, solution.sample(times.ravel()))
        changes = np.nan_to_num(np.abs(np.diff(slopes, axis=2)) * way[:, 1:] / sizes).max(axis=0)
        narrow = RESOLVED + changes[:, RESOLVED:].argmax(axis=1)
        largest, seen = changes[rows, narrow], changes[:, :RESOLVED].max(axis=1)
        for k in np.flatnonzero((largest > MISSED * tolerance) & (largest > CONTRAST * seen)):
            reach = REACH * way[k, narrow[k]]
            spans.append((max(knots[0], place[k] - reach), min(knots[-1], place[k] + reach)))
    return merged(np.array(spans).reshape(-1, 2))


def _values(function: Elements, times: Floats, states: Floats) -> Floats:
    """The values (m by the shape of the times) of functions at times (k in all) and states (k by n)."""
    rows = function(times.ravel(), *states.T)
    return np.array([np.broadcast_to(row, times.size) for row in rows]).reshape(len(rows), *times.shape)
