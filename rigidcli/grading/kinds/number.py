"""Numbers and quantities: the value, the unit, and the figures that are written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import MASS
from rigidcli.fields.units import Unit
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.factors import TURN
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.numbers import NOISE, Written, read_written, unnamed
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.grading.scalars import Key, Scalar, read_key
from rigidcli.grading.units import other_units, read_unit, scale_in

TYPABLE = (1e-290, 1e290)
"""Sizes of numbers that are typed with all their digits."""


class Number(Kind):
    """A number, or a quantity: a number with a unit."""

    name: ClassVar[str] = "number"
    options: ClassVar[frozenset[str]] = frozenset({"modulo", "products", "unit"})

    def read_key(self, asked: Asked) -> Key:
        """The number that is asked for. Raises ValueProblem."""
        return read_key(asked)

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> Scalar | Finding:
        """A number as it was typed, or what is wrong with its unit. Raises Unreadable."""
        written = read_written(unnamed(answer))
        if key.tolerance.significant_figures is not None and not written.mantissa:
            raise Unreadable("not_a_number", "significant figures are asked for: write a decimal number")
        if written.unit is None:
            if key.required and (written.value or key.reference):
                return Finding("unit_missing")
            return Scalar(written, key.unit.scale)
        unit = read_unit(written.unit, key.unit)
        try:
            return Scalar(written, scale_in(unit, key.unit.dimension))
        except ValueProblem as problem:
            return Finding(_misfit(key, written, unit), detail=problem.message)

    def judge(self, key: Key, answer: Scalar | Finding) -> Outcome:
        """The outcome of a number: its value first, then its figures."""
        if isinstance(answer, Finding):
            found: Finding | None = answer
        elif key.near(answer.written.value, answer.scale):
            found = _figures(key, answer.written)
        else:
            found = self.explanation(key, answer) or Finding("outside_tolerance")
        return correct() if found is None else wrong(replace(found, reference=key.told))

    def is_right(self, key: Key, answer: Scalar | Finding) -> bool:
        """Whether the value is right."""
        return isinstance(answer, Scalar) and key.near(answer.written.value, answer.scale)

    def right_forms(self, key: Key) -> Iterator[tuple[str, Tree]]:
        """The key with all its digits, in other spellings and units, and a period away."""
        own, unit = key.unit.scale, key.unit.text
        if not math.isfinite(key.reference / own):
            return
        text = _typed(key, key.reference / own)
        itself = _joined(text, unit)
        yield "the key", itself
        yield "with another minus sign", itself.replace("-", "\N{MINUS SIGN}")
        mantissa, _, power = _typed(key, key.reference / own, "e").partition("e")
        yield "with a power of ten", _joined(f"{mantissa}*10^{int(power)}", unit)
        if not key.required:
            yield "without a unit", text
        if unit[:1].isalpha():
            yield "without a blank before the unit", f"{text}{unit}"
        if key.tolerance.significant_figures is None:
            yield "as an expression", _joined(f"({text})/4 + 3*({text})/4", unit)
        if key.period is not None and key.tolerance.figures in ("value", "at_least"):
            for away in (-key.period, key.period):
                yield "a period away", _joined(_typed(key, (key.reference + away) / own), unit)
        for other, scale in _other_units(key):
            yield f"in {other}", _joined(_typed(key, key.reference / scale), other)

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """The key with a figure too few, without its unit, and in units that are not those of the number."""
        number = key.reference / key.unit.scale
        if key.figures is not None and key.figures > 1 and number:
            text = _joined(f"{number:.{key.figures - 2}e}", key.unit.text)
            answer = self.read_answer(key, text, Path())
            found = None if self.is_right(key, answer) else self.explanation(key, answer)
            if found is None or found.code == "too_few_sig_figs":
                yield Example("with a figure too few", text, "too_few_sig_figs")
        text = _typed(key, number)
        if key.required and key.reference:
            yield Example("without its unit", text, "unit_missing")
        for unit, scale in _other_units(key):
            if abs(scale / key.unit.scale - 1) > NOISE and not key.near(number, scale):
                what = f"in {unit} without conversion"
                yield Example(what, _joined(text, unit), "wrong_unit_right_number")
        stranger = "kg" if key.unit.dimension != MASS else "m"
        yield Example(f"in {stranger}", _joined(text, stranger), "unit_incompatible")


def _misfit(key: Key, written: Written, unit: Unit) -> str:
    """The code of an answer in a unit that does not fit: a hertz and a radian per second are told apart."""
    given, asked = unit.dimension, key.unit.dimension
    if given.cycle != asked.cycle and given._replace(angle=0, cycle=0) == asked._replace(angle=0, cycle=0):
        if key.near(written.value, unit.scale):
            return "wrong_unit_right_number"
        if key.near(written.value, unit.scale * (TURN if given.cycle else 1 / TURN)):
            return "frequency_vs_angular_frequency"
    return "unit_incompatible"


def _figures(key: Key, written: Written) -> Finding | None:
    """What is wrong with the figures of an answer that has the right value."""
    asked, counting = key.figures, key.tolerance.figures
    if asked is None or key.reference == 0:
        return None
    if written.figures < asked:
        return Finding("too_few_sig_figs")
    if counting != "at_least" and written.least_figures > asked:
        detail = f"{written.figures} significant figures are written, expected {asked}"
        return Finding("wrong_shape", detail=detail)
    return Finding("sig_figs_ambiguous") if counting == "strict" and written.ambiguous else None


def _typed(key: Key, number: float, form: str = "g") -> str:
    """A number with the figures that are asked for, or else all that it has."""
    if key.figures is None:
        return f"{number:.17g}" if form == "g" else f"{number:.16e}"
    return f"{number:.{16 if key.tolerance.figures == 'at_least' else key.figures - 1}e}"


def _joined(number: str, unit: str) -> str:
    return f"{number} {unit}".rstrip()


def _other_units(key: Key) -> Iterator[tuple[str, float]]:
    """Other units that fit, and in which the reference is neither too large nor too small to be typed."""
    for text, scale in other_units(key.unit.dimension).items():
        size = abs(key.reference / scale)
        if text != key.unit.text and (size == 0 or TYPABLE[0] < size < TYPABLE[1]):
            yield text, scale
