"""The Taylor series of the solution, by automatic differentiation in compiled code: heyoka.

Source: F. Biscani, D. Izzo, Mon. Not. R. Astron. Soc. 504 (2021) 2614. heyoka chooses order and steps so
that the series end in rounding errors. Differences:

- heyoka steps over a branch point without a word: the series of y' = -sqrt(y) goes on for ever. Here the
  slope at the end of a step must be that of the equations there; where it is not, the solution is refused,
  and is left to the Runge-Kutta pair, which says how solutions end.
- heyoka takes errors to be relative only in states larger than 1. Here it is given variables of that size.
"""

from __future__ import annotations

import importlib
import signal
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import dormand_prince, many
from rigidcli.core.arithmetic import EPS, Floats, Mask
from rigidcli.core.many import LARGEST, ManyStarts, Paths
from rigidcli.core.solution import (
    MOST_NUMBERS,
    MOST_STEPS,
    Elements,
    Flow,
    InitialValues,
    Solution,
    TooManySteps,
    columns,
    hopeless,
    largest,
    slopes_of,
)
from rigidcli.errors import ComputationError

METHOD = "Taylor (heyoka)"

# Steps times variables from one report of progress to the next: some 50 ms, and each takes heyoka 2 ms.
NUMBERS_PER_REPORT = 1 << 15
# Coefficients of series that a solution keeps (56 MB); in later steps it is sampled by another method.
MOST_COEFFICIENTS = 7_000_000
MOST_OF_SECOND = 500_000  # Those that a second solution keeps, which is compared with the first at few times.
EARLY = 16  # The units of many orbits are sizes in so large a part of the span.


def units(sizes: Floats) -> Floats:
    """Powers of 2, which change no digit, above the sizes of variables."""
    exponents = np.where(sizes > 0, np.frexp(sizes)[1], 0)
    powers: Floats = np.ldexp(1.0, np.clip(exponents, -1000, 1000))
    return powers


