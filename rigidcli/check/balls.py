"""Formulas as balls of python-flint, numbers with a proved bound of their error, at unforeseen points."""

from __future__ import annotations

import hashlib
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any, TypeAlias

from rigidcli.language import tree
from rigidcli.language.tree import Node

Ball: TypeAlias = Any
"""A ball of python-flint, `flint.arb`."""

Point: TypeAlias = Mapping[str, Ball]

BITS = 1024
"""The precision of balls: an answer must agree with its key to some 300 digits."""

TAIL = 512
"""Bits of a value of a name that come from a hash: no lattice of floats holds such points."""

RANGES = (*[(0.3, 3.0)] * 8, *[(0.02, 50.0)] * 4, *[(1e-6, 1e6)] * 4)
"""Sizes of the values of names at the points: near to one, and far from it."""

HIDDEN = 2.0**-96
"""The share of its neighbours below which a term is not seen, as it may be rounding or a narrow peak."""

COARSEST = Fraction(1, 50)
"""The most that a decimal may be off, as a share of it: 0.33 stands for a third, and 0.3 does not."""

NEVER = 10_000
"""More figures than a number has."""

TINY = 2.0**-256
"""The radius of a ball that holds nothing but rounding."""

MAX_POWER = 10_000
"""The largest whole exponent that is worked out exactly."""


class NoValue(Exception):  # noqa: N818 - it is an outcome
    """A formula has certainly no real value at a point."""


class Unclear(Exception):  # noqa: N818
    """The balls do not show whether a formula has a value at a point."""


def points(domains: Mapping[str, str], seed: str) -> Iterator[dict[str, Ball]]:
    """The points of a seed: values for all names."""
    for place in range(len(RANGES)):
        yield {
            name: coordinate(f"{seed}\n{place}\n{name}", domain, place) for name, domain in domains.items()
        }


def coordinate(seed: str, domain: str, place: int) -> Ball:
    """The value of a name at one of the points."""
    from flint import arb

    digest = hashlib.sha512(seed.encode()).digest()
    low, high = RANGES[place]
    size = low * (high / low) ** (int.from_bytes(digest[:7], "big") / 2**56)
    tail = 1 + arb(int.from_bytes(digest, "big")) / arb(2) ** (TAIL + 40)
    return arb(size) * tail * (-1 if domain == "real" and digest[7] & 1 else 1)


_SIDED = {"abs", "sign", "sqrt", "log", "asin", "acos", "atan", "asinh", "acosh", "atanh"}
"""Functions that may have another form where their argument has the other sign."""


