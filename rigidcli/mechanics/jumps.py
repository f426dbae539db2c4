"""Steps in functions, as in sign(x), x/abs(x) and sqrt(x**2)/x, of which derivatives do not tell.

The momentum changes suddenly where H has a step, so that Hamilton's equations hold on either side only.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction

from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, gathered, power, symbol
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import mapped, rebuilt, substitute, with_powers
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError

STEPPING = ("sign", "abs")


def is_constant_in(e: Expr, name: str) -> bool:
    """Whether a function does not depend on a name: its derivative vanishes, and it has no steps."""
    if name not in e.names:
        return True
    return is_zero(derivative(e, name)) and is_zero(e - substitute(e, {name: symbol(f"{name}'")}))


def jumps(e: Expr, names: Sequence[str]) -> list[Expr]:
    """Functions of the names, as far as they are found, at whose zeros `e` has a step."""
    e = _with_bars(e)
    found = (atom for atom in e.everywhere() if isinstance(atom, Applied) and atom.function in STEPPING)
    places = dict.fromkeys(atom.arguments[0] for atom in found)
    return [u for u in places if not is_zero(_height(e, u, names))]


def _with_bars(e: Expr) -> Expr:
    """The function with |u| for the root of u^2."""

    def change(atom: Atom, n: Rational) -> Expr:
        if isinstance(atom, Group) and n.denominator == 2 and len(atom.inner.terms) == 1:
            ((monomial, _),) = atom.inner.terms.items()
            if all(k.denominator == 1 and k % 2 == 0 for _, k in monomial):
                return abs(gathered(1, {factor: k / Fraction(2) for factor, k in monomial})) ** (2 * n)
        return power(rebuilt(atom, _with_bars), n)

    return with_powers(e, change)


def _height(e: Expr, u: Expr, names: Sequence[str]) -> Expr:
    """How much more the function is where u is just above zero than where it is just below."""
    height = _beside(e, u, 1) - _beside(e, u, -1)
    for name in u.names.intersection(names):
        line = coefficients(u, [name])
        if line is not None and max(line) == (1,):
            with suppress(ExpressionError):
                return substitute(height, {name: -line.get((0,), ZERO) / line[(1,)]})
            return ZERO  # a pole, as of 1/|x|, is no step
    return height if u.names.intersection(names) else ZERO


def _beside(e: Expr, u: Expr, side: int) -> Expr:
    """The function with `side` for the sign of u."""

    def change(atom: Atom) -> Expr:
        if isinstance(atom, Applied) and atom.function in STEPPING and atom.arguments[0] == u:
            return side * (u if atom.function == "abs" else u**0)
        return rebuilt(atom, lambda inner: _beside(inner, u, side))

    return mapped(e, change)
