"""Changes of variables by a generating function: the relations that follow from it, solved where they can be.

With the old variables q, p and the new ones Q, P, each type of function has one half of each:

    F1(q, Q, t):    p = dF/dq      P = -dF/dQ
    F2(q, P, t):    p = dF/dq      Q =  dF/dP
    F3(p, Q, t):    q = -dF/dp     P = -dF/dQ
    F4(p, P, t):    q = -dF/dp     Q =  dF/dP

and the new Hamiltonian is K = H + dF/dt, the derivative at fixed arguments. The relations are a change of
variables where the matrix of mixed derivatives of F is invertible. Source: H. Goldstein, C. Poole, J. Safko,
Classical Mechanics, 3rd edition, section 9.1 and table 9.1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rigidcli.algebra.bounds import Allowance
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import sample_points
from rigidcli.errors import ComputationError
from rigidcli.mechanics.canonical import MOST_TRIALS, RootSigns, solution
from rigidcli.mechanics.phase_space import TIME, Phase

TYPES = {"F1": (0, 0), "F2": (0, 1), "F3": (1, 0), "F4": (1, 1)}
"""Whether the old, and the new arguments of a function are coordinates (0) or momenta (1)."""

SINGULAR = 1e-9
"""A matrix whose least singular value is below this share of its largest entry counts as singular."""


def arguments(kind: str, old: Phase, new: Phase) -> tuple[Sequence[str], Sequence[str]]:
    """The old and the new variables that a function of this type holds."""
    first, second = TYPES[kind]
    return (old.coordinates, old.momenta)[first], (new.coordinates, new.momenta)[second]


@dataclass(frozen=True, slots=True)
class Generated:
    """The change that a generating function makes.

    `relations` are the other old and new variables as functions of its arguments. `old` are the old
    variables as functions of the new ones, and `new` the new ones by the old ones; each is None where the
    relations are not solved for it. `rate` is dF/dt at fixed arguments.
    """

    relations: Mapping[str, Expr]
    old: Mapping[str, Expr] | None
    new: Mapping[str, Expr] | None
    rate: Expr


def generated(kind: str, function: Expr, old: Phase, new: Phase) -> Generated:
    """The change of variables by a function of a type, such as "F1".

    Raises ComputationError where its mixed derivatives are not those of a change of variables.
    """
    befores, afters = arguments(kind, old, new)
    mixed = [[derivative(derivative(function, a), b) for b in afters] for a in befores]
    relations = {}
    for phase, names in ((old, befores), (new, afters)):
        for name in names:
            # p = dF/dq and Q = dF/dP, but q = -dF/dp and P = -dF/dQ.
            sign = 1 if (phase is old) == (name in phase.coordinates) else -1
            relations[_partner(name, phase)] = tidy(sign * derivative(function, name))
    point = _point(function, relations, mixed)
    if point is None:
        raise ComputationError(
            f"{kind} generates no change of variables: the determinant of its mixed derivatives by "
            f"{', '.join(befores)} and {', '.join(afters)} vanishes",
            hint=f"each old argument has to occur in a term with a new one, as in `{befores[0]}*{afters[0]}`",
        )
    signs = RootSigns(point)
    return Generated(
        relations,
        _solved(relations, old, befores, [_partner(b, new) for b in afters], signs),
        _solved(relations, new, afters, [_partner(a, old) for a in befores], signs),
        derivative(function, TIME),
    )


def _partner(name: str, phase: Phase) -> str:
    """The momentum of a coordinate, or the coordinate of a momentum."""
    names = phase.names
    return names[(names.index(name) + len(phase.coordinates)) % len(names)]


def _point(
    function: Expr, relations: Mapping[str, Expr], mixed: Sequence[Sequence[Expr]]
) -> dict[str, float] | None:
    """Values of all variables that agree, with positive arguments; None for a singular mixed matrix."""
    names = {name for e in (function, *relations.values()) for name in e.names}
    for sample in sample_points(sorted(names), {}):
        here = RootSigns(sample)
        values = {name: here.value(e) for name, e in relations.items()}
        matrix = [[here.value(e) for e in row] for row in mixed]
        if all(map(math.isfinite, (*values.values(), *(x for row in matrix for x in row)))):
            return {**sample, **values} if _is_invertible(matrix) else None
    return None


def _is_invertible(matrix: Sequence[Sequence[float]]) -> bool:
    import numpy as np

    largest = max(abs(x) for row in matrix for x in row)
    return bool(np.linalg.matrix_rank(np.array(matrix), tol=SINGULAR * largest) == len(matrix))


def _solved(
    relations: Mapping[str, Expr],
    side: Phase,
    unknowns: Sequence[str],
    given: Sequence[str],
    signs: RootSigns,
) -> dict[str, Expr] | None:
    """One side as functions of the other: its `unknowns` from the relations for the `given` variables."""
    equations = [symbol(name) - relations[name] for name in given]
    found = solution(equations, unknowns, Allowance(MOST_TRIALS), signs)
    if found is None:
        return None
    return {
        name: tidy(found[name] if name in found else signs.put(relations[name], found)) for name in side.names
    }
