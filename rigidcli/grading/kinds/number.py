"""Numbers and quantities: the value, the unit, and the figures that are written.

An answer is compared in the unit in which it was typed, so that half of one in the last figure means what
the student meant by it. Mistakes are factors: the reference times each of them is what comes of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.kinds import Example
from rigidcli.grading.mistakes import explained
from rigidcli.grading.numbers import (
    NOISE,
    Written,
    margin,
    read_unit,
    read_written,
    scale_in,
)
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.question import Tolerance
from rigidcli.model.units import ANGLE, DIMENSIONLESS, MASS, Dimension, Unit, parse_unit

MOST_PERIODS = 1e6
"""Periods away from zero beyond which no answer is reduced: its digits say nothing of the rest."""

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
    def own(self) -> tuple[float, float]:
        """The units in which the number of the key may be known."""
        return self.unit.scale, self.plain

    @property
    def told(self) -> str:
        """The reference, for those who may read it."""
        digits = max(8, self.tolerance.significant_figures or 0)
        return f"expected {self.reference / self.unit.scale:.{digits}g} {self.unit.text}".rstrip()


# --- the key


def read_key(asked: Asked) -> Key:
    """The number that is asked for. Raises ValueProblem where there is none, or the options do not fit it."""
    question, tolerance = asked.question, asked.question.tolerance
    literal = asked.report is None
    value, unit = _literal(asked.value) if literal else _computed(asked.value, asked.unit)
    kind = question.kind or ("quantity" if unit.text else "number")
    if literal and kind == "quantity" and not unit.text:
        raise ValueProblem(
            "a quantity has a unit, as `5 cm`, and this has none", hint="a pure number is of kind `number`"
        )
    if literal and kind == "number" and unit.text:
        raise ValueProblem("a pure number has no unit, and this has one", hint="make it of kind `quantity`")
    if tolerance.figures != "value" and tolerance.significant_figures is None:
        raise ValueProblem("how the figures count is told, but not how many: give `significant_figures`")
    reference = value * unit.scale
    if not math.isfinite(reference) or (value and not reference):
        raise ValueProblem("the number is beyond the range of SI units")
    plain = 1.0 if literal else unit.scale
    period = None if question.modulo is None else _period(question.modulo, unit, plain)
    if period is not None and abs(reference) > MOST_PERIODS * period:
        raise ValueProblem("the number is too many periods from zero").below("modulo")
    needless = unit.dimension in (DIMENSIONLESS, ANGLE)
    return Key(
        reference,
        unit,
        plain,
        kind == "quantity" and question.unit == "required" and not needless,
        tolerance,
        period,
        NOISE if unit.dimension == ANGLE and not literal else 0.0,  # a radian is the scale of an angle
        tuple(_mistakes(unit.dimension, asked.path, unknown=literal and not unit.text)),
    )


def _literal(tree: Tree) -> tuple[float, Unit]:
    """A number and its unit, read as an answer is."""
    try:
        written = read_written(tree)
    except Unreadable as unreadable:
        raise ValueProblem(f"the key {CODES[unreadable.finding.code]}") from None
    if written.unit is None:
        return written.value, PURE
    unit = read_unit("%") if written.unit.strip() == "%" else parse_unit(written.unit)
    return written.value, unit


def _computed(value: Any, unit: str) -> tuple[float, Unit]:
    if value is None:
        raise ValueProblem("the document has no such value")
    try:
        number = float("" if isinstance(value, bool | np.bool_ | str | np.ndarray) else value)
    except (TypeError, ValueError):
        raise ValueProblem("what is asked for is not a number") from None
    if not math.isfinite(number):
        raise ValueProblem("what is asked for is not a finite number")
    return number, parse_unit(unit) if unit else PURE


def _period(modulo: Any, unit: Unit, plain: float) -> float:
    """The period in SI units."""
    try:
        written = read_written(str(modulo))
        own = None if written.unit is None else read_unit(written.unit, unit)
    except Unreadable as unreadable:
        raise ValueProblem(f"read {shown(modulo)}, which {CODES[unreadable.finding.code]}").below(
            "modulo"
        ) from None
    try:
        period = written.value * (plain if own is None else scale_in(own, unit.dimension))
    except ValueProblem as problem:
        raise problem.below("modulo") from None
    if not 0 < period < math.inf:
        raise ValueProblem(f"read {shown(modulo)}, expected a period above zero").below("modulo")
    return period


# --- mistakes

PRECESSION = ("rate", "precession", "psi", "phi_dot")
"""Parts of the names of results whose sign is the sense of a precession ..."""

NO_PRECESSION = ("growth", "error")
"""... and of those whose sign is not."""

FACTORS = (2, 3, 4, 5, 6, 8, 3 / 2, 4 / 3, 5 / 2, math.sqrt(2), math.sqrt(3), math.pi)
"""Numbers that get lost in a formula; their inverses do, too."""

MOST_TENS = 12
"""Powers of ten that a slip may be off by."""

CONVERSIONS: dict[str, tuple[float, ...]] = {
    "length": (2.54, 0.0254, 25.4, 0.3048, 0.9144, 1.609344, 1609.344),
    "time": (60, 3600, 24, 86_400, 31_557_600),
    "mass": (0.45359237,),
}
"""Units of everyday life in SI units, by what they measure: inch, foot, yard, mile; minute to year; pound."""

KILOMETRES_PER_HOUR = 3.6
TURNS_PER_MINUTE = 30 / math.pi
WEIGHTS = (9.80665, 4.184)
"""A kilogram's weight in newtons, a calorie in joules."""


