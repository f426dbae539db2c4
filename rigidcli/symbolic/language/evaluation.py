"""Trees to numbers: with `math` for single values, with numpy for whole arrays of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.language.tree import (
    CONSTANTS,
    FUNCTIONS,
    Call,
    Constant,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def real(node: Node, values: Mapping[str, float]) -> float:
    """The value of a tree, a finite number.

    Raises:
        ExpressionError: there is no such value, at any step of the way.
    """
    match node:
        case Name(name):
            return _known(name, values[name])
        case Number(_, value):
            return finite(value)
        case Constant(name):
            return CONSTANTS[name]
        case Negative(operand):
            return -real(operand, values)
        case Sum(terms):
            total = 0.0
            for term in terms:
                total += real(term, values)
            return finite(total)
        case Product(factors):
            product = 1.0
            for factor in factors:
                if isinstance(factor, Reciprocal):
                    product = divide(product, real(factor.operand, values))
                else:
                    product *= real(factor, values)
            return finite(product)
        case Reciprocal(operand):
            return finite(divide(1.0, real(operand, values)))
        case Power(base, exponent):
            return power(real(base, values), real(exponent, values))
        case Call(function, arguments):
            return call(function, [real(argument, values) for argument in arguments])


def _known(name: str, value: float) -> float:
    try:
        number = float(value)
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


def divide(numerator: float, denominator: float) -> float:
    """The quotient; ExpressionError where the denominator is zero."""
    if denominator == 0.0:
        raise ExpressionError("division by zero")
    return numerator / denominator


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
    try:
        return finite(FUNCTIONS[function].real(*arguments))
    except OverflowError:
        raise ExpressionError(f"the value of `{function}` is too large") from None
    except ValueError:
        shown = ", ".join(f"{argument:g}" for argument in arguments)
        raise ExpressionError(f"`{function}({shown})` has no finite real value") from None


def array(node: Node, values: Mapping[str, float | NDArray[np.float64]]) -> NDArray[np.float64]:
    """The values of a tree, element by element; infinite or NaN where there is none."""
    import numpy as np

    numbers = {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}
    with np.errstate(all="ignore"):
        return np.asarray(_elements(node, numbers, np))


def _elements(node: Node, values: Mapping[str, Any], np: Any) -> Any:
    match node:
        case Name(name):
            return values[name]
        case Number(_, value):
            return np.float64(value)
        case Constant(name):
            return np.float64(CONSTANTS[name])
        case Negative(operand):
            return -_elements(operand, values, np)
        case Sum(terms):
            total = np.float64(0.0)
            for term in terms:
                total = total + _elements(term, values, np)
            return total
        case Product(factors):
            product = np.float64(1.0)
            for factor in factors:
                if isinstance(factor, Reciprocal):
                    product = product / _elements(factor.operand, values, np)
                else:
                    product = product * _elements(factor, values, np)
            return product
        case Reciprocal(operand):
            return np.float64(1.0) / _elements(operand, values, np)
        case Power(base, exponent):
            return np.power(_elements(base, values, np), _elements(exponent, values, np))
        case Call(function, arguments):
            operation = getattr(np, FUNCTIONS[function].numpy)
            return operation(*(_elements(argument, values, np) for argument in arguments))
