"""Whether an answer is the same as the key: yes, no, or the reason why that is open.

Two formulas are the same when they agree in exact normal form; otherwise their values decide, at points that
follow from the key, the answer and the name of the question, so that nobody can foresee them. Values are
balls: where the ball of a difference does not hold zero, the formulas differ. A decimal is the ball of all
numbers that round to it.

Values at points cannot see everything. What shows one side only (the sign of an argument of abs) or nothing
(a term far below its neighbours) leaves the question open, unless the key has the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError, shortened
from rigidcli.homework import balls
from rigidcli.homework.balls import Ball, NoValue, Point, Steps, Unclear
from rigidcli.language import tree
from rigidcli.language.parser import read
from rigidcli.language.text import reading
from rigidcli.language.tree import Node

if TYPE_CHECKING:
    from rigidcli.homework.base import Asked
    from rigidcli.homework.reading import Names

NEEDED = 4
"""Points at which both must have values: at fewer, an agreement may be that of two branches only."""

MOST_KNOWN = 64
"""The most outcomes that are kept."""

MOST_NODES = 400
"""The most nodes of two formulas that are worked out exactly: a larger normal form takes long."""

WIDEST = 0.25
"""The largest relative radius of a difference, at which an agreement still says something."""


@dataclass(frozen=True, eq=False)
class Formulas:
    """How formulas of the question called `name` are compared, in the `names` that they may hold.

    Numbers may be wrong by a `relative` tolerance, as a share of the largest term of the key. Where `numbers`
    says so, the values of a document stand for its parameters, in the answer and in the key. All formulas
    `within` are positive at the points: they are the conditions of the key.
    """

    name: str
    names: Names
    relative: float | None = None
    numbers: bool = False
    within: tuple[Node, ...] = ()
    known: dict[tuple[Any, ...], bool | str] = field(default_factory=dict)
    """Outcomes by answer and key: a reading of an answer is chosen, and then judged."""

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "known": {}}

    def same(
        self, answer: Node, key: Node, *, constant: bool = False, beside: Sequence[Node] = ()
    ) -> bool | str:
        """Whether the answer is the key, or a sentence that says why this is open.

        A `constant` may differ: what holds positive parameters only, so neither states nor the time.
        Functions with two sides that stand in formulas `beside` the key count as those of the key do.
        """
        from flint import ctx

        asked = self.relative, self.numbers, answer, key, constant, tuple(beside)
        if asked not in self.known:
            answer, key, *beside = map(self.independent, (answer, key, *beside))
            with ctx.workprec(balls.BITS):
                outcome = _Comparison(self, answer, key, beside, constant).outcome()
            if len(self.known) > MOST_KNOWN:
                self.known.clear()
            self.known[asked] = outcome
        return self.known[asked]

    def vanish(self, nodes: Iterable[Node]) -> bool | str:
        """Whether all formulas are zero, or why this is open."""
        outcomes = [self.same(node, tree.ZERO) for node in nodes]
        if False in outcomes:
            return False
        return next((why for why in outcomes if isinstance(why, str)), True)

    def with_values(self) -> Formulas:
        """The same, where the document's values stand for its parameters."""
        return replace(self, numbers=True)

    def values(self, node: Node, seed: str = "", most: int = len(balls.RANGES)) -> list[Ball | None]:
        """The values of a formula at the points of a seed, or at the first ones; None where it has none."""
        from flint import ctx

        steps = Steps()
        root = steps.add(self.names.without_derived(node))
        used = steps.names
        domains = {name: domain for name, domain in self.names.domains.items() if name in used}
        values: list[Ball | None] = []
        with ctx.workprec(balls.BITS):
            for point in islice(balls.points(domains, seed or self.name), most):
                try:
                    values.append(steps.values(root, point)[root])
                except (NoValue, Unclear):
                    values.append(None)
        return values

    def independent(self, node: Node) -> Node:
        """A formula in the names that nothing defines."""
        node = self.names.without_derived(node)
        return tree.bound(node, self.names.values) if self.numbers else node


