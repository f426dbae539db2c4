"""An orbit in phase space: its initial state, its integration with measures of how well, and its program."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.trees import to_tree
from rigidcli.core import integrate, memory, stiff
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.estimate import columns, compared, foreseen, rounding
from rigidcli.core.solution import NO_VALUE, Flow, Solution, digits
from rigidcli.document.document import Document
from rigidcli.document.orbit import Orbit
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.language.sharing import shared
from rigidcli.mechanics import linear_flow
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.mechanics.legendre import Momenta
from rigidcli.mechanics.velocity_inversion import Branch
from rigidcli.report import Program, Run
from rigidcli.studies.hamilton.derivation import Derivation, on_this_side
from rigidcli.studies.hamilton.equations_of_motion import (
    KEY,
    InitialState,
    equations_of_motion,
    symbolic_equations,
    values_of_terms,
)
from rigidcli.studies.hamilton.equations_of_motion import terms as terms_of
from rigidcli.studies.hamilton.passes import Values, cut, equation, passes, reach, selected, touching
from rigidcli.studies.hamilton.system import require_formulas

SAME = 1e-6
"""Velocities belong to a branch if they differ by less than this, in units of their size."""


def initial_state(
    document: Document, orbit: Orbit, derivation: Derivation
) -> tuple[Derivation, InitialState]:
    """The system on the branch of the velocities that an orbit begins on, and the state there.

    Raises DocumentError where the system has no motion from there, and ComputationError where H has steps.
    """
    assert document.system is not None
    for place in derivation.jumps:
        raise ComputationError(
            f"H has a step where {place} = 0, at which a momentum changes suddenly",
            hint=f"write a gradual step, such as {apply('tanh', place / symbol('d'))} with a small d",
        )
    q, p, v = orbit.start(document.system)
    parameters = {name: float(value) for name, value in document.values.items()}
    point = _Point(document, {TIME: 0.0, **parameters}).at(derivation.phase.coordinates, q)
    if p is None:
        assert v is not None
        p = _momenta(point, derivation, v)
    point = point.at(derivation.phase.momenta, p)
    if derivation.branches and not derivation.are_linear:
        derivation = on_this_side(derivation, point.known)
        branch = _branch(point, derivation, v)
        derivation = replace(derivation, branches=() if branch is None else (branch,))
    elif derivation.momenta is not None and not derivation.are_linear and v is None:
        v = _velocities(point, derivation.momenta, derivation.velocity_names, p)
        shown = ", ".join(f"{name} = {x:.6g}" for name, x in zip(derivation.velocity_names, v, strict=True))
        notes = (*derivation.notes, f"the momenta at the start belong to {shown}, and perhaps to others, too")
        derivation = replace(derivation, notes=notes)
    if derivation.system.constraints:
        from rigidcli.studies.hamilton.constrained import keeper, on_constraints

        if v is None and derivation.velocities is not None:
            v = point.evaluate(derivation.velocities, "a velocity")
        elif v is None:
            assert derivation.momenta is not None
            v = _velocities(point, derivation.momenta, derivation.velocity_names, p)
        q, v = on_constraints(document, keeper(derivation, parameters), q, v)
        point = point.at(derivation.phase.coordinates, q)
        p = _momenta(point, derivation, v)
        point = point.at(derivation.phase.momenta, p)
    if derivation.hamiltonian is not None:
        point.evaluate([derivation.hamiltonian], "H")
    return derivation, InitialState(parameters, q, p, v)


@dataclass(frozen=True, slots=True)
class _Point:
    """Values of names at the start."""

    document: Document
    known: Mapping[str, float]

    def at(self, names: Sequence[str], values: Floats) -> _Point:
        """Add the values of more names."""
        return replace(self, known={**self.known, **dict(zip(names, map(float, values), strict=True))})

    def evaluate(self, expressions: Sequence[Expr], what: str) -> Floats:
        """The values of expressions; DocumentError says of `what` that it has none."""
        try:
            f = code.function([to_tree(e) for e in expressions], list(self.known), {})(math)
            values = np.array(f(*self.known.values()), dtype=np.float64)
        except NO_VALUE:
            values = np.array([math.nan])
        if not np.isfinite(values).all():
            raise self.document.refusal(f"{what} has no finite real value there", KEY)
        return values


def _momenta(point: _Point, derivation: Derivation, v: Floats) -> Floats:
    """The momenta from the velocities: by definition, or where H is given from v = dH/dp linear in them."""
    if derivation.momenta is not None:
        return point.at(derivation.velocity_names, v).evaluate(derivation.momenta.definitions, "a momentum")
    names, size = derivation.phase.momenta, len(v)
    slopes = [derivative(derivation.generator, name) for name in names]
    matrix = [derivative(slope, name) for slope in slopes for name in names]
    if any(not entry.names.isdisjoint(names) for entry in matrix):
        raise point.document.refusal(
            "velocities do not tell the momenta, as dH/dp is not linear in them",
            KEY,
            hint=f"give the momenta {', '.join(names)}",
        )
    values = point.at(names, np.zeros(size)).evaluate([*slopes, *matrix], "a velocity")
    try:
        return np.asarray(np.linalg.solve(values[size:].reshape(size, size), v - values[:size]))
    except np.linalg.LinAlgError:
        raise ComputationError("the velocities do not tell the momenta there: dH/dp is degenerate") from None


def _velocities(point: _Point, momenta: Momenta, names: Sequence[str], p: Floats) -> Floats:
    """Velocities (n) with the momenta p (n), by a search from rest. Raises DocumentError where it fails."""
    from scipy.optimize import root

    entries = [*momenta.definitions, *(e for row in momenta.mass_matrix for e in row)]
    size = len(p)

    def miss(v: Floats) -> tuple[Floats, Floats]:
        values = point.at(names, v).evaluate(entries, "a momentum")
        return values[:size] - p, values[size:].reshape(size, size)

    v: Floats = root(miss, np.zeros(size), jac=True, method="lm", tol=1e-15).x
    if np.abs(miss(v)[0]).max() > SAME * np.abs(p).max():
        raise point.document.refusal(
            "no velocities were found that have these momenta",
            KEY,
            hint=f"give the velocities {', '.join(names)} instead",
        )
    return v


def _branch(point: _Point, derivation: Derivation, v: Floats | None) -> Branch | None:
    """The branch of the velocities that the orbit begins on; None if these are to be followed themselves.

    That is so if they belong to none of the branches, or the form of the branch changes on the way.
    """
    branches = derivation.branches
    inside = [b for b in branches if min(point.evaluate(b.conditions, "a momentum"), default=1.0) > 0]
    values = [point.evaluate(branch.velocities, "a velocity") for branch in inside]
    if v is not None:
        near = (np.allclose(known, v, rtol=SAME, atol=SAME * np.abs(v).max()) for known in values)
        return next((branch for branch, is_same in zip(inside, near, strict=True) if is_same), None)
    if not inside:
        raise point.document.refusal(f"no velocity has these momenta, expected {branches[0].validity}", KEY)
    if len(inside) == 1:
        return inside[0]
    names = derivation.velocity_names
    listed = "; ".join(
        ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, known, strict=True))
        for known in sorted(values, key=tuple)
    )
    raise point.document.refusal(
        f"{len(inside)} velocities have these momenta: {listed}",
        KEY,
        hint=f"give the velocities {', '.join(names)} instead",
    )


LEAST_SIZE = 1e-3
"""The least size of a variable with which its errors are compared, in units of what its rate is made of.

