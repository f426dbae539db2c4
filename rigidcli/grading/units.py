"""Units in answers: those of documents, and the other spellings that are seen in homework."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from fractions import Fraction
from functools import cache

from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS, Dimension, check_dimension
from rigidcli.fields.units import MAX_TEXT, Unit, known_names, parse_unit
from rigidcli.grading.outcome import Unreadable
from rigidcli.language.expression import RESERVED

SCALES = (1e-100, 1e100)
"""Units in SI units: no answer needs one beyond these."""

PERCENT = Unit("%", Fraction(1, 100), 0, DIMENSIONLESS)

SPELLINGS = {
    "sec": "s", "secs": "s", "mins": "min", "hrs": "h", "rads": "rad", "degs": "deg", "revs": "rev",
    "kgs": "kg", "Kg": "kg", "KG": "kg", "lbs": "lb", "cms": "cm", "Km": "km", "KM": "km", "hz": "Hz",
}  # fmt: skip
"""Names of homework that the table of units lacks, and what is meant."""

PRODUCTS = {
    pair.replace(" ", ""): pair
    for pair in (*("N m", "kN m", "N cm", "N mm", "N s", "J s"), *("kg m", "kg cm", "kg mm", "g cm", "g mm"))
}
"""Two units that homework runs together; a power belongs to the second, as in `kgm^2`."""

EXAMPLES = (
    "%", "m", "cm", "mm", "km", "in", "ft", "kg", "g", "lb", "s", "ms", "min", "h", "yr", "rad", "deg", "rev",
    "rad/s", "1/s", "rpm", "deg/s", "rev/s", "Hz", "kHz", "m/s", "km/h", "cm/s", "m/s^2", "cm/s^2", "kg m^2",
    "g cm^2", "kg m^2/s", "g cm^2/s", "N", "kN", "dyn", "N m", "J", "kJ", "erg", "W", "kW", "Pa", "bar",
    "kg/m^3", "g/cm^3", "N/m", "m^2", "cm^2", "m^3", "L", "kg m/s",
)  # fmt: skip
"""Units in which a student may give an answer."""

_RAISED = "⁰¹²³⁴-⁹"
_NAME = re.compile(
    rf"(?P<name>(?![{_RAISED}])[^\W\d_](?:(?![{_RAISED}])\w)*)"
    rf"(?P<power>-[0-9]+|\s*(?:\^|\*\*)\s*[-+]?[0-9]+|⁻?[{_RAISED}]+)?"
)
_KNOWN = frozenset([*known_names(), *"μÅ\u212b"])
_TOUCHING = re.compile(f"[^\\W{_RAISED}][°′″]|[°′″][^\\W{_RAISED}]")


def read_unit(text: str, expected: Unit | None = None, place: str = "") -> Unit:
    """A unit as typed in an answer; names of the `expected` one are known besides. Raises Unreadable."""
    if text.strip() == PERCENT.text:
        return PERCENT
    if len(text) > MAX_TEXT:
        raise Unreadable("unit_incompatible", f"read a unit of {len(text)} characters", place=place)
    if _TOUCHING.search(text):  # `°C` would become the name `degC`
        raise Unreadable("unit_incompatible", f"unknown unit {shown(text)}", place=place)
    own = [] if expected is None else [found["name"] for found in _NAME.finditer(expected.text)]
    known = _KNOWN.union(own)

    def spelled(found: re.Match[str]) -> str:
        name, power = found["name"], found["power"] or ""
        unit = _spelled(name, f"^{power}" if power.startswith("-") else power, known)
        if unit is None and (name in RESERVED or name.startswith("π")):
            message = f"read {shown(text)}: a product is written with `*`"
            raise Unreadable("not_a_number", message, place=place)
        if unit is None:
            # A name may be those of two units, the first of them one that begins a product.
            first = [pair.split()[0] for pair in PRODUCTS.values()]
            rest = (name.removeprefix(each) for each in first if name.startswith(each))
            hint = ": units stand apart, as in `kg m^2`" if any(_meant(each, known) for each in rest) else ""
            raise Unreadable("unit_incompatible", f"unknown unit {shown(name)}{hint}", place=place)
        return unit

    try:
        unit = parse_unit(_NAME.sub(spelled, text))
    except ValueProblem as problem:
        message = f"read {shown(text)}: {with_hint(problem)}"
        raise Unreadable("unit_incompatible", message, place=place) from None
    if not SCALES[0] < unit.scale < SCALES[1]:
        raise Unreadable(
            "unit_incompatible", f"{shown(text)} is too large or too small for a unit", place=place
        )
    return unit


def with_hint(problem: ValueProblem) -> str:
    """What a problem says, in one line."""
    return problem.message if problem.hint is None else f"{problem.message}: {problem.hint}"


def _spelled(name: str, power: str, known: frozenset[str]) -> str | None:
    """A name with its power, or the digits at its end as one, in the spelling of documents."""
    stem = name.rstrip("0123456789")
    for part, raised in ((name, power), (stem, power or f"^{name.removeprefix(stem)}")):
        if (meant := _meant(part, known)) is not None:
            return f"{meant}{raised}"
        if part in PRODUCTS:
            return f"({PRODUCTS[part]}{raised})"
        if power:
            break
    return None


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


@cache
def other_units(dimension: Dimension) -> dict[str, float]:
    """The EXAMPLES of units of this dimension, and how much of the SI unit each is."""
    fitting = {}
    for text in EXAMPLES:
        with suppress(ValueProblem):
            fitting[text] = scale_in(read_unit(text), dimension)
    return fitting
