"""Exact numbers as an `Arithmetic`: rationals, roots, pi, and symbols without a value."""

from __future__ import annotations

import math
import zlib
from typing import Any

import sympy

from rigidcli.core.arithmetic import Arithmetic
from rigidcli.symbolic.algebra.exact import tidy, tidy_array

ZERO_DIGITS = 60
"""A number without symbols that is below 10^-50 when worked to so many digits is zero."""


def _symbol(name: str, positive: bool) -> Any:
    """A parameter without a value: real, or known to be positive."""
    return sympy.Symbol(name, positive=True) if positive else sympy.Symbol(name, real=True)


def _value(x: Any) -> float | None:
    x = sympy.sympify(x, strict=True)
    return None if x.free_symbols else float(x.evalf(20))


def _sign(x: Any) -> int | None:
    x = tidy(sympy.sympify(x, strict=True))
    if x.is_zero:
        return 0
    if x.free_symbols:
        return 1 if x.is_positive else -1 if x.is_negative else None
    number = x.evalf(ZERO_DIGITS, maxn=2 * ZERO_DIGITS)
    if abs(number) < sympy.Float(10) ** -50:
        return 0
    return 1 if number > 0 else -1


def _size(x: Any) -> float:
    """The number, or its value where every symbol has a value of its own between 1 and 2."""
    x = sympy.sympify(x, strict=True)
    sample = {s: 1 + sympy.Float(zlib.crc32(s.name.encode())) / 2**32 for s in x.free_symbols}
    # Rounding may leave an imaginary part where the root of a square is not seen as one.
    number = complex(x.xreplace(sample).evalf(20))
    return number.real if abs(number.imag) <= 1e-12 * abs(number.real) else math.nan


def _hypot(*components: Any) -> Any:
    return sympy.sqrt(tidy(sympy.Add(*(sympy.sympify(c, strict=True) ** 2 for c in components))))


EXACT = Arithmetic(
    exact=True,
    pi=sympy.pi,
    sqrt=sympy.sqrt,
    sin=sympy.sin,
    cos=sympy.cos,
    atan2=sympy.atan2,
    hypot=_hypot,
    value=_value,
    sign=_sign,
    size=_size,
    tidy=tidy_array,
    symbol=_symbol,
)
