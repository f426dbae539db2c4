"""`START:STOP:COUNT`: values that are worked out exactly, each when it is asked for."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Context, Decimal, InvalidOperation
from fractions import Fraction
from functools import cached_property

from rigidcli.errors import UsageError, ValueProblem, shown
from rigidcli.fields.typed_numbers import split_quantity
from rigidcli.fields.units import parse_unit
from rigidcli.language.expression import parse

LOGARITHMIC = "log"
"""What stands before START where the ratio of two neighbours is constant, and not their difference."""

FORMS = "START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column"
"""The ways to write values, for messages."""

DIGITS = Context(prec=40)
"""Logarithmic steps are worked with 40 digits, so that 1 to 1000 in four steps has 10 and 100 in it."""


@dataclass(frozen=True)
class Range:
    """`count` values from `start` to `stop`, both included, all in the same `unit`.

    They are worked out exactly and rounded once: 0:1:11 has 0.3, where floats that add up have
    0.30000000000000004.
    """

    start: Fraction
    stop: Fraction
    count: int
    unit: str
    is_rounded: bool
    logarithmic: bool = False
    exact: bool = False

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> str:
        if not self.exact:
            number = repr(self.number(index))
            return f"{number} {self.unit}" if self.unit else number
        value = Fraction(*self._quotient(index))
        decimal = _decimal(value)
        if Fraction(decimal) == value:
            return f"{decimal} {self.unit}".rstrip()
        if self.unit:
            raise UsageError(
                f"{value} {self.unit} has no decimal that is exact",
                hint="choose another COUNT, or list the values",
            )
        return str(value)

    def number(self, index: int) -> float:
        """The value in the unit, rounded once: a quotient of integers is, also beyond 2^53."""
        dividend, divisor = self._quotient(index)
        return dividend / divisor

    def _quotient(self, index: int) -> tuple[int, int]:
        """The value in the unit, as a quotient of integers."""
        if index in (0, self.count - 1):
            return (self.stop if index else self.start).as_integer_ratio()
        if self.logarithmic:
            growth = DIGITS.exp(DIGITS.multiply(self._logarithm, Decimal(index) / (self.count - 1)))
            return DIGITS.multiply(_decimal(self.start), growth).as_integer_ratio()
        first, step, divisor = self._steps
        return first + step * index, divisor

    @cached_property
    def _steps(self) -> tuple[int, int, int]:
        """The first value, the step from one to the next, and what both are to be divided by."""
        step = (self.stop - self.start) / (self.count - 1)
        divisor = math.lcm(self.start.denominator, step.denominator)
        return int(self.start * divisor), int(step * divisor), divisor

    @cached_property
    def _logarithm(self) -> Decimal:
        return DIGITS.ln(DIGITS.divide(_decimal(self.stop), _decimal(self.start)))

    def exactly(self) -> Range:
        """The same range for exact numbers. Raises UsageError where its values are rounded."""
        if self.is_rounded or self.logarithmic:
            hint = "list the values, as in `--sweep KEY=0,pi/4,pi/2`"
            raise UsageError("a range whose values are rounded is none of exact numbers", hint=hint)
        return replace(self, exact=True)


def _decimal(number: Fraction) -> Decimal:
    return DIGITS.divide(Decimal(number.numerator), Decimal(number.denominator))


def read_range(name: str, typed: str, parts: Sequence[str]) -> Range:
    """The range that START:STOP:COUNT describes. Raises UsageError."""
    logarithmic = parts[0] == LOGARITHMIC
    if len(parts) != 3 + logarithmic:
        raise UsageError(f"`{name}`: read {shown(typed)}, expected {FORMS}")
    ends = [_end(name, part) for part in parts[-3:-1]]
    (start, unit), (stop, other) = ends
    if unit and other and unit != other:
        start, unit = _in_unit(name, start, unit, other), other
    for number, own, typed in ((start, unit, parts[-3]), (stop, other, parts[-2])):
        # A zero is the same in all units.
        if number != 0 and not own and (unit or other):
            raise UsageError(f"`{name}`: {shown(typed)} has no unit", hint=f"write `{typed} {unit or other}`")
    if logarithmic and start * stop <= 0:
        raise UsageError(f"`{name}`: logarithmic steps need ends of the same sign, and not 0")
    rounded = any(not _DECIMAL.match(part) for part in parts[-3:-1])
    return Range(start, stop, _count(name, parts[-1]), unit or other, rounded, logarithmic)


_DECIMAL = re.compile(r"[-+]?(\d|\.\d)")
"""How a decimal begins, and no expression such as `pi/2` that is rounded."""


def _end(name: str, text: str) -> tuple[Fraction, str]:
    """The number and the unit of one end of a range; `pi/2` is a number, too."""
    quantity = split_quantity(text)
    try:
        if quantity is not None:
            parse_unit(quantity.unit)
            return _finite(quantity.digits), quantity.unit
        with suppress(InvalidOperation):
            return _finite(text), ""
        return _finite(repr(parse(text).evaluate({}))), ""
    except ValueProblem as problem:
        message = f"`{name}`: read {shown(text)}, expected a number: {problem.message}"
        raise UsageError(message, hint=problem.hint) from None


def _finite(text: str) -> Fraction:
    """A decimal, exactly. Raises InvalidOperation for a text that is none, and ValueProblem beyond floats."""
    number = Decimal(text)
    if not number.is_finite() or abs(number.adjusted()) > 400 or math.isinf(float(number)):
        raise ValueProblem("it is not finite")
    return Fraction(number)


def _in_unit(name: str, number: Fraction, given: str, wanted: str) -> Fraction:
    """A number of one unit in another, but for the rounding of a float where pi stands between them."""
    unit, other = parse_unit(given), parse_unit(wanted)
    if unit.dimension != other.dimension:
        raise UsageError(f"`{name}`: `{given}` and `{wanted}` do not measure the same")
    if unit.pi_power == other.pi_power:
        return number * unit.factor / other.factor
    return Fraction(unit.si(number)) / Fraction(other.scale)


def _count(name: str, text: str) -> int:
    try:
        count = Decimal(text)
        if count.is_finite() and count == int(count) and 1 <= count <= MOST:
            return int(count)
    except InvalidOperation:
        pass
    raise UsageError(f"`{name}`: read {shown(text)}, expected a COUNT from 1 to {MOST:.0e}")


MOST = 10**15
"""The most values of a range: more than any machine works out."""
