"""The integration of ordinary differential equations y' = f(t, y) from a start, by four methods.

    solution = integrate(flow, start, (0.0, 10.0), blocks=(4, 3))
    solution.at(np.linspace(0.0, 10.0, 1001))

`runge-kutta` needs nothing but Python and suits nearly every problem. `taylor` compiles the equations with
heyoka, an optional dependency: it pays where very many steps are wanted.
`symplectic` is for the equations of Hamilton over very long spans: the error of the energy does not grow.
`stiff` is for rates of very different sizes, after the fast motions have died out.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import numpy as np

from rigidcli.core import dormand_prince, runge_kutta
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Engine, Flow, Solution, State, Stop, Stopped, TooManySteps, largest
from rigidcli.errors import ComputationError

__all__ = ["Engine", "Flow", "Solution", "Stop", "Stopped", "TooManySteps", "integrate"]

TRIAL = 512
"""Steps, of all starts, after which `auto` estimates how many are left."""

WORTH_COMPILING = 150_000
"""Steps left times variables, of all starts, beyond which heyoka saves more than it takes to start."""


STIFF = 1e-9
"""The least error of a step where `stiff` is taken without being asked for: it is of lower order."""


def integrate(
    flow: Flow,
    start: Floats,
    span: tuple[float, float],
    *,
    tolerance: float = 1e-12,
    blocks: Sequence[int] | None = None,
    engine: Engine = "auto",
    progress: Callable[[float], None] | None = None,
    name: str = "the solution",
    longest: float = math.inf,
    stops: Sequence[float] = (),
    like: Solution | None = None,
    roundings: Flow | None = None,
    starts: int = 1,
    project: Callable[[float, State], State] | None = None,
) -> Solution:
    """Solve y' = f(t, y), y(t0) = `start` (n), over the span (t0, t1), where t1 may come before t0.

    `tolerance` bounds the error of each step relative to the variable; `blocks` are the sizes of groups
    of adjacent variables, n in total, whose error is measured as that of one vector (a quaternion, an
    angular momentum). No variable needs a scale: 1e-160 is as good as 1. No step is longer than `longest`,
    and one ends at each of the `stops`, at which something sudden may happen.

    `auto` begins with `runge-kutta`, and changes to `taylor` when heyoka is installed, can express the
    flow, and will pay. This depends on numbers of steps alone, never on the clock, so
    that the same problem has the same result. `progress` is given the fraction done, a few times a second.
    `roundings` are the rounding errors of the flow, in units of those of one operation.
    With another solution of the problem that it is `like`, its method is taken, and its sizes of variables.
    The same flow is to be solved from so many `starts`, which are taken to need as many steps: it is compiled
    once for all. Only `runge-kutta` has steps for `stops`, and for what has no Taylor series: it is taken
    there, and the solution has a note.

    Steps of `runge-kutta` end with `project`, which moves a state (n) by about the error of the step to where
    it belongs. No other method is taken then, with a note if one was asked for.

    Raises:
        Stopped: the solution, called `name` in the message, does not reach t1.
        TooManySteps: it does so only after more than 1,000,000 steps, or than memory holds.
        ComputationError: `taylor` was asked for, but is not installed; or `symplectic`, which takes steps of
            one length, where they would be too short.
    """
    t0, t1 = (float(time) for time in span)
    y0 = np.asarray(start, dtype=np.float64)
    sizes = (1,) * len(y0) if blocks is None else tuple(blocks)
    good = sum(sizes) == len(y0) and all(sizes) and np.isfinite(y0).all()
    if not (good and 0 < tolerance < 1 and longest > 0 and math.isfinite(t1 - t0)):
        raise ValueError(f"cannot integrate {len(y0)} variables in blocks {sizes} over {span} to {tolerance}")
    tolerance, note = max(tolerance, 1e-15), None  # floats hold no more digits
    common: Any = {"tolerance": tolerance, "name": name, "longest": longest}
    tell = _by_percent(progress, t0, t1)
    engine = engine if like is None else like.engine
    if len(stops) and like is None and engine in ("taylor", "symplectic"):
        note = f"the method `{engine}` goes over what acts for a moment: the method `auto` is taken"
        engine = "runge-kutta"
    if project is not None and like is None:
        note = (
            None
            if engine == "auto"
            else f"the method `{engine}` keeps no constraints: the method `auto` is taken"
        )
        engine = "runge-kutta"
    if engine == "symplectic":
        from rigidcli.core import symplectic

        return symplectic.solve(flow, y0, (t0, t1), tell=tell, like=like, **common)
    if engine == "stiff":
        from rigidcli.core import stiff

        return stiff.solve(flow, y0, (t0, t1), tell=tell, **common)
    implicit = {"tell": tell, **common, "tolerance": max(tolerance, STIFF)}
    common["blocks"] = sizes
    times, states = array("d", [t0]), array("d", y0)

    def compiled(stops: Sequence[float] = ()) -> Solution:
        from rigidcli.core import taylor

        seen = np.array(states).reshape(-1, len(y0))
        scales = taylor.scales_of(seen, sizes) if like is None else np.array(like.sizes)
        return taylor.solve(flow, y0, scales, (t0, t1), tell=tell, stops=stops, **common)

    if engine == "taylor" and like is not None:
        from rigidcli.core import taylor

        # Another tolerance would be compiled anew, which takes longer than the steps: they get shorter.
        common |= {"tolerance": like.tolerance, "longest": min(longest, 0.75 * abs(t1 - t0) / like.steps)}
        common["most_kept"] = taylor.MOST_OF_SECOND
        # A stop takes heyoka as long as a hundred steps, and hardly anything hides where there are many.
        return compiled(stops if like.steps < 4096 else ())
    f, errors = flow(math), None if roundings is None else roundings(math)
    least = None if like is None else like.sizes
    if least is None:
        least = runge_kutta.least_sizes(f, t0, y0.tolist(), t1, sizes, longest=longest, stops=stops)
    march = runge_kutta.march(
        f, times, states, t1, least=least, stops=stops, roundings=errors, project=project, **common
    )
    if engine == "taylor":
        from rigidcli.core import taylor

        taylor.loaded()
        next(march, None)  # the first of them show the sizes of the variables
        try:
            return compiled()
        except TooManySteps:
            raise
        except ComputationError as error:
            note = f"{error}: the method `auto` is taken"
    may_change = engine == "auto" and not len(stops) and find_spec("heyoka") is not None
    trial = TRIAL / starts if may_change else math.inf
    try:
        for t in march:
            tell(t)
            if len(times) > trial:
                left = len(states) * ((t1 - t) / (t - t0))
                trial = math.inf
                if starts * left > WORTH_COMPILING:
                    # Of what heyoka cannot solve, the steps at hand tell more.
                    with suppress(ComputationError):
                        return compiled()
    except TooManySteps:
        if engine != "auto" or len(stops):
            raise
        # Steps may be short because the method is unstable with longer ones, and not for their errors.
        from rigidcli.core import stiff

        with suppress(ComputationError):
            note = "explicit steps are held back by fast decay: the method `stiff` is taken"
            return replace(stiff.solve(flow, y0, (t0, t1), most=stiff.FEW, **implicit), note=note)
        raise
    knots, path = np.frombuffer(times), np.frombuffer(states).reshape(len(times), -1)
    sample = dormand_prince.sampler(flow, knots, path)
    steps, method = len(times) - 1, dormand_prince.METHOD
    return Solution(steps, method, "runge-kutta", tolerance, knots, sample, largest(path), least, note)


def _by_percent(progress: Callable[[float], None] | None, t0: float, t1: float) -> Callable[[float], None]:
    """A function of the time reached, which reports progress when another hundredth is done."""
    last = -1

    def tell(t: float) -> None:
        nonlocal last
        if progress is not None and t1 != t0 and (percent := int(100 * (t - t0) / (t1 - t0))) != last:
            last = percent
            progress((t - t0) / (t1 - t0))

    return tell
