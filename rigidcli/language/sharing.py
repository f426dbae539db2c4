"""Values in steps of code: what stands in several places is worked out once, linear equations are solved."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from rigidcli.errors import ExpressionError
from rigidcli.language import tree

Step = tuple[str, tree.Node]
"""A name, and its value from names before."""

SIGNED = (tree.Negative, tree.Reciprocal)
"""A tree with another sign, or below a fraction bar."""


class Formulas(NamedTuple):
    """Trees to be worked out: `steps` one after the other, each known to those that follow, and `values`."""

    steps: tuple[Step, ...]
    values: tuple[tree.Node, ...]

    @property
    def trees(self) -> tuple[tree.Node, ...]:
        """All trees of the steps and values."""
        return (*(value for _, value in self.steps), *self.values)

    @property
    def names(self) -> frozenset[str]:
        """The names in the trees, and those of the steps."""
        return frozenset(name for name, _ in self.steps).union(*map(tree.names_in, self.trees))


def shared(steps: Sequence[Step], values: Sequence[tree.Node]) -> Formulas:
    """The same values, in which nothing but names and numbers stands twice; steps without use are left out.

    Names of new steps begin with `.s`.

    Raises:
        ExpressionError: a number is too large for a float.
    """
    kept = _needed(steps, values)
    roots = [*(value for _, value in kept), *values]
    parts = dict.fromkeys(tree.nodes(roots))
    for part in parts:
        if isinstance(part, tree.Number) and not math.isfinite(part.value):
            raise ExpressionError(f"the number {part.text[:20]}... is too large")
    # Each part counts once, in however many places it stands. A sign or a division is no part of its own.
    inside = (operand for part in parts if not isinstance(part, SIGNED) for operand in tree.operands(part))
    uses = Counter(map(_unsigned, [*roots, *inside]))
    made: list[Step] = []
    names: dict[tree.Node, tree.Name] = {}

    def write(node: tree.Node) -> tree.Node:
        if node in names:
            return names[node]
        changed = tree.rebuilt(node, write)
        if uses[node] < 2 or not tree.operands(node) or not tree.names_in(node):
            return changed
        names[node] = tree.Name(f".s{len(names) + 1}")
        made.append((names[node].name, changed))
        return names[node]

    for name, value in kept:
        made.append((name, write(value)))  # after what it is made of
    written = tuple(map(write, values))
    return Formulas(tuple(made), written)


def _needed(steps: Sequence[Step], values: Iterable[tree.Node]) -> list[Step]:
    """The steps that the values need."""
    needed = set[str]().union(*map(tree.names_in, values))
    kept: list[Step] = []
    for name, value in reversed(steps):
        if name in needed:
            kept.insert(0, (name, value))
            needed |= tree.names_in(value)
    return kept


def _unsigned(node: tree.Node) -> tree.Node:
    return _unsigned(node.operand) if isinstance(node, SIGNED) else node


def solved(
    matrix: Sequence[Sequence[tree.Node]], right: Sequence[tree.Node], *, is_definite: bool = True
) -> tuple[list[Step], list[tree.Node]]:
    """Steps, and then x: a x = b is solved for a symmetric matrix (n by n) and b (n), for `code.function`.

    The factors are L D L^T without pivots, as a positive definite matrix has them: a mass matrix is one, or
    its square is. So has [[M, A^T], [A, 0]] with such an M, which is not definite. Zeros save steps. Names of
    steps begin with a dot, as no name of a document does.
    """
    size, steps = len(matrix), list[Step]()

    def named(kind: str, value: tree.Node) -> tree.Node:
        if value in (tree.ZERO, tree.ONE) or isinstance(value, tree.Name):
            return value
        steps.append((f".{kind}{len(steps)}", value))
        return tree.Name(steps[-1][0])

    # Zero has one tree from here on, however it is written.
    rows = [[tree.ZERO if getattr(entry, "value", None) == 0 else entry for entry in row] for row in matrix]
    if is_definite and any(rows[i][i] == tree.ZERO for i in range(size)):
        right = [sum((a * b for a, b in zip(row, right, strict=True)), tree.ZERO) for row in rows]
        rows = [[sum((a * b for a, b in zip(r, s, strict=True)), tree.ZERO) for s in rows] for r in rows]
    factors: list[list[tree.Node]] = [[tree.ZERO] * size for _ in rows]
    pivots, ahead = list[tree.Node](), list[tree.Node]()
    for j in range(size):
        # D_j = A_jj - sum_k L_jk^2 D_k,  L_ij = (A_ij - sum_k L_ik L_jk D_k)/D_j
        carried = [factors[j][k] * pivots[k] for k in range(j)]
        pivots.append(named("d", sum((-factors[j][k] * carried[k] for k in range(j)), rows[j][j])))
        for i in range(j + 1, size):
            entry = sum((-factors[i][k] * carried[k] for k in range(j)), rows[i][j])
            factors[i][j] = named("l", entry / pivots[j])
    for i in range(size):
        ahead.append(named("y", sum((-factors[i][k] * ahead[k] for k in range(i)), right[i])))
    answers: list[tree.Node] = [tree.ZERO] * size
    for i in reversed(range(size)):
        others = (-factors[k][i] * answers[k] for k in range(i + 1, size))
        answers[i] = named("x", sum(others, ahead[i] / pivots[i]))
    return steps, answers
