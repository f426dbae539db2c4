"""Gauss-Legendre collocation with six stages, of order 12, in steps of one length: symplectic integration.

It preserves the area of phase space for every Hamiltonian, separable or not, so that the error of the energy
does not grow with time, however long that is. A step is exact for the reverse of time, too.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd edition, sections VI.4 (why the
method is symplectic) and VIII.5 (compensated summation). A step is that of `gauss_legendre`. Its length is
found by trial, from the errors of single steps against the method of Dormand and Prince. They are looked at
where stages are predicted worse than ever before. When one is too large, the whole solution begins again with
a shorter step: two lengths in one solution are not symplectic.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from rigidcli.core import gauss_legendre, runge_kutta
from rigidcli.core.arithmetic import Floats
from rigidcli.core.gauss_legendre import COUNT, WEIGHTS, stepper
from rigidcli.core.solution import (
    FINEST,
    MOST_NUMBERS,
    NO_VALUE,
    ROUNDING,
    Flow,
    Function,
    Solution,
    State,
    Stop,
    Stopped,
    TooManySteps,
    dense_output,
)
from rigidcli.errors import ComputationError

FIRST = 4.0
"""The step to begin with, in units of the longest that the method of Dormand and Prince takes at first."""

SHORTEST = 1e-4
"""The shortest step that is tried, in units of that one."""

SHARE = 0.1
"""The error that steps are to have, in units of the tolerance: those of a few steps add up in the energy."""

CRUDEST = 4.0
"""The largest error of a step, in units of that, that is no reason to begin again."""

SAFETY, LEAST = 0.85, 0.4
"""What a step that was too long is multiplied by: besides what its error tells, and at least."""

NEWS = 1.1
"""How much worse than ever before a prediction is when the error of its step is looked at."""

AHEAD = 8
"""Steps beyond one that is too long in which the end of the solution is looked for."""

FINER = 1e-3
"""The tolerance of what errors are measured against, in units of ours."""

LEAST_ERROR, MOST_ERROR = 20 * FINEST, 1e-11
"""Bounds on that error: what is told from rounding errors, and what needs enough steps in a period.

Where these are few, and a whole number of them is nearly a period, errors add up for long.
"""

NOISE = 0.1
"""The rounding errors of f, in units of how they are measured: by steps of a few ulps, and twice."""

MOVE = 4 * ROUNDING
"""How far arguments move to show what rounding errors grow to in a step, in units of their size."""

ROUND = 256
"""Steps from one look at errors, and one sign of life, to the next."""

MORE = 8
"""Sweeps that a step without a prediction takes more."""


@dataclass(frozen=True, slots=True)
class Problem:
    """y' = f(t, y), y(t0) = `start` (n), as far as t1, with `blocks` of variables as for `integrate`."""

    f: Function
    start: State
    t0: float
    t1: float
    tolerance: float
    blocks: tuple[int, ...]
    name: str

    def knot(self, index: int, steps: int) -> float:
        """Where the step of this index begins."""
        return self.t0 + (self.t1 - self.t0) * (index / steps) if index != steps else self.t1


class TooLong(Exception):  # noqa: N818 - an outcome, named for what has happened
    """A step is too long at `time`, and should be `ratio` of what it is."""

    def __init__(self, time: float, ratio: float) -> None:
        super().__init__(time, ratio)
        self.time = time
        self.ratio = ratio


def solve(
    flow: Flow,
    start: Floats,
    span: tuple[float, float],
    *,
    tolerance: float,
    blocks: tuple[int, ...],
    tell: Callable[[float], None],
    name: str,
) -> Solution:
    """The solution of y' = f(t, y), y(t0) = `start` (n), over `span` (t0, t1), in steps of one length.

    The error of the energy stays about at the `tolerance`, relative to the energy of the motion. `tell` is
    given times reached, which begin anew when the solution does.

    Raises:
        Stopped: the solution does not reach t1.
        TooManySteps: it does so only after more steps than memory holds.
        ComputationError: it needs steps so short in places that one length is not the way to take them.
    """
    problem = Problem(
        flow(math),
        tuple(start.tolist()),
        *span,
        min(max(SHARE * tolerance, LEAST_ERROR), MOST_ERROR),
        blocks,
        name,
    )
    count, length = len(start), abs(problem.t1 - problem.t0)
    longest = h = FIRST * _pilot(problem)
    while True:
        steps = math.ceil(length / h) if length else 0
        most = MOST_NUMBERS // count
        if steps > most:
            raise TooManySteps(name, most, problem.knot(most, steps))
        try:
            states, sweeps = march(problem, steps, tell)
            break
        except TooLong as long:
            h = length / steps * long.ratio
            if h < SHORTEST * longest:
                raise ComputationError(
                    f"{name} has no steps of one length: they are too short near t = {long.time:.6g}",
                    hint="take the method `auto`",
                ) from None
    knots = np.array([problem.knot(index, steps) for index in range(steps + 1)])
    path = np.frombuffer(states).reshape(len(knots), -1)

    def resume(index: int, to: float) -> State:
        return _followed(problem, float(knots[index]), path[index].tolist(), to, problem.tolerance)

    leap = partial(gauss_legendre.leap, flow(np), sweeps + MORE)
    return Solution(steps, gauss_legendre.METHOD, knots, dense_output(leap, knots, path, resume))


