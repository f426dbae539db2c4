"""Whether an answer is the same as the key: yes, no, or the reason why that is open.

Two formulas are the same when they agree in exact normal form; otherwise their values decide, at points that
follow from the key, the answer and the name of the question, so that nobody can foresee them. Values are
balls of python-flint: intervals that are proved to hold the value. Where the ball of a difference does not
hold zero, the formulas differ. A decimal is the ball of all numbers that round to it.

Values at points cannot see everything. What shows one side only (the sign of an argument of abs) or nothing
(a term far below its neighbours) leaves the question open, unless the key has the same.
"""

from __future__ import annotations

import hashlib
import math
import operator
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError, shortened
from rigidcli.language import tree
from rigidcli.language.parser import read
from rigidcli.language.text import reading
from rigidcli.language.tree import Node

if TYPE_CHECKING:
    from rigidcli.homework.base import KeySource
    from rigidcli.homework.reading import Names

Ball: TypeAlias = Any
"""A ball of python-flint, `flint.arb`."""

Point: TypeAlias = Mapping[str, Ball]

BITS = 1024
"""The precision of balls: an answer must agree with its key to some 300 digits."""

RANGES = (*[(0.3, 3.0)] * 8, *[(0.02, 50.0)] * 4, *[(1e-6, 1e6)] * 4)
"""Sizes of the values of names at the first points: near to one, and far from it."""

MOST_POINTS = 400
"""Points that are tried where a key has few values: one of a hundred is within its conditions."""

LEAST_POINTS = 4
"""Points at which both must have values: at fewer, an agreement may be that of two branches only."""

MOST_KEPT = 64
"""Outcomes that are kept: a reading of an answer is chosen, and then judged."""

MOST_NODES = 400
"""Nodes of two formulas that are worked out exactly: a larger normal form takes long."""

VAGUE = 0.25
"""A difference known less precisely than this share of the terms proves nothing."""

UNTESTED = 2.0**-96
"""A term smaller than this share of the largest one is not tested: it may be rounding, or a narrow peak."""

COARSEST = Fraction(1, 50)
"""The most that a decimal may be off, as a share of it: 0.33 stands for a third, and 0.3 does not."""

NEVER = 10_000
"""More figures than a number has."""

ROUNDING_OF_BALLS = 2.0**-256
"""An error bound, relative to the terms that cancel, which rounding alone explains."""

MAX_POWER = 10_000
"""The largest whole exponent that is worked out exactly."""


@dataclass(frozen=True, eq=False)
class FormulaComparison:
    """Compares formulas for one question.

    `name` seeds the test points; `names` are the symbols that are allowed. With a `relative` tolerance,
    formulas may differ by that share of the largest term of the key. With `numbers`, the values of a document
    stand for its parameters. The conditions `within` are formulas that are positive at all test points.
    """

    name: str
    names: Names
    relative: float | None = None
    numbers: bool = False
    within: tuple[Node, ...] = ()

    def same(
        self, answer: Node, key: Node, *, constant: bool = False, beside: Sequence[Node] = ()
    ) -> bool | str:
        """Whether the answer is the key, or a sentence that says why this is open.

        A `constant` may differ, which holds positive parameters only, so neither states nor the time.
        Functions such as abs in formulas `beside` the key count as those of the key do.
        """
        return _outcome(self, answer, key, tuple(beside), constant)

    def vanish(self, nodes: Iterable[Node]) -> bool | str:
        """Whether all formulas are zero, or why this is open."""
        outcomes = [self.same(node, tree.ZERO) for node in nodes]
        if False in outcomes:
            return False
        return next((why for why in outcomes if isinstance(why, str)), True)

    def values(self, node: Node, seed: str = "", most: int = len(RANGES)) -> list[Ball | None]:
        """The values of a formula at the first test points of a seed; None where it has no value."""
        from flint import ctx

        steps = Steps()
        root = steps.add(self.names.without_derived(node))
        values: list[Ball | None] = []
        with ctx.workprec(BITS):
            for point in islice(points(steps.used(self.names.domains), seed or self.name), most):
                try:
                    values.append(steps.values(root, point)[root])
                except (NoValue, Unclear):
                    values.append(None)
        return values

    def pivots(self, rows: Sequence[Sequence[Node]]) -> tuple[list[int], list[int]]:
        """The rows and columns of the pivots of a matrix, at the point where it has the most of them."""
        from flint import ctx

        table = [[self.values(entry) for entry in row] for row in rows if row]
        best: tuple[list[int], list[int]] = [], []
        for place in range(len(RANGES) if table else 0):
            matrix = [[values[place] for values in row] for row in table]
            with ctx.workprec(BITS):
                if all(ball is not None for row in matrix for ball in row):
                    best = max(best, _pivots(matrix), key=lambda found: len(found[0]))
            if len(best[0]) == min(len(table), len(table[0])):
                break
        return best

    def independent(self, node: Node) -> Node:
        """A formula in independent names, such as momenta in place of velocities."""
        node = self.names.without_derived(node)
        return tree.bound(node, self.names.values) if self.numbers else node

    def exact(self, node: Node) -> Expr:
        """A formula in independent names as an exact expression. Raises ExpressionError."""
        positive = [name for name, domain in self.names.domains.items() if domain == "positive"]
        return from_tree(self.independent(node), {name: symbol(name, True) for name in positive})