A variable that stays zero only as large numbers cancel is noise, about 1e-16 of these: no program can follow
it with errors of 1e-12 of its own size.
"""

NUDGE = 1e-6
"""By how much variables are changed, in units of themselves, to see what rates are made of."""

FEW, MANY_TURNS = 6, 1e4
"""With fewer coordinates, and rates times the span below this, steps are as quick as an exponential."""

LOOKS_AT_TERMS = 64
"""Steps of an orbit, besides its samples, at which the terms of what is conserved are looked at."""

LOOKS = 4097
"""Times at which it is looked whether an orbit has left its range: they tell three digits of the end."""


@dataclass(frozen=True, slots=True, eq=False)
class OrbitSolution:
    """An orbit at `times` (k): coordinates and momenta (both k by n) and H (k).

    `drift` is the change of H and of the conserved quantities, in units of the largest sum of the sizes of
    their terms; where H changes by law, the integral of dH/dt is taken off. What is neither H nor a momentum
    is one of the `invariants`. The `states` (k by 2 n) have the variables that were integrated. `further`
    samples (k), such as those of multipliers, stand under their keys, and the `means` over the orbit of some;
    `scales` are the largest sums of the sizes of their terms.
    The `end` is the time at which an orbit with `until` ends, and why; what events have met is in `remarks`.
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
    further: dict[str, Floats]
    means: dict[str, float]
    scales: dict[str, float]
    end: tuple[float, str] | None = None
    is_section: bool = False
    remarks: tuple[str, ...] = ()


