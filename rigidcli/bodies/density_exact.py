"""Integrals of a density over a shape in exact numbers, where there is a closed form.

The integrands are multiplied out, and integrated term by term over one coordinate of a chart after another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from math import comb
from typing import Any, TypeAlias

from rigidcli.algebra.atoms import Atom, Group, Symbol
from rigidcli.algebra.bounds import Allowance, Rational
from rigidcli.algebra.calculus import antiderivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, expr, gathered, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import from_tree, substitute
from rigidcli.bodies.charts import Arc, Chart, Spot
from rigidcli.bodies.density import FIRST, SECOND, centred, places
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.tensor import from_second_moments
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.fields.environment import BoundExpression

MAX_STEPS = 400_000  # steps in multiplying out all ten integrands: about two seconds
HIGHEST_POWER_INTEGRATED = 200  # the highest power of a sine or cosine that is integrated, by as many steps
Factors: TypeAlias = Sequence[tuple[Atom, Rational]]  # a product of powers of atoms


def exact_properties(formula: BoundExpression, charts: Sequence[Chart], n: Arithmetic) -> MassProperties:
    """Exact mass properties. Raises ComputationError without closed form, ValueProblem without mass."""
    allowance = Allowance(MAX_STEPS)
    try:
        of_charts = zip(*(_moments(formula, chart, allowance) for chart in charts), strict=True)
        mass, com, sums = centred(n.array(list(map(total, of_charts))), n)
        tensor = n.tidy(from_second_moments(1, sums))
    except ExpressionError as error:
        raise ComputationError(
            "no closed form is found for the integrals of the density",
            hint="polynomials have one, and functions of one coordinate that suits the shape; for numbers, "
            "give every parameter a value, and leave out `--exact`",
        ) from error
    return MassProperties(n.tidied(mass), com, tensor)


def placed(
    density: BoundExpression | Scalar, chart: Chart, symbols: Sequence[Any]
) -> tuple[Sequence[Expr], Expr, Expr]:
    """A place (x, y, z) in the coordinates of a chart, the density there, and the measure.

    Coordinates that are angles are pairs of a cosine and a sine. Raises ExpressionError where the density
    has no value, or is too large.
    """
    spot = Spot(*(None if part is None else expr(part) for part in chart.place(*symbols)))
    at = places(spot, chart.origin, hypot=lambda a, b: power(a**2 + b**2, Fraction(1, 2)))
    place = [at[name] for name in "xyz"]
    if not isinstance(density, BoundExpression):
        return place, expr(density), spot.measure
    constants = {name: expr(value) for name, value in density.constants.items()}
    return place, from_tree(density.expression.root, {**at, **constants}), spot.measure


def _moments(formula: BoundExpression, chart: Chart, allowance: Allowance) -> Iterator[Expr]:
    """The integrals (10) of the density times products of 1, x, y, z.

    The coordinates have names that no document can give. Raises ExpressionError where a term has no integral.
    """
    turns, shared = chart.coordinates, len(chart.coordinates) - chart.simplex
    names = [(f"u{k}'",) if turn is None else (f"cos{k}'", f"sin{k}'") for k, turn in enumerate(turns)]
    symbols: list[Any] = [symbol(*own, True) if len(own) == 1 else tuple(map(symbol, own)) for own in names]

    @cache
    def along(k: int, factors: Factors) -> Expr:
        turn, own = turns[k], names[k]
        if turn is not None:
            return _over_turn(turn, own, factors)
        return expand(_over_line(own[0], 1 - total(symbols[shared:k]) if k >= shared else ONE, factors))

    def integral(e: Expr) -> Expr:
        for k, own in reversed([*enumerate(names)]):
            terms = []
            for monomial, coefficient in expand(e, allowance).ordered:
                moving = tuple(factor for factor in monomial if not factor[0].names.isdisjoint(own))
                rest = {atom: exponent for atom, exponent in monomial if atom.names.isdisjoint(own)}
                terms.append(gathered(coefficient, rest) * along(k, moving))
            e = total(terms)
        return e

    place, density, measure = placed(formula, chart, symbols)
    mass, factors = density * measure, (ONE, *place)
    for first, second in zip(FIRST, SECOND, strict=True):
        yield integral(mass * (factors[first] * factors[second]))


def _over_line(name: str, end: Expr, factors: Factors) -> Expr:
    """The integral of a product over a coordinate u from 0 to an end. Raises ExpressionError without one."""
    term = gathered(1, dict(factors))
    whole = antiderivative(term, name) or _beside_line(term, name)
    if whole is None:
        raise ExpressionError("a term has no integral")
    low, high = (substitute(whole, {name: u}) for u in (ZERO, end))
    return high - low


def _beside_line(term: Expr, name: str) -> Expr | None:
    """The antiderivative of u^k L(u)^n with a linear L = p + q u; None of other terms.

    With u = (L - p)/q it is a sum of powers of L, of which that of 1/L is log(L)/q.
    """
    ((monomial, coefficient),) = term.terms.items()
    moving = {atom: n for atom, n in monomial if name in atom.names}
    lines = [atom for atom in moving if isinstance(atom, Group)]
    k = next((n for atom, n in moving.items() if isinstance(atom, Symbol)), 0)
    if len(lines) != 1 or len(moving) > 1 + bool(k) or k != int(k) or k < 0:
        return None
    line: Expr = lines[0].inner
    linear, n = coefficients(line, [name]), moving[lines[0]]
    if linear is None or max(linear) != (1,):
        return None
    p, q = linear.get((0,), ZERO), linear[(1,)]
    rest = gathered(coefficient, {atom: m for atom, m in monomial if atom not in moving})
    positive = -line if p.sign() == -1 else line
    return total(
        rest * comb(int(k), j) * (-p) ** (int(k) - j) / q ** (int(k) + 1)
        * (apply("log", positive) if n + j == -1 else power(line, n + j + 1) / (n + j + 1))
        for j in range(int(k) + 1)
    )  # fmt: skip


def _over_turn(turn: Arc, names: Sequence[str], factors: Factors) -> Expr:
    """The integral of powers of a cosine and a sine over a turn. Raises ExpressionError for other factors."""
    powers = dict.fromkeys(names, 0)
    for atom, exponent in factors:
        is_integrated = exponent.denominator == 1 and 0 <= exponent <= HIGHEST_POWER_INTEGRATED
        if not isinstance(atom, Symbol) or not is_integrated:
            raise ExpressionError("a term has no integral")
        powers[atom.name] = int(exponent)
    c, s, end = (expr(part) for part in (turn.cos, turn.sin, turn.end))

    def by_parts(p: int, q: int) -> Expr:
        if q >= 2:
            return ((q - 1) * by_parts(p, q - 2) - s ** (q - 1) * c ** (p + 1)) / (p + q)
        if q == 1:
            return (1 - c ** (p + 1)) / (p + 1)
        if p >= 2:
            return ((p - 1) * by_parts(p - 2, 0) + c ** (p - 1) * s) / p
        return s if p == 1 else end

    return by_parts(*powers.values())