def formulas_of(asked: Asked, names: Names, relative: float | None = None) -> Formulas:
    """How answers to a question are compared, in whose `names`."""
    numbers = asked.question.numbers == "allowed" and bool(names.values)
    conditions = asked.report.get("conditions") if asked.report is not None else None
    within = tuple(read(condition.removesuffix(" > 0"))[0] for condition in conditions or ())
    return Formulas(asked.name, names, relative, numbers, within)


@lru_cache(64)
def _exact(node: Node, positive: frozenset[str]) -> Expr:
    return expand(from_tree(node, {name: symbol(name, True) for name in positive}))


def _identical(answer: Node, key: Node, names: Names) -> bool:
    """Whether both have the same normal form."""
    if sum(1 for _ in tree.nodes([answer, key])) > MOST_NODES:
        return answer == key
    positive = frozenset(name for name, domain in names.domains.items() if domain == "positive")
    with suppress(ExpressionError, ArithmeticError, ValueError, KeyError):
        return not expand(_exact(answer, positive) - _exact(key, positive)).terms
    return False


class _Comparison:
    """An answer and its key, in independent names, at the points that follow from both."""

    def __init__(
        self, formulas: Formulas, answer: Node, key: Node, beside: Sequence[Node], constant: bool
    ) -> None:
        names, self.relative, self.beside = formulas.names, formulas.relative, beside
        self.is_identical = partial(_identical, answer, key, names)
        self.steps = Steps()
        # In a key 0.5 is a half, and 0.333 may be a third.
        self.key = self.steps.add(key, 3 if self.relative is None else balls.NEVER)
        self.answer = self.steps.add(answer, 1 if self.relative is None else balls.NEVER)
        roots = [self.key] + [self.answer] * (self.relative is None)
        self.terms = [term for root in roots for term in self.steps.terms(root)]
        self.within = [self.steps.add(formulas.independent(node)) for node in formulas.within]
        used = self.steps.names
        self.domains = {name: domain for name, domain in names.domains.items() if name in used}
        self.changing = [name for name in self.domains if name in names.variable] if constant else None
        self.seed = f"{formulas.name}\n{self.steps.parts}"

    def outcome(self) -> bool | str:
        """Whether both agree at all points, and nothing is left unseen.

        Most wrong answers are seen at the first point, before the normal form of an answer is worked out.
        """
        if self.key == self.answer:
            return True
        agreeing = unclear = lost = met = 0
        identical = False
        for place, point in enumerate(balls.points(self.domains, self.seed)):
            if place >= len(balls.RANGES) and met >= NEEDED:
                break
            if place == 1 and (identical := self.is_identical()) and not self.steps.sided(self.answer):
                return True
            pair = [point] if self.changing is None else [point, self.moved(point, self.changing, place)]
            shown = set(self.steps.signs), set(self.steps.unseen)
            try:
                if not all(self.steps.values(e, at)[e] > 0 for e in self.within for at in pair):
                    continue
                states = [self.steps.values(self.key, at) for at in pair]
            except (NoValue, Unclear):
                self.steps.signs, self.steps.unseen = shown
                continue
            met += 1
            try:
                states = [self.steps.values(self.answer, *of) for of in zip(pair, states, strict=True)]
            except NoValue:
                lost += 1
                continue
            except Unclear:
                unclear += 1
                continue
            agrees = self.agree(states)
            if agrees is False:
                return False
            agreeing += agrees is True
            if agrees is None:  # what such a point shows counts as little as its value
                self.steps.signs, self.steps.unseen = shown
        if identical and not lost:
            return self.one_sided() or True
        if not agreeing and lost:
            return False
        if agreeing < (NEEDED if self.domains else 1):
            return "it cannot be worked out at enough points"
        if lost or unclear:
            return "it has no value at some points where the right answer has one"
        if (hidden := self.steps.hidden) is not None:
            return f"`{shortened(reading(hidden), 60)}` is too small beside its neighbours to be seen"
        return self.one_sided() or True

    def moved(self, point: Point, changing: Sequence[str], place: int) -> Point:
        """The point with other values of some names."""
        seeds = {name: f"{self.seed}\nmoved {place}\n{name}" for name in changing}
        return {
            **point,
            **{name: balls.coordinate(seed, self.domains[name], place) for name, seed in seeds.items()},
        }

    def agree(self, states: Sequence[Sequence[Ball]]) -> bool | None:
        """Whether two values agree; None where the difference is too vague to say so.

        With a constant allowed, `states` has two states, and what counts is the change between these. It is
        vague where one state is so large that the other is lost in its rounding.
        """
        from flint import arb

        def of(place: int) -> Ball:
            return states[0][place] - states[1][place] if len(states) > 1 else states[0][place]

        places = (self.answer, self.key, *self.terms)
        gap = of(self.answer) - of(self.key)
        if self.relative is None and not gap.contains(0):
            return False
        size = max(abs(of(place).mid()) for place in places)
        if self.relative is not None and not (gap + arb(0, self.relative * size)).contains(0):
            return False
        sizes = [max(abs(state[place].mid()) for place in places) for state in states]
        if gap.rad() <= min(size, *sizes) * WIDEST:
            return True
        # A gap that is zero has no size of its own, but that of the terms which cancel in it.
        whole = [sum(self.steps.size(root, state) for root in places[:2]) for state in states]
        return True if gap.rad() <= min(whole) * balls.TINY else None

    def one_sided(self) -> str:
        """The function whose argument may have another sign that no point has shown; empty without one."""
        further = Steps()
        sided = [part for node in self.beside for part in further.sided(further.add(node))]
        for own, other in ((self.answer, self.key), (self.key, self.answer)):
            for function, argument in self.steps.one_sided(own, self.domains):
                shared = [self.steps.nodes[place] for f, place in self.steps.sided(other) if f == function]
                shared += [further.nodes[place] for f, place in sided if f == function]
                if not any(self.proportional(argument, one) for one in shared):
                    words = shortened(reading(argument), 60)
                    return f"the argument of {function} in `{words}` shows one sign only"
        return ""

    def has_sign_of(self, one: Node, other: Node) -> bool:
        """Whether the quotient of two arguments is positive by its form, as 1/(1 - x^2)^2 is."""
        if sum(1 for _ in tree.nodes([one, other])) > MOST_NODES:
            return False
        with suppress(ExpressionError, ArithmeticError, ValueError, KeyError):
            positive = frozenset(name for name, domain in self.domains.items() if domain == "positive")
            quotient = tidy(_exact(one, positive) / _exact(other, positive))
            return balls.is_positive(to_tree(quotient), self.domains)
        return False

    def proportional(self, one: Node, other: Node) -> bool:
        """Whether the quotient or the product of two arguments has one sign for all values of real names.

        Then one is positive where the other is: what is left are parameters, which are positive.
        """
        if one == other or self.has_sign_of(one, other):
            return True
        steps = Steps()
        first, second = steps.add(one), steps.add(other)
        real = [name for name, domain in self.domains.items() if domain == "real"]
        quotients, products = list[tuple[Ball, Ball]](), list[tuple[Ball, Ball]]()
        for place, point in enumerate(islice(balls.points(self.domains, self.seed), len(balls.RANGES))):
            with suppress(NoValue, Unclear):
                both = [
                    steps.values(second, at, steps.values(first, at))
                    for at in (point, self.moved(point, real, place))
                ]
                (a, b), (c, d) = ((state[first], state[second]) for state in both)
                quotients.append((a * d - b * c, a * b))
                products.append((a * b - c * d, a * b))
        return any(
            len(changes) >= NEEDED
            and all(change.contains(0) for change, _ in changes)
            and len({sign > 0 for _, sign in changes if not sign.contains(0)}) == 1
            for changes in (quotients, products)
        )
