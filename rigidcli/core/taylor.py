"""The Taylor series of the solution, by automatic differentiation in compiled code: heyoka.

Source: F. Biscani, D. Izzo, Mon. Not. R. Astron. Soc. 504 (2021) 2614. heyoka chooses order and steps so
that the series end in rounding errors. Differences:

- heyoka steps over a branch point without a word: the series of y' = -sqrt(y) goes on for ever. Here every
  step is looked at afterwards. Its slope at the end must be that of the equations there, and no step may
  be shorter than times can tell.
- heyoka takes errors to be relative only in states larger than 1. Here it is given variables of that size.
"""

from __future__ import annotations

import importlib
import math
import signal
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from signal import default_int_handler
from threading import current_thread, main_thread
from types import ModuleType
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.solution import (
    MOST_NUMBERS,
    ORIGIN,
    ROUNDING,
    SHORTEST,
    Elements,
    Flow,
    Solution,
    Stop,
    Stopped,
    TooManySteps,
    hopeless,
    stopped,
)
from rigidcli.errors import ComputationError

METHOD = "Taylor (heyoka)"

MARGIN = 1e-3
"""heyoka's tolerance in units of ours: its steps are few, so that three digits more cost little."""

DEFECT = 1e3
"""How far the slope at the end of a step may be off, in units of the tolerance; a branch point exceeds it."""

PARTS = 1000
"""The number of parts of a step that goes wrong, and again of such a part, to find the time when it does."""

ROUND = 1 << 15
"""Steps times variables from one report of progress to the next: some 50 ms, and each takes heyoka 2 ms."""


