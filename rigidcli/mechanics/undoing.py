"""The values of a name at which a function has a value: what is done to the name is undone step by step.

    v/sqrt(1 + v^2) = p    ->    v^2/(1 + v^2) = p^2    ->    v = p/sqrt(1 - p^2), v = -p/sqrt(1 - p^2)

Squaring adds solutions, and inverse functions have several branches: the caller puts all of them to the test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction

from rigidcli.algebra import arithmetic
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.bounds import Rational
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients, expand
from rigidcli.algebra.expressions import ONE, PI, ZERO, Expr, gathered, power, product, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy

HALF = Fraction(1, 2)

_Solution = tuple[Expr, tuple[Expr, ...], Expr | None]
"""A value, what must be positive for it, and the period of further values."""


def solutions(e: Expr, v: str, r: Expr = ZERO) -> Iterator[_Solution]:
    """The values of a name at which an expression is r."""
    e = _tangents(e)
    still = total(Expr({m: c}) for m, c in e.terms.items() if all(v not in atom.names for atom, _ in m))
    e, r = e - still, tidy(r - still)
    polynomial = coefficients(e, [v])
    if polynomial is not None:
        yield from _of_polynomial({n: c for (n,), c in polynomial.items()}, r)
        return
    moving = {factor for m in e.terms for factor in m if v in factor[0].names}
    if r.is_zero and len(e.terms) == 1:
        for atom, n in moving:
            yield from solutions(_base(atom), v) if n > 0 and isinstance(atom, Group) else ()
    elif len(moving) == 1:
        ((atom, n),) = moving
        for u, conditions in _roots(tidy(r * power(_base(atom), n) / e), Fraction(n)):
            yield from ((x, (*conditions, *more), t) for x, more, t in _of_atom(atom, v, u))
    else:
        yield from _of_several(e, v, r, moving)


def _base(atom: Atom) -> Expr:
    return atom.inner if isinstance(atom, Group) else gathered(1, {atom: 1})


def _of_polynomial(polynomial: Mapping[int, Expr], r: Expr) -> Iterator[_Solution]:
    """The roots of a polynomial without a constant that has one power, or one and its square."""
    first, *others = sorted(polynomial)
    if not others:
        yield from (
            (u, conditions, None) for u, conditions in _roots(tidy(r / polynomial[first]), Fraction(first))
        )
    elif others == [2 * first]:
        a, b = polynomial[2 * first], polynomial[first]
        shift = tidy(b / (2 * a))
        square = tidy(r / a + shift**2)
        for side in (1, -1):
            for u, conditions in _roots(side * square**HALF - shift, Fraction(first)):
                yield u, (square, *conditions), None


def _roots(w: Expr, n: Fraction) -> Iterator[tuple[Expr, tuple[Expr, ...]]]:
    """The real u with u^n = w."""
    if n.numerator % 2 and n.denominator % 2:
        size = apply("sign", w) * apply("abs", w) ** (1 / n) if n not in (1, -1) else power(w, n)
        yield size, ()
    else:
        yield w ** (1 / n), (w,)
        if n.numerator % 2 == 0:
            yield -(w ** (1 / n)), (w,)


def _of_atom(atom: Atom, v: str, u: Expr) -> Iterator[_Solution]:
    """The solutions where an atom, which holds the name, is u."""
    if isinstance(atom, Group):
        yield from solutions(atom.inner, v, u)
    elif not isinstance(atom, Applied):
        yield u, (), None
    elif atom.function == "atan2":
        y, x = atom.arguments
        yield from solutions(y * apply("cos", u) - x * apply("sin", u), v)
    elif atom.function == "pow" and v not in atom.arguments[1].names:
        yield from solutions(atom.arguments[0], v, u ** (1 / atom.arguments[1]))
    elif atom.function in _INVERSES:
        (inner,) = atom.arguments
        for w, conditions in _INVERSES[atom.function](u):
            for x, further, _ in solutions(inner, v, w):
                turns = atom.function in ("sin", "cos", "tan")
                period = tidy(2 * PI / abs(derivative(inner, v))) if turns else None
                yield x, (*conditions, *further), period


def _of_several(e: Expr, v: str, r: Expr, moving: set[tuple[Atom, Rational]]) -> Iterator[_Solution]:
    """The solutions where the name stands in several places: a root is squared, a sine is over its cosine."""
    for atom, n in sorted(moving, key=lambda factor: factor[0].key):
        holding = Expr({m: c for m, c in e.terms.items() if (atom, n) in m})
        above, rest = holding / gathered(1, {atom: n}), e - holding - r
        if isinstance(atom, Group) and n.denominator == 2:
            squared = expand(above**2 * power(atom.inner, 2 * n) - rest**2)
            fewer = 0 < len(_under_roots(squared, v)) < len(_under_roots(e, v))
            yield from solutions(squared, v) if fewer else _of_fraction(arithmetic.tidy(squared), v)
            return
        if isinstance(atom, Applied) and atom.function == "sin" and n == 1:
            slope = tidy(-rest / (above * apply("cos", *atom.arguments)))
            if v not in slope.names:
                yield from solutions(atom.arguments[0], v, apply("atan", slope))
                return
    yield from _of_fraction(arithmetic.tidy(e - r), v)


def _under_roots(e: Expr, v: str) -> set[Atom]:
    return {atom for m in e.terms for atom, n in m if n.denominator == 2 and v in atom.names}


def _of_fraction(e: Expr, v: str) -> Iterator[_Solution]:
    above = product(f for f, n in factors(e) if n > 0 and v in f.names)
    polynomial: Polynomial | None = coefficients(expand(above), [v])
    if polynomial is not None and len(polynomial) <= 3:
        yield from solutions(expand(above), v)


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
    """Factors that are positive where -1 < w < 1."""
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
