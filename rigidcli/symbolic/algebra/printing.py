"""Exact expressions as text: for programs, for people in a terminal, and for LaTeX."""

from __future__ import annotations

import re
from collections.abc import Callable

import sympy
from sympy.printing.str import StrPrinter

from rigidcli.symbolic.language.latex_names import latex_name
from rigidcli.symbolic.language.tree import CONSTANTS, FUNCTIONS

_NAMES = {function.sympy: name for name, function in FUNCTIONS.items()}
"""What sympy calls a function, and its name in the expression language."""

_RECIPROCALS: dict[sympy.FunctionClass, Callable[[sympy.Expr], sympy.Expr]] = {
    sympy.cot: lambda x: 1 / sympy.tan(x),
    sympy.sec: lambda x: 1 / sympy.cos(x),
    sympy.csc: lambda x: 1 / sympy.sin(x),
    sympy.coth: lambda x: 1 / sympy.tanh(x),
    sympy.sech: lambda x: 1 / sympy.cosh(x),
    sympy.csch: lambda x: 1 / sympy.sinh(x),
}
"""Functions that sympy falls into by itself and the language does without."""


def text(expr: sympy.Expr) -> str:
    """An expression in the expression language: `parse` reads it back with the same value.

    Only numbers of more than 400 digits are written out and yet beyond what `parse` accepts.

    Raises:
        ValueError: a part of it is not in the language, such as infinity or a derivative.
    """
    expr = sympy.sympify(expr, strict=True)
    for function, reciprocal in _RECIPROCALS.items():
        if expr.has(function):
            expr = expr.replace(function, reciprocal)
    for part in sympy.preorder_traversal(expr):
        if not _is_in_language(part):
            raise ValueError(f"`{part}` is not in the expression language")
    return str(_TextPrinter().doprint(expr))


def reading(expr: sympy.Expr) -> str:
    """An expression as a person would write it: `M a^2/12`, `x/(2 m)`, `a (b + c)`.

    Raises:
        ValueError: as `text`.
    """
    between_digits = r"(?<=[0-9])\*(?=[0-9])"
    apart = re.sub(between_digits, "·", text(expr).replace("**", "^"))
    return apart.replace("*", " ").replace("·", "*")


def latex(expr: sympy.Expr) -> str:
    """An expression as LaTeX for math mode; it needs the package amsmath."""
    expr = sympy.sympify(expr, strict=True)
    names = {symbol: latex_name(symbol.name) for symbol in expr.atoms(sympy.Symbol)}
    return str(sympy.latex(expr, symbol_names=names, ln_notation=True, inv_trig_style="full"))


class _TextPrinter(StrPrinter):  # type: ignore[misc]  # sympy has no types
    """Spells what sympy and the expression language spell differently."""

    def _print_Exp1(self, expr: sympy.Expr) -> str:  # noqa: N802  # sympy finds it by this name
        return "exp(1)"

    def _print_Float(self, expr: sympy.Expr) -> str:  # noqa: N802
        return repr(float(expr))

    def _print_Function(self, expr: sympy.Expr) -> str:  # noqa: N802
        return f"{_NAMES[type(expr).__name__]}({self.stringify(expr.args, ', ')})"


def _is_in_language(part: sympy.Basic) -> bool:
    if isinstance(part, sympy.Symbol):
        name = part.name
        return name.isascii() and name.isidentifier() and name not in FUNCTIONS and name not in CONSTANTS
    if isinstance(part, sympy.Float):
        return bool(part.is_finite)
    if isinstance(part, sympy.Function):
        return type(part).__name__ in _NAMES
    return isinstance(part, (sympy.Rational, sympy.Add, sympy.Mul, sympy.Pow)) or part in (sympy.pi, sympy.E)
