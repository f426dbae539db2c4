"""An orbit in phase space: its integration, its samples, and measures of how well it was followed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.core import integrate, memory, stiff
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.kicks import foreseen
from rigidcli.core.second_run import compared, rounding
from rigidcli.core.solution import Solution, columns, digits
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.document.system import Orbit
from rigidcli.errors import ComputationError
from rigidcli.mechanics import linear_flow
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton.constraints import Keeper, keeper
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    InitialState,
    equations_of_motion,
    terms,
    values_of_terms,
)
from rigidcli.studies.hamilton.sections import Values, cut, equation, passes, reach, selected, touching

# What messages call the solution.
NAME = "the orbit"
# With fewer coordinates, and rates times the span below this, steps are as quick as an exponential.
FEW_COORDINATES, FEW_RADIANS = 6, 1e4
# Steps of an orbit, besides its samples, at which the terms of what is conserved are looked at.
LOOKS_AT_TERMS = 64
# Times at which it is looked whether an orbit has left its range: they tell three digits of the end.
LOOKS_AT_RANGE = 4097
# The largest error of a straight line between two drawn states, in units of the width of the picture.
SMOOTH = 1e-3
# The most states that are drawn: about 1 MB in a file .svg.
MOST_DRAWN = 20_000


class Samples(TypedDict):
    """The fields of an orbit that have a row for each of its times."""

    times: Floats
    coordinates: Floats
    momenta: Floats
    energy: Floats
    states: Floats
    further: dict[str, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class OrbitSolution:
    """An orbit at `times` (k): coordinates and momenta (both k by n) and H (k), and how well it was followed.

    `drift` is the change of H and of the conserved quantities, in units of the largest sum of the sizes of
    their terms; where H changes by law, the integral of dH/dt is taken off. What is neither H nor a momentum
    is one of the `invariants`. The `states` (k by 2 n) have the variables that were integrated. `further`
    samples (k), of multipliers and observables, stand under their keys, with `means` over the orbit;
    `scales` are the largest sums of the sizes of the terms of each sampled function.
    The `end` is the time at which an orbit with `until` ends, and why; what events have met is in `remarks`.
    From `lost` on, if ever, a second orbit in other steps has nothing in common with this one.
    `at` gives samples at other times, and `knots` are the ends of the steps: None for one of many orbits.
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
    further: dict[str, Floats]
    means: dict[str, float]
    scales: dict[str, float]
    end: tuple[float, str] | None = None
    is_section: bool = False
    remarks: tuple[str, ...] = ()
    at: Callable[[Floats], Samples] | None = None
    knots: Floats | None = None


@np.errstate(over="ignore", invalid="ignore")
def solve_orbit(
    orbit: Orbit,
    derivation: Derivation,
    initial: InitialState,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
    starts: int,
    functions: Mapping[str, Expr],
    passing: Mapping[str, Expr],
) -> OrbitSolution:
    """The orbit that a document asks for, one of so many `starts`; with the drift of `invariants`, too.

    `functions` of the state, as `observables` writes them, are sampled under their keys, and have means; of
    those that are `passing`, under the keys of the document, zeros are looked for.

    Raises ComputationError where the orbit ends early, or needs too many steps, or too much memory.
    """
    motion, limits = equations_of_motion(derivation, initial), derivation.system.constraints
    crossing = {key: _first_row(motion.function([e])) for key, e in passing.items()}
    bounds = keeper(derivation, initial.parameters) if limits else None
    run = _follow(orbit, derivation, initial, motion, bounds, crossing, progress, starts)
    solution, times, kept, end, remarks = _met(orbit, crossing, run.solution, run.times, run.until)
    _require_range(solution, derivation, initial)
    further = {f"multipliers.{one.name}": one.multiplier for one in limits} | dict(functions)
    states = solution.at(times)
    *observed, energy_terms = motion.observed(times, states)
    samples = _samples(motion, further, times, states, observed)
    _require_values(times, samples["further"])
    drift = _drifts(motion, derivation, initial, solution, states, samples, energy_terms, invariants)
    # The energy that time or forces have brought is one more integral, with errors of its own.
    energy_error = 0.0 if derivation.energy_changes else drift["H"]
    if bounds is not None:
        misses = np.abs(bounds.measured(times, samples["states"])).max(axis=1)
        drift |= {one.name: float(miss) for one, miss in zip(limits, misses, strict=True)}
    in_slopes = _lost_in_slopes(motion, solution, run.scale)
    error = max(run.error, energy_error, in_slopes, rounding(solution, run.stops))
    means = solution.mean(partial(motion.values, [*functions.values()])) if functions else ()

    def at(times: Floats) -> Samples:
        states = solution.at(times)
        return _samples(motion, further, times, states, motion.observed(times, states)[:3])

    return OrbitSolution(
        times=times[kept],
        coordinates=samples["coordinates"][kept],
        momenta=samples["momenta"][kept],
        energy=samples["energy"][kept],
        states=samples["states"][kept],
        further={key: x[kept] for key, x in samples["further"].items()},
        drift=drift,
        invariants=tuple(map(str, invariants)),
        method=solution.method,
        steps=solution.steps,
        trusted_digits=digits(error),
        lost=run.lost,
        note=solution.note,
        means=dict(zip(functions, map(float, means), strict=True)),
        scales=_scales(motion, derivation, samples, further),
        end=end,
        is_section=orbit.section is not None,
        remarks=remarks,
        at=at,
        knots=solution.knots,
    )


