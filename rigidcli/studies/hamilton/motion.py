"""What is integrated of an orbit, and what its variables tell.

Where H has a closed form, these are Hamilton's equations. Where it has none, but the velocities follow from
linear equations M(q, t) v = p - b(q, t), these are solved at each step, and p' = dL/dq. Otherwise the
velocities themselves are variables: M v' = dL/dq - (dp/dq) v - dp/dt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Flow
from rigidcli.errors import ComputationError
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.studies.hamilton.initial import Start
from rigidcli.symbolic.algebra.calculus import derivative, substitute
from rigidcli.symbolic.algebra.expressions import Expr, symbol, total
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.elimination import solved
from rigidcli.symbolic.language.tree import Name, Node

BALANCE = "_balance"
"""The integral of the partial derivative of H by the time, which is the change of H."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What is integrated from where, and how its variables (k by m) at times (k) tell what is `seen`.

    That is q and p (k by n each), H (k), and the terms of H (any number by k).
    """

    flow: Flow
    start: Floats
    seen: Callable[[Floats, Floats], tuple[Floats, Floats, Floats, Floats]]


def motion_of(found: Derivation, start: Start) -> Motion:
    """The motion of a system from its start.

    Raises ComputationError where the velocities are needed to begin with, and not given.
    """
    if found.equations is not None:
        return _explicit(found, start)
    assert found.momenta is not None
    matrix = found.momenta.mass_matrix
    if all(entry.names.isdisjoint(found.velocity_names) for row in matrix for entry in row):
        return _from_momenta(found, start)
    if start.v is None:
        raise ComputationError(
            "the velocities have no closed form in the momenta",
            hint=f"begin the orbit with velocities: {', '.join(found.velocity_names)}",
        )
    return _from_velocities(found, start)


def columns(f: Flow, times: Floats, states: Floats) -> Floats:
    """The values (m by k) of a flow at times (k) and states (k by n)."""
    with np.errstate(all="ignore"):
        rows = f(np)(times, *states.T)
    return np.array([np.broadcast_to(row, times.shape) for row in rows])


def terms_of(e: Expr, found: Derivation, values: Mapping[str, float]) -> Flow:
    """The terms of a function on phase space, one by one."""
    parts = [Expr({monomial: factor}) for monomial, factor in e.ordered] or [e]
    return code.function([to_tree(part) for part in parts], [TIME, *found.phase.names], values)


def _explicit(found: Derivation, start: Start) -> Motion:
    """Hamilton's equations; with the balance of H as a further variable where it changes."""
    phase, hamiltonian = found.phase, found.hamiltonian
    assert hamiltonian is not None
    assert found.equations is not None
    slopes = list(found.equations)
    begin = np.concatenate([start.q, start.p])
    arguments = [TIME, *phase.names]
    if found.explicit_time:
        slopes.append(derivative(hamiltonian, TIME))
        begin, arguments = np.append(begin, 0.0), [*arguments, BALANCE]
    flow = code.function([to_tree(e) for e in slopes], arguments, start.values)
    terms = terms_of(hamiltonian, found, start.values)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        parts = columns(terms, times, states[:, : 2 * size])
        return states[:, :size], states[:, size : 2 * size], parts.sum(axis=0), parts

    return Motion(flow, begin, seen)


def _from_momenta(found: Derivation, start: Start) -> Motion:
    """q' = v and p' = dL/dq, with v from M v = p - b."""
    assert found.momenta is not None
    assert found.given.lagrangian is not None
    phase, lagrangian = found.phase, found.given.lagrangian
    matrix = [[to_tree(entry) for entry in row] for row in found.momenta.mass_matrix]
    zero = {name: Expr({}) for name in found.velocity_names}
    rest = [
        to_tree(symbol(name) - substitute(e, zero))
        for name, e in zip(phase.momenta, found.momenta.definitions, strict=True)
    ]
    steps, answers = solved(matrix, rest)
    steps = [*steps, *zip(found.velocity_names, answers, strict=True)]
    forces = [to_tree(derivative(lagrangian, name)) for name in phase.coordinates]
    slopes: list[Node] = [*map(Name, found.velocity_names), *forces]
    begin, arguments = np.concatenate([start.q, start.p]), [TIME, *phase.names]
    if found.explicit_time:
        slopes.append(to_tree(-derivative(lagrangian, TIME)))
        begin, arguments = np.append(begin, 0.0), [*arguments, BALANCE]
    flow = code.function(slopes, arguments, start.values, steps)
    parts = [symbol(a) * symbol(b) for a, b in zip(phase.momenta, found.velocity_names, strict=True)]
    terms = [*parts, *(Expr({m: -c}) for m, c in lagrangian.ordered)]
    told = code.function([to_tree(e) for e in terms], [TIME, *phase.names], start.values, steps)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        parts = columns(told, times, states[:, : 2 * size])
        return states[:, :size], states[:, size : 2 * size], parts.sum(axis=0), parts

    return Motion(flow, begin, seen)


def _from_velocities(found: Derivation, start: Start) -> Motion:
    """q' = v and M v' = dL/dq - (dp/dq) v - dp/dt."""
    assert found.momenta is not None
    assert found.given.lagrangian is not None
    phase, lagrangian, definitions = found.phase, found.given.lagrangian, found.momenta.definitions
    matrix = [[to_tree(entry) for entry in row] for row in found.momenta.mass_matrix]
    rest = [
        to_tree(
            total(
                [
                    derivative(lagrangian, name),
                    *(
                        -derivative(p, other) * symbol(rate)
                        for other, rate in zip(phase.coordinates, found.velocity_names, strict=True)
                    ),
                    -derivative(p, TIME),
                ]
            )
        )
        for name, p in zip(phase.coordinates, definitions, strict=True)
    ]
    steps, answers = solved(matrix, rest)
    slopes: list[Node] = [*map(Name, found.velocity_names), *answers]
    assert start.v is not None
    begin = np.concatenate([start.q, start.v])
    arguments = [TIME, *phase.coordinates, *found.velocity_names]
    if found.explicit_time:
        slopes.append(to_tree(-derivative(lagrangian, TIME)))
        begin = np.append(begin, 0.0)
    flow = code.function(
        slopes, [*arguments, BALANCE] if found.explicit_time else arguments, start.values, steps
    )
    parts = [p * symbol(rate) for p, rate in zip(definitions, found.velocity_names, strict=True)]
    terms = [*parts, *(Expr({m: -c}) for m, c in lagrangian.ordered)]
    told = code.function([to_tree(e) for e in (*definitions, *terms)], arguments, start.values)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        rows = columns(told, times, states[:, : 2 * size])
        return states[:, :size], rows[:size].T, rows[size:].sum(axis=0), rows[size:]

    return Motion(flow, begin, seen)
