"""Values of exact expressions at points, with proved bounds by python-flint's balls; whether one is zero."""

from __future__ import annotations

import math
import operator
import random
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np

from rigidcli.algebra.atoms import Group, Pi, Symbol
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.fractions import vanishes
from rigidcli.algebra.trees import plain_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.language.expression import numbers
from rigidcli.language.tree import Kind, UnknownFunction, fold
from rigidcli.language.words import FUNCTIONS

POINTS_OF_ZERO = 3  # points at which an expression must seem to be zero: a polynomial does so by chance only
SIGNED_POINTS = 24  # points for what no law proves, so that most choices of signs of a few names are seen
TRIALS = 60  # points that are tried at most, as an expression may have no value at some
PRECISIONS = (64, 1100)  # bits of balls: few tell most numbers from zero, 330 digits pass for a proof

_RANGES = tuple((Fraction(low), Fraction(width)) for low, width in (("1/4", 2), ("1/50", "1/10"), (10, 100)))
"""Sizes of the values of symbols at the points: the least, and how far up they go."""


def is_zero(e: Expr) -> bool:
    """Whether an expression vanishes wherever it has a value.

    Different products of powers of symbols are independent, so that a sum of these is not zero, and a product
    of powers of such sums vanishes only with one of them. Otherwise values at random points, with proved
    bounds, tell an expression from zero, or it vanishes as a fraction of polynomials in which roots and
    functions have names. If neither decides, a value below 1e-330 counts as zero. An expression that has a
    value at none of the points is not zero unless that is proved.
    """
    if not e.terms:
        return True
    if all(isinstance(atom, (Symbol, Pi)) for atom in e.atoms):
        return False
    if len(e.terms) == 1 and all(isinstance(atom, (Symbol, Pi, Group)) for atom in e.atoms):
        ((monomial, _),) = e.terms.items()
        return any(is_zero(atom.inner) for atom, n in monomial if isinstance(atom, Group) and n > 0)
    few, many = PRECISIONS
    if _seems_zero(e, few, POINTS_OF_ZERO) is False:
        return False
    with suppress(ExpressionError):
        if vanishes(e):
            return True
    return _seems_zero(e, few, SIGNED_POINTS) is not False and _seems_zero(e, many, POINTS_OF_ZERO) is True


def has_value(e: Expr) -> bool:
    """Whether it is proved that an expression has a finite real value, at one of some points at least."""
    return _seems_zero(e, PRECISIONS[-1], POINTS_OF_ZERO) is not None


@lru_cache(1)
def _balls() -> Kind:
    """Numbers of python-flint with a proved bound of their error; no number is infinite or NaN."""
    from flint import arb

    functions: dict[str, Callable[..., Any]] = {name: operator.methodcaller(name) for name in FUNCTIONS}
    functions |= {"abs": abs, "sign": operator.methodcaller("sgn"), "atan2": arb.atan2}

    def call(function: str, values: list[Any]) -> Any:
        if not all(value.is_finite() for value in values):
            raise ValueError("no real value")
        if not isinstance(function, UnknownFunction):
            return functions[function](*values)
        constant, *factors = map(arb, function.trial)
        return sum((c * (x + x * x * x) for c, x in zip(factors, values, strict=True)), constant)

    def number(text: str, value: float) -> Any:
        return arb.pi() if text == "pi" else arb(int(text))

    return numbers(number, pow, call)


def enclosed(e: Expr, point: Mapping[str, Fraction], bits: int, is_trial: bool = False) -> Any:
    """The value as a ball of so many bits, at values of the names; on trial, functions have values, too."""
    if e.unknown and not is_trial:
        raise ExpressionError("a function without a formula has no value")
    from flint import arb, ctx, fmpq

    def name(word: str) -> Any:
        return arb(fmpq(point[word].numerator, point[word].denominator))

    with ctx.workprec(bits), suppress(ArithmeticError, ValueError):
        value = fold(plain_tree(e), name, _balls())
        if value.is_finite():
            return value
    raise ExpressionError("the expression has no finite real value")


def _seems_zero(e: Expr, bits: int, points: int) -> bool | None:
    """Whether its values may be zero, as far as rounding lets tell; None if no point tried has one."""
    verdicts = (value.contains(0) for value in islice(_trials(e, bits), points))
    first = next(verdicts, None)
    return None if first is None else first and all(verdicts)


def _trials(e: Expr, bits: int) -> Iterator[Any]:
    """The finite values of an expression at random points: positive ones first, then negative, then any."""
    source = random.Random(20)  # noqa: S311 - points that are the same every time
    positive = {atom.name for atom in e.everywhere() if isinstance(atom, Symbol) and atom.positive}
    for trial in range(TRIALS):
        low, width = _RANGES[trial // 2 % len(_RANGES)]
        signs = ([1], [-1], [1, -1])[min(trial, 2)]
        point = {
            name: source.choice(signs) * (low + width * Fraction(source.randrange(1, 1009), 1009))
            for name in sorted(e.names)
        }
        point |= {name: abs(point[name]) for name in positive}
        with suppress(ExpressionError):
            yield enclosed(e, point, bits, is_trial=True)


LOW, HIGH = 0.3, 1.7  # random values lie between these: near 1, and positive as masses and lengths are
TRIES = 40  # random points that are tried, as expressions may have no value at some


def sample_points(
    names: Sequence[str], fixed: Mapping[str, float], signed: Collection[str] = ()
) -> Iterator[dict[str, float]]:
    """Random values for the names that are not `fixed`, again and again: positive, but of `signed` names."""
    chance = random.Random(1)  # noqa: S311 - a probe needs no secrecy
    for _ in range(TRIES):
        point = {name: chance.uniform(LOW, HIGH) for name in names}
        for name in signed:
            if name in point:
                point[name] *= chance.choice((1, -1))
        yield point | dict(fixed)


def sampled(
    expressions: Sequence[Expr], fixed: Mapping[str, float], count: int = 3, signed: Collection[str] = ()
) -> Floats | None:
    """The values of the expressions at some points (count by n); None if there are not so many with values.

    Names have their `fixed` values, others random ones: positive, but for those of `signed` names.
    """
    names = sorted(set().union(*(e.names for e in expressions)) | set(fixed))
    f = code.function([plain_tree(e) for e in expressions], names, {})(math)
    rows = []
    for point in sample_points(names, fixed, signed):
        try:
            row = f(*(point[name] for name in names))
        except NO_VALUE:
            continue
        if all(map(math.isfinite, row)):
            rows.append(row)
        if len(rows) == count:
            return np.array(rows, dtype=np.float64).reshape(count, len(expressions))
    return None