def formulas_of(source: KeySource, names: Names, relative: float | None = None) -> FormulaComparison:
    """The comparison for a question with these `names`."""
    numbers = source.question.numbers == "allowed" and bool(names.values)
    conditions = source.report.get("conditions") if source.report is not None else None
    within = tuple(read(condition.removesuffix(" > 0"))[0] for condition in conditions or ())
    return FormulaComparison(source.name, names, relative, numbers, within)


@lru_cache(MOST_KEPT)
def _outcome(
    formulas: FormulaComparison, answer: Node, key: Node, beside: tuple[Node, ...], constant: bool
) -> bool | str:
    from flint import ctx

    answer, key, *others = map(formulas.independent, (answer, key, *beside))
    with ctx.workprec(BITS):
        return _Comparison(formulas, answer, key, others, constant).outcome()


@lru_cache(MOST_KEPT)
def _expanded(formulas: FormulaComparison, node: Node) -> Expr:
    return expand(formulas.exact(node))


class _AtPoint(Enum):
    """What an answer and its key are at a point."""

    LEFT_OUT = "the key has no value there, or the conditions of the question do not hold"
    LOST = "the answer has no value there"
    UNCLEAR = "the answer may have no value there"
    VAGUE = "the difference is too vague to say whether they agree"
    AGREES = "they agree"
    DIFFERS = "they differ"


