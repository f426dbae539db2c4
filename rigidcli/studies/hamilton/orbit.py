"""An orbit: its integration, its samples, how well it was followed, and what is read off it.

That is its end, the states of a Poincare section, and the period of motion to and fro.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rigidcli.algebra.expansion import coefficient, coefficients, has_degrees
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.core import integrate, memory, stiff
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.events import Events, events
from rigidcli.core.kicks import foreseen
from rigidcli.core.libration import CONVERGED, MOST_NODES, Libration, libration
from rigidcli.core.second_run import compared, rounding
from rigidcli.core.solution import Solution, Stopped, digits
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.document.system import Orbit
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics import linear_flow
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton import Findings, Progress
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    InitialState,
    Samples,
    Values,
    compiled,
    equations_of_motion,
    parts_of,
    sizes_of_pushes,
    terms,
    way_back,
)

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
# What comes this near to zero and goes back is no pass, in units of the largest value, as errors are.
TOUCHING = 1e-10
# Where an orbit cannot be followed on, it is looked for its end up to this share of the time before.
BEFORE_STOP = 1e-6
# The orbit may pass a turning point by this share of their distance, or it does not turn there.
BEYOND_TURNING = 1e-6
# The nodes of the first sum for an action; then there are twice as many, and so on.
FEWEST_NODES = 128


class OrbitSolution(NamedTuple):
    """The `samples` of an orbit, or of several one after the other, and how well it was followed.

    `drift` is the change of H and of the conserved quantities, in units of the largest sum of the sizes of
    their terms; where H changes by law, the integral of dH/dt is taken off. Observables have `means` over the
    orbit; `scales` are the largest sums of the sizes of the terms of what is sampled.
    From `lost` on, if ever, a second orbit in other steps has nothing in common with this one.
    The `end` is the time at which an orbit with `until` ends, and why; `remarks` are notes for people.
    `at` gives samples at other times, and `solution` has the states at any time: None for many orbits.
    """

    samples: Samples
    drift: dict[str, float]
    method: str
    steps: int
    trusted_digits: float
    lost: float | None
    means: dict[str, float]
    scales: dict[str, float]
    remarks: tuple[str, ...] = ()
    end: tuple[float, str] | None = None
    is_section: bool = False
    at: Callable[[Floats], Samples] | None = None
    solution: Solution | None = None


@np.errstate(over="ignore", invalid="ignore")
def solve_orbit(found: Findings, progress: Progress) -> OrbitSolution:
    """The orbit that a document asks for, from what was `found` on it before.

    Raises ComputationError where the orbit ends early, or needs too many steps, or too much memory.
    """
    derivation, orbit, initial = found.derivation, found.document.orbit, found.initial
    assert orbit is not None
    assert initial is not None
    functions = found.functions
    motion = equations_of_motion(derivation, tuple(initial.parameters.items()))
    passing = {} if found.observed is None else found.observed.events
    further = {f"multipliers.{one.name}": one.multiplier for one in derivation.system.constraints} | functions
    observe = motion.observer({key: terms(e) for key, e in further.items()})
    passes = {key: Event(key, orbit.events[key].text, motion.function([e])) for key, e in passing.items()}
    solution, error, lost, times, until = _follow(found, motion, passes.get("orbit.until"), progress)
    times, end, at_end = ended(passes.get("orbit.until"), solution, times, until)
    if end is not None:
        solution = solution._replace(knots=cut(solution.knots, end[0]))
    chosen, at_section = None, list[str]()
    if orbit.section is not None:
        chosen, at_section = section_times(passes["orbit.section.at"], solution, orbit.section.direction)
        times = np.array(sorted({*times.tolist(), *chosen.tolist()}))

    def at(times: Floats) -> Samples:
        return observe(times, solution.at(times))

    _require_range(solution, derivation, motion)
    samples = at(times)
    _require_values(samples, further)
    kept = conserved(derivation)
    watch, knots = motion.observer(kept), _looks(solution)
    drift = drifts(motion, kept, [watch(times, samples.states), watch(knots, solution.at(knots))])
    if not derivation.energy_changes:
        error = max(error, drift["H"])
    elif solution.method == linear_flow.METHOD:
        del drift["H"]  # the energy that time or forces have brought was not integrated
    means = solution.mean(motion.function(functions.values())) if functions else ()
    return OrbitSolution(
        samples=samples if chosen is None else at(chosen),
        drift=drift,
        method=solution.method,
        steps=solution.steps,
        trusted_digits=digits(error),
        lost=lost,
        means=dict(zip(functions, map(float, means), strict=True)),
        scales={key: float(sizes.max()) for key, sizes in samples.sizes.items()},
        remarks=(*filter(None, [solution.note]), *at_end, *at_section),
        end=end,
        is_section=chosen is not None,
        at=at,
        solution=solution,
    )


def _require_values(samples: Samples, keys: Iterable[str]) -> None:
    """Raise ComputationError where H is too large, or what stands under one of the keys has no value."""
    too_large = np.isinf(samples.sizes["H"])
    if too_large.any():
        time = samples.times[int(np.argmax(too_large))]
        raise ComputationError(
            f"the motion grows beyond the range of numbers: at t = {time:.6g} H is larger than any of them",
            hint="take a shorter span",
        )
    for key in keys:
        has_value = np.isfinite(samples.values[key])
        if not has_value.all():
            time, name = samples.times[int(np.argmin(has_value))], key.partition(".")[2]
            raise ComputationError(f"`{name}` has no finite real value at t = {time:.6g}")


def _follow(
    found: Findings, motion: EquationsOfMotion, until: Event | None, progress: Progress
) -> tuple[Solution, float, float | None, Floats, float | None]:
    """Integrate the equations of motion, and again in other steps, to see how many digits are right.

    Returns the solution, its error in units of the sizes of the variables, when it is lost, if ever, the
    times of its samples, and about when an orbit with `until` ends, if it does.
    """
    derivation, orbit, initial = found.derivation, found.document.orbit, found.initial
    assert orbit is not None
    assert initial is not None
    times, count, start = orbit.instants(1.0), 2 * len(initial.q), motion.start(initial)
    memory.require(len(times), 2 + len(start))
    last, end = float(times[-1]), None
    stops, longest = foreseen(motion.watched, last, NAME)
    is_bound = bool(derivation.system.constraints)

    follow = partial(
        integrate.integrate,
        motion.flow,
        start,
        roundings=motion.roundings,
        name=NAME,
        longest=min(longest, orbit.max_step or math.inf),
        starts=found.document.starts,
        project=way_back(derivation, initial.parameters) if is_bound else None,
    )

    def first(end: float, **options: Any) -> Solution:
        tolerance, before = orbit.tolerance or DEFAULT_TOLERANCE, stops[stops < end].tolist()
        return follow((0.0, end), tolerance=tolerance, stops=before, engine=orbit.method, **options)

    def second(tolerance: float, stops: Sequence[float]) -> Solution:
        # That by an exponential has steps that share no point with those of the first.
        other = exactly and exactly(1.37)
        return other or follow((0.0, last), tolerance=tolerance, stops=stops, like=solution)

    if until is not None:
        last, end = reach(first, until, last)
        stops = stops[stops < last]
        times = times if end is None else cut(times, end)
    exactly = by_exponential(derivation, initial, orbit, last)
    solution = (exactly and exactly(1.0)) or first(last, progress=progress)
    # Zero at some samples must not pass for the size of a variable.
    scale = np.maximum(solution.largest, np.abs(solution.at(times)).max(axis=0))[:count]
    if is_bound:
        scale = np.maximum(scale, sizes_of_pushes(derivation, motion, solution))
    scale[scale == 0] = 1.0
    solution, error, lost = compared(
        solution,
        second,
        motion.watched,
        stops,
        lambda one, other: np.abs((one - other)[:, :count] / scale).max(axis=1),
        times,
    )
    error = max(error, rounding(solution, stops))
    # An exponential has no slopes, and where fast rates die out, so does the rounding in them.
    if solution.method not in (linear_flow.METHOD, stiff.METHOD):
        knots, steps = _looks(solution), np.array([solution.steps])
        error = max(error, motion.lost_in_slopes(knots, solution.at(knots), scale[:, None], steps, last))
    return solution, error, lost, times, end


def _require_range(solution: Solution, derivation: Derivation, motion: EquationsOfMotion) -> None:
    """Raise ComputationError where momenta leave the range in which they have velocities on this branch."""
    for condition in () if derivation.branch is None else derivation.branch.conditions:
        times = np.linspace(0.0, solution.knots[-1], LOOKS_AT_RANGE)
        outside = ~(motion.function([condition])(times, solution.at(times))[0] > 0)
        if outside.any():
            time = times[int(np.argmax(outside))]
            raise ComputationError(
                f"the orbit has no velocities beyond t = {time:.3g}, expected {condition} > 0"
            )


def conserved(derivation: Derivation) -> dict[str, list[Expr]]:
    """The terms of what is conserved besides H, and of constraints, by their names."""
    momenta = (symbol(f"p_{name}") for name in derivation.conserved_momenta)
    found = {str(e): terms(e) for e in (*momenta, *(derivation.invariants or ()))}
    limits, coordinates = derivation.system.constraints, derivation.phase.coordinates
    return found | {one.name: parts_of(one, coordinates) for one in limits}


def drifts(
    motion: EquationsOfMotion, kept: Iterable[str], looks: Sequence[Samples], orbits: int = 1
) -> dict[str, float]:
    """By how much H and what is `kept` change, in units of the largest sums of the sizes of their terms.

    The changes are those at the first of the `looks`, which has so many `orbits` one after the other; sizes
    are the largest of all looks. What time and forces bring is taken off H.
    """
    first, found = looks[0], dict[str, float]()
    values = {**first.values, "H": first.values["H"] - motion.gained(first.states)}
    for name in ("H", *kept):
        rows = values[name].reshape(orbits, -1)
        largest = np.abs(rows - rows[:, :1]).max(axis=1)
        sizes = np.max([look.sizes[name].reshape(orbits, -1).max(axis=1) for look in looks], axis=0)
        share = float((largest / np.where(largest > 0, sizes, 1.0)).max())
        found[name] = share if share > np.finfo(float).tiny else 0.0  # of very large terms
    return found


def _looks(solution: Solution) -> Floats:
    return solution.knots[:: 1 + len(solution.knots) // LOOKS_AT_TERMS]


def curve(orbit: OrbitSolution, shown: Callable[[Samples], Floats], most: int = MOST_DRAWN) -> Samples:
    """The orbit at so many times that straight lines between them are a smooth curve of what is `shown`.

    `shown` gives the quantities (k by m) that a picture has of an orbit. Intervals between samples, or ends
    of steps where samples are few, are halved until straight lines through their ends pass their middles by
    less than SMOOTH, or there are as many times as may be; those that are passed by most come first.
    """
    samples, at = orbit.samples, orbit.at
    if at is None or orbit.solution is None or orbit.is_section or len(samples.times) < 2:
        return samples
    last = samples.times[-1]
    times = samples.times[: -1 : 1 + 2 * len(samples.times) // most]
    knots = orbit.solution.knots
    knots = knots[:: 1 + 8 * len(knots) // most]
    if len(knots) > len(times):  # samples that are few may stand a whole period apart
        inside = knots[(knots > times[0]) & (knots < last)]
        times = np.array(sorted({*times.tolist(), *inside.tolist()}))
    times = np.append(times, last)
    while True:
        middle = (times[:-1] + times[1:]) / 2
        values, there = shown(at(times)), shown(at(middle))
        width = np.ptp(values, axis=0) + EPS / SMOOTH * np.abs(values).max(axis=0)
        width[width == 0] = 1.0
        miss = (np.abs(there - (values[:-1] + values[1:]) / 2) / width).max(axis=1)
        halved = np.argsort(-miss)[: max(0, min(most - len(times), (miss > SMOOTH).sum()))]
        if not len(halved):
            return at(times)
        times = np.sort(np.append(times, middle[halved]))


def by_exponential(
    derivation: Derivation, initial: InitialState, orbit: Orbit, end: float
) -> Callable[[float], Solution | None] | None:
    """The motion of linear equations that do not change with time, as a function of `finer` of `linear_flow`,
    where it has many variables or takes many steps; else None."""
    # Its steps are too long for zeros to be found.
    asked = orbit.method != "auto" or orbit.max_step is not None or bool(orbit.events)
    if asked or derivation.linear is None or derivation.explicit_time:
        return None
    if any(TIME in e.names for part in derivation.linear for e in part.flat):
        return None
    in_floats = np.vectorize(lambda e: e.evaluate(**initial.parameters) if e else 0.0, otypes=[np.float64])
    matrix, offset = map(in_floats, derivation.linear)
    start = np.concatenate([initial.q, initial.p])
    if len(initial.q) < FEW_COORDINATES and linear_flow.rate(matrix) * end < FEW_RADIANS:
        return None

    def motion(finer: float) -> Solution | None:
        found = linear_flow.solve(matrix, offset, start, end, finer)
        if found is None or not derivation.energy_changes:
            return found
        # In place of the integral of dH/dt, which it does not have.
        longer = partial(np.pad, pad_width=((0, 0), (0, 1)))
        sizes = np.append(found.largest, 0.0)
        return found._replace(sample=lambda times: longer(found.sample(times)), largest=sizes)

    return motion


# --- events: the end of an orbit, and the states of a Poincare section


class Event(NamedTuple):
    """A function of the state that passes zero: its key in the document, its text and its values (1 by k)."""

    key: str
    text: str
    values: Values

    def passes(self, solution: Solution) -> Events:
        """The zeros along an orbit. Raises ComputationError where the function has no value before one."""
        found = events(lambda times, states: self.values(times, states)[0], solution, TOUCHING)
        ends = self.key == "orbit.until" and len(found.times) > 0
        if found.gap is not None and not (ends and found.times[0] < found.gap):
            raise ComputationError(f"`{self.key}` has no finite real value at t = {found.gap:.6g}")
        return found

    def touches(self, times: Floats) -> list[str]:
        """A remark on the times at which the function comes to zero and goes back."""
        if not len(times):
            return []
        more = f" and at {len(times) - 1} more times" if len(times) > 1 else ""
        where = equation(self.text)
        return [f"at t = {times[0]:.10g}{more} the orbit touches {where} and does not pass it"]


def equation(text: str) -> str:
    """What holds where an expression, or the difference of two sides, vanishes."""
    return text if "=" in text else f"{text} = 0"


def reach(follow: Callable[[float], Solution], event: Event, end: float) -> tuple[float, float | None]:
    """The time to which an orbit is to be followed, and the first zero of an event before it, or None.

    The orbit may stop behind its end: a planet that is followed to the surface of the sun would fall into it.
    """
    stopped: Stopped | None = None
    try:
        solution = follow(end)
    except Stopped as stop:
        if stop.time <= 0:
            raise
        stopped, solution = stop, follow(stop.time * (1 - BEFORE_STOP))
    found = event.passes(solution)
    if not len(found.times):
        if stopped is not None:
            raise stopped
        return end, None
    beyond = solution.knots[solution.knots > found.times[0]]
    return float(beyond[:2][-1]) if len(beyond) else end, float(found.times[0])


def ended(
    event: Event | None, solution: Solution, times: Floats, until: float | None
) -> tuple[Floats, tuple[float, str] | None, list[str]]:
    """The times of an orbit to its end, which is about `until` if ever; when and why it ends, and remarks."""
    if event is None:
        return times, None, []
    found, reason, remarks = event.passes(solution), equation(event.text), list[str]()
    if until is None:
        remarks.append(
            f"{reason} is not passed within {times[-1]:.6g} s: the orbit is followed to its whole duration"
        )
        reason = "duration"
    else:
        times = cut(times[:-1], float(found.times[0]) if len(found.times) else until)
    remarks += event.touches(found.touched[found.touched < times[-1]])
    return times, (float(times[-1]), reason), remarks


def cut(times: Floats, end: float) -> Floats:
    """The ascending times before an end, and the end itself."""
    return np.append(times[times < end], end)


def section_times(event: Event, solution: Solution, direction: str) -> tuple[Floats, list[str]]:
    """The times of a section, and remarks. Raises ComputationError where there are none."""
    found = event.passes(solution)
    times = found.times if direction == "both" else found.times[found.upwards == (direction == "up")]
    if not len(times):
        way = {"up": " upwards", "down": " downwards", "both": ""}[direction]
        others = f"; {len(found.times)} times the other way: `direction: both`" if len(found.times) else ""
        raise ComputationError(
            f"the orbit never passes {equation(event.text)}{way}, so that the section is empty",
            hint=f"take a longer `orbit.duration`{others}",
        )
    return times, event.touches(found.touched)


# --- motion to and fro


def period(derivation: Derivation, initial: InitialState, orbit: OrbitSolution) -> Libration | None:
    """The motion to and fro of the only coordinate that is not cyclic, if the `orbit` shows one.

    The momenta of cyclic coordinates are constant, so that the other coordinate moves by itself: in a central
    field, r from one apsis to the other and back (L. Landau, E. Lifshitz, Mechanics, section 14).
    """
    phase, place = derivation.phase, place_alone(derivation)
    parts = quadratic_parts(derivation)
    if parts is None:
        return _read_off(derivation, initial, orbit)
    # The momenta of the cyclic coordinates stay what they are at the start.
    constants = dict(zip(phase.momenta, map(float, initial.p), strict=True))
    q, p = float(initial.q[place]), constants.pop(phase.momenta[place])
    values = compiled(parts, [phase.coordinates[place]], {**initial.parameters, **constants})
    a, b, c = values(np.zeros(1), np.array([q]))[:, 0]
    energy = float((a * p + b) * p + c)

    def function(places: Floats) -> tuple[Floats, Floats, Floats]:
        a, b, c = values(np.zeros(len(places)), places)
        return b**2 - 4 * a * (c - energy), a, b**2 + 4 * np.abs(a) * (np.abs(c) + abs(energy))

    path = orbit.samples.values[f"q.{phase.coordinates[place]}"]
    spread = float(np.ptp(path))
    found = libration(function, q, max(spread, abs(q) / 100) / 8 or 1.0)
    if found is None:
        return None
    first, last = found.turning_points
    slack = BEYOND_TURNING * (last - first)
    return found if first - slack <= path.min() and path.max() <= last + slack else None


def place_alone(derivation: Derivation) -> int:
    """The place of the only coordinate that is not cyclic."""
    (place,) = (k for k, q in enumerate(derivation.phase.coordinates) if q not in derivation.cyclic)
    return place


def quadratic_parts(derivation: Derivation) -> list[Expr] | None:
    """a, b, c of H = a p^2 + b p + c for the coordinate that moves alone; None where H is something else."""
    polynomial = None
    with suppress(ExpressionError):
        if derivation.hamiltonian is not None:
            polynomial = coefficients(
                derivation.hamiltonian, [derivation.phase.momenta[place_alone(derivation)]]
            )
    if not has_degrees(polynomial, 0, 1, 2) or (2,) not in polynomial:
        return None
    return [coefficient(polynomial, 1, *[0] * k) for k in (2, 1, 0)]


def _read_off(derivation: Derivation, initial: InitialState, orbit: OrbitSolution) -> Libration | None:
    """The motion to and fro of any H, from the orbit itself: from one turning point until it is there again.

    None where the orbit ends before. The action is a sum over equal steps of the time, which converges
    geometrically as what is added up comes back.
    """
    solution = orbit.solution
    if solution is None or derivation.equations is None:
        return None
    place, phase = place_alone(derivation), derivation.phase
    motion = equations_of_motion(derivation, tuple(initial.parameters.items()))
    position, momentum = symbol(phase.coordinates[place]), symbol(phase.momenta[place])
    look = motion.function([position, momentum, derivation.equations[place]])

    def at(times: Floats) -> Floats:
        """q, p and the rate of q (3 by k)."""
        return look(times, solution.at(times))

    sizes = np.abs(at(solution.knots)).max(axis=1)
    is_at_rest = abs(at(np.zeros(1))[2, 0]) <= TOUCHING * sizes[2]  # such a start is no pass through zero
    passes = events(lambda times, states: look(times, states)[2], solution, TOUCHING).times
    turns = np.append(np.zeros(int(is_at_rest)), passes)
    if not len(turns):
        return None
    there = at(turns)[:2]
    is_back = (np.abs(there - there[:, :1]) <= BEYOND_TURNING * sizes[:2, None]).all(axis=0)
    later = np.flatnonzero(is_back)[1:]
    if not len(later):
        return None
    span, nodes, action, change = float(turns[later[0]] - turns[0]), FEWEST_NODES, math.inf, math.inf
    while change > CONVERGED and nodes <= MOST_NODES:
        _, p, rate = at(turns[0] + span * np.arange(nodes) / nodes)
        before, action = action, abs(span * float((p * rate).mean()))
        change, nodes = abs(before / action - 1), 2 * nodes
    ends = there[0, : later[0] + 1]
    return Libration((float(ends.min()), float(ends.max())), span, action, change)


def why_no_period(derivation: Derivation, orbit: OrbitSolution) -> list[str]:
    """A note where H is not quadratic in p, and the orbit does not show its period."""
    if quadratic_parts(derivation) is not None:
        return []
    why = "the orbit does not come back in its duration"
    if derivation.equations is None:
        why = "H is not written"
    elif orbit.solution is None:
        why = "orbits that are followed together do not show it"
    return [f"no period is told: H is not quadratic in the momentum, and {why}"]
