"""Symplectic integration by Gauss-Legendre collocation with six stages, of order 12, in steps of one length.

The method preserves the area of phase space for every Hamiltonian, separable or not, so that the error of the
energy does not grow with time, however long that is. Each step is undone by the step back in time.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd edition, sections II.1.3 (the
method), VI.4 (why it is symplectic), VIII.5 (compensated summation) and VIII.6 (iteration of the stages).
Differences:

- The length of the steps is found by trial: when the error of a step is too large, the whole solution
  begins again with shorter steps, as two lengths in one solution are not symplectic.
- A step is straight-line Python on floats, as in `dormand_prince`: arrays would take six times as long.
- Increments of stages are summed with weights whose pairs are 1 together in floats, exactly, so that rounding
  leaves the method symplectic: M. Antonana, J. Makazaga, A. Murua, Numerical Algorithms 76 (2017) 861.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from rigidcli.core import dormand_prince, runge_kutta
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.solution import (
    MOST_NUMBERS,
    NO_VALUE,
    Flow,
    Function,
    InitialValues,
    Solution,
    State,
    TooManySteps,
    largest,
)
from rigidcli.errors import ComputationError

METHOD = "Gauss-Legendre 12"

MOST_EQUAL_STEPS = 3_000_000  # The most steps: enough for 1e5 turns of a planet, and done in some minutes.
STAGE_COUNT = 6  # Stages of a step. The order of the method is twice as large.
# The zeros of the Legendre polynomial of degree 6, and the weights of quadrature on [-1, 1].
POINTS, DOUBLE_WEIGHTS = leggauss(STAGE_COUNT)
# c and b: where in the step the stages stand, and the weights of their slopes.
NODES, WEIGHTS = (1 + POINTS) / 2, DOUBLE_WEIGHTS / 2
# The Legendre polynomials of degrees 0 to 6 (columns) at the points (rows).
POLYNOMIALS = legvander(POINTS, STAGE_COUNT)
# The matrix from increments h b f of the stages (a row) to Legendre coefficients of h f in the step.
SERIES = POLYNOMIALS[:, :-1] * (2 * np.arange(STAGE_COUNT) + 1)
# The matrix from increments of a step (a column) to those of the next, by the polynomial of the slopes.
EXTRAPOLATION = WEIGHTS[:, None] * legvander(POINTS + 2, STAGE_COUNT - 1) @ SERIES.T

# a_ij / b_j: the share of stage i (rows) in the increment of stage j (columns). The method is symplectic as
# a_ij/b_j + a_ji/b_i = 1. The shares below the diagonal are about 1, and 1 minus them is free of rounding.
_INTEGRALS = (POLYNOMIALS[:, 2:] - POLYNOMIALS[:, :-2]) / (4 * np.arange(1, STAGE_COUNT) + 2)
_LOWER = np.tril(np.column_stack([NODES, _INTEGRALS]) @ SERIES.T, -1)
SHARES = _LOWER + np.eye(STAGE_COUNT) / 2 + np.tril(1 - _LOWER, -1).T

EqualStep: TypeAlias = Callable[
    [Function, float, float, State, State, State, State, State],
    tuple[State, State, State, State, float] | None,
]
"""(f, t, h, y, e, guess, sizes, floors) -> (y(t + h), e, guess, sizes, c), or None without convergence.

