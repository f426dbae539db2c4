"""Numbers and quantities: the key, what is near to it, and what mistakes make of it.

A literal key is read as an answer is; one from a document comes as a float, in the unit of the report. An
answer is compared in the unit in which it was typed, so that half of one in the last figure means what the
student meant by it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from rigidcli.errors import ValueProblem, at, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.grading.arrays.keys import is_product, size_beside
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.factors import DEGREES, factors
from rigidcli.grading.numbers import NOISE, Written, margin, narrowed, read_written, unnamed
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Tolerance
from rigidcli.grading.units import PERCENT, read_unit, scale_in

MOST_PERIODS = 1e6
"""Periods away from zero beyond which no number is reduced: its digits say nothing of the rest."""

PURE = Unit("", Fraction(1), 0, DIMENSIONLESS)


@dataclass(frozen=True, slots=True)
class Scalar:
    """An answer as it was typed, and the size of its unit in SI units."""

    written: Written
    scale: float


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The right number, in SI units, and how an answer is held against it.

    `unit` is that in which the key was written, in which an answer without one is read, too, unless a unit is
    `required`; an absolute tolerance is in units of `plain` (SI). `period` (SI) is that of the option
    `modulo`. A reference below `noise` (SI) may be zero. `path` is that of the result that is asked; of a
    literal key it is empty.
    """

    reference: float
    unit: Unit
    plain: float
    required: bool
    tolerance: Tolerance
    period: float | None
    noise: float
    path: tuple[str, ...]

    @property
    def figures(self) -> int | None:
        """Significant figures that must be written; None where the value alone counts."""
        return None if self.tolerance.figures == "value" else self.tolerance.significant_figures

    @property
    def told(self) -> str:
        """The reference, for those who may read it."""
        digits = max(8, self.tolerance.significant_figures or 0)
        return f"expected {self.reference / self.unit.scale:.{digits}g} {self.unit.text}".rstrip()

    def times(self, factor: float) -> Key:
        """The key of a number so many times as large."""
        tolerance = narrowed(self.tolerance, abs(factor))
        return replace(self, reference=factor * self.reference, tolerance=tolerance, noise=0.0)

    @property
    def factors(self) -> Iterator[tuple[str, float]]:
        """Codes, and the factors by which they make this number wrong."""
        return factors(self.unit.dimension, self.path, unknown=not self.path and not self.unit.text)

    def near(self, number: float, scale: float) -> bool:
        """Whether a number, in a unit of `scale`, is the reference, by the tolerance."""
        if max(abs(number * scale), abs(self.reference)) <= self.noise:
            return True
        target = self.reference / scale
        gap = self.gap(number, scale)
        if gap == math.inf or (target == 0.0 and self.reference != 0.0):
            return False
        size, rounding = target, 0.0
        if self.period is not None:
            size = min(abs(number - gap), self.period / scale)
            if gap != number - target:
                rounding = NOISE * max(abs(number), abs(target))
        return abs(gap) <= margin(size, self.tolerance, scale / self.plain) + rounding

    def gap(self, number: float, scale: float) -> float:
        """How far a number is from the reference, both in a unit of `scale`; infinite beyond numbers."""
        gap = number - self.reference / scale
        if not math.isfinite(gap):
            return math.inf
        if self.period is None:
            return gap
        period = self.period / scale
        return math.remainder(gap, period) if 0 < period >= abs(number) / MOST_PERIODS else math.inf

    @property
    def least_change(self) -> float:
        """The relative change of the reference below which a mistake is not told from any wrong number."""
        reference = self.reference / self.unit.scale
        if reference == 0 or not math.isfinite(reference):
            return math.inf
        return 2 * margin(reference, self.tolerance, self.unit.scale / self.plain) / abs(reference)


