"""The functions of the expression language on exact expressions, with the laws that always hold.

Signs go in and out of odd and even functions, and a few arguments have values that are known.
"""

from __future__ import annotations

from fractions import Fraction

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.atoms import Applied
from rigidcli.symbolic.algebra.expressions import (
    ONE,
    PI,
    ZERO,
    Expr,
    Number,
    atomic,
    factored,
    number,
    power,
    scaled,
)
from rigidcli.symbolic.algebra.roots import Rational, magnitude

_SHOWN = 24

_HALF = Fraction(1, 2)

_ODD = frozenset(["sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sign"])
_EVEN = frozenset(["cos", "cosh", "abs"])

_AT_NUMBERS: dict[tuple[str, Rational], Expr] = {
    ("sin", 0): ZERO,
    ("cos", 0): ONE,
    ("tan", 0): ZERO,
    ("asin", 0): ZERO,
    ("asin", 1): PI / 2,
    ("asin", _HALF): PI / 6,
    ("acos", -1): PI,
    ("acos", -_HALF): 2 * PI / 3,
    ("acos", 0): PI / 2,
    ("acos", _HALF): PI / 3,
    ("acos", 1): ZERO,
    ("atan", 0): ZERO,
    ("atan", 1): PI / 4,
    ("sinh", 0): ZERO,
    ("cosh", 0): ONE,
    ("tanh", 0): ZERO,
    ("asinh", 0): ZERO,
    ("acosh", 1): ZERO,
    ("atanh", 0): ZERO,
    ("exp", 0): ONE,
    ("log", 1): ZERO,
}

_SINES: dict[Fraction, Expr] = {
    Fraction(0): ZERO,
    Fraction(1, 6): number(_HALF),
    Fraction(1, 4): power(number(2), _HALF) / 2,
    Fraction(1, 3): power(number(3), _HALF) / 2,
    Fraction(1, 2): ONE,
}
"""Of multiples of pi up to a right angle."""


def apply(function: str, *arguments: Number) -> Expr:
    """One of `tree.FUNCTIONS`, or `pow`, of its arguments.

    Raises:
        ExpressionError: it has no finite real value there.
    """
    exprs = [e if isinstance(e, Expr) else number(e) for e in arguments]
    if function == "sqrt":
        return power(exprs[0], _HALF)
    if function == "pow":
        return exprs[0] ** exprs[1]
    if function == "atan2":
        return _atan2(exprs[0], exprs[1])
    (argument,) = exprs
    sign = 1
    if (function in _ODD or function in _EVEN) and argument.terms and argument.ordered[0][1] < 0:
        argument = -argument
        sign = -1 if function in _ODD else 1
    return scaled(_applied(function, argument), sign)


def _applied(function: str, argument: Expr) -> Expr:
    """A function of one argument, whose sign is canonical."""
    known = argument.as_number
    if known is not None:
        value = _at_number(function, known)
        if value is not None:
            return value
    if function in ("sin", "cos", "tan"):
        turns = _half_turns(argument)
        value = None if turns is None else _at_angle(function, turns)
        if value is not None:
            return value
    if function == "log" and (exponent := _inside(argument, "exp")) is not None:
        return exponent
    if function in ("abs", "sign"):
        return _absolute(argument) if function == "abs" else _signum(argument)
    return atomic(Applied(function, (argument,)))


def _at_number(function: str, value: Rational) -> Expr | None:
    if function == "abs":
        return number(magnitude(value))
    if function == "sign":
        return number((value > 0) - (value < 0))
    if (
        (function == "log" and value <= 0)
        or (function in ("asin", "acos") and magnitude(value) > 1)
        or (function == "acosh" and value < 1)
        or (function == "atanh" and magnitude(value) >= 1)
    ):
        shown = str(value) if len(str(value)) <= _SHOWN else f"{str(value)[:_SHOWN]}..."
        raise ExpressionError(f"`{function}({shown})` has no finite real value")
    return _AT_NUMBERS.get((function, value))


def _half_turns(argument: Expr) -> Fraction | None:
    """An angle as a multiple of pi."""
    multiple = argument / PI
    known = multiple.as_number
    return None if known is None else Fraction(known)


def _at_angle(function: str, half_turns: Fraction) -> Expr | None:
    if function == "cos":
        return _at_angle("sin", half_turns + _HALF)
    if function == "tan":
        sine, cosine = _at_angle("sin", half_turns), _at_angle("cos", half_turns)
        if sine is None or cosine is None:
            return None
        if cosine.is_zero:
            raise ExpressionError("`tan` of an odd multiple of pi/2 has no finite real value")
        return sine / cosine
    part = half_turns % 2
    sign = 1
    if part >= 1:
        part, sign = part - 1, -1
    value = _SINES.get(min(part, 1 - part))
    return None if value is None else scaled(value, sign)


def _inside(e: Expr, function: str) -> Expr | None:
    """The argument, where an expression is just this function of it."""
    if len(e.terms) == 1:
        ((monomial, coefficient),) = e.terms.items()
        if coefficient == 1 and len(monomial) == 1 and monomial[0][1] == 1:
            atom = monomial[0][0]
            if isinstance(atom, Applied) and atom.function == function:
                return atom.arguments[0]
    return None


def _absolute(argument: Expr) -> Expr:
    """What is never negative comes out: numbers, even powers, exponentials."""
    coefficient, monomial = factored(argument)
    outside, inside = number(magnitude(coefficient)), ONE
    for atom, exponent in monomial:
        factor = power(atomic(atom), exponent)
        positive = exponent.denominator != 1 or exponent.numerator % 2 == 0
        if not positive and isinstance(atom, Applied):
            positive = atom.function in ("exp", "cosh", "abs", "acosh", "acos")
        if positive or atom is _PI:
            outside *= factor
        else:
            inside *= factor
    if inside == ONE:
        return outside
    return outside * atomic(Applied("abs", (inside,)))


def _signum(argument: Expr) -> Expr:
    coefficient, monomial = factored(argument)
    sign = 1 if coefficient > 0 else -1
    kept = ONE
    for atom, exponent in monomial:
        positive = isinstance(atom, Applied) and atom.function in ("exp", "cosh")
        if not positive and atom is not _PI:
            kept *= power(atomic(atom), exponent)
    if kept == ONE:
        return number(sign)
    return scaled(atomic(Applied("sign", (kept,))), sign)


def _atan2(y: Expr, x: Expr) -> Expr:
    first, second = y.as_number, x.as_number
    if first == 0 and second == 0:
        raise ExpressionError("`atan2(0, 0)` has no value")
    if first == 0 and second is not None:
        return ZERO if second > 0 else PI
    if second == 0 and first is not None:
        return scaled(PI, Fraction(1 if first > 0 else -1, 2))
    return atomic(Applied("atan2", (y, x)))


_PI = next(iter(PI.terms))[0][0]
