"""Integration by the Runge-Kutta pair of Dormand and Prince, in steps as long as its errors allow.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
section II.4 for the length of the steps. Unlike there, what is below the rounding errors of f is found by
moving its arguments by an ulp, and no step is shortened for it.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from rigidcli.core.dormand_prince import stepper
from rigidcli.core.solution import (
    MOST_NUMBERS,
    MOST_STEPS,
    NO_VALUE,
    ORIGIN,
    ROUNDING,
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

SAFETY = 0.9
"""What the step that the error allows is multiplied by, as the next error may be larger than the last."""

MOST_GROWTH, LEAST_SHRINKAGE, MOST_SHRINKAGE = 6.0, 0.3, 0.1
"""Bounds on the ratio of steps: after a good one, above and below; after a bad one."""

ROUND = 128
"""Steps from one estimate of rounding errors, and one report of progress, to the next."""

STALLED = 4
"""Rejected steps in a row after which rounding errors are estimated anew, as they may be the reason."""

REGULAR = 1e6
"""A step longer than this, in units of the shortest one, is far from any jump or pole."""

POLE = 1e-4
"""The largest part of a slope that may pass for rounding errors near a pole, so that no step crosses it."""

MOST_JUMPS = 16
"""Jumps of f that are crossed before a regular step. With more, the solution would slide along the jump."""

STILL = 1e-10
"""How far a variable may move in a step across a jump of its slope, in units of its recent size."""

PILOT = 1e-6
"""The tolerance of a first, crude integration that shows how large the variables become."""

SMALL = 1e-3
"""What errors of a variable that starts at zero are relative to at least, in units of its later size."""

LEAST = 1e-280
"""The size below which no variable is followed: it is nearly lost in the gap between zero and the floats."""

MOVES = (-5 * ROUNDING, -3 * ROUNDING, 3 * ROUNDING, 5 * ROUNDING)
"""By how much arguments are changed to show rounding errors, in units of their size."""

AHEAD = 4.0
"""How far rounding errors are looked for, in units of the step, as steps may get longer."""


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
    most: int = MOST_STEPS,
    roundings: Function | None = None,
) -> Iterator[float]:
    """Go on from the last of `times` and `states` to `end`, and append each step to them.

    Every `ROUND` steps it yields the time that it has reached. `least` has for each block the size to which
    its error is relative at least; by default those of `least_sizes`. `roundings` tells the rounding errors
    of f, in units of those of one operation: with it, steps do not get short in those of small differences.

    Raises:
        Stopped: there is no solution as far as `end`.
        TooManySteps: there are more than `most`, or will be if the later half of them goes on.
    """
    step, count = stepper(blocks), sum(blocks)
    t = times[-1]
    y: State = tuple(states[-count:])
    span = end - t
    if not finite(f, t, y):
        raise Stopped(name, Stop.AT_START, t)
    k: State = f(t, *y)
    h = span / 1000
    failures = taken = jumps = 0
    regular = True
    reach = AHEAD * h
    floor = floors(f, t, y, k, regular, blocks, tolerance, roundings, reach)
    least = least_sizes(f, t, y, end, blocks) if least is None else least
    most = min(most, MOST_NUMBERS // count)
    while t != end:
        left = end - t
        shortest = SHORTEST * max(abs(t), ORIGIN * abs(span))
        if abs(h) < shortest:
            jumps += 1
            h = math.copysign(min(shortest, abs(left)), h)
            crossed = _crossed(f, t + h, h, y, k, states[-ROUND * count :]) if jumps <= MOST_JUMPS else None
            if crossed is None:
                raise stopped(f, t, y, span, name)
            to, error, failures = t + h, 0.0, 0
            after, slope = crossed
        else:
            # What is left is shared by two steps, so that the last one is no mere rest.
            to = end if abs(left) <= abs(h) else t + (left / 2 if abs(left) < 2 * abs(h) else h)
            # Times are what a solution is asked by: the step is their difference, free of rounding.
            h = to - t
            try:
                error, after, slope = step(f, t, h, y, k, floor, least, tolerance)
            except NO_VALUE:
                error = math.nan
        if error <= 1.0:
            t, y, k = to, after, slope
            times.append(t)
            states.extend(y)
            regular = abs(h) > REGULAR * shortest
            jumps = 0 if regular else jumps
            growth = SAFETY * error**-0.125 if error else MOST_GROWTH
            h *= max(LEAST_SHRINKAGE, min(growth, 1.0 if failures else MOST_GROWTH))
            failures = 0
            taken += 1
            if not taken % ROUND:
                if hopeless(times, taken, end, most):
                    raise TooManySteps(name, taken, t, end, most)
                yield t
            if abs(h) > abs(reach) or not taken % ROUND:
                reach = AHEAD * h
                floor = floors(f, t, y, k, regular, blocks, tolerance, roundings, reach)
        else:
            failures += 1
            h *= max(MOST_SHRINKAGE, SAFETY * error**-0.125) if error < math.inf else 0.25
            if failures == STALLED:
                reach = AHEAD * h
                floor = floors(f, t, y, k, regular, blocks, tolerance, roundings, reach)


def least_sizes(f: Function, t: float, y: State, end: float, blocks: tuple[int, ...]) -> State:
    """For each block that begins with nothing, and at rest, a small part of its later size; LEAST for others.

    Such a block grows like a power of the time, high if what moves it is itself at rest: while it does so
    no step follows it to a relative accuracy, and none need.
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
            deque(march(f, times, states, end, tolerance=PILOT, blocks=(len(y),), name=""), maxlen=0)
        else:
            states.extend(stepper(blocks)(f, t, (end - t) / 1000, y, k, (0.0,), (math.inf,), PILOT)[1])
    path = np.abs(np.frombuffer(states).reshape(-1, len(y)))
    sizes = [float(np.hypot.reduce(path[:, part], axis=1).max()) for part in parts]
    return tuple(max(SMALL * size * none, LEAST) for none, size in zip(empty, sizes, strict=True))


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
        if abs(h) * max(abs(one), abs(two)) > STILL * max(map(abs, recent[i :: len(y)])) > 0:
            return None
    return after, slopes