def _mistakes(dimension: Dimension, path: tuple[str, ...], *, unknown: bool) -> Iterator[tuple[str, float]]:
    """Codes and factors; where the dimension is `unknown`, those of all dimensions."""
    yield ("precession_sense" if _is_precession(path) else "sign_error"), -1.0
    for power in range(1, MOST_TENS + 1):
        yield from _either_way("power_of_ten", 10.0**power)
    for factor in FACTORS:
        yield from _either_way("constant_factor", factor)
    rate = dimension.time == -1 and not (dimension.mass or dimension.length)
    if dimension.angle or rate or dimension == DIMENSIONLESS:
        yield from _either_way("degrees_radians", 180 / math.pi)
    if rate or unknown or dimension == Dimension(time=1):
        yield from _either_way("frequency_vs_angular_frequency", 2 * math.pi)
    if rate or unknown:
        yield from _either_way("unit_conversion", TURNS_PER_MINUTE)
    if (dimension.length and dimension.time) or unknown:
        yield from _either_way("unit_conversion", KILOMETRES_PER_HOUR)
    if dimension.mass and dimension.length and dimension.time:
        for factor in WEIGHTS:
            yield from _either_way("unit_conversion", factor)
    for name, factors in CONVERSIONS.items():
        exponent = 1 if unknown else abs(getattr(dimension, name))
        for factor in factors:
            for power in range(1, exponent + 1):
                yield from _either_way("unit_conversion", factor**power)


def _either_way(code: str, factor: float) -> tuple[tuple[str, float], tuple[str, float]]:
    return (code, factor), (code, 1 / factor)


def _is_precession(path: tuple[str, ...]) -> bool:
    last = path[-1] if path else ""
    if any(part in last for part in NO_PRECESSION):
        return False
    names = PRECESSION if path[:1] == ("precess",) else PRECESSION[2:]
    return any(part in last for part in names)


