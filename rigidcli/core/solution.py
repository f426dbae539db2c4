"""A problem with initial values, its solution at any time, and why there may be none."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.errors import ComputationError

# f(t, y1, ..., yn) -> (dy1, ..., dyn), for one kind of number.
Elements: TypeAlias = Callable[..., tuple[Any, ...]]

Flow: TypeAlias = Callable[[ModuleType], Elements]
"""The right-hand side of y' = f(t, y1, ..., yn), written once for all kinds of number.

From `math` it makes an f that takes floats, from `numpy` one for arrays of one shape (a derivative may
be a single number), from `heyoka` one for its expressions; f returns the n derivatives. Where there is no
finite real value, that of `math` raises an ArithmeticError or a ValueError, or gives inf or NaN, and that of
`numpy` gives inf or NaN. A flow that cannot be written with a module's functions raises a
ComputationError when it is given the module.
"""

Function: TypeAlias = Callable[..., Sequence[float]]  # f(t, y1, ..., yn) -> (dy1, ..., dyn) in floats.

State: TypeAlias = Sequence[float]

# The method of integration; `auto` is the first of the next ones that pays.
Engine: TypeAlias = Literal["auto", "runge-kutta", "taylor", "symplectic", "stiff"]


class InitialValues(NamedTuple):
    """A problem for any method: y' = f(t, y), y(t0) = `start` (n), over the `span` (t0, t1).

    `tolerance` bounds the error of a step, relative to each of the `blocks` of adjacent variables, of these
    sizes; `longest` bounds its length. A step ends at each of the `stops`, times on the way in the order in
    which they come. `roundings` gives the rounding errors of f, in units of those of one operation: no step
    is short for those of small differences. `project` moves the state (n) after each step, as constraints
    need it, by about the error of the step. `name` is for messages, and `tell` is given times reached, which
    begin anew when the solution does.
    """

    flow: Flow
    start: Floats
    span: tuple[float, float]
    tolerance: float
    blocks: tuple[int, ...]
    longest: float = math.inf
    stops: Sequence[float] = ()
    roundings: Flow | None = None
    project: Callable[[float, State], State] | None = None
    name: str = "the solution"
    tell: Callable[[float], None] = lambda t: None

    def function(self) -> Function:
        """f in floats. Raises Stopped where it has no value at the start."""
        f = self.flow(math)
        if not finite(f, self.span[0], self.start.tolist()):
            raise Stopped(self.name, Stop.AT_START, self.span[0])
        return f


# What functions of floats raise where they have no finite real value.
NO_VALUE = (ArithmeticError, ValueError)
MOST_NUMBERS = 200_000_000  # The most floats that one solution keeps of its steps: they take 1.6 GB.
MOST_STEPS = 1_000_000  # The most steps of a solution: in Python they take half a minute.
# Steps after which, and after each further power of two, it is estimated whether the end can be reached.
FIRST_OUTLOOK = 1 << 13
SHORTEST_STEP = 16 * EPS  # The least step, in units of the time: it is a few units in the last place.
GAUSS_POINTS = 10  # Points of Gauss's rule in a step: exact to degree 19, beyond the order of each method.
# Two rules differ by this, in units of the whole integral, in a step in which a function is not smooth.
UNEVEN = 1e-12
MOST_HALVINGS = 40  # The most times that a step is halved: a jump is then at a float.
# The rules may differ in so many parts of steps, or in four times as many as there are steps: in more it is
# rounding.
MOST_UNEVEN = 20_000
# Times below this share of the span count as that share, as steps are bounded relative to the time.
ORIGIN_OF_TIME = 1e-9
# Advice, for a hint, where steps get too short.
SMOOTHER = "smooth what is stiff, jumps, or sticks: tanh(x/0.001) for sign(x)"


class Stop(StrEnum):
    """Why a solution does not reach the end of its span."""

    AT_START = "has no finite real value at the start,"
    NO_VALUE = "has no finite real value beyond"
    INFINITE = "becomes infinite near"
    TOO_LARGE = "grows beyond the range of numbers near"
    LOST = "changes too fast to be followed beyond"


class Stopped(ComputationError):  # noqa: N818 - an outcome, named for what has happened
    """The solution ends inside the span, near `time`."""

    def __init__(self, name: str, stop: Stop, time: float) -> None:
        hints = {
            Stop.LOST: f"take a shorter span, or {SMOOTHER}",
            Stop.AT_START: "look for a formula (as of `torque`) that divides by 0 or is beyond 1e308",
        }
        super().__init__(f"{name} {stop} t = {time:.10g}", hint=hints.get(stop))
        self.stop = stop
        self.time = time


class TooManySteps(ComputationError):  # noqa: N818 - an outcome, named for what has happened
    """The span is too long, beside how fast the solution changes, for `most` steps."""

    def __init__(self, name: str, steps: int, time: float, end: float, most: int) -> None:
        faster = "" if find_spec("heyoka") else ", or pip install 'rigidcli[taylor]', whose steps are longer"
        is_orbit = name == "the orbit" and most <= MOST_STEPS
        longer = "; over very many periods, take the method `symplectic`" if is_orbit else ""
        super().__init__(
            f"{name} needs more than {most:,} steps: {steps:,} have come to t = {time:.6g} of {end:.6g}",
            hint=f"take a shorter span or a larger `tolerance`, {SMOOTHER}{faster}{longer}",
        )


def slopes_of(f: Elements, times: Floats, variables: Floats | Sequence[Floats]) -> Floats:
    """The values (m by k) of an f of arrays at times (k) and variables (n by k)."""
    rows = f(times, *variables)
    values = np.empty((len(rows), *times.shape))
    for value, row in zip(values, rows, strict=True):
        value[:] = row
    return values


def columns(flow: Flow) -> Callable[..., Floats]:
    """The values of a flow (m by k) as a function of times (k) and variables (k), NaN where there is none."""
    f = flow(np)

    def values(times: Floats, *variables: Floats) -> Floats:
        with np.errstate(all="ignore"):
            return slopes_of(f, times, variables)

    return values


def stopped(f: Function, t: float, y: State, span: float, name: str) -> Stopped:
    """The stop of steps that grew too short at (t, y), a little before what stops them; `span` is signed."""
    sudden = 1e-10  # within this time, in units of t, a variable that is about to be infinite grows by itself
    reach = math.copysign(sudden * max(abs(t), ORIGIN_OF_TIME * abs(span)), span)
    stop = Stop.NO_VALUE
    if finite(f, t, y):
        pairs = [(value, slope * reach) for value, slope in zip(y, f(t, *y), strict=True)]
        if any(abs(value) > 1e300 for value in y):  # the stages of a step overflow
            stop = Stop.TOO_LARGE
        elif any(move * value > 0 and abs(move) > abs(value) for value, move in pairs):
            # At the start of an immense span, even the least step is longer than what happens takes.
            far = any(value and abs(move / value) > 4 * sudden / SHORTEST_STEP for value, move in pairs)
            stop = Stop.LOST if far else Stop.INFINITE
        elif finite(f, t + reach, [value + move for value, move in pairs]):
            stop = Stop.LOST
    return Stopped(name, stop, t if abs(t) > SHORTEST_STEP * abs(span) else 0.0)


def finite(f: Function, t: float, y: State) -> bool:
    """Whether f has a finite real value at (t, y)."""
    try:
        return all(map(math.isfinite, f(t, *y)))
    except NO_VALUE:
        return False


def hopeless(times: Sequence[float], taken: int, end: float, most: int) -> bool:
    """Whether `most` steps are too few, as they are all taken, or at a pace that does not grow.

    `times` are the ends of the steps `taken`; the pace is looked at now and then only.
    """
    if taken >= most:
        return True
    if taken < FIRST_OUTLOOK or taken & (taken - 1):
        return False
    quarter = taken // 4
    before, pace = (abs(times[-1 - k * quarter] - times[-1 - (k + 1) * quarter]) / quarter for k in (1, 0))
    return abs(end - times[-1]) > (most - taken) * pace and pace < 1.001 * before


class Solution(NamedTuple):
    """A solution y(t) of n variables over its whole span, in `steps` steps."""

    steps: int
    method: str
    """Its name, for people."""
    engine: Engine
    tolerance: float
    knots: Floats
    """Where steps begin and end (steps + 1), from the start of the span to its end, which may come before."""
    sample: Callable[[Floats], Floats]
    """`at`, for times (k) inside the span."""
    largest: Floats
    """The largest size of each variable (n) at any of the knots."""
    sizes: State | None = None
    """Sizes of its variables or blocks, by which the engine has measured errors; None where it needs none."""
    note: str | None = None
    """Why the method is not the one that was asked for."""

    def at(self, times: Floats) -> Floats:
        """The state (k by n) at any `times` (k) inside the span, in any order, as accurate as the steps.

        Raises ValueError for a time outside; rounding errors of a time are forgiven.
        """
        times = np.asarray(times, dtype=np.float64)
        low, high = sorted((float(self.knots[0]), float(self.knots[-1])))
        slack = 1e-12 * max(abs(low), abs(high))
        if not len(times):
            return np.empty((0, len(self.largest)))
        if not np.all((times >= low - slack) & (times <= high + slack)):
            raise ValueError(f"a time is outside the span from {low!r} to {high!r}")
        return self.sample(np.clip(times, low, high))

    def mean(self, values: Callable[[Floats, Floats], Floats]) -> Floats:
        """The means over the span (m) of functions: of times (k) and states (k by n) they are (m by k).

        Gauss's rule has as many digits in a step as the solution, where the functions are smooth. A step in
        which one is not, as abs(x) where x passes zero, is halved until what is left does not count.
        """
        if len(self.knots) < 2:
            return values(self.knots, self.at(self.knots))[:, 0]
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        # Another rule, with both ends in place of the first node: no jump is the same to both rules.
        ends = np.array([*nodes[1:], -1.0, 1.0])
        powers = np.vander(ends, increasing=True).T
        others = np.linalg.solve(powers, [(1 + (-1) ** k) / (k + 1) for k in range(len(ends))])
        nodes = np.append(nodes, [-1.0, 1.0])
        low, high = self.knots[:-1], self.knots[1:]
        integral: Floats | float = 0.0
        most = max(4 * len(low), MOST_UNEVEN)
        least: Floats | None = None
        for _ in range(MOST_HALVINGS):
            half = (high - low)[:, None] / 2
            times = (low[:, None] + half * (1 + nodes)).ravel()
            weighed = values(times, self.at(times)).reshape(-1, len(half), len(nodes)) * half
            parts, other = weighed[..., :GAUSS_POINTS] @ weights, weighed[..., 1:] @ others
            if least is None:
                least = UNEVEN * np.abs(parts).sum(axis=1, keepdims=True)
            least[(np.abs(parts - other) > least).sum(axis=1) > most] = math.inf
            uneven = (np.abs(parts - other) > least).any(axis=0)
            integral = integral + parts[:, ~uneven].sum(axis=1)
            middle = (low + high)[uneven] / 2
            low, high = np.append(low[uneven], middle), np.append(middle, high[uneven])
            if not len(low):
                break
        return np.asarray(integral / (self.knots[-1] - self.knots[0]))


def largest(states: Floats) -> Floats:
    """The largest size of each variable (n) in the states (m by n)."""
    sizes: Floats = np.maximum(states.max(axis=0), -states.min(axis=0))
    return sizes


def digits(error: float) -> float:
    """Decimal digits that can be trusted in what is off by `error`, in units of its size, or in rad."""
    most = 15.9  # of a float
    return most if error <= 0 else min(most, max(0.0, math.floor(-10 * math.log10(error)) / 10))
