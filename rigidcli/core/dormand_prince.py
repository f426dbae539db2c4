"""The explicit Runge-Kutta pair of Dormand and Prince of order 8(5,3): its coefficients, and one step of it.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
section II.5 and appendix, and the program DOP853 there. Stages count from 0. Differences:

- A step is straight-line Python on floats, written for the number of variables: for the few variables
  of mechanics this takes a fifth of the time that arrays take.
- An error is relative to the size of the variable, or of the vector that the variables form together. There
  is no absolute tolerance.
- Nothing is interpolated inside a step: a shorter step of the same method is taken from its beginning, for
  many times at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import accumulate, islice
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Elements, Flow, Function, State, Stop, Stopped, slopes_of

METHOD = "Dormand-Prince 8(5,3)"

# c: where in the step the stages stand.
NODES = (0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 1 / 3, 0.25,
         0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0)  # fmt: skip

# The rows of a, of which row i says how the i stages before make up stage i; then b, which says how all make
# up the step, and b less the weights of the embedded method of order 5.
TABLEAU = """
    0.05260015195876773
    0.0197250569845379 0.0591751709536137
    0.02958758547680685 0 0.08876275643042054
    0.2413651341592667 0 -0.8845494793282861 0.924834003261792
    0.037037037037037035 0 0 0.17082860872947386 0.12546768756682242
    0.037109375 0 0 0.17025221101954405 0.06021653898045596 -0.017578125
    0.03709200011850479 0 0 0.17038392571223998 0.10726203044637328 -0.015319437748624402 0.008273789163814023
    0.6241109587160757 0 0 -3.3608926294469414 -0.868219346841726 27.59209969944671 20.154067550477894
        -43.48988418106996
    0.47766253643826434 0 0 -2.4881146199716677 -0.590290826836843 21.230051448181193 15.279233632882423
        -33.28821096898486 -0.020331201708508627
    -0.9371424300859873 0 0 5.186372428844064 1.0914373489967295 -8.149787010746927 -18.52006565999696
        22.739487099350505 2.4936055526796523 -3.0467644718982196
    2.273310147516538 0 0 -10.53449546673725 -2.0008720582248625 -17.9589318631188 27.94888452941996
        -2.8589982771350235 -8.87285693353063 12.360567175794303 0.6433927460157636
    0.054293734116568765 0 0 0 0 4.450312892752409 1.8915178993145003 -5.801203960010585 0.3111643669578199
        -0.1521609496625161 0.20136540080403034 0.04471061572777259
    0.01312004499419488 0 0 0 0 -1.2251564463762044 -0.4957589496572502 1.6643771824549864
        -0.35032884874997366 0.3341791187130175 0.08192320648511571 -0.022355307863886294
"""
NUMBERS = map(float, TABLEAU.split())
*STAGES, WEIGHTS, ERROR_5 = (np.array([*islice(NUMBERS, size)]) for size in (*range(12), 12, 12))
# The weights of the embedded method of order 3, and b less these.
WEIGHTS_3 = np.array([31 / 127, 0, 0, 0, 0, 0, 0, 0, 1 - 31 / 127 - 3 / 136, 0, 0, 3 / 136])
ERROR_3 = WEIGHTS - WEIGHTS_3

Step: TypeAlias = Callable[
    [Function, float, float, State, State, State, State, float], tuple[float, State, State]
]
"""(f, t, h, y, f(t, y), floors, least, tolerance) -> (error, y(t + h), f(t + h, y(t + h))).

