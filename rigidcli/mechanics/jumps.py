"""Steps in functions, as in sign(x), x/abs(x) and sqrt(x**2)/x, of which derivatives do not tell.

The momentum changes suddenly where H has a step, so that Hamilton's equations hold on either side only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import TypeGuard, cast

from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients
from rigidcli.algebra.expressions import (
    ONE,
    ZERO,
    Expr,
    Number,
    atomic,
    gathered,
    power,
    symbol,
)
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import rebuilt, substitute, with_powers
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError


def is_constant_in(e: Expr, name: str) -> bool:
    """Whether a function does not depend on a name: its derivative vanishes, and it has no steps."""
    if name not in e.names:
        return True
    return is_zero(derivative(e, name)) and is_zero(e - substitute(e, {name: symbol(f"{name}'")}))


def jumps(e: Expr, names: Sequence[str]) -> list[Expr]:
    """Functions of the names, as far as they are found, at whose zeros `e` has a step."""
    places = dict.fromkeys(_places(e))
    return [u for u in places if any(not is_zero(height) for height in _heights(e, u, names))]


def _places(e: Expr) -> Iterator[Expr]:
    """The u of which e holds sign(u), abs(u) or a root of u**2."""
    for monomial in e.terms:
        for atom, n in monomial:
            u = _step(atom, n)
            if u is not None:
                yield u
            for inner in _within(atom):
                yield from _places(inner)


def _within(atom: Atom) -> Sequence[Expr]:
    """The expressions that an atom is made of."""
    match atom:
        case Group(inner=inner):
            return (inner,)
        case Applied(arguments=arguments):
            return arguments
        case _:
            return ()


def _step(atom: Atom, n: Rational) -> Expr | None:
    """The u of which a power of an atom is a function of sign(u)*u or of sign(u)."""
    match atom:
        case Applied(function="sign" | "abs", arguments=(u,)):
            return cast(Expr, u)
        case Group(inner=inner) if n.denominator == 2 and len(inner.terms) == 1:
            ((monomial, _),) = inner.terms.items()
            if all(k.denominator == 1 and k % 2 == 0 for _, k in monomial):
                return gathered(1, {factor: k / Fraction(2) for factor, k in monomial})
    return None


def _heights(e: Expr, u: Expr, names: Sequence[str]) -> Iterator[Expr]:
    """What the function has more on the side where u is positive, where u is zero."""

    def beside(side: int) -> Expr:
        return _with_signs(e, lambda v: side if v == u else apply("sign", v))

    height = beside(1) - beside(-1)
    lines = {name: coefficients(u, [name]) for name in names if name in u.names}
    solved = {name: -line.get((0,), ZERO) / line[(1,)] for name, line in lines.items() if _is_line(line)}
    if lines and not solved:
        yield height
    for name, value in solved.items():
        with suppress(ExpressionError):
            yield substitute(height, {name: value})


def _is_line(found: Polynomial | None) -> TypeGuard[Polynomial]:
    return found is not None and max(found) == (1,)


def _with_signs(e: Expr, sign: Callable[[Expr], Number]) -> Expr:
    """The function with something else in place of the sign of each u."""

    def changed(atom: Atom, n: Rational) -> Expr:
        u = _step(atom, n)
        if u is None:
            return power(rebuilt(atom, lambda inner: _with_signs(inner, sign)), n)
        if isinstance(atom, Applied):
            return power(sign(u) * (u if atom.function == "abs" else ONE), n)
        return power(atomic(atom) / u**2, n) * power(sign(u) * u, 2 * n)

    return with_powers(e, changed)
