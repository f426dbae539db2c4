"""Values of expression trees at points, each with a proved bound of its error.

They are balls of python-flint: F. Johansson, IEEE Trans. Comput. 66 (2017) 1281. A ball is as small as
BITS allow, and it may be far beyond the range of floats. Numbers are fractions as long as they meet no
symbol, so that `x**(1/3*3)` is x**3.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.language.tree import (
    Call,
    Constant,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
)

Ball: TypeAlias = Any
"""An `arb` of python-flint, which has no types; not finite where there is no value, or none is known."""

Integers: TypeAlias = NDArray[np.intp]

BITS = (128, 512)
"""The precisions of balls: the second where the first leaves fewer than ENOUGH bits."""

ENOUGH = 60
"""Bits of a value that is used as a float."""

LOST = 96
"""Bits by which something is smaller than what it is added to when it may not be seen any more.

That is few beside the second of BITS, as it may be to the fourth power that it matters.
"""

MOST_BITS = 4096
"""Of a fraction that is kept exactly."""

MOST_DIGITS = 1000
"""The largest power of ten of a decimal number that is read as a fraction."""


Need: TypeAlias = Literal["nonzero", "positive", "not negative"]

CONDITIONS: Mapping[str, tuple[Need, Callable[..., tuple[Any, ...]]]] = {
    "log": ("positive", lambda x: (x,)),
    "sqrt": ("not negative", lambda x: (x,)),
    "asin": ("not negative", lambda x: (1 + x, 1 - x)),
    "acos": ("not negative", lambda x: (1 + x, 1 - x)),
    "acosh": ("not negative", lambda x: (x - 1,)),
    "atanh": ("positive", lambda x: (1 + x, 1 - x)),
    "atan2": ("nonzero", lambda y, x: (x**2 + y**2,)),
}
"""What each of some balls, or of some exact expressions, must be for a function to have a value.