def read_key(asked: Asked) -> Key:
    """The number that is asked for. Raises ValueProblem where there is none, or the options do not fit it."""
    question, tolerance = asked.question, asked.question.tolerance
    literal = asked.report is None
    value, unit = _literal(asked.value, question.kind) if literal else _computed(asked.value, asked.unit)
    if tolerance.figures != "value" and tolerance.significant_figures is None:
        raise ValueProblem("how the figures count is told, but not how many: give `significant_figures`")
    if question.products == "plus" and is_product(asked.path):
        value = -value
    reference = value * unit.scale
    if not math.isfinite(reference) or (value and not reference):
        raise ValueProblem("the number is beyond the range of SI units")
    with at("modulo"):
        period = None if question.modulo is None else _period(question.modulo, unit)
        if period is not None and abs(reference) > MOST_PERIODS * period:
            raise ValueProblem("the number is too many periods from zero")
    needless = question.kind == "number" or unit.dimension in (DIMENSIONLESS, ANGLE)
    return Key(
        reference,
        unit,
        1.0 if literal else unit.scale,
        question.unit == "required" and not needless,
        tolerance,
        period,
        _noise(asked, unit),
        asked.path,
    )


def _noise(asked: Asked, unit: Unit) -> float:
    """The size (SI) below which a result is rounding noise: a radian is the scale of an angle."""
    if asked.report is None:
        return 0.0
    return NOISE * max(size_beside(asked) * unit.scale, 1.0 if unit.dimension == ANGLE else 0.0)


def _literal(tree: Tree, kind: str | None) -> tuple[float, Unit]:
    """A number and its unit, read as an answer is."""
    try:
        written = read_written(unnamed(tree))
    except Unreadable as unreadable:
        raise ValueProblem(f"the key {CODES[unreadable.finding.code]}") from None
    if written.unit is None:
        unit = PURE
    else:
        unit = PERCENT if written.unit.strip() == PERCENT.text else parse_unit(written.unit)
    if kind == "quantity" and not unit.text:
        raise ValueProblem(
            "a quantity has a unit, as `5 cm`, and this has none", hint="a pure number is of kind `number`"
        )
    if kind == "number" and unit.text:
        raise ValueProblem("a pure number has no unit, and this has one", hint="make it of kind `quantity`")
    return written.value, unit


def _computed(value: Any, unit: str) -> tuple[float, Unit]:
    """A number of a report and its unit."""
    if value is None:
        raise ValueProblem("the document has no such value")
    try:
        # Some of what is no number can be made one.
        number = None if isinstance(value, bool | np.bool_ | str | np.ndarray) else float(value)
    except (TypeError, ValueError):
        number = None
    if number is None:
        raise ValueProblem("what is asked for is not a number")
    if not math.isfinite(number):
        raise ValueProblem("what is asked for is not a finite number")
    return number, parse_unit(unit) if unit else PURE


def _period(modulo: Any, unit: Unit) -> float:
    """The period in SI units."""
    try:
        written = read_written(str(modulo))
        own = None if written.unit is None else read_unit(written.unit, unit)
    except Unreadable as unreadable:
        raise ValueProblem(f"read {shown(modulo)}, which {CODES[unreadable.finding.code]}") from None
    period = written.value * (unit.scale if own is None else scale_in(own, unit.dimension))
    if not 0 < period < math.inf:
        raise ValueProblem(f"read {shown(modulo)}, expected a period above zero")
    return period


# --- mistakes


def in_other_unit(key: Key, answer: Scalar) -> Iterator[Key]:
    """The key of the same number in the unit of the answer."""
    ratio = answer.scale / key.unit.scale
    if abs(ratio - 1) > NOISE:
        yield key.times(ratio)


def converted_twice(code: str) -> Callable[[Key, Scalar], Iterator[Key]]:
    """What makes the key that comes of multiplying by a unit where one divides, but for powers of ten."""

    def fits(key: Key, answer: Scalar) -> Iterator[Key]:
        ratio = answer.scale / key.unit.scale
        squared = ratio * ratio
        tens = math.log10(squared) if 0 < squared < math.inf else 0.0
        angle = any(abs(ratio / degrees - 1) <= NOISE for degrees in (DEGREES, 1 / DEGREES))
        if (code == "degrees_radians") == angle and abs(tens - round(tens)) > NOISE:
            yield key.times(squared)

    return fits


def rounded(*, too_few: bool) -> Callable[[Key, Scalar], Iterator[Key]]:
    """What makes the key rounded to the digits of the answer, if these are `too_few`, or as many as asked."""

    def fits(key: Key, answer: Scalar) -> Iterator[Key]:
        number = answer.written
        few = key.figures is not None and number.figures < key.figures
        if few == too_few and abs(key.gap(number.value, answer.scale)) <= number.half_a_digit * (1 + NOISE):
            yield replace(key, reference=number.value * answer.scale)

    return fits
