"""Numbers in answers, read as they are typed, with their units and figures.

    read_number("20,8 rad/s", None)      # a pure number is asked for: Unreadable
    read_number("~22.4 rpm", unit)       # .value in SI units, .figures 3

A comma between digits is a decimal comma. An uncertainty (`20.8 +- 0.1`) is no arithmetic, and is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.values import is_zero
from rigidcli.check.base import Tree, Unreadable
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS, Dimension, check_dimension
from rigidcli.fields.units import MAX_TEXT, Unit, known_names, parse_unit
from rigidcli.language import tree
from rigidcli.language.expression import RESERVED, real
from rigidcli.language.latex import plain
from rigidcli.language.statements import TWO_ANSWERS, is_label, second_name
from rigidcli.language.typed import expression, last_member, slopes

LONGEST = 400
"""The most characters of a number."""

ROUNDING = 1e-9
"""The share of a number that rounding may change: a value on the very limit of a tolerance is accepted."""

PURE = Unit("", Fraction(1), 0, DIMENSIONLESS)
PERCENT = Unit("%", Fraction(1, 100), 0, DIMENSIONLESS)

_SPELLINGS = {
    "sec": "s", "secs": "s", "mins": "min", "hrs": "h", "rads": "rad", "degs": "deg", "revs": "rev",
    "kgs": "kg", "Kg": "kg", "KG": "kg", "lbs": "lb", "cms": "cm", "Km": "km", "KM": "km", "hz": "Hz",
}  # fmt: skip
"""Names of units in homework that the table of units lacks."""

_PRODUCTS = {
    pair.replace(" ", ""): pair
    for pair in ("N m", "kN m", "N cm", "N mm", "N s", "J s", "kg m", "kg cm", "kg mm", "g cm", "g mm")
}
"""Two units that people run together; a power belongs to the second, as in `kgm^2`."""

_BRACKETS = str.maketrans("[]", "()")
_KNOWN = frozenset(known_names())
_UNIT_NAME = re.compile(
    r"(?P<name>[^\W\d]\w*)(?P<power>-\d+|\s*(?:\^|\*\*)\s*(?:\(\s*[-+]?\d+\s*\)|[-+]?\d+))?"
)
_WORDS_OF_NUMBERS = rf"(?:{'|'.join(sorted(RESERVED - {'t', 'sec'}))})(?![^\W\d])"
_UNIT_BEGINS = rf"[(\[]*(?!{_WORDS_OF_NUMBERS})[^\W\d_]|[°%]"
_PER = rf"/\s*(?!{_WORDS_OF_NUMBERS})[^\W\d_]"
_DECIMAL = re.compile(
    r"(?P<sign>[-+]?)\s*(?P<mantissa>(?>\d++[.,]?+\d*+|[.,]\d++))"
    r"(?:[eE](?P<e>[-+]?\d++)|\s*[*xX]\s*10\s*(?:\^|\*\*)\s*(?P<open>\()?\s*(?P<p>[-+]?\s*\d++)\s*(?(open)\)))?+"
    rf"(?:(?:\s*(?={_UNIT_BEGINS}|{_PER})|\s+(?=1\s*/))(?P<unit>.+))?\s*",
    re.DOTALL,
)
_GROUPED = re.compile(r"(?P<sign>[-+]?\s*)(?P<digits>\d{1,3}(?:,\d{3})+)(?P<rest>(?!\d).*)", re.DOTALL)
"""A number whose commas may stand for thousands."""

_BEHIND = re.compile(rf"(?<=[\w.)])\s+(?={_UNIT_BEGINS}|1\s*/|{_PER})")
_UNCERTAIN = re.compile(r"[\w.)°%]\s*(?:\+/?-|±|-/?\+)")


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it was typed: `value` in SI units, of which its unit is `scale`; `typed` is in that unit.

    `mantissa` has the digits before a power of ten; it is empty for an expression such as `2*pi`. Where
    commas may stand for thousands, `thousands` is the number that is meant then. `before` are the members of
    a chain of equalities before the number.
    """

    value: float
    typed: float
    scale: float
    unit: Unit | None = None
    mantissa: str = ""
    power: int = 0
    thousands: float | None = None
    before: tuple[str, ...] = ()

    @property
    def figures(self) -> int:
        """The significant figures that are typed, zeros at the end among them; 0 for an expression."""
        digits = self.mantissa.replace(".", "")
        return len(digits.lstrip("0")) or len(digits[:1])

    @property
    def read_as(self) -> str:
        """The number as it is shown to the student."""
        digits = f"{self.typed:.12g}" if not self.mantissa or self.power else f"{self.typed:.15g}"
        return digits if self.unit is None else f"{digits} {self.unit.text}"


