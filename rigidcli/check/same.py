"""Whether an answer is the same as the key: yes, no, or the reason why that is open.

Two formulas are the same when they agree in exact normal form; otherwise their values decide, at points that
follow from the key, the answer and the name of the question, so that nobody can foresee them. Values are
balls: where the ball of a difference does not hold zero, the formulas differ. A decimal is the ball of all
numbers that round to it.

Values at points cannot see everything. What shows one side only (the sign of an argument of abs) or nothing
(a term far below its neighbours) leaves the question open, unless the key has the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.reading import from_tree
from rigidcli.check.balls import (
    BITS,
    NEVER,
    RANGES,
    TINY,
    Ball,
    NoValue,
    Point,
    Unclear,
    Walk,
    coordinate,
    points,
)
from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.text import reading
from rigidcli.language.text import text as written
from rigidcli.language.tree import Node

if TYPE_CHECKING:
    from rigidcli.check.reading import Names

NEEDED = 4
"""Points at which both must have values: at fewer, an agreement may be that of two branches only."""

WIDEST = 0.25
"""The largest relative radius of a difference, at which an agreement still says something."""

ROUNDED = 3
"""Figures from which a decimal in a key counts as rounded: 0.5 is a half, 0.333 may be a third."""

MAX_EXACT = 400
"""The most nodes of formulas that are brought to their normal form, which takes long for large ones."""


def same(
    answer: Node,
    key: Node,
    names: Names,
    seed: str,
    *,
    constant: bool = False,
    relative: float | None = None,
    by_answer: bool = False,
) -> bool | str:
    """Whether the answer is the key, or a sentence that says why this is open.

    A `constant` may differ: all that changes neither with the states nor with the time. Numbers may be wrong
    by a `relative` tolerance, as a share of the largest term of the key, or `by_answer` of either.
    """
    answer, key = names.without_derived(answer), names.without_derived(key)
    comparison = _Comparison(answer, key, names, seed, constant, relative)
    if by_answer:
        comparison.terms += comparison.terms_of(answer)
    if comparison.outcome(most=1) is False:  # most wrong answers are seen at the first point
        return False
    if not _identical(answer, key, names):
        return comparison.outcome()
    found = comparison.outcome() if comparison.answer.signs else True
    return found if comparison.lost else True  # exp(log(x)) is x where it has a value


def values(node: Node, names: Names, seed: str, most: int = len(RANGES)) -> list[Ball | None]:
    """The values of a formula at the points of a seed, or at the first ones; None where it has none."""
    from flint import ctx

    tree_of_own = names.without_derived(node)
    walk, used = Walk(tree_of_own), tree.names_in(tree_of_own)
    domains = {name: domain for name, domain in names.domains.items() if name in used}
    found: list[Ball | None] = []
    with ctx.workprec(BITS):
        for point in islice(points(domains, seed), most):
            try:
                found.append(walk.value(point))
            except (NoValue, Unclear):
                found.append(None)
    return found


@lru_cache(64)
def _exact(node: Node, positive: frozenset[str]) -> Expr:
    return expand(from_tree(node, {name: symbol(name, True) for name in positive}))


def _identical(answer: Node, key: Node, names: Names) -> bool:
    """Whether both have the same normal form."""
    if sum(1 for _ in tree.nodes([answer, key])) > MAX_EXACT:
        return answer == key
    positive = frozenset(name for name, domain in names.domains.items() if domain == "positive")
    with suppress(ExpressionError, ArithmeticError, ValueError, KeyError):
        return not expand(_exact(answer, positive) - _exact(key, positive)).terms
    return False


class _Comparison:
    """An answer and its key at the points that follow from both."""

    def __init__(
        self, answer: Node, key: Node, names: Names, seed: str, constant: bool, relative: float | None
    ) -> None:
        exact = relative is not None
        self.answer = Walk(answer, NEVER if exact else 1)
        self.key = Walk(key, NEVER if exact else ROUNDED)
        used = tree.names_in(answer) | tree.names_in(key)
        self.domains = {name: domain for name, domain in names.domains.items() if name in used}
        self.states = names.states | {"t"}
        self.relative = relative
        self.constant = constant
        self.seed = f"{seed}\n{written(key)}\n{written(answer)}"
        self.terms = [*self.terms_of(key), *([] if exact else self.terms_of(answer))]
        self.lost = 0

    @staticmethod
    def terms_of(node: Node) -> list[Walk]:
        """The terms of a sum."""
        return [Walk(term) for term in (node.terms if isinstance(node, tree.Sum) else ())]

    def outcome(self, most: int = len(RANGES)) -> bool | str:
        """Whether both agree at all points, or at the first ones, and nothing is left unseen."""
        from flint import ctx

        agreeing = unclear = self.lost = 0
        with ctx.workprec(BITS):
            for point in islice(self.points(), most):
                try:
                    expected = self.difference(self.key, point)
                except (NoValue, Unclear):
                    continue
                try:
                    found = self.difference(self.answer, point)
                except NoValue:
                    self.lost += 1
                    continue
                except Unclear:
                    unclear += 1
                    continue
                agrees = self.agree(found, expected, point)
                if agrees is False:
                    return False
                agreeing += agrees is True
        if most < len(RANGES):
            return "not all points are seen"
        if not agreeing and self.lost:
            return False
        if agreeing < (NEEDED if self.domains else 1):
            return "it cannot be worked out at enough points"
        if self.lost or unclear:
            return "it has no value at some points where the right answer has one"
        return self.unseen() or True

    def points(self) -> Iterator[dict[str, Ball]]:
        """The points; with a constant allowed, each with another one for the states in `_partner`."""
        for place, point in enumerate(points(self.domains, self.seed)):
            if self.constant:
                other = {
                    name: coordinate(f"{self.seed}\npartner {place}\n{name}", domain, place)
                    for name, domain in self.domains.items()
                    if name in self.states
                }
                self.partner: Point = {**point, **other}
            yield point

    def difference(self, walk: Walk, point: Point) -> Ball:
        """The value; with a constant allowed, its change between two states with the same parameters."""
        value = walk.value(point)
        return value - walk.value(self.partner) if self.constant else value

    def agree(self, found: Ball, expected: Ball, point: Point) -> bool | None:
        """Whether two values agree; None where the difference is too vague to say so."""
        from flint import arb

        gap = found - expected
        if self.relative is None and not gap.contains(0):
            return False
        size = max(abs(found.mid()), abs(expected.mid()))
        if self.relative is None and (gap.rad() <= size * WIDEST or gap.rad() < TINY):
            return True
        for term in self.terms:
            with suppress(NoValue, Unclear):
                size = max(size, abs(self.difference(term, point).mid()))
        if self.relative is not None and not (gap + arb(0, self.relative * size)).contains(0):
            return False
        return True if gap.rad() <= size * WIDEST or gap.rad() < TINY else None

    def unseen(self) -> str:
        """What values at points cannot see; empty where they see all."""
        if (hidden := self.answer.hidden or self.key.hidden) is not None:
            return f"`{_short(hidden)}` is too small beside its neighbours to be seen"
        for walk, other in ((self.answer, self.key), (self.key, self.answer)):
            for function, argument in walk.one_sided(self.domains):
                shared = (a for f, a in other.signs if f == function)
                if not any(self.proportional(argument, one) for one in shared):
                    return f"the argument of {function} in `{_short(argument)}` shows one sign only"
        return ""

    def proportional(self, one: Node, other: Node) -> bool:
        """Whether the quotient or the product of two arguments has one sign, and holds no real name.

        Then one is positive where the other is: what is left are parameters, which are positive.
        """
        from flint import ctx

        if one == other:
            return True
        walks = Walk(one), Walk(other)
        quotients, products = list[tuple[Ball, Ball]](), list[tuple[Ball, Ball]]()
        with ctx.workprec(BITS):
            for place, point in enumerate(points(self.domains, self.seed)):
                moved = {
                    name: coordinate(f"{self.seed}\nmoved {place}\n{name}", domain, place)
                    for name, domain in self.domains.items()
                    if domain == "real"
                }
                with suppress(NoValue, Unclear):
                    a, b, c, d = (walk.value(at) for at in (point, {**point, **moved}) for walk in walks)
                    quotients.append((a * d - b * c, a * b))
                    products.append((a * b - c * d, a * b))
        return any(
            len(found) >= NEEDED
            and all(change.contains(0) for change, _ in found)
            and len({sign > 0 for _, sign in found if not sign.contains(0)}) == 1
            for found in (quotients, products)
        )


def _short(node: Node) -> str:
    text = reading(node)
    return text if len(text) <= 60 else f"{text[:57]}..."
