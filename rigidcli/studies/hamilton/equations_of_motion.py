"""The equations of motion that are integrated for an orbit, or written as a program, and their variables.

Where H has a closed form, these are Hamilton's equations. Where it has none, but the velocities follow from
linear equations M(q, t) v = p - b(q, t), these are solved at every step, and p' = dL/dq. Otherwise the
velocities themselves are variables: M v' = dL/dq - (dp/dq) v - dp/dt.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.estimate import Watched, columns
from rigidcli.core.solution import Flow
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.language.sharing import Step, shared, solved
from rigidcli.language.tree import Name, Node, rounding
from rigidcli.mechanics.hamilton_equations import TIME, Phase
from rigidcli.program import Program, Run
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import require_formulas

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.orbit import InitialState, OrbitSolution

ENERGY_CHANGE = ".energy_change"
"""The integral of dH/dt, which is a further variable where H changes: by the time, or by forces.

No name of a document has a dot.
"""

LEAST_SIZE = 1e-3
"""The least size of a variable with which its errors are compared, in units of what its rate is made of.

A variable that stays zero only as large numbers cancel is noise, about 1e-16 of these: no program can follow
it with errors of 1e-12 of its own size.
"""

NUDGE = 1e-6
"""By how much variables are changed, in units of themselves, to see what rates are made of."""


@dataclass(frozen=True, slots=True, eq=False)
class EquationsOfMotion:
    """The `flow` is integrated from `start`; `observed` takes times (k) and its variables (k by m).

    It gives q and p (both k by n), H (k), and the terms of H (any number by k). `roundings` are the
    rounding errors of the flow, in units of the error of one operation. `watched` shows where something
    sudden may be.
    """

    flow: Flow
    roundings: Flow
    start: Floats
    watched: Watched
    observed: Callable[[Floats, Floats], tuple[Floats, Floats, Floats, Floats]]


@dataclass(frozen=True, slots=True, eq=False)
class Equations:
    """The equations of motion of 2 n variables in symbols: of coordinates, and of momenta or velocities.

    `slopes` are their derivatives by time; the momenta (n) and the terms of H, `energy`, follow from them.
    All of these come after `steps`.
    """

    names: tuple[str, ...]
    slopes: Sequence[Node]
    momenta: Sequence[Expr]
    energy: Sequence[Expr]
    steps: Sequence[Step] = ()

    def start(self, initial: InitialState) -> Floats:
        """The initial values of the variables (2 n)."""
        follows_momenta = self.names[len(initial.q) :] == tuple(map(str, self.momenta))
        others = initial.p if follows_momenta or initial.v is None else initial.v
        return np.concatenate([initial.q, others])


def symbolic_equations(derivation: Derivation) -> Equations:
    """The equations of motion of a system."""
    return _lagrange(derivation) if derivation.equations is None else _hamilton(derivation)


def equations_of_motion(derivation: Derivation, initial: InitialState) -> EquationsOfMotion:
    """The equations of motion of a system, and its initial state."""
    equations, observe, flow, roundings, watched = _in_code(derivation, tuple(initial.parameters.items()))
    size, start = len(initial.q), equations.start(initial)
    if derivation.energy_changes:
        start = np.append(start, 0.0)

    def observed(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        rows = columns(observe)(times, *states[:, : 2 * size].T)
        return states[:, :size], rows[:size].T, rows[size:].sum(axis=0), rows[size:]

    return EquationsOfMotion(flow, roundings, start, watched, observed)


@lru_cache(maxsize=1)
def _in_code(
    derivation: Derivation, parameters: tuple[tuple[str, float], ...]
) -> tuple[Equations, Flow, Flow, Flow, Watched]:
    """The equations of a system with values of its parameters, which serve all starts of an ensemble.

    Behind them are the flows of the momenta and of the terms of H, of the slopes of the variables, and of
    their rounding errors, and what is to be watched.
    """
    equations, constants = symbolic_equations(derivation), dict(parameters)
    slopes, arguments, steps = list(equations.slopes), [TIME, *equations.names], equations.steps
    observed = [to_tree(e) for e in (*equations.momenta, *equations.energy)]
    observe = code.function(observed, arguments, constants, steps)
    if derivation.energy_changes:
        arguments = [*arguments, ENERGY_CHANGE]
        slopes.append(to_tree(derivation.power))
    flow, roundings = (
        code.function(nodes, arguments, constants, steps) for nodes in (slopes, list(map(rounding, slopes)))
    )
    return equations, observe, flow, roundings, code.watched(slopes, arguments, constants, steps)


def _hamilton(derivation: Derivation) -> Equations:
    """Write Hamilton's equations in symbols."""
    assert derivation.equations is not None
    assert derivation.hamiltonian is not None
    phase, slopes = derivation.phase, [to_tree(e) for e in derivation.equations]
    p, energy = [symbol(name) for name in phase.momenta], terms(derivation.hamiltonian)
    return Equations(phase.names, slopes, p, energy)


