"""Units: the text of a unit becomes an exact factor to SI and a dimension.

The table `units.csv` defines the units of mechanics courses, each by others. What follows is exact: a
rational factor times a power of pi. A name that the table lacks is refused, with the names that are like it.

    unit   =  factor, then more of them joined by `*`, `·`, a blank (all of them products) or `/`
    factor =  (name | `(` unit `)`) [power]        `1` may stand for a name before `/`, as in `1/s`
    power  =  `^n`, `**n` or superscript digits    a whole number from -12 to 12

A product is worked from left to right and a blank binds like `*`: `N m/rad s` is `(N m/rad) s`.
A point or a hyphen before a letter is a product, too: `kg.m^2`, `N-m`.
Write `kg/(m s)` for several names below the line. Case matters: `Mm` is not `mm`.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, replace
from difflib import get_close_matches
from fractions import Fraction
from functools import lru_cache
from importlib import resources
from typing import NamedTuple

from rigidcli.errors import ValueProblem, shown
from rigidcli.symbolic.language.tokens import LOWERED, SUPERSCRIPT

MAX_TEXT = 200
"""The most characters of a unit: far more than any has, and read at once."""

MAX_POWER = 12
"""The largest power in a unit: no law of mechanics has one beyond it."""

MAX_BITS = 4096
"""The most bits of a factor's numerator or denominator: far beyond any float, and still worked at once."""

_PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494")
"""Pi to 60 digits, so that a factor is rounded only when it becomes a float."""


class Dimension(NamedTuple):
    """Exponents of the base units; its text names it and its SI unit, as in `length (m)`.

    Angle is kept, unlike in the SI, so that degrees cannot pass for metres. `cycle` is what a
    hertz counts: turns in one book and radians in the next, so it is neither.
    """

    mass: int = 0
    length: int = 0
    time: int = 0
    angle: int = 0
    cycle: int = 0
    current: int = 0
    temperature: int = 0
    amount: int = 0

    def times(self, other: Dimension, power: int = 1) -> Dimension:
        """The dimension of a product with `other` raised to `power`."""
        return Dimension(*(a + power * b for a, b in zip(self, other, strict=True)))

    def __str__(self) -> str:
        """The usual name with the SI unit, `mass (kg)`; without a name, the unit `kg m/s^3` alone."""
        if self in _DIMENSION_NAMES:
            return _DIMENSION_NAMES[self]
        above: list[str] = []
        below: list[str] = []
        for unit, power in zip(("kg", "m", "s", "rad", "cycle", "A", "K", "mol"), self, strict=True):
            text = unit if abs(power) == 1 else f"{unit}^{abs(power)}"
            if power:
                (above if power > 0 else below).append(text)
        if len(below) > 1:
            below = [f"({' '.join(below)})"]
        return "/".join([" ".join(above) or "1", *below])

    @property
    def unit(self) -> str:
        """The name of the SI unit alone; nothing for a pure number."""
        text = str(self)
        return (text.partition(" (")[2][:-1] or text) if any(self) else ""


DIMENSIONLESS = Dimension()
MASS = Dimension(mass=1)
LENGTH = Dimension(length=1)
TIME = Dimension(time=1)
ANGLE = Dimension(angle=1)
ANGULAR_VELOCITY = Dimension(angle=1, time=-1)
FREQUENCY = Dimension(cycle=1, time=-1)
AREA = Dimension(length=2)
VOLUME = Dimension(length=3)
ACCELERATION = Dimension(length=1, time=-2)
LINE_DENSITY = Dimension(mass=1, length=-1)
AREA_DENSITY = Dimension(mass=1, length=-2)
DENSITY = Dimension(mass=1, length=-3)
MOMENT_OF_INERTIA = Dimension(mass=1, length=2)
ENERGY = Dimension(mass=1, length=2, time=-2)  # a torque, too
GRAVITATIONAL_PARAMETER = Dimension(length=3, time=-2)  # G m
CURRENT = Dimension(current=1)
TEMPERATURE = Dimension(temperature=1)

