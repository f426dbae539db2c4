"""Integrals of a density over a shape in exact numbers, where a closed form is found.

The integrands are multiplied out in the coordinates of a chart, and integrated term by term. Signs and
absolute values cut a coordinate in parts on which they are constant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise, product
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group, Symbol
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import (
    ONE,
    ZERO,
    Expr,
    atomic,
    expr,
    factored,
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
from rigidcli.algebra.substitution import mapped, rebuilt, substitute
from rigidcli.bodies.charts import Barycentric, Chart, Turn
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

MOST_PARTS = 64
"""The most parts into which signs may cut the coordinates."""

Factors: TypeAlias = Mapping[Atom, Rational]

Span: TypeAlias = tuple[Any, Any]
"""A part of a coordinate, from the one to the other (Expr); of an angle, between its turns from zero."""


def exact_properties(formula: Formula, charts: Sequence[Chart], n: Arithmetic) -> MassProperties:
    """Mass, centre of mass and tensor.

    Raises ComputationError where no closed form is found, and ValueProblem for a mass that is not positive.
    """
    allowance = Allowance(MAX_STEPS)
    sums = n.array(np.zeros(10, dtype=int))
    try:
        for chart in charts:
            found = (_sums(formula, each, allowance, n) for each in (chart, *chart.slices))
            known = next((each for each in found if each is not None), None)
            if known is None:
                raise _no_closed_form()
            sums = sums + known
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
    """The integrals of the density, of it times x, y, z, and of it times their products (10); or None."""
    coordinates = _Coordinates(chart.coordinates, n)
    place, density, measure = placed(formula, chart, coordinates.symbols)
    weight = density * measure
    moments = [expr(1), *place, *(place[i] * place[j] for i, j in PAIRS)]
    found = [coordinates.integral(weight * moment, allowance) for moment in moments]
    return None if None in found else n.array(found)


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

    def __init__(self, turns: Sequence[Turn | Barycentric | None], arithmetic: Arithmetic) -> None:
        self._turns, self._n = turns, arithmetic
        self._names = [
            [f"cosine {k}", f"sine {k}"] if isinstance(turn, Turn) else [f"coordinate {k}"]
            for k, turn in enumerate(turns)
        ]
        self._place = {name: k for k, names in enumerate(self._names) for name in names}
        self._known: dict[tuple[object, ...], Expr | None] = {}
        self.symbols = [
            symbol(names[0], True) if len(names) == 1 else tuple(map(symbol, names)) for names in self._names
        ]

    def integral(self, e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over all of them; None where a term is no product of such as can be integrated.

        Raises ExpressionError where an expression gets too large.
        """
        signs = (
            atom
            for atom in e.everywhere()
            if isinstance(atom, Applied) and atom.function in ("abs", "sign") and self._on(atom)
        )
        arguments = {atom.arguments[0] for atom in signs}
        split = {argument: self._split(argument) for argument in arguments}
        cuts: list[list[Any]] = [
            [Turn(0, 1, 0), turn] if isinstance(turn, Turn) else [ZERO, ONE] for turn in self._turns
        ]
        if not all(self._cut(factor, cuts) for moving, _ in split.values() for factor in moving):
            return None
        parts = list(product(*map(pairwise, cuts)))
        found = []
        for spans in parts if len(parts) <= MOST_PARTS else ():
            middle = {
                name: value
                for names, span in zip(self._names, spans, strict=True)
                for name, value in zip(names, _middle(*span, self._n), strict=True)
            }
            meant: dict[tuple[str, Expr], Expr] = {}
            for argument, (moving, rest) in split.items():
                sign = math.prod((self._sign(substitute(own, middle)) or 0) ** n for own, n in moving.items())
                size = math.prod((own**n for own, n in moving.items()), start=sign * ONE)
                meant["abs", argument] = size * apply("abs", rest)
                meant["sign", argument] = sign * apply("sign", rest)
            is_known = not any(size.is_zero for size in meant.values())
            part = self._over(spans, _replaced(e, meant), allowance) if is_known else None
            if part is None:
                return None
            found.append(part)
        return total(found) if found else None

    def _split(self, argument: Expr) -> tuple[dict[Expr, int], Expr]:
        """The factors of an argument that hang on coordinates, with their exponents; and the rest of it."""
        content, pairs = factored(argument)
        moving = {atomic(own): int(n) for own, n in pairs if self._on(own)}
        return moving, gathered(content, {own: n for own, n in pairs if not self._on(own)})

    def _on(self, atom: Atom) -> set[int]:
        """The coordinates on which an atom hangs."""
        return {self._place[name] for name in atom.names if name in self._place}

    def _sign(self, e: Any) -> int | None:
        return self._n.sign(self._n.tidied(e))

    def _cut(self, factor: Expr, cuts: list[list[Any]]) -> bool:
        """Cut a coordinate where a factor of an argument is zero; False where that is not known.

        The factor is linear in a coordinate, or a multiple of the cosine or the sine of an angle.
        """
        on = {self._place[name] for name in factor.names if name in self._place}
        if len(on) != 1:
            return False
        k = on.pop()
        turn, names = self._turns[k], self._names[k]
        powers = coefficients(factor, names)
        if isinstance(turn, Barycentric) or powers is None:
            return False
        if isinstance(turn, Turn):
            right = self._n.pi / 2
            count = next((m for m in (1, 2, 4) if self._sign(turn.end - m * right) == 0), 0)
            corners = [Turn(m * right, (1, 0, -1, 0)[m], (0, 1, 0, -1)[m]) for m in range(count)]
            cuts[k] = [*corners, turn]
            return bool(count) and len(powers) == 1 and powers.keys() <= {(1, 0), (0, 1)}
        if not powers.keys() <= {(0,), (1,)}:
            return False
        root = self._n.tidied(-powers.get((0,), ZERO) / powers[(1,)])
        signs = self._sign(root), self._sign(1 - root)
        if signs == (1, 1):
            inner = {*cuts[k][1:-1], root}
            values = {cut: self._n.value(cut) for cut in inner}
            cuts[k] = [ZERO, *sorted(inner, key=lambda cut: values[cut] or 0.0), ONE]
            return len(inner) == 1 or None not in values.values()
        return 0 in signs or -1 in signs

    def _over(self, spans: Sequence[Span], e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over a part of each coordinate."""
        terms = []
        for monomial, coefficient in expand(e, allowance).ordered:
            rest: dict[Atom, Rational] = {}
            moving: list[dict[Atom, Rational]] = [{} for _ in spans]
            for atom, exponent in monomial:
                on = self._on(atom)
                if len(on) > 1:
                    return None
                (moving[on.pop()] if on else rest)[atom] = exponent
            factor: Expr | None = gathered(coefficient, rest)
            if any(isinstance(turn, Barycentric) for turn in self._turns):
                along = [_over_simplex(moving)]
            else:
                along = list(map(self._along, spans, self._names, moving))
            for own in along:
                factor = None if factor is None or own is None else factor * own
            if factor is None:
                return None
            terms.append(factor)
        return total(terms)

    def _along(self, span: Span, names: Sequence[str], factors: Factors) -> Expr | None:
        """The integral of a product of powers over a part of one coordinate."""
        key = span, names[0], tuple(factors.items())
        if key not in self._known:
            of = _over_turn if isinstance(span[0], Turn) else _over_unit
            self._known[key] = of(*span, names, factors)
        return self._known[key]


def _replaced(e: Expr, meant: Mapping[tuple[str, Expr], Expr]) -> Expr:
    """The expression with what functions (by name) of these arguments mean."""

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and (key := (atom.function, atom.arguments[0])) in meant:
            return meant[key]
        return rebuilt(atom, whole) if isinstance(atom, Applied | Group) else None

    def whole(inner: Expr) -> Expr:
        return mapped(inner, change)

    return whole(e)


def _middle(start: Any, end: Any, n: Arithmetic) -> Sequence[Any]:
    """A coordinate in the middle of a span; of an angle its cosine and sine."""
    if isinstance(start, Turn) and isinstance(end, Turn):
        angle = (start.end + end.end) / 2
        return n.cos(angle), n.sin(angle)
    return ((start + end) / 2,)


def _over_unit(start: Expr, end: Expr, names: Sequence[str], factors: Factors) -> Expr | None:
    """The integral of a product of powers from the one place to the other."""
    if all(isinstance(atom, Symbol) for atom in factors):
        exponent = Fraction(sum(factors.values(), Fraction(0))) + 1
        if exponent <= 0:
            return None
        ends = [ZERO if at.is_zero else power(at, exponent) for at in (start, end)]
        return (ends[1] - ends[0]) / exponent
    found = antiderivative(gathered(1, dict(factors)), names[0])
    if found is None:
        return None
    try:
        return substitute(found, {names[0]: end}) - substitute(found, {names[0]: start})
    except ExpressionError:
        return None


def _over_turn(start: Turn, end: Turn, names: Sequence[str], factors: Factors) -> Expr | None:
    """The integral of a product of powers of the cosine and the sine from one turn to another."""
    powers = dict.fromkeys(names, 0)
    for atom, exponent in factors.items():
        if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
            return None
        powers[atom.name] = int(exponent)
    p, q = powers.values()
    return _of_circle(p, q, end) - _of_circle(p, q, start)


def _of_circle(p: int, q: int, turn: Turn) -> Expr:
    """The integral of cos^p sin^q from 0 to the end of a turn, by parts."""
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
