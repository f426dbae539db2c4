"""Values of exact expressions at points, with proved bounds by python-flint's balls; whether one is zero."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group, Pi, Surd, Symbol
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.fractions import vanishes
from rigidcli.algebra.trees import plain_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.language.functions import FUNCTIONS
from rigidcli.language.tree import UnknownFunction

MAX_STEPS = 20_000
"""Steps that a proof that an expression is zero may take, a few hundredths of a second."""

POINTS = 3
"""Points at which an expression must seem to be zero. A polynomial vanishes at all of them by chance only."""

SIGNED_POINTS = 24
"""Points at which what no law proves is tried, so that most choices of signs of a few names are seen."""

TRIALS = 60
"""Points that are tried at most, as an expression may have no value at some."""

PRECISIONS = (64, 200, 1100)
"""Bits of the balls that decide, one after the other."""

_RANGES = tuple((Fraction(low), Fraction(width)) for low, width in (("1/4", 2), ("1/50", "1/10"), (10, 100)))
"""Sizes of the values of symbols at the points: the least, and how far up they go."""


def is_zero(e: Expr) -> bool:
    """Whether an expression vanishes wherever it has a value.

    Different products of powers of symbols are independent, so that a sum of these is not zero. Otherwise
    values at random points, with proved bounds, tell an expression from zero, or it vanishes as a fraction of
    polynomials in which roots and functions have names. What both leave open is zero to 330 digits, and taken
    for zero. An expression that has a value at none of the points is not zero unless that is proved.
    """
    if not e.terms:
        return True
    if all(isinstance(atom, (Symbol, Pi)) for atom in e.atoms):
        return False
    from flint import ctx

    with ctx.workprec(PRECISIONS[0]):
        if _seems_zero(e) is False:
            return False
    with suppress(ExpressionError):
        if vanishes(e, Allowance(MAX_STEPS)):
            return True
    verdict: bool | None = None
    for bits, points in zip(PRECISIONS, (SIGNED_POINTS, POINTS, POINTS), strict=True):
        with ctx.workprec(bits):
            verdict = _seems_zero(e, points)
        if verdict is False:
            break
    return verdict is True


def has_value(e: Expr) -> bool:
    """Whether it is proved that an expression has a finite real value, at one of some points at least."""
    from flint import ctx

    with ctx.workprec(PRECISIONS[-1]):
        return _seems_zero(e) is not None


_Functions = Mapping[str, Callable[..., Any]]


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


def _trials(e: Expr) -> Iterator[Any]:
    """The finite values of an expression, as balls, at random points."""
    functions = _balls()
    for point in _trial_points(e.names):
        with suppress(ArithmeticError, ValueError):
            value = _value(e, point, functions)
            if value.is_finite():
                yield value


def _seems_zero(e: Expr, points: int = POINTS) -> bool | None:
    """Whether its values may be zero, as far as rounding lets tell; None if no point tried has one."""
    verdicts = (value.contains(0) for value in islice(_trials(e), points))
    first = next(verdicts, None)
    return None if first is None else first and all(verdicts)


def _trial_points(names: frozenset[str]) -> Iterator[dict[str, Fraction]]:
    """Random points: with positive values at first, then with negative ones, then with any."""
    source = random.Random(20)  # noqa: S311 - points that are the same every time
    for trial in range(TRIALS):
        low, width = _RANGES[trial // 2 % len(_RANGES)]
        signs = ([1], [-1], [1, -1])[min(trial, 2)]
        yield {
            name: source.choice(signs) * (low + width * Fraction(source.randrange(1, 1009), 1009))
            for name in sorted(names)
        }


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
            if not base.is_finite():
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


LOW, HIGH = 0.3, 1.7
"""Random values lie between these: near 1, and positive as masses and lengths are."""

TRIES = 40
"""Random points that are tried at least, as expressions may have no value at some."""


def sample_points(
    names: Sequence[str],
    fixed: Mapping[str, float],
    seed: int = 1,
    signed: Collection[str] = (),
    tries: int = TRIES,
) -> Iterator[dict[str, float]]:
    """Random values for the names that are not `fixed`, again and again: positive, but of `signed` names."""
    chance = random.Random(seed)  # noqa: S311 - a probe needs no secrecy
    for _ in range(tries):
        point = {name: chance.uniform(LOW, HIGH) for name in names}
        for name in signed:
            if name in point:
                point[name] *= chance.choice((1, -1))
        yield point | dict(fixed)


def sampled(
    expressions: Sequence[Expr],
    fixed: Mapping[str, float],
    count: int = 3,
    seed: int = 1,
    signed: Collection[str] = (),
) -> Floats | None:
    """The values of the expressions at some points (count by n); None if there are not so many with values.

    Names have their `fixed` values, others random ones: positive, but for those of `signed` names.
    """
    names = sorted(set().union(*(e.names for e in expressions)) | set(fixed))
    f = code.function([plain_tree(e) for e in expressions], names, {})(math)
    rows = []
    for point in sample_points(names, fixed, seed, signed, max(TRIES, 3 * count)):
        try:
            row = f(*(point[name] for name in names))
        except NO_VALUE:
            continue
        if all(map(math.isfinite, row)):
            rows.append(row)
        if len(rows) == count:
            return np.array(rows, dtype=np.float64).reshape(count, len(expressions))
    return None