_DIMENSION_NAMES = {
    DIMENSIONLESS: "pure number",
    MASS: "mass (kg)",
    LENGTH: "length (m)",
    TIME: "time (s)",
    ANGLE: "angle (rad)",
    ANGULAR_VELOCITY: "angular velocity (rad/s)",
    Dimension(angle=1, time=-2): "angular acceleration (rad/s^2)",
    FREQUENCY: "frequency (Hz)",
    AREA: "area (m^2)",
    VOLUME: "volume (m^3)",
    Dimension(length=1, time=-1): "velocity (m/s)",
    ACCELERATION: "acceleration (m/s^2)",
    LINE_DENSITY: "mass per length (kg/m)",
    AREA_DENSITY: "mass per area (kg/m^2)",
    DENSITY: "density (kg/m^3)",
    MOMENT_OF_INERTIA: "moment of inertia (kg m^2)",
    Dimension(mass=1, length=1, time=-1): "momentum (kg m/s)",
    Dimension(mass=1, length=2, time=-1): "angular momentum (kg m^2/s)",
    Dimension(mass=1, time=-2): "stiffness (N/m)",
    Dimension(mass=1, length=1, time=-2): "force (N)",
    ENERGY: "torque or energy (N m)",
    Dimension(mass=1, length=2, time=-3): "power (W)",
    Dimension(mass=1, length=-1, time=-2): "pressure (Pa)",
    GRAVITATIONAL_PARAMETER: "gravitational parameter (m^3/s^2)",
    CURRENT: "electric current (A)",
    TEMPERATURE: "temperature (K)",
}


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: one of it is `factor` pi^`pi_power` of the SI unit of `dimension`, exactly."""

    text: str
    factor: Fraction
    pi_power: int
    dimension: Dimension

    @property
    def scale(self) -> float:
        """One of the unit in SI units."""
        return self.si(Fraction(1))

    def si(self, number: Fraction) -> float:
        """`number` of the unit in SI units, rounded once: 1.1 cm is 0.011, not 1.1 * 0.01.

        Raises:
            ValueProblem: the result is too large for a float.
        """
        try:
            return float(number * self.factor * _PI**self.pi_power)
        except OverflowError as error:
            raise ValueProblem(f"a value in `{self.text}` is too large") from error

    def times(self, other: Unit, power: int = 1) -> Unit:
        """The product with `other` raised to `power`; it keeps this unit's text."""
        factor = self.factor * other.factor**power
        pi_power = self.pi_power + power * other.pi_power
        return Unit(self.text, factor, pi_power, self.dimension.times(other.dimension, power))


# --- the table

# fmt: off
PREFIXES = {prefix: power for power, prefixes in {
    -30: "q quecto", -27: "r ronto", -24: "y yocto", -21: "z zepto", -18: "a atto", -15: "f femto",
    -12: "p pico", -9: "n nano", -6: "u µ micro", -3: "m milli", -2: "c centi", -1: "d deci", 1: "da deca",
    2: "h hecto", 3: "k kilo", 6: "M mega", 9: "G giga", 12: "T tera", 15: "P peta", 18: "E exa",
    21: "Z zetta", 24: "Y yotta", 27: "R ronna", 30: "Q quetta",
}.items() for prefix in prefixes.split()}
# fmt: on
"""SI prefixes with their powers of ten; up to two letters stand before symbols, the others before words."""

_BASE = {name: Dimension(**{name: 1}) for name in Dimension._fields} | {"frequency": FREQUENCY}
"""What a unit measures that is not defined by others, by the word that stands for its definition."""


class Row(NamedTuple):
    """A row of `units.csv`: the names of a unit, and its definition by a number and others, or by `_BASE`."""

    names: str
    definition: str
    prefixed: str
    """Those of the names before which a short prefix may stand; a long one stands before the longer names."""
    remark: str
    """Where a value is from, or which of several is meant."""


_LINES = resources.files("rigidcli.model").joinpath("units.csv").read_text("utf-8").splitlines()

TABLE = tuple(Row(*line.split(",")) for line in _LINES[1:])
"""The units of mechanics courses."""

_REFUSED = {
    "degC": ("has its zero elsewhere than the kelvin", "write a temperature in `K`"),
    "degF": ("has its zero elsewhere than the kelvin", "write a temperature in `K`"),
    "mil": ("is a length to some and an angle to others", "write `thou` or `mrad`"),
    "ton": ("differs from country to country", "write `t`, `long_ton` or `short_ton`"),
    "month": ("has no fixed length", "write `d`"),
    "rads": ("is a dose of radiation", "write `rad`"),
    "Nm": ("is not a unit but a product of two", "write `N m`"),
}
"""Names that are likely to mean something else than their reader would take them for: why, and a hint."""

_ONE = Unit("1", Fraction(1), 0, DIMENSIONLESS)

_DEFINED = {name: row.definition for row in TABLE for name in row.names.split()}
"""The definition of each name in the table."""

_SYMBOLS = frozenset(name for row in TABLE for name in row.prefixed.split())
"""The units before which a short prefix may stand."""

