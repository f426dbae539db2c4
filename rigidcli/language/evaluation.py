"""Trees to values: with `math` for single numbers, with numpy for whole arrays, with others in `code`."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import partial, reduce
from typing import TYPE_CHECKING, Any

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.functions import FUNCTIONS
from rigidcli.language.tree import Kind, Parts, fold

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SIGNS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


def numbers(
    number: Callable[[str, float], Any],
    negative: Callable[[Any], Any],
    joined: Callable[[Any, str, Any], Any],
    power: Callable[[Any, Any], Any],
    call: Callable[[str, list[Any]], Any],
) -> Kind:
    """A kind whose values are joined from left to right, two by two with one of `+-*/` between them."""

    def in_order(start: float, signs: str, parts: Parts) -> Any:
        return reduce(lambda left, part: joined(left, signs[part[0]], part[1]), parts, start)

    return Kind(number, negative, partial(in_order, 0.0, "+-"), partial(in_order, 1.0, "*/"), power, call)


def real(node: tree.Node, values: Mapping[str, float]) -> float:
    """The value of a tree, a finite number.

    Raises:
        ExpressionError: there is no such value, at any step of the way.
    """
    return float(fold(node, lambda name: known(name, values), FLOATS))


def known(name: str, values: Mapping[str, float]) -> float:
    """The value of a name, a finite number; ExpressionError if it has none."""
    if name not in values:
        raise ExpressionError(f"no value for `{name}`")
    try:
        number = float(values[name])
    except OverflowError:  # an integer beyond the range of floats
        number = math.inf
    if math.isfinite(number):
        return number
    raise ExpressionError(f"the value of `{name}` is not a finite number")


def finite(value: float) -> float:
    """The value; ExpressionError if it is not finite."""
    if math.isfinite(value):
        return value
    raise ExpressionError("the value is too large" if math.isinf(value) else "there is no value")


def joined(left: float, sign: str, right: float) -> float:
    """The sum, difference, product or quotient; ExpressionError where it is not finite."""
    try:
        return finite(SIGNS[sign](left, right))
    except ZeroDivisionError:
        raise ExpressionError("division by zero") from None


def power(base: float, exponent: float) -> float:
    """The real power; ExpressionError where there is none."""
    try:
        return math.pow(base, exponent)
    except OverflowError:
        raise ExpressionError("the value is too large") from None
    except ValueError:
        if base == 0.0:
            raise ExpressionError("division by zero") from None
        raise ExpressionError(
            f"a negative number ({base:g}) to the power {exponent:g} has no real value"
        ) from None


def call(function: str, arguments: list[float]) -> float:
    """The value of a function; ExpressionError where there is none."""
    require_formula(function)
    try:
        return finite(FUNCTIONS[function].real(*arguments))
    except OverflowError:
        raise ExpressionError(f"the value of `{function}` is too large") from None
    except ValueError:
        shown = ", ".join(f"{argument:g}" for argument in arguments)
        raise ExpressionError(f"`{function}({shown})` has no finite real value") from None


def require_formula(function: str) -> None:
    """Raise ExpressionError for an unknown function."""
    if isinstance(function, tree.UnknownFunction):
        raise ExpressionError(f"`{function.base}` has no formula, and so no value")


FLOATS = numbers(lambda text, number: finite(number), operator.neg, joined, power, call)


def array(node: tree.Node, values: Mapping[str, float | NDArray[np.float64]]) -> NDArray[np.float64]:
    """The values of a tree, element by element; infinite or NaN where there is none."""
    import numpy as np

    def called(function: str, arguments: list[Any]) -> Any:
        require_formula(function)
        return getattr(np, FUNCTIONS[function].numpy)(*arguments)

    arrays = numbers(
        lambda text, number: np.float64(number),
        operator.neg,
        lambda left, sign, right: SIGNS[sign](left, right),
        np.power,
        called,
    )
    with np.errstate(all="ignore"):
        return np.asarray(fold(node, lambda name: np.asarray(values[name], dtype=np.float64), arrays))