def solve(problem: InitialValues, scales: Floats, most_kept: int = MOST_COEFFICIENTS) -> Solution:
    """The solution of a problem, whose variables are in units of the `scales` (n).

    It keeps `most_kept` coefficients of its series.

    Raises:
        Stopped: the solution does not reach t1.
        TooManySteps: it does so only after more than MOST_STEPS, or more than memory holds.
        ComputationError: heyoka is not installed, does not load, or cannot express the flow.
    """
    flow, start, (t0, t1), name = problem.flow, problem.start, problem.span, problem.name
    tolerance = problem.tolerance
    # Its steps are few, so that three digits more cost little.
    integrator = _integrator(flow, len(scales), max(tolerance * 1e-3, EPS), name)
    # heyoka has none beyond the last that the equations use: a slope of zero needs no unit.
    integrator.pars[:] = [*scales, *(1 / scales)][: len(integrator.pars)]
    integrator.time, integrator.state[:] = t0, start / scales
    most = min(MOST_STEPS, MOST_NUMBERS // (len(scales) * (integrator.order + 1)))
    # A power of two, as those at which it is asked whether the end can be reached.
    at_once = 1 << max(1, NUMBERS_PER_REPORT // len(scales)).bit_length() - 1
    f, knots, outputs, goals = flow(np), array("d", [t0]), list[Any](), [t1, *reversed(problem.stops)]
    begins, path, kept = [], list[Floats](), 0
    while goals:
        taken = len(knots) - 1
        problem.tell(knots[-1])
        if hopeless(knots, taken, t1, most):
            raise TooManySteps(name, taken, knots[-1], t1, most)
        outcome, *_, output, _ = integrator.propagate_until(
            goals[-1], c_output=True, max_steps=min(at_once, most - taken), max_delta_t=problem.longest
        )
        if output is None or outcome.name == "err_nf_state":
            raise ComputationError(f"the Taylor series of {name} ends near t = {knots[-1]:.6g}")
        begins.append(output.times[0])
        path.append(output.tcs[:, :, 0].copy())
        kept += output.tcs.size
        outputs.append(output if kept <= most_kept else None)
        if not _follows(f, output.times, output.tcs, scales, tolerance, problem.blocks):
            raise ComputationError(f"{name} does not follow its Taylor series beyond t = {knots[-1]:.6g}")
        knots.extend(output.times[1:])
        if outcome.name != "step_limit":
            goals.pop()
    states = np.concatenate([*path, integrator.state[None]])
    states *= scales
    path.clear()
    times, ahead = np.frombuffer(knots), 1.0 if t1 >= t0 else -1.0
    # A step of this method is as long as a few of the other one.
    between = dormand_prince.sampler(flow, times, states, parts=8)

    def sample(times: Floats) -> Floats:
        values = np.empty((len(times), len(scales)))
        index = np.maximum(0, np.searchsorted(ahead * np.array(begins), ahead * times, side="right") - 1)
        for place in np.unique(index):
            some = index == place
            if outputs[place] is None:
                values[some] = between(times[some])
                continue
            with np.errstate(over="ignore"):  # of a state that is about to be infinite
                values[some] = outputs[place](times[some]) * scales
        return values

    return Solution(
        len(knots) - 1, METHOD, "taylor", tolerance, times, sample, largest(states), scales.tolist()
    )


def paths(problem: ManyStarts, starts: Floats, times: Floats, looks: int) -> Paths:
    """The solutions from `starts` (n by m) at t = 0, at the `times` (k), to the last of them.

    As many starts are stepped at once as the processor has lanes, each in steps of its own. At so many
    `looks` on the way it is seen how large the variables are, and whether something narrow may be passed:
    then a start is `alone`, as is one whose series ends, or whose energies are beyond the range of floats.
    There is no check of the slopes as in `solve`: two solutions in other steps pass a branch point
    differently.

    Raises ComputationError: heyoka is not installed, does not load, or cannot express the flow.
    """
    (size, count), lanes = starts.shape, loaded().recommended_simd_size()
    regular = np.linspace(0.0, times[-1], looks)
    grid = np.unique([*regular, *times])
    sampled, looked_at = np.searchsorted(grid, times), np.searchsorted(grid, regular)
    tolerances, longest = (np.broadcast_to(each, count) for each in (problem.tolerance, problem.longest))
    watched, states = columns(problem.moving), np.empty((len(times), size, count))
    found = Paths(states, np.zeros(count, int), np.empty_like(starts), np.zeros(count, bool))
    for tolerance in np.unique(tolerances):
        # With 1e-3, as in `solve`, a second solution would be off by no more than rounding, as the first is.
        integrator = _integrator(problem.flow, size, max(tolerance * 1e-2, EPS), "the orbits", lanes)
        same = np.flatnonzero(tolerances == tolerance)
        for some in np.split(same, range(lanes, len(same), lanes)):
            path, found.steps[some] = _batch(integrator, starts[:, some], longest[some], grid)
            found.states[..., some], found.largest[:, some] = path[sampled], np.abs(path).max(axis=0)
            ended = ~(np.abs(path) < LARGEST).all(axis=(0, 1))  # also where it is NaN
            found.alone[some] = ended | _passes(watched, regular, path[looked_at])
    return found


def _batch(integrator: Any, starts: Floats, longest: Floats, grid: Floats) -> tuple[Floats, NDArray[np.int_]]:
    """The states (k by n by m) of starts (n by m) at the times of the grid (k), and their numbers of steps.

    The states of a start whose series ends are NaN.
    """
    lanes, going = integrator.batch_size, np.arange(starts.shape[1])
    states, steps = np.full((len(grid), *starts.shape), np.nan), np.zeros(len(going), int)
    while len(going):
        some = np.resize(going, lanes)  # lanes that would be empty follow others once more
        begin, limits = starts[:, some], {"max_delta_t": longest[some], "max_steps": MOST_STEPS}
        path = begin[None]
        # The units of the variables are their sizes in the early part of the span.
        for times in (np.linspace(0.0, grid[-1] / EARLY, 9), grid):
            scales = units(np.abs(path).max(axis=0))
            integrator.set_time(0.0)
            integrator.state[:] = begin / scales
            integrator.pars[:] = np.concatenate([scales, 1 / scales])[: len(integrator.pars)]
            path = integrator.propagate_grid(np.repeat(times[:, None], lanes, axis=1), **limits)[-1] * scales
            results = integrator.propagate_res
            failed = [outcome.name in ("err_nf_state", "step_limit") for outcome, *_ in results]
            if any(failed):
                break
        else:
            states[..., going] = path[..., : len(going)]
            steps[going] = [taken for *_, taken in results[: len(going)]]
            break
        going = np.setdiff1d(going, some[failed])  # the first that fails stops all others
    return states, steps


def _passes(watched: Callable[..., Floats], times: Floats, states: Floats) -> Mask:
    """Whether starts may pass something narrow between the `times` (k), at which they have these states."""
    count = states.shape[2]
    clocks = np.repeat(times, count)
    seen = np.vstack([clocks, watched(clocks, *states.swapaxes(0, 1).reshape(len(states[0]), -1))])
    first, second, third = seen[:, : -2 * count], seen[:, count:-count], seen[:, 2 * count :]
    with np.errstate(all="ignore"):
        passed = many.narrow(first, second, third)
    anywhere: Mask = np.logical_or.reduce(passed.reshape(-1, count))
    return anywhere


@lru_cache(maxsize=4)
def _integrator(flow: Flow, size: int, tolerance: float, name: str, lanes: int = 0) -> Any:
    """heyoka's integrator of so many variables, of one start or of as many as there are lanes.

    To make it takes as long as to use it.

    The units of the variables, and what they are divided by, are its parameters, so that it is made once for
    all starts of an ensemble.
    """
    heyoka = loaded()
    variables = [heyoka.expression(f"v{i}") for i in range(size)]
    units = [heyoka.par[i] for i in range(2 * size)]
    try:
        slopes = flow(heyoka)(heyoka.time, *(unit * v for unit, v in zip(units, variables, strict=False)))
        equations = [
            (v, unit * slope) for v, unit, slope in zip(variables, units[size:], slopes, strict=True)
        ]
        # In this mode it compiles several times faster, at the price of slower steps.
        if lanes:
            return heyoka.taylor_adaptive_batch(
                equations, np.zeros((size, lanes)), tol=tolerance, compact_mode=True
            )
        return heyoka.taylor_adaptive(equations, [0.0] * size, tol=tolerance, compact_mode=True)
    except (ArithmeticError, AttributeError, RuntimeError, TypeError, ValueError) as error:
        # What heyoka raises for an operation that it does not have depends on the operation.
        raise ComputationError(f"heyoka cannot express {name}: {error}") from error


def loaded() -> ModuleType:
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
    if not hasattr(signal, "pthread_sigmask"):  # as on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _follows(
    f: Elements, knots: Floats, series: Floats, scales: Floats, tolerance: float, blocks: Sequence[int]
) -> bool:
    """Whether the series have the slopes of the equations at the ends of their steps.

    `knots` (m + 1) are where they begin and end, `series` (m by n by order + 1) their coefficients.
    """
    h = np.diff(knots)
    value, slope = np.zeros((2, len(scales), len(h)))
    first, good = 0, True
    with np.errstate(all="ignore"):
        for power in reversed(range(series.shape[-1])):
            slope = slope * h + value
            value = value * h + series[..., power].T
        true = slopes_of(f, knots[1:], value * scales[:, None]) / scales[:, None]
        for count in blocks:
            block = slice(first, first := first + count)
            miss, own, way = (np.hypot.reduce(rows[block], axis=0) for rows in (slope - true, value, true))
            # At a branch point it is off by far more than a thousand tolerances. Where a block is small
            # for a moment, what rounding of the time does to the slope, as in 0.7 t, may be as large.
            rounded = 8 * EPS * abs(knots[1:]) * way.max()
            bound = 1e3 * tolerance * np.maximum(own, abs(h) * way) + rounded
            good &= bool((abs(h) * miss <= bound).all())
    return good
