"""Integration by the Runge-Kutta pair of Dormand and Prince, in steps as long as its errors allow.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
section II.4 for the length of the steps. Differences: rounding errors of f show when its arguments move by an
ulp, and no step is shortened for them; a step ends at each time at which something sudden is expected.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS
from rigidcli.core.dormand_prince import stepper
from rigidcli.core.solution import (
    MOST_NUMBERS,
    MOST_STEPS,
    NO_VALUE,
    ORIGIN,
    SHORTEST,
    Function,
    State,
    Stop,
    Stopped,
    TooManySteps,
    finite,
    hopeless,
    stopped,
)
from rigidcli.errors import ComputationError

ROUND = 128
"""Steps from one estimate of rounding errors, and one report of progress, to the next."""

LEAST = 1e-280
"""The size below which no variable is followed: it is nearly lost in the gap between zero and the floats."""


def march(
    f: Function,
    times: array[float],
    states: array[float],
    end: float,
    *,
    tolerance: float,
    blocks: tuple[int, ...],
    name: str,
    least: State | None = None,
    longest: float = math.inf,
    stops: Sequence[float] = (),
    roundings: Function | None = None,
    project: Callable[[float, State], State] | None = None,
) -> Iterator[float]:
    """Go on from the last of `times` and `states` to `end`, and append each step to them.

    Every `ROUND` steps it yields the time that it has reached. `least` has for each block the size to which
    its error is relative at least; by default those of `least_sizes`. No step is longer than `longest`, and
    one ends at each of the `stops`, times on the way in the order in which they come. `roundings` gives the
    rounding errors of f, in units of those of one operation: no step is short for those of small differences.
    `project` moves the state (n) after each step, as constraints need it, by about the error of the step.

    Raises:
        Stopped: there is no solution as far as `end`.
        TooManySteps: there are more than MOST_STEPS, or will be if the later half of them goes on.
    """
    step, count = stepper(blocks), sum(blocks)

    def floor_here() -> tuple[float, ...]:
        return floors(f, roundings, t, y, k, regular, blocks, tolerance, h)

    t, span = times[-1], end - times[-1]
    y: State = tuple(states[-count:])
    if not finite(f, t, y):
        raise Stopped(name, Stop.AT_START, t)
    k: State = f(t, *y)
    edges = sides(t, stops, end)
    goal, beyond = next(edges)
    h = math.copysign(min(abs(span) / 1000, longest), span)
    failures = taken = jumps = 0
    regular, reach = True, abs(h)
    floor, landed = floor_here(), t
    least = least_sizes(f, t, y, end, blocks, longest=longest, stops=stops) if least is None else least
    most = min(MOST_STEPS, MOST_NUMBERS // count)
    while t != end:
        if goal == t:
            across = _across(f, t, y, k, beyond)
            # At the start there is a side to leave only where the slopes jump.
            if across is not None and (len(times) > 1 or _jumps(k, across[1])):
                t, (y, k) = beyond, across
                landed = t
                times.append(t)
                states.extend(y)
            goal, beyond = next(edges)
            continue
        left = goal - t
        shortest = SHORTEST * max(abs(t), ORIGIN * abs(span))
        if abs(h) < shortest:
            jumps += 1
            h = math.copysign(min(shortest, abs(left)), h)
            # With more jumps before a regular step, the solution would slide along the jump.
            crossed = _crossed(f, t + h, h, y, k, states[-ROUND * count :]) if jumps <= 16 else None
            if crossed is None:
                raise stopped(f, t, y, span, name)
            to, error, failures = t + h, 0.0, 0
            after, slope = crossed
        else:
            # What is left is shared by two steps, so that the last one is no mere rest.
            to = goal if abs(left) <= abs(h) else t + (left / 2 if abs(left) < 2 * abs(h) else h)
            # Times are what a solution is asked by: the step is their difference, free of rounding.
            h = to - t
            try:
                error, after, slope = step(f, t, h, y, k, floor, least, tolerance)
                if project is not None and error <= 1.0:
                    after = project(to, after)
                    slope = f(to, *after)
            except NO_VALUE:
                error = math.nan
        if error <= 1.0:
            t, y, k = to, after, slope
            times.append(t)
            states.extend(y)
            regular = abs(h) > 1e6 * shortest  # far from any jump or pole
            jumps = 0 if regular else jumps
            # No step is more than six times as long as the last, and none grows after one that failed.
            growth = max(0.3, min(0.9 * error**-0.125 if error else 6.0, 1.0 if failures else 6.0))
            h, failures = math.copysign(min(abs(h) * growth, longest), h), 0
            taken += 1
            if not taken % ROUND:
                if hopeless(times, taken, end, most):
                    raise TooManySteps(name, taken, t, end, most)
                yield t
            # At a stop f may jump, which must not pass for rounding errors.
            if (not taken % ROUND or abs(h) > 4 * reach) and t != goal:
                reach = abs(h)
                floor = floor_here()
        else:
            failures += 1
            h *= max(0.1, 0.9 * error**-0.125) if error < math.inf else 0.25
            if failures == 4 and t != landed:  # rounding errors may be the reason
                reach = abs(h)
                floor = floor_here()


def sides(start: float, stops: Sequence[float], end: float) -> Iterator[tuple[float, float]]:
    """The times just before and just after the start and each of the `stops`, and twice the end.

    Between the two are a few units in the last place: what jumps at a stop does so between them.
    """
    span = end - start
    before, ahead = start, math.copysign(1.0, span)
    for stop in (start, *stops):
        reach = ahead * SHORTEST / 4 * max(abs(stop), ORIGIN * abs(span))
        low, high = (start if stop == start else stop - reach), stop + reach
        if ahead * high < ahead * end and ahead * (high - before) > 0:
            yield (low if ahead * (low - before) > 0 else before), high
            before = high
    yield end, end


def _across(f: Function, t: float, y: State, k: State, to: float) -> tuple[State, State] | None:
    """The state and its slope a moment later, beyond what may jump; None where f has no value there."""
    h = to - t
    with suppress(*NO_VALUE):
        slope = f(to, *(value + h * rate for value, rate in zip(y, k, strict=True)))
        after = [value + h * (one + two) / 2 for value, one, two in zip(y, k, slope, strict=True)]
        slope = f(to, *after)
        if all(map(math.isfinite, slope)):
            return after, slope
    return None


def _jumps(one: State, two: State) -> bool:
    return math.dist(one, two) > 0.01 * max(math.hypot(*one), math.hypot(*two))


def least_sizes(f: Function, t: float, y: State, end: float, blocks: tuple[int, ...], **steps: Any) -> State:
    """For each block that begins with nothing, and at rest, a small part of its later size; LEAST for others.

    Such a block grows like a power of the time, high if what moves it is itself at rest: while it does so
    no step follows it to a relative accuracy, and none need. The `steps` may be `longest`, and have `stops`.
    """
    k: State = f(t, *y) if finite(f, t, y) else (math.nan,) * len(y)
    ends = list(itertools.accumulate(blocks))
    parts = [slice(end - size, end) for size, end in zip(blocks, ends, strict=True)]
    empty = [not any(y[part]) and not any(k[part]) for part in parts]
    if not any(empty):
        return (LEAST,) * len(blocks)
    times, states = array("d", [t]), array("d", y)
    with suppress(ComputationError, *NO_VALUE):
        if len(blocks) > 1:
            pilot = march(f, times, states, end, tolerance=1e-6, blocks=(len(y),), name="", **steps)
            # Where friction holds a body, the steps would never end.
            deque(itertools.islice(pilot, 64), maxlen=0)
        else:
            states.extend(stepper(blocks)(f, t, (end - t) / 1000, y, k, (0.0,), (math.inf,), 1e-6)[1])
    path = np.abs(np.frombuffer(states).reshape(-1, len(y)))
    sizes = [float(np.hypot.reduce(path[:, part], axis=1).max()) for part in parts]
    return tuple(max(1e-3 * size * none, LEAST) for none, size in zip(empty, sizes, strict=True))


def _crossed(
    f: Function, to: float, h: float, y: State, k: State, recent: Sequence[float]
) -> tuple[State, State] | None:
    """The state (n) and its slope at time `to`, the shortest step h away, if f merely jumps between.

    Dry friction does so where the velocity is zero, with nothing to measure an error by. It is a
    jump if nothing moves in that step, beside what it was among the `recent` states (m n); what was
    zero in all of them may begin to move.
    """
    after = [value + h * slope for value, slope in zip(y, k, strict=True)]
    if not finite(f, to, after):
        return None
    slopes = f(to, *after)
    for i, (one, two) in enumerate(zip(k, slopes, strict=True)):
        if abs(h) * max(abs(one), abs(two)) > 1e-10 * max(map(abs, recent[i :: len(y)])) > 0:
            return None
    return after, slopes


def floors(
    f: Function,
    roundings: Function | None,
    t: float,
    y: State,
    k: State,
    regular: bool,
    blocks: Sequence[int],
    tolerance: float,
    h: float = 0.0,
) -> tuple[float, ...]:
    """For each block, the size of f below which a step need not follow it to `tolerance`.

    That is where rounding errors are all there is, as they are in a body that rests in equilibrium. They show
    when the arguments of f move by a few ulps, each pair of them together in one try and against each other
    in another; and those of small differences are given by the `roundings` of f. Where steps are no longer
    `regular`, a pole is near, which must not pass for rounding errors.
    """
    noise = [0.0] * len(y)
    with suppress(*NO_VALUE):
        if roundings is not None:
            noise = [EPS * size for size in roundings(t, *y)]
            # In a few steps those of one variable get into others.
            other = f(t, *(value + 4 * h * error for value, error in zip(y, noise, strict=True)))
            noise = [max(old, abs(a - b)) for old, a, b in zip(noise, k, other, strict=True)]
    bits = range(max(1, (len(y) - 1).bit_length()))
    for bit, move in itertools.product(bits, (-5 * EPS, -3 * EPS, 3 * EPS, 5 * EPS)):
        moved = [value * (1 + (move if i >> bit & 1 else -move)) for i, value in enumerate(y)]
        with suppress(*NO_VALUE):
            other = f(t * (1 + move), *moved)
            noise = [max(old, abs(a - b)) for old, a, b in zip(noise, k, other, strict=True)]
    sizes, first = [], 0
    for size in blocks:
        block = slice(first, first := first + size)
        floor = 2 * math.hypot(*noise[block])
        floor = (floor if regular else min(floor, 1e-4 * math.hypot(*k[block]))) / tolerance
        sizes.append(floor if floor < math.inf else 0.0)
    return tuple(sizes)
