"""What exact expressions become outside of the algebra: text, LaTeX, numbers, and expressions of sympy."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Self

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Surd, Symbol, Terms
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.language.expression import Expression
from rigidcli.language.formula import in_decimals
from rigidcli.language.text import latex, text
from rigidcli.language.tree import Node, UnknownFunction

KEPT = 128
"""Texts that are kept: results of one system at many values of its parameters have the same ones."""


class Exported(Terms):
    """A sum with its ways out. `expressions.Expr` adds the arithmetic."""

    __slots__ = ("decimal",)

    decimal: bool
    """Whether it is written with decimals where its fractions have an end: 0.37 x."""

    def __str__(self) -> str:
        return _text(self, self.decimal)

    __repr__ = __str__

    def _repr_latex_(self) -> str:
        return f"${latex(self.tree())}$"

    def tree(self, digits: int | None = None) -> Node:
        """The tree in which it is written, exact for any number of digits."""
        return in_decimals(to_tree(self)) if self.decimal else to_tree(self)

    def in_decimals(self) -> Self:
        """The same expression, written with decimals."""
        written = type(self)(self.terms)
        written.decimal = True
        return written

    def __float__(self) -> float:
        """Raises ExpressionError where a symbol is in it, or the value is too large."""
        known = self.as_number
        try:
            return float(self.evaluate() if known is None else known)
        except OverflowError as error:
            raise ExpressionError("the value is too large") from error

    def evaluate(self, **values: Any) -> Any:
        """The value where the symbols have these values: a float, or an array as soon as one of these is.

        Raises:
            ExpressionError: a symbol has no value, or numbers lead to no finite real value.
        """
        import numpy as np

        arrays = {name: np.asarray(value) if np.ndim(value) else value for name, value in values.items()}
        return Expression("", to_tree(self), self.names).evaluate(arrays)

    def to_sympy(self) -> Any:
        """The same as an expression of sympy, which must be installed. Its symbols are real or positive."""
        import sympy

        def rational(value: Rational) -> Any:
            return sympy.Rational(value.numerator, value.denominator)

        def product(monomial: Monomial, coefficient: Rational) -> Any:
            return sympy.Mul(rational(coefficient), *(_to_sympy(atom) ** rational(n) for atom, n in monomial))

        return sympy.Add(*(product(monomial, coefficient) for monomial, coefficient in self.ordered))

    _sympy_ = to_sympy  # by this name sympy's own functions take it


@lru_cache(maxsize=KEPT)
def _text(e: Exported, decimal: bool) -> str:
    """The text of an expression; `decimal` tells apart equal ones that are written in two ways."""
    return text(e.tree())


def _to_sympy(atom: Atom) -> Any:
    """An atom as an expression of sympy."""
    import sympy

    match atom:
        case Symbol(name=name, positive=positive):
            return sympy.Symbol(name, positive=True) if positive else sympy.Symbol(name, real=True)
        case Surd(value=value):
            return sympy.Integer(value)
        case Group(inner=inner):
            return inner.to_sympy()
        case Applied(function="pow", arguments=(base, exponent)):
            return base.to_sympy() ** exponent.to_sympy()
        case Applied(function=function, arguments=arguments):
            values = [argument.to_sympy() for argument in arguments]
            if not isinstance(function, UnknownFunction):
                return getattr(sympy, "Abs" if function == "abs" else function)(*values)
            places = sympy.symbols(f"x:{len(values)}", cls=sympy.Dummy)
            slope = sympy.Function(function.base)(*places).diff(*(places[k] for k in function.by))
            return sympy.Subs(slope, places, values).doit()
        case _:
            return sympy.pi
