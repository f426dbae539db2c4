"""The functions of the expression language on exact expressions, with the laws that always hold.

Signs go in and out of odd and even functions, and a few arguments have values that are known.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from rigidcli.algebra.atoms import Applied, Atom
from rigidcli.algebra.bounds import Rational, magnitude
from rigidcli.algebra.expressions import ONE, PI, ZERO, ExactNumber, Expr, atomic, expr, factored, gathered
from rigidcli.errors import ExpressionError
from rigidcli.language.tree import UnknownFunction

_SHOWN = 24  # most digits of a number that a message repeats

_HALF = Fraction(1, 2)

_ODD = frozenset(["sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sign"])
_EVEN = frozenset(["cos", "cosh", "abs"])


def _root(value: ExactNumber) -> Expr:
    return expr(value) ** _HALF


_SINES: dict[Fraction, Expr] = {
    Fraction(0): ZERO,
    Fraction(1, 12): (_root(6) - _root(2)) / 4,
    Fraction(1, 10): (_root(5) - 1) / 4,
    Fraction(1, 8): _root(2 - _root(2)) / 2,
    Fraction(1, 6): expr(_HALF),
    Fraction(1, 5): _root(10 - 2 * _root(5)) / 4,
    Fraction(1, 4): _root(2) / 2,
    Fraction(3, 10): (_root(5) + 1) / 4,
    Fraction(1, 3): _root(3) / 2,
    Fraction(3, 8): _root(2 + _root(2)) / 2,
    Fraction(2, 5): _root(10 + 2 * _root(5)) / 4,
    Fraction(5, 12): (_root(6) + _root(2)) / 4,
    Fraction(1, 2): ONE,
}
"""The sines of multiples of pi up to a right angle that have a short form in square roots."""

_TANGENTS: dict[Fraction, Expr] = {
    Fraction(0): ZERO,
    Fraction(1, 12): 2 - _root(3),
    Fraction(1, 8): _root(2) - 1,
    Fraction(1, 6): _root(3) / 3,
    Fraction(1, 4): ONE,
    Fraction(1, 3): _root(3),
    Fraction(3, 8): _root(2) + 1,
    Fraction(5, 12): 2 + _root(3),
}
"""The tangents of such multiples of pi that have a short form."""

_KNOWN: dict[tuple[str, Expr], Expr] = {
    **{("asin", sine): PI * part for part, sine in _SINES.items()},
    **{("acos", sine): PI * (_HALF - part) for part, sine in _SINES.items()},
    **{("acos", -sine): PI * (_HALF + part) for part, sine in _SINES.items()},
    **{("atan", tangent): PI * part for part, tangent in _TANGENTS.items()},
    ("cosh", ZERO): ONE,
    ("acosh", ONE): ZERO,
    ("exp", ZERO): ONE,
    ("log", ONE): ZERO,
}
"""Values at arguments where they are known."""

_COMPOSED: dict[tuple[str, str], Callable[[Expr], Expr]] = {
    ("sin", "asin"): lambda x: x,
    ("sin", "acos"): lambda x: _root(1 - x**2),
    ("sin", "atan"): lambda x: x / _root(1 + x**2),
    ("cos", "asin"): lambda x: _root(1 - x**2),
    ("cos", "acos"): lambda x: x,
    ("cos", "atan"): lambda x: 1 / _root(1 + x**2),
    ("tan", "atan"): lambda x: x,
    ("tan", "asin"): lambda x: x / _root(1 - x**2),
    ("log", "exp"): lambda x: x,
    **{(f, g): lambda x: x for f, g in (("sinh", "asinh"), ("cosh", "acosh"), ("tanh", "atanh"))},
    **{(f, g): lambda x: x for f, g in (("asinh", "sinh"), ("atanh", "tanh"))},
    ("cosh", "asinh"): lambda x: _root(1 + x**2),
    ("tanh", "asinh"): lambda x: x / _root(1 + x**2),
    ("sinh", "acosh"): lambda x: _root(x**2 - 1),
    ("sinh", "atanh"): lambda x: x / _root(1 - x**2),
    ("cosh", "atanh"): lambda x: 1 / _root(1 - x**2),
}
"""Functions of functions that are simpler wherever they have a value."""


def apply(function: str, *arguments: ExactNumber) -> Expr:
    """One of `words.FUNCTIONS`, or `pow`, or an unknown function of its arguments."""
    exprs = [expr(e) for e in arguments]
    if isinstance(function, UnknownFunction):
        return atomic(Applied(function, tuple(exprs)))
    if function == "sqrt":
        return exprs[0] ** _HALF
    if function == "pow":
        return exprs[0] ** exprs[1]
    if function == "atan2":
        return _atan2(exprs[0], exprs[1])
    (argument,) = exprs
    is_negative = bool(argument.terms) and argument.ordered[0][1] < 0
    if function in _ODD and is_negative:
        return -_applied(function, -argument)
    return _applied(function, -argument if function in _EVEN and is_negative else argument)


def _applied(function: str, argument: Expr) -> Expr:
    rational = argument.as_number
    if rational is not None:
        _require_value(function, rational)
    known = ZERO if function in _ODD and not argument.terms else _KNOWN.get((function, argument))
    if known is not None:
        return known
    if function in ("sin", "cos", "tan") and (value := _of_angle(function, argument)) is not None:
        return value
    inner, n = only_power(argument)
    if function == "log" and inner is not None and n != 1 and (inner.positive or n % 2):
        return n * apply("log", atomic(inner))  # log(x^n) has a value where log(x) has one
    if n == 1 and isinstance(inner, Applied) and (function, inner.function) in _COMPOSED:
        return _COMPOSED[function, inner.function](inner.arguments[0])
    if function in ("abs", "sign"):
        return abs(argument) if function == "abs" else _signum(argument)
    return atomic(Applied(function, (argument,)))


def _require_value(function: str, value: Rational) -> None:
    """Raise ExpressionError where a function has no finite real value at a number."""
    if (
        (function == "log" and value <= 0)
        or (function in ("asin", "acos") and magnitude(value) > 1)
        or (function == "acosh" and value < 1)
        or (function == "atanh" and magnitude(value) >= 1)
    ):
        shown = str(value) if len(str(value)) <= _SHOWN else f"{str(value)[:_SHOWN]}..."
        raise ExpressionError(f"`{function}({shown})` has no finite real value")


def _of_angle(function: str, argument: Expr) -> Expr | None:
    """A function of a multiple of pi, or without quarter turns: cos(x + pi) is -cos(x). Else None."""
    ((turn, _),) = PI.terms.items()
    quarters, part = divmod(2 * Fraction(argument.terms.get(turn, 0)), 1)
    angle, part = argument - PI * Fraction(quarters + part, 2), part / 2
    if angle.terms and (part or not quarters):
        return None
    value: Expr | None
    if function == "tan":
        if quarters % 2 and not angle.terms and not part:
            raise ExpressionError("`tan` of an odd multiple of pi/2 has no finite real value")
        if angle.terms:
            return -1 / apply("tan", angle) if quarters % 2 else apply("tan", angle)
        value = _TANGENTS.get(_HALF - part if quarters % 2 else part)
        return -value if value is not None and quarters % 2 else value
    place = (quarters + (1 if function == "cos" else 0)) % 4  # of sin, cos, -sin, -cos
    turned = ("sin", "cos")[place % 2]
    value = apply(turned, angle) if angle.terms else _SINES.get(part if turned == "sin" else _HALF - part)
    return value if value is None or place < 2 else -value


def only_power(e: Expr) -> tuple[Atom | None, Rational]:
    """The atom and the exponent of the power that an expression is; None and 1 where it is something else."""
    if len(e.terms) == 1:
        ((monomial, coefficient),) = e.terms.items()
        if coefficient == 1 and len(monomial) == 1:
            return monomial[0]
    return None, 1


def _signum(argument: Expr) -> Expr:
    """The sign of an expression, in which positive factors are left out."""
    if not argument.terms:
        return ZERO
    coefficient, monomial = factored(argument)
    kept = gathered(1, {atom: n for atom, n in monomial if not atom.positive})
    sign = 1 if coefficient > 0 else -1
    return expr(sign) if kept == ONE else sign * atomic(Applied("sign", (kept,)))


def _atan2(y: Expr, x: Expr) -> Expr:
    """By the arc tangent where the signs are known; those of sums of square roots are not."""
    above, right = y.sign(), x.sign()
    if above == 0 and right == 0:
        raise ExpressionError("`atan2(0, 0)` has no value")
    if right == 0 and above is not None and y.is_strict():
        return PI * Fraction(above, 2)
    if right is None or not x.is_strict() or (right < 0 and above is None):
        return atomic(Applied("atan2", (y, x)))
    angle = apply("atan", y / x)
    return angle if right > 0 else angle + PI if above != -1 else angle - PI
