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
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidcli.algebra.arithmetic import weak_sign
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, number, symbol
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ComputationError, ExpressionError, shortened
from rigidcli.language import tree
from rigidcli.language.parser import read
from rigidcli.language.text import reading
from rigidcli.language.tree import Kind, Node, Parts, fold

if TYPE_CHECKING:
    from rigidcli.homework.base import KeySource
    from rigidcli.homework.reading import Names

Ball: TypeAlias = Any  # a ball of python-flint, `flint.arb`
Point: TypeAlias = Mapping[str, Ball]  # values of names
BITS = 1024  # the precision of balls: an answer must agree with its key to some 300 digits
# Sizes of the values of names at the first points: near to one, and far from it.
RANGES = (*[(0.3, 3.0)] * 8, *[(0.02, 50.0)] * 4, *[(1e-6, 1e6)] * 4)
# Points that are tried where a key has few values: one of a hundred is within its conditions.
MOST_POINTS = 400
LEAST_POINTS = 4  # points with values that an agreement needs: at fewer, it may be that of two branches only
MOST_KEPT = 64  # outcomes that are kept: a reading of an answer is chosen, and then judged
MOST_NODES = 300  # nodes of a formula that is worked out exactly: a larger normal form takes long
# The largest shares of the terms by which decimals, and by which rounding alone may leave a difference open.
VAGUE, ROUNDING_OF_BALLS = 0.25, 2.0**-256
UNTESTED = 2.0**-96  # a smaller share of the largest term is not tested: it may be rounding, or a narrow peak
COARSEST = Fraction(1, 50)  # the most that a decimal may be off: 0.33 stands for a third, and 0.3 does not
NEVER = 10_000  # more figures than a number has
NOT_EXACT = (ExpressionError, ComputationError, ArithmeticError, ValueError, KeyError)
MAX_POWER = 10_000  # the largest number in an exponent that is worked out exactly


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

        node = self.names.without_derived(node)
        values = list[Ball | None]()
        with ctx.workprec(BITS):
            for point in islice(points(_domains(self.names, [node]), seed or self.name), most):
                try:
                    values.append(value_at(point, node, _BALLS))
                except NoValue:
                    values.append(None)
        return values

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
    if sum(1 for _ in tree.nodes([node])) > MOST_NODES:
        raise ExpressionError("the formula is too long")
    return formulas.exact(node)


class _AtPoint(Enum):
    """What is found of an answer and its key at a point, or of their change between two."""

    LEFT_OUT = "the key has no value there, or the conditions of the question do not hold"
    LOST = "the answer has no value there"
    UNCLEAR = "the answer may have no value there"
    VAGUE = "the difference is too vague to say whether they agree"
    AGREES = "they agree"
    DIFFERS = "they differ"