def read_number(answer: Tree, unit: Unit | None = None, place: str = "") -> Number:
    """A decimal number or an expression of numbers, in its own unit or else in `unit`.

    A unit must fit `unit`; where that is None, a pure number is asked for. Raises Unreadable.
    """
    number = as_typed(answer, unit, place)
    if number.unit is None:
        return number
    try:
        scale = scale_in(number.unit, DIMENSIONLESS if unit is None else unit.dimension)
    except ValueProblem as problem:
        raise Unreadable("unit_incompatible", with_hint(problem), place=place) from None
    return replace(number, value=number.typed * scale, scale=scale)


def as_typed(answer: Tree, unit: Unit | None = None, place: str = "") -> Number:
    """A number in its own unit, whatever that measures; `unit` is that of a number without one.

    Raises Unreadable.
    """
    if isinstance(answer, list | dict) or answer is None:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected one number", place=place)
    text = str(answer)
    if len(text) > LONGEST:
        raise Unreadable("too_large", f"{len(text)} characters", place=place)
    try:
        last, members = last_member(plain(_signs_of_units(text)))
        text, before = last.strip(), tuple(members)
        if _UNCERTAIN.search(text):
            raise ExpressionError("an uncertainty is not read, give the value")
        decimal = _DECIMAL.fullmatch(text)
        value, behind = (None, decimal["unit"]) if decimal else _split(text)
        own = None if behind is None else read_unit(behind, unit, place)
        scale = own.scale if own else 1.0 if unit is None else unit.scale
        if decimal is None:
            assert value is not None
            typed = _value(value)
            return Number(_finite(typed * scale), typed, scale, own, before=before)
        mantissa = decimal["mantissa"].replace(",", ".")
        power = int((decimal["e"] or decimal["p"] or "0").replace(" ", ""))
        typed = float(f"{decimal['sign']}{mantissa}e{power}")
        if typed == 0:
            if mantissa.strip("0."):
                raise ExpressionError("it is too small for a number")
            power = 0
        thousands = _thousands(text, unit)
        return Number(_finite(typed * scale), typed, scale, own, mantissa, power, thousands, before)
    except ExpressionError as error:
        message = f"read {shown(answer)}: {with_hint(error)}"
        raise Unreadable(error.code or "not_a_number", message, place=place) from None


CONTRADICTION = "the members of the chain of equalities are not equal"


def doubt(before: Sequence[str], read: Callable[[str], Any], is_equal: Callable[[Any], bool]) -> str:
    """Why a person must look at an answer behind `=`: a member before it is another value, or no name.

    What can be read is compared; a name alone is only a name. Raises Unreadable where a second answer begins.
    """
    for place, member in enumerate(before):
        is_name = place == 0 and is_label(slopes(member))
        if is_name and len(member.split()) == 1:
            continue
        try:
            other = read(member)
        except Unreadable:
            if place == 0 and not is_name:
                return f"what stands before `=` is no name: {shown(member.strip())}"
            if place and begins_another(member, read):
                raise Unreadable("wrong_shape", TWO_ANSWERS) from None
        else:
            if not is_equal(other):
                return CONTRADICTION
    return ""


def begins_another(member: str, read: Callable[[str], Any]) -> bool:
    """Whether a member is a value and the name of a second answer: `3.1 rad/s fast`."""
    value = second_name(member)
    try:
        return value is not None and read(value) is not None
    except Unreadable:
        return False


def _signs_of_units(text: str) -> str:
    """A text whose minutes of arc, micro and ohm are not read as primes and Greek letters."""
    text = re.sub(r"(?<=\d)\s*″", " arcsec", re.sub(r"(?<=\d)\s*′", " arcmin", text))
    return re.sub("[Å\u212b]", "angstrom", re.sub("μ(?=[A-Za-z])", "\N{MICRO SIGN}", text))


def _thousands(text: str, unit: Unit | None) -> float | None:
    """The SI value of a number whose commas stand for thousands; None where they cannot."""
    grouped = _GROUPED.fullmatch(text)
    if grouped is None:
        return None
    whole = grouped["sign"] + grouped["digits"].replace(",", "") + grouped["rest"]
    return as_typed(whole, unit).value