class Walk:
    """A formula at points: its values, and what they show of its terms and of the signs in it.

    A decimal with at least `rounded` figures is the ball of all numbers that round to it.
    """

    def __init__(self, node: Node, rounded: int = NEVER) -> None:
        self.node = node
        self.rounded = rounded
        self.signs: dict[tuple[str, Node], set[int]] = {}
        self.unseen: dict[int, Node] = {}
        self.seen = set[int]()
        self._values: dict[int, Ball] = {}

    def value(self, point: Point) -> Ball:
        """The value at a point. Raises NoValue, Unclear."""
        self._values = {}
        value = self.of(self.node, point)
        if not value.is_finite():
            raise Unclear
        return value

    @property
    def hidden(self) -> Node | None:
        """A term that no point has shown."""
        return next((term for place, term in self.unseen.items() if place not in self.seen), None)

    def one_sided(self, domains: Mapping[str, str]) -> Iterator[tuple[str, Node]]:
        """The functions whose argument has shown one sign only, and is not positive by its form."""
        for (function, argument), signs in self.signs.items():
            varies = bool(tree.names_in(argument))
            if varies and len(signs) == 1 and not _is_positive(argument, domains):
                yield function, argument

    def of(self, node: Node, point: Point) -> Ball:
        """The value of a part of the formula, which may stand in it more than once."""
        place = id(node)
        if place not in self._values:
            self._values[place] = self._of(node, point)
        return self._values[place]

    def _of(self, node: Node, point: Point) -> Ball:
        match node:
            case tree.Name(name):
                if name not in point:
                    raise Unclear
                return point[name]
            case tree.Number(text, _):
                return _number(text, self.rounded)
            case tree.Constant():
                return _pi()
            case tree.Negative(operand):
                return -self.of(operand, point)
            case tree.Reciprocal(operand):
                return _inverse(self.of(operand, point))
            case tree.Sum(terms):
                return self.sum(terms, point)
            case tree.Product(factors):
                return math.prod(self.of(factor, point) for factor in factors)
            case tree.Power(base, exponent):
                return self.power(base, exponent, point)
            case tree.Call(function, arguments):
                inner = [self.of(argument, point) for argument in arguments]
                for argument, value in zip(arguments, inner, strict=True):
                    self.note(argument, bool(value.is_zero() or value.abs_upper() > HIDDEN))
                if function in _SIDED:
                    self.show(function, arguments[0], inner[0])
                return _call(function, inner)

    def sum(self, terms: tuple[Node, ...], point: Point) -> Ball:
        """The value of a sum, of which the terms that can be seen are noted."""
        found = [self.of(term, point) for term in terms]
        sizes = [abs(value) for value in found]
        least = max(size.abs_upper() for size in sizes) * HIDDEN
        for term, size in zip(terms, sizes, strict=True):
            self.note(term, bool(size.abs_lower() > least or (size.is_zero() and not tree.names_in(term))))
        return sum(found)

    def note(self, term: Node, is_seen: bool) -> None:
        """Note whether a term can be seen beside the others at a point."""
        self.unseen[id(term)] = term
        if is_seen:
            self.seen.add(id(term))

    def power(self, base: Node, exponent: Node, point: Point) -> Ball:
        """The value of a power, whose base must be positive unless the exponent is a whole number."""
        value, rational = self.of(base, point), _rational(exponent)
        if rational is None:
            raised = self.of(exponent, point)
            whole = raised.unique_fmpz() if raised.rad() < TINY else None
            if whole is not None and abs(whole) <= MAX_POWER:  # an exponent such as 2 + k - k
                rational = Fraction(int(whole))
        if rational is not None and rational.denominator == 1:
            raised = value ** abs(int(rational))
            return raised if rational >= 0 else _inverse(raised)
        if rational is None or rational.denominator % 2 == 0:
            self.show("sqrt" if rational is not None else "log", base, value)
        if rational is not None and rational.denominator == 2:
            root = _call("sqrt", [value]) ** abs(rational.numerator)
            return root if rational > 0 else _inverse(root)
        if value < 0:
            raise NoValue
        if value.contains(0):
            raise Unclear
        return value ** self.of(exponent, point)

    def show(self, function: str, argument: Node, value: Ball) -> None:
        """Note the sign of an argument."""
        if not value.contains(0) and value.is_finite():
            self.signs.setdefault((function, argument), set()).add(1 if value > 0 else -1)
        else:
            self.signs.setdefault((function, argument), set())


@lru_cache(1)
def _pi() -> Ball:
    from flint import arb, ctx

    with ctx.workprec(BITS):
        return arb.pi()


@lru_cache(1024)
def _number(text: str, rounded: int) -> Ball:
    """A number as typed, with half of its last digit where it is a decimal of `rounded` figures or more."""
    from flint import arb, ctx, fmpq

    mantissa, _, exponent = text.lower().partition("e")
    decimals = mantissa.partition(".")[2]
    if abs(int(exponent or 0)) > MAX_POWER:
        raise Unclear
    fraction = Fraction(text)
    with ctx.workprec(BITS):
        value = arb(fmpq(fraction.numerator, fraction.denominator))
        if not decimals or not fraction or len(mantissa.replace(".", "").lstrip("0")) < rounded:
            return value
        half = min(Fraction(10) ** (int(exponent or 0) - len(decimals)) / 2, fraction * COARSEST)
        return value + arb(0, arb(fmpq(half.numerator, half.denominator)))