class _Comparison:
    """An answer and its key, in independent names, at the points that follow from both."""

    def __init__(
        self, formulas: FormulaComparison, answer: Node, key: Node, beside: Sequence[Node], constant: bool
    ) -> None:
        self.formulas, self.beside, self.nodes = formulas, beside, (answer, key)
        names, self.relative, self.steps = formulas.names, formulas.relative, Steps()
        # In a key 0.5 is a half, and 0.333 may be a third.
        self.key = self.steps.add(key, 3 if self.relative is None else NEVER)
        self.answer = self.steps.add(answer, 1 if self.relative is None else NEVER)
        # What decimals leave open is measured by the terms of the key: 1.0*10^9*x - 1.0*10^9*x is vague, but
        # not in units of its own terms. What ought to be zero has no terms beside its own.
        is_zero = isinstance(key, tree.Number) and not key.value
        of_both = self.relative is None and (is_zero or not self.steps.has_decimals)
        self.measured = (self.key, self.answer) if of_both else (self.key,)
        parts = [self.steps.parts[root] for root in self.measured]
        self.terms = [term for kind, _, terms in parts if kind == "Sum" for term in terms]
        self.within = [self.steps.add(formulas.independent(node)) for node in formulas.within]
        self.domains = self.steps.used(names.domains)
        self.changing = [name for name in self.domains if name in names.variable] if constant else None
        self.seed = f"{formulas.name}\n{self.steps.parts}"
        self.shown: Shown = set()

    def outcome(self) -> bool | str:
        """Whether both agree at all points, and nothing is left untested: cheap tests come first."""
        if self.key == self.answer:
            return True
        counts, identical = Counter[_AtPoint](), False
        for place, point in enumerate(points(self.domains, self.seed)):
            if place >= len(RANGES) and counts.total() - counts[_AtPoint.LEFT_OUT] >= LEAST_POINTS:
                break
            # The first point shows that most wrong answers are wrong, and costs less than the normal form.
            if place == 1 and (identical := self.identical()) and not self.steps.sided(self.answer):
                return True
            shown = {*self.shown}
            found = self.at(point, place, shown)
            if found is _AtPoint.DIFFERS:
                return False
            counts[found] += 1
            if found not in (_AtPoint.LEFT_OUT, _AtPoint.VAGUE):  # these show as little as their values
                self.shown = shown
        if identical and not counts[_AtPoint.LOST]:
            return self.one_sided() or True
        if counts[_AtPoint.LOST] and not counts[_AtPoint.AGREES]:
            return False
        if counts[_AtPoint.AGREES] < (LEAST_POINTS if self.domains else 1):
            return f"it has a value at fewer than {LEAST_POINTS} test points"
        if counts[_AtPoint.LOST] or counts[_AtPoint.UNCLEAR]:
            return "it has no value at some points where the right answer has one"
        if untested := self.steps.untested(self.shown):
            return f"`{shortened(reading(untested), 60)}` is too small to be tested"
        return self.one_sided() or True

    def at(self, point: Point, place: int, shown: Shown) -> _AtPoint:
        """What both are at a point; what their values show is added to `shown`."""
        pair = [point] if self.changing is None else [point, self.moved(point, self.changing, place)]
        try:
            if not all(self.steps.values(e, at, shown)[e] > 0 for e in self.within for at in pair):
                return _AtPoint.LEFT_OUT
            states = [self.steps.values(self.key, at, shown) for at in pair]
        except (NoValue, Unclear):
            return _AtPoint.LEFT_OUT
        try:
            both = zip(pair, states, strict=True)
            states = [self.steps.values(self.answer, at, shown, state) for at, state in both]
        except NoValue:
            return _AtPoint.LOST
        except Unclear:
            return _AtPoint.UNCLEAR
        return self.compared(states)

    def identical(self) -> bool:
        """Whether both have the same normal form."""
        gap = self.exactly(*self.nodes, lambda answer, key: expand(answer - key))
        return gap is not None and not gap.terms

    def exactly(self, one: Node, other: Node, combined: Callable[[Expr, Expr], Expr]) -> Expr | None:
        """Two formulas combined as exact expressions; None where that fails or would take long."""
        if sum(1 for _ in tree.nodes([one, other])) > MOST_NODES:
            return None
        with suppress(ExpressionError, ArithmeticError, ValueError, KeyError):
            return combined(_expanded(self.formulas, one), _expanded(self.formulas, other))
        return None

    def moved(self, point: Point, changing: Sequence[str], place: int) -> Point:
        """The point with other values of some names."""
        seeds = {name: f"{self.seed}\nmoved {place}\n{name}" for name in changing}
        others = {name: coordinate(seed, self.domains[name], place) for name, seed in seeds.items()}
        return {**point, **others}

    def compared(self, states: Sequence[Sequence[Ball]]) -> _AtPoint:
        """Whether two values agree.

        With a constant allowed, `states` has two states, and the change between them counts. The difference
        is vague if rounding in the larger state exceeds the value in the smaller one.
        """
        values = states[0] if len(states) == 1 else [a - b for a, b in zip(*states, strict=True)]
        places = (self.answer, self.key, *self.terms)
        gap = values[self.answer] - values[self.key]
        size = max(abs(values[place].mid()) for place in places)
        allowed = gap if self.relative is None else gap + _arb()(0, self.relative * size)
        if not allowed.contains(0):
            return _AtPoint.DIFFERS
        sizes = [max(abs(state[place].mid()) for place in places) for state in states]
        if gap.rad() <= min(size, *sizes) * VAGUE:
            return _AtPoint.AGREES
        # An exact zero, such as sin(x)^2 + cos(x)^2 - 1, is judged by the size of the terms that cancel.
        cancelling = min(sum(self.steps.size(root, state) for root in self.measured) for state in states)
        return _AtPoint.AGREES if gap.rad() <= cancelling * ROUNDING_OF_BALLS else _AtPoint.VAGUE

    def one_sided(self) -> str:
        """Why the sign inside a function leaves the outcome open; empty if it does not."""
        further = Steps()
        parts = [part for node in self.beside for part in further.sided(further.add(node))]
        for own, other in ((self.answer, self.key), (self.key, self.answer)):
            shared = [*self.steps.sided(other), *parts]
            for function, argument in self.steps.sided(own):
                place = self.steps.add(argument)
                signs = {(function, place, sign) for sign in (True, False)} & self.shown
                if len(signs) != 1 or not tree.names_in(argument) or is_positive(argument, self.domains):
                    continue
                if not any(self.proportional(argument, node) for name, node in shared if name == function):
                    words = shortened(reading(argument), 60)
                    return f"the sign of `{words}`, inside {function}, never changed in the tests"
        return ""

    def proportional(self, one: Node, other: Node) -> bool:
        """Whether one argument is positive where the other is, or nowhere else than where it is negative.

        The quotient is positive by its form, as 1/(1 - x^2)^2 is, or it, or the product, depends on positive
        parameters only.
        """
        quotient = self.exactly(one, other, lambda above, below: tidy(above / below))
        if one == other or (quotient is not None and is_positive(to_tree(quotient), self.domains)):
            return True
        steps = Steps()
        pair = steps.add(one), steps.add(other)
        real = [name for name, domain in self.domains.items() if domain == "real"]
        changes, signs = list[tuple[Ball, Ball]](), set[bool]()
        for place, point in enumerate(islice(points(self.domains, self.seed), len(RANGES))):
            with suppress(NoValue, Unclear):
                states = [steps.values(max(pair), at) for at in (point, self.moved(point, real, place))]
                (a, b), (c, d) = ([state[root] for root in pair] for state in states)
                changes.append((a * d - b * c, a * b - c * d))
                signs |= {a * b > 0} if not (a * b).contains(0) else set()
        is_fixed = any(all(gap.contains(0) for gap in gaps) for gaps in zip(*changes, strict=True))
        return len(changes) >= LEAST_POINTS and is_fixed and len(signs) == 1


