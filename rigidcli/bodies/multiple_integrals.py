"""Integrals of exact expressions over coordinates from 0 to 1, over angles and simplices, term by term."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

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
    product,
    symbol,
    total,
)
from rigidcli.algebra.integration import antiderivative
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import substitute
from rigidcli.bodies.charts import Barycentric, Turn
from rigidcli.bodies.sign_changes import Span, without_signs
from rigidcli.core.arithmetic import Arithmetic
from rigidcli.errors import ExpressionError

HIGHEST = 200
"""The highest power of a sine or cosine that is integrated, by as many steps."""

Factors = Mapping[Atom, Rational]


class Coordinates:
    """Coordinates from 0 to 1, or angles (by their `Turn`), under names that no document can give.

    `symbols` has each as a formula takes it: a symbol, or the pair of the cosine and the sine. Where they are
    `Barycentric`, all of them are those of a simplex.
    """

    def __init__(self, turns: Sequence[Turn | Barycentric | None], arithmetic: Arithmetic) -> None:
        self._arithmetic = arithmetic
        self._is_simplex = any(isinstance(turn, Barycentric) for turn in turns)
        self._names = [
            [f"cosine {k}", f"sine {k}"] if isinstance(turn, Turn) else [f"coordinate {k}"]
            for k, turn in enumerate(turns)
        ]
        self._spans: list[Span] = [
            (Turn(0, 1, 0), turn) if isinstance(turn, Turn) else (ZERO, ONE) for turn in turns
        ]
        self._place = {name: k for k, names in enumerate(self._names) for name in names}
        self._known: dict[tuple[object, ...], Expr | None] = {}
        self.symbols = [
            symbol(names[0], True) if len(names) == 1 else tuple(map(symbol, names)) for names in self._names
        ]

    def integral(self, e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over all of them; None where a term is no product of such as can be integrated.

        Where absolute values and signs change with one coordinate, it is taken in parts.
        Raises ExpressionError where an expression gets too large.
        """
        found = without_signs(e, self._names, self._spans, self._arithmetic)
        if found is None or (self._is_simplex and len(found) > 1):
            return None
        parts = [self._over(spans, inner, allowance) for inner, spans in found]
        known = [part for part in parts if part is not None]
        return total(known) if len(known) == len(parts) else None

    def _over(self, spans: Sequence[Span], e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over a part of each coordinate."""
        parts = []
        for monomial, coefficient in expand(e, allowance).ordered:
            rest: dict[Atom, Rational] = {}
            moving: list[dict[Atom, Rational]] = [{} for _ in spans]
            for atom, exponent in monomial:
                on = {self._place[name] for name in atom.names if name in self._place}
                if len(on) > 1:
                    return None
                (moving[on.pop()] if on else rest)[atom] = exponent
            factors = [gathered(coefficient, rest)]
            along = (
                [_of_simplex(moving)] if self._is_simplex else map(self._along, spans, self._names, moving)
            )
            for factor in along:
                if factor is None:
                    return None
                factors.append(factor)
            parts.append(product(factors))
        return total(parts)

    def _along(self, span: Span, names: Sequence[str], factors: dict[Atom, Rational]) -> Expr | None:
        """The integral of a product of powers over a part of one coordinate."""
        key = span, names[0], tuple(factors.items())
        if key not in self._known:
            start, end = span
            if isinstance(start, Turn):
                self._known[key] = _over_turn(start, end, names, factors)
            else:
                self._known[key] = _over_unit(start, end, names[0], factors)
        return self._known[key]


def _over_unit(start: Expr, end: Expr, name: str, factors: Factors) -> Expr | None:
    if all(isinstance(atom, Symbol) for atom in factors):
        exponent = Fraction(sum(factors.values(), Fraction(0))) + 1
        if exponent <= 0:
            return None
        ends = [ZERO if at.is_zero else power(at, exponent) for at in (start, end)]
        return (ends[1] - ends[0]) / exponent
    found = antiderivative(gathered(1, dict(factors)), name)
    if found is None:
        return None
    try:
        return substitute(found, {name: end}) - substitute(found, {name: start})
    except ExpressionError:
        return None


def _over_turn(start: Turn, end: Turn, names: Sequence[str], factors: Factors) -> Expr | None:
    powers = dict.fromkeys(names, 0)
    for atom, exponent in factors.items():
        if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
            return None
        powers[atom.name] = int(exponent)
    cosines, sines = powers.values()
    return _of_circle(cosines, sines, end) - _of_circle(cosines, sines, start)


def _of_simplex(factors: Sequence[Factors]) -> Expr | None:
    """The integral of a product of powers of all coordinates of a simplex.

    That of a^i b^j ... is i! j! .../(i + j + ... + d)! in d dimensions, as Dirichlet found.
    """
    powers = [sum(own.values()) for own in factors]
    if not all(
        isinstance(atom, Symbol) and n.denominator == 1 and n >= 0
        for own in factors
        for atom, n in own.items()
    ):
        return None
    above = math.prod(math.factorial(int(n)) for n in powers)
    return number(Fraction(above, math.factorial(int(sum(powers)) + len(powers))))


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
