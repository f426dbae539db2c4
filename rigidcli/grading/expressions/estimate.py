"""Values of expressions at many points, each with a bound of its rounding error.

Every operation passes on how far rounding may have led its operands astray, to first order: the running
error analysis of N. J. Higham, Accuracy and Stability of Numerical Algorithms, section 3.3. So it is known
where terms cancel, and where an argument is too near to the end of what a function is defined on. Numbers
are fractions as long as they meet no symbol, so that `x**(1/3*3)` is x**3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Mask
from rigidcli.symbolic.language.tree import (
    FUNCTIONS,
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

Values: TypeAlias = Any
"""Floats, or decimals in an array of objects: one for each point (n), or one for all."""

MAX_BITS = 4096
"""Of a fraction that is kept exactly."""

STEEP = 0.25
"""Where an error times the slope of a function exceeds this, first order says nothing."""


ROUNDED = 1e-9
"""The error of an exponent that may be a whole number but for rounding."""


class Ball(NamedTuple):
    """Values, and the bounds of their absolute errors."""

    value: Values
    error: Values


@dataclass(frozen=True, slots=True)
class Numbers:
    """A kind of number: its rounding `unit`, `pi`, fractions of it, and functions of arrays.

    A function is right to some units of its value, and the `floor` besides; what is below
    `tiny` may be zero.
    """

    unit: Any
    pi: Any
    of: Callable[[Fraction], Any]
    functions: Mapping[str, Callable[..., Values]]
    nearest_integer: Callable[[Values], Values]
    finite: Callable[[Values], Mask]
    floor: Any
    tiny: Any


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The values of an expression at points (n), their rounding errors, and what is wrong with them.

    An expression is `undefined` where an operation certainly has no value; its value is `doubtful` where
    rounding leaves that open, or where it is beyond the range of numbers.
    """

    value: Values
    error: Values
    undefined: Mask
    doubtful: Mask

    def minus(self, other: Estimate) -> Estimate:
        """The difference of two expressions at the same points."""
        undefined = self.undefined | other.undefined
        doubtful = (self.doubtful | other.doubtful) & ~undefined
        with np.errstate(invalid="ignore"):
            return Estimate(self.value - other.value, self.error + other.error, undefined, doubtful)

    @property
    def changes(self) -> Estimate:
        """The values at the first half of the points less those at the second, each with its partner."""
        half = len(self.value) // 2
        return self.some(slice(half)).minus(self.some(slice(half, None)))

    def some(self, places: slice) -> Estimate:
        """The values at some of the points."""
        return Estimate(self.value[places], self.error[places], self.undefined[places], self.doubtful[places])


def _float(fraction: Fraction) -> np.float64:
    try:
        return np.float64(fraction.numerator / fraction.denominator)
    except OverflowError:
        return np.float64(math.inf)


FLOATS = Numbers(
    unit=float(np.finfo(np.float64).eps),
    pi=np.float64(math.pi),
    of=_float,
    functions={name: getattr(np, function.numpy) for name, function in FUNCTIONS.items()},
    nearest_integer=np.rint,
    finite=np.isfinite,
    floor=0.0,
    tiny=float(np.finfo(np.float64).smallest_subnormal),
)


def estimate(node: Node, values: Mapping[str, Ball], count: int, numbers: Numbers = FLOATS) -> Estimate:
    """The values of a tree at `count` points, where its names have these values."""
    walk = _Walk(values, count, numbers)
    with np.errstate(all="ignore"):
        value, error = walk.ball(walk.of(node))
        zeros = np.full(count, numbers.of(Fraction(0)))
        value, error = zeros + value, zeros + error
        finite = np.asarray(numbers.finite(value) & numbers.finite(error), dtype=bool)
    return Estimate(value, error, walk.undefined, (walk.doubtful | ~finite) & ~walk.undefined)


