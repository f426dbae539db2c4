"""The initial state of an orbit: coordinates, momenta, and the branch of the velocities that it is on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.functions import apply
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.document.orbit import Orbit
from rigidcli.errors import ComputationError, DocumentError
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.mechanics.legendre import MOST_BRANCHES
from rigidcli.mechanics.velocity_inversion import Branch
from rigidcli.studies.hamilton import velocity_branches
from rigidcli.studies.hamilton.derivation import Derivation, on_this_side

KEY = "orbit.initial"
"""The key under which a document gives the initial state."""


SAME = 1e-6
"""Velocities belong to a branch if they differ by less than this, in units of their size."""


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
    if derivation.momenta is not None and not derivation.momenta.are_linear(derivation.velocity_names):
        derivation, v = _on_branch(point, on_this_side(derivation, point.known), p, v)
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


def _on_branch(
    point: _Point, derivation: Derivation, p: Floats, v: Floats | None
) -> tuple[Derivation, Floats | None]:
    """The system on the branch of the velocities at a point, and these where they are followed themselves."""
    branch = _branch(point, derivation, v) if derivation.branches else None
    alone = derivation.branch is not None and derivation.branch.is_continued
    kept = derivation.branches if alone else ()
    if branch is not None:
        start, kept = point.evaluate(branch.velocities, "a velocity"), (branch,)
    else:
        start = v = _velocities(point, derivation, p) if v is None else v
    notes = (*derivation.notes, *_named(point, derivation, start))
    return replace(derivation, branches=kept, notes=notes), v


def _branch(point: _Point, derivation: Derivation, v: Floats | None) -> Branch | None:
    """The branch of the velocities that the orbit begins on; None if these are to be followed themselves.

    They are if they belong to no branch that is known, or its form changes on the way.
    """
    branches = derivation.branches
    inside = [b for b in branches if min(point.evaluate(b.conditions, "a momentum"), default=1.0) > 0]
    if v is None and not inside:
        raise point.document.refusal(f"no velocity has these momenta, expected {branches[0].validity}", KEY)
    if v is None and len(inside) > 1:
        found = sorted((point.evaluate(b.velocities, "a velocity") for b in inside), key=tuple)
        raise _several(point, derivation, found, inside[0].period)
    for branch in inside:
        if not branch.is_continued:
            known = point.evaluate(branch.velocities, "a velocity")
            if v is None or np.allclose(known, v, rtol=SAME, atol=SAME * np.abs(v).max()):
                return branch
    return None


def _velocities(point: _Point, derivation: Derivation, p: Floats) -> Floats:
    """The velocities that have these momenta, if they are the only ones that are found."""
    found = velocity_branches.velocities(derivation, point.known, p)
    if len(found) == 1:
        return found[0]
    if found:
        raise _several(point, derivation, found)
    hint = f"give the velocities {', '.join(derivation.velocity_names)} instead"
    raise point.document.refusal("no velocities were found that have these momenta", KEY, hint=hint)


def _several(
    point: _Point, derivation: Derivation, found: Sequence[Floats], period: Expr | None = None
) -> DocumentError:
    """The refusal of momenta that several velocities have."""
    names = derivation.velocity_names
    listed = "; ".join(
        ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, v, strict=True)) for v in found
    )
    return point.document.refusal(
        f"{len(found)} velocities have these momenta: {listed}"
        + ("" if period is None else f", and all that differ by multiples of {period}"),
        KEY,
        hint=f"give the velocities {', '.join(names)} instead",
    )


def _named(point: _Point, derivation: Derivation, v: Floats) -> Iterator[str]:
    """A note on the branch of the velocities, where there are several."""
    if len(v) > 1:
        return
    found = velocity_branches.intervals(derivation, point.known)
    (name,), (momentum,) = derivation.velocity_names, derivation.phase.momenta
    for interval in found if len(found) > 1 else ():
        if interval.low <= v[0] <= interval.high:
            small = ", that of small velocities," if interval.low < 0 < interval.high else ""
            count = len(found) if len(found) <= MOST_BRANCHES else "many"
            yield (
                f"the orbit is on the branch {interval.velocities(name)}{small} "
                f"where {interval.momenta(momentum)}; there are {count} branches"
            )
