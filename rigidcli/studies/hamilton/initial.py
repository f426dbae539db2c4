"""The initial state of an orbit: coordinates, momenta, and the branch of the velocities that it is on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.errors import ComputationError
from rigidcli.model.document import Document
from rigidcli.model.orbit import Orbit
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr, symbol
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import code
from rigidcli.symbolic.mechanics.velocity_inversion import Branch

KEY = "orbit.initial"
"""The key under which a document gives the initial state."""


@dataclass(frozen=True, slots=True, eq=False)
class InitialState:
    """The values of the parameters, and coordinates q, momenta p and velocities v (n each) at t = 0.

    The velocities are None where the document gives momenta.
    """

    parameters: Mapping[str, float]
    q: Floats
    p: Floats
    v: Floats | None


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
    if derivation.branches:
        derivation = replace(derivation, branches=(_branch(point, derivation, v),))
    if derivation.hamiltonian is not None:
        point.evaluate([derivation.hamiltonian], "H")
    return derivation, InitialState(parameters, q, p, v)


@dataclass(frozen=True, slots=True)
class _Point:
    """Values of names at the start."""

    document: Document
    known: Mapping[str, float]

    def at(self, names: Sequence[str], values: Floats) -> _Point:
        """The same with values of more names."""
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


def _branch(point: _Point, derivation: Derivation, v: Floats | None) -> Branch:
    """The branch of the velocities that the orbit begins on."""
    branches = derivation.branches
    inside = [b for b in branches if min(point.evaluate(b.conditions, "a momentum"), default=1.0) > 0]
    if not inside:
        raise point.document.refusal(f"no velocity has these momenta, expected {branches[0].validity}", KEY)
    if len(inside) == 1:
        return inside[0]
    if v is None:
        raise point.document.refusal(
            f"{len(inside)} velocities have these momenta",
            KEY,
            hint=f"give the velocities {', '.join(derivation.velocity_names)} instead",
        )
    return min(inside, key=lambda b: float(np.abs(point.evaluate(b.velocities, "a velocity") - v).max()))
