"""How orbits keep constraints: the start is on them, and each step ends with the way back to them.

An orbit drifts away from the constraints by the errors of its steps. So each step ends with one of Newton's
steps back, which is the shortest one as the mass matrix M measures lengths. With the matrix A of the slopes,

    [M  A^T] [dq]   [0]                    [M  A^T] [dv]   [   0   ]
    [A   0 ] [ .] = [f(q, t)],  then       [A   0 ] [ .] = [A v + b],     q -> q - dq,  v -> v - dv.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, section IV.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.estimate import columns
from rigidcli.core.solution import NO_VALUE, Function, Solution, State
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, DocumentError, Problem
from rigidcli.language import code
from rigidcli.language.tree import Name
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import KEY, beside_constraints, terms

ZEROS = np.zeros(1)
"""The time of the start, as an array."""

KEPT_TO = 1e-6
"""A start breaks a constraint that it misses by more than this, in units of the terms of the constraint.

It is moved by less: the digits of a number that is typed obey no constraint to all digits of a float.
"""

RETURNS = 8
"""Newton's steps by which a start comes back to the constraints; each doubles the digits."""

DEPENDENT = 1e-10
"""Constraints are dependent at a state where a singular value of their slopes, scaled to 1, is less."""


@dataclass(frozen=True, slots=True, eq=False)
class Keeper:
    """The constraints of a system with values of its parameters. States are coordinates, then velocities.

    `places` and `rates` give a state whose coordinates, or whose velocities, are moved back by one step.
    """

    derivation: Derivation
    constants: Mapping[str, float]
    places: Function
    rates: Function

    def back(self, t: float, state: State) -> State:
        """A state near the constraints, moved to them by one of Newton's steps; what else is in it stays."""
        size = 2 * len(self.derivation.phase.coordinates)
        return (*self.rates(t, *self.places(t, *state[:size])), *state[size:])

    def sizes(self, values: Callable[[Sequence[Expr], Floats, Floats], Floats], solution: Solution) -> Floats:
        """What the forces of the constraints do to coordinates and velocities in a step of a solution (2 n).

        A velocity that a constraint keeps at zero is rounding: large forces cancel in it.
        """
        momenta, limits = self.derivation.momenta, self.derivation.system.constraints
        assert momenta is not None
        pushes = [
            one.multiplier * slope / row[place]
            for one in limits
            for place, (slope, row) in enumerate(zip(one.slopes, momenta.mass_matrix, strict=True))
            if row[place]
        ]
        if len(pushes) < len(limits) * len(momenta.mass_matrix):
            return np.zeros(2 * len(momenta.mass_matrix))
        found = np.abs(values(pushes, solution.knots, solution.at(solution.knots)))
        gained = found.reshape(len(limits), len(momenta.mass_matrix), -1).sum(axis=0).max(axis=1)
        step = float(solution.knots[-1]) / max(1, solution.steps)
        sizes: Floats = np.nan_to_num(np.concatenate([gained * step**2, gained * step]))
        return sizes

    def measured(self, times: Floats, states: Floats, which: str = "expression") -> Floats:
        """How far off each constraint is, or its `rate`, at times (k) and states (k by 2 n): (m by k).

        It is in units of the largest sum of the sizes of its terms, or of its slopes times the coordinates.
        """
        q, v = self.derivation.phase.coordinates, self.derivation.velocity_names
        arguments, rows = [TIME, *q, *v], []
        for one in self.derivation.system.constraints:
            e = getattr(one, which)
            moved = [] if e == one.rate else [a * symbol(name) for a, name in zip(one.slopes, q, strict=True)]
            count, trees = len(terms(e)), [to_tree(x) for x in (*terms(e), *moved)]
            values = columns(code.function(trees, arguments, self.constants))(times, *states.T)
            sizes = [np.abs(part).sum(axis=0).max() for part in (values[:count], values[count:])]
            rows.append(values[:count].sum(axis=0) / (max(sizes) or 1.0))
        return np.array(rows)


