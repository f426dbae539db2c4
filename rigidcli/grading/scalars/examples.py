"""Answers made from the key of a number: right in other spellings and units, and wrong by each mistake."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rigidcli.errors import ValueProblem
from rigidcli.grading.example import Example
from rigidcli.grading.numbers import NOISE, read_written
from rigidcli.grading.scalars.key import Key
from rigidcli.grading.scalars.mistakes import explaining
from rigidcli.grading.scalars.near import is_near
from rigidcli.grading.units import read_unit, scale_in
from rigidcli.model.units import MASS

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
    yield from _right(key)
    yield from _times_a_factor(key)
    yield from _with_too_few_figures(key)
    yield from _in_wrong_units(key)


def _right(key: Key) -> Iterator[Example]:
    own, name = key.unit.scale, key.unit.text
    text = _typed(key, key.reference / own)
    itself = _joined(text, name)
    yield Example("the key", itself)
    yield Example("with another minus sign", itself.replace("-", "\N{MINUS SIGN}"))
    mantissa, _, power = _typed(key, key.reference / own, "e").partition("e")
    yield Example("with a power of ten", _joined(f"{mantissa}*10^{int(power)}", name))
    if not key.required:
        yield Example("without a unit", _typed(key, key.reference / key.plain))
    if name[:1].isalpha():
        yield Example("without a blank before the unit", f"{text}{name}")
    if key.tolerance.significant_figures is None:
        yield Example("as an expression", _joined(f"({text})/4 + 3*({text})/4", name))
    if key.period is not None and key.tolerance.figures in ("value", "at_least"):
        for sign in (-1, 1):
            away = (key.reference + sign * key.period) / own
            yield Example("a period away", _joined(_typed(key, away), name))
    for unit, scale in _other_units(key):
        yield Example(f"in {unit}", _joined(_typed(key, key.reference / scale), unit))


def _times_a_factor(key: Key) -> Iterator[Example]:
    own = key.unit.scale
    for code, factor in key.mistakes:
        number = factor * (key.reference / own)
        if not math.isfinite(number):
            continue
        text = _joined(_typed(key, number), key.unit.text)
        written = read_written(text)
        if explaining(key, written, own) == {code} and not is_near(key, written.value, own):
            yield Example(f"times {factor:.6g}", text, code)


def _with_too_few_figures(key: Key) -> Iterator[Example]:
    own, code = key.unit.scale, "too_few_sig_figs"
    number = key.reference / own
    if key.figures is None or key.figures == 1 or number == 0:
        return
    text = _joined(f"{number:.{key.figures - 2}e}", key.unit.text)
    written = read_written(text)
    if is_near(key, written.value, own) or explaining(key, written, own) == {code}:
        yield Example("with a figure too few", text, code)


def _in_wrong_units(key: Key) -> Iterator[Example]:
    own = key.unit.scale
    number = key.reference / own
    text = _typed(key, number)
    if key.required and key.reference:
        yield Example("without its unit", text, "unit_missing")
    for unit, scale in _other_units(key):
        if abs(scale / own - 1) > NOISE and not is_near(key, number, scale):
            yield Example(f"in {unit} without conversion", _joined(text, unit), "wrong_unit_right_number")
    stranger = "kg" if key.unit.dimension != MASS else "m"
    yield Example(f"in {stranger}", _joined(text, stranger), "unit_incompatible")


def _typed(key: Key, number: float, form: str = "g") -> str:
    """A number with the figures that are asked for, or else all that it has."""
    if key.figures is None:
        return f"{number:.17g}" if form == "g" else f"{number:.16e}"
    return f"{number:.{16 if key.tolerance.figures == 'at_least' else key.figures - 1}e}"


def _joined(number: str, unit: str) -> str:
    return f"{number} {unit}".rstrip()


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
