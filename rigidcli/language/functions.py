"""The functions and constants of the expression language."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


class Function(NamedTuple):
    """What a function is for each kind of number: a callable for floats, names in numpy and heyoka; in words.

    heyoka has none for what is not smooth: a Taylor series does not see a corner ahead.
    """

    arity: int
    real: Callable[..., float]
    numpy: str
    heyoka: str | None
    says: str


FUNCTIONS: dict[str, Function] = {
    "sin": Function(1, math.sin, "sin", "sin", "sine of x (rad)"),
    "cos": Function(1, math.cos, "cos", "cos", "cosine of x (rad)"),
    "tan": Function(1, math.tan, "tan", "tan", "tangent of x (rad)"),
    "asin": Function(1, math.asin, "arcsin", "asin", "arc sine, from -pi/2 to pi/2"),
    "acos": Function(1, math.acos, "arccos", "acos", "arc cosine, from 0 to pi"),
    "atan": Function(1, math.atan, "arctan", "atan", "arc tangent, from -pi/2 to pi/2"),
    "atan2": Function(2, math.atan2, "arctan2", "atan2", "angle of the point (x, y), from -pi to pi"),
    "sinh": Function(1, math.sinh, "sinh", "sinh", "hyperbolic sine"),
    "cosh": Function(1, math.cosh, "cosh", "cosh", "hyperbolic cosine"),
    "tanh": Function(1, math.tanh, "tanh", "tanh", "hyperbolic tangent"),
    "asinh": Function(1, math.asinh, "arcsinh", "asinh", "inverse hyperbolic sine"),
    "acosh": Function(1, math.acosh, "arccosh", "acosh", "inverse hyperbolic cosine"),
    "atanh": Function(1, math.atanh, "arctanh", "atanh", "inverse hyperbolic tangent"),
    "exp": Function(1, math.exp, "exp", "exp", "e to the power of x"),
    "log": Function(1, math.log, "log", "log", "natural logarithm"),
    "sqrt": Function(1, math.sqrt, "sqrt", "sqrt", "square root"),
    "abs": Function(1, math.fabs, "fabs", None, "absolute value"),
    "sign": Function(1, _sign, "sign", None, "1, 0 or -1: the sign of x"),
}

ALIASES = {"ln": "log"}
"""Further names of functions, which are read and never written."""

QUOTIENTS = {"cot": ("cos", "sin"), "sec": ("", "cos"), "csc": ("", "sin")}
"""Functions that are read as quotients of others, and never written: cot(x) is cos(x)/sin(x)."""

CONSTANTS: dict[str, float] = {"pi": math.pi}

CALLED: frozenset[str] = frozenset({*FUNCTIONS, *ALIASES, *QUOTIENTS})
"""Names that stand before arguments."""

RESERVED: frozenset[str] = CALLED | {*CONSTANTS, "t"}
"""Names that a document cannot give to a parameter of its own; `t` is time."""
