"""The orbit of a system in phase space: integrated numerically, with measures of how well."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigidcli.core import integrate
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import digits
from rigidcli.errors import ComputationError
from rigidcli.model.orbit import Orbit
from rigidcli.model.sampling import DEFAULT_TOLERANCE
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    columns,
    equations_of_motion,
    flow_of_terms,
)
from rigidcli.studies.hamilton.initial import InitialState
from rigidcli.studies.hamilton.velocity_branches import VANISHING, require_regular
from rigidcli.symbolic.algebra.expressions import Expr

COARSER = 1e2
"""The ratio of the tolerances of two integrations, from whose difference the error is estimated."""

PIECES = 7
"""Pieces of the second integration, each twice as long as the one before: the first is a 64th of the span."""

REFINEMENTS, PARTS = 5, 101
"""How often the time at which an orbit leaves its range is narrowed down, to one of so many parts."""

LOST = 0.1
"""An error of a variable, in units of its size, with which it has no digits left."""

EARLY = 0.8
"""If the coarse orbit is lost before this part of the span, the fine one is lost before its end."""

BEFORE = 1 - 1e-9
"""The part of an orbit that ends that is followed again, to see why."""

ORDER = 7 / 8
"""The power of the tolerance to which the error of an orbit is proportional: steps h have errors of h^8."""


@dataclass(frozen=True, slots=True, eq=False)
class OrbitSolution:
    """An orbit at `times` (k): coordinates and momenta (k by n each) and H (k).

    `drift` tells of H and of each conserved quantity by how much it changes, in units of the largest sum of
    the sizes of its terms; where H changes by law, the integral of dH/dt is taken off. Those that are neither
    H nor momenta are `invariants`. The `states` (k by 2 n) are those of the variables that were integrated.
    From `lost` on, if ever, an orbit with somewhat coarser steps has nothing in common with this one.
    """

    times: Floats
    coordinates: Floats
    momenta: Floats
    energy: Floats
    drift: dict[str, float]
    invariants: tuple[str, ...]
    method: str
    steps: int
    states: Floats
    trusted_digits: float
    lost: float | None


@np.errstate(over="ignore", invalid="ignore")
def solve_orbit(
    orbit: Orbit,
    derivation: Derivation,
    initial: InitialState,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
) -> OrbitSolution:
    """The orbit that a document asks for; also of the `invariants` the drift is told.

    Raises ComputationError where the orbit ends early.
    """
    motion = equations_of_motion(derivation, initial)
    times = orbit.instants(1.0)
    tolerance = orbit.tolerance or DEFAULT_TOLERANCE
    follow = partial(integrate.integrate, motion.flow, engine=orbit.method, name="the orbit")
    defined = derivation.momenta
    may_branch = defined is not None and not defined.are_linear(derivation.velocity_names)
    try:
        solution = follow(motion.start, (0.0, float(times[-1])), tolerance=tolerance, progress=progress)
    except integrate.Stopped as stop:
        if may_branch:
            with suppress(integrate.Stopped):
                seen = follow(motion.start, (0.0, BEFORE * stop.time), tolerance=tolerance)
                _require_regular(seen, motion, derivation, initial, VANISHING)
        raise
    if may_branch:
        _require_regular(solution, motion, derivation, initial, 0.0)
    _require_range(solution, derivation, initial)
    states = solution.at(times)
    coordinates, momenta, energy, terms = motion.observed(times, states)
    coarse = partial(follow, tolerance=min(1e-3, tolerance * COARSER), least=solution.least)
    error, lost = _estimated_error(coarse, motion.start, times, states)
    gained = states[:, -1] if derivation.energy_changes else np.zeros(len(times))
    drift = {"H": _drift(energy - energy[0] - (gained - gained[0]), terms)}
    for name in derivation.conserved_momenta:
        column = momenta[:, derivation.phase.coordinates.index(name)]
        drift[f"p_{name}"] = _drift(column, column[None])
    further = [str(invariant) for invariant in invariants]
    for name, invariant in zip(further, invariants, strict=True):
        flow = flow_of_terms(invariant, derivation.phase, initial.parameters)
        parts = columns(flow, times, np.hstack([coordinates, momenta]))
        drift[name] = _drift(parts.sum(axis=0), parts)
    return OrbitSolution(
        times,
        coordinates,
        momenta,
        energy,
        drift,
        tuple(further),
        solution.method,
        solution.steps,
        states[:, : 2 * len(initial.q)],
        digits(max(error, np.finfo(np.float64).eps * solution.steps**0.5)),
        lost,
    )


def _require_regular(
    solution: integrate.Solution,
    motion: EquationsOfMotion,
    derivation: Derivation,
    initial: InitialState,
    least: float,
) -> None:
    """Raise ComputationError if the mass matrix becomes singular on the way."""
    times, size = solution.knots, len(initial.q)
    states = solution.at(times)
    velocities = columns(motion.flow, times, states)[:size].T
    require_regular(derivation, initial.parameters, times, states[:, :size], velocities, least)


def _drift(values: Floats, terms: Floats) -> float:
    """The largest change of values (k), in units of the largest sum of the sizes of the terms (any by k)."""
    change = float(np.abs(values - values[0]).max())
    return change / (float(np.abs(terms).sum(axis=0).max()) or 1.0) if change else 0.0


def _require_range(solution: integrate.Solution, derivation: Derivation, initial: InitialState) -> None:
    """Raise ComputationError where momenta leave the range in which they have velocities on this branch."""
    for condition in () if derivation.branch is None else derivation.branch.conditions:
        flow = flow_of_terms(condition, derivation.phase, initial.parameters)
        times = solution.knots
        for _ in range(REFINEMENTS):
            states = solution.at(times)[:, : 2 * len(initial.q)]
            outside = ~(columns(flow, times, states).sum(axis=0) > 0)
            if not outside.any():
                break
            first = int(np.argmax(outside))
            times = np.linspace(times[max(0, first - 1)], times[first], PARTS)
        else:
            raise ComputationError(
                f"the orbit has no velocities beyond t = {times[-1]:.6g}, expected {condition} > 0"
            )


def _estimated_error(
    follow: Callable[..., integrate.Solution], state: Floats, times: Floats, states: Floats
) -> tuple[float, float | None]:
    """The largest error of the states (k by n), in units of the variables' sizes, and when digits are lost.

    It is estimated from a second, coarser integration, which `follow` does piece by piece from the first
    `state`: as soon as it has lost all digits, as in chaotic motion, there is no need to go on.
    """
    scale = np.abs(states).max(axis=0)
    scale[scale == 0] = 1.0
    end = float(times[-1])
    t, error = 0.0, 0.0
    for piece in reversed(range(PIECES)):
        until = end / 2**piece
        solution = follow(state, (t, until))
        inside = (times > t) & (times <= until)
        misses = np.abs((solution.at(times[inside]) - states[inside]) / scale).max(axis=1, initial=0.0)
        error = max(error, float(misses.max(initial=0.0)) / COARSER**ORDER)
        if (misses > LOST).any():
            lost = float(times[inside][np.argmax(misses > LOST)])
            if lost < EARLY * end:
                return 1.0, lost
        t, state = until, solution.at(np.array([until]))[0]
    return error, None
