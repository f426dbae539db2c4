"""Formulas as balls of python-flint, numbers with a proved bound of their error, at unforeseen points."""

from __future__ import annotations

import hashlib
import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any, TypeAlias

from rigidcli.algebra.reading import from_tree
from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.tree import Node

Ball: TypeAlias = Any
"""A ball of python-flint, `flint.arb`."""

Point: TypeAlias = Mapping[str, Ball]

BITS = 1024
"""The precision of balls: an answer must agree with its key to some 300 digits."""

RANGES = (*[(0.3, 3.0)] * 8, *[(0.02, 50.0)] * 4, *[(1e-6, 1e6)] * 4)
"""Sizes of the values of names at the first points: near to one, and far from it."""

MOST_POINTS = 400
"""The most points that are tried where a key has few values: one of a hundred is within its conditions."""

HIDDEN = 2.0**-96
"""The share of its neighbours below which a term is not seen, as it may be rounding or a narrow peak."""

COARSEST = Fraction(1, 50)
"""The most that a decimal may be off, as a share of it: 0.33 stands for a third, and 0.3 does not."""

NEVER = 10_000
"""More figures than a number has."""

TINY = 2.0**-256
"""The radius of a ball that holds nothing but rounding, as a share of the terms that cancel in it."""

MAX_POWER = 10_000
"""The largest whole exponent that is worked out exactly."""


class NoValue(Exception):  # noqa: N818 - it is an outcome
    """A formula has certainly no real value at a point."""


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
"""Functions that may have another form where their argument has the other sign."""


