"""Derivatives of exact expressions."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.expressions import ONE, ZERO, Expr, gathered, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import bounded
from rigidcli.language.tree import UnknownFunction

MAX_FACTORS = 20_000
"""Most factors of the terms of one derivative, so that none takes longer than a second."""

_SLOPES: dict[str, Callable[[Expr], Expr]] = {
    "sin": lambda x: apply("cos", x),
    "cos": lambda x: -apply("sin", x),
    "tan": lambda x: 1 + apply("tan", x) ** 2,
    "asin": lambda x: (1 - x**2) ** Fraction(-1, 2),
    "acos": lambda x: -((1 - x**2) ** Fraction(-1, 2)),
    "atan": lambda x: 1 / (1 + x**2),
    "sinh": lambda x: apply("cosh", x),
    "cosh": lambda x: apply("sinh", x),
    "tanh": lambda x: 1 - apply("tanh", x) ** 2,
    "asinh": lambda x: (1 + x**2) ** Fraction(-1, 2),
    "acosh": lambda x: (x - 1) ** Fraction(-1, 2) * (x + 1) ** Fraction(-1, 2),
    "atanh": lambda x: 1 / (1 - x**2),
    "exp": lambda x: apply("exp", x),
    "log": lambda x: 1 / x,
    "abs": lambda x: apply("sign", x),
    "sign": lambda x: ZERO,
}
"""The derivative of each function of one argument."""


def derivative(e: Expr, name: str) -> Expr:
    """The derivative with respect to a symbol; that of `abs` is `sign`, that of `sign` is 0."""
    return _Derivative(name).of(e)


class _Derivative:
    """The derivatives of atoms that are known so far."""

    __slots__ = ("allowance", "known", "name")

    def __init__(self, name: str) -> None:
        self.name = name
        self.allowance = Allowance(MAX_FACTORS)
        self.known: dict[Atom, Expr] = {}

    def of(self, e: Expr) -> Expr:
        if self.name not in e.names:
            return ZERO
        parts = []
        for monomial, coefficient in e.terms.items():
            for atom, exponent in monomial:
                if self.name in atom.names:
                    self.allowance.spend(len(monomial))
                    exponents = dict(monomial)
                    exponents[atom] = exponent - 1
                    rest = gathered(bounded(coefficient * exponent), exponents)
                    parts.append(rest * self.of_atom(atom))
        return total(parts)

    def of_atom(self, atom: Atom) -> Expr:
        if atom not in self.known:
            self.known[atom] = self.worked_out(atom)
        return self.known[atom]

    def worked_out(self, atom: Atom) -> Expr:
        match atom:
            case Group(inner=inner):
                return self.of(inner)
            case Applied(function="atan2", arguments=(y, x)):
                turned: Expr = (x * self.of(y) - y * self.of(x)) / (x**2 + y**2)
                return turned
            case Applied(function="pow", arguments=(base, exponent)):
                return self.of_power(base, exponent)
            case Applied(function=UnknownFunction() as function, arguments=arguments):
                slopes = [apply(slope, *arguments) for slope in function.derivatives]
                return total(f * self.of(x) for f, x in zip(slopes, arguments, strict=True))
            case Applied(function=function, arguments=(argument,)):
                return _SLOPES[function](argument) * self.of(argument)
            case _:
                return ONE

    def of_power(self, base: Expr, exponent: Expr) -> Expr:
        through_base = exponent * base ** (exponent - 1) * self.of(base)
        slope = self.of(exponent)
        if slope.is_zero:
            return through_base
        return through_base + base**exponent * apply("log", base) * slope
