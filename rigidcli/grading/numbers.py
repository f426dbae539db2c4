"""Numbers in answers: read as typed, with their units and the figures that were written, and compared.

    number = decimal | an expression without names, such as `2*pi` or `sqrt(2)/3`
    decimal = digits, then perhaps a power of ten: `20.8`, `2.08e1`, `2.08*10^1`, `2.08 x 10^1`
    answer = number [unit]      a blank before the unit may be left out after a decimal: `5cm`

Units are those of documents, and a few spellings besides that are seen in homework. A name that the table
of units lacks is not looked for elsewhere.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import RELATIVE, Tolerance
from rigidcli.model.units import (
    ANGLE,
    DIMENSIONLESS,
    MAX_TEXT,
    Dimension,
    Unit,
    check_dimension,
    known_names,
    parse_unit,
)
from rigidcli.symbolic.expression import RESERVED, parse

LONGEST = 400
"""Characters of a number."""

MOST_ENTRIES = 10_000
"""Numbers in one answer that is a list."""

NOISE = 1e-12
"""A component of the reference below this, in units of its largest, is zero; so is what rounding adds."""

ROUNDING = 1e-9
"""Relative slack of every comparison, so that a value on the very limit is accepted."""

# Possessive, so that a long text is read or refused in one pass.
_TEN = r"[eE](?P<e>[-+]?[0-9]++)|\s*[*×·⋅xX]\s*10\s*(?:\^|\*\*)\s*(?P<open>\()?(?P<p>[-+]?[0-9]++)(?(open)\))"
_DECIMAL = re.compile(
    rf"(?P<sign>[-+]?)\s*(?P<mantissa>(?>[0-9]++\.?+[0-9]*+|\.[0-9]++))(?:{_TEN})?+"
    r"(?:(?:\s*(?=[^\W\d_]|[°′″%])|\s+(?=1/))(?P<unit>.+))?",
    re.DOTALL,
)
_UNIT_AFTER = re.compile(r"(?<=[\w.)])\s+(?=[^\W\d_]|[°′″%]|1/)")
_BASED = re.compile(r"[-+]?0[xXoO][0-9a-fA-F]")
_SLIPS = (
    (re.compile(r"[-+.0-9]+,[.,0-9]+"), "the decimal sign is a point, and no comma stands between digits"),
    (re.compile(r"[-+.0-9]+[_'][._'0-9]+"), "nothing stands between digits"),
    (re.compile(r"[-+.0-9]+\s[.\s0-9]+"), "no blank stands between digits"),
)
_NOT_FINITE = re.compile(r"[-+]?\.?(inf|infinity|nan)", re.IGNORECASE)


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


def read_written(answer: Tree, place: str = "") -> Written:
    """A decimal number or an expression of numbers, with or without a unit. Raises Unreadable."""
    if not isinstance(answer, str):
        raise Unreadable("not_a_number", f"read {shown(answer)}", place=place)
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters", place=place)
    text = answer.replace("\N{MINUS SIGN}", "-").strip()
    if _BASED.match(text):
        message = f"read {shown(answer)}, expected decimal digits"
        raise Unreadable("not_a_number", message, place=place)
    if (decimal := _DECIMAL.fullmatch(text)) is not None:
        return _decimal(decimal, place)
    if _NOT_FINITE.fullmatch(text):
        raise Unreadable("not_a_finite_number", f"read {shown(answer)}", place=place)
    value, unit = text, None
    if (blank := _UNIT_AFTER.search(text)) is not None:
        value, unit = text[: blank.start()], text[blank.end() :]
    return Written(_expression(value, answer, place), unit=unit)


def _decimal(match: re.Match[str], place: str) -> Written:
    mantissa, power, unit = match["mantissa"], match["e"] or match["p"], match["unit"]
    value = _finite(float(f"{match['sign']}{mantissa}e{power or 0}"), place)
    if value == 0 and mantissa.strip("0."):
        raise Unreadable("not_a_finite_number", "it is too small to be told from zero", place=place)
    return Written(value, mantissa, unit, None if power is None else int(power))


def _expression(text: str, answer: str, place: str) -> float:
    try:
        expression = parse(text)
    except ExpressionError as error:
        advice = next((advice for slip, advice in _SLIPS if slip.match(text)), _told(error))
        raise Unreadable("not_a_number", f"read {shown(answer)}: {advice}", place=place) from None
    if expression.names:
        name = shown(min(expression.names))
        raise Unreadable("not_a_number", f"read {shown(answer)}: {name} has no value", place=place)
    try:
        return _finite(expression.evaluate({}), place)
    except ExpressionError as error:
        message = f"read {shown(answer)}: {error.message}"
        raise Unreadable("not_a_finite_number", message, place=place) from None


def _told(problem: ValueProblem) -> str:
    return problem.message if problem.hint is None else f"{problem.message}: {problem.hint}"


def _finite(value: float, place: str) -> float:
    if not math.isfinite(value):
        raise Unreadable("not_a_finite_number", "it is beyond the range of numbers", place=place)
    return value


# --- units

SCALES = (1e-100, 1e100)
"""Units in SI units: no answer needs one beyond these."""

PERCENT = Unit("%", Fraction(1, 100), 0, DIMENSIONLESS)

SPELLINGS = {
    "sec": "s", "secs": "s", "mins": "min", "hrs": "h", "rads": "rad", "degs": "deg", "revs": "rev",
    "kgs": "kg", "Kg": "kg", "KG": "kg", "lbs": "lb", "cms": "cm", "Km": "km", "KM": "km", "hz": "Hz",
    "Nm": "(N m)",
}  # fmt: skip
"""Names of homework that the table of units lacks, and what is meant."""

_NAME = re.compile(r"(?![⁰¹²³⁴-⁹])[^\W\d_](?:(?![⁰¹²³⁴-⁹])\w)*(?P<power>-[0-9]+)?")
_KNOWN = frozenset([*known_names(), *"μÅ\u212b"])
_TOUCHING = re.compile("[^\\W⁰¹²³⁴-⁹][°′″]|[°′″][^\\W⁰¹²³⁴-⁹]")


def read_unit(text: str, expected: Unit | None = None, place: str = "") -> Unit:
    """A unit as typed in an answer; names of the `expected` one are known besides. Raises Unreadable."""
    if text.strip() == PERCENT.text:
        return PERCENT
    if len(text) > MAX_TEXT:
        raise Unreadable("unit_incompatible", f"read a unit of {len(text)} characters", place=place)
    if _TOUCHING.search(text):  # `°C` would become the name `degC`
        raise Unreadable("unit_incompatible", f"unknown unit {shown(text)}", place=place)
    own = [] if expected is None else [found[0] for found in _NAME.finditer(expected.text)]
    known = _KNOWN.union(own)

    def spelled(found: re.Match[str]) -> str:
        power = found["power"] or ""
        name = found[0].removesuffix(power)
        if (meant := _meant(name, known)) is not None:
            return meant if not power else f"{meant}^{power}"
        stem = name.rstrip("0123456789")
        if stem != name and not power and (meant := _meant(stem, known)) is not None:
            return f"{meant}^{name.removeprefix(stem)}"
        if name in RESERVED:
            message = f"read {shown(text)}: a product is written with `*`"
            raise Unreadable("not_a_number", message, place=place)
        raise Unreadable("unit_incompatible", f"unknown unit {shown(name)}", place=place)

    try:
        unit = parse_unit(_NAME.sub(spelled, text))
    except ValueProblem as problem:
        raise Unreadable("unit_incompatible", f"read {shown(text)}: {_told(problem)}", place=place) from None
    if not SCALES[0] < unit.scale < SCALES[1]:
        raise Unreadable("unit_incompatible", f"{shown(text)} is no unit of this world", place=place)
    return unit


def _meant(name: str, known: frozenset[str]) -> str | None:
    """The name of a unit in the spelling of documents; None for one that is not known."""
    if name in known or name.replace("μ", "µ") in known:
        return name
    small = name.lower()
    return (
        SPELLINGS.get(name) or SPELLINGS.get(small) or (small if len(name) > 2 and small in known else None)
    )


def scale_in(unit: Unit, expected: Dimension) -> float:
    """One of the unit in SI units, where a quantity of dimension `expected` is asked.

    Beyond what documents accept, an angle is a pure number, a hertz is 1/s, and turns (`rev/s`, `rpm`, and
    degrees, but not radians) are what a frequency counts.

    Raises:
        ValueProblem: the unit does not fit.
    """
    given = unit.dimension
    if expected == DIMENSIONLESS and given == ANGLE:
        return unit.scale
    if expected.cycle and given == expected._replace(cycle=0):
        return unit.scale
    turns = expected.cycle and given == expected._replace(cycle=0, angle=expected.cycle)
    if turns and unit.pi_power == given.angle:
        return unit.scale / (2 * math.pi) ** given.angle
    check_dimension(unit.text, given, expected)
    return unit.scale


def unit_of(text: str) -> Unit | None:
    """The unit of a reference, None for a pure number."""
    return parse_unit(text) if text else None


def in_si(written: Written, unit: Unit | None, place: str = "") -> float:
    """The SI value of a number that has a unit, which must fit. Raises Unreadable."""
    assert written.unit is not None
    own = read_unit(written.unit, unit, place)
    try:
        scale = scale_in(own, DIMENSIONLESS if unit is None else unit.dimension)
    except ValueProblem as problem:
        raise Unreadable("unit_incompatible", _told(problem), place=place) from None
    return _finite(written.value * scale, place)


def read_number(answer: Tree, unit: Unit | None = None, place: str = "") -> float:
    """The SI value of a number; one without a unit of its own is in SI units. Raises Unreadable.

    A unit must fit `unit`; where that is None, a pure number is expected.
    """
    written = read_written(answer, place)
    return written.value if written.unit is None else in_si(written, unit, place)


def read_list(answer: Tree, unit: Unit | None = None, length: int | None = None, place: str = "") -> Floats:
    """A list of numbers in SI units. Raises Unreadable."""
    if not isinstance(answer, list) or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers", place=place)
    if length is not None and len(answer) != length:
        raise Unreadable("wrong_shape", f"read {len(answer)} numbers, expected {length}", place=place)
    prefix = f"{place} " if place else ""
    return np.array([read_number(each, unit, f"{prefix}entry {k + 1}") for k, each in enumerate(answer)])


# --- comparing


def margin(reference: float, tolerance: Tolerance, scale: float = 1.0) -> float:
    """How far an answer may be from a reference that is not zero: the largest of what is allowed.

    Both are in a unit that is `scale` of that in which the absolute tolerance is. Half of one in the last
    figure is allowed either way; a reference just below a power of ten counts as that power.
    """
    allowed = [(tolerance.absolute or 0.0) / scale]
    size = abs(reference)
    if tolerance.significant_figures is not None and size:
        power = math.floor(math.log10(size) + ROUNDING) + 1 - tolerance.significant_figures
        allowed.append(0.5 * 10.0**power)
    relative = tolerance.relative
    if relative is None and tolerance.absolute is None and tolerance.significant_figures is None:
        relative = RELATIVE
    allowed.append((relative or 0.0) * size)
    return max(allowed) * (1 + ROUNDING) + NOISE * size


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
