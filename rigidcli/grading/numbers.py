"""Numbers in answers: read as typed, with their units and the figures that were written, and compared.

    number = decimal | an expression without names, such as `2*pi` or `sqrt(2)/3`
    decimal = digits, then perhaps a power of ten: `20.8`, `2.08e1`, `2.08*10^1`, `2.08 x 10^1`, `2.08 x 10¹`
    answer = number [unit]      a blank before the unit may be left out after a decimal: `5cm`, `20.8/s`

An uncertainty (`20.8 +- 0.1`) is no arithmetic, and is refused. Units are read in `units`.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.dimensions import DIMENSIONLESS
from rigidcli.fields.units import Unit
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import RELATIVE, Tolerance
from rigidcli.grading.units import read_unit, scale_in, with_hint
from rigidcli.language.expression import FUNCTIONS, RESERVED, parse

LONGEST = 400
"""Characters of a number."""

MOST_ENTRIES = 10_000
"""Numbers in one answer that is a list."""

NOISE = 1e-12
"""A component of the reference below this, in units of its largest, is zero; so is what rounding adds."""

ROUNDING = 1e-9
"""Relative slack of every comparison, so that a value on the very limit is accepted."""

LEAST = 5e-324
"""The smallest float above zero."""

# Possessive, so that a long text is read or refused in one pass.
_TEN = (
    r"[eE](?P<e>[-+]?[0-9]++)|\s*[*×·⋅xX]\s*10"
    r"(?:\s*(?:\^|\*\*)\s*(?P<open>\()?(?P<p>[-+]?[0-9]++)(?(open)\))|(?P<raised>[⁻⁺]?[⁰¹²³⁴-⁹]++))"
)
_RAISED = str.maketrans("⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹", "-+0123456789")

_NAMES = rf"(?:{'|'.join([*sorted(FUNCTIONS), 'ln', 'pi'])}|π)(?![^\W\d])"
"""Functions and constants, which are no units."""

_UNIT = rf"(?!{_NAMES}|[⁰¹²³⁴-⁹])[^\W\d_]|[°′″%]"
"""How a unit begins."""

_PER = rf"/\s*(?!(?:{'|'.join(sorted(RESERVED))}|π)\b)[^\W\d_]"
"""One over a unit, and not over a function or a constant."""

_DECIMAL = re.compile(
    rf"(?P<sign>[-+]?)\s*(?P<mantissa>(?>[0-9]++\.?+[0-9]*+|\.[0-9]++))(?:{_TEN})?+"
    rf"(?:(?:\s*(?={_UNIT}|{_PER})|\s+(?=1/))(?P<unit>.+))?",
    re.DOTALL,
)
_UNIT_AFTER = re.compile(rf"(?<=[\w.)])\s+(?={_UNIT}|1/|{_PER})")
_NAMED = re.compile(r"\s*[^\W\d]\w*\s*=(?!=)")
_UNCERTAIN = re.compile(r"[\w.)°′″%]\s*(?:\+/?-|-/?\+|[±∓])")
_BASED = re.compile(r"[-+]?0[xXoO][0-9a-fA-F]")
_SLIPS = (
    (re.compile(r"[-+.0-9]+,[.,0-9]+"), "the decimal sign is a point, and no comma stands between digits"),
    (re.compile(r"[-+.0-9]+[_'][._'0-9]+"), "nothing stands between digits"),
    (re.compile(r"[-+.0-9]+\s[.\s0-9]+"), "no blank stands between digits"),
)
_NOT_FINITE = re.compile(r"[-+]?\s*(?:\.?(?:inf|infinity|nan)|∞)(?:\s.*)?", re.IGNORECASE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Written:
    """A number as it was typed: its `value` in its `unit` (None where none was typed).

    `mantissa` has the digits before a power of ten, and `power` is that power (None where none was typed);
    the mantissa of an expression such as `2*pi` is empty.
    """

    value: float
    mantissa: str = ""
    unit: str | None = None
    power: int | None = None

    @property
    def figures(self) -> int:
        """Significant figures that are written, trailing zeros among them; 0 for an expression."""
        digits = self.mantissa.replace(".", "")
        return len(digits.lstrip("0")) or len(digits[:1])

    @property
    def ambiguous(self) -> bool:
        """Whether zeros at the end of a whole number leave open how many figures are meant."""
        plain = "." not in self.mantissa and self.power is None
        return plain and self.mantissa.endswith("0") and self.value != 0

    @property
    def least_figures(self) -> int:
        """Significant figures that are certainly meant."""
        return len(self.mantissa.strip("0")) if self.ambiguous else self.figures

    @property
    def half_a_digit(self) -> float:
        """Half of one in the last digit that is written; 0 for an expression, and for zero."""
        if not self.mantissa or self.value == 0:
            return 0.0
        decimals = len(self.mantissa.partition(".")[2])
        return 0.5 * 10.0 ** ((self.power or 0) - decimals)


# --- reading


def unnamed(answer: Tree) -> Tree:
    """An answer without the name that stands before it, as in `omega = 20.8 rad/s`."""
    return _NAMED.sub("", answer, count=1) if isinstance(answer, str) and _NAMED.match(answer) else answer


def read_written(answer: Tree, place: str = "") -> Written:
    """A decimal number or an expression of numbers, with or without a unit. Raises Unreadable."""
    if isinstance(answer, list | dict):
        message = f"read {shown(answer)}, expected one number, with its unit as in `5 cm`"
        raise Unreadable("wrong_shape", message, place=place)
    if not isinstance(answer, str):
        raise Unreadable("not_a_number", f"read {shown(answer)}", place=place)
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters", place=place)
    text = answer.replace("\N{MINUS SIGN}", "-").strip()
    if _BASED.match(text):
        message = f"read {shown(answer)}, expected decimal digits"
        raise Unreadable("not_a_number", message, place=place)
    if _UNCERTAIN.search(text):
        message = f"read {shown(answer)}: an uncertainty is not read: give the value"
        raise Unreadable("not_a_number", message, place=place)
    if (decimal := _DECIMAL.fullmatch(text)) is not None:
        return _decimal(decimal, place)
    if _NOT_FINITE.fullmatch(text):
        raise Unreadable("not_a_finite_number", f"read {shown(answer)}", place=place)
    value, unit = text, None
    if (blank := _UNIT_AFTER.search(text)) is not None:
        value, unit = text[: blank.start()], text[blank.end() :]
    return Written(_expression(value, answer, place), unit=_unit(unit))


def _decimal(match: re.Match[str], place: str) -> Written:
    mantissa, unit = match["mantissa"], match["unit"]
    power = match["e"] or match["p"] or (match["raised"] or "").translate(_RAISED) or None
    value = _finite(float(f"{match['sign']}{mantissa}e{power or 0}"), place)
    if value == 0 and mantissa.strip("0."):
        raise Unreadable("not_a_finite_number", "it is too small to be told from zero", place=place)
    return Written(value, mantissa, _unit(unit), None if power is None else int(power))


def _unit(text: str | None) -> str | None:
    """A unit as it is read alone."""
    return f"1{text}" if text is not None and text.startswith("/") else text


def _expression(text: str, answer: str, place: str) -> float:
    try:
        expression = parse(text)
    except ExpressionError as error:
        advice = next((advice for slip, advice in _SLIPS if slip.match(text)), with_hint(error))
        raise Unreadable("not_a_number", f"read {shown(answer)}: {advice}", place=place) from None
    if expression.names:
        name = shown(min(expression.names))
        raise Unreadable("not_a_number", f"read {shown(answer)}: {name} has no value", place=place)
    try:
        value = _finite(expression.evaluate({}), place)
    except ExpressionError as error:
        message = f"read {shown(answer)}: {error.message}"
        raise Unreadable("not_a_finite_number", message, place=place) from None
    # It is proved that `cos(pi/2)` is zero, which no float tells.
    with suppress(ExpressionError):
        return 0.0 if abs(value) < ROUNDING and is_zero(from_tree(expression.root)) else value
    return value


def _finite(value: float, place: str) -> float:
    if not math.isfinite(value):
        raise Unreadable("not_a_finite_number", "it is beyond the range of numbers", place=place)
    return value


# --- in SI units


def scale_of(written: Written, unit: Unit | None, place: str = "") -> float:
    """The unit of a number in SI units: its own, which must fit, or else `unit`. Raises Unreadable."""
    if written.unit is None:
        return 1.0 if unit is None else unit.scale
    own = read_unit(written.unit, unit, place)
    try:
        return scale_in(own, DIMENSIONLESS if unit is None else unit.dimension)
    except ValueProblem as problem:
        raise Unreadable("unit_incompatible", with_hint(problem), place=place) from None


def read_number(answer: Tree, unit: Unit | None = None, place: str = "") -> float:
    """The SI value of a number, which is in this unit unless it has its own. Raises Unreadable.

    A unit must fit `unit`; where that is None, a pure number is expected.
    """
    written = read_written(answer, place)
    return _finite(written.value * scale_of(written, unit, place), place)


# --- comparing


@overload
def margin(reference: float, tolerance: Tolerance, scale: float = 1.0) -> float: ...
@overload
def margin(reference: Floats, tolerance: Tolerance, scale: float = 1.0) -> Floats: ...
def margin(reference: float | Floats, tolerance: Tolerance, scale: float = 1.0) -> float | Floats:
    """How far answers may be from references: the largest of what is allowed.

    Both are in a unit that is `scale` of that in which the absolute tolerance is. Half of one in the last
    figure is allowed either way; a reference just below a power of ten counts as that power.
    """
    size: Any = abs(reference)
    figures = tolerance.significant_figures
    relative = tolerance.relative
    if relative is None and tolerance.absolute is None and figures is None:
        relative = RELATIVE
    allowed = (relative or 0.0) * size
    if tolerance.absolute:
        allowed = np.maximum(allowed, tolerance.absolute / scale)
    if figures is not None:
        powers = np.floor(np.log10(np.maximum(size, LEAST)) + ROUNDING) + 1 - figures
        allowed = np.maximum(allowed, np.where(size == 0, 0.0, 0.5 * 10.0**powers))
    margin: float | Floats = allowed * (1 + ROUNDING) + NOISE * size
    return margin


def margins(references: Floats, tolerance: Tolerance, beside: float = 0.0) -> Floats:
    """How far entries (k, ...) may be off: each by its own size, or by that of the largest at its point.

    The latter is for an entry that is zero, but for rounding; where all are, it is `beside` what they are so.
    """
    sizes = np.abs(references)
    largest = sizes.max(axis=tuple(range(1, sizes.ndim)), keepdims=True, initial=0.0)
    largest = np.where(largest > NOISE * beside, largest, beside)
    return margin(np.where(sizes > NOISE * largest, sizes, largest), tolerance)


def narrowed(tolerance: Tolerance, factor: float) -> Tolerance:
    """The tolerance of a number so many times as large.

    A factor below 1 takes an absolute tolerance with it, which would cover all that is small.
    """
    if tolerance.absolute is None or factor >= 1:
        return tolerance
    return tolerance.model_copy(update={"absolute": tolerance.absolute * factor})
