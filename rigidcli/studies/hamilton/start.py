"""The state at t = 0: the momenta or velocities that are not given, on the constraints and on one branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.functions import apply
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, DocumentError, ExpressionError, Problem
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.lagrange_equations import Constraint
from rigidcli.mechanics.legendre import Momenta, canonical_momenta
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton.derivation import Derivation, on_this_side
from rigidcli.studies.hamilton.equations_of_motion import InitialState, parts_of, way_back

# The key under which a document gives the initial state.
INITIAL_KEY = "orbit.initial"
# The largest miss of a constraint that a start may have, in units of the terms of the constraint.
# It is moved onto the constraint: numbers that are typed obey none to all digits of a float.
START_MISSES = 1e-6
# Steps of Newton's method that move a start onto the constraints; each doubles the digits.
NEWTON_STEPS = 8
# Constraints are dependent where a singular value of their slopes, each scaled to 1, is below this.
DEPENDENT_SLOPES = 1e-10
# Velocities belong to a branch v(p) from which they differ by less than this, in units of their size.
SAME_VELOCITIES = 1e-6


def initial_state(document: Document, derivation: Derivation) -> tuple[Derivation, InitialState]:
    """The state at t = 0, and the system with the branch v(p) to which its velocities belong.

    Raises DocumentError where the system has no motion from there, and ComputationError where H has steps.
    """
    assert document.system is not None
    assert document.orbit is not None
    for place in derivation.jumps:
        raise ComputationError(
            f"H has a step where {place} = 0, at which a momentum changes suddenly",
            hint=f"write a gradual step, such as {apply('tanh', place / symbol('d'))} with a small d",
        )
    q, p, v = document.orbit.start(document.system)
    phase, names = derivation.phase, derivation.velocity_names
    parameters = {name: float(value) for name, value in document.values.items()}
    point = _Point(document, {TIME: 0.0, **parameters}).at(phase.coordinates, q)
    notes = tuple[str, ...]()
    if p is None:
        assert v is not None
        p, notes = _momenta(point, derivation, v)
    point = point.at(phase.momenta, p)
    if derivation.branches and not derivation.are_linear:
        derivation = on_this_side(derivation, point.known)
        branch = _branch(point, derivation, v)
        derivation = replace(derivation, branches=() if branch is None else (branch,))
    limits = derivation.system.constraints
    if v is None and (limits or derivation.equations is None):
        if derivation.rates:
            v = point.evaluate([*derivation.rates.values()], "a velocity")
        else:
            v, notes = _solved(point, derivation.momenta, names, p, "velocities", "momenta")
    if limits and v is not None:
        q, v = _on_constraints(point.at(names, v), derivation, parameters, np.concatenate([q, v]))
        point = point.at(phase.coordinates, q)
        p, _ = _momenta(point, derivation, v)
        point = point.at(phase.momenta, p)
    if derivation.hamiltonian is not None:
        point.evaluate([derivation.hamiltonian], "H")
    if notes:
        derivation = replace(derivation, notes=(*derivation.notes, *notes))
    return derivation, InitialState(parameters, q, p, v)


class _Point(NamedTuple):
    """The start: the values of t, parameters, and variables that are known so far."""

    document: Document
    known: Mapping[str, float]

    def at(self, names: Sequence[str], values: Floats) -> _Point:
        return self._replace(known={**self.known, **dict(zip(names, map(float, values), strict=True))})

    def evaluate(self, expressions: Sequence[Expr], what: str) -> Floats:
        """The values of expressions. Raises DocumentError where `what` has none."""
        try:
            return np.array([e.evaluate(**self.known) for e in expressions], dtype=np.float64)
        except ExpressionError:
            message = f"{what} has no finite real value there"
            raise self.document.refusal(message, INITIAL_KEY) from None


def _momenta(point: _Point, derivation: Derivation, v: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The momenta (n) from the velocities: by definition, or from v = dH/dp where H is given; with notes."""
    names = derivation.phase.momenta
    if not derivation.definitions:
        functions = canonical_momenta(derivation.generator, names)
        return _solved(point, functions, names, v, "momenta", "velocities")
    there = point.at(derivation.velocity_names, v)
    return there.evaluate(derivation.momenta.definitions, "a momentum"), ()


