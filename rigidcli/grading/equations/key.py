"""Keys of equations of motion: from Hamilton's equations of a document, or as they are typed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.equations.determinacy import Stencil, Tried, stencil, tried
from rigidcli.grading.equations.mistakes import Mistake, mistakes
from rigidcli.grading.equations.states import POSITIVE, REAL, STATES, Motion, paired, with_derivatives
from rigidcli.grading.equations.text import Equation, equations, texts
from rigidcli.grading.expressions.formula import Domain, Vocabulary, draw
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Question
from rigidcli.grading.values import Points
from rigidcli.model.variables import acceleration, momentum, velocity
from rigidcli.symbolic.algebra.calculus import coefficients, substitute
from rigidcli.symbolic.algebra.expressions import ZERO, Expr, symbol
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.language import parser
from rigidcli.symbolic.language.tree import Name, Negative, Node, Sum
from rigidcli.symbolic.mechanics.energies import TIME
from rigidcli.symbolic.mechanics.mass_matrix import null_vectors

if TYPE_CHECKING:
    from rigidcli.report import Report


_DERIVATIVE = re.compile(r"(.+?)d?dot")

TOLERANCE = 1e-9
"""Of an equation whose question gives none, in units of its terms: a number has to be right, not near."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The motion, at states where equations are tried, and `elsewhere`, where derivatives are of none.

    `given` has parameters with their values in the document, `definitions` momenta as functions of the rates.
    The equations of a document are `hamiltonian`: asked in first order. `implied` are equations that the
    question makes true: that a velocity with a name of its own is one.
    """

    motion: Motion
    vocabulary: Vocabulary
    tolerance: float
    points: Points
    elsewhere: Points
    stencil: Stencil
    mistakes: tuple[Mistake, ...]
    given: Mapping[str, float]
    definitions: Mapping[str, Expr]
    hamiltonian: bool
    implied: tuple[Tried, ...] = ()

    def values_at(self, states: Mask | NDArray[np.int64]) -> dict[str, Floats]:
        """The values of all names at some of the states."""
        return {name: value[states] for name, value in self.points.floats.items()}


def read(asked: Asked) -> Key:
    """The key of a question. Raises ValueProblem."""
    question, told = asked.question, asked.report
    potential, given, definitions = None, dict[str, float](), dict[str, Expr]()
    motion = of_text(asked) if told is None else of_document(asked)
    if told is not None and asked.document is not None:
        given = {
            name: float(value)
            for name, value in asked.document.values.items()
            if name in motion.domains and asked.document.arithmetic.value(value) is not None
        }
        if motion.momenta == tuple(told["momenta"]):
            potential = _potential(motion, told)
            definitions = told["momentum_definitions"] or {}
    vocabulary = motion.vocabulary(told is not None or question.symbols is not None)
    points = motion.states()
    around = stencil(motion, points)
    aliases = motion.auxiliary if not motion.first_order else ()
    implied = [Sum((Name(name), Negative(motion.known[name]))) for name in aliases]
    return Key(
        motion,
        vocabulary,
        question.tolerance.relative or TOLERANCE,
        points,
        draw(vocabulary, STATES, seed=2),
        around,
        mistakes(motion, potential, points),
        given,
        definitions,
        told is not None,
        tuple(tried(node, around) for node in implied),
    )


def _potential(motion: Motion, told: Report) -> Expr | None:
    """The potential energy: what -L, or else H, is at rest."""
    of_rates = told["lagrangian"] is not None
    energy, moving = ("lagrangian", motion.middles) if of_rates else ("hamiltonian", motion.momenta)
    try:
        at_rest = substitute(told[energy], dict.fromkeys(moving, ZERO))
    except ExpressionError:
        return None
    return -at_rest if of_rates else at_rest


def of_document(asked: Asked) -> Motion:
    """The motion by the equations in a report. Raises ValueProblem."""
    assert asked.document is not None
    told: Mapping[str, Expr] | None = asked.value
    if told is None:
        raise ValueProblem("the document has no equations in closed form")
    if asked.path[-1] != "equations" or len(told) % 2:
        raise ValueProblem("this result has no equations of motion, expected `hamilton.equations`")
    names = tuple(told)
    half = len(names) // 2
    definitions = asked.document.definitions
    parameters = {
        name: definition.root for name, definition in definitions.items() if definition and definition.names
    }
    domains = _domains(asked.question, names, [name for name in definitions if name not in parameters])
    rates = {velocity(name): rate for name, rate in told.items()}
    momenta = names[half:]
    return with_derivatives(Motion(names[:half], (), momenta, rates, domains, parameters, momenta=momenta))


def _domains(question: Question, states: Sequence[str], parameters: Sequence[str]) -> dict[str, Domain]:
    domains = dict.fromkeys(states, REAL)
    domains |= dict.fromkeys([TIME, *parameters], POSITIVE)
    return domains | {name: d for name, d in (question.symbols or {}).items() if name in domains}


def of_text(asked: Asked) -> Motion:
    """The motion by equations as they are typed. Raises ValueProblem."""
    question = asked.question
    try:
        return with_derivatives(_typed(question, asked.value))
    except Unreadable as unreadable:
        # Without place and detail, which repeat what was typed: this is the key.
        raise ValueProblem(f"the equations cannot be read: {CODES[unreadable.finding.code]}") from None
    except ExpressionError as error:
        where = "" if error.column is None else f", for what stands at column {error.column} of one of them"
        raise ValueProblem(f"the equations cannot be worked with{where}") from None


def _typed(question: Question, value: Tree) -> Motion:
    found = texts(value)
    left = [parser.read(text.left)[1] for text in found]
    names = frozenset().union(*left, *(parser.read(text.right)[1] for text in found))
    labels = [text.left.strip() for text in found] if all(text.label for text in found) else []
    functions = _functions(question, names, labels)
    second = tuple(name for name in functions if acceleration(name) in names)
    aliases = {
        v: velocity(q)
        for q, v in zip(question.coordinates, question.velocities, strict=False)
        if v != velocity(q) and v not in functions
    }
    tops = {name: acceleration(name) if name in second else velocity(name) for name in functions}
    states = [*functions, *map(velocity, second)]
    known = {*states, *tops.values(), *map(velocity, functions), *aliases, TIME}
    parameters = sorted(names - known)
    if question.symbols is not None:
        if not set(parameters) <= question.symbols.keys():
            raise ValueProblem("the equations hold a symbol that is not among the `symbols`")
        parameters = [name for name in question.symbols if name not in known]
    every = dict.fromkeys([*known, *parameters, *names], REAL)
    rates = _solved(equations(value, Vocabulary(every), tops), list(tops.values()), aliases)
    domains = _domains(question, states, parameters)
    if second:
        alias: dict[str, Node] = {v: Name(name) for v, name in aliases.items()}
        alias |= {velocity(v): Name(f"{name.removesuffix('dot')}ddot") for v, name in aliases.items()}
        used = tuple(v for v, name in aliases.items() if name.removesuffix("dot") in second)
        return Motion(functions, second, used, rates, domains, known=alias)
    auxiliary = _auxiliary(question, functions, rates)
    own = tuple(name for name in functions if name not in auxiliary)
    known_momenta = {*question.momenta, *map(momentum, own)}
    momenta = auxiliary if known_momenta.issuperset(auxiliary) else ()
    return Motion(own, (), auxiliary, rates, domains, momenta=momenta)


def _functions(question: Question, names: frozenset[str], labels: Sequence[str]) -> tuple[str, ...]:
    """What moves: the names that have a derivative, or else the keys of a mapping."""
    declared = (*question.coordinates, *question.momenta)
    fixed = set(question.symbols or ()) - set(declared)
    moving = []
    for name in sorted(names):
        base = _DERIVATIVE.fullmatch(name)
        # A parameter `mdot` is no derivative, where there is no m.
        if base is not None and not (name in fixed and base[1] not in {*names, *declared, *fixed}):
            moving.append(base[1])
    if not moving and not labels:
        raise ValueProblem("the equations hold no derivative, expected names such as `xdot`")
    return tuple(dict.fromkeys((*declared, *(moving or labels))))


def _auxiliary(question: Question, functions: tuple[str, ...], rates: Mapping[str, Expr]) -> tuple[str, ...]:
    """Momenta or velocities, in the order of the other functions."""
    found = paired(functions, rates)
    for names in (question.momenta, question.velocities):
        if set(names) < set(functions) and 2 * len(names) == len(functions) and set(names) != set(found):
            return names
    return found


def _solved(found: Sequence[Equation], tops: Sequence[str], aliases: Mapping[str, str]) -> dict[str, Expr]:
    """The derivatives for which linear equations can be solved. Raises ValueProblem."""
    respelled = {name: symbol(meant) for name, meant in aliases.items()}
    rows: list[list[Expr]] = []
    for equation in found:
        parts = coefficients(substitute(from_tree(equation.residual), respelled), tops)
        if parts is None or any(sum(powers) > 1 for powers in parts):
            raise ValueProblem("the equations are not linear in the derivatives")
        units = [tuple(int(i == place) for i in range(len(tops))) for place in range(len(tops))]
        rows.append([parts.get(powers, ZERO) for powers in (*units, (0,) * len(tops))])
    if len(rows) != len(tops):
        raise ValueProblem(f"{len(rows)} equations do not go with {len(tops)} unknown functions of the time")
    vectors = null_vectors([*rows, [ZERO] * (len(tops) + 1)])
    if len(vectors) != 1 or vectors[0][-1] != 1:
        raise ValueProblem("the equations do not determine the derivatives")
    return dict(zip(tops, vectors[0], strict=False))
