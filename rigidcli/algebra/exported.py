"""What exact expressions become outside of the algebra: text, LaTeX, numbers, and expressions of sympy."""

from __future__ import annotations

import operator
from functools import lru_cache
from typing import Any, Self

from rigidcli.algebra.atoms import Symbol, Terms
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.language.evaluation import SIGNS, numbers
from rigidcli.language.expression import Expression
from rigidcli.language.formula import Style
from rigidcli.language.text import latex, text
from rigidcli.language.tree import Node, UnknownFunction, fold

KEPT = 128
"""Texts that are kept: results of one system at many values of its parameters have the same ones."""

PLAIN = Style()
"""Expressions as the algebra orders them, with fractions."""


class Exported(Terms):
    """A sum with its ways out. `expressions.Expr` adds the arithmetic."""

    __slots__ = ("style",)

    style: Style
    """How it is written. Equal expressions may have different styles."""

    @property
    def decimal(self) -> bool:
        """Whether it is written with decimals where its fractions have an end: 0.37 x."""
        return self.style.decimal

    def __str__(self) -> str:
        return _text(self, self.style)

    __repr__ = __str__

    def _repr_latex_(self) -> str:
        return f"${latex(self.tree())}$"

    def tree(self, digits: int | None = None) -> Node:
        """The tree in which it is written, exact for any number of digits."""
        return self.style.of(to_tree(self))

    def styled(self, style: Style) -> Self:
        """The same expression, written in a style."""
        written = type(self)(self.terms)
        written.style = style
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

        positive = {atom.name for atom in self.everywhere() if isinstance(atom, Symbol) and atom.positive}

        def called(function: str, values: list[Any]) -> Any:
            if not isinstance(function, UnknownFunction):
                return getattr(sympy, "Abs" if function == "abs" else function)(*values)
            places = sympy.symbols(f"x:{len(values)}", cls=sympy.Dummy)
            slope = sympy.Function(function.base)(*places).diff(*(places[k] for k in function.by))
            return sympy.Subs(slope, places, values).doit()

        def named(name: str) -> Any:
            return sympy.Symbol(name, real=True, positive=True if name in positive else None)

        kind = numbers(
            number=lambda text, value: sympy.pi if text == "pi" else sympy.Rational(text),
            negative=operator.neg,
            joined=lambda left, sign, right: SIGNS[sign](int(left) if left in (0.0, 1.0) else left, right),
            power=operator.pow,
            call=called,
        )
        return fold(to_tree(self), named, kind)

    _sympy_ = to_sympy  # by this name sympy's own functions take it


@lru_cache(maxsize=KEPT)
def _text(e: Exported, style: Style) -> str:
    """The text of an expression; the style tells apart equal ones that are written in two ways."""
    return text(e.tree())
