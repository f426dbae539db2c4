"""Exact numbers as output: their shortest form, and their text for programs, people and LaTeX."""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.printing.str import StrPrinter


def tidy(expr: Any) -> Any:
    expr = sympy.sympify(expr, strict=True)
    if expr.is_Number or expr.is_Symbol:
        return expr
    found = [expr, sympy.factor_terms(expr), sympy.factor(expr), sympy.cancel(expr)]
    if expr.has(sympy.sin, sympy.cos):
        found += [sympy.trigsimp(e) for e in found[:2]]
    return min(found, key=lambda e: (sympy.count_ops(e), len(str(e)), str(e)))


def tidy_array(array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype != object:
        return array
    result = np.empty(array.shape, dtype=object)
    for index, entry in np.ndenumerate(array):
        result[index] = tidy(entry)
    return result


class _Printer(StrPrinter):
    def _print_Abs(self, e: Any) -> str:
        return f"abs({self._print(e.args[0])})"

    def _print_Exp1(self, e: Any) -> str:
        return "exp(1)"


def text(expr: Any) -> str:
    return str(_Printer().doprint(expr))


def reading(expr: Any) -> str:
    return text(expr).replace("**", "^").replace("*", " ")


def latex(expr: Any) -> str:
    return str(sympy.latex(expr))


def common_factor(array: NDArray[Any]) -> tuple[Any, NDArray[Any]]:
    entries = [sympy.factor_terms(e) for e in array.flat if e != 0]
    if not entries:
        return sympy.Integer(1), array
    numbers = [e.as_coeff_Mul()[0] for e in entries]
    gcd = reduce(math.gcd, [abs(n.p) for n in numbers if n.is_Rational])
    lcm = reduce(math.lcm, [n.q for n in numbers if n.is_Rational])
    factor = sympy.Rational(gcd, lcm) * reduce(sympy.gcd, [e.as_coeff_Mul()[1] for e in entries])
    return factor, tidy_array(array / factor)
