"""In what a document's numbers are read: its parameters, and the kind of number to make of them."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from typing import Any

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Scalar
from rigidcli.errors import ExpressionError, ValueProblem, nearest, shown
from rigidcli.model.dimensions import dimension_of
from rigidcli.model.units import (
    Dimension,
    check_dimension,
    looks_like_missing_space,
    parse_unit,
    split_quantity,
)
from rigidcli.symbolic.expression import Expression, parse

LONGEST_LIST = 20
"""Names that a message lists."""


@dataclass(frozen=True, slots=True)
class Formula:
    """An expression in variables, and the values of the parameters that it uses."""

    expression: Expression
    constants: Mapping[str, Scalar]


@dataclass
class Environment:
    """Parameters by name, the arithmetic to use, and what was noticed while numbers were read.

    `dimensions` has those of parameters with units; `declared` the names of all parameters, also
    before they have their values; `broken` those that have a problem of their own, so that what uses
    them is not reported again; `positive` symbols that stand where only a positive number makes sense.
    """

    arithmetic: Arithmetic = FLOAT
    parameters: dict[str, Scalar] = field(default_factory=dict)
    dimensions: dict[str, Dimension] = field(default_factory=dict)
    folder: pathlib.Path = pathlib.Path()
    used: set[str] = field(default_factory=set)
    declared: set[str] = field(default_factory=set)
    broken: set[str] = field(default_factory=set)
    positive: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)

    def read(self, raw: object, dimension: Dimension | None) -> Any:
        """The SI value of a number, a quantity such as `5 cm`, or an expression in the parameters.

        `dimension` is what a unit must fit; None fits all. Raises ValueProblem.
        """
        if isinstance(raw, bool) or not isinstance(raw, float | int | str | Decimal):
            raise ValueProblem(f"read {shown(raw)}, expected {number_of(dimension)}")
        if isinstance(raw, float) and not math.isfinite(raw):
            raise ValueProblem(f"read {shown(raw)}, expected a finite number")
        if not isinstance(raw, str):
            return parse(str(raw)).exact({}) if self.arithmetic.exact else _finite(raw)
        quantity = split_quantity(raw)
        if quantity is None:
            return self._value(self.parse(raw), dimension)
        digits, unit_text = quantity
        try:
            unit = parse_unit(unit_text)
            if dimension is not None:
                check_dimension(unit.text, unit.dimension, dimension)
        except ValueProblem as problem:
            if unit_text in self.declared:
                problem.hint = f"a number, a blank and a unit; for the parameter write `{digits}*{unit_text}`"
            raise
        if unit_text in self.declared:
            self.notes.append(f"{shown(raw)} has a unit; for the parameter write `{digits}*{unit_text}`")
        if self.arithmetic.exact:
            factor = parse(f"{unit.factor.numerator}/{unit.factor.denominator}").exact({})
            return parse(digits).exact({}) * factor * self.arithmetic.pi**unit.pi_power
        # Through the shortest decimal, so that 120 g cm^2 is the float nearest to 1.2e-5.
        return unit.si(Fraction(repr(_finite(digits))))

    def formula(self, raw: object, dimension: Dimension, variables: tuple[str, ...]) -> Formula:
        """A number, a quantity, or an expression in `variables` and the parameters. Raises ValueProblem."""
        if not isinstance(raw, str) or split_quantity(raw) is not None:
            return Formula(parse("value"), {"value": self.read(raw, dimension)})
        expression = self.parse(raw)
        inside = expression.names & set(variables)
        for name in sorted(inside & self.declared):
            raise ExpressionError(
                f"`{name}` is a parameter, and a variable of the motion", hint="rename the parameter"
            )
        self._use(expression.names - inside, variables)
        if not inside:
            return Formula(parse("value"), {"value": self._value(expression, dimension)})
        known = expression.names - inside - self.broken
        return Formula(expression, {name: self.parameters[name] for name in sorted(known)})

    @staticmethod
    def parse(raw: str) -> Expression:
        """Read a text as an expression."""
        try:
            return parse(raw)
        except ExpressionError as error:
            if looks_like_missing_space(raw):
                error.hint = "a blank stands between a number and its unit, as in `5 cm`"
            raise

    def dimension(self, raw: object) -> Dimension | None:
        """The dimension of a value as it is written; None where it may be any."""
        if not isinstance(raw, str):
            return None
        quantity = split_quantity(raw)
        return (
            parse_unit(quantity[1]).dimension if quantity else dimension_of(parse(raw).root, self.dimensions)
        )

    def _value(self, expression: Expression, dimension: Dimension | None) -> Any:
        self._use(expression.names)
        if expression.names & self.broken:
            return 1.0
        if expression.names & self.dimensions.keys():
            given = dimension_of(expression.root, self.dimensions)
            if dimension is not None and given is not None and any(given):
                check_dimension(expression.text, given, dimension)
        if self.arithmetic.exact:
            return expression.exact(self.parameters)
        return expression.evaluate(self.parameters)

    def _use(self, names: Iterable[str], variables: tuple[str, ...] = ()) -> None:
        """Note that parameters are used. Raises ExpressionError for what is none; names the `variables`."""
        unknown = sorted(set(names) - self.declared)
        if unknown:
            raise self._undeclared(unknown, variables)
        self.used |= set(names)

    def assume_positive(self, value: Any) -> None:
        """Note that the document makes sense only if `value`, whose sign is open, is positive."""
        if value.is_Symbol:
            self.positive.add(value.name)

    @cached_property
    def _declared_in_order(self) -> list[str]:
        return sorted(self.declared)

    def _undeclared(self, names: list[str], variables: tuple[str, ...]) -> ValueProblem:
        near = nearest(names[0], [*variables, *self._declared_in_order])
        also = f"; variables here: {', '.join(variables)}" if variables else ""
        return ExpressionError(
            f"undeclared name{'s' if len(names) > 1 else ''} {_listed(names)}"
            f"{f' (did you mean {near}?)' if near else ''}",
            hint=f"declared parameters: {_listed(self._declared_in_order)}{also}",
        )


def _listed(names: list[str]) -> str:
    """Names for a message, not too many of them."""
    more = f" and {len(names) - LONGEST_LIST} more" if len(names) > LONGEST_LIST else ""
    return (", ".join(map(shown, names[:LONGEST_LIST])) or "none") + more


def _finite(raw: float | int | str | Decimal) -> float:
    try:
        value = float(raw)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueProblem(f"read {shown(raw)}, expected a finite number")
    return value


def number_of(dimension: Dimension | None, sign: str | None = None) -> str:
    """What is expected where a number of this dimension stands, in words."""
    words = {"positive": "a positive", "nonnegative": "a nonnegative", None: "a"}[sign]
    return f"{words} number" if not dimension or not any(dimension) else f"{words} {dimension}"
