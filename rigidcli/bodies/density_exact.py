"""Integrals of a density over a shape in exact numbers, where a closed form is found.

The integrands are multiplied out in the coordinates of a chart, and integrated term by term.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Symbol
from rigidcli.algebra.calculus import antiderivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import (
    ONE,
    ZERO,
    Expr,
    expr,
    gathered,
    number,
    power,
    symbol,
    total,
)
from rigidcli.algebra.functions import apply
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import substitute
from rigidcli.bodies.charts import Chart, Turn
from rigidcli.bodies.density import PAIRS, symmetric
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ExpressionError, ValueProblem
from rigidcli.fields.environment import Formula

MAX_STEPS = 400_000
"""Steps in multiplying out all ten integrands: about two seconds."""

HIGHEST = 200
"""The highest power of a sine or cosine that is integrated, by as many steps."""

SIDED = ("abs", "sign")
"""Functions with another form on either side of the place where their argument vanishes."""

Factors: TypeAlias = Sequence[tuple[Atom, Rational]]
"""A product of powers of atoms."""


def exact_properties(formula: Formula, charts: Sequence[Chart], n: Arithmetic) -> MassProperties:
    """Mass, centre of mass and tensor.

    Raises ComputationError where no closed form is found, and ValueProblem for a mass that is not positive.
    """
    mass: Any
    moments: list[Any]
    allowance = Allowance(MAX_STEPS)
    try:
        parts = zip(*(_sums(formula, chart, allowance) for chart in charts), strict=True)
        mass, *moments = map(total, parts)
        if n.sign(mass) in (0, -1):
            raise ValueProblem("the density leaves no mass", path=("density",))
        com = n.tidy(n.array(moments[:3]) / mass)
        second = symmetric(n.array(moments[3:])) - mass * np.outer(com, com)
        inertia = tensor.Inertia.of_sums(mass, com, n.tidy(second))
    except ExpressionError as error:
        raise ComputationError(
            "no closed form is found for the integrals of the density",
            hint="polynomials have one, and functions of one coordinate that suits the shape; for numbers, "
            "give every parameter a value, and leave out `--exact`",
        ) from error
    return MassProperties(n.tidied(mass), com, inertia)


def placed(
    density: Formula | Scalar, chart: Chart, symbols: Sequence[Any]
) -> tuple[Sequence[Expr], Expr, Expr]:
    """A place (x, y, z) in the coordinates of a chart, the density there, and the measure.

    Coordinates that are angles are pairs of a cosine and a sine. Raises ExpressionError where the density
    has no value, or is too large.
    """
    spot = chart.place(*symbols)
    place = [expr(part) + start for part, start in zip(spot[:3], chart.origin, strict=True)]
    if not isinstance(density, Formula):
        return place, expr(density), expr(spot.measure)
    s, r = (
        power(sum((part**2 for part in place[:count]), ZERO), Fraction(1, 2))
        if known is None
        else expr(known)
        for known, count in ((spot.s, 2), (spot.r, 3))
    )
    constants = {name: expr(value) for name, value in density.constants.items()}
    known = dict(zip("xyzsr", (*place, s, r), strict=True)) | constants
    return place, from_tree(density.expression.root, known), expr(spot.measure)


def _sums(formula: Formula, chart: Chart, allowance: Allowance) -> Iterator[Expr]:
    """The integrals of the density, of it times x, y, z, and of it times their products (10).

    The coordinates have names that no document can give. Raises ExpressionError where a term is no product of
    powers that can be integrated.
    """
    names = [
        (f"coordinate {k}",) if turn is None else (f"cosine {k}", f"sine {k}")
        for k, turn in enumerate(chart.coordinates)
    ]
    owner = {name: k for k, own in enumerate(names) for name in own}

    @cache
    def along(k: int, factors: Factors) -> Expr:
        turn = chart.coordinates[k]
        return _over_unit(names[k][0], factors) if turn is None else _over_turn(turn, names[k], factors)

    def integral(e: Expr) -> Iterator[Expr]:
        for monomial, coefficient in expand(e, allowance).ordered:
            moving: list[list[tuple[Atom, Rational]]] = [[] for _ in range(len(names) + 1)]
            for atom, exponent in monomial:
                on = {owner[name] for name in atom.names if name in owner} or {len(names)}
                if len(on) > 1:
                    raise _no_product()
                moving[on.pop()].append((atom, exponent))
            *own, rest = map(tuple, moving)
            parts = [_over_simplex(own)] if chart.is_simplex else [along(*each) for each in enumerate(own)]
            yield math.prod(parts, start=gathered(coefficient, dict(rest)))

    symbols = [symbol(*own, True) if len(own) == 1 else tuple(map(symbol, own)) for own in names]
    place, density, measure = placed(formula, chart, symbols)
    weight = density * measure
    for moment in (ONE, *place, *(place[i] * place[j] for i, j in PAIRS)):
        yield total(list(integral(weight * moment)))


def _no_product() -> ExpressionError:
    return ExpressionError("a term is no product of powers that can be integrated")


def _exponents(names: Sequence[str], factors: Factors) -> list[int]:
    """Those of the symbols with these names, whole numbers. Raises ExpressionError for other factors."""
    found = dict.fromkeys(names, 0)
    for atom, exponent in factors:
        if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
            raise _no_product()
        found[atom.name] = int(exponent)
    return [found[name] for name in names]


def _over_unit(name: str, factors: Factors) -> Expr:
    """The integral of a product of powers from 0 to 1. Raises ExpressionError where it is not found."""
    if all(isinstance(atom, Symbol) for atom, _ in factors):
        exponent = Fraction(sum((own for _, own in factors), Fraction(0))) + 1
        if exponent <= 0:
            raise _no_product()
        return number(1 / exponent)
    sided = {
        atom: _line(name, atom) for atom, _ in factors if isinstance(atom, Applied) and atom.function in SIDED
    }
    inside = {root for _, root in sided.values() if 0 < root < 1}
    parts = []
    for low, high in pairwise(sorted({Fraction(0), Fraction(1), *inside})):
        here: dict[Atom, Expr] = {}
        for atom, (slope, root) in sided.items():
            side = 1 if low + high > 2 * root else -1
            away = symbol(name) - root if atom.function == "abs" else ONE
            here[atom] = side * away * apply(str(atom.function), slope)
        inner = math.prod((here.get(atom, gathered(1, {atom: 1})) ** k for atom, k in factors), start=ONE)
        found = antiderivative(inner, name)
        if found is None:
            raise _no_product()
        parts += [substitute(found, {name: number(high)}), -substitute(found, {name: number(low)})]
    return total(parts)


def _line(name: str, atom: Applied[Expr]) -> tuple[Expr, Fraction]:
    """The slope of the argument of abs or sign in a coordinate, and the number at which it vanishes."""
    found = coefficients(atom.arguments[0], [name])
    if found is None or max(found) != (1,):
        raise _no_product()
    root = (-found.get((0,), ZERO) / found[(1,)]).as_number
    if not isinstance(root, int | Fraction):
        raise _no_product()
    return found[(1,)], Fraction(root)


def _over_turn(turn: Turn, names: Sequence[str], factors: Factors) -> Expr:
    """The integral of a product of powers of a cosine and a sine from 0 to the end of a turn, by parts."""
    p, q = _exponents(names, factors)
    c, s, end = (expr(part) for part in (turn.cos, turn.sin, turn.end))
    found, factor = ZERO, ONE
    while q >= 2:
        found -= factor * s ** (q - 1) * c ** (p + 1) / (p + q)
        factor, q = factor * Fraction(q - 1, p + q), q - 2
    if q == 1:
        return found + factor * (1 - c ** (p + 1)) / (p + 1)
    while p >= 2:
        found += factor * c ** (p - 1) * s / p
        factor, p = factor * Fraction(p - 1, p), p - 2
    return found + factor * (s if p == 1 else end)


def _over_simplex(factors: Sequence[Factors]) -> Expr:
    """The integral of a product of powers of all coordinates of a simplex.

    That of a^i b^j ... is i! j! .../(i + j + ... + d)! in d dimensions, as Dirichlet found.
    """
    powers = [sum(_exponents([f"coordinate {k}"], own)) for k, own in enumerate(factors)]
    above = math.prod(map(math.factorial, powers))
    return number(Fraction(above, math.factorial(sum(powers) + len(powers))))