def _split(text: str) -> tuple[str, str | None]:
    """An expression and the unit behind it; or thousands with more than one comma, as they are typed."""
    grouped = _GROUPED.fullmatch(text)
    if grouped is not None and grouped["digits"].count(",") > 1:
        text = grouped["sign"] + grouped["digits"].replace(",", "") + grouped["rest"]
    blank = _BEHIND.search(text)
    return (text, None) if blank is None else (text[: blank.start()], text[blank.end() :])


def _value(text: str) -> float:
    """The value of an expression without names."""
    for slip, advice in _SLIPS:
        if slip.match(text):
            raise ExpressionError(advice)
    node = expression(text, None, leading=False)
    if names := sorted(tree.names_in(node)):
        raise ExpressionError(f"{shown(names[0])} has no value")
    value = _finite(real(node, {}))
    with suppress(ExpressionError):  # it is proved that `cos(pi/2)` is zero, which no float shows
        return 0.0 if abs(value) < ROUNDING and is_zero(from_tree(node)) else value
    return value


_SLIPS = (
    (re.compile(r"[-+.0-9]+[_'][._'0-9]+"), "nothing stands between digits"),
    (re.compile(r"[-+]?\d[.,\d]*\s[.,\s]*\d"), "no blank stands between digits"),
    (re.compile(r"[-+]?0[xXoObB]"), "expected decimal digits"),
    (re.compile(r"[-+\s]*(?:inf|nan|\.inf|\.nan)", re.IGNORECASE), "expected a finite number"),
)


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ExpressionError("it is beyond the range of numbers")
    return value


# --- units


def read_unit(text: str, expected: Unit | None = None, place: str = "") -> Unit:
    """A unit as typed in homework; names of the `expected` one may stand in it, too. Raises Unreadable."""
    text = re.sub(r"^\s*/", "1/", re.sub(r"(^|\s)per\s", "/", text.strip())).translate(_BRACKETS).strip()
    if text == PERCENT.text:
        return PERCENT
    if twice := re.fullmatch(r"([^\s()]+)\s*\(([^\W\d_]+)\)", text):  # as in `J (joules)`
        unit, again = (read_unit(part, expected, place) for part in twice.groups())
        if (unit.scale, unit.dimension) == (again.scale, again.dimension):
            return unit
    own = set() if expected is None else {match["name"] for match in _UNIT_NAME.finditer(expected.text)}

    def spelled(match: re.Match[str]) -> str:
        name, power = match["name"], re.sub(r"[\s()]", "", match["power"] or "").replace("**", "^")
        return _unit_spelled(name, f"^{power}" if power.startswith("-") else power, own)

    try:
        if len(text) > MAX_TEXT:
            raise ValueProblem(f"a unit of {len(text)} characters")
        if re.search(r"°\s*[A-Za-z]|\w°", text):
            raise ValueProblem("unknown unit")  # a degree Celsius has its zero elsewhere
        unit = parse_unit(_UNIT_NAME.sub(spelled, text.replace("°", "deg")))
        if not 1e-100 < unit.scale < 1e100:
            raise ValueProblem("the unit is too large or too small")
    except ValueProblem as problem:
        message = f"read {shown(text)}: {with_hint(problem)}"
        raise Unreadable("unit_incompatible", message, place=place) from None
    return unit


def _unit_spelled(name: str, power: str, own: set[str]) -> str:
    """A name of a unit with its power, or with the digits at its end as one, in the spelling of documents."""
    stem = name.rstrip("0123456789")
    for part, raised in ((name, power), (stem, power or f"^{name.removeprefix(stem)}")):
        small = part.lower()
        if part in _KNOWN or part in own:
            return f"{part}{raised}"
        if (
            meant := _SPELLINGS.get(part)
            or _SPELLINGS.get(small)
            or (len(part) > 2 and small in _KNOWN and small)
        ):
            return f"{meant}{raised}"
        if part in _PRODUCTS:
            return f"({_PRODUCTS[part]}{raised})"
    return f"{name}{power}"


def scale_in(unit: Unit, expected: Dimension) -> float:
    """The size in SI units of one of the unit, where a quantity of dimension `expected` is asked.

    Beyond what documents accept, an angle is a pure number, a hertz is 1/s, and turns (`rev/s`, `rpm`, and
    degrees, but not radians) are what a frequency counts. Raises ValueProblem where the unit does not fit.
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


def with_hint(problem: ValueProblem) -> str:
    """What a problem says, in one line."""
    return problem.message if problem.hint is None else f"{problem.message} ({problem.hint})"