class _Walk:
    """The way through one tree, and what was found wrong on it."""

    def __init__(self, values: Mapping[str, Ball], count: int, numbers: Numbers) -> None:
        self.values = values
        self.n = numbers
        self.undefined = np.zeros(count, dtype=bool)
        self.doubtful = np.zeros(count, dtype=bool)

    def ball(self, value: Ball | Fraction) -> Ball:
        """The value as the kind of number that is used; a fraction may be rounded by that."""
        if isinstance(value, Ball):
            return value
        near = self.n.of(value)
        finite = bool(self.n.finite(near))
        return Ball(
            near, near * 0 if finite and Fraction(near) == value else abs(near) * self.n.unit + self.n.tiny
        )

    def of(self, node: Node) -> Ball | Fraction:
        match node:
            case Name(name):
                return self.values[name]
            case Number(text, value):
                return self.number(text, value)
            case Constant():
                return Ball(self.n.pi, self.n.pi * self.n.unit)
            case Negative(operand):
                inner = self.of(operand)
                return -inner if isinstance(inner, Fraction) else Ball(-inner.value, inner.error)
            case Sum(terms):
                return self.sum([self.of(term) for term in terms])
            case Product(factors):
                return self.product([self.of(factor) for factor in factors])
            case Reciprocal(operand):
                return self.reciprocal(self.of(operand))
            case Power(base, exponent):
                return self.power(self.of(base), self.of(exponent))
            case Call("atan2", (y, x)):
                return self.angle(self.ball(self.of(y)), self.ball(self.of(x)))
            case Call(function, arguments):
                return self.call(function, self.ball(self.of(arguments[0])))

    def number(self, text: str, value: float) -> Ball | Fraction:
        if math.isfinite(value) and (value or not text.strip("0.")):
            return Fraction(text)
        _, _, exponent = text.lower().partition("e")
        if abs(int(exponent or 0)) <= MAX_BITS // 4:
            return Fraction(text)
        self.doubtful[:] = True
        return Fraction(0)

    def sum(self, terms: list[Ball | Fraction]) -> Ball | Fraction:
        exact = Fraction(0)
        total: Ball | None = None
        for term in terms:
            if isinstance(term, Fraction):
                exact = exact + term
            else:
                total = term if total is None else self.plus(total, term)
        if total is None:
            return self.bounded(exact)
        return self.plus(total, self.ball(exact)) if exact else total

    def plus(self, left: Ball, right: Ball) -> Ball:
        value = left.value + right.value
        return Ball(value, left.error + right.error + self.n.unit * abs(value))

    def product(self, factors: list[Ball | Fraction]) -> Ball | Fraction:
        exact = Fraction(1)
        total: Ball | None = None
        for factor in factors:
            if isinstance(factor, Fraction):
                exact = exact * factor
                if exact.numerator.bit_length() + exact.denominator.bit_length() > MAX_BITS:
                    total = self.ball(exact) if total is None else self.times(total, self.ball(exact))
                    exact = Fraction(1)
            else:
                total = factor if total is None else self.times(total, factor)
        if total is None or exact == 0:
            return exact
        return self.times(total, self.ball(exact)) if exact != 1 else total

    def times(self, left: Ball, right: Ball) -> Ball:
        value = left.value * right.value
        spread = abs(left.value) * right.error + (abs(right.value) + right.error) * left.error
        return Ball(value, spread + self.n.unit * abs(value) + self.n.tiny)

    def bounded(self, exact: Fraction) -> Ball | Fraction:
        """A fraction that is not too long."""
        long = exact.numerator.bit_length() + exact.denominator.bit_length() > MAX_BITS
        return self.ball(exact) if long else exact

    def reciprocal(self, operand: Ball | Fraction) -> Ball | Fraction:
        if isinstance(operand, Fraction):
            if operand:
                return 1 / operand
            self.undefined[:] = True
            return Fraction(1)
        value, error = operand
        self.away_from_zero(operand)
        inverse = 1 / value
        return Ball(inverse, error / (abs(value) * (abs(value) - error)) + self.n.unit * abs(inverse))

    def away_from_zero(self, operand: Ball) -> None:
        """Note where an operand is zero, or may be."""
        value, error = operand
        self.undefined |= (value == 0) & (error == 0)
        self.doubtful |= (abs(value) <= error) & (error > 0)

    def power(self, base: Ball | Fraction, exponent: Ball | Fraction) -> Ball | Fraction:
        if isinstance(exponent, Fraction) and exponent.denominator == 1:
            n = exponent.numerator
            if n < 0:
                base, n = self.reciprocal(base), -n
            if isinstance(base, Fraction):
                bits = base.numerator.bit_length() + base.denominator.bit_length()
                if bits * n <= MAX_BITS or base in (0, 1):
                    return base**n if n else Fraction(1)
            return self.natural_power(self.ball(base), n) if n else Fraction(1)
        return self.real_power(self.ball(base), self.ball(exponent))

    def natural_power(self, base: Ball, n: int) -> Ball:
        """x**n, whose slope is n x**(n-1)."""
        if n == 2:
            return self.times(base, base)
        exponent = self.n.of(Fraction(n))
        value = np.power(base.value, exponent)
        slope = exponent * np.power(abs(base.value) + base.error, exponent - 1)
        return Ball(value, slope * base.error + 4 * self.n.unit * abs(value))

    def real_power(self, base: Ball, exponent: Ball) -> Ball:
        """x**y = exp(y log x) for positive x; others have powers only where y is a whole number.

        A y that is one but for rounding is one: at random points it is no accident.
        """
        x, dx = base
        y, dy = exponent
        size = abs(x)
        is_zero = (x == 0) & (dx == 0)
        whole = self.n.nearest_integer(y)
        nearly = abs(y - whole) <= dy
        self.undefined |= (x < -dx) & np.logical_not(nearly)
        self.undefined |= is_zero & (y < -dy)
        self.doubtful |= (x < -dx) & nearly & (dy > ROUNDED)
        vanishing = (size <= dx) & nearly & (whole > 0) & (dy <= ROUNDED)
        self.doubtful |= (size <= dx) & (dx > 0) & np.logical_not(vanishing)
        self.doubtful |= is_zero & (abs(y) <= dy) & (dy > 0)
        value = np.power(x, np.where(((x < -dx) & nearly) | vanishing, whole, y))
        logarithm = abs(self.n.functions["log"](size))
        relative = abs(y) * dx / (size - dx) + logarithm * dy
        self.doubtful |= (relative > STEEP) & (size > dx)
        rounding = 4 * self.n.unit * (1 + abs(y) * logarithm)
        error = np.where(vanishing, 2 * np.power(size + dx, whole), abs(value) * (2 * relative + rounding))
        return Ball(value, np.where(is_zero, abs(value) * 0, error))

    def angle(self, y: Ball, x: Ball) -> Ball:
        """atan2(y, x), which jumps by 2 pi where y changes its sign behind the origin."""
        square = x.value * x.value + y.value * y.value
        spread = (abs(x.value) * y.error + abs(y.value) * x.error) / square
        jumps = (abs(y.value) <= y.error) & (y.error > 0) & (x.value < x.error)
        self.doubtful |= jumps | (spread > STEEP)
        value = self.n.functions["atan2"](y.value, x.value)
        return Ball(value, 2 * spread + 4 * self.n.unit * abs(value) + self.n.floor)

    def call(self, function: str, argument: Ball) -> Ball:
        x, error = argument
        if function in _ROOM:
            room, is_open = _ROOM[function]
            left = room(x)
            self.undefined |= left < -error
            if is_open:
                self.undefined |= (left == 0) & (error == 0)
            self.doubtful |= (abs(left) <= error) & (error > 0)
        if function == "sign":
            self.doubtful |= (abs(x) <= error) & (error > 0)
        value = self.n.functions[function](x)
        rounding = 4 * self.n.unit * abs(value) + self.n.floor
        slope = _SLOPES.get(function)
        if slope is None:
            return Ball(value, error + rounding)
        steepness = slope(x, value, error, self.n.functions["sqrt"])
        spread = steepness * error
        if function in _GROWING:
            self.doubtful |= error * _GROWING[function](value) > STEEP
        # At the very end of a range the slope is infinite, and an argument without error still exact.
        return Ball(value, np.where(error == 0, error * 0, spread) + rounding)


