"""Conserved quantities: as many as the key has, none of them a function of H and the others.

A quantity F(q, p, t) is conserved if {F, H} and the slope of F by t add up to zero. Quantities are
independent if their gradients are, so that a multiple of the key, a sum or a product of two is as right.
Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 9.6.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, symbol, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.variables import velocity
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.homework.base import Asked, Finding, Kind, Outcome, Reading, Tree, Unreadable
from rigidcli.homework.entries import chosen
from rigidcli.homework.kinds.arrays import MOST_ENTRIES, numbered
from rigidcli.homework.lists import read_list
from rigidcli.homework.reading import names_of, read_expressions
from rigidcli.homework.same import Formulas, formulas_of, pivots
from rigidcli.language.text import text, without_doubt
from rigidcli.language.tree import Node, bound
from rigidcli.mechanics.hamilton_equations import TIME, Phase, bracket

NOTHING_NEW = "it is a function of H, of the momenta that are conserved, or of the other quantities"


@dataclass(frozen=True, eq=False)
class Key:
    """The right quantities, and what decides whether others are as right.

    None may be a function of the `known` quantities alone: H and the momenta that are conserved anyway.
    `velocities` are formulas in the variables of `phase`.
    """

    quantities: tuple[Node, ...]
    formulas: Formulas
    hamiltonian: Node
    phase: Phase
    known: tuple[Node, ...]
    velocities: Mapping[str, Node]

    def exact(self, node: Node) -> Expr:
        """A formula in the variables and the independent parameters. Raises ExpressionError."""
        node = self.formulas.independent(bound(node, self.velocities))
        domains = self.formulas.names.domains.items()
        return from_tree(node, {name: symbol(name, True) for name, d in domains if d == "positive"})

    def is_conserved(self, node: Node) -> bool | str:
        """Whether a quantity keeps its value, or why that is open."""
        try:
            f = self.exact(node)
            rate = total([bracket(f, self.exact(self.hamiltonian), self.phase), derivative(f, TIME)])
            return self.formulas.vanish([to_tree(rate)])
        except ExpressionError as error:
            return f"its rate of change cannot be worked out: {error.message}"

    def rank(self, nodes: Sequence[Node]) -> int:
        """How many quantities are independent: the largest rank of their gradients at the points."""
        slopes = [[derivative(self.exact(node), name) for name in self.phase.names] for node in nodes]
        table = [[self.formulas.values(to_tree(slope)) for slope in row] for row in slopes]
        ranks = [0]
        for place in range(len(table[0][0])):
            matrix = [[values[place] for values in row] for row in table]
            if all(ball is not None for row in matrix for ball in row):
                ranks.append(len(pivots(matrix)[0]))
        return max(ranks)


class Invariants(Kind):
    """Further conserved quantities of a system, in any independent combination."""

    name: ClassVar[str] = "invariants"
    has_tolerance: ClassVar[bool] = False
    options: ClassVar[frozenset[str]] = frozenset(
        {"symbols", "coordinates", "momenta", "velocities", "numbers"}
    )

    def key(self, asked: Asked) -> Key:
        """The conserved quantities of a document. Raises ValueProblem."""
        if asked.report is None:
            hint = "ask a document for `hamilton.invariants`, or give one formula of kind `expression`"
            raise ValueProblem("what is conserved follows from a document", hint=hint)
        results = asked.report.tree
        if asked.path[-1] != "invariants" or not asked.value:
            hint = "there are `hamilton.cyclic` and `hamilton.conserved`, too"
            raise ValueProblem("this result has no conserved quantities", hint=hint)
        equations, hamiltonian = results["equations"], to_tree(results["hamiltonian"])
        states = tuple(equations)
        coordinates, momenta = states[: len(states) // 2], states[len(states) // 2 :]
        known = [hamiltonian if name == "H" else to_tree(symbol(name)) for name in results["conserved"]]
        return Key(
            tuple(map(to_tree, asked.value)),
            formulas_of(asked, names_of(asked)),
            hamiltonian,
            Phase(coordinates, momenta),
            tuple(known),
            {velocity(q): to_tree(equations[q]) for q in coordinates},
        )

    def read(self, key: Key, answer: Tree) -> Reading:
        """A list of formulas, perhaps named; of several readings one that is conserved. Raises Unreadable."""
        table = read_list(answer, is_square=True)  # so that the y of `y p_x` is no unit vector
        cells = list(table.values()) if isinstance(table, dict) else table
        if len(cells) > MOST_ENTRIES:
            raise Unreadable("too_large", f"expected at most {MOST_ENTRIES} formulas")
        names = key.formulas.names
        several = [
            read_expressions(cell, names, place)
            for cell, place in zip(cells, numbered("quantity", len(cells)), strict=True)
        ]
        nodes = [chosen(readings, key.is_conserved) for readings in several]
        return Reading(tuple(nodes), "; ".join(map(without_doubt, nodes)))

    def judge(self, key: Key, value: Sequence[Node]) -> Outcome:
        """New conserved quantities earn their share; more formulas than the key has cost as much."""
        kept, findings, count = list(key.known), list[Finding](), len(key.quantities)
        rank = known = key.rank(kept) if kept else 0
        for place, node in zip(numbered("quantity", len(value)), value, strict=True):
            truth = key.is_conserved(node)
            if isinstance(truth, str):
                return Outcome.review(truth)
            if not truth:
                findings.append(Finding("component_wrong", place, "it is not conserved"))
            elif (more := key.rank([*kept, node])) > rank:
                kept, rank = [*kept, node], more
            else:
                findings.append(Finding("component_wrong", place, NOTHING_NEW))
        if len(value) < count:
            findings.append(Finding("wrong_shape", detail=f"read {len(value)}, expected {count}"))
        new = rank - known
        surplus = len(value) - max(new, count)
        return Outcome.earning((min(new, count) - max(surplus, 0)) / count, *findings)

    def typed(self, key: Key) -> Tree:
        """The quantities of the key."""
        return list(map(text, key.quantities))
