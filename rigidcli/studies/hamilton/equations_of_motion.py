"""The equations of motion of an orbit, and how it keeps constraints.

Where H has a closed form, and there are no constraints, these are Hamilton's equations. Otherwise they are
those of Lagrange, and the velocities are variables. Where the accelerations a and the multipliers have no
closed form, they solve a system of linear equations: A is the matrix of the slopes of the constraints, r and
c are what else stands in Lagrange's equations and in the differentiated constraints.

    [ M  -A^T] [  a   ]   [-r]
    [-A    0 ] [lambda] = [ c]

An orbit drifts away from the constraints by the errors of its steps. So each step ends with one of Newton's
steps back, which is the shortest one as M measures lengths:

    [ M  -A^T] [dq]   [0]                    [ M  -A^T] [dv]   [   0   ]
    [-A    0 ] [ .] = [f(q, t)],  then       [-A    0 ] [ .] = [A v + b],     q -> q + dq,  v -> v + dv.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, section IV.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import EPS, Array, Floats
from rigidcli.core.kicks import Watched
from rigidcli.core.solution import Flow, Function, Solution, State, columns
from rigidcli.language import code
from rigidcli.language.code import Step, solved
from rigidcli.language.tree import Name, Node, rounding
from rigidcli.mechanics.lagrange_equations import Constraint
from rigidcli.mechanics.phase_space import TIME
from rigidcli.studies.hamilton.derivation import Derivation

# The integral of dH/dt, which is a further variable where H changes: by the time, or by forces.
# No name of a document has a dot.
ENERGY_CHANGE = ".energy_change"
# Values of functions (any number by k) at times (k) and states (k by m).
Values: TypeAlias = Callable[[Floats, Floats], Floats]


class InitialState(NamedTuple):
    """The values of the parameters, and coordinates q, momenta p and velocities v (all n) at t = 0.

    The velocities are None where the document gives momenta.
    """

    parameters: Mapping[str, float]
    q: Floats
    p: Floats
    v: Floats | None


class Samples(NamedTuple):
    """An orbit at `times` (k), where the variables that are integrated have the `states` (k by m).

    The `values` (k each) of coordinates, momenta, H and further functions stand by their keys; the `sizes` (k
    each) are the sums of the sizes of their terms.
    """

    times: Floats
    states: Floats
    values: dict[str, Floats]
    sizes: dict[str, Floats]

    def columns(self, keys: Iterable[str]) -> Floats:
        """The values (k by any) that have these keys, one of which may be that of the time."""
        return np.column_stack([self.times if key == TIME else self.values[key] for key in keys])


class EquationsOfMotion(NamedTuple):
    """The equations in `symbols`, for some values of the parameters, as a `flow` of m `variables`.

    Behind the 2 n variables of the symbols come the integral of dH/dt, where H changes, the integrals of
    other functions over the time, and swept parameters, as variables at rest. `roundings` are the rounding
    errors of the flow, in units of the error of one operation. `watched` shows where something sudden may be.
    """

    symbols: SymbolicEquations
    constants: Mapping[str, float]
    variables: Sequence[str]
    flow: Flow
    roundings: Flow
    watched: Watched

    def start(self, initial: InitialState) -> Floats:
        """The initial values of the variables (m)."""
        own = self.symbols.start(initial)
        # What is no parameter is an integral, which begins at zero.
        return np.array([*own, *(initial.parameters.get(name, 0.0) for name in self.variables[len(own) :])])

    def function(self, functions: Iterable[Expr]) -> Values:
        """Functions (any number) of the state, momenta and multipliers, by times and states."""
        values = compiled(functions, self.variables, self.constants, self.symbols.steps)
        return lambda times, states: values(times, *states.T)

    @property
    def integrals(self) -> list[int]:
        """The places of the variables that are integrals of other functions over the time."""
        return [k for k, name in enumerate(self.variables) if name.startswith(f"{ENERGY_CHANGE}.")]

    def gained(self, states: Floats) -> Floats:
        """The integral of dH/dt at states (k by m)."""
        size = len(self.symbols.names)
        return states[:, size] if ENERGY_CHANGE in self.variables else np.zeros(len(states))

    def lost_in_slopes(
        self, times: Floats, states: Floats, scale: Floats, steps: Array, span: float
    ) -> float:
        """The error that rounding in the slopes makes, in units of the sizes `scale` (2 n by m) of variables.

        The states (k by any) are those of m orbits one after the other, in so many `steps` (m) over a `span`.
        Two solutions share this error, so that they do not show it. It has either sign in each step.
        """
        slopes = columns(self.roundings)(times, *states.T)[: len(scale)]
        errors = slopes.reshape(*scale.shape, -1).mean(axis=2) / scale / np.sqrt(np.maximum(steps, 1))
        return EPS * span * float(errors.max(initial=0.0))

    def observer(self, further: Mapping[str, Sequence[Expr]]) -> Callable[[Floats, Floats], Samples]:
        """Samples of an orbit, with the terms of `further` functions, by times (k) and states (k by m)."""
        momenta = {f"p.{name}": [p] for name, p in self.symbols.momenta.items()}
        coordinates = {f"q.{name}": [symbol(name)] for name in self.symbols.names[: len(momenta)]}
        parts = {**coordinates, **momenta, "H": terms(self.symbols.energy), **further}
        function, ends = self.function(chain(*parts.values())), np.cumsum([*map(len, parts.values())])[:-1]

        def observe(times: Floats, states: Floats) -> Samples:
            rows = dict(zip(parts, np.split(function(times, states), ends), strict=True))
            sizes = {key: np.abs(row).sum(axis=0) for key, row in rows.items()}
            return Samples(times, states, {key: row.sum(axis=0) for key, row in rows.items()}, sizes)

        return observe


class SymbolicEquations(NamedTuple):
    """The equations of motion of 2 n variables in symbols: of coordinates, and of momenta or velocities.

    `slopes` are their derivatives by time; the momenta (n), by their names, and H, the `energy`, follow from
    them. All of these come after `steps`.
    """

    names: tuple[str, ...]
    slopes: Sequence[Node]
    momenta: Mapping[str, Expr]
    energy: Expr
    steps: Sequence[Step] = ()

    def start(self, initial: InitialState) -> Floats:
        """The initial values of the variables (2 n)."""
        follows_momenta = self.names[len(initial.q) :] == tuple(self.momenta)
        others = initial.p if follows_momenta or initial.v is None else initial.v
        return np.concatenate([initial.q, others])


def symbolic_equations(derivation: Derivation) -> SymbolicEquations:
    """Hamilton's equations, or Lagrange's where H has no closed form or there are constraints."""
    if derivation.system.constraints or derivation.equations is None or derivation.hamiltonian is None:
        return _lagrange(derivation)
    phase, slopes = derivation.phase, [to_tree(e) for e in derivation.equations]
    p = {name: symbol(name) for name in phase.momenta}
    return SymbolicEquations(phase.names, slopes, p, derivation.hamiltonian)


@lru_cache(maxsize=1)
def equations_of_motion(
    derivation: Derivation,
    parameters: tuple[tuple[str, float], ...],
    swept: tuple[str, ...] = (),
    integrands: tuple[Expr, ...] = (),
) -> EquationsOfMotion:
    """The equations of motion of a system with these values of its parameters but those that are `swept`.

    They are compiled once for all starts of an ensemble.
    """
    symbols = symbolic_equations(derivation)
    constants = {name: value for name, value in parameters if name not in swept}
    slopes, variables, steps = list(symbols.slopes), list(symbols.names), symbols.steps
    if derivation.energy_changes:
        variables.append(ENERGY_CHANGE)
        slopes.append(to_tree(derivation.power))
    variables += [*(f"{ENERGY_CHANGE}.{place}" for place in range(len(integrands))), *swept]
    watched = code.watched(slopes, [TIME, *variables], constants, steps, swept)
    slopes += [*map(to_tree, integrands), *(to_tree(ZERO) for _ in swept)]
    flow, roundings = (
        code.function(trees, [TIME, *variables], constants, steps)
        for trees in (slopes, list(map(rounding, slopes)))
    )
    return EquationsOfMotion(symbols, constants, variables, flow, roundings, watched)


def _lagrange(derivation: Derivation) -> SymbolicEquations:
    """Lagrange's equations for coordinates and velocities; multipliers are solved for in steps before."""
    lagrange, limits, momenta = derivation.lagrange, derivation.system.constraints, derivation.definitions
    assert lagrange is not None
    names, multipliers = derivation.velocity_names, derivation.multipliers_anywhere
    steps = [(name, to_tree(p)) for name, p in momenta.items()]
    if multipliers is not None and lagrange.accelerations is not None:
        solutions = [*map(to_tree, lagrange.accelerations), *map(to_tree, multipliers)]
    else:
        free = dict.fromkeys((one.name for one in limits), ZERO)
        forces = [-substitute(e, free) for e in lagrange.rest]
        more, solutions = beside_constraints(derivation, forces, [one.turning for one in limits])
        steps += more
    steps += zip((one.name for one in limits), solutions[len(names) :], strict=True)
    slopes = [*map(Name, names), *solutions[: len(names)]]
    energy = derivation.hamiltonian if derivation.is_short else derivation.energy_of_velocities
    assert energy is not None
    variables = (*derivation.phase.coordinates, *names)
    return SymbolicEquations(variables, slopes, momenta, energy, steps)