class _Comparison:
    """An answer and its key, in independent names, at the points that follow from both.

    At the points `agreeing` they were found to be the same.
    """

    def __init__(
        self, formulas: FormulaComparison, answer: Node, key: Node, beside: Sequence[Node], constant: bool
    ) -> None:
        self.formulas, self.beside = formulas, beside
        self.relative, self.constant = formulas.relative, constant
        self.within = list(map(formulas.independent, formulas.within))
        # In a key 0.5 is a half, and 0.333 may be a third.
        rounded = dict.fromkeys(_decimals(answer), 1) | dict.fromkeys(_decimals(key), 3)
        self.has_decimals = self.relative is None and bool(rounded)
        if self.has_decimals:
            answer, key = _with_exact_exponents(answer), _with_exact_exponents(key)
            self.kind = _BALLS._replace(number=lambda text, _: _number(text, rounded.get(text, NEVER)))
        else:
            self.kind = _BALLS
        self.answer, self.key = answer, key
        self.domains = _domains(formulas.names, [answer, key, *self.within])
        self.seed = f"{formulas.name}\n{key}\n{answer}"
        self.counts = Counter[_AtPoint]()
        self.agreeing = list[Point]()

    def outcome(self) -> bool | str:
        """Whether both agree at all points, and nothing is left untested: cheap tests come first."""
        if self.key == self.answer:
            return True
        for pair in self.pairs():
            found = self.at(pair)
            if found is _AtPoint.DIFFERS:
                return False
            self.counts[found] += 1
            # A point shows that most wrong answers are wrong, and costs less than the normal form.
            if found is _AtPoint.AGREES and self.is_identical and self.has_values_of_key:
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
        if untested := self.untested():
            return f"`{shortened(reading(untested), 60)}` is too small to be tested"
        return self.one_sided() or True

    def pairs(self) -> Iterator[Sequence[Point]]:
        """The test points; where a constant may differ, each with another where all that varies differs.

        There are more than usual where few of them have a value of the key.
        """
        variable = self.formulas.names.variable
        changing = {name: domain for name, domain in self.domains.items() if name in variable}
        moved = points(changing, f"{self.seed}\nmoved")
        for place, point in enumerate(points(self.domains, self.seed)):
            judged = self.counts.total() - self.counts[_AtPoint.LEFT_OUT]
            if place >= len(RANGES) and judged >= LEAST_POINTS:
                return
            yield [point, {**point, **next(moved)}] if self.constant else [point]

    def at(self, pair: Sequence[Point]) -> _AtPoint:
        """What both are at a point; where a constant may differ, their change to another point counts."""
        try:
            keys = [self.value(point, self.key) for point in pair]
            if not all(self.value(point, condition) > 0 for point in pair for condition in self.within):
                return _AtPoint.LEFT_OUT
        except NoValue:
            return _AtPoint.LEFT_OUT
        try:
            answers = [self.value(point, self.answer) for point in pair]
        except Unclear:
            return _AtPoint.UNCLEAR
        except NoValue:
            return _AtPoint.LOST
        own, right = _change(answers), _change(keys)
        gap = allowed = own - right
        if self.relative is not None:
            parts = self.key.terms if isinstance(self.key, tree.Sum) else ()
            terms = [_change([self.value(point, part) for point in pair]) for part in parts]
            allowed = gap + _arb()(0, self.relative * max(abs(each.mid()) for each in (own, right, *terms)))
        if not allowed.contains(0):
            return _AtPoint.DIFFERS
        most = VAGUE if self.has_decimals else ROUNDING_OF_BALLS
        is_clear = gap.rad() <= most * min(abs(key.mid()) for key in keys)
        if not (is_clear or gap.rad() <= most * min(map(self.size, pair))):
            return _AtPoint.VAGUE
        self.agreeing += pair  # a point where the difference is vague shows as little as this
        return _AtPoint.AGREES

    def value(self, point: Point, node: Node) -> Ball:
        """The value of a formula at a point, its decimals all that rounds to them. Raises NoValue."""
        return value_at(point, node, self.kind)

    def size(self, point: Point) -> Ball:
        """The size of the key before its terms cancel, as those of sin(x)^2 + cos(x)^2 - 1 do.

        What decimals leave open is measured by the key: 1.0*10^9*x - 1.0*10^9*x is vague, but not in units of
        its own terms. What ought to be zero has no terms beside its own.
        """
        is_zero = isinstance(self.key, tree.Number) and not self.key.value
        nodes = [self.key, self.answer] if is_zero or not self.has_decimals else [self.key]
        return sum(_size(node, lambda part: self.value(point, part)) for node in nodes)

    @cached_property
    def is_identical(self) -> bool:
        """Whether both have the same normal form."""
        with suppress(*NOT_EXACT):
            return not expand(self.exact(self.answer) - self.exact(self.key)).terms
        return False

    @cached_property
    def has_values_of_key(self) -> bool:
        """Whether an answer of the same normal form has a value, the same, wherever the key has one."""
        functions = {name for name, _ in sided(self.answer)}
        return functions.isdisjoint(("asin", "acos", "acosh", "atanh")) and not self.one_sided()

    def exact(self, node: Node) -> Expr:
        """A formula as an exact expression. Raises NOT_EXACT where that fails or would take long."""
        return _exact(self.formulas, node)

    def untested(self) -> Node | None:
        """A term of a sum, or an argument of a function, that was lost beside others at all points."""
        for node in _parts([self.key, self.answer]):
            if isinstance(node, tree.Sum | tree.Call):
                lost = tree.operands(node)
                for point in self.agreeing:
                    lost = lost and self.lost(node, lost, point)
                if lost:
                    return lost[0]
        return None

    def lost(self, node: Node, some: Sequence[Node], point: Point) -> tuple[Node, ...]:
        """Those of some terms or arguments that are lost at a point, or that may be any number."""
        values = {part: self.value(point, part) for part in tree.operands(node)}
        sizes = [value.abs_upper() for value in values.values()]
        largest = max(sizes) if isinstance(node, tree.Sum) else 1
        return tuple(part for part in some if not _is_seen(part, values[part], largest))

    def one_sided(self) -> str:
        """Why the sign inside a function leaves the outcome open; empty if it does not.

        It does not where the sign follows from the form of the argument, or from that of its quotient by an
        argument of the same function in the other formula, as in 1/(1 - x^2)^2.
        """
        answer, key = sided(self.answer), sided(self.key)
        beside = [pair for node in self.beside for pair in sided(node)]
        for own, shared in ((answer, key + beside), (key, answer + beside)):
            for function, argument in own:
                balls = [self.value(point, argument) for point in self.agreeing]
                signs = {bool(ball > 0) for ball in balls if not ball.contains(0)}
                alike = [node for name, node in shared if name == function]
                if len(signs) != 1 or not tree.names_in(argument) or argument in alike:
                    continue
                if not any(self.has_one_sign(argument, below) for below in (tree.ONE, *alike)):
                    words = shortened(reading(argument), 60)
                    return f"the sign of `{words}`, inside {function}, never changed in the tests"
        return ""

    def has_one_sign(self, above: Node, below: Node) -> bool:
        """Whether a quotient has one sign by its form.

        A root outweighs what has a smaller square: x + sqrt(x^2 + 1) is positive.
        """
        with suppress(*NOT_EXACT):
            quotient = self.exact(above) / self.exact(below)
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


