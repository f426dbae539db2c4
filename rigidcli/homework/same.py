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
from functools import cached_property, lru_cache
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidcli.algebra.arithmetic import weak_sign
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.substitution import from_tree
from rigidcli.errors import ComputationError, ExpressionError, shortened
from rigidcli.language import tree
from rigidcli.language.parser import read
from rigidcli.language.text import reading
from rigidcli.language.tree import Node

if TYPE_CHECKING:
    from rigidcli.homework.base import KeySource
    from rigidcli.homework.reading import Names

Ball: TypeAlias = Any  # a ball of python-flint, `flint.arb`
Point: TypeAlias = Mapping[str, Ball]  # values of names
BITS = 1024  # the precision of balls: an answer must agree with its key to some 300 digits
LARGEST_VALUE = 1e6  # the largest value of a name at a test point
# Sizes of the values of names at the first points: near to one, and far from it.
RANGES = (*[(0.3, 3.0)] * 8, *[(0.02, 50.0)] * 4, *[(1e-6, LARGEST_VALUE)] * 4)
# Points that are tried where a key has few values: one of a hundred is within its conditions.
MOST_POINTS = 400
LEAST_POINTS = 4  # points with values that an agreement needs: at fewer, it may be that of two branches only
MOST_KEPT = 64  # outcomes that are kept: a reading of an answer is chosen, and then judged
MOST_NODES = 400  # nodes of two formulas that are worked out exactly: a larger normal form takes long
VAGUE = 0.25  # a difference known less precisely than this share of the terms proves nothing
UNTESTED = 2.0**-96  # a smaller share of the largest term is not tested: it may be rounding, or a narrow peak
COARSEST = Fraction(1, 50)  # the most that a decimal may be off: 0.33 stands for a third, and 0.3 does not
NEVER = 10_000  # more figures than a number has
ROUNDING_OF_BALLS = 2.0**-256  # a share of the terms that cancel which rounding alone explains
MAX_POWER = 10_000  # the largest whole exponent that is worked out exactly


