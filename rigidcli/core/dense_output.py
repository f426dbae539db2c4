"""A solution at any time, from its steps by the pair of Dormand and Prince.

Unlike in DOP853, nothing is interpolated between the ends of a step. A shorter step of the same method is
taken from its beginning, for all times at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.dormand_prince import array_step, stepper
from rigidcli.core.runge_kutta import LEAST
from rigidcli.core.solution import NO_VALUE, Flow, Function, State

ANY_ERROR = 1e100
"""A tolerance with which every step is good, and errors are still in the range of floats."""

BLOCK = 32_768
"""Floats of the states that are sampled at once, so that the arrays of the stages stay in the cache."""


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
                    y = array_step(f, t + leap * h, h, y)
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
