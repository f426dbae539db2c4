"""Numbers and quantities: the value, the unit, and the figures that are typed."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from rigidcli.check.base import Asked, Finding, Kind, Outcome, Reading, Tree, Unreadable
from rigidcli.check.mistakes import TURN, common_factor
from rigidcli.check.numbers import (
    NOISE,
    PURE,
    Number,
    as_typed,
    beside,
    is_short,
    margin,
    scale_in,
    too_few,
    with_hint,
)
from rigidcli.check.question import Tolerance
from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit, parse_unit


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The right number in SI units, the unit of an answer without one, and the tolerance.

    A reference of zero is compared beside a `noise` (SI). A literal key has no `path`.
    """

    reference: float
    unit: Unit
    tolerance: Tolerance
    needs_unit: bool
    noise: float
    path: tuple[str, ...]

    def is_near(self, value: float, scale: float) -> bool:
        """Whether an SI value is within the tolerance, where one of the typed unit is `scale`."""
        allowed = margin(self.reference, self.tolerance, 0.0, scale)
        return abs(value - self.reference) <= (allowed if self.reference else allowed + self.noise)


class Quantity(Kind):
    """A number, with a unit where it is a `quantity`."""

    options: ClassVar[frozenset[str]] = frozenset({"products", "unit"})

    def __init__(self, name: str) -> None:
        self.name = name  # type: ignore[misc]  # two kinds of the same class

    def key(self, asked: Asked) -> Key:
        """The number that is asked for. Raises ValueProblem."""
        question = asked.question
        value, unit = _literal(asked.value) if asked.report is None else _computed(asked.value, asked.unit)
        if asked.report is None and (question.kind == "quantity") is not bool(unit.text):
            has_unit, kind = ("has one", "quantity") if unit.text else ("has none", "number")
            hint = f"make it of kind `{kind}`"
            raise ValueProblem(f"a quantity has a unit, a number has no unit, and this {has_unit}", hint=hint)
        is_product = (
            len(asked.path) > 2 and asked.path[-3].startswith("tensor") and asked.path[-2] != asked.path[-1]
        )
        reference = value * unit.scale * (-1 if question.products == "plus" and is_product else 1)
        if not math.isfinite(reference) or (value and not reference):
            raise ValueProblem("the number is beyond the range of SI units")
        noise = NOISE * max(beside(asked) * unit.scale, asked.report is not None and unit.dimension == ANGLE)
        needless = unit.dimension in (DIMENSIONLESS, ANGLE)
        return Key(
            0.0 if abs(reference) <= noise else reference,
            unit,
            question.tolerance,
            question.unit == "required" and not needless,
            noise,
            asked.path,
        )

    def read(self, key: Key, answer: Tree) -> Reading:
        """A number in its own unit, or else in that of the key. Raises Unreadable."""
        number = as_typed(answer, key.unit)
        if key.tolerance.significant_figures is not None and not number.mantissa:
            raise Unreadable("not_a_number", "significant figures are asked for: write a decimal number")
        bare = number.unit is None and key.unit.text and not key.needs_unit
        return Reading(number, f"{number.read_as} {key.unit.text}" if bare else number.read_as)

    def judge(self, key: Key, value: Number) -> Outcome:
        """The value first, then its unit and its figures."""
        try:
            scale = value.scale if value.unit is None else scale_in(value.unit, key.unit.dimension)
        except ValueProblem as problem:
            return Outcome.earning(0.0, _of_misfit(key, value, with_hint(problem)))
        number = replace(value, value=value.typed * scale, scale=scale)
        is_right = key.is_near(number.value, scale)
        if is_right and too_few(number, key.tolerance):
            return Outcome.earning(0.0, Finding("too_few_sig_figs"))
        unitless = [Finding("unit_missing")] if key.needs_unit and value.unit is None else []
        if is_right:
            nothing = value.typed == 0  # zero is zero in any unit
            return Outcome.earning(0.0, *unitless) if unitless and not nothing else Outcome.correct()
        if number.thousands is not None and key.is_near(number.thousands, scale):
            return Outcome.review(
                "right if its comma separates thousands, and a comma is read as a decimal comma"
            )
        return Outcome.earning(0.0, *unitless, Finding(self._slip(key, number)))

    def _slip(self, key: Key, number: Number) -> str:
        """The code of the one mistake that makes this number of the key."""
        if is_short(number, key.reference, key.tolerance):
            return "too_few_sig_figs"
        if number.unit is not None and key.is_near(number.typed * key.unit.scale, key.unit.scale):
            return "wrong_unit_right_number"
        slack = margin(key.reference, key.tolerance, 0.0, number.scale) / abs(key.reference or 1)
        if not key.reference or slack >= 1:
            return "outside_tolerance"
        code = common_factor(number.value / key.reference, key.unit, key.path, max(slack, NOISE))
        return code or "outside_tolerance"

    def typed(self, key: Key) -> Tree:
        """The key with all its digits, in its unit."""
        return f"{key.reference / key.unit.scale!r} {key.unit.text}".strip()


def _of_misfit(key: Key, number: Number, detail: str) -> Finding:
    """What is wrong with a unit of another dimension: hertz is not radians per second."""
    given, asked = number.unit.dimension if number.unit else DIMENSIONLESS, key.unit.dimension
    if given.cycle != asked.cycle and given._replace(angle=0, cycle=0) == asked._replace(angle=0, cycle=0):
        if key.is_near(number.typed * number.scale, number.scale):
            return Finding("wrong_unit_right_number")
        if key.is_near(number.typed * number.scale * (TURN if given.cycle else 1 / TURN), number.scale):
            return Finding("frequency_vs_angular_frequency")
    return Finding("unit_incompatible", detail=detail)


def _literal(tree: Tree) -> tuple[float, Unit]:
    """A number and its unit, read as an answer is. Raises ValueProblem."""
    try:
        number = as_typed(tree)
    except Unreadable as unreadable:
        raise ValueProblem(f"the key is no number: {unreadable.findings[0].detail}") from None
    return number.typed, number.unit or PURE


def _computed(value: Any, unit: str) -> tuple[float, Unit]:
    """A number of a report and its unit. Raises ValueProblem."""
    number = math.nan
    if not isinstance(value, bool | np.bool_ | str | list | dict | np.ndarray):
        with suppress(TypeError, ValueError):
            number = float(value)
    if not math.isfinite(number):
        raise ValueProblem("what is asked for is not a finite number")
    return number, parse_unit(unit) if unit else PURE
