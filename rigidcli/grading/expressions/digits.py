"""Elementary functions of decimals with 80 digits, for where floats leave open whether terms cancel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from decimal import Context, Decimal, localcontext
from fractions import Fraction

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.high_precision import CONTEXT, PI
from rigidcli.grading.expressions.estimate import Ball, Estimate, Numbers, Values, estimate
from rigidcli.symbolic.language.tree import FUNCTIONS, Node

QUIET = Context(prec=CONTEXT.prec, Emax=CONTEXT.Emax, Emin=CONTEXT.Emin, traps=[])
"""Where there is no value, the result is NaN or infinite."""

UNIT = Decimal(10) ** (2 - CONTEXT.prec)
"""Relative rounding error of one operation; two digits are left to the series below."""

LARGEST = Decimal(10) ** 12
"""Of an angle whose sine is known to nearly all digits: PI has 95."""

TURN = Context(prec=100).multiply(2, PI)

TINY = Decimal(10) ** (-10 - CONTEXT.prec)
"""Where a series ends."""

NOT = Decimal("NaN")


def exactly(values: Mapping[str, Floats]) -> dict[str, Ball]:
    """Floats as decimals, without rounding."""
    return {name: Ball(_decimals(value), np.full(len(value), Decimal(0))) for name, value in values.items()}


def _decimals(values: Floats) -> Values:
    return np.array([Decimal(value) for value in values.tolist()], dtype=object)


def precisely(node: Node, values: Mapping[str, Ball], count: int) -> Estimate:
    """The same as `estimate` with 80 digits, from decimals."""
    with localcontext(QUIET):
        return estimate(node, values, count, DECIMALS)


def _of(fraction: Fraction) -> Decimal:
    return Decimal(fraction.numerator) / Decimal(fraction.denominator)


def _sine(x: Decimal) -> Decimal:
    """By the sine of a 27th: sin(3a) = 3 sin(a) - 4 sin(a)^3."""
    if not x.is_finite() or abs(x) > LARGEST:
        return NOT
    part = x.remainder_near(TURN) / 27
    square, sine, term, k = part * part, part, part, 1
    while abs(term) > TINY:
        term *= -square / ((k + 1) * (k + 2))
        sine += term
        k += 2
    for _ in range(3):
        sine *= 3 - 4 * sine * sine
    return sine


def _cosine(x: Decimal) -> Decimal:
    return _sine(PI / 2 - x.remainder_near(TURN)) if abs(x) <= LARGEST else NOT


def _arc(x: Decimal) -> Decimal:
    """The arc of a tangent, by that of an eighth: tan(a/2) = t/(1 + sqrt(1 + t^2))."""
    if not x.is_finite():
        return (PI / 2).copy_sign(x) if x.is_infinite() else NOT
    for _ in range(3):
        x = x / (1 + (1 + x * x).sqrt())
    square, arc, power, k = x * x, x, x, 1
    while abs(power) > TINY:
        power *= -square
        k += 2
        arc += power / k
    return 8 * arc


def _arc2(y: Decimal, x: Decimal) -> Decimal:
    if not (x.is_finite() and y.is_finite()):
        return NOT
    if x == 0:
        return (PI / 2).copy_sign(y) if y else Decimal(0)
    if x > 0:
        return _arc(y / x)
    return _arc(y / x) + (PI if y >= 0 else -PI)


def _arcsine(x: Decimal) -> Decimal:
    return _arc2(x, (1 - x * x).sqrt()) if abs(x) <= 1 else NOT


def _area_sine(x: Decimal) -> Decimal:
    return (abs(x) + (x * x + 1).sqrt()).ln().copy_sign(x)


def _area_cosine(x: Decimal) -> Decimal:
    return (x + ((x - 1) * (x + 1)).sqrt()).ln() if x >= 1 else NOT


def _area_tangent(x: Decimal) -> Decimal:
    return ((1 + x) / (1 - x)).ln() / 2 if abs(x) < 1 else NOT


def _hyperbolic_tangent(x: Decimal) -> Decimal:
    small = (-2 * abs(x)).exp()
    return ((1 - small) / (1 + small)).copy_sign(x)


_SCALAR: Mapping[str, Callable[..., Decimal]] = {
    "sin": _sine,
    "cos": _cosine,
    "tan": lambda x: _sine(x) / _cosine(x),
    "asin": _arcsine,
    "acos": lambda x: PI / 2 - _arcsine(x),
    "atan": _arc,
    "atan2": _arc2,
    "sinh": lambda x: (x.exp() - (-x).exp()) / 2,
    "cosh": lambda x: (x.exp() + (-x).exp()) / 2,
    "tanh": _hyperbolic_tangent,
    "asinh": _area_sine,
    "acosh": _area_cosine,
    "atanh": _area_tangent,
    "exp": Decimal.exp,
    "log": Decimal.ln,
    "sqrt": Decimal.sqrt,
    "abs": abs,
    "sign": lambda x: Decimal(0) if x == 0 else Decimal(1).copy_sign(x),
}


def _is_finite(values: Values) -> Mask:
    return np.asarray(_ARE_FINITE(values), dtype=bool)


_ARE_FINITE = np.frompyfunc(Decimal.is_finite, 1, 1)

DECIMALS = Numbers(
    unit=UNIT,
    pi=PI,
    of=_of,
    functions={name: np.frompyfunc(f, FUNCTIONS[name].arity, 1) for name, f in _SCALAR.items()},
    nearest_integer=np.frompyfunc(Decimal.to_integral_value, 1, 1),
    finite=_is_finite,
    floor=UNIT,
    tiny=Decimal(0),
)
