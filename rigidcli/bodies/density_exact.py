"""Integrals of a density over a shape in exact numbers, where there is a closed form.

The integrands are multiplied out in the coordinates of a chart, and integrated term by term.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any, TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Symbol
from rigidcli.algebra.calculus import antiderivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, expr, gathered, number, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import substitute
from rigidcli.bodies.charts import Chart, Spot, Turn
from rigidcli.bodies.density import FIRST, SECOND, centred, places
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ExpressionError
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

    Raises ComputationError where there is no closed form, and ValueProblem for a mass that is not positive.
    """
    allowance = Allowance(MAX_STEPS)
    try:
        of_charts = zip(*(_moments(formula, chart, allowance) for chart in charts), strict=True)
        mass, com, sums = centred(n.array(list(map(total, of_charts))), n)
        inertia = tensor.Inertia.of_sums(mass, com, sums)
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
    spot = Spot(*(None if part is None else expr(part) for part in chart.place(*symbols)))
    at = places(spot, chart.origin, hypot=lambda a, b: power(a**2 + b**2, Fraction(1, 2)))
    place = [at[name] for name in "xyz"]
    if not isinstance(density, Formula):
        return place, expr(density), spot.measure
    constants = {name: expr(value) for name, value in density.constants.items()}
    return place, from_tree(density.expression.root, {**at, **constants}), spot.measure


def _moments(formula: Formula, chart: Chart, allowance: Allowance) -> Iterator[Expr]:
    """The integrals (10) of the density times products of 1, x, y, z.

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
        if turn is None:
            return _over_unit(names[k][0], factors)
        return _over_turn(turn, *_powers(names[k], factors))

    def integral(e: Expr) -> Iterator[Expr]:
        for monomial, coefficient in expand(e, allowance).ordered:
            moving: list[list[tuple[Atom, Rational]]] = [[] for _ in range(len(names) + 1)]
            for atom, exponent in monomial:
                on = {owner[name] for name in atom.names if name in owner} or {len(names)}
                if len(on) > 1:
                    raise _no_product()
                moving[on.pop()].append((atom, exponent))
            *own, rest = map(tuple, moving)
            if chart.is_simplex:
                whole = _over_simplex([_powers(*own) for own in zip(names, moving, strict=False)])
            else:
                whole = math.prod((along(k, factors) for k, factors in enumerate(own)), start=ONE)
            yield gathered(coefficient, dict(rest)) * whole

    symbols = [symbol(*own, True) if len(own) == 1 else tuple(map(symbol, own)) for own in names]
    place, density, measure = placed(formula, chart, symbols)
    mass, factors = density * measure, (ONE, *place)
    for first, second in zip(FIRST, SECOND, strict=True):
        yield total(list(integral(mass * (factors[first] * factors[second]))))


def _no_product() -> ExpressionError:
    return ExpressionError("a term is no product of powers that can be integrated")


def _powers(names: Sequence[str], factors: Factors) -> list[int]:
    """The exponents of symbols, whole numbers. Raises ExpressionError for other factors."""
    powers = dict.fromkeys(names, 0)
    for atom, exponent in factors:
        if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
            raise _no_product()
        powers[atom.name] = int(exponent)
    return list(powers.values())


def _over_unit(name: str, factors: Factors) -> Expr:
    """The integral of a product of powers from 0 to 1. Raises ExpressionError where there is none."""
    if all(isinstance(atom, Symbol) and exponent >= 0 for atom, exponent in factors):
        return number(1 / Fraction(1 + sum(exponent for _, exponent in factors)))
    lines = {
        atom: _line(name, atom) for atom, _ in factors if isinstance(atom, Applied) and atom.function in SIDED
    }
    inside = {root for _, root in lines.values() if 0 < root < 1}
    parts = []
    for low, high in pairwise(sorted({Fraction(0), Fraction(1), *inside})):
        here: dict[Atom, Expr] = {}
        for atom, (slope, root) in lines.items():
            side = 1 if low + high > 2 * root else -1
            away = symbol(name) - root if atom.function == "abs" else ONE
            here[atom] = side * away * apply(str(atom.function), slope)
        inner = math.prod((here.get(atom, gathered(1, {atom: 1})) ** k for atom, k in factors), start=ONE)
        whole = antiderivative(inner, name)
        if whole is None:
            raise _no_product()
        parts += [substitute(whole, {name: number(high)}), -substitute(whole, {name: number(low)})]
    return total(parts)


def _line(name: str, atom: Applied[Expr]) -> tuple[Expr, Fraction]:
    """The slope of the argument of abs or sign in a coordinate, and the number at which it vanishes."""
    line = coefficients(atom.arguments[0], [name])
    if line is None or max(line) != (1,):
        raise _no_product()
    root = (-line.get((0,), ZERO) / line[(1,)]).as_number
    if not isinstance(root, int | Fraction):
        raise _no_product()
    return line[(1,)], Fraction(root)


def _over_turn(turn: Turn, p: int, q: int) -> Expr:
    """The integral of cos^p sin^q over a turn, by parts."""
    c, s, end = (expr(part) for part in (turn.cos, turn.sin, turn.end))
    if q >= 2:
        return ((q - 1) * _over_turn(turn, p, q - 2) - s ** (q - 1) * c ** (p + 1)) / (p + q)
    if q == 1:
        return (1 - c ** (p + 1)) / (p + 1)
    if p >= 2:
        return ((p - 1) * _over_turn(turn, p - 2, 0) + c ** (p - 1) * s) / p
    return s if p == 1 else end


def _over_simplex(powers: Sequence[Sequence[int]]) -> Expr:
    """The integral of a product of powers of the coordinates of a simplex.

    In d dimensions that of a^i b^j ... is i! j! .../(i + j + ... + d)!, as Dirichlet showed.
    """
    exponents = [exponent for (exponent,) in powers]
    above = math.prod(map(math.factorial, exponents))
    return number(Fraction(above, math.factorial(sum(exponents) + len(exponents))))
