"""The start of an orbit: coordinates, momenta and velocities that belong together, on all constraints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.functions import apply
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE, State, columns
from rigidcli.document.document import Document
from rigidcli.document.system import Orbit
from rigidcli.errors import ComputationError, DocumentError, Problem
from rigidcli.language import code
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.legendre import Momenta
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton.constraints import Keeper, keeper
from rigidcli.studies.hamilton.derivation import Derivation, on_this_side
from rigidcli.studies.hamilton.equations_of_motion import INITIAL_KEY, InitialState

# The time of the start, as an array.
ZEROS = np.zeros(1)
# The largest miss of a constraint that a start may have, in units of the terms of the constraint.
# It is moved onto the constraint: numbers that are typed obey none to all digits of a float.
START_MISSES = 1e-6
# Steps of Newton's method that move a start onto the constraints; each doubles the digits.
NEWTON_STEPS = 8
# Constraints are dependent where a singular value of their slopes, each scaled to 1, is below this.
DEPENDENT_SLOPES = 1e-10
# Velocities belong to a branch v(p) from which they differ by less than this, in units of their size.
SAME_VELOCITIES = 1e-6


def initial_state(
    document: Document, orbit: Orbit, derivation: Derivation
) -> tuple[Derivation, InitialState]:
    """The state at t = 0, and the system with the branch v(p) to which its velocities belong.

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
        shown = _listed(derivation.velocity_names, v)
        notes = (*derivation.notes, f"the momenta at the start belong to {shown}, and perhaps to others, too")
        derivation = replace(derivation, notes=notes)
    if derivation.system.constraints:
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
    """The start: the values of t, parameters, and variables that are known so far."""

    document: Document
    known: Mapping[str, float]

    def at(self, names: Sequence[str], values: Floats) -> _Point:
        return replace(self, known={**self.known, **dict(zip(names, map(float, values), strict=True))})

    def evaluate(self, expressions: Sequence[Expr], what: str) -> Floats:
        """The values of expressions. Raises DocumentError where `what` has none."""
        try:
            f = code.function([to_tree(e) for e in expressions], list(self.known), {})(math)
            values = np.array(f(*self.known.values()), dtype=np.float64)
        except NO_VALUE:
            values = np.array([math.nan])
        if not np.isfinite(values).all():
            raise self.document.refusal(f"{what} has no finite real value there", INITIAL_KEY)
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
            "the momenta do not follow from the velocities: dH/dp is not linear in p",
            INITIAL_KEY,
            hint=f"give the momenta {', '.join(names)}",
        )
    values = point.at(names, np.zeros(size)).evaluate([*slopes, *matrix], "a velocity")
    try:
        return np.asarray(np.linalg.solve(values[size:].reshape(size, size), v - values[:size]))
    except np.linalg.LinAlgError:
        message = "the momenta do not follow from the velocities there: dH/dp is degenerate"
        raise ComputationError(message) from None


def _velocities(point: _Point, momenta: Momenta, names: Sequence[str], p: Floats) -> Floats:
    """Velocities (n) with the momenta p (n), by a search from rest. Raises DocumentError where it fails."""
    from scipy.optimize import root

    entries = [*momenta.definitions, *(e for row in momenta.mass_matrix for e in row)]
    size = len(p)

    def miss(v: Floats) -> tuple[Floats, Floats]:
        values = point.at(names, v).evaluate(entries, "a momentum")
        return values[:size] - p, values[size:].reshape(size, size)

    v: Floats = root(miss, np.zeros(size), jac=True, method="lm", tol=1e-15).x
    if np.abs(miss(v)[0]).max() > SAME_VELOCITIES * np.abs(p).max():
        raise point.document.refusal(
            "no velocities were found that have these momenta",
            INITIAL_KEY,
            hint=f"give the velocities {', '.join(names)} instead",
        )
    return v


