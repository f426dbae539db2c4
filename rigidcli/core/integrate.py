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
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.util import find_spec

import numpy as np

from rigidcli.core import stiff
from rigidcli.core.arithmetic import Floats
from rigidcli.core.runge_kutta import March
from rigidcli.core.solution import Engine, Flow, InitialValues, Solution, State, Stop, Stopped, TooManySteps
from rigidcli.errors import ComputationError

__all__ = ["Engine", "Flow", "Solution", "Stop", "Stopped", "TooManySteps", "integrate"]

TRIAL = 512  # Steps, of all starts, after which `auto` estimates how many are left.
# Steps left times variables, of all starts, beyond which heyoka saves more than it takes to start.
WORTH_COMPILING = 150_000
# The least tolerance where `stiff` is taken without being asked for: it is of lower order.
STIFF_TOLERANCE = 1e-9


def integrate(
    flow: Flow,
    start: Floats,
    span: tuple[float, float],
    *,
    tolerance: float = 1e-12,
    blocks: Sequence[int] | None = None,
    longest: float = math.inf,
    stops: Sequence[float] = (),
    roundings: Flow | None = None,
    project: Callable[[float, State], State] | None = None,
    name: str = "the solution",
    engine: Engine = "auto",
    starts: int = 1,
    like: Solution | None = None,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Solve y' = f(t, y), y(t0) = `start` (n), over the span (t0, t1), where t1 may come before t0.

    The arguments from `tolerance` to `name` are those of `InitialValues`, and each variable is a block unless
    told otherwise. No variable needs a scale: 1e-160 is as good as 1.

    `auto` begins with `runge-kutta`, and changes to `taylor` when heyoka is installed, can express the flow,
    and will pay for all the `starts` from which the same flow is to be solved, as it is compiled once. This
    depends on numbers of steps alone, never on the clock, so that the same problem has the same result. Only
    `runge-kutta` has steps for `stops`, for `project`, and for what has no Taylor series: it is taken there,
    and the solution has a note if another method was asked for.

    `like` is an earlier solution whose method and scales are reused. `progress` is given the fraction done, a
    few times a second.

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
    least, tell = max(tolerance, 1e-15), _by_percent(progress, t0, t1)  # floats hold no more digits
    problem = InitialValues(flow, y0, (t0, t1), least, sizes, longest, stops, roundings, project, name, tell)
    engine, note = _allowed(engine, problem) if like is None else (like.engine, None)
    match engine:
        case "symplectic":
            from rigidcli.core import symplectic

            return symplectic.solve(problem, like)
        case "stiff":
            return stiff.solve(problem)
        case "taylor" if like is not None:
            return _by_taylor_again(problem, like)
    march = March(problem, None if like is None else like.sizes)
    if engine == "taylor" and t0 != t1:
        return _by_taylor(march)
    return _by_the_best(march, starts) if engine == "auto" else _to_the_end(march, note)


def _allowed(engine: Engine, problem: InitialValues) -> tuple[Engine, str | None]:
    """The engine for a problem with stops or constraints, and why it is another than the one asked for."""
    if problem.project is not None:
        reason = "keeps no constraints"
    elif len(problem.stops) and engine in ("taylor", "symplectic"):
        reason = "goes over what acts for a moment"
    else:
        return engine, None
    note = f"the method `{engine}` {reason}: the method `auto` is taken"
    return "runge-kutta", None if engine == "auto" else note


def _to_the_end(march: March, note: str | None = None) -> Solution:
    for t in march.steps:
        march.problem.tell(t)
    return march.solution(note)


def _compiled(march: March) -> Solution:
    """The solution by heyoka, in units of the sizes that the variables have had so far."""
    from rigidcli.core import taylor

    blocks = march.problem.blocks
    sizes = np.abs(np.array(march.states).reshape(len(march.times), -1)).max(axis=0)
    of_blocks = np.maximum.reduceat(sizes, np.cumsum([0, *blocks[:-1]]))
    return taylor.solve(march.problem, np.repeat(taylor.units(of_blocks), blocks))


def _by_taylor(march: March) -> Solution:
    """The solution by heyoka, or by the pair where there is no Taylor series."""
    from rigidcli.core import taylor

    taylor.loaded()
    next(march.steps, None)  # the first of them show the sizes of the variables
    try:
        return _compiled(march)
    except TooManySteps:
        raise
    except ComputationError as error:
        return _to_the_end(march, f"{error}: the method `auto` is taken")


def _by_taylor_again(problem: InitialValues, like: Solution) -> Solution:
    from rigidcli.core import taylor

    t0, t1 = problem.span
    # Another tolerance would be compiled anew, which takes longer than the steps: they get shorter.
    longest = min(problem.longest, 0.75 * abs(t1 - t0) / like.steps)
    # A stop takes heyoka as long as a hundred steps, and hardly anything hides where there are many.
    stops = problem.stops if like.steps < 4096 else ()
    problem = problem._replace(tolerance=like.tolerance, longest=longest, stops=stops)
    return taylor.solve(problem, np.array(like.sizes), taylor.MOST_OF_SECOND)


def _by_the_best(march: March, starts: int) -> Solution:
    """The solution by the pair; by heyoka where many steps are left, or stiff where there are too many."""
    problem, stops = march.problem, march.problem.stops
    may_change = not len(stops) and find_spec("heyoka") is not None
    (t0, t1), trial = problem.span, TRIAL / starts if may_change else math.inf
    try:
        for t in march.steps:
            problem.tell(t)
            if len(march.times) > trial:
                trial = math.inf
                left = len(march.states) * ((t1 - t) / (t - t0))
                if starts * left > WORTH_COMPILING:
                    # Of what heyoka cannot solve, the steps at hand tell more.
                    with suppress(ComputationError):
                        return _compiled(march)
        return march.solution()
    except TooManySteps:
        if len(stops):
            raise
        # Steps may be short because the method is unstable with longer ones, and not for their errors.
        looser = problem._replace(tolerance=max(problem.tolerance, STIFF_TOLERANCE))
        with suppress(ComputationError):
            note = "explicit steps are held back by fast decay: the method `stiff` is taken"
            return stiff.solve(looser, stiff.MOST_TRIED)._replace(note=note)
        raise


def _by_percent(progress: Callable[[float], None] | None, t0: float, t1: float) -> Callable[[float], None]:
    """A function of the time reached, which reports progress when another hundredth is done."""
    last = -1

    def tell(t: float) -> None:
        nonlocal last
        if progress is not None and t1 != t0 and (percent := int(100 * (t - t0) / (t1 - t0))) != last:
            last = percent
            progress((t - t0) / (t1 - t0))

    return tell
