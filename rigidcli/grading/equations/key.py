"""Keys of equations of motion: from Hamilton's equations of a document, or as they are typed."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.matrices import null_vectors
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import acceleration, momentum, velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.equations.motion import Motion, paired, with_derivatives
from rigidcli.grading.equations.text import Equation, equations, texts
from rigidcli.grading.expressions.formula import Domain, Vocabulary
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import RELATIVE, Question
from rigidcli.language import parser
from rigidcli.mechanics.energies import TIME

if TYPE_CHECKING:
    from rigidcli.report import Report

_DERIVATIVE = re.compile(r"(.+?)d?dot")


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The motion, and what is asked of equations.

    They are of any `form`, or must be of the first order; a mistake may be one of equations of the second
    only. A `tolerance` is of their numbers. `given` has parameters with their values in the document. The
    equations of a document are `hamiltonian`: told in first order. `definitions` has momenta as functions of
    the rates, `potential` the potential energy, as far as they are known.
    """

    motion: Motion
    vocabulary: Vocabulary
    tolerance: float
    hamiltonian: bool
    form: Literal["any", "first_order", "second_order"] = "any"
    given: Mapping[str, Fraction] = field(default_factory=dict)
    definitions: Mapping[str, Expr] = field(default_factory=dict)
    potential: Expr | None = None

    def with_numbers(self, names: Sequence[str], tolerance: float) -> Key:
        """The key of answers in which these parameters may have their values."""
        fixed = {name: self.given[name] for name in names}
        return replace(self, motion=replace(self.motion, fixed=fixed), tolerance=tolerance)


def read(asked: Asked) -> Key:
    """The key of a question. Raises ValueProblem."""
    question, told = asked.question, asked.report
    motion = _of_text(asked) if told is None else _of_document(asked)
    rates = "".join(e.key for e in motion.rates.values())
    motion = replace(motion, seed=f"{asked.name} {zlib.crc32(rates.encode())}")
    if question.form == "first_order" and not motion.first_order:
        raise ValueProblem("the equations are of second order, and first order is asked for")
    key = Key(
        motion,
        motion.vocabulary(told is not None or question.symbols is not None),
        question.tolerance.relative or 0.0,
        told is not None,
        question.form,
        _given(asked, motion),
    )
    if told is not None and motion.momenta == tuple(told["momenta"]):
        definitions = told["momentum_definitions"] or {}
        key = replace(key, definitions=definitions, potential=_potential(motion, told))
    if question.numbers == "allowed":
        key = key.with_numbers(tuple(key.given), question.tolerance.relative or RELATIVE)
    return key


def _given(asked: Asked, motion: Motion) -> dict[str, Fraction]:
    """The parameters with their values, as decimals have them."""
    if asked.document is None:
        return {}
    values = {name: asked.document.arithmetic.value(x) for name, x in asked.document.values.items()}
    return {
        name: Fraction(repr(float(x)))
        for name, x in values.items()
        if x is not None and name in motion.domains
    }


def _potential(motion: Motion, told: Report) -> Expr | None:
    """The potential energy: what -L, or else H, is at rest."""
    of_rates = told["lagrangian"] is not None
    energy, moving = ("lagrangian", motion.middles) if of_rates else ("hamiltonian", motion.momenta)
    try:
        at_rest = substitute(told[energy], dict.fromkeys(moving, ZERO))
    except ExpressionError:
        return None
    return motion.exact(to_tree(-at_rest if of_rates else at_rest))


def _of_document(asked: Asked) -> Motion:
    """The motion by the equations in a report. Raises ValueProblem."""
    document, told = asked.document, asked.value
    assert document is not None
    if told is None:
        raise ValueProblem("the document has no equations in closed form")
    if asked.path[-1] != "equations" or len(told) % 2:
        raise ValueProblem("this result has no equations of motion, expected `hamilton.equations`")
    names = tuple(told)
    half = len(names) // 2
    derived = {name: each.root for name, each in document.definitions.items() if each and each.names}
    parameters = [name for name in document.definitions if name not in derived]
    values = {name: document.arithmetic.value(x) for name, x in document.values.items()}
    domains = _domains(asked.question, names, parameters)
    domains |= {name: "real" for name in parameters if (values.get(name) or 1) < 0}
    symbols = {name: symbol(name, domain == "positive") for name, domain in domains.items()}
    for name, root in derived.items():
        symbols[name] = from_tree(root, symbols)
    rates = {velocity(name): rate for name, rate in told.items()}
    momenta = names[half:]
    known = {name: symbols[name] for name in derived}
    return with_derivatives(Motion(names[:half], (), momenta, rates, domains, known, momenta=momenta))


def _domains(question: Question, states: Sequence[str], parameters: Sequence[str]) -> dict[str, Domain]:
    domains: dict[str, Domain] = dict.fromkeys(states, "real")
    domains |= dict.fromkeys([TIME, *parameters], "positive")
    return domains | {name: d for name, d in (question.symbols or {}).items() if name in domains}


def _of_text(asked: Asked) -> Motion:
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
    every: dict[str, Domain] = dict.fromkeys([*known, *parameters, *names], "real")
    rates = _solved(equations(value, Vocabulary(every), tops), list(tops.values()), aliases)
    domains = _domains(question, states, parameters)
    if second:
        used = {v: name for v, name in aliases.items() if name.removesuffix("dot") in second}
        known_too = {v: symbol(name) for v, name in used.items()}
        known_too |= {velocity(v): symbol(f"{name.removesuffix('dot')}ddot") for v, name in used.items()}
        return Motion(functions, second, tuple(used), rates, domains, known=known_too)
    auxiliary = _auxiliary(question, functions, rates)
    own = tuple(name for name in functions if name not in auxiliary)
    momenta = auxiliary if {*question.momenta, *map(momentum, own)}.issuperset(auxiliary) else ()
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