def value_at(point: Point, node: Node, kind: Kind) -> Ball:
    """The value of a formula at a point, of a kind of balls. Raises NoValue, Unclear."""

    def value(name: str) -> Ball:
        if name not in point:
            raise Unclear
        return point[name]

    return fold(node, value, kind)


def _product(factors: Parts) -> Ball:
    return math.prod(_inverse(value) if divides else value for divides, value in factors)


def _power(base: Ball, exponent: Ball) -> Ball:
    """A power, whose base must be positive unless the exponent is a whole number, or a half one."""
    if abs(exponent) <= MAX_POWER and (halves := (2 * exponent).unique_fmpz()) is not None:
        power = base ** abs(halves // 2) if halves % 2 == 0 else _called("sqrt", [base]) ** abs(halves)
        return power if halves >= 0 else _inverse(power)
    if base < 0:
        raise NoValue
    if base.contains(0):
        raise Unclear
    return _finite(base**exponent)


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
    if text == "pi":
        return _arb().pi()
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


def _inverse(value: Ball) -> Ball:
    if value.contains(0):
        raise NoValue if value.is_zero() else Unclear
    return 1 / value


def _called(function: str, arguments: list[Ball]) -> Ball:
    """The value of a function. Raises NoValue outside of its domain, Unclear on the edge of it."""
    if function not in _FUNCTIONS:
        raise Unclear
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


_BALLS = Kind(
    number=lambda text, _: _number(text, NEVER),
    negative=operator.neg,
    sum=lambda terms: sum(-value if is_subtracted else value for is_subtracted, value in terms),
    product=_product,
    power=_power,
    call=_called,
)


def _change(values: Sequence[Ball]) -> Ball:
    """The value at one point, or how much it changes between two."""
    return values[0] - values[1] if len(values) > 1 else values[0]


def _size(node: Node, value: Callable[[Node], Ball]) -> Ball:
    """The size of a formula before its terms cancel, from the values of its parts."""
    match node:
        case tree.Sum(parts):
            return sum(_size(part, value) for part in parts)
        case tree.Product(parts):
            return math.prod(_size(part, value) for part in parts)
        case tree.Negative(operand):
            return _size(operand, value)
        case tree.Power(base, tree.Number(_, exponent)) if float(exponent).is_integer():
            return _size(base, value) ** int(exponent)
    return abs(value(node).mid())


def _is_seen(part: Node, value: Ball, largest: Ball) -> bool:
    if value.is_zero() and not tree.names_in(part):
        return True  # a plain number may be zero
    return bool(value.abs_lower() > largest * UNTESTED and value.abs_lower() > value.rad())


# --- the form of formulas

# Functions whose formula may differ between arguments of either sign: abs(x) is x or -x.
_SIDED = {"abs", "sign", "sqrt", "log", "asin", "acos", "atan", "asinh", "acosh", "atanh"}


@lru_cache(1024)
def _rational(node: Node) -> Fraction | None:
    """The exponent that a formula is, where that is a small rational number, as 2 + k - k is."""
    with suppress(ExpressionError):
        value = from_tree(node).as_number
        if value is not None and max(abs(value.numerator), value.denominator) <= MAX_POWER:
            return Fraction(value)
    return None


def _with_exact_exponents(node: Node) -> Node:
    """The formula with fractions for rational exponents, of which no decimal stands for others."""
    if isinstance(node, tree.Power) and (exponent := _rational(node.exponent)) is not None:
        return tree.Power(_with_exact_exponents(node.base), to_tree(number(exponent)))
    return tree.rebuilt(node, _with_exact_exponents)


def _parts(formulas: Sequence[Node]) -> Iterator[Node]:
    """All parts of formulas, each behind those that it is made of."""
    return reversed(list(tree.nodes(formulas)))


def _decimals(node: Node) -> set[str]:
    """The decimals in a formula, as they were typed."""
    return {part.text for part in tree.nodes([node]) if isinstance(part, tree.Number) and "." in part.text}


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
    """The functions of _SIDED in a formula, with their arguments."""
    found = [(name, tree.operands(part)[0]) for part in _parts([node]) if (name := function_of(part))]
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