class _Run(NamedTuple):
    """A solution with its error and the sizes `scale` (2 n) of the variables, by which that is measured.

    The steps end at `stops`; an orbit with `until` ends at about that time, if it is met.
    """

    solution: Solution
    error: float
    lost: float | None
    scale: Floats
    stops: Floats
    times: Floats
    until: float | None


def _follow(
    orbit: Orbit,
    derivation: Derivation,
    initial: InitialState,
    motion: EquationsOfMotion,
    bounds: Keeper | None,
    crossing: Mapping[str, Values],
    progress: Callable[[float], None] | None,
    starts: int,
) -> _Run:
    """Integrate the equations of motion, and again in other steps, to see how many digits are right."""
    times, count = orbit.instants(1.0), 2 * len(initial.q)
    memory.require(len(times), 2 + len(motion.start))
    last, until = float(times[-1]), None
    stops, longest = foreseen(motion.watched, last, NAME)

    def follow(end: float, stops: Sequence[float], tolerance: float, **options: Any) -> Solution:
        return integrate.integrate(
            motion.flow,
            motion.start,
            (0.0, end),
            tolerance=tolerance,
            stops=stops,
            roundings=motion.roundings,
            name=NAME,
            longest=min(longest, orbit.max_step or math.inf),
            starts=starts,
            project=None if bounds is None else bounds.back,
            **options,
        )

    def first(end: float, **options: Any) -> Solution:
        tolerance = orbit.tolerance or DEFAULT_TOLERANCE
        return follow(end, stops[stops < end].tolist(), tolerance, engine=orbit.method, **options)

    if "orbit.until" in crossing:
        last, until = reach(first, crossing["orbit.until"], last, "orbit.until")
        stops = stops[stops < last]
        times = times if until is None else cut(times, until)
    exactly = partial(by_exponential, derivation, initial, last, orbit)
    solution = exactly() or first(last, progress=progress)
    # Zero at some samples must not pass for the size of a variable.
    scale = np.maximum(solution.largest, np.abs(solution.at(times)).max(axis=0))[:count]
    if bounds is not None:
        scale = np.maximum(scale, bounds.sizes(motion.values, solution))
    scale[scale == 0] = 1.0
    solution, error, lost = compared(
        solution,
        # A second solution by an exponential has steps that share no point with those of the first.
        lambda tolerance, stops: exactly(finer=1.37) or follow(last, stops, tolerance, like=solution),
        motion.watched,
        stops,
        lambda one, other: np.abs((one - other)[:, :count] / scale).max(axis=1),
        times,
    )
    return _Run(solution, error, lost, scale, stops, times, until)


def _first_row(function: Values) -> Values:
    return lambda times, states: function(times, states)[0]


def _samples(
    motion: EquationsOfMotion,
    further: Mapping[str, Expr],
    times: Floats,
    states: Floats,
    observed: Iterable[Floats],
) -> Samples:
    coordinates, momenta, energy = observed
    rows = motion.values([*further.values()], times, states)
    return {
        "times": times,
        "coordinates": coordinates,
        "momenta": momenta,
        "energy": energy,
        "states": states[:, : 2 * coordinates.shape[1]],
        "further": dict(zip(further, rows, strict=True)),
    }


def _require_values(times: Floats, further: Mapping[str, Floats]) -> None:
    """Raise ComputationError where a multiplier or an observable has no finite real value."""
    for key, row in further.items():
        if not np.isfinite(row).all():
            first = times[int(np.argmin(np.isfinite(row)))]
            raise ComputationError(f"`{key.partition('.')[2]}` has no finite real value at t = {first:.6g}")