# --- judging


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a number as it was typed. Raises Unreadable."""
    written = read_written(answer)
    if key.tolerance.significant_figures is not None and not written.mantissa:
        raise Unreadable("not_a_number", "significant figures are asked for: write a decimal number")
    finding = _finding(key, written)
    return correct() if finding is None else wrong(replace(finding, reference=key.told))


def _finding(key: Key, written: Written) -> Finding | None:
    """What is wrong with an answer. Raises Unreadable for a unit that is none."""
    if written.unit is None:
        if key.required and (written.value or key.reference):
            return Finding("unit_missing")
        scale = key.plain
    else:
        unit = read_unit(written.unit, key.unit)
        try:
            scale = scale_in(unit, key.unit.dimension)
        except ValueProblem as problem:
            return Finding(_misfit(key, written, unit), detail=problem.message)
    return _figures(key, written) if _is_near(key, written.value, scale) else _mistake(key, written, scale)


def _misfit(key: Key, written: Written, unit: Unit) -> str:
    """The code of an answer in a unit that does not fit: a hertz and a radian per second are told apart."""
    given, asked = unit.dimension, key.unit.dimension
    if given.cycle != asked.cycle and given._replace(angle=0, cycle=0) == asked._replace(angle=0, cycle=0):
        turn = 2 * math.pi if given.cycle else 1 / (2 * math.pi)
        if _is_near(key, written.value, unit.scale):
            return "wrong_unit_right_number"
        if _is_near(key, written.value, unit.scale * turn):
            return "frequency_vs_angular_frequency"
    return "unit_incompatible"


def _figures(key: Key, written: Written) -> Finding | None:
    """What is wrong with the figures of an answer that has the right value."""
    asked, counting = key.tolerance.significant_figures, key.tolerance.figures
    if asked is None or counting == "value" or key.reference == 0:
        return None
    if written.figures < asked:
        return Finding("too_few_sig_figs")
    if counting != "at_least" and written.least_figures > asked:
        detail = f"{written.figures} significant figures are written, expected {asked}"
        return Finding("wrong_shape", detail=detail)
    return Finding("sig_figs_ambiguous") if counting == "strict" and written.ambiguous else None


def _gap(key: Key, number: float, target: float, scale: float) -> float:
    """How far a number is from its target, both in a unit of `scale`; infinite for what is beyond numbers."""
    gap = number - target
    if not math.isfinite(gap):
        return math.inf
    if key.period is None:
        return gap
    period = key.period / scale
    return math.remainder(gap, period) if 0 < period >= abs(number) / MOST_PERIODS else math.inf


def _is_near(key: Key, number: float, scale: float, factor: float = 1.0) -> bool:
    """Whether a number, in a unit of `scale`, is the reference times a factor, by the tolerance of the key.

    A factor below 1 takes an absolute tolerance with it, which would cover all that is small.
    """
    if number == 0 and abs(key.reference) <= key.noise:
        return True
    target = factor * (key.reference / scale)
    gap = _gap(key, number, target, scale)
    if gap == math.inf or (target == 0.0 and key.reference != 0.0):
        return False
    size, rounding = target, 0.0
    if key.period is not None:
        size = min(abs(number - gap), key.period / scale)
        if gap != number - target:
            rounding = NOISE * max(abs(number), abs(target))
    return abs(gap) <= margin(size, key.tolerance, scale / key.plain / min(1.0, abs(factor))) + rounding


def _mistake(key: Key, written: Written, scale: float) -> Finding:
    """What is wrong with an answer that has not the right value."""
    codes = _explaining(key, written, scale)
    finding = explained(((code, True) for code in codes), bool, "outside_tolerance")
    if finding.code == "unit_missing":
        return replace(finding, detail="without a unit, a number is in SI units")
    return finding


def _explaining(key: Key, written: Written, scale: float) -> set[str]:
    """The codes of all mistakes that lead from the reference to the answer.

    With the right number in a wrong unit, the factor between the units is no other mistake.
    """
    mistakes = [*key.mistakes]
    if written.unit is not None:
        if any(abs(scale / own - 1) > NOISE and _is_near(key, written.value, own) for own in key.own):
            return {"wrong_unit_right_number"}
        mistakes += _wrong_way(scale / key.plain)
    elif key.unit.dimension != ANGLE and _is_near(key, written.value, key.unit.scale):
        return {"unit_missing"}
    least = _least_change(key, scale)
    codes = {
        code
        for code, factor in mistakes
        if abs(factor - 1) > least and _is_near(key, written.value, scale, factor)
    }
    return codes | {_imprecise(key, written)} if _is_rounded(key, written, scale) else codes


def _least_change(key: Key, scale: float) -> float:
    """The relative change of the reference below which a mistake is not told from any wrong number."""
    reference = key.reference / scale
    if reference == 0 or not math.isfinite(reference):
        return math.inf
    return 2 * margin(reference, key.tolerance, scale / key.plain) / abs(reference)


def _wrong_way(ratio: float) -> Iterator[tuple[str, float]]:
    """Multiplying by a unit where one divides, unless that is off by a power of ten."""
    squared = ratio * ratio
    tens = math.log10(squared) if 0 < squared < math.inf else 0.0
    if abs(tens - round(tens)) > NOISE:
        yield "unit_conversion", squared


def _is_rounded(key: Key, written: Written, scale: float) -> bool:
    """Whether the answer is the reference, rounded to the digits that are written."""
    gap = _gap(key, written.value, key.reference / scale, scale)
    return abs(gap) <= written.half_a_digit * (1 + NOISE)


def _imprecise(key: Key, written: Written) -> str:
    asked = key.tolerance.significant_figures
    counts = asked is not None and key.tolerance.figures != "value" and written.figures < asked
    return "too_few_sig_figs" if counts else "precision_insufficient"


# --- examples

UNITS = (
    "%", "m", "cm", "mm", "km", "in", "ft", "kg", "g", "lb", "s", "ms", "min", "h", "yr", "rad", "deg", "rev",
    "rad/s", "1/s", "rpm", "deg/s", "rev/s", "Hz", "kHz", "m/s", "km/h", "cm/s", "m/s^2", "cm/s^2", "kg m^2",
    "g cm^2", "kg m^2/s", "g cm^2/s", "N", "kN", "dyn", "N m", "J", "kJ", "erg", "W", "kW", "Pa", "bar",
    "kg/m^3", "g/cm^3", "N/m", "m^2", "cm^2", "m^3", "L", "kg m/s",
)  # fmt: skip
"""Units in which a student may give an answer."""

TYPABLE = (1e-290, 1e290)
"""Sizes of numbers that are typed with all their digits."""


def examples(key: Key) -> Iterator[Example]:
    """The key as typed, in other units and spellings, and under each mistake that looks like no other."""
    for what, text in _right(key):
        yield Example(what, text)
    for what, text, code in _wrong(key):
        yield Example(what, text, code)


def _right(key: Key) -> Iterator[tuple[str, str]]:
    own, counting = key.unit.scale, key.tolerance.figures
    number, name = key.reference / own, key.unit.text
    text = _typed(key, number)
    yield "the key", f"{text} {name}".strip()
    yield "with another minus sign", f"{text} {name}".strip().replace("-", "\N{MINUS SIGN}")
    mantissa, _, power = _typed(key, number, "e").partition("e")
    yield "with a power of ten", f"{mantissa}*10^{int(power)} {name}".strip()
    if not key.required:
        yield "without a unit", _typed(key, key.reference / key.plain)
    if name[:1].isalpha():
        yield "without a blank before the unit", f"{text}{name}"
    if key.tolerance.significant_figures is None:
        yield "as an expression", f"({text})/4 + 3*({text})/4 {name}".strip()
    if key.period is not None and counting in ("value", "at_least"):
        for sign in (-1, 1):
            yield "a period away", f"{_typed(key, (key.reference + sign * key.period) / own)} {name}".strip()
    for unit, scale in _other_units(key):
        yield f"in {unit}", f"{_typed(key, key.reference / scale)} {unit}"


def _wrong(key: Key) -> Iterator[tuple[str, str, str]]:
    own, name, asked = key.unit.scale, key.unit.text, key.tolerance.significant_figures
    number = key.reference / own
    for code, factor in key.mistakes:
        text = f"{_typed(key, factor * number)} {name}".strip()
        written = read_written(text)
        if _explaining(key, written, own) == {code} and not _is_near(key, written.value, own):
            yield f"times {factor:.6g}", text, code
    if asked is not None and asked > 1 and key.tolerance.figures != "value" and number:
        text = f"{number:.{asked - 2}e} {name}".strip()
        written = read_written(text)
        if _is_near(key, written.value, own) or _explaining(key, written, own) == {"too_few_sig_figs"}:
            yield "with a figure too few", text, "too_few_sig_figs"
    if key.required and key.reference:
        yield "without its unit", _typed(key, number), "unit_missing"
    for unit, scale in _other_units(key):
        if abs(scale / own - 1) > NOISE and not _is_near(key, number, scale):
            yield f"in {unit} without conversion", f"{_typed(key, number)} {unit}", "wrong_unit_right_number"
    stranger = "kg" if key.unit.dimension != MASS else "m"
    yield f"in {stranger}", f"{_typed(key, number)} {stranger}", "unit_incompatible"


def _typed(key: Key, number: float, form: str = "g") -> str:
    """A number with the figures that are asked for, or else all that it has."""
    asked, counting = key.tolerance.significant_figures, key.tolerance.figures
    if asked is None or counting == "value":
        return f"{number:.17g}" if form == "g" else f"{number:.16e}"
    return f"{number:.{16 if counting == 'at_least' else asked - 1}e}"


def _other_units(key: Key) -> Iterator[tuple[str, float]]:
    """Other units that fit, and in which the reference is neither too large nor too small to be typed."""
    for text in UNITS:
        unit = read_unit(text)
        try:
            scale = scale_in(unit, key.unit.dimension)
        except ValueProblem:
            continue
        size = abs(key.reference / scale)
        if text != key.unit.text and (size == 0 or TYPABLE[0] < size < TYPABLE[1]):
            yield text, scale
