"""Integrals of exact expressions over coordinates from 0 to 1, and over angles, where they are products."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from rigidcli.core.charts import Turn
from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Atom, Symbol
from rigidcli.symbolic.algebra.calculus import expand, substitute
from rigidcli.symbolic.algebra.expressions import (
    ONE,
    ZERO,
    Expr,
    expr,
    gathered,
    number,
    product,
    symbol,
    total,
)
from rigidcli.symbolic.algebra.integration import antiderivative
from rigidcli.symbolic.algebra.roots import Rational

HIGHEST = 200
"""The highest power of a sine or cosine that is integrated, by as many steps."""

Factors = Mapping[Atom, Rational]


class Coordinates:
    """Coordinates from 0 to 1, or angles (by their `Turn`), under names that no document can give.

    `symbols` has each as a formula takes it: a symbol, or the pair of the cosine and the sine.
    """

    def __init__(self, turns: Sequence[Turn | None]) -> None:
        self._turns = turns
        self._names = [
            [f"coordinate {k}"] if turn is None else [f"cosine {k}", f"sine {k}"]
            for k, turn in enumerate(turns)
        ]
        self._place = {name: k for k, names in enumerate(self._names) for name in names}
        self._known: dict[tuple[int, tuple[tuple[Atom, Rational], ...]], Expr | None] = {}
        self.symbols = [
            symbol(names[0], True) if len(names) == 1 else tuple(map(symbol, names)) for names in self._names
        ]

    def integral(self, e: Expr, allowance: Allowance) -> Expr | None:
        """The integral over all of them; None where a term is no product of such as can be integrated.

        Raises ExpressionError where an expression gets too large.
        """
        parts = []
        for monomial, coefficient in expand(e, allowance).ordered:
            rest: dict[Atom, Rational] = {}
            moving: list[dict[Atom, Rational]] = [{} for _ in self._turns]
            for atom, exponent in monomial:
                on = {self._place[name] for name in atom.names if name in self._place}
                if len(on) > 1:
                    return None
                (moving[on.pop()] if on else rest)[atom] = exponent
            factors = [gathered(coefficient, rest)]
            for k, inner in enumerate(moving):
                along = self._along(k, inner)
                if along is None:
                    return None
                factors.append(along)
            parts.append(product(factors))
        return total(parts)

    def _along(self, k: int, factors: dict[Atom, Rational]) -> Expr | None:
        """The integral of a product of powers over one coordinate."""
        key = k, tuple(factors.items())
        if key not in self._known:
            turn = self._turns[k]
            self._known[key] = (
                self._over_unit(k, factors) if turn is None else self._over_turn(k, turn, factors)
            )
        return self._known[key]

    def _over_unit(self, k: int, factors: Factors) -> Expr | None:
        (name,) = self._names[k]
        if all(isinstance(atom, Symbol) for atom in factors):
            exponent = Fraction(sum(factors.values(), Fraction(0)))
            return number(1 / (exponent + 1)) if exponent > -1 else None
        found = antiderivative(gathered(1, dict(factors)), name)
        if found is None:
            return None
        try:
            return substitute(found, {name: ONE}) - substitute(found, {name: ZERO})
        except ExpressionError:
            return None

    def _over_turn(self, k: int, turn: Turn, factors: Factors) -> Expr | None:
        cosines = sines = 0
        for atom, exponent in factors.items():
            if not isinstance(atom, Symbol) or exponent.denominator != 1 or not 0 <= exponent <= HIGHEST:
                return None
            if atom.name == self._names[k][0]:
                cosines = int(exponent)
            else:
                sines = int(exponent)
        return _of_circle(cosines, sines, turn)


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
