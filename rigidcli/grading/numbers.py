"""Numbers in answers: read as typed, with the figures that were written, and compared."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import RELATIVE, Tolerance
from rigidcli.model.units import Unit, check_dimension, parse_unit, split_quantity
from rigidcli.symbolic.expression import parse

LONGEST = 400
"""Characters of a number."""

MOST_ENTRIES = 10_000
"""Numbers in one answer that is a list."""

NOISE = 1e-12
"""A component of the reference below this, in units of its largest, is zero."""

ROUNDING = 1e-9
"""Relative slack of every comparison, so that a value on the very limit is accepted."""

_DECIMAL = re.compile(r"\s*([-+]?)([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,4})?\s*")
_NOT_FINITE = re.compile(r"\s*[-+]?\.?(inf|infinity|nan)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Written:
    """A number as it was typed: its `value` in its `unit` (None where none was typed).

    `mantissa` has the digits before a power of ten; it is empty for an expression such as `2*pi`.
    """

    value: float
    mantissa: str = ""
    unit: str | None = None

    @property
    def figures(self) -> int:
        """Significant figures that are written, trailing zeros among them; 0 for an expression."""
        return len(self.mantissa.replace(".", "").lstrip("0")) or len(self.mantissa.replace(".", "")[:1])

    @property
    def ambiguous(self) -> bool:
        """Whether zeros at the end of a whole number leave open how many figures are meant."""
        return "." not in self.mantissa and self.mantissa.endswith("0") and self.value != 0

    @property
    def least_figures(self) -> int:
        """Significant figures that are certainly meant."""
        return len(self.mantissa.strip("0")) if self.ambiguous else self.figures


def read_written(answer: Tree, place: str = "") -> Written:
    """A decimal number or an expression of numbers, with or without a unit. Raises Unreadable."""
    if not isinstance(answer, str):
        code = "not_a_number" if answer is None or isinstance(answer, list | dict) else "parse_error"
        raise Unreadable(code, f"read {shown(answer)}", place=place)
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters", place=place)
    text = answer.replace("\N{MINUS SIGN}", "-")
    if (decimal := _DECIMAL.fullmatch(text)) is not None:
        return Written(_finite(float(text), place), decimal[2])
    if _NOT_FINITE.fullmatch(text):
        raise Unreadable("not_a_finite_number", f"read {shown(answer)}", place=place)
    quantity = split_quantity(text)
    if quantity is not None:
        decimal = _DECIMAL.fullmatch(quantity[0])
        if decimal is not None:
            return Written(_finite(float(quantity[0]), place), decimal[2], quantity[1])
    try:
        return Written(_finite(parse(text).evaluate({}), place))
    except ExpressionError as error:
        raise Unreadable("not_a_number", f"read {shown(answer)}: {error.message}", place=place) from None


def _finite(value: float, place: str) -> float:
    if not math.isfinite(value):
        raise Unreadable("not_a_finite_number", "it is beyond the range of numbers", place=place)
    return value


def read_number(answer: Tree, unit: Unit | None = None, place: str = "") -> float:
    """The SI value of a number; one without a unit of its own is in SI units. Raises Unreadable.

    A unit must fit `unit`; where that is None, none may be given.
    """
    written = read_written(answer, place)
    return written.value if written.unit is None else in_si(written, unit, place)


def in_si(written: Written, unit: Unit | None, place: str = "") -> float:
    """The SI value of a number that has a unit, which must fit. Raises Unreadable."""
    assert written.unit is not None
    try:
        own = parse_unit(written.unit)
        if unit is None:
            raise Unreadable("unit_incompatible", f"read {shown(written.unit)}, expected none", place=place)
        check_dimension(own.text, own.dimension, unit.dimension)
    except ValueProblem:
        raise Unreadable("unit_incompatible", f"read {shown(written.unit)}", place=place) from None
    return _finite(written.value * own.scale, place)


def read_list(answer: Tree, unit: Unit | None = None, length: int | None = None, place: str = "") -> Floats:
    """A list of numbers in SI units. Raises Unreadable."""
    if not isinstance(answer, list) or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers", place=place)
    if length is not None and len(answer) != length:
        raise Unreadable("wrong_shape", f"read {len(answer)} numbers, expected {length}", place=place)
    prefix = f"{place} " if place else ""
    return np.array([read_number(each, unit, f"{prefix}entry {k + 1}") for k, each in enumerate(answer)])


def unit_of(text: str) -> Unit | None:
    """The unit of a reference, None for a pure number."""
    return parse_unit(text) if text else None


def margin(reference: float, tolerance: Tolerance) -> float:
    """How far an answer may be from a reference that is not zero: the largest of what is allowed."""
    allowed = [tolerance.absolute or 0.0]
    if tolerance.significant_figures is not None and reference:
        power = math.floor(math.log10(abs(reference))) + 1 - tolerance.significant_figures
        allowed.append(0.5 * 10.0**power)
    relative = tolerance.relative
    if relative is None and tolerance.absolute is None and tolerance.significant_figures is None:
        relative = RELATIVE
    allowed.append((relative or 0.0) * abs(reference))
    return max(allowed) * (1 + ROUNDING) + ROUNDING * NOISE * abs(reference)


def is_near(value: float, reference: float, tolerance: Tolerance) -> bool:
    """Whether a number is what is expected."""
    return abs(value - reference) <= margin(reference, tolerance)


def are_near(values: Floats, reference: Floats, tolerance: Tolerance) -> np.ndarray:
    """Which entries of an array are what is expected.

    Each is judged by its own size; one that is zero, but for rounding, by that of the largest.
    """
    largest = float(np.abs(reference).max(initial=0.0))
    allowed = [
        margin(entry if abs(entry) > NOISE * largest else largest, tolerance) for entry in np.ravel(reference)
    ]
    near: np.ndarray = np.abs(values - reference) <= np.reshape(allowed, np.shape(reference))
    return near