def _followed(problem: Problem, t: float, y: State, to: float, tolerance: float) -> State:
    """The state at time `to`, from y at t, by the method of Dormand and Prince. Raises Stopped."""
    times, states = array("d", [t]), array("d", y)
    steps = runge_kutta.march(
        problem.f, times, states, to, tolerance=tolerance, blocks=problem.blocks, name=problem.name
    )
    try:
        for _ in steps:
            pass
    except Stopped as end:
        if end.stop is Stop.AT_START:
            # What is its start is none of the solution.
            raise Stopped(problem.name, Stop.NO_VALUE, t) from None
        raise
    return states[-len(y) :]


def _pilot(problem: Problem) -> float:
    """The longest of the first steps that the method of Dormand and Prince takes. Raises Stopped."""
    times, states = array("d", [problem.t0]), array("d", problem.start)
    steps = runge_kutta.march(
        problem.f,
        times,
        states,
        problem.t1,
        tolerance=problem.tolerance,
        blocks=problem.blocks,
        name=problem.name,
    )
    next(steps, None)
    return max((abs(b - a) for a, b in pairwise(times)), default=1.0)


def march(problem: Problem, steps: int, tell: Callable[[float], None]) -> tuple[array[float], int]:
    """The states at the ends of equal `steps` ((steps + 1) n), and the most sweeps that one of them took.

    Raises:
        Stopped: the solution does not reach its end.
        TooLong: the steps are too long.
    """
    f, tolerance = problem.f, problem.tolerance
    y: State = problem.start
    count = len(y)
    step, states = stepper(count), array("d", y)
    e: State = (0.0,) * count
    h = (problem.t1 - problem.t0) / steps if steps else 0.0
    guess: State = tuple(h * weight * slope for weight in WEIGHTS for slope in f(problem.t0, *y))
    record, most = 0.0, 0
    for index in range(steps):
        t = problem.knot(index, steps)
        if not index % ROUND:
            floors = _floors(problem, t, y, h)
            tell(t)
        try:
            made = step(f, t, h, y, e, guess, floors, NOISE * tolerance)
        except NO_VALUE:
            made = None
        if made is None or made[3] > record or not index % ROUND:
            error = _error(problem, t, problem.knot(index + 1, steps), y, guess, floors) if made else math.inf
            if made is None or error > CRUDEST * tolerance:
                _followed(problem, t, y, problem.knot(min(index + AHEAD, steps), steps), tolerance)
                raise TooLong(t, max(LEAST, SAFETY * (tolerance / error) ** (1 / (2 * COUNT + 1))))
            if index:  # the first step has no prediction
                record = max(record, NEWS * made[3])
        y, e, guess, _, sweeps = made
        most = max(most, sweeps)
        states.extend(y)
    return states, most


def _floors(problem: Problem, t: float, y: State, h: float) -> State:
    """For each variable, the size of h f below which rounding errors are all there is, at the tolerance."""
    each = (1,) * len(y)
    try:
        slopes = problem.f(t, *y)
        floors = runge_kutta.floors(problem.f, t, y, slopes, True, each, problem.tolerance)
    except NO_VALUE:
        return (0.0,) * len(y)
    return tuple(abs(h) * floor for floor in floors)


def _error(problem: Problem, t: float, to: float, y: State, guess: State, floors: State) -> float:
    """The largest error of a block in a step from y at t, relative to the block.

    What becomes of it where the arguments of f move by a few ulps tells what may be rounding errors.
    """
    h, tolerance = to - t, problem.tolerance
    finer = max(FINEST, FINER * tolerance)
    true = _followed(problem, t, y, to, finer)
    try:
        other = _followed(replace(problem, f=_moved(problem.f)), t, y, to, finer)
    except Stopped:
        other = true
    zero = (0.0,) * len(y)
    made = stepper(len(y))(problem.f, t, h, y, zero, guess, floors, NOISE * tolerance)
    if made is None:
        return math.inf
    slopes = problem.f(t, *y)
    errors, first = [0.0], 0
    for count in problem.blocks:
        block = slice(first, first := first + count)
        miss = math.dist(made[0][block], true[block])
        if miss:
            sizes = [math.hypot(*row[block]) for row in (y, true, floors)]
            sizes += [abs(h) * math.hypot(*slopes[block]), math.dist(other[block], true[block]) / tolerance]
            errors.append(miss / max(miss, *sizes))
    return max(errors)


def _moved(f: Function) -> Function:
    """f, with its arguments moved by a few ulps, those next to each other against each other."""

    def moved(t: float, *y: float) -> Sequence[float]:
        up, down = 1 + MOVE, 1 - MOVE
        return f(t * up, *(value * (up if i % 2 else down) for i, value in enumerate(y)))

    return moved
