"""Gauss-Legendre collocation with six stages, of order 12: its coefficients, and generated code for a step.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd edition, sections II.1.3 (the
method), VIII.5 (compensated summation) and VIII.6 (iteration of the stages and where it starts). Differences:

- Increments of stages are summed with weights whose pairs are 1 together in floats, exactly, so that rounding
  leaves the method symplectic: M. Antonana, J. Makazaga, A. Murua, Numerical Algorithms 76 (2017) 861.
- The iteration takes what it has found of a stage for the next one, at once. It ends one sweep after
  what is left to find is within rounding errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import ROUNDING, Elements, Function, State

METHOD = "Gauss-Legendre 12"

NODES = (
    0.03376524289842399,
    0.16939530676686773,
    0.38069040695840156,
    0.6193095930415985,
    0.8306046932331322,
    0.966234757101576,
)
"""c: where in the step the stages stand, the zeros of the Legendre polynomial of degree 6."""

WEIGHTS = (
    0.08566224618958518,
    0.1803807865240693,
    0.23395696728634552,
    0.23395696728634552,
    0.1803807865240693,
    0.08566224618958518,
)
"""b: the weights of the slopes."""

LOWER = (
    (),
    (1.0818475530664537,),
    (0.9601420260544555, 1.0867685306776687),
    (1.0242303450725845, 0.9557048616228526, 1.087548270022611),
    (0.9841755135338738, 1.027093755505859, 0.9557048616228526, 1.0867685306776687),
    (1.0094881958787998, 0.9841755135338738, 1.0242303450725845, 0.9601420260544555, 1.0818475530664537),
)
"""a_ij / b_j for j < i."""

COUNT = len(NODES)

SHARES = tuple(
    tuple(LOWER[i][j] if j < i else 0.5 if j == i else 1.0 - LOWER[j][i] for j in range(COUNT))
    for i in range(COUNT)
)
"""a_ij / b_j: the share of the increment of stage j that stage i has. That of i and j, and that of
j and i, are 1 together: this makes the method symplectic."""

EXTRAPOLATION = tuple(
    tuple(
        WEIGHTS[i]
        / WEIGHTS[j]
        * math.prod((1 + NODES[i] - c) / (NODES[j] - c) for c in NODES if c != NODES[j])
        for j in range(COUNT)
    )
    for i in range(COUNT)
)
"""The increments of the next step, by the polynomial through the slopes of this one."""

SWEEPS = 60
"""An iteration that takes more does not converge."""

LAST = 1
"""Sweeps after all that is left to find is within rounding errors."""

Step: TypeAlias = Callable[
    [Function, float, float, State, State, State, State, float], tuple[State, State, State, float, int] | None
]
"""(f, t, h, y, e, guess, floors, grain) -> (y(t + h), e, guess, surprise, sweeps), or None: it has no end.

y + e is the state: what y alone has lost in rounding is in e. A guess is of the increments h b f of all
stages, one stage after the other; that which is returned is for the next step. What is below `floors` (n)
need not be followed to the tolerance: `grain` of it is rounding errors. The surprise is by how much the
guess for the last stage was wrong, relative to the variable.
"""


def source(count: int) -> str:
    """The text of a `Step` of so many variables; it holds nothing but the coefficients.

    In it, y is the state before and z after the step, l0 to l5 are the increments, o is that of the
    last stage in the sweep before, w is what is within rounding errors, and m what errors are relative to.
    """
    every, stages, last = range(count), range(COUNT), COUNT - 1
    increments = "".join(f"l{j}_{i}, " for j in stages for i in every)

    def row(letter: str) -> str:
        return "".join(f"{letter}{i}, " for i in every)

    def mixed(weights: Sequence[float], i: int) -> str:
        return " + ".join(f"{weight!r}*l{j}_{i}" for j, weight in enumerate(weights))

    lines = [f"{row('y')} = y", f"{row('e')} = e", f"{increments} = guess"]
    for i in every:
        lines.append(f"a = max(abs(y{i}), abs(l{last}_{i})*{1 / WEIGHTS[last]!r})")
        lines.append(f"m{i}, w{i} = max(a, floors[{i}]), {ROUNDING / 2!r}*a + grain*floors[{i}]")
    lines += ["settled = 0", f"for sweep in range({SWEEPS}):"]
    lines += [f" o{i} = l{last}_{i}" for i in every]
    for j in stages:
        arguments = ", ".join(f"y{i} + ({mixed(SHARES[j], i)})" for i in every)
        lines.append(f" {row(f'l{j}_')} = f(t + {NODES[j]!r}*h, {arguments})")
        lines.append(f" w = {WEIGHTS[j]!r}*h")
        lines += [f" l{j}_{i} *= w" for i in every]
    lines.append(" if not sweep:")
    lines.append("  surprise = 0.0")
    for i in every:
        lines.append(f"  d = abs(l{last}_{i} - o{i})")
        lines.append(f"  if d > surprise*m{i}: surprise = d/max(d, m{i})")
    lines.append(f" if settled or {' and '.join(f'abs(l{last}_{i} - o{i}) <= w{i}' for i in every)}:")
    lines.append(f"  if settled == {LAST}: break")
    lines.append("  settled += 1")
    lines.append("else: return None")
    for i in every:
        lines.append(f"d = e{i} + ({' + '.join(f'l{j}_{i}' for j in stages)})")
        lines.append(f"z{i} = y{i} + d")
        lines.append(f"e{i} = (y{i} - z{i}) + d")
    # Nought times what is not finite is NaN.
    lines.append(f"if 0.0*({' + '.join(f'z{i}' for i in every)}) != 0.0: return None")
    guess = "".join(f"{mixed(EXTRAPOLATION[j], i)}, " for j in stages for i in every)
    lines.append(f"return ({row('z')}), ({row('e')}), ({guess}), surprise, sweep + 1")
    return "\n ".join(["def step(f, t, h, y, e, guess, floors, grain):", *lines])


@cache
def stepper(count: int) -> Step:
    """The code of `source`, ready to run."""
    names: dict[str, Any] = {"__builtins__": {}, "abs": abs, "max": max, "range": range}
    exec(source(count), names)  # noqa: S102 - written above, from constant tables and the count alone
    step: Step = names["step"]
    return step


def leap(f: Elements, sweeps: int, t: Floats, h: Floats, y: Floats) -> Floats:
    """One step for each column: from y (n by k) at t (k) by h (k).

    All stages are iterated in so many sweeps, lest one column depend on the others.
    """

    def put(increments: Floats, weight: float, slopes: tuple[Any, ...]) -> None:
        for row, slope in zip(increments, slopes, strict=True):
            row[:] = weight * h * slope

    stages = [np.empty(y.shape) for _ in WEIGHTS]
    slopes = f(t, *y)
    for increments, weight in zip(stages, WEIGHTS, strict=True):
        put(increments, weight, slopes)
    for _ in range(sweeps):
        for increments, node, weight, shares in zip(stages, NODES, WEIGHTS, SHARES, strict=True):
            # Added one by one, for the same reason as ever so many sweeps.
            moves = sum(share * other for share, other in zip(shares, stages, strict=True))
            put(increments, weight, f(t + node * h, *(y + moves)))
    total: Floats = y + sum(stages)
    return total
