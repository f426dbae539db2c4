"""Keys of expressions: the right one, what a wrong one is compared with, and what may stand in either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.expressions.agreement import Reference, refer
from rigidcli.grading.expressions.dimensions import mismatch
from rigidcli.grading.expressions.energy import additive_terms, mistaken, split
from rigidcli.grading.expressions.estimate import Estimate
from rigidcli.grading.expressions.formula import Points, names_in, read
from rigidcli.grading.expressions.vocabulary import TIME, Names, names_of
from rigidcli.grading.numbers import margin
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Tolerance
from rigidcli.model.dimensions import dimension_of
from rigidcli.model.units import DIMENSIONLESS
from rigidcli.model.variables import velocity
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.language.tree import Node

ENERGIES = ("hamiltonian", "lagrangian", "energy")
"""Last names of results to which a constant may be added."""


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """What comes out under a mistake, and its values at the points of the reference."""

    code: str
    tree: Node
    found: Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """The points of the reference, but with no momentum or velocity, and its values there."""

    points: Points
    found: Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The right expression, and what a wrong answer is compared with.

    A `constant` may be added where that is allowed. `misplaced` are the velocities, where momenta stand in
    the reference; `hamiltonian` tells whether it is H, and `lagrangian` has the values of L then. `asked` is
    a name for what is asked, in which it is no answer. What is `periodic` may be a frequency, an angular one,
    or a period. `terms` are those of a sum, with their values. What an energy is at `rest` tells T from V.
    The reference is `told` to those who may read it.
    """

    reference: Reference
    names: Names
    constant: bool
    misplaced: frozenset[str]
    hamiltonian: bool
    lagrangian: Estimate | None
    asked: str
    periodic: bool
    mistakes: tuple[Mistake, ...]
    terms: tuple[Mistake, ...]
    rest: Rest | None
    told: str

    def is_same(self, answer: Estimate, other: Estimate) -> bool:
        """Whether an answer is another expression than the reference, by the same tolerance."""
        floats, relative = self.reference.floats, self.reference.relative
        return floats.verdict(answer, other, constant=self.constant, relative=relative) is True


def read_key(asked: Asked) -> Key:
    """The expression that is asked for. Raises ValueProblem where there is none, or an option is unfit."""
    tree = _tree(asked)
    used = names_in(tree)
    names = names_of(asked, used)
    if mismatch(tree, names.dimensions) is not None:
        names = replace(names, dimensions={})
    last = asked.path[-1] if asked.path else ""
    moving = names.states | {TIME} if used & names.states else frozenset()
    rates = names.velocities if used & set(names.velocities) else names.momenta
    is_energy = not used.isdisjoint(rates) if asked.report is None else last in ENERGIES
    reference = refer(tree, names.vocabulary, moving, _relative(asked.question.tolerance, tree))
    points = reference.floats.points

    def mistake(code: str, node: Node) -> Mistake:
        return Mistake(code, node, points.at(node))

    has_momenta = last == "hamiltonian" or not used.isdisjoint(names.momenta)
    misplaced = frozenset(names.velocities) - used if has_momenta and rates == names.momenta else frozenset()
    is_hamiltonian = bool(misplaced) and (last == "hamiltonian" or asked.report is None)
    is_lagrangian = last == "lagrangian" or rates == names.velocities
    found = mistaken(tree, names.coordinates, rates, is_energy=is_energy, is_lagrangian=is_lagrangian)
    lagrangian = asked.report.get("lagrangian") if asked.report is not None and is_hamiltonian else None
    key = Key(
        reference,
        names,
        is_energy and bool(moving) and asked.question.constant == "allowed",
        misplaced,
        is_hamiltonian,
        None if lagrangian is None else points.at(to_tree(lagrangian)),
        velocity(last) if asked.path[-2:-1] == ("equations",) else last,
        not used & names.states and _may_be_periodic(tree, names),
        tuple(mistake(code, node) for code, node in found),
        tuple(mistake("term_wrong", node) for node in additive_terms(tree)),
        _rest(tree, points, [name for name in rates if name in used]) if is_energy else None,
        f"expected {text(tree)}",
    )
    real = [mistake for mistake in key.mistakes if not key.is_same(mistake.found, reference.floats.found)]
    return replace(key, mistakes=tuple(real))


def _tree(asked: Asked) -> Node:
    """The expression that is the key. Raises ValueProblem."""
    value = asked.value
    if asked.report is None:
        try:
            return read(value, None)
        except Unreadable as unreadable:
            raise ValueProblem(f"the key {CODES[unreadable.finding.code]}") from None
    if isinstance(value, Expr):
        return to_tree(value)
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        value = repr(float(value)) if np.isfinite(value) else None
    try:
        return read(value, None, label=False)
    except Unreadable:
        raise ValueProblem("what is asked for is not one expression") from None


def _relative(tolerance: Tolerance, tree: Node) -> float | None:
    """The tolerance relative to the sizes of terms, if any is given. Raises ValueProblem for an unfit one."""
    if tolerance.figures != "value":
        raise ValueProblem("an expression has no figures to count", path=("tolerance", "figures"))
    if tolerance == Tolerance():
        return None
    if not names_in(tree):
        value = _value(tree)
        return margin(value, tolerance) / value if value else None
    if tolerance.absolute is not None:
        raise ValueProblem(
            "an expression has a tolerance `relative` to its terms", path=("tolerance", "absolute")
        )
    figures = tolerance.significant_figures
    rounded = 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures)
    return max(tolerance.relative or 0.0, rounded)


def _value(tree: Node) -> float:
    """The size of a number. Raises ValueProblem where there is none."""
    try:
        return abs(evaluation.real(tree, {}))
    except ExpressionError:
        raise ValueProblem("the key has no value") from None


def _may_be_periodic(tree: Node, names: Names) -> bool:
    """Whether the dimension, as far as it is known, is that of a frequency or of a time."""
    dimension = dimension_of(tree, names.dimensions)
    return dimension is None or (
        dimension.time in (-1, 1) and dimension._replace(time=0, angle=0, cycle=0) == DIMENSIONLESS
    )


def _rest(tree: Node, points: Points, rates: Sequence[str]) -> Rest | None:
    """What tells T from V, where they can be told apart."""
    try:
        if split(from_tree(tree), rates) is None:
            return None
    except ExpressionError:
        return None
    still = points.but(dict.fromkeys(rates, 0.0))
    return Rest(still, still.at(tree))
