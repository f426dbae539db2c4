"""The orbits of a system from many starts, or for many values of its parameters, together.

They go in arrays; those from many starts by heyoka where that is installed and saves more than it takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import groupby
from typing import Any, TypeAlias

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.core import dormand_prince, many, taylor
from rigidcli.core.arithmetic import EPS, Floats, Mask
from rigidcli.core.kicks import Watched, foreseen
from rigidcli.core.second_run import MISSED, NO_DIGIT_SHARED
from rigidcli.core.solution import MOST_STEPS, Flow, digits
from rigidcli.document.document import Document
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.document.system import Orbit
from rigidcli.errors import ComputationError, RigidError
from rigidcli.studies.common import report, trusted
from rigidcli.studies.ensembles import Form, StartReport, may_go_in_arrays, of_start, with_start
from rigidcli.studies.hamilton import Findings, notes_on, orbit_table, run
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    InitialState,
    compiled,
    equations_of_motion,
    terms,
)
from rigidcli.studies.hamilton.orbit import NAME, OrbitSolution, by_exponential, conserved, drifts
from rigidcli.studies.hamilton.start import initial_state

# Starts, or points of a sweep, from which on arrays are quicker than one orbit after the other.
FEWEST = 16
# Steps of the pair, of all starts, from which on heyoka saves more than it takes to load and to compile.
WORTH_COMPILING = 3_000_000
BY_HEYOKA = "the orbits are followed together by Taylor series (heyoka)"
TRIED = 8  # Starts that heyoka follows first, to see whether it can.
LEAST_TOLERANCE = 1e-12  # With less, a second solution by heyoka is off by rounding only, as the first is.
# Times at which orbits by heyoka are looked at; as many as its steps where something narrow may be.
FEWEST_LOOKS, MOST_LOOKS = 65, 16_384
# Starts of which whole reports are made at a time: their documents and samples take some 100 MB.
MOST_REPORTS = 128

Distance: TypeAlias = Callable[[many.Paths, many.Paths], Floats]


def together(document: Document, form: Form) -> Callable[[range], Iterator[StartReport]] | None:
    """A function for the orbits from some starts together; None where starts may differ in their equations.

    It leaves out starts that are better followed alone: their reports are None.
    """
    orbit, ensemble = document.orbit, document.ensemble
    if orbit is None or ensemble is None or len(ensemble) < FEWEST or not may_go_in_arrays(document):
        return None
    if form == "starts":
        return partial(_one_by_one, document)
    first = document.start(0)
    try:
        derivation, initial = initial_state(first, derive(document))
        starts = _starts(derivation, initial, ensemble.names, ensemble.values)
        motion = equations_of_motion(derivation, tuple(initial.parameters.items()))
        stops, longest = _foreseen(motion.watched, (), float(orbit.instants(1.0)[-1]))
    except RigidError:
        return None  # it is told of each start
    if starts is None:
        return None
    found, more = Findings(first, derivation), len(motion.variables) - len(starts)
    starts = np.pad(starts, ((0, more), (0, 0)))
    equations = _equations(found, motion, stops, longest)
    follow = _chosen(orbit, equations, starts, _distance(2 * len(derivation.phase.coordinates)))
    if follow is None:
        return None
    # Rows of samples have no digits, which a summary has.
    every = many.ONE_OF if form == "rows" else 1

    def samples(places: range) -> Iterator[StartReport]:
        begin = starts[:, places.start : places.stop]
        orbit_of, alone = _followed(found, motion, equations, begin, {}, every, follow)
        for is_alone, group in groupby(range(len(places)), key=alone.__getitem__):
            some = list(group)
            if is_alone:
                yield from ((places[index], None) for index in some)
                continue
            solution = orbit_of(some)
            findings = replace(found, orbit=solution)
            tables = (with_start(orbit_table(findings)[0], np.array(places)[some]),)
            fields = [trusted("hamilton", "orbit.trusted_digits", solution.trusted_digits)]
            yield places[some[0]], report(document, "hamilton", fields, notes_on(findings), tables)

    return samples


def _one_by_one(document: Document, places: range) -> Iterator[StartReport]:
    """A whole report on each start; those that are to be worked alone have none."""
    for first in range(0, len(places), MOST_REPORTS):
        some = places[first : first + MOST_REPORTS]
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
    phase, definitions = derivation.phase, derivation.definitions
    if not derivation.are_linear or derivation.equations is None:
        return None
    by_name = dict(zip(names, values.T, strict=True))
    q = [by_name[name] for name in phase.coordinates]
    if phase.momenta[0] in by_name:
        return np.array([*q, *(by_name[name] for name in phase.momenta)])
    if not definitions:
        return None
    known = [*phase.coordinates, *derivation.velocity_names]
    formulas = compiled(definitions.values(), known, initial.parameters)
    return np.array([*q, *formulas(np.zeros(len(values)), *(by_name[name] for name in known))])


def swept(documents: Sequence[Document], fewest: int = FEWEST) -> list[OrbitSolution | None]:
    """The orbits of documents that differ in values only; None for those that are to be followed alone.

    With fewer than the `fewest` all are.
    """
    found: list[OrbitSolution | None] = [None] * len(documents)
    begun = {place: one for place, document in enumerate(documents) if (one := _begun(document)) is not None}
    if not begun:
        return found
    derivation, initial, asked = next(iter(begun.values()))
    # Others have another system, or are asked for at other times.
    places = [place for place, (own, _, other) in begun.items() if own is derivation and other == asked]
    if len(places) < fewest:
        return found
    *_, times = asked
    shared, values = Findings(documents[places[0]], derivation), [begun[k][1].parameters for k in places]
    names = tuple(name for name, first in initial.parameters.items() if any(x[name] != first for x in values))
    try:
        integrands = tuple(shared.functions.values())
        motion = equations_of_motion(derivation, tuple(initial.parameters.items()), names, integrands)
        limits = [_foreseen(motion.watched, [x[name] for name in names], times[-1]) for x in values]
    except RigidError:
        return found  # it is told of each of them
    stops = limits[0][0]
    if any(other != stops for other, _ in limits):
        return found
    begin = np.column_stack([motion.start(begun[place][1]) for place in places])
    longest = np.array([longest for _, longest in limits])
    equations = _equations(shared, motion, stops, longest)
    orbit_of, alone = _followed(shared, motion, equations, begin, conserved(derivation))
    for index, place in enumerate(places):
        if not alone[index]:
            found[place] = orbit_of([index])
    return found


def _begun(document: Document) -> tuple[Derivation, InitialState, tuple[Any, ...]] | None:
    """The beginning of an orbit that may go with others, and how it is asked for.

    None where it does not, or there is none.
    """
    orbit = document.orbit
    if orbit is None or orbit.method != "auto" or orbit.events:
        return None
    try:
        derivation, initial = initial_state(document, derive(document))
        if derivation.system.constraints or (derivation.branch is not None and derivation.branch.conditions):
            return None
        times = orbit.instants(1.0)
        is_linear = by_exponential(derivation, initial, orbit, float(times[-1])) is not None
    except RigidError:
        return None  # it is told where the document is worked
    return None if is_linear else (derivation, initial, (orbit.tolerance, orbit.max_step, times.tolist()))


def _foreseen(watched: Watched, values: Sequence[float], end: float) -> tuple[list[float], float]:
    """The stops and the longest step of `kicks.foreseen` for these values of swept parameters."""

    def with_values(flow: Flow) -> Flow:
        return lambda module: lambda t: flow(module)(t, *values)

    own = Watched(with_values(watched.timed), with_values(watched.phases), watched.moving)
    stops, longest = foreseen(own, end, NAME)
    return stops.tolist(), longest


def _equations(
    found: Findings, motion: EquationsOfMotion, stops: Sequence[float], longest: float | Floats
) -> many.ManyStarts:
    """What is integrated from many starts, in steps to the stops that are no longer than told."""
    orbit, size = found.document.orbit, 2 * len(found.derivation.phase.coordinates)
    assert orbit is not None
    return many.ManyStarts(
        motion.flow,
        motion.roundings,
        motion.watched.moving,
        dormand_prince.slices((1,) * (size + found.derivation.energy_changes)),
        float(orbit.tolerance or DEFAULT_TOLERANCE),
        np.minimum(longest, orbit.max_step or math.inf),
        stops,
        [slice(place, place + 1) for place in motion.integrals],
    )


def _chosen(
    orbit: Orbit, equations: many.ManyStarts, starts: Floats, distance: Distance
) -> many.Follow | None:
    """What follows all starts (n by m): the pair in arrays, or heyoka where it pays or is asked for.

    It depends on the whole ensemble, so that each process chooses the same. None where heyoka is asked for,
    and starts are better followed alone.
    """
    end, is_asked = float(orbit.instants(1.0)[-1]), orbit.method == "taylor"
    other = None if is_asked and end else many.paths
    fits = end and not equations.stops and float(equations.tolerance) >= LEAST_TOLERANCE
    if not fits or not (is_asked or find_spec("heyoka")):
        return other
    steps, is_watched = many.outlook(equations, starts, end), equations.is_watched(starts)
    if steps > MOST_STEPS or not (is_asked or starts.shape[1] * steps > WORTH_COMPILING):
        return other
    looks = int(np.clip(steps / 2, FEWEST_LOOKS, MOST_LOOKS)) if is_watched else FEWEST_LOOKS
    follow, few = partial(taylor.paths, looks=looks), starts[:, :: 1 + starts.shape[1] // TRIED]
    try:
        found = many.twice(equations, few, np.array([end]), distance, 1, follow)
    except ComputationError:
        return other
    # Only the pair looks at each step for what is narrow; nearly all starts would be followed again.
    return many.paths if is_watched and _in_doubt(*found).any() else follow


def _in_doubt(paths: many.Paths, apart: Floats) -> Mask:
    """Which starts may have gone over something narrow, as their two solutions differ, or one has ended."""
    doubt: Mask = paths.alone | (apart.max(axis=0) > MISSED)
    return doubt


def _distance(size: int) -> Distance:
    """A function for how far solutions are apart (k by m), in units of the sizes of so many variables."""

    def distance(one: many.Paths, other: many.Paths) -> Floats:
        apart: Floats = np.abs((one.states - other.states)[:, :size] / _scale(one, size)).max(axis=1)
        return apart

    return distance


def _scale(paths: many.Paths, size: int) -> Floats:
    scale = np.maximum(paths.largest, np.abs(paths.states).max(axis=0))[:size]
    return np.where(scale > 0, scale, 1.0)


def _followed(
    found: Findings,
    motion: EquationsOfMotion,
    equations: many.ManyStarts,
    begin: Floats,
    kept: Mapping[str, Sequence[Expr]],
    every: int = 1,
    follow: many.Follow = many.paths,
) -> tuple[Callable[[list[int]], OrbitSolution], list[bool]]:
    """The orbits from starts (n by m) as a function of some of their places, and which must go alone.

    They have the drifts of what is `kept`. One of `every` so many is integrated twice, and the digits are
    those that both solutions share, as of a single orbit.
    """
    derivation, orbit, functions = found.derivation, found.document.orbit, found.functions
    assert orbit is not None
    times, size = orbit.instants(1.0), 2 * len(derivation.phase.coordinates)
    distance = _distance(size)
    paths, apart = many.twice(equations, begin, times, distance, every, follow)
    if follow is not many.paths and equations.is_watched(begin):
        # The pair finds out what is narrow there.
        again = np.flatnonzero(_in_doubt(paths, apart))
        if len(again):
            others, apart[:, again] = many.twice(equations, begin[:, again], times, distance)
            for whole, part in zip(paths, others, strict=True):
                whole[..., again] = part
    method = dormand_prince.METHOD if follow is many.paths else taylor.METHOD
    scale, span = _scale(paths, size), float(times[-1])
    parts = {key: terms(e) for key, e in functions.items()}
    observe, watch = motion.observer(parts), motion.observer(kept)

    def orbit_of(places: list[int]) -> OrbitSolution:
        states = paths.states[:, :, places].transpose(2, 0, 1)  # starts by times by variables
        samples = observe(np.tile(times, len(places)), states.reshape(-1, states.shape[-1]))
        drift = drifts(motion, kept, [watch(samples.times, samples.states)], len(places))
        error = float(apart[:, places].max(initial=0.0 if derivation.energy_changes else drift["H"]))
        steps = np.maximum(paths.steps[places], 1)
        rounding = EPS * (math.sqrt(steps.max()) + 4 * len(equations.stops))
        slopes = motion.lost_in_slopes(samples.times, samples.states, scale[:, places], steps, span)
        lost = times[(apart[:, places] > NO_DIGIT_SHARED).any(axis=1)]
        means = states[0, -1, motion.integrals] / (span or 1.0)
        return OrbitSolution(
            samples,
            drift,
            method,
            int(steps.sum()),
            0.0 if len(lost) else digits(max(error, rounding, slopes)),
            float(lost[0]) if len(lost) else None,
            dict(zip(functions, map(float, means), strict=False)),
            {key: float(sizes.max()) for key, sizes in samples.sizes.items()},
            () if follow is many.paths else (BY_HEYOKA,),
        )

    return orbit_of, paths.alone.tolist()