def all_same(outcomes: Iterable[bool | str]) -> bool | str:
    """Whether all are the same: no if one is not, else why one is open."""
    several = list(outcomes)
    return False not in several and next((why for why in several if why is not True), True)


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
        return all_same(self.same(node, tree.ZERO) for node in nodes)

    def values(self, node: Node, seed: str = "", most: int = len(RANGES)) -> list[Ball | None]:
        """The values of a formula at the first test points of a seed; None where it has no value."""
        from flint import ctx

        node, steps = self.names.without_derived(node), Steps()
        root, domains = steps.add(node), _domains(self.names, [node])
        with ctx.workprec(BITS):
            found = [steps.values(point)[root] for point in islice(points(domains, seed or self.name), most)]
        return [None if isinstance(value, NoValue) else value for value in found]

    def pivots(self, rows: Sequence[Sequence[Node]]) -> tuple[list[int], list[int]]:
        """The rows and columns of the pivots of a matrix, at the test point where it has the most of them."""
        from flint import ctx

        best: tuple[list[int], list[int]] = [], []
        table = [[self.values(entry) for entry in row] for row in rows]
        with ctx.workprec(BITS):
            for place in range(len(RANGES)):
                matrix = [[values[place] for values in row] for row in table]
                if all(ball is not None for row in matrix for ball in row):
                    best = max(best, _pivots(matrix), key=lambda found: len(found[0]))
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
def _exact(formulas: FormulaComparison, node: Node) -> Expr:
    return formulas.exact(node)


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
        self.relative, self.constant, self.steps = formulas.relative, constant, Steps()
        # In a key 0.5 is a half, and 0.333 may be a third.
        self.key = self.steps.add(key, 3 if self.relative is None else NEVER)
        self.answer = self.steps.add(answer, 1 if self.relative is None else NEVER)
        # What decimals leave open is measured by the terms of the key: 1.0*10^9*x - 1.0*10^9*x is vague, but
        # not in units of its own terms. What ought to be zero has no terms beside its own.
        is_zero = isinstance(key, tree.Number) and not key.value
        of_both = self.relative is None and (is_zero or not self.steps.has_decimals)
        self.measured = (self.key, self.answer) if of_both else (self.key,)
        parts = [self.steps.parts[root] for root in self.measured]
        self.terms = [term for node, _, terms in parts if isinstance(node, tree.Sum) for term in terms]
        within = [formulas.independent(node) for node in formulas.within]
        self.within = list(map(self.steps.add, within))
        self.domains = _domains(formulas.names, [answer, key, *within])
        self.seed = f"{formulas.name}\n{key}\n{answer}"
        self.counts = Counter[_AtPoint]()

    def outcome(self) -> bool | str:
        """Whether both agree at all points, and nothing is left untested: cheap tests come first."""
        if self.key == self.answer:
            return True
        for pair in chain(self.pairs(), self.crossings()):
            found = self.at(pair)
            if found is _AtPoint.DIFFERS:
                return False
            self.counts[found] += 1
            # A point shows that most wrong answers are wrong, and costs less than the normal form.
            if self.is_identical and not sided(self.nodes[0]):
                return True
        lost, agreeing = self.counts[_AtPoint.LOST], self.counts[_AtPoint.AGREES]
        if self.is_identical and not lost:
            return self.one_sided() or True
        if lost and not agreeing:
            return False
        if agreeing < (LEAST_POINTS if self.domains else 1):
            return f"it has a value at fewer than {LEAST_POINTS} test points"
        if lost or self.counts[_AtPoint.UNCLEAR]:
            return "it has no value at some points where the right answer has one"
        if untested := self.steps.untested():
            return f"`{shortened(reading(untested), 60)}` is too small to be tested"
        return self.one_sided() or True

    def pairs(self) -> Iterator[Sequence[Point]]:
        """The test points; where a constant may differ, each with another where all that varies differs.

        There are more than usual where few of them have a value of the key.
        """
        variable = self.formulas.names.variable
        changing = {name: domain for name, domain in self.domains.items() if name in variable}
        both = zip(points(self.domains, self.seed), points(changing, f"{self.seed}\nmoved"), strict=True)
        for place, (point, other) in enumerate(both):
            judged = self.counts.total() - self.counts[_AtPoint.LEFT_OUT]
            if place >= len(RANGES) and judged >= LEAST_POINTS:
                return
            yield [point, {**point, **other}] if self.constant else [point]

    def at(self, pair: Sequence[Point]) -> _AtPoint:
        """What both are at a point; where a constant may differ, their change to another point counts."""
        states = [self.steps.values(point) for point in pair]
        needed = [state[place] for state in states for place in (self.key, *self.within)]
        conditions = [state[place] for state in states for place in self.within]
        if any(isinstance(value, NoValue) for value in needed) or not all(ball > 0 for ball in conditions):
            return _AtPoint.LEFT_OUT
        missing = [state[self.answer] for state in states if isinstance(state[self.answer], NoValue)]
        if missing:
            return _AtPoint.UNCLEAR if all(isinstance(why, Unclear) for why in missing) else _AtPoint.LOST
        found = self.compared(states)
        for state in states if found is _AtPoint.AGREES else ():  # what is vague shows as little as its value
            self.steps.observe(state)
        return found

    def compared(self, states: Sequence[Sequence[Ball]]) -> _AtPoint:
        """Whether the values of both agree in one state, or change alike between two.

        The difference is vague if rounding in the larger state exceeds the value in the smaller one.
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

    @cached_property
    def is_identical(self) -> bool:
        """Whether both have the same normal form."""
        gap = self.exactly(*self.nodes, lambda answer, key: expand(answer - key))
        return gap is not None and not gap.terms

    def exactly(self, one: Node, other: Node, combined: Callable[[Expr, Expr], Expr]) -> Expr | None:
        """Two formulas combined as exact expressions; None where that fails or would take long."""
        if sum(1 for _ in tree.nodes([one, other])) > MOST_NODES:
            return None
        with suppress(ExpressionError, ArithmeticError, ValueError, KeyError):
            return combined(_exact(self.formulas, one), _exact(self.formulas, other))
        return None

    def one_sided(self) -> str:
        """Why the sign inside a function leaves the outcome open; empty if it does not."""
        for function, argument in self.of_one_sign():
            words = shortened(reading(argument), 60)
            return f"the sign of `{words}`, inside {function}, never changed in the tests"
        return ""

    def crossings(self) -> Iterator[Sequence[Point]]:
        """Points beyond the zeros of arguments of one sign, each by a double step of Newton's method.

        The formula may be another one there: abs(x - 60) is 60 - x at most test points. Zeros that are
        farther away than any test point stay untested.
        """
        changing = self.domains.keys() & (self.formulas.names.variable if self.constant else self.domains)
        for _, argument in list(self.of_one_sign()):
            place = self.steps.add(argument)
            for point in islice(points(self.domains, self.seed), LEAST_POINTS):
                for name in sorted(changing & tree.names_in(argument)):
                    x = point[name]
                    here, there = (self.steps.values({**point, name: each})[place] for each in (x, 2 * x))
                    if isinstance(here, NoValue) or isinstance(there, NoValue):
                        continue
                    beyond = x - 2 * here * x / (there - here)
                    if abs(beyond) < LARGEST_VALUE and (self.domains[name] == "real" or beyond > 0):
                        crossing = {**point, name: beyond}
                        yield [crossing, point] if self.constant else [crossing]

    def of_one_sign(self) -> Iterator[tuple[str, Node]]:
        """Functions of _SIDED whose arguments had one sign at all points, and stand in one formula only."""
        for own, other in (self.nodes, self.nodes[::-1]):
            shared = [pair for node in (other, *self.beside) for pair in sided(node)]
            for function, argument in sided(own):
                place = self.steps.add(argument)
                signs = {(function, place, True), (function, place, False)} & self.steps.signs
                if len(signs) != 1 or not tree.names_in(argument):
                    continue
                # The quotient of two arguments may have one sign, too, as 1/(1 - x^2)^2 has.
                alike = [node for name, node in shared if name == function]
                if argument not in alike and not any(
                    self.has_one_sign(argument, below) for below in (tree.ONE, *alike)
                ):
                    yield function, argument

    def has_one_sign(self, above: Node, below: Node) -> bool:
        """Whether a quotient has one sign by its form.

        A root outweighs what has a smaller square: x + sqrt(x^2 + 1) is positive.
        """
        quotient = self.exactly(above, below, operator.truediv)
        if quotient is None:
            return False
        with suppress(ComputationError, ExpressionError):
            if quotient.sign() is not None or weak_sign(quotient) is not None:
                return True
            roots = [Expr({m: c}) for m, c in quotient.terms.items() if any(n.denominator > 1 for _, n in m)]
            for root in roots:
                excess = weak_sign(root**2 - (quotient - root) ** 2)
                if root.sign() is not None and excess is not None and excess[0] == 1:
                    return True
        return False


# --- values of formulas at points


class NoValue(Exception):  # noqa: N818 - it is an outcome
    """A formula has no real value at a point, for sure."""


class Unclear(NoValue):
    """The balls do not show whether a formula has a value at a point."""


def points(domains: Mapping[str, str], seed: str) -> Iterator[dict[str, Ball]]:
    """The points of a seed: values for all names, whose last bits are a hash, on no lattice of floats.

    The ranges of sizes come again and again.
    """
    short = hashlib.sha512(seed.encode()).hexdigest()
    for place in range(MOST_POINTS):
        point = {}
        for name, domain in domains.items():
            digest = hashlib.sha512(f"{short} {place} {name}".encode()).digest()
            low, high = RANGES[place % len(RANGES)]
            size = low * (high / low) ** (int.from_bytes(digest[:7], "big") / 2**56)
            tail = _arb()(int.from_bytes(digest, "big")) * 2.0**-552 + 1
            point[name] = tail * (-size if domain == "real" and digest[7] & 1 else size)
        yield point


def _domains(names: Names, nodes: Sequence[Node]) -> dict[str, str]:
    used = set[str]().union(*map(tree.names_in, nodes))
    return {name: domain for name, domain in names.domains.items() if name in used}


class Steps:
    """Formulas as one list of parts: what stands in several places, or formulas, is worked out once.

    A part is a formula with its detail (the digits of a number, the rational exponent of a power) and the
    places of its operands. `signs` has the signs of arguments that have been seen: (function, place of its
    argument, whether that is positive). `tested` has the terms of sums, and the arguments of functions, that
    were not lost beside others: (place of the sum, place of the term).
    """

    def __init__(self) -> None:
        self.parts: list[tuple[Node, Any, tuple[int, ...]]] = []
        self.signs: set[tuple[str, int, bool]] = set()
        self.tested: set[tuple[int, int]] = set()
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
        part = (type(node), detail, places)
        place = self._places.setdefault(part, len(self.parts))
        if place == len(self.parts):
            self.parts.append((node, detail, places))
        return place

    @property
    def has_decimals(self) -> bool:
        """Whether a decimal in the formulas stands for all numbers that round to it."""
        return any(rounded < NEVER for _, rounded in self._decimals.values())

    def values(self, point: Point) -> list[Ball]:
        """The values of all parts at a point, NoValue or Unclear where there is none."""
        values = list[Ball]()
        for node, detail, places in self.parts:
            inner = [values[place] for place in places]
            missing = [value for value in inner if isinstance(value, NoValue)]
            try:
                values.append(missing[0] if missing else _value(node, detail, inner, point))
            except NoValue as why:
                values.append(why)
        return values

    def size(self, root: int, values: Sequence[Ball]) -> Ball:
        """The size of a formula before its terms cancel, from the values of its parts."""
        node, exponent, places = self.parts[root]
        match node:
            case tree.Sum() | tree.Negative():
                return sum(self.size(place, values) for place in places)
            case tree.Product():
                return math.prod(self.size(place, values) for place in places)
            case tree.Power() if exponent is not None and exponent.denominator == 1:
                return self.size(places[0], values) ** exponent.numerator
        return abs(values[root].mid())

    def observe(self, values: Sequence[Ball]) -> None:
        """Note what the values of all parts show."""
        for place, (node, detail, operands) in enumerate(self.parts):
            inner = [values[operand] for operand in operands]
            function = function_of(node)
            is_whole = isinstance(node, tree.Power) and detail is None and _whole(inner[1]) is not None
            if function and not is_whole and not inner[0].contains(0):
                self.signs.add((function, operands[0], bool(inner[0] > 0)))
            if isinstance(node, tree.Sum | tree.Call):
                least = UNTESTED
                if isinstance(node, tree.Sum):
                    least = max(value.abs_upper() for value in inner) * UNTESTED
                for operand, value in zip(operands, inner, strict=True):
                    size = value.abs_lower()
                    # What may be any number is not tested, either; a plain number may be zero.
                    is_zero = value.is_zero() and not tree.names_in(self.parts[operand][0])
                    if (size > least and size > value.rad()) or is_zero:
                        self.tested.add((place, operand))

    def untested(self) -> Node | None:
        """A term of a sum, or an argument of a function, that was lost beside others at all points."""
        for place, (node, _, operands) in enumerate(self.parts):
            for operand in operands if isinstance(node, tree.Sum | tree.Call) else ():
                if (place, operand) not in self.tested:
                    return self.parts[operand][0]
        return None


def _value(node: Node, detail: Any, inner: list[Ball], point: Point) -> Ball:
    """The value of a part from the values of its operands. Raises NoValue, Unclear."""
    match node:
        case tree.Product():
            return math.prod(inner)
        case tree.Sum():
            return sum(inner)
        case tree.Name(name) if name in point:
            return point[name]
        case tree.Number():
            return _number(*detail)
        case tree.Negative():
            return -inner[0]
        case tree.Reciprocal():
            return _inverse(inner[0])
        case tree.Power():
            return _raised(detail, *inner)
        case tree.Constant():
            return _arb().pi()
        case tree.Call(function) if function in _FUNCTIONS:
            return _called(function, inner)
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
    return _finite(base ** (raised if exponent is None else _ball(exponent)))


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


def _finite(value: Ball) -> Ball:
    if not value.is_finite():
        raise Unclear
    return value


@lru_cache(1024)
def _number(text: str, rounded: int) -> Ball:
    """A number as typed, with half of its last digit where it is a decimal of `rounded` figures or more.

    A decimal of an answer, of which all are `rounded`, may also be cut: 0.9166 is 11/12. What is cut is off
    by less than one unit of its last digit: 0.99 is not 1, which is cut to 1.00.
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
    # Roots and quotients make balls wider, by about this share of a unit.
    whole = unit * (1 - 2 * min(unit / fraction, COARSEST))
    below, above = min(unit / 2, most), min(whole if rounded == 1 else unit / 2, most)
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
    if value.contains(0):
        raise NoValue if value.is_zero() else Unclear
    return 1 / value


