"""The values of a name at which a function has a value, its operations undone one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction

from rigidcli.algebra import arithmetic
from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import MAX_STEPS, coefficients, expand
from rigidcli.algebra.expressions import (
    ONE,
    PI,
    ZERO,
    Expr,
    gathered,
    power,
    total,
)
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.mechanics.hamilton_equations import coefficient

HALF = Fraction(1, 2)

_Solution = tuple[Expr, tuple[Expr, ...], Expr | None]
"""A value, what must be positive for it, and the period of further values."""


def solutions(e: Expr, v: str, r: Expr) -> Iterator[_Solution]:
    """The values of a name at which an expression is r, its operations undone one by one."""
    e = _tangents(e)
    still = total(Expr({m: c}) for m, c in e.terms.items() if all(v not in atom.names for atom, _ in m))
    e, r = e - still, tidy(r - still)
    found = coefficients(e, [v])
    if found is not None:
        a, b = (coefficient(found, 1, *[0] * n) for n in (2, 1))
        if max(found) == (1,):
            yield tidy(r / b), (), None
        elif max(found) == (2,):
            shift = tidy(b / (2 * a))
            square = tidy(r / a + shift**2)
            yield from ((side * square**HALF - shift, (square,), None) for side in (1, -1))
        return
    moving = {factor for m in e.terms for factor in m if v in factor[0].names}
    if len(moving) > 1 or len(e.terms) > 1:
        yield from _of_fraction(e, v, r)
        return
    ((atom, n),) = moving
    w = tidy(r * gathered(1, {atom: n}) / e)
    for u, conditions in _roots(w, Fraction(n)):
        inner: Iterator[_Solution] = iter([(u, (), None)])
        if isinstance(atom, Group):
            inner = solutions(atom.inner, v, u)
        elif isinstance(atom, Applied):
            inner = _of_function(atom, v, u)
        yield from ((x, (*conditions, *further), period) for x, further, period in inner)


def _roots(w: Expr, n: Fraction) -> Iterator[tuple[Expr, tuple[Expr, ...]]]:
    """The real u with u^n = w."""
    if n.numerator % 2 and n.denominator % 2:
        size = apply("sign", w) * apply("abs", w) ** (1 / n) if n not in (1, -1) else power(w, n)
        yield size, ()
    else:
        yield w ** (1 / n), (w,)
        if n.numerator % 2 == 0:
            yield -(w ** (1 / n)), (w,)


def _of_fraction(e: Expr, v: str, r: Expr) -> Iterator[_Solution]:
    """The solutions of a fraction of polynomials, or of roots of these: its square is one."""
    if any(n.denominator == 2 for m in e.terms for atom, n in m if v in atom.names):
        e, r = arithmetic.tidy(expand(e**2)), r**2
    else:
        e = arithmetic.tidy(e)
    above, below = ONE, ONE
    for factor, n in factors(e, Allowance(MAX_STEPS)):
        above, below = (above * factor**n, below) if n > 0 else (above, below * factor**-n)
    whole = expand(above - r * below)
    found = coefficients(whole, [v])
    if found is not None and max(found) in ((1,), (2,)):
        yield from solutions(whole, v, ZERO)


def _of_function(atom: Applied[Expr], v: str, w: Expr) -> Iterator[_Solution]:
    """The solutions of f(u) = w, where u is a function of the name."""
    if atom.function not in _INVERSES or len(atom.arguments) > 1:
        return
    (inner,) = atom.arguments
    for u, conditions in _INVERSES[atom.function](w):
        for x, further, _ in solutions(inner, v, u):
            rate = derivative(inner, v)
            turns = atom.function in ("sin", "cos", "tan")
            yield x, (*conditions, *further), tidy(2 * PI / abs(rate)) if turns else None


def _tangents(e: Expr) -> Expr:
    """The expression with tan and tanh for quotients of a sine and a cosine."""
    parts = []
    for monomial, c in e.terms.items():
        exponents = dict(monomial)
        made = ONE
        for atom, n in monomial:
            if isinstance(atom, Applied) and atom.function in ("sin", "sinh") and exponents[atom] == n:
                for other, k in monomial:
                    is_other = isinstance(other, Applied) and other.function == f"cos{atom.function[3:]}"
                    if is_other and other.arguments == atom.arguments and k == -n:  # type: ignore[attr-defined]
                        made *= apply(f"tan{atom.function[3:]}", *atom.arguments) ** n
                        exponents[atom] = exponents[other] = 0
        parts.append(gathered(c, exponents) * made)
    return total(parts)


def _within(w: Expr) -> tuple[Expr, ...]:
    """What is positive where -1 < w < 1."""
    is_root = any(n.denominator > 1 for m in w.terms for _, n in m)
    return (1 - w**2,) if is_root else (1 - w, 1 + w)


_Inverse = Callable[[Expr], list[tuple[Expr, tuple[Expr, ...]]]]

_INVERSES: Mapping[str, _Inverse] = {
    "exp": lambda w: [(apply("log", w), (w,))],
    "log": lambda w: [(apply("exp", w), ())],
    "sin": lambda w: [(s, _within(w)) for s in (apply("asin", w), PI - apply("asin", w))],
    "cos": lambda w: [(s * apply("acos", w), _within(w)) for s in (1, -1)],
    "tan": lambda w: [(apply("atan", w), ()), (PI + apply("atan", w), ())],
    "sinh": lambda w: [(apply("asinh", w), ())],
    "cosh": lambda w: [(s * apply("acosh", w), (w - 1,)) for s in (1, -1)],
    "tanh": lambda w: [(apply("atanh", w), _within(w))],
    "asin": lambda w: [(apply("sin", w), (PI / 2 - w, PI / 2 + w))],
    "acos": lambda w: [(apply("cos", w), (w, PI - w))],
    "atan": lambda w: [(apply("tan", w), (PI / 2 - w, PI / 2 + w))],
    "asinh": lambda w: [(apply("sinh", w), ())],
    "acosh": lambda w: [(apply("cosh", w), (w,))],
    "atanh": lambda w: [(apply("tanh", w), ())],
    "abs": lambda w: [(s * w, (w,)) for s in (1, -1)],
}
"""For each function f all u with f(u) = w, each with what must be positive."""
