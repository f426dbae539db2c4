"""The equations of motion of an orbit, how it starts and keeps constraints, and the equations as a program.

Where H has a closed form, these are Hamilton's equations. Where it has none, but the velocities follow from
linear equations M(q, t) v = p - b(q, t), these are solved at every step, and p' = dL/dq. Otherwise the
velocities themselves are variables: M v' = dL/dq - (dp/dq) v - dp/dt.

With constraints, too, the velocities are variables. Where the multipliers have no closed form, they and the
accelerations a solve a system of linear equations: A is the matrix of the slopes of the constraints, r and c
are what else stands in Lagrange's equations and in the differentiated constraints.

    [M  A^T] [   a   ]   [-r]
    [A   0 ] [-lambda] = [-c]

An orbit drifts away from the constraints by the errors of its steps. So each step ends with one of Newton's
steps back, which is the shortest one as M measures lengths:

    [M  A^T] [dq]   [0]                    [M  A^T] [dv]   [   0   ]
    [A   0 ] [ .] = [f(q, t)],  then       [A   0 ] [ .] = [A v + b],     q -> q - dq,  v -> v - dv.

Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, section IV.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.kicks import Watched
from rigidcli.core.solution import NO_VALUE, Flow, Function, Solution, State, columns
from rigidcli.document.document import Document
from rigidcli.errors import ComputationError, DocumentError, ExpressionError, Problem
from rigidcli.language import code
from rigidcli.language.code import Step, shared, solved
from rigidcli.language.tree import Name, Node, rounding
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.lagrange_equations import Constraint
from rigidcli.mechanics.legendre import canonical_momenta
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Program, Run
from rigidcli.studies.hamilton.derivation import Derivation, on_this_side
from rigidcli.studies.hamilton.system import require_formulas

if TYPE_CHECKING:
    from rigidcli.studies.hamilton import Findings

# The integral of dH/dt, which is a further variable where H changes: by the time, or by forces.
# No name of a document has a dot.
ENERGY_CHANGE = ".energy_change"
# The key under which a document gives the initial state.
INITIAL_KEY = "orbit.initial"
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
# A remark in programs of systems with constraints, whose steps do not end with a way back to them.
DRIFTS = "the constraints are differentiated: by the errors of its steps, the orbit drifts away from them"
# The least size of a variable that its errors are measured by, in units of the terms of its rate.
# A variable that stays zero only as large numbers cancel is noise, about 1e-16 of these: no program can
# follow it with errors of 1e-12 of its own size.
LEAST_SIZE = 1e-3
# The relative step of a finite difference that shows the size of the terms of a rate.
NUDGE = 1e-6
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
    """An orbit at `times` (k): coordinates and momenta (both k by n), H (k), and the terms of H (any by k).

    The `states` (k by m) have the variables that are integrated, `further` functions (k) stand by their keys.
    """

    times: Floats
    coordinates: Floats
    momenta: Floats
    energy: Floats
    energy_terms: Floats
    states: Floats
    further: dict[str, Floats]


class EquationsOfMotion(NamedTuple):
    """The equations in `symbols`, for some values of the parameters, as a `flow` of m `variables`.

    Behind the 2 n variables of the symbols come the integral of dH/dt, where H changes, swept parameters, as
    variables at rest, and the integrals of other functions over the time. `roundings` are the rounding errors
    of the flow, in units of the error of one operation. `watched` shows where something sudden may be.
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
        steps, known = [*self.symbols.steps], {*self.variables, *dict(self.symbols.steps)}
        steps += [(name, to_tree(p)) for name, p in self.symbols.momenta.items() if name not in known]
        values = compiled(functions, self.variables, self.constants, steps)
        return lambda times, states: values(times, *states.T)

    @property
    def integrals(self) -> list[int]:
        """The places of the variables that are integrals of other functions over the time."""
        return [k for k, name in enumerate(self.variables) if name.startswith(f"{ENERGY_CHANGE}.")]

    def gained(self, states: Floats) -> Floats:
        """The integral of dH/dt at states (k by m)."""
        size = len(self.symbols.names)
        return states[:, size] if ENERGY_CHANGE in self.variables else np.zeros(len(states))

    def observer(self, further: Mapping[str, Expr]) -> Callable[[Floats, Floats], Samples]:
        """Samples of an orbit, with `further` functions, by times (k) and states (k by m)."""
        momenta, energy = self.symbols.momenta.values(), self.symbols.energy
        function, size = self.function([*momenta, *energy, *further.values()]), len(momenta)

        def observe(times: Floats, states: Floats) -> Samples:
            p, parts, rows = np.split(function(times, states), [size, size + len(energy)])
            named = dict(zip(further, rows, strict=True))
            return Samples(times, states[:, :size], p.T, parts.sum(axis=0), parts, states, named)

        return observe


