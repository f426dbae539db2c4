"""The explicit Runge-Kutta pair of Dormand and Prince of order 8(5,3), with generated code for a step.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
section II.5, and the program DOP853 there. Differences:

- A step is straight-line Python on floats, written for the number of variables: for the few variables
  of mechanics this takes a fifth of the time that arrays take.
- An error is relative to the size of the variable, or of the vector that the variables form together. There
  is no absolute tolerance: what is below the rounding errors of f is found by moving its arguments by an ulp.
- Between the ends of a step the solution is not interpolated. A shorter step of the same method is taken from
  its beginning, for all times at once.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.dormand_prince import ERROR_5, NODES, STAGES, WEIGHTS, WEIGHTS_3
from rigidcli.core.solution import (
    MOST_NUMBERS,
    MOST_STEPS,
    NO_VALUE,
    ORIGIN,
    ROUNDING,
    SHORTEST,
    Elements,
    Flow,
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

Step: TypeAlias = Callable[
    [Function, float, float, State, State, State, State, float], tuple[float, State, State]
]
"""(f, t, h, y, f(t, y), floors, least, tolerance) -> (error, y(t + h), f(t + h, y(t + h))).

The error is in units of the tolerance. Where it is beyond 1, or NaN, the other results are not to be used.
"""

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

ANY_ERROR = 1e100
"""A tolerance with which every step is good, and errors are still in the range of floats."""

BLOCK = 32_768
"""Floats of the states that are sampled at once, so that the arrays of the stages stay in the cache."""


def _sum(weights: dict[int, float], variable: int) -> str:
    return " + ".join(f"{weight!r}*k{stage}_{variable}" for stage, weight in weights.items())


def _norm(letter: str, block: range) -> str:
    names = ", ".join(f"{letter}{i}" for i in block)
    return f"abs({names})" if len(block) == 1 else f"hypot({names})"


def source(blocks: Sequence[int]) -> str:
    """The Python text of a `Step` for variables in `blocks` of these sizes, with the numbers of the tableau.

    In it, y is the state before and z after the step, k0 to k11 are the stages, p and q the errors of order
    5 and 3. With |.| the norm of a block, its error is h p^2 / sqrt(p^2 + 0.01 q^2), relative to the
    largest of |y|, |z|, |h k0|, |h floor| and what it has at least. A step across a pole may make p small by
    chance, but hardly q as well: so that of order 3 must stay below the fourth root of the tolerance, as
    it does in any regular step.
    """
    every = range(sum(blocks))

    def row(letter: str) -> str:
        return "".join(f"{letter}{i}, " for i in every)

    lines = [f"{row('y')} = y", f"{row('k0_')} = k", "a = abs(h)", "lax = tolerance**0.75"]
    for stage, (node, weights) in enumerate(zip(NODES, STAGES, strict=True)):
        if stage:
            arguments = ", ".join(f"y{i} + h*({_sum(weights, i)})" for i in every)
            lines.append(f"{row(f'k{stage}_')} = f(t + {node!r}*h, {arguments})")
    for i in every:
        lines.append(f"s = {_sum(WEIGHTS, i)}")
        lines.append(f"z{i} = y{i} + h*s")
        lines.append(f"p{i} = {_sum(ERROR_5, i)}")
        lines.append(f"q{i} = s - ({_sum(WEIGHTS_3, i)})")
    lines += ["error = 0.0", f"check = {' + '.join(f'z{i}' for i in every)}"]
    first = 0
    for number, size in enumerate(blocks):
        block = range(first, first := first + size)
        lines.append(f"p = {_norm('p', block)}")
        lines.append("if p:")
        lines.append(f" q, m = {_norm('q', block)}, {_norm('y', block)}")
        # Comparisons take a third of the time of `max`.
        others = (_norm("z", block), f"a*{_norm('k0_', block)}", f"a*floors[{number}]", f"least[{number}]")
        lines += [f" w = {other}\n  if w > m: m = w" for other in others]
        lines.append(" e, w = p*(p/hypot(p, 0.1*q)), q*lax")
        lines.append(" if w > e: e = w")
        lines.append(" e = e*(a/m)/tolerance")
        lines.append(" if e > error: error = e")
        lines.append(" check += e")
    # Of a number that is not finite, nought times it is NaN: neither a maximum nor a comparison hides it.
    lines.append("error += 0.0*check")
    lines.append("if not error <= 1.0: return error, y, k")
    lines.append(f"z = ({row('z')})")
    lines.append("k = f(t + h, *z)")
    lines.append("return error + 0.0*sum(k), z, k")
    return "\n ".join(["def step(f, t, h, y, k, floors, least, tolerance):", *lines])


@cache
def stepper(blocks: tuple[int, ...]) -> Step:
    """The code of `source`, ready to run."""
    names: dict[str, Any] = {"__builtins__": {}, "abs": abs, "hypot": math.hypot, "sum": sum}
    exec(source(blocks), names)  # noqa: S102 - written above, from a constant table and the sizes alone
    step: Step = names["step"]
    return step


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


def sampler(
    flow: Flow,
    knots: Floats,
    states: Floats,
    follow: Callable[[float, State, float], State],
    parts: int = 1,
) -> Callable[[Floats], Floats]:
    """A function from times (k) to states (k by n), where steps begin at `knots` (m) from `states` (m by n).

    From the knot before, `parts` steps of the method go there, for many times at once. A single time that
    they do not reach is left to `follow`, which takes that knot, its state and the time.
    """
    f = flow(np)
    ahead = 1.0 if knots[-1] >= knots[0] else -1.0
    count = states.shape[1]
    block = max(1, BLOCK // count)

    def sample(times: Floats) -> Floats:
        result = np.empty((len(times), count))
        for start in range(0, len(times), block):
            part = times[start : start + block]
            index = np.searchsorted(ahead * knots, ahead * part, side="right") - 1
            t, h, y = knots[index], (part - knots[index]) / parts, np.ascontiguousarray(states[index].T)
            with np.errstate(all="ignore"):
                for leap in range(parts):
                    y = _leap(f, t + leap * h, h, y)
            for lost in np.flatnonzero(~np.isfinite(y).all(axis=0)):
                before = int(index[lost])
                y[:, lost] = follow(float(knots[before]), states[before].tolist(), float(part[lost]))
            result[start : start + block] = y.T
        return result

    return sample


def single_sampler(
    f: Function, knots: Floats, states: Floats, blocks: tuple[int, ...]
) -> Callable[[Floats], Floats]:
    """What `sampler` gives, to rounding, by steps on floats, which are faster for a few times.

    Where a step has no value, the state is NaN.
    """
    step, none, least = stepper(blocks), (0.0,) * len(blocks), (LEAST,) * len(blocks)
    ahead = 1.0 if knots[-1] >= knots[0] else -1.0

    def at(time: float, index: int) -> State:
        t, y = float(knots[index]), states[index].tolist()
        with suppress(*NO_VALUE):
            return step(f, t, time - t, y, f(t, *y), none, least, ANY_ERROR)[1] if time != t else y
        return (math.nan,) * len(y)

    def sample(times: Floats) -> Floats:
        index = np.searchsorted(ahead * knots, ahead * times, side="right") - 1
        found = [at(*place) for place in zip(times.tolist(), index.tolist(), strict=True)]
        return np.array(found).reshape(len(times), states.shape[1])

    return sample


def _leap(f: Elements, t: Floats, h: Floats, y: Floats) -> Floats:
    """One step of the method for each column: from y (n by k) at t (k) by h (k)."""
    stages: list[Floats] = []
    for node, weights in zip(NODES, STAGES, strict=True):
        slopes = np.empty_like(y)
        for row, slope in zip(slopes, f(t + node * h, *_moved(y, h, stages, weights)), strict=True):
            row[:] = slope
        stages.append(slopes)
    return _moved(y, h, stages, WEIGHTS)


def _moved(y: Floats, h: Floats, stages: Sequence[Floats], weights: Mapping[int, float]) -> Floats:
    # Added one by one: a sample must not depend on the others, as it does in a matrix product.
    total = np.zeros_like(y)
    for stage, weight in weights.items():
        total += weight * stages[stage]
    return y + h * total