def _called(function: str, arguments: list[Ball]) -> Ball:
    """The value of a function. Raises NoValue outside of its domain, Unclear on the edge of it."""
    x = arguments[0]
    least, most = _DOMAINS.get(function, (-math.inf, math.inf))
    if x < least or x > most:
        raise NoValue
    return _finite(_FUNCTIONS[function](*arguments))


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


# --- the form of formulas

# Functions whose formula may differ between arguments of either sign: abs(x) is x or -x.
_SIDED = {"abs", "sign", "sqrt", "log", "asin", "acos", "atan", "asinh", "acosh", "atanh"}


def function_of(node: Node) -> str:
    """The function of _SIDED that a part is like: x^(1/2) is a square root, and x^y is exp(y log(x))."""
    match node:
        case tree.Call(function, _) if function in _SIDED:
            return function
        case tree.Power(_, exponent):
            rational = _rational(exponent)
            odd_root = rational is not None and rational.denominator % 2  # it has one formula for either sign
            return "log" if rational is None else "" if odd_root else "sqrt"
    return ""


def sided(node: Node) -> list[tuple[str, Node]]:
    """The functions of _SIDED in a formula, with their arguments, the first to be worked out first."""
    parts = reversed(list(tree.nodes([node])))
    found = [(name, tree.operands(part)[0]) for part in parts if (name := function_of(part))]
    return list(dict.fromkeys(found))


def _pivots(matrix: Sequence[Sequence[Ball]]) -> tuple[list[int], list[int]]:
    """The rows and the columns of pivots that are certainly not zero, by elimination."""
    rows = dict(enumerate(matrix))
    chosen, columns = list[int](), list[int]()
    for column in range(len(matrix[0]) if matrix else 0):
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
