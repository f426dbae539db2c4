"""What a question for a number or a quantity is judged by: the number, its unit, and how it is compared.

A literal key is read as an answer is; one from a document comes as a float, in the unit of the report.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from rigidcli.errors import ValueProblem, at, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.numbers import NOISE, read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import Tolerance
from rigidcli.grading.scalars.factors import factors
from rigidcli.grading.units import PERCENT, read_unit, scale_in
from rigidcli.model.units import ANGLE, DIMENSIONLESS, Unit, parse_unit

MOST_PERIODS = 1e6
"""Periods away from zero beyond which no number is reduced: its digits say nothing of the rest."""

PURE = Unit("", Fraction(1), 0, DIMENSIONLESS)


@dataclass(frozen=True, slots=True)
class Key:
    """The right number, in SI units, and how an answer is held against it.

    `unit` is that in which the key was written; an answer without one is in units of `plain`, unless a unit
    is `required`. `period` (SI) is that of the option `modulo`. A reference below `noise` (SI) may be zero.
    `mistakes` are codes, each with the factor by which the mistake changes the reference.
    """

    reference: float
    unit: Unit
    plain: float
    required: bool
    tolerance: Tolerance
    period: float | None
    noise: float
    mistakes: tuple[tuple[str, float], ...]

    @property
    def figures(self) -> int | None:
        """Significant figures that must be written; None where the value alone counts."""
        return None if self.tolerance.figures == "value" else self.tolerance.significant_figures

    @property
    def told(self) -> str:
        """The reference, for those who may read it."""
        digits = max(8, self.tolerance.significant_figures or 0)
        return f"expected {self.reference / self.unit.scale:.{digits}g} {self.unit.text}".rstrip()


def read_key(asked: Asked) -> Key:
    """The number that is asked for. Raises ValueProblem where there is none, or the options do not fit it."""
    question, tolerance = asked.question, asked.question.tolerance
    literal = asked.report is None
    value, unit = _literal(asked.value, question.kind) if literal else _computed(asked.value, asked.unit)
    if tolerance.figures != "value" and tolerance.significant_figures is None:
        raise ValueProblem("how the figures count is told, but not how many: give `significant_figures`")
    reference = value * unit.scale
    if not math.isfinite(reference) or (value and not reference):
        raise ValueProblem("the number is beyond the range of SI units")
    plain = 1.0 if literal else unit.scale
    with at("modulo"):
        period = None if question.modulo is None else _period(question.modulo, unit, plain)
        if period is not None and abs(reference) > MOST_PERIODS * period:
            raise ValueProblem("the number is too many periods from zero")
    needless = question.kind == "number" or unit.dimension in (DIMENSIONLESS, ANGLE)
    return Key(
        reference,
        unit,
        plain,
        question.unit == "required" and not needless,
        tolerance,
        period,
        NOISE if unit.dimension == ANGLE and not literal else 0.0,  # a radian is the scale of an angle
        tuple(factors(unit.dimension, asked.path, unknown=literal and not unit.text)),
    )


def _literal(tree: Tree, kind: str | None) -> tuple[float, Unit]:
    """A number and its unit, read as an answer is."""
    try:
        written = read_written(tree)
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


def _period(modulo: Any, unit: Unit, plain: float) -> float:
    """The period in SI units."""
    try:
        written = read_written(str(modulo))
        own = None if written.unit is None else read_unit(written.unit, unit)
    except Unreadable as unreadable:
        raise ValueProblem(f"read {shown(modulo)}, which {CODES[unreadable.finding.code]}") from None
    period = written.value * (plain if own is None else scale_in(own, unit.dimension))
    if not 0 < period < math.inf:
        raise ValueProblem(f"read {shown(modulo)}, expected a period above zero")
    return period