class SymbolicEquations(NamedTuple):
    """The equations of motion of 2 n variables in symbols: of coordinates, and of momenta or velocities.

    `slopes` are their derivatives by time; the momenta (n), by their names, and the terms of H, `energy`,
    follow from them. All of these come after `steps`.
    """

    names: tuple[str, ...]
    slopes: Sequence[Node]
    momenta: Mapping[str, Expr]
    energy: Sequence[Expr]
    steps: Sequence[Step] = ()

    def start(self, initial: InitialState) -> Floats:
        """The initial values of the variables (2 n)."""
        follows_momenta = self.names[len(initial.q) :] == tuple(self.momenta)
        others = initial.p if follows_momenta or initial.v is None else initial.v
        return np.concatenate([initial.q, others])


def symbolic_equations(derivation: Derivation) -> SymbolicEquations:
    """Hamilton's equations, or Lagrange's where H has no closed form or there are constraints."""
    if derivation.system.constraints:
        return _with_multipliers(derivation)
    if derivation.equations is None or derivation.hamiltonian is None:
        return _lagrange(derivation)
    phase, slopes = derivation.phase, [to_tree(e) for e in derivation.equations]
    p = {name: symbol(name) for name in phase.momenta}
    return SymbolicEquations(phase.names, slopes, p, terms(derivation.hamiltonian))


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
    variables += [*swept, *(f"{ENERGY_CHANGE}.{place}" for place in range(len(integrands)))]
    watched = code.watched(slopes, [TIME, *variables], constants, steps, swept)
    slopes += [*(to_tree(ZERO) for _ in swept), *map(to_tree, integrands)]
    flow, roundings = (
        code.function(trees, [TIME, *variables], constants, steps)
        for trees in (slopes, list(map(rounding, slopes)))
    )
    return EquationsOfMotion(symbols, constants, variables, flow, roundings, watched)


def _lagrange(derivation: Derivation) -> SymbolicEquations:
    """Lagrange's equations for q and p where p is linear in v, else for q and v."""
    phase, velocities, lagrangian = derivation.phase, derivation.velocity_names, derivation.system.lagrangian
    assert lagrangian is not None
    matrix, defined = derivation.momenta.mass_matrix, derivation.definitions
    pairs = zip(phase.coordinates, derivation.system.forces, strict=True)
    forces = [derivative(lagrangian, q) + force for q, force in pairs]
    rates: list[Node] = [Name(name) for name in velocities]

    def solutions(right: Iterable[Expr]) -> tuple[list[Step], list[Node]]:
        return solved([[to_tree(e) for e in row] for row in matrix], [to_tree(e) for e in right])

    if derivation.are_linear:
        p, at_rest = {name: symbol(name) for name in phase.momenta}, dict.fromkeys(velocities, ZERO)
        steps, v_of_p = solutions(p[name] - substitute(e, at_rest) for name, e in defined.items())
        steps += zip(velocities, v_of_p, strict=True)
        slopes = [*rates, *map(to_tree, forces)]
        return SymbolicEquations(phase.names, slopes, p, _energy(derivation, p), steps)
    moving = [*zip(phase.coordinates, map(symbol, velocities), strict=True), (TIME, ONE)]
    steps, accelerations = solutions(
        total([substitute(f, defined), *(-derivative(p, name) * rate for name, rate in moving)])
        for f, p in zip(forces, defined.values(), strict=True)
    )
    names, slopes = (*phase.coordinates, *velocities), [*rates, *accelerations]
    return SymbolicEquations(names, slopes, defined, _energy(derivation, defined), steps)


def _energy(derivation: Derivation, momenta: Mapping[str, Expr]) -> list[Expr]:
    """The terms of H = sum p v - L."""
    assert derivation.system.lagrangian is not None
    pairs = zip(momenta.values(), derivation.velocity_names, strict=True)
    return [*(p * symbol(v) for p, v in pairs), *terms(-derivation.system.lagrangian)]


