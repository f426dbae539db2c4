"""Antiderivatives of sums of simple terms: powers, functions of what is linear in the variable, and both."""

from __future__ import annotations

from collections.abc import Callable

from rigidcli.algebra.atoms import Applied, Atom, Symbol
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, atomic, gathered, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.errors import ExpressionError

_INTEGRALS: dict[str, Callable[[Expr], Expr]] = {
    "sin": lambda x: -apply("cos", x),
    "cos": lambda x: apply("sin", x),
    "sinh": lambda x: apply("cosh", x),
    "cosh": lambda x: apply("sinh", x),
    "exp": lambda x: apply("exp", x),
}
"""The integral of each function of one argument."""

MAX_PARTS = 40
"""The highest power of the variable beside another function that is integrated by parts."""


def antiderivative(e: Expr, name: str) -> Expr | None:
    """A function whose derivative by a symbol is `e`; None where a term is of no kind that is known."""
    try:
        parts = [_of_term(Expr({monomial: c}), name) for monomial, c in expand(e).ordered]
    except ExpressionError:
        return None
    known = [part for part in parts if part is not None]
    return total(known) if len(known) == len(parts) else None


def _of_term(term: Expr, name: str) -> Expr | None:
    """The same for one term."""
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
    return None if name in slope.names else rest * _INTEGRALS[atom.function](atom.arguments[0]) / slope


def _by_parts(rest: Expr, moving: dict[Atom, Rational], name: str) -> Expr | None:
    """That of a natural power of the variable and one other factor: the power gets lower step by step."""
    variable = next((atom for atom in moving if isinstance(atom, Symbol)), None)
    exponent = moving.pop(variable, 0) if variable is not None else 0
    if variable is None or len(moving) > 1 or exponent.denominator != 1 or not 0 < exponent <= MAX_PARTS:
        return None
    factor = _of_term(gathered(1, moving), name)
    x = atomic(variable)
    lower = None if factor is None else antiderivative(exponent * x ** (exponent - 1) * factor, name)
    return None if factor is None or lower is None else rest * (x**exponent * factor - lower)
