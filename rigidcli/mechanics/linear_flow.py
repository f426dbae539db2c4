"""The solution of z' = A z + b, with constant A and b, by the exponential of A: z(t + h) = exp(A h) z(t).

A further variable that stays 1 carries b. A is balanced first: coordinates and momenta in unlike units would
make its norm, and so the number of steps, larger than its rates are.
"""

from __future__ import annotations

import math

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import Solution

METHOD = "matrix exponential"

MOST_STEPS = 1_000_000
"""The most steps, as of the integrators: the states at their ends are kept."""

TERMS = 20
"""Terms of the series between two steps: 1/20! is below the rounding of floats."""


def solve(matrix: Floats, offset: Floats, start: Floats, end: float, finer: float = 1.0) -> Solution | None:
    """z(t) from `start` (n) at t = 0 to the `end`, where A is `matrix` (n by n) and b is `offset` (n).

    A step is as long as the inverse of the norm of A, or shorter by the factor `finer`. None where there are
    too many steps, or the motion grows beyond the range of floats.
    """
    from scipy.linalg import expm, matrix_balance

    size = len(start)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = matrix, offset
    balanced, (scale, _) = matrix_balance(whole, permute=False, separate=True)
    whole = np.asarray(balanced, dtype=np.float64)
    steps = finer * float(np.linalg.norm(whole, 1)) * end
    if not steps < MOST_STEPS:
        return None
    knots = np.linspace(0.0, end, math.ceil(steps) + 2)
    step = float(knots[1])
    forward = expm(whole * step)
    states = np.empty((len(knots), size + 1))
    states[0] = np.append(start, 1.0) / scale
    for k in range(1, len(knots)):
        states[k] = forward @ states[k - 1]

    def sample(times: Floats) -> Floats:
        place = np.minimum((times / step).astype(int), len(knots) - 1)
        left = (times - knots[place])[:, None]
        term = found = states[place]
        for n in range(1, TERMS):
            term = term @ whole.T * (left / n)
            found = found + term
        return np.asarray((found * scale)[:, :size])

    if not np.isfinite(states).all():
        return None
    return Solution(len(knots) - 1, METHOD, "runge-kutta", EPS, knots, sample)