def _with_multipliers(derivation: Derivation) -> SymbolicEquations:
    """The equations for coordinates and velocities with multipliers, which are solved for in steps before."""
    lagrange, limits, momenta = derivation.lagrange, derivation.system.constraints, derivation.definitions
    assert lagrange is not None
    names, solved = derivation.velocity_names, derivation.multipliers_anywhere
    accelerations = lagrange.accelerations
    steps = [(name, to_tree(p)) for name, p in momenta.items()]
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
    h = derivation.hamiltonian if derivation.is_short else None
    energy = _energy(derivation, momenta) if h is None else terms(h)
    variables = (*derivation.phase.coordinates, *names)
    return SymbolicEquations(variables, [*map(Name, names), *slopes], momenta, energy, steps)


def beside_constraints(
    derivation: Derivation, right: Sequence[Expr], below: Sequence[Expr]
) -> tuple[list[Step], list[Node]]:
    """The linear equations at the top of the module, solved for right sides of M and of A; with steps."""
    slopes = [[to_tree(e) for e in one.slopes] for one in derivation.system.constraints]
    masses = [[to_tree(e) for e in row] for row in derivation.momenta.mass_matrix]
    upper = [[*row, *column] for row, column in zip(masses, zip(*slopes, strict=True), strict=True)]
    lower = [[*row, *[to_tree(ZERO)] * len(slopes)] for row in slopes]
    return solved([*upper, *lower], [to_tree(e) for e in (*right, *below)], is_definite=False)


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
        nearer = {name: Name(name) - d for name, d in zip(names, answers, strict=False)}
        after = [nearer.get(name, Name(name)) for name in (*q, *v)]
        return code.function(after, [TIME, *q, *v], constants, steps)(math)

    places = moved(q, [ZERO if one.has_velocities else one.expression for one in limits])
    rates, size = moved(v, [one.rate for one in limits]), len(q) + len(v)
    return lambda t, state: (*rates(t, *places(t, *state[:size])), *state[size:])


def misses(
    derivation: Derivation, constants: Mapping[str, float], times: Floats, states: Floats, rates: bool = False
) -> Floats:
    """How far off each constraint is, or its rate, at times (k) and states (k by 2 n): (m by k).

    It is in units of the largest sum of the sizes of its terms, or of its slopes times the coordinates.
    """
    q, rows = derivation.phase.coordinates, []
    for one in derivation.system.constraints:
        parts = terms(one.rate if rates else one.expression)
        is_rate = rates or one.expression == one.rate
        moved = [] if is_rate else [a * symbol(name) for a, name in zip(one.slopes, q, strict=True)]
        function = compiled([*parts, *moved], [*q, *derivation.velocity_names], constants)
        values = function(times, *states.T)
        sizes = [np.abs(part).sum(axis=0).max() for part in np.split(values, [len(parts)])]
        rows.append(values[: len(parts)].sum(axis=0) / (max(sizes) or 1.0))
    return np.array(rows)


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


# --- the start


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
    if v is None and (limits or not (derivation.branches or derivation.are_linear)):
        if derivation.rates:
            v = point.evaluate([*derivation.rates.values()], "a velocity")
        else:
            v, notes = _solved(point, derivation, p, "velocities")
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
            f = code.function([to_tree(e) for e in expressions], list(self.known), {})(math)
            values = np.array(f(*self.known.values()), dtype=np.float64)
        except NO_VALUE:
            values = np.array([math.nan])
        if not np.isfinite(values).all():
            raise self.document.refusal(f"{what} has no finite real value there", INITIAL_KEY)
        return values


