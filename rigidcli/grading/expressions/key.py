"""Keys of expressions: the right one, where answers are compared with it, and what may stand in either."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.fields.dimensional_analysis import dimension_of
from rigidcli.fields.dimensions import DIMENSIONLESS
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.expressions.agreement import Function, Told
from rigidcli.grading.expressions.dimensions import mismatch
from rigidcli.grading.expressions.formula import names_in, read
from rigidcli.grading.expressions.ground import ground
from rigidcli.grading.expressions.rounding import Rounded, rounded
from rigidcli.grading.expressions.vocabulary import POSITIVE, TIME, Names, names_of
from rigidcli.grading.numbers import margin
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Tolerance
from rigidcli.language import evaluation
from rigidcli.language.text import text
from rigidcli.language.tree import Node, bound

ENERGIES = ("hamiltonian", "lagrangian", "energy")
"""Last names of results to which a constant may be added."""

ROUNDING = 1e-9
"""Relative to the terms, what a number of a report may be off."""


@dataclass(frozen=True, eq=False)
class Key:
    """The right expression, and what is known of it.

    A `constant` may be added where that is allowed, and the tolerance may be `relative` to the terms; where
    it `is_rounded`, the question gives none. The values of a document may stand for its parameters where
    `numbers` are allowed. `rates` are momenta or velocities, in which an energy is T and V. `misplaced` are
    the velocities, where momenta stand in the key; `lagrangian` is L where it is H. `asked` is a name for
    what is asked, in which it is no answer. What is `periodic` may be a frequency, an angular one, or a
    period.
    """

    function: Function
    names: Names
    constant: bool
    relative: float | None
    is_rounded: bool
    numbers: bool
    rates: tuple[str, ...]
    is_energy: bool
    is_lagrangian: bool
    misplaced: frozenset[str]
    lagrangian: Node | None
    asked: str
    periodic: bool

    @property
    def tree(self) -> Node:
        """The expression."""
        return self.function.tree

    @property
    def is_hamiltonian(self) -> bool:
        """Whether it is H, in momenta."""
        return bool(self.misplaced) and self.asked in ("hamiltonian", "")

    def of(self, tree: Node, **changes: Any) -> Key:
        """The key that another expression is."""
        return replace(self, function=Function(tree, self.function.ground), **changes)

    def answer(self, tree: Node) -> Function:
        """An answer on the ground of the key."""
        return Function(tree, self.function.ground)

    def told(self, answer: Function, *, constant: bool | None = None) -> Told:
        """Whether an answer is the key, but for a `constant` if one is allowed; or why that is left open."""
        allowed = self.constant if constant is None else constant
        found: Told = False
        for one, other in self._readings(answer):
            found = one.is_same(other, constant=allowed, relative=self.relative) or found
            if found is True:
                break
        return found

    def rounded(self, answer: Function) -> Rounded | None:
        """The answer whose decimals were rounded; None where it is not the key."""
        found = (rounded(one, other, constant=self.constant) for one, other in self._readings(answer))
        return next((each for each in found if each is not None), None)

    def _readings(self, answer: Function) -> list[tuple[Function, Function]]:
        """The answer and the key, and both with the values of a document if these are allowed."""
        both = [(answer, self.function)]
        if self.numbers:
            meant = self.names.meant
            both.append((self.answer(bound(answer.tree, meant)), self.answer(bound(self.tree, meant))))
        return both

    def where_positive(self) -> Key | None:
        """The key where names of which that is not told are positive; None where there are none."""
        real, names = self.function.ground, self.names.open
        if not names:
            return None
        domains = {**real.vocabulary.domains, **dict.fromkeys(names, POSITIVE)}
        points = real.points.but({name: abs(real.points.values[name]) for name in names})
        positive = replace(real, points=points, vocabulary=replace(real.vocabulary, domains=domains))
        return replace(self, function=Function(self.tree, positive))


def read_key(asked: Asked) -> Key:
    """The expression that is asked for. Raises ValueProblem where there is none, or an option is unfit."""
    tree = _tree(asked)
    used = names_in(tree)
    names = names_of(asked, tree)
    if mismatch(tree, names.dimensions) is not None:
        names = replace(names, dimensions={})
    last = asked.path[-1] if asked.path else ""
    moving = names.states | {TIME} if used & names.states else frozenset()
    rates = names.velocities if used & set(names.velocities) else names.momenta
    is_energy = not used.isdisjoint(rates) if asked.report is None else last in ENERGIES
    has_momenta = last == "hamiltonian" or not used.isdisjoint(names.momenta)
    misplaced = frozenset(names.velocities) - used if has_momenta and rates == names.momenta else frozenset()
    seed = zlib.crc32(f"{asked.name}\n{text(tree)}".encode())
    relative = _relative(asked.question.tolerance, tree)
    is_float = isinstance(asked.value, float | np.floating) and relative is None
    lagrangian = None if asked.report is None or last != "hamiltonian" else asked.report.get("lagrangian")
    return Key(
        Function(tree, ground(tree, names.vocabulary, moving, seed)),
        names,
        is_energy and bool(moving) and asked.question.constant == "allowed",
        ROUNDING if is_float else relative,
        is_float,
        asked.question.numbers == "allowed" and bool(names.meant),
        rates,
        is_energy,
        last == "lagrangian" or rates == names.velocities,
        misplaced,
        None if lagrangian is None else to_tree(lagrangian),
        velocity(last) if asked.path[-2:-1] == ("equations",) else last,
        not used & names.states and _may_be_periodic(tree, names),
    )


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
        try:
            value = abs(evaluation.real(tree, {}))
        except ExpressionError:
            raise ValueProblem("the key has no value") from None
        return margin(value, tolerance) / value if value else None
    if tolerance.absolute is not None:
        raise ValueProblem(
            "an expression has a tolerance `relative` to its terms", path=("tolerance", "absolute")
        )
    figures = tolerance.significant_figures
    rounded = 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures)
    return max(tolerance.relative or 0.0, rounded)


def _may_be_periodic(tree: Node, names: Names) -> bool:
    """Whether the dimension, as far as it is known, is that of a frequency or of a time."""
    dimension = dimension_of(tree, names.dimensions)
    return dimension is None or (
        dimension.time in (-1, 1) and dimension._replace(time=0, angle=0, cycle=0) == DIMENSIONLESS
    )