# --- values of formulas at points


class NoValue(Exception):  # noqa: N818 - it is an outcome
    """A formula has no real value at a point, for sure."""


class Unclear(Exception):  # noqa: N818
    """The balls do not show whether a formula has a value at a point."""


def points(domains: Mapping[str, str], seed: str) -> Iterator[dict[str, Ball]]:
    """The points of a seed: values for all names. The ranges of sizes come again and again."""
    short = hashlib.sha512(seed.encode()).hexdigest()
    for place in range(MOST_POINTS):
        yield {name: coordinate(f"{short} {place} {name}", domain, place) for name, domain in domains.items()}


def coordinate(seed: str, domain: str, place: int) -> Ball:
    """The value of a name at one of the points: its last bits are a hash, on no lattice of floats."""
    digest = hashlib.sha512(seed.encode()).digest()
    low, high = RANGES[place % len(RANGES)]
    size = low * (high / low) ** (int.from_bytes(digest[:7], "big") / 2**56)
    tail = _arb()(int.from_bytes(digest, "big")) * 2.0**-552 + 1
    return tail * (-size if domain == "real" and digest[7] & 1 else size)


_SIDED = {"abs", "sign", "sqrt", "log", "asin", "acos", "atan", "asinh", "acosh", "atanh"}
"""Functions whose formula may differ between arguments of either sign: abs(x) is x or -x."""

