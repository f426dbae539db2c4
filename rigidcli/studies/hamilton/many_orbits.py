"""The orbits of a system from many starts, in arrays, where all starts share their equations."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from itertools import groupby

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core import dormand_prince, many
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.estimate import columns, foreseen
from rigidcli.core.solution import digits
from rigidcli.document.document import Document
from rigidcli.document.sampling import DEFAULT_TOLERANCE
from rigidcli.errors import RigidError
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.studies.common import report, trusted
from rigidcli.studies.ensembles import Form, StartReport, with_start
from rigidcli.studies.hamilton import SCHEMA, notes_on, orbit_table
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import (
    EquationsOfMotion,
    InitialState,
    equations_of_motion,
    terms,
)
from rigidcli.studies.hamilton.findings import Findings, derived, observations
from rigidcli.studies.hamilton.orbit import OrbitSolution, initial_state

METHOD = f"{dormand_prince.METHOD}, many starts at once"

FEWEST = 16
"""Starts from which on arrays are quicker than one start after the other."""


def together(
    document: Document, form: Form
) -> Callable[[range], Iterator[StartReport | tuple[int, None]]] | None:
    """A function for the orbits from some starts in arrays; None where starts may differ in their equations.

    It leaves out starts that are better followed alone: their reports are None.
    """
    orbit, ensemble = document.orbit, document.ensemble
    if orbit is None or ensemble is None or orbit.method != "auto" or len(ensemble) < FEWEST or orbit.events:
        return None
    first = document.start(0)
    assert first.orbit is not None
    try:
        derivation, initial = initial_state(first, first.orbit, derived(document))
        starts = _starts(derivation, initial, ensemble.names, ensemble.values)
        motion = equations_of_motion(derivation, initial)
        times = orbit.instants(1.0)
        stops, longest = foreseen(motion.watched, float(times[-1]), "the orbit")
    except RigidError:
        return None  # it is told of each start
    if starts is None or derivation.system.constraints:
        return None
    observed = observations(document, derivation)
    functions = {f"observables.{name}": e for name, e in observed.functions.items()} if observed else {}
    size = len(motion.start)
    problem = many.Problem(
        motion.flow,
        motion.roundings,
        motion.watched.moving,
        (1,) * size,
        float(orbit.tolerance or DEFAULT_TOLERANCE),
        min(longest, orbit.max_step or math.inf),
        stops.tolist(),
    )

    def samples(places: range) -> Iterator[StartReport | tuple[int, None]]:
        begin = np.zeros((size, len(places)))
        begin[: len(starts)] = starts[:, places.start : places.stop]
        found, alone = _followed(problem, motion, derivation, begin, times, functions)
        for is_alone, group in groupby(range(len(places)), key=lambda index: bool(alone[index])):
            some = list(group)
            if is_alone:
                yield from ((places[index], None) for index in some)
                continue
            solution = found(some)
            findings = Findings(first, (), derivation, None, solution, None, None, observed, initial)
            tables = (with_start(orbit_table(findings)[0], np.array(places)[some]),)
            fields = [trusted("hamilton", "orbit.trusted_digits", solution.trusted_digits)]
            title = "Hamilton's equations"
            yield places[some[0]], report(document, SCHEMA, title, fields, notes_on(findings), tables)

    return samples


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


def _followed(
    problem: many.Problem,
    motion: EquationsOfMotion,
    derivation: Derivation,
    begin: Floats,
    times: Floats,
    functions: Mapping[str, Expr],
) -> tuple[Callable[[list[int]], OrbitSolution], list[bool]]:
    """The orbits from starts (n by m) as a function of some of their places, and which must go alone.

    All are integrated twice, and the digits are those that both share, as of a single orbit.
    """
    paths, second = many.twice(problem, begin, times)
    alone = paths.alone | second.alone
    size, span = 2 * len(derivation.phase.coordinates), float(times[-1])
    scale = np.maximum(paths.largest, np.abs(paths.states).max(axis=0))[:size]
    scale = np.where(scale > 0, scale, 1.0)
    apart = np.abs((paths.states - second.states)[:, :size] / scale).max(axis=1)  # times by starts

    def some(places: list[int]) -> OrbitSolution:
        states = paths.states[:, :, places].transpose(2, 0, 1)  # starts by times by variables
        every, flat = np.tile(times, len(places)), states.reshape(-1, states.shape[-1])
        coordinates, momenta, energy, parts = motion.observed(every, flat)
        error = float(apart[:, places].max(initial=0.0))
        if not derivation.energy_changes:
            values, sizes = (each.reshape(len(places), -1) for each in (energy, np.abs(parts).sum(axis=0)))
            change = np.abs(values - values[:, :1]).max(axis=1)
            error = max(error, float((change / np.where(change > 0, sizes.max(axis=1), 1.0)).max()))
        steps = np.maximum(paths.steps[places], 1)
        slopes = columns(motion.roundings)(every, *flat.T)[:size].reshape(size, len(places), -1).mean(axis=2)
        noise = (slopes / scale[:, places] * span / np.sqrt(steps)).max(initial=0.0)
        rounding = EPS * max(noise, math.sqrt(steps.max()) + 4 * len(problem.stops))
        further = motion.values([*functions.values()], every, flat) if functions else ()
        lost = times[(apart[:, places] > 0.1).any(axis=1)]
        return OrbitSolution(
            every,
            coordinates,
            momenta,
            energy,
            {},
            (),
            METHOD,
            int(steps.sum()),
            flat[:, :size],
            0.0 if len(lost) else digits(max(error, rounding)),
            float(lost[0]) if len(lost) else None,
            None,
            dict(zip(functions, further, strict=True)),
            {},
            {
                key: float(np.abs(motion.values(terms(e), every, flat)).sum(axis=0).max())
                for key, e in functions.items()
            },
        )

    return some, alone.tolist()
