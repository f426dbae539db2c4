"""Dimensions of expressions: a parameter that was given as `3 cm` is a length wherever it is used.

A plain number is in SI units of whatever fits, and so is a parameter given as one; an expression
has a dimension only as far as that follows from parameters with units.
"""

from __future__ import annotations

from collections.abc import Mapping

from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import DIMENSIONLESS, Dimension, described
from rigidcli.language import tree
from rigidcli.language.tree import Call, Name, Negative, Node, Number, Power, Product, Reciprocal, Sum


def dimension_of(node: Node, dimensions: Mapping[str, Dimension]) -> Dimension | None:
    """The dimension of an expression, from those of its names; None where it may be any.

    Raises ValueProblem for a sum of different dimensions, and for a function of no pure number.
    """
    match node:
        case Name(name):
            return dimensions.get(name)
        case Negative(operand):
            return dimension_of(operand, dimensions)
        case Reciprocal(operand):
            return _power(dimension_of(operand, dimensions), -1)
        case Sum(terms):
            return _common([dimension_of(term, dimensions) for term in terms])
        case Product(factors):
            total = DIMENSIONLESS
            for factor in factors:
                dimension = dimension_of(factor, dimensions)
                if dimension is None and not _is_pure(factor):
                    return None
                total = total.times(dimension or DIMENSIONLESS)
            return None if all(map(_is_pure, factors)) else total
        case Power(base, Number(_, exponent)):
            return _power(dimension_of(base, dimensions), exponent)
        case Power(base, Negative(Number(_, exponent))):
            return _power(dimension_of(base, dimensions), -exponent)
        case Call(tree.UnknownFunction(), _):
            return None
        case Call("sqrt", (argument,)):
            return _power(dimension_of(argument, dimensions), 0.5)
        case Call("abs", (argument,)):
            return dimension_of(argument, dimensions)
        case Call(function, arguments):
            dimension = _common([dimension_of(argument, dimensions) for argument in arguments])
            is_free = dimension is None or function in ("atan2", "sign")
            if dimension is not None and not is_free and any(dimension._replace(angle=0)):
                raise ValueProblem(
                    f"{function} of {described(dimension)}, expected an angle or a pure number"
                )
    return None


def _is_pure(node: Node) -> bool:
    """Whether a factor is a pure number in any case, such as the 2 of 2*a and the sine of R*sin(theta)."""
    match node:
        case Number() | tree.Constant():
            return True
        case Negative(operand) | Reciprocal(operand):
            return _is_pure(operand)
        case Sum(members) | Product(members):
            return all(map(_is_pure, members))
        case Power(base, exponent):
            return _is_pure(base) and _is_pure(exponent)
        case Call(tree.UnknownFunction(), _):
            return False
        case Call(function, arguments):
            return function not in ("sqrt", "abs") or all(map(_is_pure, arguments))
    return False


def _power(dimension: Dimension | None, exponent: float) -> Dimension | None:
    if dimension is None:
        return None
    exponents = [part * exponent for part in dimension]
    return Dimension(*map(int, exponents)) if all(part == int(part) for part in exponents) else None


def _common(dimensions: list[Dimension | None]) -> Dimension | None:
    """The dimension of terms that are added: radians count as 1, and plain numbers fit any."""
    given = [dimension for dimension in dimensions if dimension is not None]
    for other in given[1:]:
        if other._replace(angle=0) != given[0]._replace(angle=0):
            raise ValueProblem(f"{described(given[0])} and {described(other)} cannot be added")
    return given[0] if given else None