Shown: TypeAlias = set[tuple[str, int, Any]]
"""What the values of formulas have shown, where parts are meant by their places.

The sign of an argument: (function, argument, True where it is positive). A term of a sum, or an argument of a
function, that was not lost beside others: ("", sum or function, term or argument).
"""


class Steps:
    """Formulas as one list of parts: what stands in several places, or formulas, is worked out once.

    A part has a kind, a detail (name, number, function or rational exponent) and the places of its operands.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.parts: list[tuple[str, Any, tuple[int, ...]]] = []
        self._places: dict[tuple[Any, ...], int] = {}
        self._decimals: dict[str, tuple[str, int]] = {}

    def add(self, node: Node, rounded: int = NEVER) -> int:
        """The place of a formula; a decimal of `rounded` figures or more is all that rounds to it."""
        detail: Any = None
        operands = tree.operands(node)
        match node:
            case tree.Name(detail) | tree.Constant(detail) | tree.Call(detail, _):
                pass
            case tree.Number(text, _):
                # A decimal that two formulas share is the same number in both, as the first of them has it.
                detail = self._decimals.setdefault(text, (text, rounded if "." in text else NEVER))
            case tree.Power(base, exponent):
                detail = _rational(exponent)
                operands = operands if detail is None else (base,)
        places = tuple([self.add(operand, rounded) for operand in operands])
        part = (type(node).__name__, detail, places)
        place = self._places.setdefault(part, len(self.parts))
        if place == len(self.parts):
            self.nodes.append(node)
            self.parts.append(part)
        return place

    @property
    def has_decimals(self) -> bool:
        """Whether a decimal in the formulas stands for all numbers that round to it."""
        return any(rounded < NEVER for _, rounded in self._decimals.values())

    def used(self, domains: Mapping[str, str]) -> dict[str, str]:
        """The domains of the names in the formulas."""
        names = {detail for kind, detail, _ in self.parts if kind == "Name"}
        return {name: domain for name, domain in domains.items() if name in names}

    def sided(self, root: int) -> list[tuple[str, Node]]:
        """The functions of _SIDED in a formula, with their arguments."""
        inside, functions = {root}, list[tuple[str, Node]]()
        for place in range(root, -1, -1):
            kind, detail, places = self.parts[place]
            if place in inside:
                inside.update(places)
                function = _function_of(kind, detail)
                functions += [(function, self.nodes[places[0]])] if function in _SIDED else []
        return functions[::-1]

    def untested(self, shown: Shown) -> Node | None:
        """A term of a sum, or an argument of a function, that was lost beside others at all points."""
        for place, (kind, _, operands) in enumerate(self.parts):
            for operand in operands if kind in ("Sum", "Call") else ():
                if ("", place, operand) not in shown:
                    return self.nodes[operand]
        return None

    def values(
        self, root: int, point: Point, shown: Shown | None = None, before: Sequence[Ball] = ()
    ) -> list[Ball]:
        """The values of all parts up to a root, of which the first have been worked out `before`.

        What they show is added to `shown`. Raises NoValue, Unclear.
        """
        values = list(before)
        for place in range(len(values), root + 1):
            kind, detail, places = self.parts[place]
            inner = [values[operand] for operand in places]
            if shown is not None:
                self._observe(place, inner, shown)
            values.append(_value(kind, detail, inner, point))
        if not values[root].is_finite():
            raise Unclear
        return values

    def size(self, root: int, values: Sequence[Ball]) -> Ball:
        """The size of a formula before its terms cancel, from the values of its parts."""
        kind, exponent, places = self.parts[root]
        is_whole_power = kind == "Power" and exponent is not None and exponent.denominator == 1
        if not is_whole_power and kind not in ("Sum", "Product", "Negative"):
            return abs(values[root].mid())
        sizes = [self.size(place, values) for place in places]
        if is_whole_power:
            return sizes[0] ** exponent.numerator
        return math.prod(sizes) if kind == "Product" else sum(sizes)

    def _observe(self, place: int, inner: list[Ball], shown: Shown) -> None:
        """Add what the values of the operands of a part show."""
        kind, detail, places = self.parts[place]
        function = _function_of(kind, detail)
        if kind == "Power" and detail is None and _whole(inner[1]) is not None:
            function = ""
        if function in _SIDED and inner[0].is_finite() and not inner[0].contains(0):
            shown.add((function, places[0], bool(inner[0] > 0)))
        if kind not in ("Sum", "Call") or all(("", place, operand) in shown for operand in places):
            return
        least = max(term.abs_upper() for term in inner) * UNTESTED if kind == "Sum" else UNTESTED
        for operand, value in zip(places, inner, strict=True):
            size = value.abs_lower()  # what may be any number is not tested, either
            is_tested = size > least and size > value.rad()
            # A plain number may be zero.
            if is_tested or (value.is_zero() and not tree.names_in(self.nodes[operand])):
                shown.add(("", place, operand))


def _function_of(kind: str, detail: Any) -> str:
    """The function of _SIDED that a part is like: x^(1/2) is a square root, x^y like exp(y log(x))."""
    if kind == "Power" and detail is None:
        return "log"
    if kind == "Power":
        return "" if detail.denominator % 2 else "sqrt"  # odd roots have one formula for either sign
    return str(detail) if kind == "Call" else ""


def _value(kind: str, detail: Any, inner: list[Ball], point: Point) -> Ball:
    """The value of a part from the values of its operands. Raises NoValue, Unclear."""
    match kind:
        case "Product":
            return math.prod(inner)
        case "Sum":
            return sum(inner)
        case "Name" if detail in point:
            return point[detail]
        case "Number":
            return _number(*detail)
        case "Negative":
            return -inner[0]
        case "Reciprocal":
            return _inverse(inner[0])
        case "Power":
            return _raised(detail, *inner)
        case "Constant":
            return _arb().pi()
        case "Call" if detail in _FUNCTIONS:
            return _called(detail, inner)
    raise Unclear  # a name or a function without a value


def _raised(exponent: Fraction | None, base: Ball, raised: Ball = None) -> Ball:
    """A power, whose base must be positive unless the exponent is a whole number."""
    rational = _whole(raised) if exponent is None else exponent
    if rational is not None and rational.denominator <= 2:
        root = base if rational.denominator == 1 else _called("sqrt", [base])
        power = root ** abs(rational.numerator)
        return power if rational >= 0 else _inverse(power)
    if base < 0:
        raise NoValue
    if base.contains(0):
        raise Unclear
    return base ** (raised if exponent is None else _ball(exponent))


def _whole(exponent: Ball) -> Fraction | None:
    """The whole number that an exponent such as 2 + k - k is, if it is one, and not too large."""
    integer = exponent.unique_fmpz() if exponent.rad() < ROUNDING_OF_BALLS else None
    return None if integer is None or abs(integer) > MAX_POWER else Fraction(int(integer))


@lru_cache(1)
def _arb() -> Any:
    """The class of balls, which takes long to load."""
    from flint import arb

    return arb


def _ball(number: Fraction) -> Ball:
    return _arb()(number.numerator) / number.denominator


@lru_cache(1024)
def _number(text: str, rounded: int) -> Ball:
    """A number as typed, with half of its last digit where it is a decimal of `rounded` figures or more.

    A decimal of an answer, of which all are `rounded`, may also be cut: 0.9166 is 11/12.
    """
    mantissa, _, exponent = text.lower().partition("e")
    decimals = mantissa.partition(".")[2]
    if abs(int(exponent or 0)) > MAX_POWER:
        raise Unclear
    fraction = Fraction(text)
    value = _ball(fraction)
    if not decimals or not fraction or len(mantissa.replace(".", "").lstrip("0")) < rounded:
        return value
    unit, most = Fraction(10) ** (int(exponent or 0) - len(decimals)), fraction * COARSEST
    below, above = min(unit / 2, most), min(unit if rounded == 1 else unit / 2, most)
    return value + _ball((above - below) / 2) + _arb()(0, _ball((above + below) / 2))


@lru_cache(1024)
def _rational(node: Node) -> Fraction | None:
    """The exponent that a formula without names is, where it is a small rational number."""
    if tree.names_in(node):
        return None
    with suppress(ExpressionError):
        number = from_tree(node).as_number
        if number is not None and max(abs(number.numerator), number.denominator) <= MAX_POWER:
            return Fraction(number)
    return None


def _inverse(value: Ball) -> Ball:
    if value.is_zero():
        raise NoValue
    if value.contains(0):
        raise Unclear
    return 1 / value


def _called(function: str, arguments: list[Ball]) -> Ball:
    """The value of a function. Raises NoValue outside of its domain, Unclear on the edge of it."""
    x = arguments[0]
    least, most = _DOMAINS.get(function, (-math.inf, math.inf))
    if x < least or x > most:
        raise NoValue
    if function == "sqrt" and x.contains(0):
        return _arb()(0, x.abs_upper().sqrt().abs_upper())
    if function == "sign" and x.contains(0) and not x.is_zero():
        raise Unclear
    value = _FUNCTIONS[function](*arguments)
    if not value.is_finite():
        raise Unclear
    return value


_DOMAINS: dict[str, tuple[float, float]] = {
    "sqrt": (0, math.inf), "log": (0, math.inf), "acosh": (1, math.inf),
    **dict.fromkeys(("asin", "acos", "atanh"), (-1, 1)),
}  # fmt: skip

_METHODS = "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt cot sec csc"

_FUNCTIONS: dict[str, Callable[..., Ball]] = {
    **{name: operator.methodcaller(name) for name in _METHODS.split()},
    "abs": abs,
    "sign": operator.methodcaller("sgn"),
    "atan2": lambda y, x: type(y).atan2(y, x),
}


_TWO = tree.Number("2", 2.0)


def is_positive(node: Node, domains: Mapping[str, str]) -> bool:
    """Whether a formula is nowhere negative by its form."""
    match node:
        case tree.Name(name):
            return domains.get(name) == "positive"
        case tree.Number() | tree.Constant() | tree.Call("exp" | "cosh" | "abs" | "sqrt" | "acos"):
            return True
        case tree.Reciprocal(operand) | tree.Call("sinh" | "asinh" | "atan" | "tanh", (operand,)):
            return is_positive(operand, domains)
        case tree.Sum((tree.Call("sqrt", (tree.Sum() as radicand,)), other)) | tree.Sum(
            (other, tree.Call("sqrt", (tree.Sum() as radicand,)))
        ) if tree.Power(other, _TWO) in radicand.terms:  # x + sqrt(x^2 + 1)
            return is_positive(radicand, domains)
        case tree.Sum(parts):
            return all(is_positive(part, domains) for part in parts)
        case tree.Product(parts):
            # Factors of either sign must stand in pairs.
            inner = [part.operand if isinstance(part, tree.Reciprocal) else part for part in parts]
            open_ = [part for part in inner if not is_positive(part, domains)]
            return all(open_.count(part) % 2 == 0 for part in open_)
        case tree.Power(base, exponent):
            rational = _rational(exponent)
            is_even = rational is not None and rational.numerator % 2 == 0
            return is_even or is_positive(base, domains)
        case _:
            return False


def _pivots(matrix: Sequence[Sequence[Ball]]) -> tuple[list[int], list[int]]:
    """The rows and the columns of pivots that are certainly not zero, by elimination."""
    rows = dict(enumerate(matrix))
    chosen, columns = list[int](), list[int]()
    for column in range(len(matrix[0])):
        usable = [place for place, row in rows.items() if not row[column].contains(0)]
        if usable:
            place = max(usable, key=lambda place: float(rows[place][column].abs_lower()))
            pivot = rows.pop(place)
            for other, row in rows.items():
                factor = row[column] / pivot[column]
                rows[other] = [a - factor * b for a, b in zip(row, pivot, strict=True)]
            chosen.append(place)
            columns.append(column)
    return sorted(chosen), columns