def beside_constraints(
    derivation: Derivation, right: Sequence[Expr], below: Sequence[Expr]
) -> tuple[list[Step], list[Node]]:
    """The linear equations at the top of the module, solved for right sides of M and of -A; with steps."""
    limits = derivation.system.constraints
    rows = [
        [*row, *(-one.slopes[place] for one in limits)]
        for place, row in enumerate(derivation.momenta.mass_matrix)
    ]
    rows += [[*(-e for e in one.slopes), *[ZERO] * len(limits)] for one in limits]
    matrix = [[to_tree(e) for e in row] for row in rows]
    return solved(matrix, [to_tree(e) for e in (*right, *below)], is_definite=not limits)


def terms(e: Expr) -> list[Expr]:
    """The terms of a sum."""
    return [Expr({monomial: factor}) for monomial, factor in e.ordered] or [e]


def compiled(
    functions: Iterable[Expr],
    variables: Sequence[str],
    constants: Mapping[str, float],
    steps: Sequence[Step] = (),
) -> Callable[..., Floats]:
    """The values (m by k) of functions (m) at times (k) and values of the variables (k each)."""
    return columns(code.function([to_tree(e) for e in functions], [TIME, *variables], constants, steps))


# --- constraints


def way_back(derivation: Derivation, constants: Mapping[str, float]) -> Callable[[float, State], State]:
    """A function that moves a state at a time to the constraints by one of Newton's steps.

    A state has coordinates, then velocities; what else is in it stays.
    """
    limits, q, v = derivation.system.constraints, derivation.phase.coordinates, derivation.velocity_names

    def moved(names: Sequence[str], misses: Sequence[Expr]) -> Function:
        """The state after a step of the variables with these names."""
        steps, answers = beside_constraints(derivation, [ZERO] * len(q), misses)
        nearer = {name: Name(name) + d for name, d in zip(names, answers, strict=False)}
        after = [nearer.get(name, Name(name)) for name in (*q, *v)]
        return code.function(after, [TIME, *q, *v], constants, steps)(math)

    places = moved(q, [ZERO if one.has_velocities else one.expression for one in limits])
    rates, size = moved(v, [one.rate for one in limits]), len(q) + len(v)
    return lambda t, state: (*rates(t, *places(t, *state[:size])), *state[size:])


