"""Where expressions are compared: points near and far, in pairs, that nobody can foresee."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.reading import from_tree
from rigidcli.core.arithmetic import Mask
from rigidcli.errors import ValueProblem
from rigidcli.grading.expressions.formula import Scale, Vocabulary, draw
from rigidcli.grading.values import Integers, Points, Worked
from rigidcli.language.tree import Node

FAR: tuple[Scale, ...] = ((1e4, 1e6), (1e2, 1e4), (1e5, 1e6))
"""Between which sizes random values lie at points far away."""

NEAR_PAIRS, FAR_PAIRS = 12, 6
"""Of points at which expressions are compared; there are more far away, where more names change."""

LEAST_PAIRS = 4
CANDIDATES = (60, 2000)
"""Random points among which those with a value are looked for."""


@dataclass(frozen=True, eq=False)
class Ground(Worked):
    """Where expressions are compared: points (2 n), and symbols for the names.

    The points come in pairs, i and i + n, that differ in the `changing` names only: what is left of the
    difference of two expressions there is not a constant. Of n, the first are `near`.
    """

    points: Points
    vocabulary: Vocabulary
    changing: frozenset[str]
    near: int

    def is_near(self, of_pairs: bool = False) -> Mask:
        """Which points, or pairs of them, are not far away."""
        half = self.points.count // 2
        near = np.arange(half) < self.near
        return near if of_pairs else np.tile(near, 2)

    @cached_property
    def symbols(self) -> dict[str, Expr]:
        """What each name is in exact expressions."""
        domains, derived = self.vocabulary.domains, self.vocabulary.derived
        known = {name: symbol(name, domain == "positive") for name, domain in domains.items()}
        for name, node in derived.items():
            known[name] = from_tree(node, known)
        return known

    def exact(self, node: Node) -> Expr:
        """A tree as an exact expression. Raises ExpressionError."""
        return from_tree(node, self.symbols)


def ground(tree: Node, vocabulary: Vocabulary, changing: Iterable[str], seed: int) -> Ground:
    """Where an expression has values. Raises ValueProblem where these are too few."""
    names = frozenset(changing) or frozenset(vocabulary.domains)
    for count in CANDIDATES:
        first, other = (draw(vocabulary, count, seed + more) for more in (0, 1))
        second = first.but({name: other.values[name] for name in names})
        near = _known(tree, first, second)[:NEAR_PAIRS]
        if len(near) == NEAR_PAIRS or (count == CANDIDATES[-1] and len(near) >= LEAST_PAIRS):
            far = _far(vocabulary, sorted(names), first, second, seed + 2)
            good = _known(tree, *far)
            halves = (
                each.some(near).joined(away.some(good))
                for each, away in zip((first, second), far, strict=True)
            )
            return Ground(next(halves).joined(next(halves)), vocabulary, names, len(near))
    raise ValueProblem("has a value at too few of the points where its symbols may lie")


def _known(tree: Node, first: Points, second: Points) -> Integers:
    """The places where an expression has values at both points."""
    return np.flatnonzero(first.roughly_at(tree).known & second.roughly_at(tree).known)


def _far(
    vocabulary: Vocabulary, names: Sequence[str], first: Points, second: Points, seed: int
) -> tuple[Points, Points]:
    """Pairs of points at which one name after the other is far away, on both sides, or all of them are."""
    turns = len(names) + 1
    count = max(FAR_PAIRS, turns)
    distances = draw(vocabulary, count, seed, FAR).values
    turn = np.arange(count) % turns
    above, below = (
        {name: each.values[name][:count].copy() for name in vocabulary.domains} for each in (first, second)
    )
    for place, name in enumerate(names):
        is_far = (turn == place) | (turn == len(names))
        sign = 1 if vocabulary.domains[name] == "positive" else -1
        above[name][is_far] = abs(distances[name][is_far])
        below[name][is_far] = sign * abs(np.roll(distances[name], 1)[is_far])
    return first.some(range(count)).but(above), second.some(range(count)).but(below)