def floors(
    f: Function,
    t: float,
    y: State,
    k: State,
    regular: bool,
    blocks: Sequence[int],
    tolerance: float,
    roundings: Function | None = None,
    reach: float = 0.0,
) -> tuple[float, ...]:
    """For each block, the size of f below which a step need not follow it to `tolerance`.

    That is where rounding errors are all there is, as they are in a body that rests in
    equilibrium. They show when the arguments of f move by a few ulps, each pair of them together in one try
    and against each other in another; and in the `roundings` of f, where those of one variable get
    into another one within a time `reach`. Where steps are no longer `regular`, slopes bound them.
    """
    noise = [0.0] * len(y)
    with suppress(*NO_VALUE):
        if roundings is not None:
            noise = [ROUNDING * size for size in roundings(t, *y)]
            other = f(t, *(value + reach * error for value, error in zip(y, noise, strict=True)))
            noise = [max(old, abs(a - b)) for old, a, b in zip(noise, k, other, strict=True)]
    bits = range(max(1, (len(y) - 1).bit_length()))
    for bit, move in itertools.product(bits, MOVES):
        moved = [value * (1 + (move if i >> bit & 1 else -move)) for i, value in enumerate(y)]
        try:
            other = f(t * (1 + move), *moved)
        except NO_VALUE:
            continue
        noise = [max(old, abs(a - b)) for old, a, b in zip(noise, k, other, strict=True)]
    found, first = [], 0
    for size in blocks:
        block = slice(first, first := first + size)
        floor = 2 * math.hypot(*noise[block])
        found.append((floor if regular else min(floor, POLE * math.hypot(*k[block]))) / tolerance)
    return tuple(floor if floor < math.inf else 0.0 for floor in found)


def follower(
    f: Function, *, tolerance: float, blocks: tuple[int, ...], name: str
) -> Callable[[float, State, float], State]:
    """A function (t, y, to) -> y(to) that takes as many steps as it needs, and raises Stopped."""

    def follow(t: float, y: State, to: float) -> State:
        times, states = array("d", [t]), array("d", y)
        steps = march(f, times, states, to, tolerance=tolerance, blocks=blocks, name=name)
        try:
            deque(steps, maxlen=0)
        except Stopped as end:
            if end.stop is Stop.AT_START:  # this is not the start of the solution
                raise Stopped(name, Stop.NO_VALUE, t) from None
            raise
        return states[-len(y) :]

    return follow