def solve(
    flow: Flow,
    start: Floats,
    scales: Floats,
    span: tuple[float, float],
    *,
    tolerance: float,
    blocks: Sequence[int],
    tell: Callable[[float], None],
    name: str,
    most: int,
) -> Solution:
    """The solution of y' = f(t, y) over `span` (t0, t1) from `start` (n), in units of the `scales` (n).

    `tell` is given times reached.

    Raises:
        Stopped: the solution does not reach t1.
        TooManySteps: it does so only after more than `most` steps, or more than memory holds.
        ComputationError: heyoka is not installed, does not load, or cannot express the flow.
    """
    t0, t1 = span
    integrator = _integrator(flow, len(scales), max(tolerance * MARGIN, ROUNDING), name)
    integrator.pars[:] = [*scales, *(1 / scales)]
    integrator.time, integrator.state[:] = t0, start / scales
    most = min(most, MOST_NUMBERS // (len(scales) * (integrator.order + 1)))
    at_once = 1 << max(1, ROUND // len(scales)).bit_length() - 1
    f, knots, outputs = flow(np), array("d", [t0]), list[Any]()
    while True:
        taken = len(knots) - 1
        part = min(at_once, most - taken)
        outcome, *_, output, _ = integrator.propagate_until(t1, c_output=True, max_steps=part)
        if output is None and not outputs:
            raise Stopped(name, Stop.AT_START, t0)
        reached = knots[-1]
        if output is not None:
            outputs.append(output)
            reached = _reached(f, output.times, output.tcs, span, scales, tolerance, blocks)
            knots.extend(output.times[1:])
        if reached != knots[-1] or outcome.name == "err_nf_state":
            state = outputs[-1](reached) * scales
            raise stopped(flow(math), reached, state.tolist(), t1 - t0, name)
        if outcome.name != "step_limit":
            break
        tell(reached)
        if hopeless(knots, len(knots) - 1, t1, most):
            raise TooManySteps(name, len(knots) - 1, reached, t1, most)
    ahead = 1.0 if t1 >= t0 else -1.0
    starts = ahead * np.array([output.times[0] for output in outputs])

    def sample(times: Floats) -> Floats:
        states = np.empty((len(times), len(scales)))
        index = np.maximum(0, np.searchsorted(starts, ahead * times, side="right") - 1)
        for place in np.unique(index):
            states[index == place] = outputs[place](times[index == place])
        with np.errstate(over="ignore"):  # of a state that is about to be infinite
            return states * scales

    return Solution(
        len(knots) - 1, METHOD, "taylor", tolerance, np.frombuffer(knots), sample, scales.tolist()
    )


def scales_of(seen: Floats, blocks: Sequence[int]) -> Floats:
    """For each variable a power of 2, about as large as its block was in the states `seen` (m by n)."""
    sizes = np.abs(seen).max(axis=0)
    largest = np.maximum.reduceat(sizes, np.cumsum([0, *blocks[:-1]]))
    exponents = np.where(largest > 0, np.frexp(largest)[1], 0)
    return np.repeat(np.ldexp(1.0, np.clip(exponents, -1000, 1000)), blocks)


@lru_cache(maxsize=2)
def _integrator(flow: Flow, size: int, tolerance: float, name: str) -> Any:
    """heyoka's integrator of so many variables, which takes as long to make as to use.

    The units of the variables, and what they are divided by, are its parameters, so that it is made once for
    all starts of an ensemble.
    """
    heyoka = _loaded()
    variables = [heyoka.expression(f"v{i}") for i in range(size)]
    units = [heyoka.par[i] for i in range(2 * size)]
    try:
        slopes = flow(heyoka)(heyoka.time, *(unit * v for unit, v in zip(units, variables, strict=False)))
        return heyoka.taylor_adaptive(
            [
                (variable, unit * slope)
                for variable, unit, slope in zip(variables, units[size:], slopes, strict=True)
            ],
            [0.0] * size,
            tol=tolerance,
            # It compiles several times faster, at the price of slower steps.
            compact_mode=True,
        )
    except (
        ArithmeticError,
        AttributeError,
        NotImplementedError,
        RuntimeError,
        TypeError,
        ValueError,
    ) as error:
        # What heyoka raises for an operation that it does not have depends on the operation.
        raise ComputationError(f"heyoka cannot express {name}: {error}") from error


def _loaded() -> ModuleType:
    """heyoka. Raises ComputationError where there is none, or one that does not load."""
    try:
        with _uninterrupted():
            return importlib.import_module("heyoka")
    except ModuleNotFoundError as error:
        if error.name != "heyoka":
            raise ComputationError(f"heyoka cannot be loaded: {error}") from error
        raise ComputationError(
            "integration by Taylor series needs heyoka, which is not installed",
            hint="pip install 'rigidcli[taylor]'",
        ) from None
    except Exception as error:  # a compiled library may raise anything when it cannot be loaded
        raise ComputationError(f"heyoka cannot be loaded: {error}") from error


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """A context in which an interrupt waits: compiled code that it hits turns it into errors of its own."""
    ours = current_thread() is main_thread() and signal.getsignal(signal.SIGINT) is default_int_handler
    asked = False

    def remember(number: int, frame: object) -> None:
        nonlocal asked
        asked = True

    if ours:
        signal.signal(signal.SIGINT, remember)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, default_int_handler)
        if asked:
            raise KeyboardInterrupt


def _reached(
    f: Elements,
    knots: Floats,
    series: Floats,
    span: tuple[float, float],
    scales: Floats,
    tolerance: float,
    blocks: Sequence[int],
) -> float:
    """The time up to which the series solve the equations.

    `knots` (m + 1) are where they begin and end, `series` (m by n by order + 1) their coefficients.
    """
    t, h = knots[:-1], np.diff(knots)
    short = np.abs(h) < SHORTEST * np.maximum(np.abs(t), ORIGIN * abs(span[1] - span[0]))
    short[-1] &= knots[-1] != span[1]  # where what is left of the span may be short
    bad = short | ~_follow(f, t, h, series, scales, tolerance, blocks)
    if not bad.any():
        return float(knots[-1])
    step = int(np.argmax(bad))
    low, high = 0.0, h[step]
    while not short[step] and abs(high - low) > ROUNDING * abs(t[step] + high):
        parts = np.linspace(low, high, PARTS + 1)
        good = _follow(f, t[step], parts, series[step, None], scales, tolerance, blocks)
        first = max(1, int(np.argmin(good)))
        if (parts[first - 1], parts[first]) == (low, high):
            break
        low, high = parts[first - 1], parts[first]
    return float(t[step] + low)


def _follow(
    f: Elements,
    t: Floats,
    h: Floats,
    series: Floats,
    scales: Floats,
    tolerance: float,
    blocks: Sequence[int],
) -> Mask:
    """Whether each series about t (m), at t + h (m), has the slope that the equations give there."""
    size = np.abs(h)
    good = np.ones(len(h), dtype=np.bool_)
    units = scales[:, None]
    value, slope = np.zeros((2, len(scales), len(h)))
    first = 0
    with np.errstate(all="ignore"):
        for power in reversed(range(series.shape[-1])):
            slope *= h
            slope += value
            value *= h
            value += series[..., power].T
        true = np.empty_like(value)
        for row, derivative in zip(true, f(t + h, *(value * units)), strict=True):
            row[:] = derivative
        true /= units
        for count in blocks:
            block = slice(first, first := first + count)
            miss, own, way = (np.hypot.reduce(rows[block], axis=0) for rows in (slope - true, value, true))
            good &= size * miss <= DEFECT * tolerance * np.maximum(own, size * way)
    return good
