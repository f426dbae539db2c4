"""Units: the text of a unit becomes an exact factor to SI and a dimension.

A literal table defines the units of mechanics courses, each by others. What follows is exact: a rational
factor times a power of pi. A name that the table lacks is refused, with the names that are like it.

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
"""SI prefixes with their powers of ten; up to two letters stand before symbols, the others before words."""

_SYMBOLS = frozenset([
    "m", "g", "s", "sec", "A", "K", "mol", "rad", "deg", "Hz", "N", "J", "W", "Pa", "C", "V", "T", "F", "H",
    "Ω", "ohm", "Wb", "L", "l", "eV", "cal", "Wh", "yr", "ly", "pc", "Da", "P", "St", "Gal",
])
# fmt: on
"""The units before which a short prefix may stand; a long one stands before their longer names."""

TABLE: tuple[tuple[str, Unit | str], ...] = (
    ("kg", Unit("kg", Fraction(1), 0, MASS)),
    ("m meter meters metre metres", Unit("m", Fraction(1), 0, LENGTH)),
    ("s sec secs second seconds", Unit("s", Fraction(1), 0, TIME)),
    ("A ampere amperes", Unit("A", Fraction(1), 0, CURRENT)),
    ("K kelvin kelvins", Unit("K", Fraction(1), 0, TEMPERATURE)),
    ("mol mole moles", Unit("mol", Fraction(1), 0, Dimension(amount=1))),
    ("rad radian radians", Unit("rad", Fraction(1), 0, ANGLE)),
    ("Hz hertz", Unit("Hz", Fraction(1), 0, FREQUENCY)),
    ("g gram grams", "1/1000 kg"),
    ("N newton newtons", "kg m/s^2"),
    ("J joule joules", "N m"),
    ("W watt watts", "J/s"),
    ("Pa pascal pascals", "N/m^2"),
    ("C coulomb coulombs", "A s"),
    ("V volt volts", "W/A"),
    ("T tesla teslas", "V s/m^2"),
    ("F farad farads", "C/V"),
    ("H henry", "V s/A"),
    ("Ω ohm ohms", "V/A"),
    ("Wb weber webers", "V s"),
    ("min mins minute minutes", "60 s"),
    ("h hr hrs hour hours", "60 min"),
    ("d day days", "24 h"),
    ("sidereal_day sidereal_days", "1/1.00273790935079524 d"),
    ("week weeks", "7 d"),
    ("fortnight fortnights", "14 d"),
    ("a yr yrs year years julian_year julian_years", "365.25 d"),
    ("sidereal_year sidereal_years", "365.256363004 d"),
    ("tropical_year tropical_years", "365.242190402 d"),
    ("century centuries", "100 a"),
    ("in inch inches", "2.54 cm"),
    ("ft foot feet", "12 in"),
    ("yd yard yards", "3 ft"),
    ("mi mile miles", "5280 ft"),
    ("survey_foot", "1200/3937 m"),  # of the United States
    ("fathom fathoms", "6 survey_foot"),
    ("furlong furlongs", "660 survey_foot"),
    ("nmi nautical_mile nautical_miles", "1852 m"),
    ("thou", "1/1000 in"),
    ("micron microns", "1e-6 m"),
    ("angstrom angstroms", "1e-10 m"),
    ("fermi", "1e-15 m"),
    ("au astronomical_unit astronomical_units", "149597870700 m"),
    ("ly light_year light_years lightyear lightyears", "c a"),
    # IAU 2015 resolution B2
    ("pc parsec parsecs", Unit("pc", Fraction(648_000 * 149_597_870_700), -1, LENGTH)),
    ("R_sun solar_radius solar_radii", "695700 km"),  # nominal values of IAU 2015 resolution B3
    ("R_earth earth_radius earth_radii", "6378.1 km"),
    ("GM_sun", "1.3271244e20 m^3/s^2"),
    ("GM_earth", "3.986004e14 m^3/s^2"),
    ("M_sun solar_mass solar_masses", "1e11/6.67430 kg m^-3 s^2 GM_sun"),  # G of CODATA 2022, measured
    ("M_earth earth_mass earth_masses", "1e11/6.67430 kg m^-3 s^2 GM_earth"),
    ("t tonne tonnes metric_ton metric_tons", "1000 kg"),
    ("lb lbs lbm pound pounds", "0.45359237 kg"),
    ("oz ounce ounces", "1/16 lb"),
    ("grain grains", "1/7000 lb"),
    ("carat carats", "200 mg"),
    ("stone", "14 lb"),
    ("short_ton short_tons", "2000 lb"),
    ("long_ton long_tons", "2240 lb"),
    ("slug slugs", "lbf s^2/ft"),
    ("slinch blob", "lbf s^2/in"),
    ("u Da amu dalton daltons", "1.66053906892e-27 kg"),  # measured, CODATA 2022
    ("deg degree degrees", Unit("deg", Fraction(1, 180), 1, ANGLE)),
    ("gon gons grad grads", "0.9 deg"),
    ("arcmin arcminute arcminutes", "1/60 deg"),
    ("arcsec arcsecond arcseconds", "1/60 arcmin"),
    ("mas milliarcsecond milliarcseconds", "1/1000 arcsec"),
    ("rev revolution revolutions turn turns cycle cycles", "360 deg"),
    ("rpm", "rev/min"),
    ("rps", "rev/s"),
    ("ha hectare hectares", "10000 m^2"),
    ("acre acres", "43560 survey_foot^2"),
    ("L l liter liters litre litres", "dm^3"),
    ("cc", "cm^3"),
    ("gal gallon gallons", "231 in^3"),  # of the United States
    ("mph", "mi/h"),
    ("kph", "km/h"),
    ("fps", "ft/s"),
    ("kn kt knot knots", "nmi/h"),
    ("c speed_of_light", "299792458 m/s"),
    ("g0 g_0 gn g_n standard_gravity", "9.80665 m/s^2"),
    ("Gal", "cm/s^2"),
    ("lbf pound_force", "lb g0"),
    ("ozf ounce_force", "oz g0"),
    ("kip kips", "1000 lbf"),
    ("pdl poundal poundals", "lb ft/s^2"),
    ("kgf kilogram_force", "kg g0"),
    ("gf gram_force", "g g0"),
    ("dyn dyne dynes", "g cm/s^2"),
    ("erg ergs", "dyn cm"),
    ("eV electron_volt electron_volts electronvolt electronvolts", "1.602176634e-19 J"),
    ("cal calorie calories", "4.184 J"),  # thermochemical
    ("Wh watt_hour watt_hours", "W h"),
    ("Btu BTU", "1055.056 J"),
    ("ft_lb foot_pound foot_pounds", "ft lbf"),
    ("tTNT ton_TNT", "1e9 cal"),
    ("hp horsepower", "550 ft lbf/s"),
    ("metric_horsepower", "75 kgf m/s"),
    ("bar", "100 kPa"),
    ("mbar millibar millibars", "1/1000 bar"),
    ("atm atmosphere atmospheres", "101325 Pa"),
    ("torr", "1/760 atm"),
    ("mmHg", "13.5951 g/cm^3 g0 mm"),
    ("inHg", "13.5951 g/cm^3 g0 in"),
    ("cmH2O", "g/cm^3 g0 cm"),
    ("psi", "lbf/in^2"),
    ("ksi", "kip/in^2"),
    ("P poise", "0.1 Pa s"),
    ("St stokes", "cm^2/s"),
)
"""Names with a definition by a number and other units; base units, and those with pi, as they are."""

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

_ROWS = {"1": ("1", _ONE)} | {name: row for row in TABLE for name in row[0].split()}
"""The row of the table in which a name stands."""

_WORDS = frozenset(name for symbol in _SYMBOLS for name in _ROWS[symbol][0].split() if len(name) > 3)
"""The units before which a long prefix may stand."""


def _may_follow(prefix: str) -> frozenset[str]:
    return _SYMBOLS if len(prefix) <= 2 else _WORDS


def known_names() -> list[str]:
    """Every name of the table, those with an SI prefix too."""
    prefixed = (prefix + name for prefix in PREFIXES for name in sorted(_may_follow(prefix)))
    return list(dict.fromkeys([*_ROWS, *prefixed]))


def _from_table(name: str) -> Unit | None:
    if name in _ROWS:
        meaning = _ROWS[name][1]
        return replace(meaning, text=name) if isinstance(meaning, Unit) else _defined(name, meaning)
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
    """The unit that a row of the table defines by others: `550 ft lbf/s`, `1/16 lb`, `lbf/in^2`."""
    number, _, others = definition.partition(" ") if definition[0].isdigit() else ("1", "", definition)
    numerator, _, denominator = number.partition("/")
    unit = parse_unit(others)
    factor = unit.factor * Fraction(numerator) / Fraction(denominator or 1)
    return replace(unit, text=name, factor=factor)


def _named(name: str) -> Unit:
    if name in _REFUSED:
        reason, hint = _REFUSED[name]
        raise ValueProblem(f"`{name}` {reason}", hint=hint)
    unit = _from_table(name)
    if unit is None:
        raise ValueProblem(f"unknown unit `{name}`", hint=_hint_for(name))
    return unit


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
