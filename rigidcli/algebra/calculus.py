"""Derivatives of exact expressions, and antiderivatives of sums of simple terms."""

from __future__ import annotations

from functools import cache, lru_cache

from rigidcli.algebra.atoms import Applied, Atom, Group, Symbol
from rigidcli.algebra.bounds import Allowance, Rational, bounded
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, atomic, gathered, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import from_tree
from rigidcli.errors import ExpressionError
from rigidcli.language.parser import read
from rigidcli.language.tree import UnknownFunction
from rigidcli.language.words import FUNCTIONS

_parsed = cache(read)


def _at(formula: str, x: Expr) -> Expr:
    """The value of a formula in x, in the expression language."""
    return from_tree(_parsed(formula)[0], {"x": x})


@lru_cache(4096)
def derivative(e: Expr, name: str) -> Expr:
    """The derivative with respect to a symbol; that of `abs` is `sign`, that of `sign` is 0."""
    allowance = Allowance()

    def of(e: Expr) -> Expr:
        if name not in e.names:
            return ZERO
        parts = []
        for monomial, coefficient in e.terms.items():
            for atom, exponent in monomial:
                if name in atom.names:
                    allowance.spend(len(monomial))
                    exponents = dict(monomial)
                    exponents[atom] = exponent - 1
                    rest = gathered(bounded(coefficient * exponent), exponents)
                    parts.append(rest * of_atom(atom))
        return total(parts)

    @cache
    def of_atom(atom: Atom) -> Expr:
        match atom:
            case Group(inner=inner):
                return of(inner)
            case Applied(function="atan2", arguments=(y, x)):
                turned: Expr = (x * of(y) - y * of(x)) / (x**2 + y**2)
                return turned
            case Applied(function="pow", arguments=(base, exponent)):
                slope, through_base = of(exponent), exponent * base ** (exponent - 1) * of(base)
                through_exponent = base**exponent * apply("log", base) * slope if slope else ZERO
                return total([through_base, through_exponent])
            case Applied(function=UnknownFunction() as function, arguments=arguments):
                slopes = [apply(slope, *arguments) for slope in function.derivatives]
                return total(f * of(x) for f, x in zip(slopes, arguments, strict=True))
            case Applied(function=function, arguments=(argument,)):
                return _at(FUNCTIONS[function].slope, argument) * of(argument)
            case _:
                return ONE

    return of(e)


_INTEGRALS = {"sin": "-cos(x)", "cos": "sin(x)", "sinh": "cosh(x)", "cosh": "sinh(x)", "exp": "exp(x)"}
"""The integral of each function of one argument."""

MAX_PARTS = 40  # the highest power of the variable beside another function that is integrated by parts


def antiderivative(e: Expr, name: str) -> Expr | None:
    """A function whose derivative by a symbol is `e`; None where a term has none by these rules.

    Terms are powers, functions of what is linear in the variable, and natural powers times one of these.
    """
    try:
        parts = [_of_term(Expr({monomial: c}), name) for monomial, c in expand(e).ordered]
    except ExpressionError:
        return None
    known = [part for part in parts if part is not None]
    return total(known) if len(known) == len(parts) else None


def _of_term(term: Expr, name: str) -> Expr | None:
    ((monomial, coefficient),) = term.terms.items()
    moving = [(atom, n) for atom, n in monomial if name in atom.names]
    rest = gathered(coefficient, {atom: n for atom, n in monomial if name not in atom.names})
    if not moving:
        return term * symbol(name)
    if len(moving) > 1:
        return _by_parts(rest, dict(moving), name)
    ((atom, n),) = moving
    if isinstance(atom, Symbol):
        x = atomic(atom)
        return rest * (apply("log", x) if n == -1 else power(x, n + 1) / (n + 1))
    if not isinstance(atom, Applied) or atom.function not in _INTEGRALS or n != 1:
        return None
    slope = derivative(atom.arguments[0], name)
    return None if name in slope.names else rest * _at(_INTEGRALS[atom.function], atom.arguments[0]) / slope


def _by_parts(rest: Expr, moving: dict[Atom, Rational], name: str) -> Expr | None:
    """The antiderivative of a natural power times another function, by parts: the power gets lower."""
    variable = next((atom for atom in moving if isinstance(atom, Symbol)), None)
    exponent = moving.pop(variable, 0) if variable is not None else 0
    if variable is None or len(moving) > 1 or exponent.denominator != 1 or not 0 < exponent <= MAX_PARTS:
        return None
    factor = _of_term(gathered(1, moving), name)
    x = atomic(variable)
    lower = None if factor is None else antiderivative(exponent * x ** (exponent - 1) * factor, name)
    return None if factor is None or lower is None else rest * (x**exponent * factor - lower)
