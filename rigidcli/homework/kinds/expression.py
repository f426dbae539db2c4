"""Formulas: right where they are the same function as the key, or conserved as the key is, in any form.

Where the key is an energy, H or L, a constant may be added: it does not change the motion.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.parameters import TIME
from rigidcli.document.phase_space import velocity
from rigidcli.errors import ValueProblem
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import Ruler, chosen
from rigidcli.homework.mistakes import common_factor
from rigidcli.homework.question import OF_FORMULAS, Tolerance
from rigidcli.homework.reading import names_of, read_expression, read_expressions
from rigidcli.homework.same import LEAST_POINTS, Ball, FormulaComparison, formulas_of
from rigidcli.language.text import text, without_doubt
from rigidcli.language.tree import ZERO, Name, Negative, Node, Number, Product, Sum, bound, names_in
from rigidcli.language.words import said

ENERGIES = ("hamiltonian", "lagrangian", "energy")  # last names of results to which a constant may be added
FACTOR_ERROR = 1e-12  # the relative error of a factor that is read from the values of formulas

HALF, TWO = Number("0.5", 0.5), Number("2", 2.0)


@dataclass(frozen=True, eq=False)
class FormulaKey:
    """The right formula, and what may stand in an answer.

    A `constant` may differ. `rates` are momenta or velocities, in which an energy is T + V (or T - V, where
    it `is_lagrangian`). In a Hamiltonian, velocities are `misplaced`. The names in `tied` are formulas in
    others where the constraints of the question hold.
    """

    tree: Node
    formulas: FormulaComparison
    constant: bool = False
    rates: tuple[str, ...] = ()
    is_lagrangian: bool = False
    misplaced: frozenset[str] = frozenset()
    tied: Mapping[str, Node] = field(default_factory=dict)

    def same(self, answer: Node, *, constant: bool = False) -> bool | str:
        """Whether an answer is this formula, up to a constant if one is allowed."""
        for name, formula in self.tied.items():
            answer = bound(answer, {name: formula})
        return self.formulas.same(answer, self.tree, constant=constant)


class ExpressionKind(AnswerKind):
    """A formula in the symbols of the question."""

    name = "expression"
    has_tolerance = False
    options = OF_FORMULAS | {"constant"}

    def key(self, source: KeySource) -> FormulaKey:
        tree, question, last = _tree(source), source.question, source.path[-1] if source.path else ""
        used = names_in(tree)
        names = names_of(source, used)
        rates = names.velocities if used & set(names.velocities) else names.momenta
        is_energy = last in ENERGIES if source.report is not None else not used.isdisjoint(rates)
        in_momenta = last == "hamiltonian" or not used.isdisjoint(names.momenta)
        formulas = formulas_of(source, names, _relative(question.tolerance))
        if all(value is None for value in formulas.values(tree)):
            raise ValueProblem("the key has no value")
        constant = is_energy and bool(used & names.states) and question.constant == "allowed"
        is_lagrangian = last == "lagrangian" or rates == names.velocities
        misplaced = {*names.velocities} - used if in_momenta and rates == names.momenta else ()
        rates = rates if is_energy else ()
        tied = _tied(source)
        return FormulaKey(tree, formulas, constant, rates, is_lagrangian, frozenset(misplaced), tied)

    def read(self, key: FormulaKey, answer: Tree) -> ReadAnswer:
        if key.constant and isinstance(answer, str):
            answer = re.sub(rf"\s*\+\s*(?:{said('constant')}|cst)\.?\s*\Z", "", answer)
        several = read_expressions(answer, key.formulas.names)
        node = chosen(several, lambda each: self.is_right(key, each) or key.same(each))
        why = Ruler(Tolerance(), formulas=key.formulas).doubt(answer, node)
        return ReadAnswer(node, without_doubt(node), why)

    def judge(self, key: FormulaKey, value: Node) -> Outcome:
        truth = key.same(value)
        if truth is True:
            return Outcome.correct()
        if key.constant and key.same(value, constant=True) is True:
            return Outcome.correct(Finding("additive_constant", detail="that does not change the motion"))
        if isinstance(truth, str):
            return Outcome.review(truth)
        return Outcome.earning(0.0, *_findings(key, value))

    def is_right(self, key: FormulaKey, value: Node) -> bool:
        return key.same(value, constant=key.constant) is True

    def mistaken(self, source: KeySource, key: FormulaKey) -> Iterator[tuple[str, FormulaKey]]:
        """The key of the other sign, and of an energy T + V also T - V, T/2 + V and 2 T + V."""
        yield "sign_error", replace(key, tree=Negative(key.tree))
        if parts := _energies(key):
            kinetic, rest = parts
            code = "potential_sign" if key.is_lagrangian else "lagrangian_or_potential_sign"
            yield code, replace(key, tree=Sum((kinetic, Negative(rest))))
            for factor in (HALF, TWO):
                yield "kinetic_factor", replace(key, tree=Sum((Product((factor, kinetic)), rest)))

    def typed(self, key: FormulaKey) -> Tree:
        return text(key.tree)


def _tree(source: KeySource) -> Node:
    """The formula that is the key. Raises ValueProblem."""
    if source.report is not None:
        if isinstance(source.value, Expr):
            return to_tree(source.value)
        raise ValueProblem("what is asked for is not one expression")
    code = ""
    for names in (names_of(source), None):  # without names, letters may stand in it that are not listed
        try:
            return read_expression(source.value, names)
        except Unreadable as unreadable:
            code = code or unreadable.findings[0].code
    raise ValueProblem(f"the key cannot be read: {code}")


def _tied(source: KeySource) -> dict[str, Node]:
    """For a force of a constraint: momenta by velocities, then what a constraint fixes, as r - l fixes r."""
    if source.report is None or "constraint_forces" not in source.path:
        return {}
    tree, coordinates = source.report.tree, names_of(source).coordinates
    tied = {name: to_tree(definition) for name, definition in (tree["momentum_definitions"] or {}).items()}
    for constraint in tree["constraints"]:
        expression = constraint["expression"]
        names = expression.names.intersection((*coordinates, *map(velocity, coordinates)))
        slopes = [derivative(expression, name) for name in names]
        if len(names) == 1 and names.issubset(coordinates) and names.isdisjoint(slopes[0].names):
            (name,) = names
            value = expand(symbol(name) - expression / slopes[0])
            tied[name] = to_tree(value)
            tied[velocity(name)] = to_tree(derivative(value, TIME))
    return tied


def _relative(tolerance: Tolerance) -> float | None:
    """The tolerance relative to the sizes of terms, if the question gives any. Raises ValueProblem."""
    if tolerance.absolute is not None:
        message = "an expression has a tolerance `relative` to its terms"
        raise ValueProblem(message, path=("tolerance", "absolute"))
    figures = tolerance.significant_figures
    return tolerance.relative if figures is None else 0.5 * 10.0 ** (1 - figures)


def _findings(key: FormulaKey, answer: Node) -> list[Finding]:
    """What is wrong with an answer, apart from the mistakes that change the key."""
    if velocities := sorted(key.misplaced & names_in(answer)):
        return [Finding("velocity_in_hamiltonian", detail=f"read `{velocities[0]}`")]
    names = key.formulas.names
    missing = names_in(names.without_derived(key.tree)) - names_in(names.without_derived(answer))
    if names.values and missing:
        given = replace(key, formulas=replace(key.formulas, numbers=True))
        if given.same(answer, constant=key.constant) is True:
            return [Finding("number_for_symbol")]
    if not key.constant and names.states & names_in(key.tree) and key.same(answer, constant=True) is True:
        return [Finding("additive_constant")]
    seed = f"{key.formulas.name} {text(answer)}"
    own, right = (key.formulas.values(node, seed, LEAST_POINTS + 1) for node in (answer, key.tree))
    pairs = [(a, b) for a, b in zip(own, right, strict=True) if a is not None and b is not None]
    if len(pairs) < LEAST_POINTS:
        return [Finding("outside_tolerance")]
    if not key.constant and names_in(key.tree) and _common([a - b for a, b in pairs]) is not None:
        return [Finding("additive_constant")]
    factor = _common([a / b for a, b in pairs if not b.contains(0)])
    if factor and abs(factor - 1) > FACTOR_ERROR:
        return [Finding(common_factor(factor, None, (), FACTOR_ERROR) or "constant_factor")]
    lacking = f"`{min(missing)}` does not occur in it" if missing else ""
    return [Finding("term_wrong" if isinstance(key.tree, Sum) else "outside_tolerance", detail=lacking)]


def _common(balls: Sequence[Ball]) -> float | None:
    """The one number within all balls; None where there is none, or it is no float."""
    if len(balls) < LEAST_POINTS:
        return None
    best = min(balls, key=lambda ball: float(ball.rad()))
    is_common = all(ball.overlaps(best) for ball in balls) and math.isfinite(best)
    return float(best.mid()) if is_common and best.rad() <= FACTOR_ERROR * abs(best.mid()) else None


def _energies(key: FormulaKey) -> tuple[Node, Node] | None:
    """The energies T and V of a key T + V; None where reversed motion would change it."""
    if not key.rates or names_in(key.tree).isdisjoint(key.rates):
        return None
    resting = to_tree(from_tree(bound(key.tree, dict.fromkeys(key.rates, ZERO))))
    back = bound(key.tree, {name: Negative(Name(name)) for name in key.rates})
    if key.same(back) is not True or key.formulas.same(resting, ZERO) is not False:
        return None
    return Sum((key.tree, Negative(resting))), resting
