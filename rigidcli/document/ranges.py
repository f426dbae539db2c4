"""`START:STOP:COUNT`: values that are worked out exactly, each when it is asked for."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Context, Decimal, InvalidOperation
from fractions import Fraction

from rigidcli.errors import UsageError, ValueProblem, shown
from rigidcli.fields.typed_numbers import split_quantity
from rigidcli.fields.units import parse_unit
from rigidcli.language.expression import parse

LOGARITHMIC = "log"
"""What stands before START where the ratio of two neighbours is constant, and not their difference."""

FORMS = "START:STOP:COUNT, log:START:STOP:COUNT, 1,2,5 or @table.csv:column"
"""The ways to write values, for messages."""

MOST = 10**15
"""The most values of a range: more than any machine works out."""

DIGITS = Context(prec=40)
"""Logarithmic steps are worked with 40 digits, so that 1 to 1000 in four steps has 10 and 100 in it."""

_DECIMAL = re.compile(r"[-+]?(\d|\.\d)")
"""How a decimal begins, and no expression such as `pi/2` that is rounded."""


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
        over, under = self._ratio(index)
        text = f"{over / under!r}"
        if self.exact:
            value = Fraction(over, under)
            decimal = _decimal(value)
            text = str(decimal) if Fraction(decimal) == value else str(value)
            if "/" in text and self.unit:
                hint = "choose another COUNT, or list the values"
                raise UsageError(f"{text} {self.unit} has no decimal that is exact", hint=hint)
        return f"{text} {self.unit}".rstrip()

    def _ratio(self, index: int) -> tuple[int, int]:
        """The value in the unit, as two whole numbers: their quotient is rounded once."""
        if index in (0, self.count - 1):
            return (self.stop if index else self.start).as_integer_ratio()
        if not self.logarithmic:
            steps, (a, c), (b, d) = self.count - 1, *map(Fraction.as_integer_ratio, (self.start, self.stop))
            return a * d * (steps - index) + b * c * index, c * d * steps
        growth = DIGITS.power(_decimal(self.stop / self.start), Decimal(index) / (self.count - 1))
        return (self.start * Fraction(growth)).as_integer_ratio()

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
    *texts, count = parts[-3:]
    ends = [_end(name, text) for text in texts]
    unit = ends[1][1] or ends[0][1]
    start, stop = (_in_unit(name, text, *end, unit) for text, end in zip(texts, ends, strict=True))
    if logarithmic and start * stop <= 0:
        raise UsageError(f"`{name}`: logarithmic steps need ends of the same sign, and not 0")
    is_rounded = not all(map(_DECIMAL.match, texts))
    with suppress(InvalidOperation):
        number = Decimal(count)
        if number.is_finite() and number == int(number) and 1 <= number <= MOST:
            return Range(start, stop, int(number), unit, is_rounded, logarithmic)
    raise UsageError(f"`{name}`: read {shown(count)}, expected a COUNT from 1 to {MOST:.0e}")


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


def _in_unit(name: str, text: str, number: Fraction, given: str, wanted: str) -> Fraction:
    """A number of one unit in another, but for the rounding of a float where pi stands between them."""
    if given == wanted or (number == 0 and not given):
        return number
    if not given:
        raise UsageError(f"`{name}`: {shown(text)} has no unit", hint=f"write `{text} {wanted}`")
    unit, other = parse_unit(given), parse_unit(wanted)
    if unit.dimension != other.dimension:
        raise UsageError(f"`{name}`: `{given}` and `{wanted}` do not measure the same")
    if unit.pi_power == other.pi_power:
        return number * unit.factor / other.factor
    return Fraction(unit.si(number)) / Fraction(other.scale)