_WORDS = frozenset(name for row in TABLE if row.prefixed for name in row.names.split() if len(name) > 3)
"""The units before which a long prefix may stand."""

_DEFINITION = re.compile(r"(?:(pi|[0-9][^ /]*)(?:/(pi|[^ ]+))? )?(.+)")
"""The number in a definition, if there is one, its divisor, and the units."""


def _may_follow(prefix: str) -> frozenset[str]:
    return _SYMBOLS if len(prefix) <= 2 else _WORDS


def known_names() -> list[str]:
    """Every name of the table, those with an SI prefix too."""
    prefixed = (prefix + name for prefix in PREFIXES for name in sorted(_may_follow(prefix)))
    return list(dict.fromkeys(["1", *_DEFINED, *prefixed]))


def _from_table(name: str) -> Unit | None:
    if name == "1":
        return _ONE
    if name in _DEFINED:
        return _defined(name, _DEFINED[name])
    for prefix, power in PREFIXES.items():
        rest = name.removeprefix(prefix)
        if rest != name and rest in _may_follow(prefix):
            unit = _named(rest)
            return replace(unit, text=name, factor=unit.factor * Fraction(10) ** power)
    return None


def is_unit(name: str) -> bool:
    """Whether a name is that of a unit."""
    return _from_table(name) is not None


def _defined(name: str, definition: str) -> Unit:
    """The unit that a row of the table defines by others: `550 ft lbf/s`, `1/16 lb`, `pi/180 rad`."""
    if definition in _BASE:
        return Unit(name, Fraction(1), 0, _BASE[definition])
    found = _DEFINITION.fullmatch(definition)
    assert found is not None
    unit = parse_unit(found[3])
    for number, sign in ((found[1], 1), (found[2], -1)):
        pi_power = sign if number == "pi" else 0
        factor = Fraction(1 if pi_power else number or 1) ** sign
        unit = unit.times(Unit("", factor, pi_power, DIMENSIONLESS))
    return replace(unit, text=name)


def _named(name: str) -> Unit:
    if name in _REFUSED:
        reason, hint = _REFUSED[name]
        raise ValueProblem(f"`{name}` {reason}", hint=hint)
    unit = _from_table(name)
    if unit is None:
        raise ValueProblem(f"unknown unit `{name}`", hint=_hint_for(name))
    return unit


@lru_cache(maxsize=128)
def _hint_for(name: str) -> str:
    stem = name.rstrip("0123456789")
    if stem != name and _from_table(stem):
        return f"write a power as `{stem}^{name.removeprefix(stem)}`"
    if same := [known for known in known_names() if known.lower() == name.lower()]:
        return f"case matters, did you mean {_listed(same)}?"
    near = get_close_matches(name, known_names(), cutoff=0.7)
    if near:
        return f"did you mean {_listed(near)}?"
    return "units are those of the SI with their prefixes, and others of mechanics, `rigidcli explain units`"


def _listed(texts: list[str]) -> str:
    return " or ".join(f"`{text}`" for text in texts)


# --- reading

_SPELLINGS = str.maketrans(
    {"°": "deg", "′": "arcmin", "″": "arcsec", "Å": "angstrom", "\u212b": "angstrom"}
    | {"μ": "µ", "\u2126": "Ω", "ℓ": "l", "·": "*", "⋅": "*", "−": "-"}
)
"""Characters for which ASCII, or another character of the same look, is read."""

_JOINED = re.compile(r"(?<=[^\W_])[.-](?=[^\W\d_])")
"""The point of `kg.m^2` and the hyphen of `N-m`."""

_TOKEN = re.compile(r"[^\W\d_]\w*|1(?=\s*/)|(?:\^|\*\*)\s*[-+]?[0-9]+|\S")
"""A name, a power, or any other character, which is a sign or an error."""


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """The unit that a text such as `g/cm^3`, `N m` or `1/s` names.

    Raises:
        ValueProblem: the text is no unit, or names one that is unknown, ambiguous, offset
            (`degC`), or too large or too small for a float.
    """
    if len(text) > MAX_TEXT:
        raise ValueProblem(f"a unit of {len(text)} characters, expected at most {MAX_TEXT}")
    plain = re.sub(SUPERSCRIPT, lambda raised: "^" + raised[0].translate(LOWERED), text.translate(_SPELLINGS))
    tokens = deque([*_TOKEN.findall(_JOINED.sub("*", plain)), ""])
    unit = replace(_product(tokens), text=text.strip())
    if tokens[0]:
        raise _unexpected(tokens[0])
    if unit.scale == 0:
        raise ValueProblem(f"a value in `{unit.text}` is too small")
    return unit