The error is in units of the tolerance. Where it is beyond 1, or NaN, the other results are not to be used.
"""


def slices(blocks: Sequence[int]) -> list[slice]:
    """Where each of adjacent blocks of these sizes is."""
    return [slice(end - size, end) for size, end in zip(blocks, accumulate(blocks), strict=True)]


def _sum(weights: Floats, variable: int) -> str:
    terms = enumerate(weights.tolist())
    return " + ".join(f"{weight!r}*k{stage}_{variable}" for stage, weight in terms if weight)


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
    count, first = sum(blocks), 0
    every = range(count)
    lines = [f"{_row('y', count)} = y", f"{_row('k0_', count)} = k", "a = abs(h)", "lax = tolerance**0.75"]
    for stage, (node, weights) in enumerate(zip(NODES, STAGES, strict=True)):
        if stage:
            arguments = ", ".join(f"y{i} + h*({_sum(weights, i)})" for i in every)
            lines.append(f"{_row(f'k{stage}_', count)} = f(t + {node!r}*h, {arguments})")
    for i in every:
        lines.append(f"s = {_sum(WEIGHTS, i)}")
        lines.append(f"z{i} = y{i} + h*s")
        lines.append(f"p{i} = {_sum(ERROR_5, i)}")
        lines.append(f"q{i} = s - ({_sum(WEIGHTS_3, i)})")
    lines += ["error = 0.0", f"check = {' + '.join(f'z{i}' for i in every)}"]
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
    lines += [f"z = ({_row('z', count)})", "k = f(t + h, *z)", "return error + 0.0*sum(k), z, k"]
    return "\n ".join(["def step(f, t, h, y, k, floors, least, tolerance):", *lines])


def _row(letter: str, count: int) -> str:
    return "".join(f"{letter}{i}, " for i in range(count))


@cache
def stepper(blocks: tuple[int, ...]) -> Step:
    """The code of `source`, ready to run."""
    step: Step = compiled(source(blocks))
    return step


def compiled(text: str) -> Any:
    """The function `step` that a text defines, which was written from tables and sizes alone."""
    names: dict[str, Any] = {"__builtins__": {}, "abs": abs, "hypot": math.hypot, "max": max}
    names |= {"range": range, "sum": sum}
    exec(text, names)  # noqa: S102 - no part of it is anybody's input
    return names["step"]


COLUMNS = 16
"""Arrays of states have a multiple of so many columns in products with the tableau.

