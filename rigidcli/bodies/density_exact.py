"""Integrals of a density over a shape in exact numbers, where a closed form is found.

The integrands are multiplied out in the coordinates of a chart, and integrated term by term.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Atom, Symbol
from rigidcli.algebra.expansion import expand
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
from rigidcli.algebra.integration import antiderivative
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

Factors: TypeAlias = Mapping[Atom, Rational]


def exact_properties(formula: Formula, charts: Sequence[Chart], n: Arithmetic) -> MassProperties:
    """Mass, centre of mass and tensor.

    Raises ComputationError where no closed form is found, and ValueProblem for a mass that is not positive.
    """
    allowance = Allowance(MAX_STEPS)
    sums = n.array(np.zeros(10, dtype=int))
    try:
        for chart in charts:
            sums = sums + _sums(formula, chart, allowance, n)
        mass, first = sums[0], sums[1:4]
        if n.sign(mass) in (0, -1):
            raise ValueProblem("the density leaves no mass", path=("density",))
        com = n.tidy(first / mass)
        second = symmetric(sums[4:]) - mass * np.outer(com, com)
        inertia = tensor.Inertia.of_sums(mass, com, n.tidy(second))
    except ExpressionError as error:
        raise _no_closed_form() from error
    return MassProperties(n.tidy(n.array([mass]))[0], com, inertia)


class Placed(NamedTuple):
    """A point of a shape in coordinates: its place (x, y, z), the density there, and the measure."""

    place: Sequence[Expr]
    density: Expr
    measure: Expr


def placed(density: Formula | Scalar, chart: Chart, symbols: Sequence[Any]) -> Placed:
    """A density in the coordinates of a chart; those that are angles are pairs of a cosine and a sine.

    Raises ExpressionError where it has no value, or is too large.
    """
    spot = chart.place(*symbols)
    place = [expr(part) + start for part, start in zip(spot[:3], chart.origin, strict=True)]
    if not isinstance(density, Formula):
        return Placed(place, expr(density), expr(spot.measure))
    s = _root(place[:2]) if spot.s is None else expr(spot.s)
    r = _root(place) if spot.r is None else expr(spot.r)
    known = dict(zip("xyzsr", (*place, s, r), strict=True))
    constants = {name: expr(value) for name, value in density.constants.items()}
    varying = from_tree(density.expression.root, {**known, **constants})
    return Placed(place, varying, expr(spot.measure))


def _sums(formula: Formula, chart: Chart, allowance: Allowance, n: Arithmetic) -> Any:
    """The integrals of the density, of it times x, y, z, and of it times their products (10)."""
    coordinates = _Coordinates(chart)
    place, density, measure = placed(formula, chart, coordinates.symbols)
    weight = density * measure
    moments = [expr(1), *place, *(place[i] * place[j] for i, j in PAIRS)]
    found = [coordinates.integral(weight * moment, allowance) for moment in moments]
    if None in found:
        raise _no_closed_form()
    return n.array(found)


def _root(components: Sequence[Expr]) -> Expr:
    moving = [part for part in components if not part.is_zero]
    if len(moving) == 1:
        return apply("abs", *moving)
    return power(sum((part**2 for part in moving), expr(0)), Fraction(1, 2))


def _no_closed_form() -> ComputationError:
    return ComputationError(
        "no closed form is found for the integrals of the density",
        hint="polynomials have one, and functions of one coordinate that suits the shape; for numbers, give "
        "every parameter a value, and leave out `--exact`",
    )


class _Coordinates:
    """The coordinates of a chart, under names that no document can give.

    `symbols` has each as a formula takes it: a symbol, or the pair of the cosine and the sine of an angle.
    """

    def __init__(self, chart: Chart) -> None:
        self._turns, self._is_simplex = chart.coordinates, chart.is_simplex
        self._names = [
            [f"cosine {k}", f"sine {k}"] if isinstance(turn, Turn) else [f"coordinate {k}"]
            for k, turn in enumerate(chart.coordinates)
        ]
        self._place = {name: k for k, names in enumerate(self._names) for name in names}
        self._known: dict[tuple[object, ...], Expr | None] = {}
        self.symbols = [
            symbol(names[0], True) if len(names) == 1 else tuple(map(symbol, names)) for names in self._names
        ]

    def integral(self, e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over all of them; None where a term is no product of powers that can be integrated.

        Raises ExpressionError where an expression gets too large.
        """
        terms = []
        for monomial, coefficient in expand(e, allowance).ordered:
            rest: dict[Atom, Rational] = {}
            moving: list[dict[Atom, Rational]] = [{} for _ in self._turns]
            for atom, exponent in monomial:
                on = {self._place[name] for name in atom.names if name in self._place}
                if len(on) > 1:
                    return None
                (moving[on.pop()] if on else rest)[atom] = exponent
            if self._is_simplex:
                along = [_over_simplex(moving)]
            else:
                along = [self._along(k, factors) for k, factors in enumerate(moving)]
            known = [own for own in along if own is not None]
            if len(known) < len(along):
                return None
            terms.append(math.prod(known, start=gathered(coefficient, rest)))
        return total(terms)

    def _along(self, k: int, factors: Factors) -> Expr | None:
        """The integral of a product of powers along a coordinate."""
        key = k, tuple(factors.items())
        if key not in self._known:
            turn = self._turns[k]
            self._known[key] = (
                _over_unit(self._names[k][0], factors)
                if turn is None
                else _over_turn(turn, self._names[k], factors)
            )
        return self._known[key]


def _over_unit(name: str, factors: Factors) -> Expr | None:
    """The integral of a product of powers from 0 to 1."""
    if all(isinstance(atom, Symbol) for atom in factors):
        exponent = Fraction(sum(factors.values(), Fraction(0))) + 1
        return number(1 / exponent) if exponent > 0 else None
    found = antiderivative(gathered(1, dict(factors)), name)
    try:
        return found and substitute(found, {name: ONE}) - substitute(found, {name: ZERO})
    except ExpressionError:
        return None


def _over_turn(turn: Turn, names: Sequence[str], factors: Factors) -> Expr | None:
    """The integral of a product of powers of a cosine and a sine from 0 to the end of a turn, by parts."""
    powers = dict.fromkeys(names, 0)
    for atom, exponent in factors.items():
        if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
            return None
        powers[atom.name] = int(exponent)
    p, q = powers.values()
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


def _over_simplex(factors: Sequence[Factors]) -> Expr | None:
    """The integral of a product of powers of all coordinates of a simplex.

    That of a^i b^j ... is i! j! .../(i + j + ... + d)! in d dimensions, as Dirichlet found.
    """
    powers = [sum(own.values()) for own in factors]
    pairs = [pair for own in factors for pair in own.items()]
    if not all(isinstance(atom, Symbol) and n.denominator == 1 and n >= 0 for atom, n in pairs):
        return None
    above = math.prod(math.factorial(int(n)) for n in powers)
    return number(Fraction(above, math.factorial(int(sum(powers)) + len(powers))))
