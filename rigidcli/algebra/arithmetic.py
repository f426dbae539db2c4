"""Exact numbers as an `Arithmetic`: rationals, roots, pi, and symbols without a value.

Nothing here is decided by the clock: what is tried depends on the size of an expression alone, so that the
same expression always comes out the same.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any, cast

import numpy as np

from rigidcli.algebra import simplification, values
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.bounds import Rational, content, magnitude
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, PI, ZERO, Expr, expr, factored, gathered, power, symbol, total
from rigidcli.algebra.fractions import factors, lowest_terms
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import from_tree
from rigidcli.core.arithmetic import Arithmetic, Array
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language.text import reading
from rigidcli.language.tree import Node

MOST_NODES_TO_PRINT = 4_000  # the most nodes of a result: its text would be several pages long

_HALF = Fraction(1, 2)


@lru_cache(maxsize=4096)
def tidy(e: Expr) -> Expr:
    """The shortest of the forms that cheap rearrangements find, over and over; 0 for a hidden zero.

    Raises ComputationError where all forms are too long for anybody to read.
    """
    short = e
    while (form := simplification.tidy(short)) != short:  # the parts of a new form may have shorter forms
        short = form
    if simplification.is_product(short):
        return short
    forms = [short]
    with suppress(ExpressionError):
        forms += lowest_terms(short)
    shorter = simplification.shortest(forms)
    if shorter.nodes > MOST_NODES_TO_PRINT:
        raise ComputationError("an exact result is too long to print")
    if values.is_zero(shorter):
        return ZERO
    return short if shorter == short else tidy(shorter)


def worked_out(node: Node, known: Mapping[str, Expr]) -> Expr:
    """The exact value of a tree whose names have these values. Raises ExpressionError where it has none."""
    e = from_tree(node, known)
    if any(isinstance(atom, Applied | Group) for atom in e.atoms) and not values.has_value(e):
        raise ExpressionError("there is no finite real value, or it cannot be told")
    return e


def tidy_array(array: Array) -> Array:
    """An array of exact numbers, each one tidied."""
    tidied: Array = np.frompyfunc(lambda entry: tidy(expr(entry)), 1, 1)(array)
    return tidied


def common_factor(array: Array) -> tuple[Expr, Array]:
    """The factor that leaves an array of exact numbers shortest, and what it leaves.

    Rational entries become integers without a common divisor. Where nothing gets shorter, the factor is 1.
    """
    entries = [factored(entry) for entry in array.flat if entry]
    if not entries:
        return ONE, array
    shared: dict[Atom, Rational] = dict(entries[0][1])
    for powers in (dict(monomial) for _, monomial in entries[1:]):
        shared = {a: min(n, powers[a], key=magnitude) for a, n in shared.items() if n * powers.get(a, 0) > 0}
    numbers = [number for number, _ in entries]
    is_turned = numbers[0] < 0 and any(isinstance(atom, Group) for atom in shared)  # b - 1 becomes 1 - b
    factor = gathered(-content(numbers) if is_turned else content(numbers), shared)
    rest = np.array([entry / factor for entry in array.flat], dtype=object).reshape(array.shape)
    before, after = (sum(len(str(entry)) for entry in entries.flat) for entries in (array, rest))
    return (factor, rest) if after + len(str(factor)) < before else (ONE, array)


def _number_sign(e: Expr) -> int:
    for bits in values.PRECISIONS:
        ball = values.enclosed(e, {}, bits)
        if not ball.contains(0):
            return 1 if ball > 0 else -1
    return 0


def _float(e: Expr, point: Mapping[str, Fraction]) -> float:
    for bits in values.PRECISIONS:
        ball = values.enclosed(e, point, bits)
        if ball.rel_accuracy_bits() > np.finfo(np.float64).nmant + 1:
            return float(ball.mid())
    return 0.0


def size(x: Any) -> float:
    """The number, or its value where every symbol has a value of its own between 1 and 2."""
    e = expr(x)
    try:
        return _float(e, {name: 1 + Fraction(zlib.crc32(name.encode()), 2**32) for name in e.names})
    except ExpressionError:
        return math.nan


def sign(x: Any) -> int | None:
    """-1, 0 or 1; None where that depends on symbols."""
    weak = weak_sign(expr(x))
    return None if weak is None or not weak[1] else weak[0]


def weak_sign(x: Expr) -> tuple[int, bool] | None:
    """The sign that an expression has unless it is zero, and whether it never is; None where it has both."""
    e = tidy(x)
    if not e.names:
        return _number_sign(e), True
    known = e.sign()
    if known is not None:
        return known, e.is_strict()
    try:
        parts = factors(e)
    except ExpressionError:
        return None
    product, strict = 1, True
    for factor, exponent in parts:
        known = factor.sign() if factor.names else _number_sign(factor)
        if exponent % 2:
            if known is None:
                return None
            product *= known
        strict = strict and known is not None and (factor.is_strict() or not factor.names)
    return product, strict


def inequality(e: Expr) -> str:
    """The condition e > 0 as in a book, c^2 < 4 k m: without positive factors, and without a minus sign."""
    with suppress(ExpressionError):
        kept = ONE
        for factor, times in factors(e):
            side = factor.sign()
            kept *= ONE if times % 2 == 0 or side == 1 else -ONE if side == -1 else factor
        e = tidy(kept)
    below = Expr({monomial: -c for monomial, c in e.terms.items() if c < 0})
    above = e + below
    if not (below and above):
        return f"{reading(e.tree())} > 0"
    return f"{reading(below.tree())} < {reading(above.tree())}"


def polynomial_factors(e: Expr, unknown: str) -> list[tuple[dict[int, Expr], int]]:
    """The irreducible factors that hold a name, as coefficients by their powers, with their exponents."""
    parts = [(f, times) for f, times in factors(e) if unknown in f.names and times > 0]
    polynomials = [(coefficients(factor, [unknown]), times) for factor, times in parts]
    return [({k: c for (k,), c in p.items()}, times) for p, times in polynomials if p is not None]


def sqrt(x: Any) -> Expr:
    """The square root, of squares of known sign without a root."""
    return root_of_either_sign(x, abs)


def root_of_either_sign(x: Any, of_square: Callable[[Expr], Expr] = lambda x: x) -> Expr:
    """A square root whose sign is free: of x^2 simply x, or what `of_square` makes of x."""
    e = tidy(expr(x))
    if e.as_number is not None:
        return power(e, _HALF)
    try:
        parts = factors(e)
    except ExpressionError:
        return power(e, _HALF)
    outside, inside = ONE, ONE
    for factor, exponent in parts:
        outside *= of_square(factor) ** (exponent // 2)
        inside *= factor ** (exponent % 2)
    return outside * power(tidy(inside), _HALF)


# An `Expr` stands where `Arithmetic` says `Scalar`.
EXACT: Arithmetic = cast(Any, Arithmetic)(
    exact=True,
    pi=PI,
    sqrt=sqrt,
    sin=lambda x: apply("sin", x),
    cos=lambda x: apply("cos", x),
    atan2=lambda y, x: apply("atan2", tidy(expr(y)), tidy(expr(x))),
    hypot=lambda *components: sqrt(total(expr(x) ** 2 for x in components)),
    value=lambda x: None if expr(x).names else _float(expr(x), {}),
    sign=sign,
    size=size,
    tidy=tidy_array,
    symbol=symbol,
)
