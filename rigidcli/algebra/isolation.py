"""A name isolated in an equation by undoing its operations, on the branch of roots that holds at a point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction

from rigidcli.algebra.arithmetic import root_of_either_sign, tidy
from rigidcli.algebra.atoms import Applied, Atom, Group, Symbol
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, factored, gathered, power, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import rebuilt, substitute, with_powers
from rigidcli.errors import ComputationError, ExpressionError

NEAR = 1e-6
"""Values that differ by less than this, in units of their size, are those of the same branch."""

_PAIRS = (
    *(("sin", "asin"), ("cos", "acos"), ("tan", "atan"), ("exp", "log")),
    *(("sinh", "asinh"), ("cosh", "acosh"), ("tanh", "atanh")),
)
_INVERSES = dict(_PAIRS) | {b: a for a, b in _PAIRS}
"""The function that undoes another one, where that is on its main branch."""


@dataclass(frozen=True, slots=True)
class Branch:
    """The signs of square roots of squares: those that they have where names have the values of `point`.

    Where the point does not tell, a root may have either sign.
    """

    point: Mapping[str, float]

    def value(self, e: Expr) -> float:
        """The value at the point; nan where there is none."""
        try:
            return float(e.evaluate(**{name: self.point[name] for name in e.names}))
        except (ExpressionError, KeyError):
            return math.nan

    def is_at(self, e: Expr, value: float) -> bool:
        """Whether an expression has this value at the point."""
        return abs(self.value(e) - value) <= NEAR * (1 + abs(value))

    def root(self, e: Expr) -> Expr:
        """The square root, without a root where it is one of a square."""
        found = root_of_either_sign(e)
        return -found if self.value(found) < 0 else found

    def put(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """The same as `with_roots`, in a short form."""
        return tidy(self.with_roots(e, values))

    def with_roots(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """An expression with names replaced, roots worked out, and tangents in sines and cosines."""
        return self._rooted(substitute(e, values))

    def _rooted(self, e: Expr) -> Expr:
        return with_powers(e, self._of_power)

    def _of_power(self, atom: Atom, n: Rational) -> Expr:
        inner = rebuilt(atom, self._rooted)
        if isinstance(atom, Applied) and atom.function == "tan":
            inner = apply("sin", *atom.arguments) / apply("cos", *atom.arguments)
        half = isinstance(atom, Group) and n.denominator == 2
        return power(self.root(inner), 2 * n) if half else power(inner, n)


def isolated(e: Expr, name: str, branch: Branch) -> Iterator[Expr]:
    """Values of a name for which an expression vanishes, from its operations undone one by one."""
    with suppress(ExpressionError, ComputationError):
        e = branch.put(e, {})
        factors = [atom.inner for atom, n in factored(e)[1] if isinstance(atom, Group) and n > 0]
        for inner in factors if factors != [e] else ():
            yield from isolated(inner, name, branch)
        polynomial = coefficients(e, [name])
        if polynomial is not None:
            yield from _roots({powers[0]: tidy(value) for powers, value in polynomial.items()}, branch)
            return
        moving = {factor for monomial in e.terms for factor in monomial if name in factor[0].names}
        for atom, n in sorted(moving, key=lambda factor: factor[0].key):
            holding = [monomial for monomial in e.terms if (atom, n) in monomial]
            factor = gathered(1, {atom: n})
            above = total(Expr({m: e.terms[m]}) for m in holding) / factor
            rest = e - above * factor
            # above atom^n + rest = 0
            if name in above.names or name in rest.names:
                if isinstance(atom, Group) and n.denominator == 2:
                    yield from isolated(above**2 * power(atom.inner, 2 * n) - rest**2, name, branch)
                elif isinstance(atom, Applied) and atom.function == "sin" and n == 1:
                    angle = atom.arguments[0]
                    slope = branch.put(-rest / (above * apply("cos", angle)), {})
                    if name not in slope.names:
                        yield from isolated(angle - apply("atan", slope), name, branch)
                continue
            value = branch.put(-rest / above, {})
            for root in _powers(value, 1 / Fraction(n), branch):
                if isinstance(atom, Group):
                    yield from isolated(atom.inner - root, name, branch)
                elif isinstance(atom, Symbol):
                    yield root
                elif isinstance(atom, Applied):
                    yield from _undone(atom, root, name, branch)


def _undone(atom: Applied[Expr], value: Expr, name: str, branch: Branch) -> Iterator[Expr]:
    """Values of a name for which a function has a value."""
    match atom.function, atom.arguments:
        case "atan2", (y, x):
            yield from isolated(y * apply("cos", value) - x * apply("sin", value), name, branch)
        case "abs", (argument,):
            for sign in 1, -1:
                yield from isolated(argument - sign * value, name, branch)
        case "pow", (base, exponent) if name not in exponent.names:
            yield from isolated(base - value ** (1 / exponent), name, branch)
        case function, (argument,) if function in _INVERSES:
            yield from isolated(argument - apply(_INVERSES[function], value), name, branch)


def _roots(polynomial: Mapping[int, Expr], branch: Branch) -> Iterator[Expr]:
    """The roots of a polynomial with one power, or with one and its square."""
    first, *others = sorted(n for n, value in polynomial.items() if n and not value.is_zero)
    rest = polynomial.get(0, ZERO)
    if not others:
        yield from _powers(tidy(-rest / polynomial[first]), Fraction(1, first), branch)
    elif others == [2 * first]:
        a, b = polynomial[2 * first], polynomial[first]
        root = branch.root(b**2 - 4 * a * rest)
        for square in (-b + root) / (2 * a), (-b - root) / (2 * a):
            yield from _powers(square, Fraction(1, first), branch)


def _powers(value: Expr, exponent: Fraction, branch: Branch) -> Iterator[Expr]:
    """A power, and its negative where that has the same inverse."""
    found = branch.root(value) if exponent == Fraction(1, 2) else power(value, exponent)
    yield found
    if exponent.denominator % 2 == 0:
        yield -found
