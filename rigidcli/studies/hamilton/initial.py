"""Where an orbit begins: coordinates, momenta, and the branch of the velocities that it is on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.errors import ComputationError
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.mechanics.legendre import Branch

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.model.orbit import Orbit

WHERE = "orbit.initial"


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """The parameters' values, and coordinates q, momenta p and velocities v (n each) at t = 0.

    The velocities are None where the document gives momenta.
    """

    values: Mapping[str, float]
    q: Floats
    p: Floats
    v: Floats | None


def begin(document: Document, orbit: Orbit, found: Derivation) -> tuple[Derivation, Start]:
    """The system, on one branch of its velocities, and where its orbit begins.

    Raises DocumentError where the system has no motion from there.
    """
    assert document.system is not None
    q, p, v = orbit.start(document.system)
    values = {name: float(value) for name, value in document.values.items()}
    point = _Point(
        document, {TIME: 0.0, **values} | dict(zip(found.phase.coordinates, map(float, q), strict=True))
    )
    if p is None:
        assert v is not None
        p = _momenta(point, found, v)
    point = point.at(found.phase.momenta, p)
    start = Start(values, q, p, v)
    if found.branches:
        found = replace(found, branches=(_branch(point, found, v),))
    if found.hamiltonian is not None:
        point.values_of([found.hamiltonian], "H")
    return found, start


@dataclass(frozen=True, slots=True)
class _Point:
    """Values of names at the start."""

    document: Document
    known: Mapping[str, float]

    def at(self, names: Sequence[str], values: Floats) -> _Point:
        """The same with values of more names."""
        return replace(self, known={**self.known, **dict(zip(names, map(float, values), strict=True))})

    def values_of(self, expressions: Sequence[Expr], what: str) -> Floats:
        """The values of expressions; DocumentError says of `what` that it has none."""
        try:
            f = code.function([to_tree(e) for e in expressions], list(self.known), {})(math)
            found = np.array(f(*self.known.values()), dtype=np.float64)
        except NO_VALUE:
            found = np.array([math.nan])
        if not np.isfinite(found).all():
            raise self.document.refusal(f"{what} has no finite real value there", WHERE)
        return found


def _momenta(point: _Point, found: Derivation, v: Floats) -> Floats:
    """The momenta, from the velocities."""
    if found.momenta is None:
        return _from_hamiltonian(point, found, v)
    return point.at(found.velocity_names, v).values_of(found.momenta.definitions, "a momentum")


def _from_hamiltonian(point: _Point, found: Derivation, v: Floats) -> Floats:
    """The momenta of which v = dH/dp, where that is linear in them."""
    momenta, size = found.phase.momenta, len(v)
    slopes = [derivative(found.mover, name) for name in momenta]
    matrix = [derivative(slope, name) for slope in slopes for name in momenta]
    if any(not entry.names.isdisjoint(momenta) for entry in matrix):
        raise point.document.refusal(
            "velocities do not tell the momenta, as dH/dp is not linear in them",
            WHERE,
            hint=f"give the momenta {', '.join(momenta)}",
        )
    told = point.at(momenta, np.zeros(size)).values_of([*slopes, *matrix], "a velocity")
    try:
        solved = np.linalg.solve(told[size:].reshape(size, size), v - told[:size])
    except np.linalg.LinAlgError:
        raise ComputationError("the velocities do not tell the momenta there: dH/dp is degenerate") from None
    return np.asarray(solved, dtype=np.float64)


def _branch(point: _Point, found: Derivation, v: Floats | None) -> Branch:
    """The branch of the velocities that the orbit begins on."""
    inside = [
        branch
        for branch in found.branches
        if min(point.values_of(branch.conditions, "a momentum"), default=1.0) > 0
    ]
    if not inside:
        told = " and ".join(f"{text(to_tree(e))} > 0" for e in found.branches[0].conditions)
        raise point.document.refusal(f"no velocity has these momenta, expected {told}", WHERE)
    if len(inside) == 1:
        return inside[0]
    if v is None:
        raise point.document.refusal(
            f"{len(inside)} velocities have these momenta",
            WHERE,
            hint=f"give the velocities {', '.join(found.velocity_names)} instead",
        )
    return min(inside, key=lambda b: float(np.abs(point.values_of(b.velocities, "a velocity") - v).max()))
