"""Trees to values: with `math` for single numbers, with numpy for whole arrays, with others in `code`."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.functions import CONSTANTS, FUNCTIONS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Operations(NamedTuple):
    """What names, numbers and operations are, where trees are worked out in one kind of values."""

    name: Callable[[str], Any]
    number: Callable[[float, str], Any]
    """A number by its nearest float and its text, which is the name of a constant."""
    negative: Callable[[Any], Any]
    joined: Callable[[Any, str, Any], Any]
    """What two values with one of `+-*/` between them come to; a sum begins with 0.0, a product with 1.0."""
    power: Callable[[Any, Any], Any]
    call: Callable[[str, list[Any]], Any]


def value(node: tree.Node, by: Operations) -> Any:
    """The value of a tree by these operations, from left to right."""
    total: Any
    match node:
        case tree.Name(name):
            return by.name(name)
        case tree.Number(text, number):
            return by.number(number, text)
        case tree.Constant(name):
            return by.number(CONSTANTS[name], name)
        case tree.Negative(operand):
            return by.negative(value(operand, by))
        case tree.Power(base, exponent):
            return by.power(value(base, by), value(exponent, by))
        case tree.Call(function, arguments):
            return by.call(function, [value(argument, by) for argument in arguments])
        case tree.Sum(operands):
            total, signs = 0.0, "+-"
        case tree.Product(operands):
            total, signs = 1.0, "*/"
        case tree.Reciprocal():
            total, signs, operands = 1.0, "*/", (node,)
    inverse = tree.Negative if signs == "+-" else tree.Reciprocal
    for operand in operands:
        sign, inner = (signs[1], operand.operand) if isinstance(operand, inverse) else (signs[0], operand)
        total = by.joined(total, sign, value(inner, by))
    return total


SIGNS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


def real(node: tree.Node, values: Mapping[str, float]) -> float:
    """The value of a tree, a finite number.

    Raises:
        ExpressionError: there is no such value, at any step of the way.
    """
    by = Operations(lambda name: known(name, values), finite, operator.neg, joined, power, call)
    return float(value(node, by))


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


def finite(value: float, text: str = "") -> float:
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


def array(node: tree.Node, values: Mapping[str, float | NDArray[np.float64]]) -> NDArray[np.float64]:
    """The values of a tree, element by element; infinite or NaN where there is none."""
    import numpy as np

    def called(function: str, arguments: list[Any]) -> Any:
        require_formula(function)
        return getattr(np, FUNCTIONS[function].numpy)(*arguments)

    by = Operations(
        lambda name: np.asarray(values[name], dtype=np.float64),
        lambda number, text: np.float64(number),
        operator.neg,
        lambda left, sign, right: SIGNS[sign](left, right),
        np.power,
        called,
    )
    with np.errstate(all="ignore"):
        return np.asarray(value(node, by))