class Steps:
    """Formulas as one list of parts: what stands in several places, or formulas, is worked out once.

    A part has a kind, a detail (name, number, function or rational exponent) and the places of its operands.
    The values at points show more than the value of a formula: `signs` has those of the arguments of
    functions, and `unseen` the terms and arguments, by the sum or function, that are lost beside others.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.parts: list[tuple[str, Any, tuple[int, ...]]] = []
        self.signs: set[tuple[str, int, bool]] = set()
        self.unseen: set[tuple[int, int]] = set()
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
            if isinstance(node, tree.Sum | tree.Call):
                self.unseen.update((place, operand) for operand in places)
        return place

    @property
    def names(self) -> set[str]:
        """The names in the formulas."""
        return {detail for kind, detail, _ in self.parts if kind == "Name"}

    def terms(self, root: int) -> tuple[int, ...]:
        """The places of the terms of a sum; none of another formula."""
        kind, _, places = self.parts[root]
        return places if kind == "Sum" else ()

    @property
    def hidden(self) -> Node | None:
        """A term that no point has shown."""
        return self.nodes[min(self.unseen)[1]] if self.unseen else None

    def sided(self, root: int) -> list[tuple[str, int]]:
        """The functions in a formula that may have another form for the other sign, and their arguments."""
        inside, functions = {root}, list[tuple[str, int]]()
        for place in range(root, -1, -1):
            kind, detail, places = self.parts[place]
            if place in inside:
                inside.update(places)
                function = detail if kind == "Call" else _root(detail) if kind == "Power" else ""
                functions += [(function, places[0])] if function in _SIDED else []
        return functions[::-1]

    def one_sided(self, root: int, domains: Mapping[str, str]) -> Iterator[tuple[str, Node]]:
        """The functions whose argument has shown one sign only, and is not positive by its form."""
        for function, place in self.sided(root):
            argument = self.nodes[place]
            shows_one = ((function, place, True) in self.signs) != ((function, place, False) in self.signs)
            if shows_one and tree.names_in(argument) and not is_positive(argument, domains):
                yield function, argument

    def values(self, root: int, point: Point, before: Sequence[Ball] = ()) -> list[Ball]:
        """The values of all parts up to a root, of which the first have been worked out `before`.

        Raises NoValue, Unclear.
        """
        values = list(before)
        for place in range(len(values), root + 1):
            kind, detail, places = self.parts[place]
            values.append(self._value(place, kind, detail, [values[inner] for inner in places], point))
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

    def _value(self, place: int, kind: str, detail: Any, inner: list[Ball], point: Point) -> Ball:
        """The value of a part of which the operands have the values `inner`."""
        match kind:
            case "Product":
                return math.prod(inner)
            case "Sum":
                if self.unseen:
                    self._see(place, inner, max(term.abs_upper() for term in inner) * HIDDEN)
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
                return self._power(place, detail, *inner)
            case "Constant":
                return _arb().pi()
            case "Call":
                if self.unseen:
                    self._see(place, inner, HIDDEN)
                self._show(detail, place, inner[0])
                return _called(detail, inner)
        raise Unclear

    def _see(self, place: int, inner: list[Ball], least: Ball) -> None:
        """Note which operands of a part can be seen: one that is zero only where it is a plain number."""
        for operand, value in zip(self.parts[place][2], inner, strict=True):
            if (place, operand) not in self.unseen:
                continue
            size = value.abs_lower()  # what may be any number is not seen, either
            is_seen = size > least and size > value.rad()
            if is_seen or (value.is_zero() and not tree.names_in(self.nodes[operand])):
                self.unseen.discard((place, operand))

    def _show(self, function: str, place: int, value: Ball) -> None:
        """Note the sign of the argument of a part."""
        if function in _SIDED and value.is_finite() and not value.contains(0):
            self.signs.add((function, self.parts[place][2][0], bool(value > 0)))

    def _power(self, place: int, exponent: Fraction | None, base: Ball, raised: Ball = None) -> Ball:
        """A power, whose base must be positive unless the exponent is a whole number."""
        whole = exponent
        if exponent is None and raised.rad() < TINY:
            integer = raised.unique_fmpz()  # of an exponent such as 2 + k - k
            whole = None if integer is None or abs(integer) > MAX_POWER else Fraction(int(integer))
        if whole is not None and whole.denominator == 1:
            power = base ** abs(whole.numerator)
            return power if whole >= 0 else _inverse(power)
        self._show(_root(exponent), place, base)
        if exponent is not None and exponent.denominator == 2:
            root = _called("sqrt", [base]) ** abs(exponent.numerator)
            return root if exponent > 0 else _inverse(root)
        if base < 0:
            raise NoValue
        if base.contains(0):
            raise Unclear
        return base ** (raised if exponent is None else _exact(exponent))


def _root(exponent: Fraction | None) -> str:
    """The function that such a power is like: an odd root, and a whole power, have no sides."""
    return "log" if exponent is None else "" if exponent.denominator % 2 else "sqrt"


@lru_cache(1)
def _arb() -> Any:
    """The class of balls, which takes long to load."""
    from flint import arb

    return arb


def _exact(number: Fraction) -> Ball:
    """A rational number as a ball."""
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
    value = _exact(fraction)
    if not decimals or not fraction or len(mantissa.replace(".", "").lstrip("0")) < rounded:
        return value
    unit, most = Fraction(10) ** (int(exponent or 0) - len(decimals)), fraction * COARSEST
    below, above = min(unit / 2, most), min(unit if rounded == 1 else unit / 2, most)
    return value + _exact((above - below) / 2) + _arb()(0, _exact((above + below) / 2))


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
    operation = _FUNCTIONS.get(function)
    value = None if operation is None else operation(*arguments)
    if value is None or not value.is_finite():  # a function without a formula has no value
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


def pivots(matrix: Sequence[Sequence[Ball]]) -> tuple[list[int], list[int]]:
    """The rows and the columns of pivots that are certainly not zero, by elimination."""
    rows = {place: list(row) for place, row in enumerate(matrix)}
    chosen: list[int] = []
    columns: list[int] = []
    for column in range(len(matrix[0]) if matrix else 0):
        usable = [place for place in rows if place not in chosen and not rows[place][column].contains(0)]
        if not usable:
            continue
        pivot = max(usable, key=lambda place: float(rows[place][column].abs_lower()))
        for place, row in rows.items():
            if place != pivot and place not in chosen:
                factor = row[column] / rows[pivot][column]
                rows[place] = [a - factor * b for a, b in zip(row, rows[pivot], strict=True)]
        chosen.append(pivot)
        columns.append(column)
    return sorted(chosen), columns