def _product(tokens: deque[str]) -> Unit:
    """Factors up to the end or a closing parenthesis, which is left in place."""
    unit = _factor(tokens)
    while tokens[0] not in ("", ")"):
        sign = tokens.popleft() if tokens[0] in ("*", "/") else "*"
        unit = unit.times(_factor(tokens), -1 if sign == "/" else 1)
    return unit


def _factor(tokens: deque[str]) -> Unit:
    """A name or a parenthesis, with its power."""
    head = tokens.popleft()
    if head == "(":
        unit = _product(tokens)
        if tokens.popleft() != ")":
            raise ValueProblem("a parenthesis is not closed in a unit")
    elif head == "1" or head[:1].isalpha():
        unit = _named(head)
    else:
        raise _unexpected(head)
    if len(tokens[0]) > 1 and tokens[0][0] in "^*":
        power = int(tokens.popleft().lstrip("^* "))
        bits = max(unit.factor.numerator, unit.factor.denominator).bit_length()
        if abs(power) > MAX_POWER or bits * abs(power) > MAX_BITS:
            raise ValueProblem(f"power {power} in a unit is out of bounds", hint=f"at most {MAX_POWER}")
        unit = _ONE.times(unit, power)
    return unit


def _unexpected(head: str) -> ValueProblem:
    return ValueProblem(f"unexpected `{head}` in a unit" if head else "a unit ends too early")


# --- fitness


def check_dimension(text: str, given: Dimension, expected: Dimension) -> None:
    """Refuse `text`, a unit or an expression, that has another dimension than expected.

    A radian counts as 1: an angle may be left out (`1/s` for an angular velocity) or join a
    product (`kg m^2 rad/s`), but a mere angle is no pure number. Hertz and radians never mix.

    Raises:
        ValueProblem: the dimensions differ; the message names both.
    """
    rest = given._replace(angle=0)
    angle_fits = given.angle in (0, expected.angle) or (expected.angle == 0 and rest != DIMENSIONLESS)
    if angle_fits and rest == expected._replace(angle=0):
        return
    hint = None
    if given.cycle != expected.cycle:
        hint = "a hertz may count turns or radians, 2 pi apart: write `rev/s` or `rad/s`"
    raise ValueProblem(f"{shown(text)} is {described(given)}, expected {described(expected)}", hint=hint)


def described(dimension: Dimension) -> str:
    """A dimension in a sentence, with its article: `a length (m)`."""
    name = _DIMENSION_NAMES.get(dimension, f"quantity in {dimension}")
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"


# --- quantities

_QUANTITY = re.compile(
    rf"""\s*(?P<digits>[-+−]?+(?>[0-9]++\.?+[0-9]*+|\.[0-9]++))
    (?: [eE](?P<e>[-+−]?[0-9]++)
      | \s*[*·⋅]\s*10 (?: (?:\^|\*\*)(?P<power>[-+−]?[0-9]++) | (?P<raised>{SUPERSCRIPT}) )
    )?+
    (?P<gap>\s*)(?P<unit>(?: (?!{SUPERSCRIPT})[^\W\d_] | [°′″] | (?<=\s)1/ ).*)""",
    re.DOTALL | re.VERBOSE,
)


class Written(NamedTuple):
    """A quantity as it is typed: a decimal number of any size, and what may be a unit."""

    digits: str
    unit: str
    touches: bool
    """Whether there is no blank between them."""


def split_quantity(text: str) -> Written | None:
    """The number and the unit of `5 cm` or `6*10^24 kg`; None for what may only be an expression.

    A quantity is a decimal number and what begins like a unit: a letter, `°`, `′`, `″`, or `1/` after a
    blank. Neither part is judged here.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None
    power = match["e"] or match["power"] or (match["raised"] or "").translate(LOWERED)
    number = f"{match['digits']}e{power}" if power else match["digits"]
    return Written(number.replace("−", "-"), match["unit"].rstrip(), not match["gap"])


_QUOTIENT = re.compile(r"\s*(\d+(?:\.\d*)?)\s*/\s*(\d+(?:\.\d*)?)\s+(\S.*)")
"""A quotient of two numbers and what may be a unit."""


def quantity_meant(text: str) -> str | None:
    """The quantity `0.5 m` that is meant by `1/2 m`, which cannot be read; None for other texts."""
    match = _QUOTIENT.fullmatch(text)
    if match is None or not is_unit(match[3]) or not float(match[2]):
        return None
    return f"{float(match[1]) / float(match[2])!r} {match[3]}"
