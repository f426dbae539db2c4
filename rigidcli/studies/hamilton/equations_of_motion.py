"""The equations of motion that are integrated for an orbit, and the meaning of their variables.

Where H has a closed form, these are Hamilton's equations. Where it has none, but the velocities follow from
linear equations M(q, t) v = p - b(q, t), these are solved at every step, and p' = dL/dq. Otherwise the
velocities themselves are variables: M v' = dL/dq - (dp/dq) v - dp/dt.

With constraints, too, the velocities are variables. Where the multipliers have no closed form, they and the
accelerations a solve a system of linear equations: A is the matrix of the slopes of the constraints, r and c
are what else stands in Lagrange's equations and in the differentiated constraints.

    [M  A^T] [   a   ]   [-r]
    [A   0 ] [-lambda] = [-c]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.kicks import Watched
from rigidcli.core.solution import Flow, columns
from rigidcli.language import code
from rigidcli.language.code import Step, solved
from rigidcli.language.tree import Name, Node, rounding
from rigidcli.mechanics.phase_space import TIME, Phase
from rigidcli.studies.hamilton.derivation import Derivation

# The integral of dH/dt, which is a further variable where H changes: by the time, or by forces.
# No name of a document has a dot.
ENERGY_CHANGE = ".energy_change"
# The key under which a document gives the initial state.
INITIAL_KEY = "orbit.initial"


@dataclass(frozen=True, slots=True, eq=False)
class InitialState:
    """The values of the parameters, and coordinates q, momenta p and velocities v (all n) at t = 0.

    The velocities are None where the document gives momenta.
    """

    parameters: Mapping[str, float]
    q: Floats
    p: Floats
    v: Floats | None


@dataclass(frozen=True, slots=True, eq=False)
class EquationsOfMotion:
    """The `flow` is integrated from `start`; `observed` takes times (k) and its variables (k by m).

    It gives q and p (both k by n), H (k), and the terms of H (any number by k). `roundings` are the
    rounding errors of the flow, in units of the error of one operation. `watched` shows where something
    sudden may be. `function` makes of functions of the variables, momenta and multipliers (m) one of times
    and states that gives their values (m by k).
    """

    flow: Flow
    roundings: Flow
    start: Floats
    watched: Watched
    observed: Callable[[Floats, Floats], tuple[Floats, Floats, Floats, Floats]]
    function: Callable[[Sequence[Expr]], Callable[[Floats, Floats], Floats]]

    def values(self, functions: Sequence[Expr], times: Floats, states: Floats) -> Floats:
        """The values (m by k) of functions (m) at times and states."""
        return self.function(functions)(times, states)


@dataclass(frozen=True, slots=True, eq=False)
class SymbolicEquations:
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


def symbolic_equations(derivation: Derivation) -> SymbolicEquations:
    """Hamilton's equations, or Lagrange's where H has no closed form or there are constraints."""
    if derivation.system.constraints:
        return _with_multipliers(derivation)
    return _lagrange(derivation) if derivation.equations is None else _hamilton(derivation)


def equations_of_motion(
    derivation: Derivation,
    initial: InitialState,
    swept: tuple[str, ...] = (),
    integrands: Sequence[Expr] = (),
) -> EquationsOfMotion:
    """The equations of motion of a system, and its initial state.

    Behind its own variables come the parameters that are `swept`, as variables at rest, and the integrals of
    some functions of the state over the time.
    """
    constants = {name: value for name, value in initial.parameters.items() if name not in swept}
    made = _in_code(derivation, tuple(constants.items()), swept, tuple(integrands))
    equations, observe, flow, roundings, watched = made
    size, start = len(initial.q), equations.start(initial)
    if derivation.energy_changes:
        start = np.append(start, 0.0)
    own = [*range(2 * size), *range(len(start), len(start) + len(swept))]
    start = np.array([*start, *(initial.parameters[name] for name in swept), *(0.0 for _ in integrands)])

    def observed(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        rows = columns(observe)(times, *states[:, own].T)
        return states[:, :size], rows[:size].T, rows[size:].sum(axis=0), rows[size:]

    def function(functions: Sequence[Expr]) -> Callable[[Floats, Floats], Floats]:
        trees, arguments = [to_tree(e) for e in functions], [TIME, *equations.names, *swept]
        f = columns(code.function(trees, arguments, constants, equations.steps))
        return lambda times, states: f(times, *states[:, own].T)

    return EquationsOfMotion(flow, roundings, start, watched, observed, function)


@lru_cache(maxsize=1)
def _in_code(
    derivation: Derivation,
    parameters: tuple[tuple[str, float], ...],
    swept: tuple[str, ...],
    integrands: tuple[Expr, ...],
) -> tuple[SymbolicEquations, Flow, Flow, Flow, Watched]:
    """The equations of a system with parameter values, compiled once for all starts of an ensemble.

    Behind them are the flows of the momenta and of the terms of H, of the slopes of the variables, and of
    their rounding errors, and what is to be watched.
    """
    equations, constants = symbolic_equations(derivation), dict(parameters)
    slopes, arguments, steps = list(equations.slopes), [TIME, *equations.names], equations.steps
    observed = [to_tree(e) for e in (*equations.momenta, *equations.energy)]
    observe = code.function(observed, [*arguments, *swept], constants, steps)
    if derivation.energy_changes:
        arguments = [*arguments, ENERGY_CHANGE]
        slopes.append(to_tree(derivation.power))
    arguments += [*swept, *(f"{ENERGY_CHANGE}.{place}" for place in range(len(integrands)))]
    watching = code.watched(slopes, arguments, constants, steps, swept)
    slopes += [*(to_tree(ZERO) for _ in swept), *map(to_tree, integrands)]
    flow, roundings = (
        code.function(nodes, arguments, constants, steps) for nodes in (slopes, list(map(rounding, slopes)))
    )
    return equations, observe, flow, roundings, watching


def _hamilton(derivation: Derivation) -> SymbolicEquations:
    assert derivation.equations is not None
    assert derivation.hamiltonian is not None
    phase, slopes = derivation.phase, [to_tree(e) for e in derivation.equations]
    p, energy = [symbol(name) for name in phase.momenta], terms(derivation.hamiltonian)
    return SymbolicEquations(phase.names, slopes, p, energy)


def _lagrange(derivation: Derivation) -> SymbolicEquations:
    """Lagrange's equations for q and p where p is linear in v, else for q and v."""
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
        return SymbolicEquations(phase.names, slopes, p, energy(p), steps)
    moving = [*zip(phase.coordinates, v, strict=True), (TIME, ONE)]
    defined = dict(zip(phase.momenta, definitions, strict=True))
    steps, accelerations = solutions(
        total([substitute(f, defined), *(-derivative(p, name) * rate for name, rate in moving)])
        for f, p in zip(forces, definitions, strict=True)
    )
    names, slopes = (*phase.coordinates, *velocities), [*rates, *accelerations]
    return SymbolicEquations(names, slopes, definitions, energy(definitions), steps)


