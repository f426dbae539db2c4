"""The implicit method Radau IIA of order 5, by scipy: its steps are not held back by stability.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8, and scipy's `Radau`.
Difference: an error is relative to the largest size that a variable has had, as it may pass zero.
"""

from __future__ import annotations

from array import array
from contextlib import suppress
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE, InitialValues, Solution, TooManySteps, largest, stopped

METHOD = "Radau IIA of order 5 (scipy)"

LEAST_TOLERANCE = 1e-10  # The least error of a step: below it, this method takes very many steps.
MOST_IMPLICIT_STEPS = 100_000  # The most steps where this method is asked for: each takes some milliseconds.
MOST_TRIED = 20_000  # The most steps where this method is tried after another one: they take seconds.
# Steps after which it is estimated whether the most steps reach the end: these take a second.
CHECKED_AFTER = (256, 2048)


def solve(problem: InitialValues, most: int = MOST_IMPLICIT_STEPS) -> Solution:
    """The solution of a problem in at `most` so many steps.

    Raises:
        Stopped: there is no solution as far as t1.
        TooManySteps: there are more, or will be if they go on as they are.
    """
    from scipy.integrate import OdeSolution, Radau

    start, (t0, t1), longest, name = problem.start, problem.span, problem.longest, problem.name
    f, count = problem.function(), len(start)

    def slopes(t: float, y: Floats) -> Floats:
        try:
            return np.array(f(t, *y.tolist()), dtype=np.float64)
        except NO_VALUE:
            return np.full(count, np.nan)

    rate = np.abs(slopes(t0, start))
    sizes = np.maximum(np.abs(start), 1e-3 * rate * min(abs(t1 - t0), longest))
    sizes = np.where(sizes > 0, sizes, max(float(sizes.max()), 1.0))
    tolerance = max(problem.tolerance, LEAST_TOLERANCE)
    with np.errstate(all="ignore"):
        solver: Any = Radau(
            slopes, t0, start, t1, max_step=longest, rtol=tolerance, atol=tolerance * sizes.min()
        )
        solver.atol = tolerance * sizes
        times, states, polynomials = array("d", [t0]), array("d", start), list[Any]()
        while solver.status == "running":
            with suppress(ValueError, ArithmeticError, np.linalg.LinAlgError):  # of what is not finite
                solver.step()
            if solver.t == times[-1]:
                raise stopped(f, times[-1], solver.y.tolist(), t1 - t0, name)
            times.append(float(solver.t))
            states.extend(solver.y)
            polynomials.append(solver.dense_output())
            sizes = np.maximum(sizes, np.abs(solver.y))
            solver.atol = tolerance * sizes
            taken = len(times) - 1
            if taken >= most or (
                taken in CHECKED_AFTER and taken * abs(t1 - t0) > most * abs(times[-1] - t0)
            ):
                raise TooManySteps(name, taken, times[-1], t1, most)
            if not taken % 64:
                problem.tell(times[-1])
    knots, path = np.frombuffer(times), np.frombuffer(states).reshape(-1, count)
    between = OdeSolution(knots, polynomials)
    steps, sizes = len(polynomials), largest(path)
    return Solution(steps, METHOD, "stiff", tolerance, knots, lambda times: between(times).T, sizes)
