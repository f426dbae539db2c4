"""The solution of z' = A z + b, with constant A and b, by the exponential of A: z(t + h) = exp(A h) z(t).

A further variable that stays 1 carries b. A time is written in binary digits of the end: the exponentials of
a half, a quarter, ... of the whole span follow from each other by squares, and a Taylor series does the rest.
So neither long spans nor rates of very different sizes take more than a few factors, whose number follows
from the rates, which are the same in any units. The exponentials have twice the digits of a float.
"""

from __future__ import annotations

import math

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import Solution, largest

METHOD = "matrix exponential"

MOST_HALVES = 50  # the most halves of a span: the floats of times have no more digits
# Halves beyond a radian of the fastest rate: equal rates make powers of t, with which the series grows, too.
FURTHER_HALVES = 5
MOST_KNOTS = 200_000  # the most times of a solution at which it is looked at


def rate(matrix: Floats) -> float:
    """The largest rate of z' = A z, be it of growth, decay or rotation (1/s)."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def solve(matrix: Floats, offset: Floats, start: Floats, end: float, finer: float = 1.0) -> Solution | None:
    """z(t) from `start` (n) at t = 0 to the `end`, where A is `matrix` (n by n) and b is `offset` (n).

    The span that is halved is longer than the end by the factor `finer`, so that two solutions have other
    factors. None where the motion grows beyond the range of floats.
    """
    from flint import arb, arb_mat, ctx

    size = len(start)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = matrix, offset
    span, turns = finer * end, rate(matrix) * end
    halves = min(MOST_HALVES, math.ceil(math.log2(max(finer * turns, 1.0))) + FURTHER_HALVES)
    # exp(A span/2), exp(A span/4), ...: so many as floats, and what these have lost in rounding.
    factors: list[tuple[Floats, Floats]] = []
    with ctx.workprec(128 + 2 * halves):
        exact = (arb_mat(whole.tolist()) * (arb(span) / 2**halves)).exp()
        for _ in range(halves):
            near = np.array([[float(entry) for entry in row] for row in exact.tolist()])
            left = np.array((exact - arb_mat(near.tolist())).tolist(), dtype=np.float64)
            factors.insert(0, (near, left))
            exact = exact * exact
    first = np.append(start, 1.0)

    def sample(times: Floats) -> Floats:
        left = times / span
        states = np.tile(first[:, None], len(times))
        with np.errstate(all="ignore"):
            for forward, rest in factors:
                left = 2 * left
                go = left >= 1
                states[:, go] = forward @ states[:, go] + rest @ states[:, go]
                left = left - go
            term, left = states, left * (span / 2.0**halves)
            for n in range(1, 20):  # 1/20! is below the rounding of floats
                term = whole @ term * (left / n)
                states = states + term
        return np.asarray(states[:size].T)

    knots = np.linspace(0.0, end, min(math.ceil(turns) + 2, MOST_KNOTS))
    states = sample(knots[:: 1 + len(knots) // 1024])
    if not np.isfinite(states).all() or not np.isfinite(sample(knots[-1:])).all():
        return None
    return Solution(len(knots) - 1, METHOD, "runge-kutta", EPS, knots, sample, largest(states))
