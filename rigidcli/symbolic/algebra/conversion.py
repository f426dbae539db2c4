"""Trees to exact sympy expressions, each step bounded before it is taken.

sympy works numbers out while an expression is being built: powers of integers in full, roots by
factoring, signs by isolating the roots of polynomials or by finding minimal polynomials. A short
text can keep each of these busy for hours, so a conversion spends from a fixed allowance of work,
counted in steps and never in seconds: what is refused once is refused everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import sympy

from rigidcli.errors import ExpressionError
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

MAX_BITS = 10_000
"""Of a numerator or denominator: about 3,000 digits."""

MAX_ROOT_BITS = 512
"""Of a number under a root, which sympy tries to factor: about 150 digits."""

MAX_EXPONENT = 1_000
"""Of a power of anything but a number."""

MAX_WEIGHT = 200
"""Of the argument of a function or root: how many names and numbers, powers written as products."""

MAX_HEIGHT = 12
"""Of an argument: how many functions and powers stand inside each other."""

MAX_NUMBER_HEIGHT = 6
"""The same for an argument without symbols, where the time for its value doubles with each level."""

MAX_WEIGHT_TO_EXPAND = 50
"""Of a number that seems to be zero, and is if its products cancel when multiplied out."""

MAX_WORK = 40_000
"""In all, in units of about 10 microseconds."""

# What sympy takes at worst for each kind of step, as measured, with some room.
_UNITS_TO_GATHER = 1
_UNITS_TO_ADD = 5
_UNITS_TO_MULTIPLY = 5
_UNITS_TO_MULTIPLY_OUT = 12
_UNITS_FOR_A_POWER = 25
_UNITS_FOR_A_ROOT = 150
_UNITS_FOR_A_CALL = 100
_UNITS_FOR_A_VALUE = 50
_UNITS_TO_SPLIT = 1
_UNITS_TO_TELL_SIGNS = 60
_UNITS_TO_ISOLATE_ROOTS = 300
_WEIGHT_OF_A_LINE = 5

_LARGEST = sympy.Integer(2) ** MAX_BITS
_ENDLESS = (sympy.zoo, sympy.nan, sympy.oo, -sympy.oo)

FAILURES = (ArithmeticError, AttributeError, NotImplementedError, RecursionError, TypeError)
"""What sympy raises within the bounds: by comparing huge numbers that it cannot tell apart, for one."""


def exact(root: Node, values: Mapping[str, sympy.Expr]) -> sympy.Expr:
    """The exact value of a tree; `values` has one for each of its names.

    Symbols among the values should be declared real, or sympy keeps track of imaginary parts.

    Raises:
        ExpressionError: there is no finite real value, sympy cannot tell, or it would be too large.
    """
    try:
        known = {name: sympy.sympify(value, strict=True) for name, value in values.items()}
        return _Converter(known).convert(root)
    except FAILURES as error:
        raise ExpressionError("the expression cannot be worked out exactly") from error


class _Size(NamedTuple):
    """How large an expression is, see `MAX_WEIGHT` and `MAX_HEIGHT`."""

    weight: int
    height: int


class _Converter:
    """One conversion: the values of the names, and how much work has been spent."""

    def __init__(self, values: Mapping[str, sympy.Expr]) -> None:
        self.values = values
        self.work = 0
        self.sizes: dict[sympy.Expr, _Size] = {}

    def convert(self, node: Node) -> sympy.Expr:
        match node:
            case Name(name):
                return self.values[name]
            case Number(text, _):
                fraction = Fraction(text)
                return _bounded(sympy.Rational(fraction.numerator, fraction.denominator))
            case Constant(name):
                return getattr(sympy, name)
            case Negative(operand):
                return self.add([(self.convert(operand), -1)])
            case Sum(terms):
                return self.add([self.signed(term) for term in terms])
            case Product(factors):
                return self.multiply([self.convert(factor) for factor in factors])
            case Reciprocal(operand):
                return self.power(self.convert(operand), sympy.S.NegativeOne)
            case Power(base, exponent):
                return self.power(self.convert(base), self.convert(exponent))
            case Call("sqrt", (argument,)):
                return self.power(self.convert(argument), sympy.S.Half)
            case Call(function, arguments):
                return self.call(function, [self.convert(argument) for argument in arguments])

    def signed(self, term: Node) -> tuple[sympy.Expr, int]:
        if isinstance(term, Negative):
            return self.convert(term.operand), -1
        return self.convert(term), 1

    def spend(self, units: int) -> None:
        self.work += units
        if self.work > MAX_WORK:
            raise ExpressionError("the expression is too large for exact arithmetic")

    def add(self, terms: Sequence[tuple[sympy.Expr, int]]) -> sympy.Expr:
        """The sum, its like terms gathered here so that no coefficient grows without bound."""
        coefficients: dict[sympy.Expr, sympy.Rational] = {}
        for term, sign in terms:
            for part in sympy.Add.make_args(term):
                self.spend(_UNITS_TO_GATHER)
                coefficient, rest = part.as_coeff_Mul()
                known = coefficients.get(rest, sympy.S.Zero)
                coefficients[rest] = _bounded(known + sign * coefficient)
        parts = []
        for rest, coefficient in coefficients.items():
            if coefficient == 1:
                self.spend(_UNITS_TO_ADD)
                parts.append(rest)
            else:
                self.spend(_UNITS_TO_ADD + _UNITS_TO_MULTIPLY_OUT)
                parts.append(sympy.Mul(coefficient, rest))
        numbers = [part for part in parts if part.is_number]
        if len(numbers) > 1 and self.is_zero(sympy.Add(*numbers)):
            parts = [part for part in parts if not part.is_number]
        return sympy.Add(*parts)

    def multiply(self, factors: Sequence[sympy.Expr]) -> sympy.Expr:
        """The product, refused if powers of numbers in it would come to something too large."""
        coefficient: sympy.Rational = sympy.S.One
        exponents: dict[sympy.Expr, sympy.Expr] = {}
        parts = []
        for factor in factors:
            for part in sympy.Mul.make_args(factor):
                self.spend(_UNITS_TO_GATHER)
                if part.is_Number:
                    coefficient = _bounded(coefficient * part)
                    continue
                parts.append(part)
                base, exponent = part.as_base_exp()
                exponents[base] = _bounded(exponents.get(base, sympy.S.Zero) + _constant(exponent))
        if coefficient.is_zero:
            return coefficient
        self.spend(_UNITS_TO_MULTIPLY * len(exponents))
        bits = sum(_growth(base, exponent) for base, exponent in exponents.items())
        _require(bits <= MAX_BITS, "the value")
        if len(parts) == 1 and parts[0].is_Add and coefficient != 1:
            self.spend(_UNITS_TO_MULTIPLY_OUT * len(parts[0].args))
        return sympy.Mul(coefficient, *parts)

    def power(self, base: sympy.Expr, exponent: sympy.Expr) -> sympy.Expr:
        self.spend(_UNITS_FOR_A_POWER)
        self.check_power(base, exponent)
        if not exponent.is_Integer:
            _require(self.size(base).weight <= MAX_WEIGHT, "the base of a power or root")
        self.weigh(base, _UNITS_TO_SPLIT)
        self.weigh(exponent, _UNITS_TO_SPLIT)
        for part in (*(base.args if base.is_Add else [base]), exponent):
            self.pay_for_signs(part)
        return self.checked(sympy.Pow(base, exponent))

    def check_power(self, base: sympy.Expr, exponent: sympy.Expr) -> None:
        """Refuse a power whose numbers would grow too large, or be too hard to find roots of."""
        bits = 0.0
        for factor in sympy.Mul.make_args(base):
            self.spend(_UNITS_TO_MULTIPLY)
            inner, outer = factor.as_base_exp()
            total = outer * exponent
            bits += _growth(inner, _constant(total))
            if inner.is_Rational and total.is_Rational and not total.is_Integer:
                size = _bits(inner)
                _require(size <= MAX_ROOT_BITS, "the number under a root")
                _require(total.q <= MAX_BITS / max(size, 1.0), "the exponent")
                self.spend(_UNITS_FOR_A_ROOT + int(size * size) // 150)
        _require(bits <= MAX_BITS, "the power")

    def call(self, function: str, arguments: Sequence[sympy.Expr]) -> sympy.Expr:
        self.spend(_UNITS_FOR_A_CALL)
        for argument in arguments:
            _require(self.size(argument).weight <= MAX_WEIGHT, f"the argument of `{function}`")
            self.weigh(argument, _UNITS_TO_TELL_SIGNS)
            self.pay_for_signs(argument)
        if function == "exp":
            self.check_exponential(arguments[0])
        return self.checked(getattr(sympy, FUNCTIONS[function].sympy)(*arguments))

    def check_exponential(self, argument: sympy.Expr) -> None:
        """Check a power of e, and the powers of a that sympy makes of exp(n log a)."""
        self.check_power(sympy.E, argument)
        for term in sympy.Add.make_args(argument):
            factors = sympy.Mul.make_args(term)
            for factor in factors:
                if isinstance(factor, sympy.log):
                    others = sympy.Mul(*(other for other in factors if other is not factor))
                    self.check_power(factor.args[0], others)

    def checked(self, result: sympy.Expr) -> sympy.Expr:
        """The result if it is finite and real.

        Raises:
            ExpressionError: it is not, or a sign cannot be told.
        """
        if any(result is endless for endless in _ENDLESS):
            raise ExpressionError("division by zero, or a value that is not finite")
        if any(_is_imaginary(part) for part in sympy.preorder_traversal(result)):
            raise ExpressionError("there is no real value")
        if result.is_number and not result.is_Rational and self.is_zero(result):
            return sympy.S.Zero
        return result

    def is_zero(self, number: sympy.Expr) -> bool:
        """Whether a number without symbols vanishes, which sympy must never be left to find out."""
        size = self.size(number)
        _require(size.height <= MAX_NUMBER_HEIGHT, "the nesting")
        self.spend(_UNITS_FOR_A_VALUE + size.weight * 2**size.height)
        value = number.evalf(4)
        if not value.is_real:
            raise ExpressionError("there is no real value")
        _require(abs(value) < _LARGEST, "the value")
        if value.is_Float and value._prec > 1:
            return False
        if size.weight <= MAX_WEIGHT_TO_EXPAND and sympy.expand(number) == 0:
            return True
        raise ExpressionError("cannot tell exactly whether a part of the expression is zero")

    def weigh(self, argument: sympy.Expr, units: int) -> None:
        """Spend what sympy may need to learn enough about an argument, so many units for each name in it."""
        size = self.size(argument)
        _require(size.height <= MAX_HEIGHT, "the nesting")
        if not argument.is_Atom:
            self.spend(units * size.weight * (1 + size.height))

    def pay_for_signs(self, argument: sympy.Expr) -> None:
        """Spend what sympy needs to isolate the roots of polynomials, which tell it their signs."""
        for part in argument.atoms(sympy.Add):
            weight = self.size(part).weight
            if weight > _WEIGHT_OF_A_LINE and _has_signed_roots(part):
                numbers = (number for number in sympy.preorder_traversal(part) if number.is_number)
                rational = all(number.is_Rational for number in numbers)
                self.spend(_UNITS_TO_ISOLATE_ROOTS * weight * (1 if rational else weight))

    def size(self, expr: sympy.Expr) -> _Size:
        known = self.sizes.get(expr)
        if known is not None:
            return known
        if expr.is_Rational:
            size = _Size(1 + int(_bits(expr)) // 64, 0)
        elif expr.is_Pow:
            base, exponent = self.size(expr.base), self.size(expr.exp)
            weight = base.weight * max(1, int(abs(_constant(expr.exp))))
            if not expr.exp.is_Integer:
                weight += exponent.weight
            size = _Size(weight, 1 + max(base.height, exponent.height))
        else:
            parts = [self.size(part) for part in expr.args]
            height = max((part.height for part in parts), default=0)
            size = _Size(1 + sum(part.weight for part in parts), height + isinstance(expr, sympy.Function))
        self.sizes[expr] = size
        return size


def _require(bounded: bool, what: str) -> None:
    if not bounded:
        raise ExpressionError(f"{what} is too large for exact arithmetic")


def _bits(number: sympy.Rational) -> float:
    return math.log2(max(abs(int(number.p)), int(number.q)))


def _bounded(number: sympy.Expr) -> sympy.Expr:
    _require(not number.is_Rational or _bits(number) <= MAX_BITS, "the value")
    return number


def _constant(exponent: sympy.Expr) -> sympy.Expr:
    """The term of an exponent that is a rational number."""
    return exponent.as_coeff_Add()[0]


def _growth(base: sympy.Expr, exponent: sympy.Expr) -> float:
    """How many bits a power of a number comes to; for any other base its exponent is bounded here."""
    size = abs(exponent)
    if base.is_Rational:
        return _bits(base) * float(min(max(size, 1), 2 * MAX_BITS))
    _require(size <= MAX_EXPONENT, "the exponent")
    return 0.0


def _is_imaginary(part: sympy.Expr) -> bool:
    if part.is_Pow and part.base.is_number and part.exp.is_Rational and not part.exp.is_Integer:
        return bool(part.base.is_negative)
    return part is sympy.I or isinstance(part, (sympy.re, sympy.im, sympy.arg))


def _has_signed_roots(part: sympy.Expr) -> bool:
    """Whether sympy would look for the roots of this sum to know its sign."""
    symbols = part.free_symbols
    if len(symbols) != 1:
        return False
    (symbol,) = symbols
    return bool((symbol.is_nonnegative or symbol.is_nonpositive) and part.is_rational_function(symbol))