def _momenta(point: _Point, derivation: Derivation, v: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The momenta (n) from the velocities: by definition, or from v = dH/dp where H is given; with notes."""
    if not derivation.definitions:
        return _solved(point, derivation, v, "momenta")
    there = point.at(derivation.velocity_names, v)
    return there.evaluate(derivation.momenta.definitions, "a momentum"), ()


def _solved(
    point: _Point, derivation: Derivation, target: Floats, kind: Literal["velocities", "momenta"]
) -> tuple[Floats, tuple[str, ...]]:
    """Velocities (n) with these momenta, or momenta with these velocities, by a search from zero; with notes.

    Raises DocumentError where nothing is found.
    """
    functions, names = derivation.momenta, derivation.velocity_names
    given, one = "momenta", "a momentum"
    if kind == "momenta":
        names, (given, one) = derivation.phase.momenta, ("velocities", "a velocity")
        functions = canonical_momenta(derivation.generator, names)
    size, slopes = len(target), [e for row in functions.mass_matrix for e in row]

    def miss(values: Floats) -> tuple[Floats, Floats]:
        there = point.at(names, values).evaluate([*functions.definitions, *slopes], one)
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

    def off(state: Floats, rates: bool = False) -> Floats:
        return np.abs(misses(derivation, parameters, ZEROS, state[None], rates)[:, 0])

    back, nearest = way_back(derivation, parameters), tuple(start.tolist())
    with suppress(*NO_VALUE):
        for _ in range(NEWTON_STEPS):
            nearest = tuple(back(0.0, nearest))
    moved = np.array(nearest)
    is_found = np.isfinite(moved).all() and off(moved).max() < START_MISSES
    names = (*derivation.phase.coordinates, *derivation.velocity_names)
    near = ", ".join(f"{name}: {x:.12g}" for name, x in zip(names, moved, strict=True))
    hint = f"the nearest start that obeys all constraints is {{{near}}}" if is_found else None
    problems, typed = list[Problem](), (document.system and document.system.constraints) or {}
    for one, miss, miss_of_rate in zip(limits, off(start), off(start, rates=True), strict=True):
        # A miss that is not a number breaks the constraint, too.
        if miss <= START_MISSES and miss_of_rate <= START_MISSES:
            continue
        e = one.expression if not miss <= START_MISSES else one.rate
        value = e.evaluate(**point.known)
        what = f"the start breaks `{one.name}`, {typed[one.name].expression.text}: it is off by {value:.6g}"
        if miss <= START_MISSES and not one.has_velocities:
            what = f"the velocities at the start break `{one.name}`: {e} is {value:.6g}, expected 0"
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


# --- the program


def program_of(findings: Findings, name: str) -> Program:
    """The program of a system with this `name`: its rates, H, and momenta where velocities are followed.

    Raises DocumentError where a function has no formula, and ComputationError where H has steps, which its
    equations do not tell, or a number is too large for floats.
    """
    document, derivation, initial = findings.document, findings.derivation, findings.initial
    require_formulas(document, [derivation.generator, *derivation.system.forces], "a program")
    for place in derivation.jumps:
        raise ComputationError(f"H has a step where {place} = 0, which its equations do not tell")
    equations, phase, system = symbolic_equations(derivation), derivation.phase, derivation.system
    asked = {name: [to_tree(e)] for name, e in equations.momenta.items() if name not in equations.names}
    asked["H"] = [to_tree(total(equations.energy))]
    asked |= {one.name: [to_tree(one.multiplier)] for one in system.constraints}
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
    about += [f"{one.name}: {one.expression} = 0" for one in system.constraints]
    about += [DRIFTS] if system.constraints else []
    forces = zip(phase.coordinates, system.forces, strict=True)
    about += [f"the force on {q} is {force}" for q, force in forces if not force.is_zero]
    run = None
    if initial is not None and findings.orbit is not None:
        motion = equations_of_motion(derivation, tuple(initial.parameters.items()))
        samples, steps = findings.orbit.samples, findings.orbit.steps
        run = Run(equations.start(initial).tolist(), _sizes(samples, steps, motion), samples.times)
    shown = (TIME, *phase.names, *list(asked)[-1 - len(system.constraints) :])
    return Program(about, constants, TIME, equations.names, rates, quantities, shown, run)


def _sizes(samples: Samples, steps: int, motion: EquationsOfMotion) -> list[float]:
    """The sizes of the variables of an orbit in so many steps, in three digits; none is zero."""
    rates, times, states = columns(motion.flow), samples.times, samples.states
    # Each variable is changed differently, so that equal ones do not cancel.
    nudged = states * (1 + NUDGE * np.linspace(1.0, 2.0, states.shape[1]))
    changes = np.abs(rates(times, *nudged.T) - rates(times, *states.T)).max(axis=1) / NUDGE
    between = times[-1] / min(len(times), steps or 1)
    sizes = np.fmax(np.abs(states).max(axis=0), LEAST_SIZE * changes * between)
    return [float(f"{size:.3g}") or 1.0 for size in sizes[: len(motion.symbols.names)]]
