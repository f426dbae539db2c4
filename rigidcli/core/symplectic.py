"""Symplectic integration by Gauss-Legendre collocation, in steps of one length.

The method preserves the area of phase space for every Hamiltonian, separable or not, so that the error of the
energy does not grow with time, however long that is. Each step is undone by the step back in time.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd edition, section VI.4. Unlike
there, the length of the steps is found by trial. When the error of a step is too large, the whole solution
begins again with shorter steps: two lengths in one solution are not symplectic.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence

import numpy as np

from rigidcli.core import dense_output, runge_kutta
from rigidcli.core.arithmetic import Floats
from rigidcli.core.gauss_legendre import GRAIN, METHOD, STAGES, WEIGHTS, stepper
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
    finite,
)
from rigidcli.errors import ComputationError

SETTLED = 1e-2
"""How far that iteration goes in a crude solution, in units of the error of its steps."""

FIRST = 16
"""The number of steps to begin with: few, as too few are noticed in the first of them."""

SHORTEST = 1e-4
"""The shortest step that is tried, in units of the longest that went beyond the start.

It is enough for an orbit of eccentricity 0.99 that begins at its far end.
"""

SHARE = 0.03
"""The error that steps may have, in units of the tolerance: those of a few steps add up in the energy."""

LEAST_ERROR, MOST_ERROR = 20 * FINEST, 3e-12
"""Bounds on that error: rounding leaves the one, and the other keeps more than ten steps in a period.

Where these are few, and a whole number of them is nearly a period, errors add up for long.
"""

HIGHEST = 0.005
"""The error of a step in units of c^(13/6), where c is the highest Legendre coefficient of h f.

It is 0.0048 for the exponential function, and 0.0038 for one with a pole.
"""

JUMP = 1e-9
"""The largest error of two steps, in units of the largest variable, where the equations do not jump."""

SAFETY, LEAST = 0.9, 0.3
"""Factors of a step that was too long: one besides what its error tells, and the least of both together."""

AHEAD = 8
"""Steps beyond one that is too long in which the end of the solution is looked for."""

ROUND = 256
"""Steps from one estimate of rounding errors, and one report of progress, to the next."""

SUBSTEPS = 4
"""The steps of Dormand and Prince that lead to a time inside a step, as accurate as its ends are."""


class TooLong(Exception):  # noqa: N818 - an outcome, named for what has happened
    """The step of this index is too long, from this state; its length should be multiplied by `ratio`."""

    def __init__(self, index: int, state: State, ratio: float) -> None:
        super().__init__(index, state, ratio)
        self.index, self.state, self.ratio = index, state, ratio


def solve(
    flow: Flow,
    start: Floats,
    span: tuple[float, float],
    *,
    tolerance: float,
    blocks: tuple[int, ...],
    tell: Callable[[float], None],
    name: str,
    most: int,
    like: Solution | None,
) -> Solution:
    """The solution of y' = f(t, y), y(t0) = `start` (n), over `span` (t0, t1), in steps of one length.

    The error of the energy stays about at the `tolerance`, relative to the energy of the motion. `tell` is
    given times reached, which begin anew when the solution does. If this one is `like` another solution, its
    steps are as many times longer as the tolerances and the order of the method tell.

    Raises:
        Stopped: the solution does not reach t1.
        TooManySteps: it does so only after more than `most` steps.
        ComputationError: it needs steps so short in places that one length is not the way to take them.
    """
    f, (t0, t1) = flow(math), span
    y = tuple(start.tolist())
    if not finite(f, t0, y):
        raise Stopped(name, Stop.AT_START, t0)
    finest = tolerance if like is None else like.tolerance
    error = min(max(SHARE * finest, LEAST_ERROR), MOST_ERROR) * (tolerance / finest)
    follow = runge_kutta.follower(f, tolerance=error, blocks=blocks, name=name)
    # Of the whole state as one vector: a variable of rounding errors alone does not matter here.
    look = runge_kutta.follower(f, tolerance=error, blocks=(len(y),), name=name)
    steps, fewest, most = FIRST if t0 != t1 else 0, math.inf, min(most, MOST_NUMBERS // len(y))
    largest, rounding = error, ROUNDING
    if like is not None and steps:
        share = abs((t1 - t0) / (like.knots[-1] - like.knots[0]))
        steps = math.ceil(like.steps * share * (like.tolerance / tolerance) ** (0.5 / STAGES))
        largest, rounding = math.inf, SETTLED * error
    while True:
        knots = np.linspace(t0, t1, steps + 1)
        if steps > most:
            raise TooManySteps(name, most, float(knots[most]), t1, most)
        try:
            states, worst = march(f, knots.tolist(), y, largest, tell, rounding)
            path = np.frombuffer(states).reshape(len(knots), -1)
            if steps and like is None:
                before = path[worst - 1].tolist()
                miss = path[worst + 1] - look(float(knots[worst - 1]), before, float(knots[worst + 1]))
                if np.abs(miss).max() > JUMP * np.abs(path).max():
                    raise TooLong(worst - 1, before, LEAST)
            break
        except TooLong as long:
            t, ahead = float(knots[long.index]), float(knots[min(long.index + AHEAD, steps)])
            if long.index:
                look(t, long.state, ahead)  # which tells whether the solution ends there
                fewest = min(fewest, steps)
            steps = math.ceil(steps / long.ratio)
            if steps * SHORTEST > fewest:
                raise ComputationError(
                    f"{name} has no steps of one length: they are too short near t = {t:.6g}",
                    hint="take the method `auto`",
                ) from None
    sample = dense_output.sampler(flow, knots, path, follow, SUBSTEPS)
    return Solution(steps, METHOD, "symplectic", tolerance, knots, sample)


def march(
    f: Function,
    knots: Sequence[float],
    y: State,
    error: float,
    tell: Callable[[float], None],
    rounding: float = ROUNDING,
) -> tuple[array[float], int]:
    """The states (m n) at equally distant `knots` (m), from y at the first one, and the index of one step.

    That step was predicted worst from the one before: where the equations jump, they do so there.

    Raises TooLong where the error of a step is larger than `error`.
    """
    step, states = stepper(len(y), rounding), array("d", y)
    limit = (error / HIGHEST) ** (STAGES / (2 * STAGES + 1))
    e: State = (0.0,) * len(y)
    sizes = e
    h = (knots[-1] - knots[0]) / max(1, len(knots) - 1)
    worst, record = 0, 0.0
    guess: State = [h * weight * slope for weight in WEIGHTS.tolist() for slope in f(knots[0], *y)]
    for index, t in enumerate(knots[:-1]):
        try:
            if not index % ROUND:
                tell(t)
                noise = runge_kutta.floors(f, t, y, f(t, *y), True, (1,) * len(y), GRAIN)
                floors = [abs(h) * floor for floor in noise]
            made = step(f, t, h, y, e, guess, sizes, floors)
        except NO_VALUE:
            made = None
        if made is None or made[-1] > limit:
            ratio = SAFETY * (limit / made[-1]) ** (1 / STAGES) if made else LEAST
            raise TooLong(index, y, max(LEAST, ratio))
        y, e, guess, sizes, surprise, _ = made
        states.extend(y)
        if index and surprise >= record:
            worst, record = index, surprise
    return states, worst