_ROOM: dict[str, tuple[Callable[[Values], Values], bool]] = {
    "asin": (lambda x: 1 - abs(x), False),
    "acos": (lambda x: 1 - abs(x), False),
    "atanh": (lambda x: 1 - abs(x), True),
    "acosh": (lambda x: x - 1, False),
    "log": (lambda x: x, True),
    "sqrt": (lambda x: x, False),
}
"""How far an argument is inside of where a function has values; whether the end itself is outside."""

_SLOPES: dict[str, Callable[[Values, Values, Values, Callable[[Values], Values]], Values]] = {
    "tan": lambda x, value, error, sqrt: 2 * (1 + value * value),
    "asin": lambda x, value, error, sqrt: 1 / sqrt(1 - (abs(x) + error) ** 2),
    "acos": lambda x, value, error, sqrt: 1 / sqrt(1 - (abs(x) + error) ** 2),
    "acosh": lambda x, value, error, sqrt: 1 / sqrt((x - error) ** 2 - 1),
    "atanh": lambda x, value, error, sqrt: 1 / (1 - (abs(x) + error) ** 2),
    "log": lambda x, value, error, sqrt: 1 / (x - error),
    "sqrt": lambda x, value, error, sqrt: 1 / value,
    "exp": lambda x, value, error, sqrt: 2 * value,
    "sinh": lambda x, value, error, sqrt: 2 * (1 + abs(value)),
    "cosh": lambda x, value, error, sqrt: 2 * value,
    "sign": lambda x, value, error, sqrt: 0 * value,
}
"""The largest slope within the error of an argument; of the other functions it is at most 1."""

_GROWING: dict[str, Callable[[Values], Values]] = {
    "tan": lambda value: 1 + abs(value),
    "exp": lambda value: 1,
    "sinh": lambda value: 1,
    "cosh": lambda value: 1,
}
"""What the error of an argument is multiplied by to tell whether the slope is nearly the same throughout."""