def keeper(derivation: Derivation, constants: Mapping[str, float]) -> Keeper:
    """The constraints of a system with these values of its parameters."""
    limits, q, v = derivation.system.constraints, derivation.phase.coordinates, derivation.velocity_names

    def moved(names: Sequence[str], misses: Sequence[Expr]) -> Function:
        steps, answers = beside_constraints(derivation, [ZERO] * len(q), misses)
        nearer = {name: Name(name) - d for name, d in zip(names, answers, strict=False)}
        after = [nearer.get(name, Name(name)) for name in (*q, *v)]
        return code.function(after, [TIME, *q, *v], constants, steps)(math)

    places = moved(q, [ZERO if one.has_velocities else one.expression for one in limits])
    return Keeper(derivation, constants, places, moved(v, [one.rate for one in limits]))


def on_constraints(document: Document, keeper: Keeper, q: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The start of an orbit, moved to the constraints: numbers that are typed miss them by a rounding.

    Raises DocumentError where it breaks one, ComputationError where they are dependent there.
    """
    derivation, size, start = keeper.derivation, len(q), np.concatenate([q, v])
    _require_independent(keeper, start)
    nearest: State = tuple(start.tolist())
    with suppress(*NO_VALUE):
        for _ in range(RETURNS):
            nearest = keeper.back(0.0, nearest)
    moved = np.array(nearest)
    is_found = np.isfinite(moved).all() and np.abs(keeper.measured(ZEROS, moved[None])).max() < KEPT_TO
    names = (*derivation.phase.coordinates, *derivation.velocity_names)
    problems, typed = list[Problem](), (document.system and document.system.constraints) or {}
    for one, misses in zip(
        derivation.system.constraints,
        zip(
            *(keeper.measured(ZEROS, start[None], which)[:, 0] for which in ("expression", "rate")),
            strict=True,
        ),
        strict=True,
    ):
        which = next((k for k, miss in enumerate(misses) if not abs(miss) <= KEPT_TO), None)
        if which is None:
            continue
        e = one.rate if which else one.expression
        values = dict(zip(names, map(float, start), strict=True)) | {TIME: 0.0, **keeper.constants}
        off = e.evaluate(**{name: values[name] for name in e.names})
        what = f"the start breaks `{one.name}`, {typed[one.name].expression.text}: it is off by {off:.6g}"
        if which and not one.has_velocities:
            what = f"the velocities at the start break `{one.name}`: {e} is {off:.6g}, expected 0"
        near = ", ".join(f"{name}: {x:.12g}" for name, x in zip(names, moved, strict=True))
        hint = f"the nearest start that obeys all constraints is {{{near}}}" if is_found else None
        problems.append(document.problem(what, KEY, hint=hint))
    if problems:
        raise DocumentError(problems)
    return moved[:size], moved[size:]


def _require_independent(keeper: Keeper, start: Floats) -> None:
    """Raise ComputationError where the slopes of the constraints are dependent at the start."""
    limits = keeper.derivation.system.constraints
    names = [TIME, *keeper.derivation.phase.coordinates, *keeper.derivation.velocity_names]
    flat = [to_tree(e) for one in limits for e in one.slopes]
    slopes = columns(code.function(flat, names, keeper.constants))(ZEROS, *start[:, None])
    rows = slopes.reshape(len(limits), -1)
    sizes = np.abs(rows).max(axis=1)
    rank = int(np.linalg.matrix_rank(rows / np.where(sizes, sizes, 1.0)[:, None], tol=DEPENDENT))
    if rank < len(limits):
        empty = [one.name for one, size in zip(limits, sizes, strict=True) if not size]
        why = (
            f"`{empty[0]}` has no slope there" if empty else f"their slopes have rank {rank} of {len(limits)}"
        )
        raise ComputationError(
            f"the constraints do not tell their forces at the start: {why}",
            hint="start elsewhere, or write a constraint that changes in the first order, as x and not x**2",
        )