def _drifts(
    motion: EquationsOfMotion,
    derivation: Derivation,
    initial: InitialState,
    solution: Solution,
    states: Floats,
    samples: Samples,
    energy_terms: Floats,
    invariants: Sequence[Expr],
) -> dict[str, float]:
    """By how much H and what is conserved change, in units of the largest sum of the sizes of their terms."""
    times, energy = samples["times"], samples["energy"]
    # The sizes of terms, too, are the largest along the run.
    way = solution.knots[:: 1 + len(solution.knots) // LOOKS_AT_TERMS]
    q, p, _, terms_on_the_way = motion.observed(way, solution.at(way))
    drift = {}
    if solution.method != linear_flow.METHOD or not derivation.energy_changes:
        gained = states[:, -1] if derivation.energy_changes else np.zeros(len(times))
        drift["H"] = _drift(energy - energy[0] - (gained - gained[0]), energy_terms, terms_on_the_way)
    for e in (*(symbol(f"p_{name}") for name in derivation.conserved_momenta), *invariants):
        values = values_of_terms(e, derivation.phase, initial.parameters)
        parts = values(times, *samples["coordinates"].T, *samples["momenta"].T)
        drift[str(e)] = _drift(parts.sum(axis=0), parts, values(way, *q.T, *p.T))
    return drift


def _drift(values: Floats, *terms: Floats) -> float:
    """The largest change of values (k), in units of the largest sum of the sizes of `terms` (any by any)."""
    change = float(np.abs(values - values[0]).max())
    size = max(float(np.abs(some).sum(axis=0).max()) for some in terms)
    return change / (size or 1.0) if change else 0.0


def _lost_in_slopes(motion: EquationsOfMotion, solution: Solution, scale: Floats) -> float:
    """The error that rounding in the slopes makes, in units of the sizes `scale` (2 n) of the variables.

    Two solutions share it, so that their difference does not show it. It has either sign in each step. An
    exponential has no slopes, and where fast rates die out, so does this error.
    """
    if solution.method in (linear_flow.METHOD, stiff.METHOD):
        return 0.0
    way = solution.knots[:: 1 + len(solution.knots) // LOOKS_AT_TERMS]
    errors = columns(motion.roundings)(way, *solution.at(way).T)[: len(scale)].mean(axis=1)
    largest = float((errors / scale).max())
    return largest * EPS * float(solution.knots[-1]) / math.sqrt(solution.steps or 1)


def _scales(
    motion: EquationsOfMotion, derivation: Derivation, samples: Samples, further: Mapping[str, Expr]
) -> dict[str, float]:
    times, states, phase = samples["times"], samples["states"], derivation.phase
    sizes = {key: np.abs(motion.values(terms(e), times, states)).sum(axis=0) for key, e in further.items()}
    keys = [*(f"q.{name}" for name in phase.coordinates), *(f"p.{name}" for name in phase.momenta)]
    sizes |= zip(keys, np.abs([*samples["coordinates"].T, *samples["momenta"].T]), strict=True)
    return {key: float(x.max()) for key, x in sizes.items()}


def curve(
    orbit: OrbitSolution, shown: Callable[[OrbitSolution], Floats], most: int = MOST_DRAWN
) -> OrbitSolution:
    """The orbit at so many times that straight lines between them are a smooth curve of what is `shown`.

    `shown` gives the quantities (k by m) that a picture has of an orbit. Intervals between samples, or ends
    of steps where samples are few, are halved until straight lines through their ends pass their middles by
    less than SMOOTH, or there are as many times as may be; those that are passed by most come first.
    """
    if orbit.at is None or orbit.knots is None or orbit.is_section or len(orbit.times) < 2:
        return orbit
    sampled = orbit.at

    def at(times: Floats) -> OrbitSolution:
        return replace(orbit, **sampled(times))

    last = orbit.times[-1]
    times = orbit.times[: -1 : 1 + 2 * len(orbit.times) // most]
    knots = orbit.knots[:: 1 + 8 * len(orbit.knots) // most]
    if len(knots) > len(times):  # samples that are few may stand a whole period apart
        inside = knots[(knots > times[0]) & (knots < last)]
        times = np.array(sorted({*times.tolist(), *inside.tolist()}))
    times = np.append(times, last)
    values = shown(at(times))
    places = np.arange(len(times) - 1)
    while len(places) and len(times) < most:
        middle = (times[places] + times[places + 1]) / 2
        there = shown(at(middle))
        width = np.ptp(values, axis=0) + EPS / SMOOTH * np.abs(values).max(axis=0)
        width[width == 0] = 1.0
        miss = (np.abs(there - (values[places] + values[places + 1]) / 2) / width).max(axis=1)
        halved = np.sort(np.argsort(-miss)[: min(most - len(times), (miss > SMOOTH).sum())])
        times = np.insert(times, places[halved] + 1, middle[halved])
        values = np.insert(values, places[halved] + 1, there[halved], axis=0)
        # The halves are looked at next: the places of the ones before moved by one for each insertion.
        left = places[halved] + np.arange(len(halved))
        places = np.sort(np.concatenate([left, left + 1]))
    return at(times)


def _met(
    orbit: Orbit, crossing: Mapping[str, Values], solution: Solution, times: Floats, until: float | None
) -> tuple[Solution, Floats, NDArray[np.bool_], tuple[float, str] | None, tuple[str, ...]]:
    """Apply `until` and `section`: the solution to its end, times, which of them are kept, the end, remarks.

    The end is about `until`, if ever; in a section, only the times of the section are kept.
    """
    end, remarks = None, list[str]()
    if orbit.until is not None:
        found = passes(crossing["orbit.until"], solution, "orbit.until")
        if until is None:
            end = (float(times[-1]), "duration")
            remarks.append(
                f"{equation(orbit.until.text)} is not passed within {times[-1]:.6g} s: the orbit is followed "
                "to its whole duration"
            )
        else:
            until = float(found.times[0]) if len(found.times) else until
            end = (until, equation(orbit.until.text))
            times = cut(times[:-1], until)
            solution = replace(solution, knots=cut(solution.knots, until))
        remarks += touching(orbit.until.text, found.touched[found.touched < times[-1]])
    kept = np.ones(len(times), dtype=bool)
    if orbit.section is not None:
        found = passes(crossing["orbit.section.at"], solution, "orbit.section.at")
        chosen = selected(found, orbit)
        times = np.array(sorted({*times.tolist(), *chosen.tolist()}))
        kept = np.isin(times, chosen)
        remarks += touching(orbit.section.at.text, found.touched)
    return solution, times, kept, end, tuple(remarks)


def by_exponential(
    derivation: Derivation, initial: InitialState, end: float, orbit: Orbit, finer: float = 1.0
) -> Solution | None:
    """The motion of linear equations that do not change with time, where it has many variables or takes many
    steps; else None."""
    # Its steps are too long for zeros to be found.
    asked = orbit.method != "auto" or orbit.max_step is not None or bool(orbit.events)
    if asked or derivation.linear is None or derivation.explicit_time:
        return None
    rows, shift = derivation.linear
    parts = ([e for row in rows for e in row], shift)
    if any(TIME in e.names for part in parts for e in part):
        return None
    values, offset = ([e.evaluate(**initial.parameters) if e else 0.0 for e in part] for part in parts)
    start = np.concatenate([initial.q, initial.p])
    matrix = np.reshape(values, (len(start), -1))
    if len(initial.q) < FEW_COORDINATES and linear_flow.rate(matrix) * end < FEW_RADIANS:
        return None
    found = linear_flow.solve(matrix, np.array(offset), start, end, finer)
    if found is None or not derivation.energy_changes:
        return found

    def sample(times: Floats) -> Floats:
        return np.pad(found.sample(times), ((0, 0), (0, 1)))

    # In place of the integral of dH/dt, which it does not have.
    return replace(found, sample=sample, largest=np.append(found.largest, 0.0))


def _require_range(solution: Solution, derivation: Derivation, initial: InitialState) -> None:
    """Raise ComputationError where momenta leave the range in which they have velocities on this branch."""
    for condition in () if derivation.branch is None else derivation.branch.conditions:
        times = np.linspace(0.0, solution.knots[-1], LOOKS_AT_RANGE)
        states = solution.at(times)[:, : 2 * len(initial.q)]
        values = values_of_terms(condition, derivation.phase, initial.parameters)(times, *states.T)
        outside = ~(values.sum(axis=0) > 0)
        if outside.any():
            time = times[int(np.argmax(outside))]
            raise ComputationError(
                f"the orbit has no velocities beyond t = {time:.3g}, expected {condition} > 0"
            )
