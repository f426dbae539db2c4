"""Values of exact expressions at points, as floats or with proved bounds; whether one is zero.

python-flint's balls have the proved bounds. It is loaded only where floats leave a doubt.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Applied, Atom, Group, Surd, Symbol
from rigidcli.symbolic.algebra.expressions import Expr, factored, gathered, product
from rigidcli.symbolic.algebra.trigonometry import elementary_angles
from rigidcli.symbolic.language.tree import FUNCTIONS, UnknownFunction

MAX_STEPS = 20_000
"""Steps that a proof that an expression is zero may take, a few hundredths of a second."""

POINTS = 3
"""Points at which an expression must seem to be zero. A polynomial vanishes at all of them by chance only."""

TRIALS = 40
"""Points that are tried at most, as an expression may have no value at some."""

DOUBTFUL = 1e-3
"""A sum smaller than this, in units of its largest terms, may be rounding: floats lose 13 digits at most."""

PRECISIONS = (64, 200, 1100)
"""Bits of the balls that decide where floats do not. What all leave open is zero, to 330 digits."""

_RANGES = tuple(
    (Fraction(low), Fraction(width))
    for low, width in (("1/4", 2), (-2, 2), (-1, 2), ("1/50", "1/10"), (10, 100), (-100, 200))
)
"""Where the points lie: the least value of a symbol, and how far up its values go."""


def is_zero(e: Expr) -> bool:
    """Whether an expression vanishes wherever it has a value.

    Values at random points tell it from zero, or laws prove it to be zero; where neither is sure, values
    with a proved bound of their error decide. An expression for which no point with a value is
    found is not zero unless that is proved.
    """
    if not e.terms:
        return True
    if _seems_zero(e, _FLOATS) is False:
        return False
    try:
        allowance = Allowance(MAX_STEPS)
        reduced = _numerator(elementary_angles(e, allowance), allowance)
    except ExpressionError:
        reduced = e
    if not reduced.terms:
        return True
    if _seems_zero(reduced, _FLOATS) is False:
        return False
    from flint import ctx

    verdict: bool | None = None
    for bits in PRECISIONS:
        with ctx.workprec(bits):
            verdict = _seems_zero(e, _balls())
        if verdict is False:
            break
    return verdict is True


def has_value(e: Expr) -> bool:
    """Whether it is proved that an expression has a finite real value, at one of some points at least."""
    from flint import ctx

    with ctx.workprec(PRECISIONS[-1]):
        return _seems_zero(e, _balls()) is not None


def _numerator(e: Expr, allowance: Allowance) -> Expr:
    """What vanishes where the expression does, multiplied out."""
    coefficient, monomial = factored(e)
    above = [gathered(coefficient, {atom: n}) for atom, n in monomial if n > 0 and isinstance(atom, Group)]
    return elementary_angles(product(above), allowance) if above else e


_Functions = Mapping[str, Callable[..., Any]]

_FLOATS: _Functions = {
    **{name: function.real for name, function in FUNCTIONS.items()},
    "power": pow,
    "number": float,
    "pi": lambda: math.pi,
    "vanishes": lambda values: abs(sum(values)) <= DOUBTFUL * sum(map(abs, values)),
}


def _balls() -> _Functions:
    """The functions of python-flint's balls: numbers with a proved bound of their error."""
    from flint import arb, fmpq

    def method(name: str) -> Callable[[Any], Any]:
        return lambda x: getattr(x, name)()

    return {
        **{name: method(name) for name in FUNCTIONS},
        "abs": abs,
        "sign": method("sgn"),
        "atan2": arb.atan2,
        "power": pow,
        "number": lambda value: arb(fmpq(value.numerator, value.denominator)),
        "pi": arb.pi,
        "vanishes": lambda values: sum(values, arb()).contains(0),
    }


def enclosed(e: Expr, point: Mapping[str, Fraction], bits: int) -> Any:
    """The value of an expression as a ball of so many bits; its names have values in `point`.

    Raises ValueError or ArithmeticError where it has no finite real value, as an unknown function has none.
    """
    from flint import ctx

    if e.unknown:
        raise ValueError("a function without a formula")

    with ctx.workprec(bits):
        return _value(e, point, _balls())


def _seems_zero(e: Expr, functions: _Functions) -> bool | None:
    """Whether its values may be zero, as far as rounding lets tell; None if no point tried has one."""
    source = random.Random(20)  # noqa: S311 - points that are the same every time
    names = sorted(e.names)
    found = 0
    for trial in range(TRIALS):
        low, width = _RANGES[trial % len(_RANGES)]
        point = {name: low + width * Fraction(source.randrange(1, 1009), 1009) for name in names}
        try:
            values = [_value(Expr({m: c}), point, functions) for m, c in e.ordered]
            vanishes = functions["vanishes"](values)
        except (ArithmeticError, ValueError):
            continue
        if not vanishes:
            return False
        found += 1
        if found == POINTS:
            break
    return True if found else None


def _value(e: Expr, point: Mapping[str, Fraction], functions: _Functions) -> Any:
    number = functions["number"]
    value = number(Fraction(0))
    for monomial, coefficient in e.ordered:
        part = number(Fraction(coefficient))
        for atom, exponent in monomial:
            base = _value_of_atom(atom, point, functions)
            if exponent != 1:
                whole = exponent.denominator == 1
                base = functions["power"](base, int(exponent) if whole else number(Fraction(exponent)))
            if isinstance(base, complex) or not (isinstance(base, float) or base.is_finite()):
                raise ValueError("no real value")
            part *= base
        value += part
    return value


def _value_of_atom(atom: Atom, point: Mapping[str, Fraction], functions: _Functions) -> Any:
    match atom:
        case Symbol(name=name, positive=positive):
            return functions["number"](abs(point[name]) if positive else point[name])
        case Surd(value=value):
            return functions["number"](Fraction(value))
        case Group(inner=inner):
            return _value(inner, point, functions)
        case Applied(function=function, arguments=arguments):
            values = [_value(argument, point, functions) for argument in arguments]
            if isinstance(function, UnknownFunction):
                constant, *factors = (functions["number"](Fraction(c)) for c in function.trial)
                return sum((c * (x + x * x * x) for c, x in zip(factors, values, strict=True)), constant)
            return functions["power" if function == "pow" else function](*values)
        case _:
            return functions["pi"]()