def _rational(node: Node) -> Fraction | None:
    """The exponent that a formula without names is, where it is a small rational number."""
    match node:
        case tree.Number(text, value):
            return Fraction(text) if abs(value) <= MAX_POWER and len(text) < 20 else None
        case tree.Negative(operand):
            inner = _rational(operand)
            return None if inner is None else -inner
        case tree.Reciprocal(operand):
            inner = _rational(operand)
            return 1 / inner if inner else None
        case tree.Sum(parts) | tree.Product(parts):
            found = [_rational(part) for part in parts]
            if any(part is None for part in found):
                return None
            total = Fraction(0) if isinstance(node, tree.Sum) else Fraction(1)
            for part in found:
                assert part is not None
                total = total + part if isinstance(node, tree.Sum) else total * part
            return total if abs(total) <= MAX_POWER and total.denominator <= MAX_POWER else None
        case _:
            return None


def _inverse(value: Ball) -> Ball:
    if value.is_zero():
        raise NoValue
    if value.contains(0):
        raise Unclear
    return 1 / value


def _call(function: str, arguments: list[Ball]) -> Ball:
    """The value of a function. Raises NoValue outside of its domain, Unclear on the edge of it."""
    from flint import arb

    x = arguments[0]
    least, most = _DOMAINS.get(function, (None, None))
    if (least is not None and x < least) or (most is not None and x > most):
        raise NoValue
    if function == "sqrt" and x.contains(0):
        return arb(0, x.abs_upper().sqrt().abs_upper())
    if function == "sign" and x.contains(0) and not x.is_zero():
        raise Unclear
    operation = _FUNCTIONS.get(function)
    if operation is None:  # a function without a formula
        raise Unclear
    value = operation(*arguments)
    if not value.is_finite():
        raise Unclear
    return value


_DOMAINS: dict[str, tuple[int | None, int | None]] = {
    "sqrt": (0, None), "log": (0, None), "acosh": (1, None),
    **dict.fromkeys(("asin", "acos", "atanh"), (-1, 1)),
}  # fmt: skip

_METHODS = "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt cot sec csc"

_FUNCTIONS: dict[str, Callable[..., Ball]] = {
    **{name: operator.methodcaller(name) for name in _METHODS.split()},
    "abs": abs,
    "sign": operator.methodcaller("sgn"),
    "atan2": lambda y, x: type(y).atan2(y, x),
}


def _is_positive(node: Node, domains: Mapping[str, str]) -> bool:
    """Whether a formula is nowhere negative by its form."""
    match node:
        case tree.Name(name):
            return domains.get(name) == "positive"
        case tree.Number() | tree.Constant() | tree.Call("exp" | "cosh" | "abs" | "sqrt" | "acos"):
            return True
        case tree.Reciprocal(operand):
            return _is_positive(operand, domains)
        case tree.Sum(parts):
            return all(_is_positive(part, domains) for part in parts)
        case tree.Product(parts):
            return _is_square(parts, domains)
        case tree.Power(base, exponent):
            rational = _rational(exponent)
            is_even = rational is not None and rational.numerator % 2 == 0
            return is_even or _is_positive(base, domains)
        case tree.Call("sinh" | "asinh" | "atan" | "tanh", (argument,)):
            return _is_positive(argument, domains)
        case _:
            return False


def _is_square(factors: tuple[Node, ...], domains: Mapping[str, str]) -> bool:
    """Whether a product has only positive factors, and others in pairs."""
    open_: list[Node] = []
    for factor in factors:
        inner = factor.operand if isinstance(factor, tree.Reciprocal) else factor
        if not _is_positive(inner, domains):
            open_.remove(inner) if inner in open_ else open_.append(inner)
    return not open_