def parts_of(limit: Constraint, coordinates: Sequence[str], rate: bool = False) -> list[Expr]:
    """The terms of a constraint, or of its rate, whose sizes tell how well it is kept.

    A single term that vanishes has no size: the slopes times the coordinates stand beside it with both signs.
    """
    if rate or limit.has_velocities:
        return terms(limit.rate)
    moved = [a * symbol(name) for a, name in zip(limit.slopes, coordinates, strict=True)]
    return [*terms(limit.expression), *moved, *(-e for e in moved)]


def sizes_of_pushes(derivation: Derivation, motion: EquationsOfMotion, solution: Solution) -> Floats:
    """What the forces of the constraints do to coordinates and velocities in a step of a solution (2 n).

    A velocity that a constraint keeps at zero is rounding: large forces cancel in it.
    """
    masses, limits = derivation.momenta.mass_matrix, derivation.system.constraints
    inertia = [row[place] for place, row in enumerate(masses)]
    if not all(inertia):
        return np.zeros(2 * len(masses))
    pushes = [one.multiplier * a / m for one in limits for a, m in zip(one.slopes, inertia, strict=True)]
    found = np.abs(motion.function(pushes)(solution.knots, solution.at(solution.knots)))
    gained = found.reshape(len(limits), len(masses), -1).sum(axis=0).max(axis=1)
    step = float(solution.knots[-1]) / max(1, solution.steps)
    sizes: Floats = np.nan_to_num(np.concatenate([gained * step**2, gained * step]))
    return sizes
