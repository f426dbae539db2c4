"""Units: the text of a unit becomes an exact factor to SI and a dimension.

A literal table holds the everyday units of mechanics: a rational factor times a power of pi. A name
that the table lacks is asked of pint, which is slow to start and imported only then. pint sees one
bare name at a time; products and powers are read here, within bounds.

    unit   =  factor, then more of them joined by `*`, `·`, a blank (all of them products) or `/`
    factor =  (name | `(` unit `)`) [power]        `1` may stand for a name before `/`, as in `1/s`
    power  =  `^n`, `**n` or superscript digits    a whole number from -12 to 12

A product is worked from left to right and a blank binds like `*`: `N m/rad s` is `(N m/rad) s`.
Write `kg/(m s)` for several names below the line. Case matters: `Mm` is not `mm`.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any, NamedTuple

from rigidcli.errors import ValueProblem, shown

MAX_TEXT = 200  # characters of a unit
MAX_POWER = 12
MAX_BITS = 4096  # of a factor's numerator or denominator: far beyond any float, still instant

# Rational pi, 60 digits, so that a factor is rounded only when it becomes a float.
_PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494")


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


DIMENSIONLESS = Dimension()
MASS = Dimension(mass=1)
LENGTH = Dimension(length=1)
TIME = Dimension(time=1)
ANGLE = Dimension(angle=1)
ANGULAR_VELOCITY = Dimension(angle=1, time=-1)
FREQUENCY = Dimension(cycle=1, time=-1)
VOLUME = Dimension(length=3)
VELOCITY = Dimension(length=1, time=-1)
ACCELERATION = Dimension(length=1, time=-2)
LINE_DENSITY = Dimension(mass=1, length=-1)
AREA_DENSITY = Dimension(mass=1, length=-2)
DENSITY = Dimension(mass=1, length=-3)
MOMENT_OF_INERTIA = Dimension(mass=1, length=2)
FORCE = Dimension(mass=1, length=1, time=-2)
ENERGY = Dimension(mass=1, length=2, time=-2)  # a torque, too
POWER = Dimension(mass=1, length=2, time=-3)
PRESSURE = Dimension(mass=1, length=-1, time=-2)
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
    Dimension(length=2): "area (m^2)",
    VOLUME: "volume (m^3)",
    VELOCITY: "velocity (m/s)",
    ACCELERATION: "acceleration (m/s^2)",
    LINE_DENSITY: "mass per length (kg/m)",
    AREA_DENSITY: "mass per area (kg/m^2)",
    DENSITY: "density (kg/m^3)",
    MOMENT_OF_INERTIA: "moment of inertia (kg m^2)",
    Dimension(mass=1, length=1, time=-1): "momentum (kg m/s)",
    Dimension(mass=1, length=2, time=-1): "angular momentum (kg m^2/s)",
    Dimension(mass=1, time=-2): "stiffness (N/m)",
    FORCE: "force (N)",
    ENERGY: "torque or energy (N m)",
    POWER: "power (W)",
    PRESSURE: "pressure (Pa)",
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

# Powers of ten. Prefixes of one or two letters go before symbols, the longer ones before words.
# fmt: off
_PREFIXES = {
    "q": -30, "r": -27, "y": -24, "z": -21, "a": -18, "f": -15, "p": -12, "n": -9, "u": -6, "µ": -6,
    "m": -3, "c": -2, "d": -1, "da": 1, "h": 2, "k": 3, "M": 6, "G": 9, "T": 12, "P": 15, "E": 18,
    "Z": 21, "Y": 24, "R": 27, "Q": 30,
    "quecto": -30, "ronto": -27, "yocto": -24, "zepto": -21, "atto": -18, "femto": -15, "pico": -12,
    "nano": -9, "micro": -6, "milli": -3, "centi": -2, "deci": -1, "deca": 1, "hecto": 2, "kilo": 3,
    "mega": 6, "giga": 9, "tera": 12, "peta": 15, "exa": 18, "zetta": 21, "yotta": 24, "ronna": 27,
    "quetta": 30,
}
# fmt: on

_PREFIXED = (  # symbols, words, factor to SI, dimension
    ("m", "meter meters metre metres", 1, LENGTH),
    ("g", "gram grams", Fraction(1, 1000), MASS),
    ("s", "second seconds", 1, TIME),
    ("A", "ampere amperes", 1, CURRENT),
    ("K", "kelvin kelvins", 1, TEMPERATURE),
    ("mol", "mole moles", 1, Dimension(amount=1)),
    ("rad", "radian radians", 1, ANGLE),
    ("Hz", "hertz", 1, FREQUENCY),
    ("N", "newton newtons", 1, FORCE),
    ("J", "joule joules", 1, ENERGY),
    ("W", "watt watts", 1, POWER),
    ("Pa", "pascal pascals", 1, PRESSURE),
    ("C", "coulomb coulombs", 1, Dimension(current=1, time=1)),
    ("V", "volt volts", 1, POWER.times(CURRENT, -1)),
    ("T", "tesla teslas", 1, Dimension(mass=1, time=-2, current=-1)),
    ("L l", "liter liters litre litres", Fraction(1, 1000), VOLUME),
    ("eV", "electron_volt electron_volts", Fraction("1.602176634e-19"), ENERGY),
    ("cal", "calorie calories", Fraction("4.184"), ENERGY),  # thermochemical
    ("Wh", "", 3600, ENERGY),
)

_INCH = Fraction("0.0254")
_FOOT = 12 * _INCH
_MILE = 5280 * _FOOT
_POUND = Fraction("0.45359237")
_GRAVITY = Fraction("9.80665")
_DAY = 86_400
_YEAR = 36525 * _DAY // 100  # Julian
_AU = 149_597_870_700
_DEGREE = Fraction(1, 180)  # of pi
_DALTON = Fraction("1.66053906892e-27")  # CODATA 2022; the one entry that is measured, not defined

_OTHER = (  # names, factor to SI, power of pi, dimension
    ("min minute minutes", 60, 0, TIME),
    ("h hr hour hours", 3600, 0, TIME),
    ("d day days", _DAY, 0, TIME),
    ("week weeks", 7 * _DAY, 0, TIME),
    ("a yr year years", _YEAR, 0, TIME),
    ("in inch inches", _INCH, 0, LENGTH),
    ("ft foot feet", _FOOT, 0, LENGTH),
    ("yd yard yards", 3 * _FOOT, 0, LENGTH),
    ("mi mile miles", _MILE, 0, LENGTH),
    ("nmi nautical_mile nautical_miles", 1852, 0, LENGTH),
    ("micron microns", Fraction(1, 10**6), 0, LENGTH),
    ("angstrom angstroms", Fraction(1, 10**10), 0, LENGTH),
    ("au astronomical_unit astronomical_units", _AU, 0, LENGTH),
    ("ly light_year light_years", 299_792_458 * _YEAR, 0, LENGTH),
    ("pc parsec parsecs", 648_000 * _AU, -1, LENGTH),  # IAU 2015; pint has an arcsecond's tangent
    ("kpc kiloparsec kiloparsecs", 648_000_000 * _AU, -1, LENGTH),
    ("Mpc megaparsec megaparsecs", 648_000_000_000 * _AU, -1, LENGTH),
    ("t tonne tonnes", 1000, 0, MASS),
    ("lb pound pounds", _POUND, 0, MASS),
    ("oz ounce ounces", _POUND / 16, 0, MASS),
    ("slug slugs", _POUND * _GRAVITY / _FOOT, 0, MASS),
    ("u Da amu dalton daltons", _DALTON, 0, MASS),
    ("deg degree degrees", _DEGREE, 1, ANGLE),
    ("arcmin arcminute arcminutes", _DEGREE / 60, 1, ANGLE),
    ("arcsec arcsecond arcseconds", _DEGREE / 3600, 1, ANGLE),
    ("mas", _DEGREE / 3_600_000, 1, ANGLE),
    ("rev revolution revolutions turn turns cycle cycles", 2, 1, ANGLE),
    ("rpm", Fraction(1, 30), 1, ANGULAR_VELOCITY),
    ("rps", 2, 1, ANGULAR_VELOCITY),
    ("mph", _MILE / 3600, 0, VELOCITY),
    ("kph", Fraction(1000, 3600), 0, VELOCITY),
    ("kn knot knots", Fraction(1852, 3600), 0, VELOCITY),
    ("g0 g_0 gn g_n", _GRAVITY, 0, ACCELERATION),
    ("lbf", _POUND * _GRAVITY, 0, FORCE),
    ("kgf", _GRAVITY, 0, FORCE),
    ("dyn dyne dynes", Fraction(1, 10**5), 0, FORCE),
    ("erg ergs", Fraction(1, 10**7), 0, ENERGY),
    ("hp horsepower", 550 * _FOOT * _POUND * _GRAVITY, 0, POWER),
    ("bar", 100_000, 0, PRESSURE),
    ("mbar", 100, 0, PRESSURE),
    ("atm atmosphere atmospheres", 101_325, 0, PRESSURE),
    ("psi", _POUND * _GRAVITY / _INCH**2, 0, PRESSURE),
)

_REFUSED = {  # names to which pint has an answer, but hardly the one that is meant: why, and a hint
    "degC": ("has its zero elsewhere than the kelvin", "write a temperature in `K`"),
    "degF": ("has its zero elsewhere than the kelvin", "write a temperature in `K`"),
    "mil": ("is a length to some and an angle to others", "write `thou` or `mrad`"),
    "ton": ("differs from country to country", "write `t`, `long_ton` or `short_ton`"),
    "rads": ("is a dose of radiation", "write `rad`"),
    "Nm": ("is not a unit but a product of two", "write `N m`"),
}

_ONE = Unit("1", Fraction(1), 0, DIMENSIONLESS)


def _rows() -> Iterator[Unit]:
    for symbols, words, factor, dimension in _PREFIXED:
        for name in f"{symbols} {words}".split():
            yield Unit(name, Fraction(factor), 0, dimension)
    for names, factor, pi_power, dimension in _OTHER:
        for name in names.split():
            yield Unit(name, Fraction(factor), pi_power, dimension)


_UNITS = {unit.text: unit for unit in (_ONE, *_rows())}
_SYMBOLS = frozenset(symbol for symbols, *_ in _PREFIXED for symbol in symbols.split())
_WORDS = frozenset(word for _, words, *_ in _PREFIXED for word in words.split())


def _may_follow(prefix: str) -> frozenset[str]:
    return _SYMBOLS if len(prefix) <= 2 else _WORDS


def known_names() -> list[str]:
    """Every name of the table, those with an SI prefix too."""
    return [*_UNITS, *(prefix + name for prefix in _PREFIXES for name in sorted(_may_follow(prefix)))]


def _from_table(name: str) -> Unit | None:
    if name in _UNITS:
        return _UNITS[name]
    for cut in range(1, len(name)):
        prefix, rest = name[:cut], name[cut:]
        if prefix in _PREFIXES and rest in _may_follow(prefix):
            unit, power = _UNITS[rest], _PREFIXES[prefix]
            return replace(unit, text=name, factor=unit.factor * Fraction(10) ** power)
    return None


# --- names that only pint knows


@cache
def _pint() -> Any:
    """The registry of pint, in exact arithmetic."""
    import pint

    return pint.UnitRegistry(non_int_type=Fraction)


def _from_pint(name: str) -> Unit | None:
    """The unit of one bare name; None where pint knows none, or none of mechanics."""
    registry = _pint()
    try:
        if name not in registry:
            return None
    except AttributeError:  # what looks like one of Python's own names to pint
        return None
    try:
        zero, one = (registry.Quantity(Fraction(n), name).to_root_units() for n in (0, 1))
    except (TypeError, ArithmeticError):  # a logarithm, which has no fractions
        return None
    if zero.magnitude != 0 or not isinstance(one.magnitude, Fraction):  # an offset; a root
        return None
    pi = registry.Quantity(Fraction(1), "pi").to_root_units().magnitude
    # pint has folded its rational pi into the factor: the plainest fraction is the one without.
    fractions = [(one.magnitude / pi**power, power) for power in range(-2, 3)]
    factor, pi_power = min(fractions, key=lambda pair: pair[0].numerator * pair[0].denominator)
    unit = Unit(name, factor, pi_power, DIMENSIONLESS)
    for root, power in one.unit_items():
        if root not in _UNITS or power != int(power):  # a candela, a bit; the root of a gram
            return None
        unit = unit.times(_UNITS[root], int(power))
    if unit.dimension == Dimension(time=-1):  # a hertz by another name
        return replace(unit, dimension=FREQUENCY)
    return None if unit.dimension == DIMENSIONLESS else unit


def _named(name: str) -> Unit:
    if name in _REFUSED:
        reason, hint = _REFUSED[name]
        raise ValueProblem(f"`{name}` {reason}", hint=hint)
    unit = _from_table(name) or _from_pint(name)
    if unit is None:
        raise ValueProblem(f"unknown unit `{name}`", hint=_hint_for(name))
    return unit


def _hint_for(name: str) -> str | None:
    stem = name.rstrip("0123456789")
    if stem != name and _from_table(stem):
        return f"write a power as `{stem}^{name.removeprefix(stem)}`"
    if same := [known for known in known_names() if known.lower() == name.lower()]:
        return f"case matters, did you mean {_listed(same)}?"
    near = get_close_matches(name, known_names(), cutoff=0.7)
    return f"did you mean {_listed(near)}?" if near else None


def _listed(texts: list[str]) -> str:
    return " or ".join(f"`{text}`" for text in texts)


# --- reading

_SPELLINGS = str.maketrans(
    {"°": "deg", "′": "arcmin", "″": "arcsec", "Å": "angstrom", "\u212b": "angstrom"}
    | {"μ": "µ", "·": "*", "⋅": "*", "−": "-"}
)
_RAISED = re.compile("⁻?[⁰¹²³⁴-⁹]+")
_LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")

# A name, a power, or any other character, which is a sign or an error.
_TOKEN = re.compile(r"[^\W\d_]\w*|1(?=\s*/)|(?:\^|\*\*)\s*[-+]?[0-9]+|\S")


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """The unit that a text such as `g/cm^3`, `N m` or `1/s` names.

    Raises:
        ValueProblem: the text is no unit, or names one that is unknown, ambiguous, offset
            (`degC`), or too large or too small for a float.
    """
    if len(text) > MAX_TEXT:
        raise ValueProblem(f"a unit of {len(text)} characters, expected at most {MAX_TEXT}")
    plain = _RAISED.sub(lambda raised: "^" + raised[0].translate(_LOWERED), text.translate(_SPELLINGS))
    tokens = deque([*_TOKEN.findall(plain), ""])
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

_NUMBER_AND_UNIT = re.compile(
    r"\s*([-+−]?+(?>[0-9]++\.?+[0-9]*+|\.[0-9]++)(?>[eE][-+−]?[0-9]++)?+)(\s*)((?:[^\W\d_]|[°′″]|1/).*)",
    re.DOTALL,
)


def split_quantity(text: str) -> tuple[str, str] | None:
    """The number and the unit of `5 cm`, as texts; None for what may be an expression instead.

    A quantity is a decimal number, white space, and what begins like a unit: a letter, `°`, `′`,
    `″` or `1/`. Neither part is judged here; the number may have any size.
    """
    match = _NUMBER_AND_UNIT.fullmatch(text)
    return (match[1].replace("−", "-"), match[3].rstrip()) if match and match[2] else None


def looks_like_missing_space(text: str) -> bool:
    """Whether a number and a letter touch, as in `5cm`."""
    match = _NUMBER_AND_UNIT.fullmatch(text)
    return match is not None and not match[2]