def _branch(point: _Point, derivation: Derivation, v: Floats | None) -> Branch | None:
    """The branch v(p) on which the orbit begins; None if the velocities belong to no branch.

    Then the velocities are integrated themselves.
    """
    branches = derivation.branches
    inside = [b for b in branches if min(point.evaluate(b.conditions, "a momentum"), default=1.0) > 0]
    values = [point.evaluate(branch.velocities, "a velocity") for branch in inside]
    if v is not None:
        slack = SAME_VELOCITIES * np.abs(v).max()
        pairs = zip(inside, values, strict=True)
        return next(
            (b for b, known in pairs if np.allclose(known, v, rtol=SAME_VELOCITIES, atol=slack)), None
        )
    if not inside:
        raise point.document.refusal(
            f"no velocity has these momenta, expected {branches[0].validity}", INITIAL_KEY
        )
    if len(inside) == 1:
        return inside[0]
    names = derivation.velocity_names
    listed = "; ".join(_listed(names, known) for known in sorted(values, key=tuple))
    raise point.document.refusal(
        f"{len(inside)} velocities have these momenta: {listed}",
        INITIAL_KEY,
        hint=f"give the velocities {', '.join(names)} instead",
    )


def _listed(names: Sequence[str], values: Floats) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


def on_constraints(document: Document, bounds: Keeper, q: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The start moved to the constraints, which typed numbers miss by their last digit.

    Raises DocumentError where it breaks one, ComputationError where they are dependent there.
    """
    derivation, size, start = bounds.derivation, len(q), np.concatenate([q, v])
    _require_independent(bounds, start)
    nearest: State = tuple(start.tolist())
    with suppress(*NO_VALUE):
        for _ in range(NEWTON_STEPS):
            nearest = bounds.back(0.0, nearest)
    moved = np.array(nearest)
    is_found = np.isfinite(moved).all() and np.abs(bounds.measured(ZEROS, moved[None])).max() < START_MISSES
    names = (*derivation.phase.coordinates, *derivation.velocity_names)
    near = ", ".join(f"{name}: {x:.12g}" for name, x in zip(names, moved, strict=True))
    hint = f"the nearest start that obeys all constraints is {{{near}}}" if is_found else None
    values = dict(zip(names, map(float, start), strict=True)) | {TIME: 0.0, **bounds.constants}
    of_places, of_rates = (
        np.abs(bounds.measured(ZEROS, start[None], which)[:, 0]) for which in ("expression", "rate")
    )
    problems, typed = list[Problem](), (document.system and document.system.constraints) or {}
    for one, miss, miss_of_rate in zip(derivation.system.constraints, of_places, of_rates, strict=True):
        # A miss that is not a number breaks the constraint, too.
        if miss <= START_MISSES and miss_of_rate <= START_MISSES:
            continue
        e = one.expression if not miss <= START_MISSES else one.rate
        off = e.evaluate(**{name: values[name] for name in e.names})
        what = f"the start breaks `{one.name}`, {typed[one.name].expression.text}: it is off by {off:.6g}"
        if miss <= START_MISSES and not one.has_velocities:
            what = f"the velocities at the start break `{one.name}`: {e} is {off:.6g}, expected 0"
        problems.append(document.problem(what, INITIAL_KEY, hint=hint))
    if problems:
        raise DocumentError(problems)
    return moved[:size], moved[size:]


def _require_independent(bounds: Keeper, start: Floats) -> None:
    """Raise ComputationError where the slopes of the constraints are dependent at the start."""
    limits = bounds.derivation.system.constraints
    names = [TIME, *bounds.derivation.phase.coordinates, *bounds.derivation.velocity_names]
    flat = [to_tree(e) for one in limits for e in one.slopes]
    slopes = columns(code.function(flat, names, bounds.constants))(ZEROS, *start[:, None])
    rows = slopes.reshape(len(limits), -1)
    sizes = np.abs(rows).max(axis=1)
    rank = int(np.linalg.matrix_rank(rows / np.where(sizes, sizes, 1.0)[:, None], tol=DEPENDENT_SLOPES))
    if rank < len(limits):
        empty = next((one.name for one, size in zip(limits, sizes, strict=True) if not size), None)
        why = f"`{empty}` has no slope there" if empty else f"their slopes have rank {rank} of {len(limits)}"
        raise ComputationError(
            f"the forces of the constraints have no one value at the start: {why}",
            hint="start elsewhere, or write a constraint that changes in the first order, as x and not x**2",
        )