A product of matrices adds up the last columns beyond such a multiple in another order: then a solution would
depend on the place of its column.
"""


def padded(count: int) -> NDArray[np.int_]:
    """The numbers below `count`, the last of them repeated up to a multiple of COLUMNS."""
    return np.minimum(np.arange(-(-count // COLUMNS) * COLUMNS), count - 1)


# Where arrays keep the stages. Stages 1 and 2 share a place, as no row of the tableau has both.
PLACES = np.array([1, 0, 0, *range(2, 11)])


class ArraySteps:
    """Steps of the method for m columns at once, from states (n by m), each by a length of its own (m).

    m is a multiple of COLUMNS. The arrays in which a step is worked out are used again for the next one, as
    new memory would cost as much as the arithmetic. `increments` (11 by n by m) are h times the stages.
    Errors are in units of the `tolerance` (m), and `parts` are the rows of each block.
    """

    def __init__(
        self, f: Elements, shape: tuple[int, ...], tolerance: Floats | float = 1, parts: Sequence[slice] = ()
    ) -> None:
        self.f, self.shape, self.tolerance, self.parts = f, shape, tolerance, parts
        self.lax, self.ones = np.power(tolerance, 0.75), np.ones(shape[0])
        self.increments = np.empty((len(STAGES) - 1, *shape))
        self.state, self.time = np.empty(shape), np.empty(shape[1])
        # Loops over rows of arrays make views of them, which takes as long as the arithmetic of a short row.
        self.rows, self.flat = list(self.state), self.state.reshape(-1)
        targets = [list(self.increments[place]) for place in PLACES[1:]]
        self.plan = [*zip(map(self.part, STAGES[1:]), NODES[1:], targets, strict=True)]
        self.step, *self.errors = map(self.part, (WEIGHTS, ERROR_5, ERROR_3))

    def part(self, weights: Floats) -> tuple[Floats, Floats]:
        """The weights from the first to the last that is not zero, by their places, and those increments."""
        used, every = np.flatnonzero(weights), np.zeros(len(self.increments))
        every[PLACES[used]] = weights[used]
        places = slice(PLACES[used].min(), PLACES[used].max() + 1)
        return every[places], self.increments.reshape(len(every), -1)[places]

    def total(self, part: tuple[Floats, Floats]) -> Floats:
        """The sum (n by m) of some increments with their weights."""
        weights, increments = part
        total: Floats = weights.dot(increments).reshape(self.shape)
        return total

    def after(self, t: Floats, h: Floats, y: Floats, k: Floats) -> Floats:
        """The states after the steps from y, where the slope is k; the increments are kept."""
        f, rows, state, time, add, multiply = self.f, self.rows, self.state, self.time, np.add, np.multiply
        multiply(k, h, self.increments[PLACES[0]])
        for (weights, increments), node, targets in self.plan:
            weights.dot(increments, self.flat)
            add(state, y, state)
            add(multiply(h, node, time), t, time)
            for slope, target in zip(f(time, *rows), targets, strict=True):
                multiply(slope, h, target)
        return y + self.total(self.step)

    def with_error(
        self, t: Floats, h: Floats, y: Floats, k: Floats, sizes: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """The errors (m) of the steps, the states after them, and their slopes, as `Step` has them.

        `sizes` (blocks by m) are those to which errors of blocks are relative at least.
        """
        after = self.after(t, h, y, k)
        p, q = (norms(self.total(part), self.parts) for part in self.errors)
        for states in (self.increments[PLACES[0]], y, after):
            sizes = np.maximum(sizes, norms(states, self.parts))
        # p^2/sqrt(p^2 + 0.01 q^2), in a form in which no square vanishes.
        errors = np.where(p == 0, 0.0, np.fmax(p / np.sqrt(1 + np.square(0.1 * q / p)), q * self.lax))
        slopes = slopes_of(self.f, t + h, after)
        # Of a number that is not finite, nought times it is NaN.
        check = 0.0 * self.ones.dot(after + slopes)
        return (errors / sizes).max(axis=0) / self.tolerance + check, after, slopes


def array_step(f: Elements, t: Floats, h: Floats, y: Floats) -> Floats:
    """One step of the method for each column: from y (n by m) at t (m) by h (m), for any m."""
    every = padded(len(t))
    t, h, y, count = t[every], h[every], y[:, every], len(t)
    return ArraySteps(f, y.shape).after(t, h, y, slopes_of(f, t, y))[:, :count]


def norms(rows: Floats, parts: Sequence[slice]) -> Floats:
    """The norm (any by blocks by m) of each block of rows (any by n by m)."""
    if parts[-1].stop == len(parts):  # each is of one row
        return np.abs(rows[..., : len(parts), :])
    return np.stack([np.hypot.reduce(rows[..., part, :], axis=-2) for part in parts], axis=-2)


# Floats of the states that are sampled at once, so that the arrays of the stages stay in the cache.
SAMPLED_AT_ONCE = 32_768


def sampler(flow: Flow, knots: Floats, states: Floats, parts: int = 1) -> Callable[[Floats], Floats]:
    """A function from times (k) to states (k by n), where steps begin at `knots` (m) from `states` (m by n).

    From the knot before, `parts` steps of the method go there, for many times at once.
    """
    f, ahead, count = flow(np), 1.0 if knots[-1] >= knots[0] else -1.0, states.shape[1]
    block = max(1, SAMPLED_AT_ONCE // count)

    def sample(times: Floats) -> Floats:
        result = np.empty((len(times), count))
        for start in range(0, len(times), block):
            part = times[start : start + block]
            index = np.searchsorted(ahead * knots, ahead * part, side="right") - 1
            t, h, y = knots[index], (part - knots[index]) / parts, np.ascontiguousarray(states[index].T)
            with np.errstate(all="ignore"):
                for leap in range(parts):
                    y = array_step(f, t + leap * h, h, y)
            result[start : start + block] = y.T
        lost = ~np.isfinite(result).all(axis=1)
        if lost.any():
            raise Stopped("the solution", Stop.NO_VALUE, float(times[lost][0]))
        return result

    return sample