y + e is the state: what y alone has lost in rounding is in e. A guess is of the increments h b f of all
stages, one stage after the other; the one returned is for the next step. `sizes` (n) are the largest that the
variables, or h times their slopes, have been of late, but not less than `floors` (n), of which a millionth
is rounding errors of h f. In units of these sizes, c is the highest Legendre coefficient of h f.
"""


class TooLong(Exception):  # noqa: N818 - an outcome, named for what has happened
    """A step is too long: its index, and the number by which its length should be multiplied."""


def solve(problem: InitialValues, like: Solution | None = None) -> Solution:
    """The solution of a problem in steps of one length; of fewer steps if it is `like` another solution.

    The error of the energy stays about at the tolerance, relative to the energy of the motion.

    Raises:
        Stopped: the solution does not begin.
        TooManySteps: it reaches t1 only after more than MOST_EQUAL_STEPS steps.
        ComputationError: it needs steps so short in places that one length is not the way to take them.
    """
    (t0, t1), y, name = problem.span, tuple(problem.start.tolist()), problem.name
    problem.function()  # where it has no value at the start, there is no solution
    most = min(MOST_EQUAL_STEPS, MOST_NUMBERS // len(y))
    # The errors of a few steps add up; rounding leaves 2e-14. With 3e-12 there are more than ten steps in a
    # period: where these are few, and a whole number of them is nearly a period, errors add up for long.
    error, fewest = min(max(0.03 * problem.tolerance, 2e-14), 3e-12), math.inf
    # The first try has few steps, as too few are noticed in the first of them.
    steps = max(16, math.ceil(abs(t1 - t0) / problem.longest)) if t0 != t1 else 0
    if like is not None:
        steps, error = math.ceil(0.7 * like.steps), math.inf  # its errors are 70 times as large
    while True:
        knots = np.linspace(t0, t1, steps + 1)
        if steps > most:
            raise TooManySteps(name, most, float(knots[most]), t1, most)
        try:
            path = march(problem.flow, knots, y, error, problem.tell)
            break
        except TooLong as long:
            index, ratio = long.args
            fewest = min(fewest, steps) if index else fewest
            steps = math.ceil(steps / ratio)
            # This is enough for an orbit of eccentricity 0.99 that begins at its far end.
            if steps * 1e-4 > fewest:
                near = float(knots[index])
                raise ComputationError(
                    f"{name} has no steps of one length: they are too short near t = {near:.6g}",
                    hint="take the method `auto`",
                ) from None
    # Four steps of the other method lead to a time inside a step as accurately as its ends are.
    sample = dormand_prince.sampler(problem.flow, knots, path, parts=4)
    return Solution(steps, METHOD, "symplectic", problem.tolerance, knots, sample, largest(path))


def march(flow: Flow, knots: Floats, y: State, error: float, tell: Callable[[float], None]) -> Floats:
    """The states (m by n) at equally distant `knots` (m), from y at the first one.

    Raises TooLong where the error of a step is larger than `error`.
    """
    f, elements, step, states = flow(math), flow(np), stepper(len(y)), array("d", y)
    # In units of c^(13/6), where c is the highest Legendre coefficient of h f, the error of a step is 0.0048
    # for the exponential function, and 0.0038 for one with a pole.
    limit = (error / 0.005) ** (STAGE_COUNT / (2 * STAGE_COUNT + 1))
    e: State = (0.0,) * len(y)
    sizes = e
    h = float(knots[-1] - knots[0]) / max(1, len(knots) - 1)
    times = knots.tolist()
    guess: State = [h * weight * slope for weight in WEIGHTS.tolist() for slope in f(times[0], *y)]
    for index, t in enumerate(times[:-1]):
        try:
            if not index % 256:
                tell(t)
                at, state = np.array([t]), np.array(y)[:, None]
                noise = runge_kutta.rounding_errors(elements, None, at, h, state, len(y))
                floors = (2e6 * abs(h) * noise[:, 0]).tolist()
            made = step(f, t, h, y, e, guess, sizes, floors)
        except NO_VALUE:
            made = None
        if made is None or made[-1] > limit:
            raise TooLong(index, max(0.3, 0.9 * (limit / made[-1]) ** (1 / STAGE_COUNT)) if made else 0.3)
        y, e, guess, sizes, _ = made
        states.extend(y)
    return np.frombuffer(states).reshape(len(knots), -1)


def source(count: int) -> str:
    """The text of a `Step` of so many variables; it holds nothing but the coefficients.

    In it, y is the state before and z after the step, l0 to l5 are the increments, o is that of the
    last stage in the sweep before, w is what is within rounding errors, and m are the sizes.
    """
    every, stages, last = range(count), range(STAGE_COUNT), STAGE_COUNT - 1
    reach = float(1 / WEIGHTS[last])
    increments = "".join(f"l{j}_{i}, " for j in stages for i in every)

    def row(letter: str) -> str:
        return "".join(f"{letter}{i}, " for i in every)

    def mixed(weights: Iterable[Any], i: int) -> str:
        return " + ".join(f"{float(weight)!r}*l{j}_{i}" for j, weight in enumerate(weights))

    lines = [f"{row('y')} = y", f"{row('e')} = e", f"{row('m')} = sizes", f"{increments} = guess"]
    for i in every:
        lines.append(f"a = max(abs(y{i}), abs(l{last}_{i})*{reach}, m{i})")
        lines.append(f"w{i} = {EPS / 2!r}*a + 1e-6*floors[{i}]")
    # The iteration takes 4 to 20 sweeps where it converges.
    lines += ["settled = False", "for sweep in range(60):"]
    lines += [f" o{i} = l{last}_{i}" for i in every]
    for j in stages:
        arguments = ", ".join(f"y{i} + ({mixed(SHARES[j], i)})" for i in every)
        lines.append(f" {row(f'l{j}_')} = f(t + {float(NODES[j])!r}*h, {arguments})")
        lines += [f" l{j}_{i} *= {float(WEIGHTS[j])!r}*h" for i in every]
    # One sweep more, after what is left to find is within rounding errors.
    lines.append(" if settled: break")
    lines.append(f" settled = {' and '.join(f'abs(l{last}_{i} - o{i}) <= w{i}' for i in every)}")
    lines += ["else: return None", "c = 0.0"]
    for i in every:
        lines.append(f"d = e{i} + ({' + '.join(f'l{j}_{i}' for j in stages)})")
        lines.append(f"z{i} = y{i} + d")
        lines.append(f"e{i} = (y{i} - z{i}) + d")
        lines.append(f"d = abs({mixed(SERIES[:, -1], i)})")
        # A variable that passes zero keeps some of the size that it had.
        lines.append(f"m{i} = max(abs(z{i}), abs(l{last}_{i})*{reach}, 0.8*m{i}, floors[{i}])")
        lines.append(f"if d > c*m{i}: c = d/max(d, m{i})")
    # Nought times what is not finite is NaN.
    lines.append(f"if 0.0*({' + '.join(f'z{i}' for i in every)}) != 0.0: return None")
    guess = "".join(f"{mixed(EXTRAPOLATION[j], i)}, " for j in stages for i in every)
    lines.append(f"return ({row('z')}), ({row('e')}), ({guess}), ({row('m')}), c")
    return "\n ".join(["def step(f, t, h, y, e, guess, sizes, floors):", *lines])


@cache
def stepper(count: int) -> EqualStep:
    """The code of `source`, ready to run."""
    step: EqualStep = dormand_prince.compiled(source(count))
    return step