def _solved(
    point: _Point, functions: Momenta, names: Sequence[str], target: Floats, kind: str, given: str
) -> tuple[Floats, tuple[str, ...]]:
    """Values of names (n) for which functions of them are the target, by a search from zero; with notes.

    They are of a `kind`, velocities with `given` momenta or momenta with given velocities. Raises
    DocumentError where nothing is found.
    """
    size, slopes = len(target), [e for row in functions.mass_matrix for e in row]

    def miss(values: Floats) -> tuple[Floats, Floats]:
        there = point.at(names, values).evaluate([*functions.definitions, *slopes], f"one of the {given}")
        return there[:size] - target, there[size:].reshape(size, size)

    with suppress(np.linalg.LinAlgError):
        left, matrix = miss(np.zeros(size))
        is_alone = all(e.names.isdisjoint(names) for e in slopes)
        if is_alone:
            found = np.asarray(np.linalg.solve(matrix, -left))
        else:
            from scipy.optimize import root

            found = root(miss, np.zeros(size), jac=True, method="lm", tol=1e-15).x
        if np.abs(miss(found)[0]).max() <= SAME_VELOCITIES * np.abs([target, left]).max():
            belong = f"the {given} at the start belong to {_listed(names, found)}, and perhaps to others, too"
            return found, () if is_alone else (belong,)
    raise point.document.refusal(
        f"no {kind} were found that have these {given}",
        INITIAL_KEY,
        hint=f"give the {kind} {', '.join(names)} instead",
    )


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


def _on_constraints(
    point: _Point, derivation: Derivation, parameters: Mapping[str, float], start: Floats
) -> tuple[Floats, Floats]:
    """Coordinates and velocities moved to the constraints, which typed numbers miss by their last digit.

    Raises DocumentError where the start (2 n) breaks one, ComputationError where they are dependent there.
    """
    limits, document = derivation.system.constraints, point.document
    _require_independent(point, limits)

    names = (*derivation.phase.coordinates, *derivation.velocity_names)

    def off(limit: Constraint, state: Floats, rate: bool = False) -> float:
        terms = parts_of(limit, derivation.phase.coordinates, rate)
        sizes = point.at(names, state).evaluate(terms, "a constraint")
        return float(abs(sizes.sum()) / (np.abs(sizes).sum() or 1.0))

    back, nearest = way_back(derivation, parameters), tuple(start.tolist())
    with suppress(*NO_VALUE):
        for _ in range(NEWTON_STEPS):
            nearest = tuple(back(0.0, nearest))
    moved = np.array(nearest)
    is_found = np.isfinite(moved).all() and all(off(one, moved) < START_MISSES for one in limits)
    near = ", ".join(f"{name}: {x:.12g}" for name, x in zip(names, moved, strict=True))
    hint = f"the nearest start that obeys all constraints is {{{near}}}" if is_found else None
    problems, typed = list[Problem](), (document.system and document.system.constraints) or {}
    for one in limits:
        if off(one, start) > START_MISSES:
            value, text = one.expression.evaluate(**point.known), typed[one.name].expression.text
            what = f"the start breaks `{one.name}`, {text}: it is off by {value:.6g}"
        elif off(one, start, rate=True) > START_MISSES:
            value = one.rate.evaluate(**point.known)
            what = f"the velocities at the start break `{one.name}`: {one.rate} is {value:.6g}, expected 0"
        else:
            continue
        problems.append(document.problem(what, INITIAL_KEY, hint=hint))
    if problems:
        raise DocumentError(problems)
    return moved[: len(start) // 2], moved[len(start) // 2 :]


def _require_independent(point: _Point, limits: Sequence[Constraint]) -> None:
    """Raise ComputationError where the slopes of the constraints are dependent at the start."""
    slopes = point.evaluate([e for one in limits for e in one.slopes], "the slope of a constraint")
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
