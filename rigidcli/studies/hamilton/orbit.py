"""The orbit of a system in phase space: integrated numerically, with measures of how well."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.core import integrate, memory
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.estimate import compared, foreseen
from rigidcli.core.solution import Solution, digits
from rigidcli.document.orbit import Orbit
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ComputationError
from rigidcli.mechanics import linear_flow
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import equations_of_motion, values_of_terms
from rigidcli.studies.hamilton.initial import InitialState

LOOKS = 4097
"""Times at which it is looked whether an orbit has left its range: they tell three digits of the end."""


@dataclass(frozen=True, slots=True, eq=False)
class OrbitSolution:
    """An orbit at `times` (k): coordinates and momenta (both k by n) and H (k).

    `drift` is the change of H and of the conserved quantities, in units of the largest sum of the sizes of
    their terms; where H changes by law, the integral of dH/dt is taken off. What is neither H nor a momentum
    is one of the `invariants`. The `states` (k by 2 n) have the variables that were integrated.
    From `lost` on, if ever, a second orbit in other steps has nothing in common with this one.
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
    note: str | None


@np.errstate(over="ignore", invalid="ignore")
def solve_orbit(
    orbit: Orbit,
    derivation: Derivation,
    initial: InitialState,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
    starts: int = 1,
) -> OrbitSolution:
    """The orbit that a document asks for, one of so many `starts`; with the drift of `invariants`, too.

    Raises ComputationError where the orbit ends early, or needs too many steps, or too much memory.
    """
    motion, name = equations_of_motion(derivation, initial), "the orbit"
    times = orbit.instants(1.0)
    memory.require(len(times), 2 + len(motion.start))
    span = (0.0, float(times[-1]))
    stops, longest = foreseen(motion.watched, span[1], name)
    follow = partial(
        integrate.integrate,
        motion.flow,
        motion.start,
        roundings=motion.roundings,
        name=name,
        longest=min(longest, orbit.max_step or math.inf),
        starts=starts,
    )
    solution = _by_exponential(derivation, initial, span[1], orbit) or follow(
        span,
        tolerance=orbit.tolerance or DEFAULT_TOLERANCE,
        stops=stops.tolist(),
        engine=orbit.method,
        progress=progress,
    )
    _require_range(solution, derivation, initial)
    states = solution.at(times)
    coordinates, momenta, energy, terms = motion.observed(times, states)
    scale = np.abs(states[:, : 2 * len(initial.q)]).max(axis=0)
    scale[scale == 0] = 1.0
    error, lost = compared(
        solution,
        # A second solution by an exponential has steps that share no point with those of the first.
        lambda tolerance, stops: (
            _by_exponential(derivation, initial, span[1], orbit, finer=1.37)
            or follow(span, tolerance=tolerance, stops=stops, like=solution)
        ),
        motion.watched,
        stops,
        lambda one, other: np.abs((one - other)[:, : len(scale)] / scale).max(axis=1),
        times,
    )
    gained = states[:, -1] if derivation.energy_changes else np.zeros(len(times))
    drift = {"H": _drift(energy - energy[0] - (gained - gained[0]), terms)}
    for e in (*(symbol(f"p_{name}") for name in derivation.conserved_momenta), *invariants):
        parts = values_of_terms(e, derivation.phase, initial.parameters)(times, *coordinates.T, *momenta.T)
        drift[str(e)] = _drift(parts.sum(axis=0), parts)
    return OrbitSolution(
        times,
        coordinates,
        momenta,
        energy,
        drift,
        tuple(map(str, invariants)),
        solution.method,
        solution.steps,
        states[:, : 2 * len(initial.q)],
        digits(max(error, drift["H"], EPS * math.sqrt(solution.steps))),
        lost,
        solution.note,
    )


def _drift(values: Floats, terms: Floats) -> float:
    """The largest change of values (k), in units of the largest sum of the sizes of the terms (any by k)."""
    change = float(np.abs(values - values[0]).max())
    return change / (float(np.abs(terms).sum(axis=0).max()) or 1.0) if change else 0.0


def _by_exponential(
    derivation: Derivation, initial: InitialState, end: float, orbit: Orbit, finer: float = 1.0
) -> Solution | None:
    """The motion of many variables with linear equations that do not change with time; else None."""
    asked = orbit.method != "auto" or orbit.max_step is not None
    # With fewer variables, steps are as quick as an exponential.
    if asked or derivation.linear is None or derivation.energy_changes or len(initial.q) < 6:
        return None
    rows, shift = derivation.linear
    parts = ([e for row in rows for e in row], shift)
    matrix, offset = ([e.evaluate(**initial.parameters) if e else 0.0 for e in part] for part in parts)
    start = np.concatenate([initial.q, initial.p])
    return linear_flow.solve(np.reshape(matrix, (len(start), -1)), np.array(offset), start, end, finer)


def _require_range(solution: Solution, derivation: Derivation, initial: InitialState) -> None:
    """Raise ComputationError where momenta leave the range in which they have velocities on this branch."""
    for condition in () if derivation.branch is None else derivation.branch.conditions:
        times = np.linspace(0.0, solution.knots[-1], LOOKS)
        states = solution.at(times)[:, : 2 * len(initial.q)]
        values = values_of_terms(condition, derivation.phase, initial.parameters)(times, *states.T)
        outside = ~(values.sum(axis=0) > 0)
        if outside.any():
            time = times[int(np.argmax(outside))]
            raise ComputationError(
                f"the orbit has no velocities beyond t = {time:.3g}, expected {condition} > 0"
            )