def _with_multipliers(derivation: Derivation) -> SymbolicEquations:
    """The equations for coordinates and velocities with multipliers, which are solved for in steps before."""
    lagrange, momenta, limits = derivation.lagrange, derivation.momenta, derivation.system.constraints
    assert lagrange is not None
    assert momenta is not None
    assert derivation.system.lagrangian is not None
    names, solved = derivation.velocity_names, derivation.multipliers_anywhere
    accelerations = lagrange.accelerations
    steps = [*zip(derivation.phase.momenta, map(to_tree, momenta.definitions), strict=True)]
    if solved is not None and accelerations is not None:
        steps += [(one.name, to_tree(e)) for one, e in zip(limits, solved, strict=True)]
        slopes = [to_tree(e) for e in accelerations]
    else:
        free = dict.fromkeys((one.name for one in limits), ZERO)
        made, answers = beside_constraints(
            derivation, [-substitute(e, free) for e in lagrange.rest], [-one.turning for one in limits]
        )
        slopes = answers[: len(names)]
        steps += [*made, *((one.name, -x) for one, x in zip(limits, answers[len(names) :], strict=True))]
    energy = derivation.hamiltonian if derivation.is_short else None
    parts = [p * symbol(v) for p, v in zip(momenta.definitions, names, strict=True)]
    return SymbolicEquations(
        (*derivation.phase.coordinates, *names),
        [*map(Name, names), *slopes],
        momenta.definitions,
        [*parts, *terms(-derivation.system.lagrangian)] if energy is None else terms(energy),
        steps,
    )


def beside_constraints(
    derivation: Derivation, right: Sequence[Expr], below: Sequence[Expr]
) -> tuple[list[Step], list[Node]]:
    """The linear equations at the top of the module, solved for right sides of M and of A; with steps."""
    assert derivation.momenta is not None
    slopes = [[to_tree(e) for e in one.slopes] for one in derivation.system.constraints]
    masses = [[to_tree(e) for e in row] for row in derivation.momenta.mass_matrix]
    upper = [[*row, *column] for row, column in zip(masses, zip(*slopes, strict=True), strict=True)]
    lower = [[*row, *[to_tree(ZERO)] * len(slopes)] for row in slopes]
    return solved([*upper, *lower], [to_tree(e) for e in (*right, *below)], is_definite=False)


def terms(e: Expr) -> list[Expr]:
    """The terms of a sum."""
    return [Expr({monomial: factor}) for monomial, factor in e.ordered] or [e]


def values_of_terms(e: Expr, phase: Phase, parameters: Mapping[str, float]) -> Callable[..., Floats]:
    """The terms (m by k) of a function on phase space at times (k) and values of the variables (k)."""
    return columns(code.function([to_tree(term) for term in terms(e)], [TIME, *phase.names], parameters))
