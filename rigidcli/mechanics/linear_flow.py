"""The solution of z' = A z + b, with constant A and b, by the exponential of A: z(t + h) = exp(A h) z(t).

A further variable that stays 1 carries b. A is balanced first: coordinates and momenta in unlike units would
make its norm, and so the number of steps, larger than its rates are. The exponential has twice the digits of
a float, as an error of it would add up with each step.
"""

from __future__ import annotations

import math

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import MOST_STEPS, Solution, largest

METHOD = "matrix exponential"


def solve(matrix: Floats, offset: Floats, start: Floats, end: float, finer: float = 1.0) -> Solution | None:
    """z(t) from `start` (n) at t = 0 to the `end`, where A is `matrix` (n by n) and b is `offset` (n).

    A step is as long as the inverse of the norm of A, or shorter by the factor `finer`. None where there are
    too many steps, or the motion grows beyond the range of floats.
    """
    size = len(start)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = matrix, offset
    scale = _balance(whole)
    steps = finer * float(np.linalg.norm(whole, 1)) * end
    if not steps < MOST_STEPS:
        return None
    knots = np.linspace(0.0, end, math.ceil(steps) + 2)
    step = float(knots[1])
    forward, rest = _exponential(whole, step)
    states = np.empty((len(knots), size + 1))
    states[0] = np.append(start, 1.0) / scale
    with np.errstate(all="ignore"):
        for k in range(1, len(knots)):
            states[k] = forward @ states[k - 1] + rest @ states[k - 1]

    def sample(times: Floats) -> Floats:
        place = np.minimum((times / step).astype(int), len(knots) - 1)
        left = (times - knots[place])[:, None]
        term = states[place]
        total = term
        for n in range(1, 20):  # 1/20! is below the rounding of floats
            term = term @ whole.T * (left / n)
            total = total + term
        return np.asarray((total * scale)[:, :size])

    if not np.isfinite(states).all():
        return None
    return Solution(
        len(knots) - 1, METHOD, "runge-kutta", EPS, knots, sample, largest(states[:, :size] * scale[:size])
    )


def _balance(matrix: Floats) -> Floats:
    """Units of the variables, as powers of two, in which a row is as long as its column; `matrix` is changed.

    Source: E. E. Osborne, J. ACM 7 (1960) 338.
    """
    scale, settled = np.ones(len(matrix)), False
    while not settled:
        settled = True
        for i in range(len(matrix)):
            column, row = (float(np.abs(np.delete(line, i)).sum()) for line in (matrix[:, i], matrix[i]))
            unit = 2.0 ** round(math.log2(row / column) / 2) if row and column else 1.0
            if unit != 1:
                scale[i] *= unit
                matrix[:, i] *= unit
                matrix[i] /= unit
                settled = False
    return scale


def _exponential(matrix: Floats, time: float) -> tuple[Floats, Floats]:
    """exp(matrix time) as floats, and what these have lost in rounding."""
    from flint import arb, arb_mat, ctx

    with ctx.workprec(128):
        exact = (arb_mat(matrix.tolist()) * arb(time)).exp()
        near = np.array([[float(entry) for entry in row] for row in exact.tolist()])
        return near, np.array((exact - arb_mat(near.tolist())).tolist(), dtype=np.float64)