Two of them are never below zero together.
"""

VIOLATED: Mapping[Need, Callable[[Ball], bool]] = {
    "nonzero": lambda x: x.is_zero(),
    "positive": lambda x: x <= 0,
    "not negative": lambda x: x < 0,
}
"""Whether a ball certainly is not what it has to be."""


class Worked:
    """A dataclass with cached properties, which are worked anew in another process: balls stay at home."""

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Estimate(Worked):
    """The values of an expression at points (n).

    An expression is `undefined` where an operation certainly has no value. Where it is not, and no ball is
    `known`, the precision leaves open whether there is a value. In the higher precision,
    `hidden` tells where something in it is too small, beside the rest, to be seen.
    """

    balls: Sequence[Ball]
    undefined: Mask
    hidden: Mask | None = None

    @cached_property
    def known(self) -> Mask:
        """Where there is certainly a value."""
        return np.array([ball.is_finite() for ball in self.balls], dtype=bool) & ~self.undefined

    @cached_property
    def value(self) -> Floats:
        """The values as floats, infinite beyond their range."""
        return np.array([float(ball.mid()) for ball in self.balls])

    @cached_property
    def error(self) -> Floats:
        """Bounds of the errors of `value`."""
        radius = np.array([float(ball.rad()) for ball in self.balls])
        float64 = np.finfo(np.float64)
        return radius * (1 + float64.eps) + float64.eps * np.abs(self.value) + float64.smallest_subnormal

    @cached_property
    def doubtful(self) -> Mask:
        """Where there may be a value, but no float is near it."""
        return ~(self.known & np.isfinite(self.value) & np.isfinite(self.error)) & ~self.undefined

    @cached_property
    def differs(self) -> Mask:
        """Where the value is certainly not zero."""
        return np.array([not ball.contains(0) for ball in self.balls], dtype=bool) & self.known

    def minus(self, other: Estimate) -> Estimate:
        """The difference of two expressions at the same points."""
        return self._with(other, operator.sub)

    def over(self, other: Estimate) -> Estimate:
        """The quotient of two expressions at the same points."""
        return self._with(other, operator.truediv)

    def _with(self, other: Estimate, operation: Callable[[Ball, Ball], Ball]) -> Estimate:
        from flint import ctx

        with ctx.workprec(BITS[1]):
            balls = [operation(one, two) for one, two in zip(self.balls, other.balls, strict=True)]
        return Estimate(balls, self.undefined | other.undefined)

    def where(self, places: Mask) -> Estimate:
        """The values at these places; elsewhere nothing is known."""
        return Estimate(self.balls, self.undefined | ~places)

    @property
    def changes(self) -> Estimate:
        """The values at the first half of the points less those at the second, each with its partner."""
        half = len(self.balls) // 2
        return self.some(range(half)).minus(self.some(range(half, 2 * half)))

    def some(self, places: Sequence[int] | Integers) -> Estimate:
        """The values at some of the points."""
        return Estimate([self.balls[place] for place in places], self.undefined[list(places)])


@dataclass(frozen=True, eq=False)
class Points(Worked):
    """Values (n) of the independent names, and what the derived ones are."""

    values: Mapping[str, Floats]
    derived: Mapping[str, Node]
    count: int

    @cached_property
    def balls(self) -> Mapping[int, Mapping[str, Sequence[Ball]]]:
        """The values of all names in each precision."""
        from flint import arb

        known: dict[int, Mapping[str, Sequence[Ball]]] = {}
        for bits in BITS:
            values: dict[str, Sequence[Ball]] = {
                name: [arb(x) for x in each.tolist()] for name, each in self.values.items()
            }
            for name, node in self.derived.items():
                values[name] = estimate(node, values, self.count, bits).balls
            known[bits] = values
        return known

    @property
    def finest(self) -> Mapping[str, Sequence[Ball]]:
        """The values of all names in the higher precision."""
        return self.balls[BITS[1]]

    @cached_property
    def floats(self) -> Mapping[str, Floats]:
        """The values of all names as floats."""
        return {name: np.array([float(x.mid()) for x in each]) for name, each in self.balls[BITS[0]].items()}

    def at(self, node: Node) -> Estimate:
        """The values of a tree, as precise as floats wherever it is not zero for hundreds of digits."""
        found = self.roughly_at(node)
        poor = [
            place
            for place, ball in enumerate(found.balls)
            if not found.undefined[place] and not (ball.is_finite() and ball.rel_accuracy_bits() >= ENOUGH)
        ]
        if not poor:
            return found
        finer = self.some(poor).finely_at(node)
        balls, undefined = list(found.balls), found.undefined.copy()
        for place, ball in zip(poor, finer.balls, strict=True):
            balls[place] = ball
        undefined[poor] = finer.undefined
        return Estimate(balls, undefined)

    def roughly_at(self, node: Node) -> Estimate:
        """The values of a tree in the lower precision."""
        return estimate(node, self.balls[BITS[0]], self.count, BITS[0])

    def finely_at(self, node: Node) -> Estimate:
        """The values of a tree in the higher precision."""
        return estimate(node, self.finest, self.count, BITS[1])

    def some(self, places: Sequence[int] | Integers) -> Points:
        """Some of the points."""
        return Points({name: x[list(places)] for name, x in self.values.items()}, self.derived, len(places))

    def joined(self, other: Points) -> Points:
        """These points, and others in the same names."""
        values = {name: np.append(value, other.values[name]) for name, value in self.values.items()}
        return Points(values, self.derived, self.count + other.count)

    def but(self, changes: Mapping[str, float | Floats]) -> Points:
        """The same points with other values of some independent names."""
        changed = {name: np.full(self.count, value, dtype=np.float64) for name, value in changes.items()}
        return Points({**self.values, **changed}, self.derived, self.count)


def estimate(node: Node, values: Mapping[str, Sequence[Ball]], count: int, bits: int = BITS[0]) -> Estimate:
    """The values of a tree at `count` points, where its names have these values."""
    from flint import ctx

    with ctx.workprec(bits):
        walk = _Walk(values, count, bits)
        balls = walk.balls(walk.of(node))
        return Estimate(balls, walk.undefined, walk.hidden)


class _Walk:
    """The way through one tree, and what was found wrong on it."""

    def __init__(self, values: Mapping[str, Sequence[Ball]], count: int, bits: int) -> None:
        from flint import arb, fmpq

        self.arb, self.fmpq = arb, fmpq
        self.values = values
        self.count = count
        self.undefined = np.zeros(count, dtype=bool)
        self.watching = bits > BITS[0]
        self.hidden = np.zeros(count, dtype=bool)
        self.small = arb(2) ** -LOST

    def balls(self, value: Sequence[Ball] | Fraction) -> Sequence[Ball]:
        """A value at every point."""
        if isinstance(value, Fraction):
            return [self.arb(self.fmpq(value.numerator, value.denominator))] * self.count
        return value

    def of(self, node: Node) -> Sequence[Ball] | Fraction:
        match node:
            case Name(name):
                return self.values[name]
            case Number(text):
                return self.number(text)
            case Constant():
                return [self.arb.pi()] * self.count
            case Negative(operand):
                inner = self.of(operand)
                return -inner if isinstance(inner, Fraction) else [-x for x in inner]
            case Sum(terms):
                return self.sum([self.of(term) for term in terms])
            case Product(factors):
                return self.product([self.of(factor) for factor in factors])
            case Reciprocal(operand):
                return self.power(self.of(operand), Fraction(-1))
            case Power(base, exponent):
                return self.power(self.of(base), self.of(exponent))
            case Call(function, arguments):
                return self.call(function, [self.balls(self.of(each)) for each in arguments])

    def number(self, text: str) -> Sequence[Ball] | Fraction:
        power = int(text.lower().partition("e")[2] or 0)
        return Fraction(text) if abs(power) <= MOST_DIGITS else [self.arb(text)] * self.count

    def sum(self, terms: Sequence[Sequence[Ball] | Fraction]) -> Sequence[Ball] | Fraction:
        exact = sum((term for term in terms if isinstance(term, Fraction)), Fraction(0))
        parts = [term for term in terms if not isinstance(term, Fraction)]
        if not parts:
            return self.bounded(exact)
        if exact:
            parts.append(self.balls(exact))
        if len(parts) == 1:
            return parts[0]
        total = [sum(column[1:], column[0]) for column in zip(*parts, strict=True)]
        if self.watching:
            limits = [self.small * max(abs(x).mid() for x in column) for column in zip(*parts, strict=True)]
            for part in parts:
                self.watch([abs(x) < limit for x, limit in zip(part, limits, strict=True)], part)
        return total

    def watch(self, lost: Sequence[bool], values: Sequence[Ball]) -> None:
        """Note where values are lost, but for exact zeros."""
        self.hidden |= np.array([each and not x.is_zero() for each, x in zip(lost, values, strict=True)])

    def product(self, factors: Sequence[Sequence[Ball] | Fraction]) -> Sequence[Ball] | Fraction:
        exact = Fraction(1)
        parts: list[Sequence[Ball]] = []
        for factor in factors:
            if isinstance(factor, Fraction):
                exact *= factor
                if _length(exact) > MOST_BITS:
                    parts.append(self.balls(exact))
                    exact = Fraction(1)
            else:
                parts.append(factor)
        if not parts or exact == 0:
            return exact
        if exact != 1:
            parts.append(self.balls(exact))
        return [math.prod(column[1:], start=column[0]) for column in zip(*parts, strict=True)]

    def bounded(self, exact: Fraction) -> Sequence[Ball] | Fraction:
        """A fraction that is not too long."""
        return self.balls(exact) if _length(exact) > MOST_BITS else exact

    def power(
        self, base: Sequence[Ball] | Fraction, exponent: Sequence[Ball] | Fraction
    ) -> Sequence[Ball] | Fraction:
        if isinstance(exponent, Fraction) and exponent.denominator == 1:
            times = exponent.numerator
            if not isinstance(base, Fraction):
                return self.by_points(lambda x: None if times < 0 and x == 0 else x**times, base)
            if base == 0 and times < 0:
                self.undefined[:] = True
                return Fraction(1)
            if base in (0, 1) or _length(base) * abs(times) <= MOST_BITS:
                return base**times
        return self.by_points(_power, self.balls(base), self.balls(exponent))

    def by_points(self, function: Callable[..., Ball | None], *arguments: Sequence[Ball]) -> Sequence[Ball]:
        """The values of a function, which is None where it certainly has no value."""
        found = [function(*each) for each in zip(*arguments, strict=True)]
        for place, value in enumerate(found):
            if value is None:
                self.undefined[place] = True
                found[place] = self.arb("nan")
        return found

    def call(self, function: str, arguments: Sequence[Sequence[Ball]]) -> Sequence[Ball]:
        x = arguments[0]
        if self.watching and function not in _WITHOUT_SCALE:
            self.watch([abs(each) < self.small for each in x], x)
        if self.watching and function in _FLAT_AT_INFINITY:
            largest = _FLAT_AT_INFINITY[function](1 / self.small)
            self.watch([abs(each) > largest for each in x], x)
        method = getattr(self.arb, _METHODS.get(function, function))
        if function not in CONDITIONS:
            return [method(*each) for each in zip(*arguments, strict=True)]
        need, of = CONDITIONS[function]
        return self.by_points(lambda *x: None if any(map(VIOLATED[need], of(*x))) else method(*x), *arguments)


def _length(fraction: Fraction) -> int:
    return fraction.numerator.bit_length() + fraction.denominator.bit_length()


def _power(x: Ball, y: Ball) -> Ball | None:
    """x**y for positive x; others have powers only where y is a whole number.

    A y that is one but for rounding is one: at random points it is no accident.
    """
    if x > 0:
        return x**y
    whole = y.unique_fmpz()
    if whole is not None:
        return None if x == 0 and whole < 0 else x ** int(whole)
    return None if x < 0 or (x == 0 and y < 0) else x**y


_METHODS = {"abs": "__abs__", "sign": "sgn"}
"""Methods of `arb` that have other names than the functions."""

_WITHOUT_SCALE = frozenset({"log", "sqrt", "abs", "sign"})
"""Functions that are no sums near zero: all others are, of a number and more and more powers."""

_FLAT_AT_INFINITY: dict[str, Callable[[Ball], Ball]] = {
    **dict.fromkeys(["tanh", "sinh", "cosh"], lambda x: x.log()),
    **dict.fromkeys(["atan", "asinh", "acosh"], lambda x: x),
}
"""Functions that are sums of something large and something small, and where the latter is lost."""
