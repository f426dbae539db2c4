"""Constraints: how orbits keep them, and the results on their multipliers and forces.

An orbit drifts away from the constraints by the errors of its steps. So each step ends with one of Newton's
steps back, which is the shortest one as the mass matrix M measures lengths. With the matrix A of the slopes,

    [M  A^T] [dq]   [0]                    [M  A^T] [dv]   [   0   ]
    [A   0 ] [ .] = [f(q, t)],  then       [A   0 ] [ .] = [A v + b],     q -> q - dq,  v -> v - dv.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, section IV.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Function, Solution, State, columns
from rigidcli.document.document import Document
from rigidcli.document.phase_space import acceleration
from rigidcli.language import code
from rigidcli.language.text import latex_name
from rigidcli.language.tree import Name
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Column, Field, Step, Table, yes_or_no
from rigidcli.studies.common import celled, field_of
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import beside_constraints, terms
from rigidcli.studies.hamilton.system import as_typed


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


def fields(derivation: Derivation) -> list[Field]:
    """The multipliers, the forces of the constraints, and how many ways are left to move."""
    limits, phase = derivation.system.constraints, derivation.phase
    shown = [field_of("hamilton", "degrees_of_freedom", len(phase.coordinates) - len(limits))]
    if derivation.multipliers is None or derivation.constraint_forces is None:
        return [*shown, Field("multipliers", None), Field("constraint_forces", None)]
    for one, e in zip(limits, derivation.multipliers, strict=True):
        shown.append(celled(f"multipliers.{one.name}", e, one.name, latex_name(one.name)))
    for q, e in zip(phase.coordinates, derivation.constraint_forces, strict=True):
        # A force that is a multiplier is shown already.
        is_shown = e.is_zero or e in derivation.multipliers
        sign = f"R_{{{latex_name(q)}}}"
        key, title = f"constraint_forces.{q}", f"force of constraint, {q}"
        shown.append(celled(key, e, title, sign, diagnostic=is_shown))
    return shown


def table(derivation: Derivation, document: Document) -> Table:
    """The constraints, as they are typed."""
    limits = derivation.system.constraints
    (typed,) = as_typed([Field("", [one.expression for one in limits])], document)
    kinds = [one.holonomic for one in limits]
    columns = (
        Column("name", [one.name for one in limits], ("multiplier",)),
        Column("expression", typed.value, ("what vanishes",)),
        Column("holonomic", kinds, ("holonomic",), words=tuple(map(yes_or_no, kinds))),
    )
    return Table("constraints", "constraints", columns, records=True)


def steps(derivation: Derivation, shown: list[Field]) -> Iterator[Step]:
    """Lead from the constraints to their multipliers; `shown` are the results on them."""
    limits, phase = derivation.system.constraints, derivation.phase
    matrix = np.array([one.slopes for one in limits], dtype=object)
    rates = [Field("", one.expression, one.name, latex_name(one.name)) for one in limits]
    yield Step(
        "Constraints",
        "These vanish. The entry a_ji of the matrix A is the derivative of the j-th by the i-th coordinate, "
        "or by its velocity where the constraint has velocities. It acts on that coordinate with the force "
        "lambda_j a_ji, which stands in the equations already.",
        (*rates, Field("", matrix, "A", r"\mathbf{A}")),
    )
    second = []
    for one in limits:
        moved = total(a * symbol(acceleration(q)) for a, q in zip(one.slopes, phase.coordinates, strict=True))
        if not one.has_velocities:
            second.append(Field("", one.rate, f"{one.name}, once: 0 =", "0"))
        times = "once" if one.has_velocities else "twice"
        second.append(Field("", moved + one.turning, f"{one.name}, {times}: 0 =", "0"))
    yield Step(
        "Differentiated constraints",
        "The constraints hold all the time, so that their derivatives by the time vanish, too. They are "
        "differentiated until there are accelerations in them.",
        tuple(second),
    )
    yield Step(
        "Multipliers",
        "The accelerations of Lagrange's equations are put into the differentiated constraints, which are "
        "solved for the multipliers. These give the forces of constraint, and the accelerations.",
        tuple(shown),
    )