@np.errstate(over="ignore", invalid="ignore")
def solve_orbit(
    orbit: Orbit,
    derivation: Derivation,
    initial: InitialState,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
    starts: int = 1,
    functions: Mapping[str, Expr] | None = None,
    passing: Mapping[str, Expr] | None = None,
) -> OrbitSolution:
    """The orbit that a document asks for, one of so many `starts`; with the drift of `invariants`, too.

    `functions` of the state, as `observables` writes them, are sampled under their keys, and have means; of
    those that are `passing`, under the keys of the document, zeros are looked for.

    Raises ComputationError where the orbit ends early, or needs too many steps, or too much memory.
    """
    motion, name = equations_of_motion(derivation, initial), "the orbit"
    times = orbit.instants(1.0)
    memory.require(len(times), 2 + len(motion.start))
    span = (0.0, float(times[-1]))
    stops, longest = foreseen(motion.watched, span[1], name)
    limits = derivation.system.constraints
    bounds = None
    if limits:
        from rigidcli.studies.hamilton.constrained import keeper

        bounds = keeper(derivation, initial.parameters)
    tolerance = orbit.tolerance or DEFAULT_TOLERANCE
    follow = partial(
        integrate.integrate,
        motion.flow,
        motion.start,
        roundings=motion.roundings,
        name=name,
        longest=min(longest, orbit.max_step or math.inf),
        starts=starts,
        project=None if bounds is None else bounds.back,
    )
    until, crossing = None, {key: _first_row(motion.function([e])) for key, e in (passing or {}).items()}
    if "orbit.until" in crossing:
        far, until = reach(
            lambda end: follow(
                (0.0, end), tolerance=tolerance, stops=stops[stops < end].tolist(), engine=orbit.method
            ),
            crossing["orbit.until"],
            span[1],
            "orbit.until",
        )
        span, stops = (0.0, far), stops[stops < far]
        times = times if until is None else cut(times, until)
    solution = by_exponential(derivation, initial, span[1], orbit) or follow(
        span, tolerance=tolerance, stops=stops.tolist(), engine=orbit.method, progress=progress
    )
    # Zero at some samples must not pass for the size of a variable.
    scale = np.maximum(solution.largest, np.abs(solution.at(times)).max(axis=0))[: 2 * len(initial.q)]
    if bounds is not None:
        scale = np.maximum(scale, bounds.sizes(motion.values, solution))
    scale[scale == 0] = 1.0
    solution, error, lost = compared(
        solution,
        # A second solution by an exponential has steps that share no point with those of the first.
        lambda tolerance, stops: (
            by_exponential(derivation, initial, span[1], orbit, finer=1.37)
            or follow(span, tolerance=tolerance, stops=stops, like=solution)
        ),
        motion.watched,
        stops,
        lambda one, other: np.abs((one - other)[:, : len(scale)] / scale).max(axis=1),
        times,
    )
    solution, times, kept, end, remarks = _met(orbit, crossing, solution, times, until)
    _require_range(solution, derivation, initial)
    states = solution.at(times)
    coordinates, momenta, energy, terms = motion.observed(times, states)
    # The sizes of terms, too, are the largest along the run.
    way = solution.knots[:: 1 + len(solution.knots) // LOOKS_AT_TERMS]
    on_the_way = motion.observed(way, solution.at(way))
    drift = {}
    if solution.method != linear_flow.METHOD or not derivation.energy_changes:
        gained = states[:, -1] if derivation.energy_changes else np.zeros(len(times))
        drift["H"] = _drift(energy - energy[0] - (gained - gained[0]), terms, on_the_way[3])
    for e in (*(symbol(f"p_{name}") for name in derivation.conserved_momenta), *invariants):
        values = values_of_terms(e, derivation.phase, initial.parameters)
        parts = values(times, *coordinates.T, *momenta.T)
        drift[str(e)] = _drift(parts.sum(axis=0), parts, values(way, *on_the_way[0].T, *on_the_way[1].T))
    # Both solutions share rounding errors of their slopes, in each step of either sign. An exponential has
    # no slopes, and where fast rates die out, so do these errors.
    lost_in_slopes = columns(motion.roundings)(way, *solution.at(way).T)[: len(scale)].mean(axis=1)
    noise = float((lost_in_slopes / scale).max()) * EPS * span[1] / math.sqrt(solution.steps or 1)
    if solution.method in (linear_flow.METHOD, stiff.METHOD):
        noise = 0.0
    # The energy that time or forces have brought is one more integral, with errors of its own.
    energy_error = 0.0 if derivation.energy_changes else drift["H"]
    if bounds is not None:
        misses = np.abs(bounds.measured(times, states[:, : 2 * len(initial.q)])).max(axis=1)
        drift |= {one.name: float(miss) for one, miss in zip(limits, misses, strict=True)}
    further = {f"multipliers.{one.name}": one.multiplier for one in limits} | dict(functions or {})
    samples = motion.values([*further.values()], times, states)
    for key, row in zip(further, samples, strict=True):
        if not np.isfinite(row).all():
            first = times[int(np.argmin(np.isfinite(row)))]
            raise ComputationError(f"`{key.partition('.')[2]}` has no finite real value at t = {first:.6g}")
    means = solution.mean(partial(motion.values, [*functions.values()])) if functions else ()
    return OrbitSolution(
        times[kept],
        coordinates[kept],
        momenta[kept],
        energy[kept],
        drift,
        tuple(map(str, invariants)),
        solution.method,
        solution.steps,
        states[kept, : 2 * len(initial.q)],
        digits(max(error, energy_error, noise, rounding(solution, stops))),
        lost,
        solution.note,
        dict(zip(further, samples[:, kept], strict=True)),
        dict(zip(functions or (), map(float, means), strict=True)),
        {
            key: float(np.abs(motion.values(terms_of(e), times, states)).sum(axis=0).max())
            for key, e in further.items()
        }
        | {
            key: float(np.abs(x).max())
            for prefix, names, rows in (
                ("q", derivation.phase.coordinates, coordinates.T),
                ("p", derivation.phase.momenta, momenta.T),
            )
            for key, x in zip((f"{prefix}.{name}" for name in names), rows, strict=True)
        },
        end,
        orbit.section is not None,
        remarks,
    )


def _first_row(function: Values) -> Values:
    return lambda times, states: function(times, states)[0]


def _met(
    orbit: Orbit, crossing: Mapping[str, Values], solution: Solution, times: Floats, until: float | None
) -> tuple[Solution, Floats, NDArray[np.bool_], tuple[float, str] | None, tuple[str, ...]]:
    """The solution to its end, the times of its samples, which of them are kept, the end, and remarks.

    The end is about `until`, if ever; in a section, only the times of the section are kept.
    """
    end, remarks = None, list[str]()
    if orbit.until is not None:
        if until is None:
            end = (float(times[-1]), "duration")
            remarks.append(
                f"{equation(orbit.until.text)} is not passed within {times[-1]:.6g} s: the orbit is followed "
                "to its whole duration"
            )
            found = passes(crossing["orbit.until"], solution, "orbit.until")
        else:
            found = passes(crossing["orbit.until"], solution, "orbit.until")
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


def _drift(values: Floats, *terms: Floats) -> float:
    """The largest change of values (k), in units of the largest sum of the sizes of `terms` (any by any)."""
    change = float(np.abs(values - values[0]).max())
    size = max(float(np.abs(some).sum(axis=0).max()) for some in terms)
    return change / (size or 1.0) if change else 0.0


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
    if len(initial.q) < FEW and linear_flow.rate(matrix) * end < MANY_TURNS:
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
        times = np.linspace(0.0, solution.knots[-1], LOOKS)
        states = solution.at(times)[:, : 2 * len(initial.q)]
        values = values_of_terms(condition, derivation.phase, initial.parameters)(times, *states.T)
        outside = ~(values.sum(axis=0) > 0)
        if outside.any():
            time = times[int(np.argmax(outside))]
            raise ComputationError(
                f"the orbit has no velocities beyond t = {time:.3g}, expected {condition} > 0"
            )


def program_of(
    document: Document,
    name: str,
    derivation: Derivation,
    initial: InitialState | None,
    orbit: OrbitSolution | None,
) -> Program:
    """The program of a system with this `name`: its rates, H, and momenta where velocities are followed.

    Raises DocumentError where a function has no formula, and ComputationError where H has steps, which its
    equations do not tell, or a number is too large for floats.
    """
    require_formulas(document, [derivation.generator, *derivation.system.forces], "a program")
    for place in derivation.jumps:
        raise ComputationError(f"H has a step where {place} = 0, which its equations do not tell")
    equations, phase, system = symbolic_equations(derivation), derivation.phase, derivation.system
    asked = {name: [to_tree(e)] for name, e in zip(phase.momenta, equations.momenta, strict=True)}
    asked = {name: trees for name, trees in asked.items() if name not in equations.names}
    asked["H"] = [to_tree(total(equations.energy))]
    asked |= {one.name: [to_tree(one.multiplier)] for one in system.constraints}
    try:
        rates = shared(equations.steps, equations.slopes)
        quantities = {name: shared(equations.steps, trees) for name, trees in asked.items()}
    except ExpressionError as error:
        raise ComputationError(f"there is no program: {error.message}") from error
    used = frozenset[str]().union(rates.names, *(each.names for each in quantities.values()))
    constants = {
        name: None
        if document.values.get(name) is None or name in document.symbols
        else float(document.values[name])
        for name in document.definitions
        if name in used
    }
    about = [name, f"L = {system.lagrangian}" if system.hamiltonian is None else f"H = {system.hamiltonian}"]
    about += [f"{one.name}: {one.expression} = 0" for one in system.constraints]
    about += [
        f"the force on {q} is {force}"
        for q, force in zip(phase.coordinates, system.forces, strict=True)
        if not force.is_zero
    ]
    run = None
    if initial is not None and orbit is not None:
        arguments = [TIME, *equations.names]
        flow = code.function(equations.slopes, arguments, initial.parameters, equations.steps)
        run = Run(equations.start(initial).tolist(), _sizes(orbit, flow), orbit.times)
    return Program(
        about,
        constants,
        TIME,
        equations.names,
        rates,
        quantities,
        (TIME, *phase.names, *list(asked)[-1 - len(system.constraints) :]),
        run,
    )


def _sizes(orbit: OrbitSolution, flow: Flow) -> list[float]:
    """The sizes of the variables of an orbit with these rates, in three digits; none is zero."""
    rates, times, states = columns(flow), orbit.times, orbit.states
    # Each variable is changed differently, so that equal ones do not cancel.
    nudged = states * (1 + NUDGE * np.linspace(1.0, 2.0, states.shape[1]))
    changes = np.abs(rates(times, *nudged.T) - rates(times, *states.T)).max(axis=1) / NUDGE
    between = times[-1] / min(len(times), orbit.steps or 1)
    sizes = np.fmax(np.abs(states).max(axis=0), LEAST_SIZE * changes * between)
    return [float(f"{size:.3g}") or 1.0 for size in sizes]
