"""The orbits of a system from many starts, or for many values of its parameters, in arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from typing import NamedTuple

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.trees import to_tree
from rigidcli.core import dormand_prince, many
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.kicks import Watched, foreseen
from rigidcli.core.second_run import NO_DIGIT_SHARED
from rigidcli.core.solution import Flow, columns, digits
from rigidcli.document.document import Document
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.document.system import Orbit
from rigidcli.errors import RigidError
from rigidcli.language import code
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.common import report, trusted
from rigidcli.studies.ensembles import Form, StartReport, may_go_in_arrays, of_start, with_start
from rigidcli.studies.hamilton import notes_on, orbit_table, run
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    InitialState,
    equations_of_motion,
    terms,
)
from rigidcli.studies.hamilton.findings import Findings, invariants_of, observations
from rigidcli.studies.hamilton.orbit import OrbitSolution, by_exponential
from rigidcli.studies.hamilton.start import initial_state

FEWEST = 16
"""Starts, or points of a sweep, from which on arrays are quicker than one orbit after the other."""

MOST_REPORTS = 128
"""Starts of which whole reports are made at a time: their documents and samples take some 100 MB."""


class _ManyOrbits(NamedTuple):
    """The equations of orbits that are followed at once, at which `times` they are sampled, and how.

    `functions` of the state are sampled, too; the last variables are the integrals of so many `integrands`.
    The drifts of the `conserved` momenta, and of further `invariants`, are reported.
    """

    derivation: Derivation
    motion: EquationsOfMotion
    orbit: Orbit
    times: Floats
    functions: Mapping[str, Expr]
    conserved: Sequence[Expr] = ()
    invariants: Sequence[Expr] = ()
    integrands: int = 0

    def equations(self, longest: float | Floats, stops: Sequence[float]) -> many.ManyStarts:
        motion, orbit = self.motion, self.orbit
        measured = 2 * len(self.derivation.phase.coordinates) + self.derivation.energy_changes
        return many.ManyStarts(
            motion.flow,
            motion.roundings,
            motion.watched.moving,
            dormand_prince.slices((1,) * measured),
            float(orbit.tolerance or DEFAULT_TOLERANCE),
            np.minimum(longest, orbit.max_step or math.inf),
            stops,
        )


def together(document: Document, form: Form) -> Callable[[range], Iterator[StartReport]] | None:
    """A function for the orbits from some starts in arrays; None where starts may differ in their equations.

    It leaves out starts that are better followed alone: their reports are None.
    """
    orbit, ensemble = document.orbit, document.ensemble
    if orbit is None or ensemble is None or len(ensemble) < FEWEST or not may_go_in_arrays(document):
        return None
    if form == "starts":
        return partial(_one_by_one, document)
    first = document.start(0)
    assert first.orbit is not None
    try:
        derivation, initial = initial_state(first, first.orbit, derive(document))
        starts = _starts(derivation, initial, ensemble.names, ensemble.values)
        motion = equations_of_motion(derivation, initial)
        times = orbit.instants(1.0)
        stops, longest = foreseen(motion.watched, float(times[-1]), "the orbit")
    except RigidError:
        return None  # it is told of each start
    if starts is None:
        return None
    observed = observations(document, derivation)
    functions = {f"observables.{name}": e for name, e in observed.functions.items()} if observed else {}
    problem = _ManyOrbits(derivation, motion, orbit, times, functions)
    equations, size = problem.equations(longest, stops.tolist()), len(motion.start)

    def samples(places: range) -> Iterator[StartReport]:
        begin = np.zeros((size, len(places)))
        begin[: len(starts)] = starts[:, places.start : places.stop]
        # Rows of samples have no digits, which a summary has.
        found, alone = _followed(problem, equations, begin, many.ONE_OF if form == "rows" else 1)
        for is_alone, group in groupby(range(len(places)), key=lambda index: bool(alone[index])):
            some = list(group)
            if is_alone:
                yield from ((places[index], None) for index in some)
                continue
            solution = found(some)
            findings = Findings(first, (), derivation, None, solution, None, None, observed, initial)
            tables = (with_start(orbit_table(findings)[0], np.array(places)[some]),)
            fields = [trusted("hamilton", "orbit.trusted_digits", solution.trusted_digits)]
            yield places[some[0]], report(document, "hamilton", fields, notes_on(findings), tables)

    return samples


def _one_by_one(document: Document, places: range) -> Iterator[StartReport]:
    """A whole report on each start; those that are to be worked alone have none."""
    for first in range(places.start, places.stop, MOST_REPORTS):
        some = range(first, min(first + MOST_REPORTS, places.stop))
        documents = [document.start(place) for place in some]
        for place, one, orbit in zip(some, documents, swept(documents, 1), strict=True):
            try:
                yield place, None if orbit is None else of_start(run(one, followed=orbit), place)
            except RigidError as error:
                yield place, error


def _starts(
    derivation: Derivation, initial: InitialState, names: tuple[str, ...], values: Floats
) -> Floats | None:
    """Coordinates and momenta (2 n by m) of all starts; None where they are not told by one formula."""
    phase, momenta = derivation.phase, derivation.momenta
    if not derivation.are_linear and (derivation.branches or momenta is not None):
        return None
    by_name = dict(zip(names, values.T, strict=True))
    q = [by_name[name] for name in phase.coordinates]
    if phase.momenta[0] in by_name:
        return np.array([*q, *(by_name[name] for name in phase.momenta)])
    if momenta is None:
        return None
    known = [TIME, *phase.coordinates, *derivation.velocity_names]
    formulas = code.function([to_tree(e) for e in momenta.definitions], known, initial.parameters)
    v = [by_name[name] for name in derivation.velocity_names]
    return np.array([*q, *columns(formulas)(np.zeros(len(values)), *q, *v)])


def swept(documents: Sequence[Document], fewest: int = FEWEST) -> list[OrbitSolution | None]:
    """The orbits of documents that differ in values only; None for those that are to be followed alone.

    With fewer than the `fewest` all are.
    """
    found: list[OrbitSolution | None] = [None] * len(documents)
    begun = {place: one for place, document in enumerate(documents) if (one := _begun(document)) is not None}
    if not begun:
        return found
    (document, derivation, initial), *_ = begun.values()
    # Others have another system, or are asked for at other times.
    places = [place for place, one in begun.items() if one.derivation is derivation and one.is_like(document)]
    if len(places) < fewest:
        return found
    orbit, values = document.orbit, [begun[place].initial.parameters for place in places]
    assert orbit is not None
    names = tuple(name for name, first in initial.parameters.items() if any(x[name] != first for x in values))
    observed = observations(document, derivation)
    functions = {f"observables.{name}": e for name, e in observed.functions.items()} if observed else {}
    conserved = [symbol(f"p_{name}") for name in derivation.conserved_momenta]
    try:
        motions = [
            equations_of_motion(derivation, begun[place].initial, names, [*functions.values()])
            for place in places
        ]
        limits = [
            _foreseen(motion.watched, [x[name] for name in names], orbit)
            for motion, x in zip(motions, values, strict=True)
        ]
    except RigidError:
        return found  # it is told of each of them
    stops = limits[0][0]
    if any(other != stops for other, _ in limits):
        return found
    problem = _ManyOrbits(
        derivation,
        motions[0],
        orbit,
        orbit.instants(1.0),
        functions,
        conserved,
        invariants_of(derivation) or (),
        len(functions),
    )
    equations = problem.equations(np.array([longest for _, longest in limits]), stops)
    some, alone = _followed(problem, equations, np.column_stack([motion.start for motion in motions]))
    for index, place in enumerate(places):
        if not alone[index]:
            found[place] = some([index])
    return found


class _Begun(NamedTuple):
    """A document with the system of its orbit, and its initial state."""

    document: Document
    derivation: Derivation
    initial: InitialState

    def is_like(self, other: Document) -> bool:
        """Whether the orbit of another document is asked for at the same times, and as accurately."""
        one, two = self.document.orbit, other.orbit
        assert one is not None
        assert two is not None
        same = (one.tolerance, one.max_step) == (two.tolerance, two.max_step)
        return same and np.array_equal(one.instants(1.0), two.instants(1.0))


def _begun(document: Document) -> _Begun | None:
    """The beginning of an orbit that may go with others; None where it does not, or has none."""
    orbit = document.orbit
    if orbit is None or orbit.method != "auto" or orbit.events:
        return None
    try:
        derivation, initial = initial_state(document, orbit, derive(document))
        if derivation.system.constraints or (derivation.branch is not None and derivation.branch.conditions):
            return None
        end = float(orbit.instants(1.0)[-1])
        is_linear = by_exponential(derivation, initial, end, orbit) is not None
    except RigidError:
        return None  # it is told where the document is worked
    return None if is_linear else _Begun(document, derivation, initial)


def _foreseen(watched: Watched, values: Sequence[float], orbit: Orbit) -> tuple[list[float], float]:
    """The stops and the longest step of `kicks.foreseen` for these values of swept parameters."""

    def with_values(flow: Flow) -> Flow:
        return lambda module: lambda t: flow(module)(t, *values)

    own = Watched(with_values(watched.timed), with_values(watched.phases), watched.moving)
    stops, longest = foreseen(own, float(orbit.instants(1.0)[-1]), "the orbit")
    return stops.tolist(), longest


def _followed(
    problem: _ManyOrbits, equations: many.ManyStarts, begin: Floats, every: int = 1
) -> tuple[Callable[[list[int]], OrbitSolution], list[bool]]:
    """The orbits from starts (n by m) as a function of some of their places, and which must go alone.

    One of `every` so many is integrated twice, and the digits are those that both solutions share, as of a
    single orbit.
    """
    derivation, motion, _, times, functions, conserved, invariants, integrands = problem
    size, span = 2 * len(derivation.phase.coordinates), float(times[-1])

    def scale_of(paths: many.Paths) -> Floats:
        scale = np.maximum(paths.largest, np.abs(paths.states).max(axis=0))[:size]
        return np.where(scale > 0, scale, 1.0)

    def distance(one: many.Paths, other: many.Paths) -> Floats:
        apart: Floats = np.abs((one.states - other.states)[:, :size] / scale_of(one)).max(axis=1)
        return apart

    paths, apart = many.twice(equations, begin, times, distance, every)
    scale = scale_of(paths)
    roundings, observe = columns(motion.roundings), motion.function([*functions.values()])
    sizes = {key: motion.function(terms(e)) for key, e in functions.items()}
    kept = {str(e): motion.function(terms(e)) for e in (*conserved, *invariants)}

    def some(places: list[int]) -> OrbitSolution:
        states = paths.states[:, :, places].transpose(2, 0, 1)  # starts by times by variables
        every, flat = np.tile(times, len(places)), states.reshape(-1, states.shape[-1])
        coordinates, momenta, energy, parts = motion.observed(every, flat)
        error = float(apart[:, places].max(initial=0.0))
        gained = flat[:, size] if derivation.energy_changes else np.zeros(len(energy))
        drift = {"H": _drift((energy - gained).reshape(len(places), -1), parts)}
        for name, function in kept.items():
            values = function(every, flat)
            drift[name] = _drift(values.sum(axis=0).reshape(len(places), -1), values)
        if not derivation.energy_changes:
            error = max(error, drift["H"])
        steps = np.maximum(paths.steps[places], 1)
        slopes = roundings(every, *flat.T)[:size].reshape(size, len(places), -1).mean(axis=2)
        noise = (slopes / scale[:, places] * span / np.sqrt(steps)).max(initial=0.0)
        rounding = EPS * max(noise, math.sqrt(steps.max()) + 4 * len(equations.stops))
        lost = times[(apart[:, places] > NO_DIGIT_SHARED).any(axis=1)]
        scales = {key: np.abs(function(every, flat)).sum(axis=0) for key, function in sizes.items()}
        means = states[0, -1, states.shape[-1] - integrands :] / (span or 1.0)
        return OrbitSolution(
            every,
            coordinates,
            momenta,
            energy,
            drift,
            tuple(map(str, invariants)),
            dormand_prince.METHOD,
            int(steps.sum()),
            flat[:, :size],
            0.0 if len(lost) else digits(max(error, rounding)),
            float(lost[0]) if len(lost) else None,
            None,
            dict(zip(functions, observe(every, flat), strict=True)) if functions else {},
            dict(zip(functions, map(float, means), strict=False)) if integrands else {},
            {key: float(size.max()) for key, size in scales.items()},
        )

    return some, paths.alone.tolist()


def _drift(values: Floats, parts: Floats) -> float:
    change = np.abs(values - values[:, :1]).max(axis=1)
    sizes = np.abs(parts).sum(axis=0).reshape(values.shape).max(axis=1)
    return float((change / np.where(change > 0, sizes, 1.0)).max())