def _lagrange(derivation: Derivation) -> Equations:
    """Write Lagrange's equations for the momenta if linear in the velocities, or else for the velocities."""
    phase, velocities, lagrangian = derivation.phase, derivation.velocity_names, derivation.system.lagrangian
    assert lagrangian is not None
    assert derivation.momenta is not None
    matrix, definitions = derivation.momenta.mass_matrix, derivation.momenta.definitions
    pairs = zip(phase.coordinates, derivation.system.forces, strict=True)
    forces = [derivative(lagrangian, q) + force for q, force in pairs]
    rates: list[Node] = [Name(name) for name in velocities]
    v = [symbol(name) for name in velocities]

    def solutions(right: Iterable[Expr]) -> tuple[list[Step], list[Node]]:
        return solved([[to_tree(e) for e in row] for row in matrix], [to_tree(e) for e in right])

    def energy(p: Sequence[Expr]) -> list[Expr]:
        return [*(a * b for a, b in zip(p, v, strict=True)), *terms(-lagrangian)]

    if derivation.are_linear:
        p, at_rest = [symbol(name) for name in phase.momenta], dict.fromkeys(velocities, ZERO)
        steps, v_of_p = solutions(a - substitute(e, at_rest) for a, e in zip(p, definitions, strict=True))
        steps += zip(velocities, v_of_p, strict=True)
        slopes = [*rates, *map(to_tree, forces)]
        return Equations(phase.names, slopes, p, energy(p), steps)
    moving = [*zip(phase.coordinates, v, strict=True), (TIME, ONE)]
    defined = dict(zip(phase.momenta, definitions, strict=True))
    steps, accelerations = solutions(
        total([substitute(f, defined), *(-derivative(p, name) * rate for name, rate in moving)])
        for f, p in zip(forces, definitions, strict=True)
    )
    names, slopes = (*phase.coordinates, *velocities), [*rates, *accelerations]
    return Equations(names, slopes, definitions, energy(definitions), steps)


def terms(e: Expr) -> list[Expr]:
    """The terms of an expression, one by one."""
    return [Expr({monomial: factor}) for monomial, factor in e.ordered] or [e]


def values_of_terms(e: Expr, phase: Phase, parameters: Mapping[str, float]) -> Callable[..., Floats]:
    """The terms (m by k) of a function on phase space at times (k) and values of the variables (k)."""
    return columns(code.function([to_tree(term) for term in terms(e)], [TIME, *phase.names], parameters))


def program_of(
    document: Document,
    name: str,
    derivation: Derivation,
    initial: InitialState | None,
    orbit: OrbitSolution | None,
) -> Program:
    """The program of a system with this `name`: its rates, H, and momenta where velocities are followed.

    Raises DocumentError where a function has no formula, and ComputationError where H has steps, which its
    equations do not tell, or a number is too large for floats.
    """
    require_formulas(document, [derivation.generator, *derivation.system.forces], "a program")
    for place in derivation.jumps:
        raise ComputationError(f"H has a step where {place} = 0, which its equations do not tell")
    equations, phase, system = symbolic_equations(derivation), derivation.phase, derivation.system
    asked = {name: [to_tree(e)] for name, e in zip(phase.momenta, equations.momenta, strict=True)}
    asked = {name: trees for name, trees in asked.items() if name not in equations.names}
    asked["H"] = [to_tree(total(equations.energy))]
    try:
        rates = shared(equations.steps, equations.slopes)
        quantities = {name: shared(equations.steps, trees) for name, trees in asked.items()}
    except ExpressionError as error:
        raise ComputationError(f"there is no program: {error.message}") from error
    used = frozenset[str]().union(rates.names, *(each.names for each in quantities.values()))
    constants = {
        name: None
        if document.values.get(name) is None or name in document.symbols
        else float(document.values[name])
        for name in document.definitions
        if name in used
    }
    about = [name, f"L = {system.lagrangian}" if system.hamiltonian is None else f"H = {system.hamiltonian}"]
    about += [
        f"the force on {q} is {force}"
        for q, force in zip(phase.coordinates, system.forces, strict=True)
        if not force.is_zero
    ]
    run = None
    if initial is not None and orbit is not None:
        arguments = [TIME, *equations.names]
        flow = code.function(equations.slopes, arguments, initial.parameters, equations.steps)
        run = Run(equations.start(initial).tolist(), _sizes(orbit, flow), orbit.times)
    return Program(about, constants, TIME, equations.names, rates, quantities, (TIME, *phase.names, "H"), run)


def _sizes(orbit: OrbitSolution, flow: Flow) -> list[float]:
    """The sizes of the variables of an orbit with these rates, in three digits; none is zero."""
    rates, times, states = columns(flow), orbit.times, orbit.states
    # Each variable is changed differently, so that equal ones do not cancel.
    nudged = states * (1 + NUDGE * np.linspace(1.0, 2.0, states.shape[1]))
    changes = np.abs(rates(times, *nudged.T) - rates(times, *states.T)).max(axis=1) / NUDGE
    between = times[-1] / min(len(times), orbit.steps or 1)
    sizes = np.fmax(np.abs(states).max(axis=0), LEAST_SIZE * changes * between)
    return [float(f"{size:.3g}") or 1.0 for size in sizes]
