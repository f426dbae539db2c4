"""Units: the text of a unit becomes an exact factor to SI and a dimension.

The table `units.csv` defines the units of mechanics courses, each by others. What follows is exact: a
rational factor times a power of pi. A name that the table lacks is refused, with the names that are like it.

    unit   =  factor, then more of them joined by `*`, `·`, a blank (all of them products) or `/`
    factor =  (name | `(` unit `)`) [power]        `1` may stand for a name before `/`, as in `1/s`
    power  =  `^n`, `**n` or superscript digits    a whole number from -12 to 12

A product is worked from left to right and a blank binds like `*`: `N m/rad s` is `(N m/rad) s`.
A point or a hyphen before a letter is a product, too: `kg.m^2`, `N-m`.
In one word, `rads^-1` and `kgm^2` are the products that fit the dimension of a field.
Write `kg/(m s)` for several names below the line. Case matters: `Mm` is not `mm`.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches
from fractions import Fraction
from functools import lru_cache
from itertools import islice, product
from pathlib import Path
from typing import NamedTuple

from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import DIMENSIONLESS, FREQUENCY, Dimension, check_dimension
from rigidcli.fields.words import NO_UNITS, UNITS_BY_WORD, folded
from rigidcli.language.tokens import LOWERED, SUPERSCRIPT
from rigidcli.suggestions import question

LONGEST_UNIT = 200  # the most characters of a unit: far more than any has, and read at once
HIGHEST_POWER_OF_UNIT = 12  # the largest power in a unit: no law of mechanics has one beyond it
# The most bits of a factor's numerator or denominator: far beyond any float, and still worked at once.
MOST_BITS_OF_FACTOR = 4096
# Pi to 60 digits, so that a factor is rounded only when it becomes a float.
_PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494")


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

        Raises ValueProblem where it is too large for a float.
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

# SI prefixes with their powers of ten; up to two letters stand before symbols, the others before words.
# fmt: off
PREFIXES = {prefix: power for power, prefixes in {
    -30: "q quecto", -27: "r ronto", -24: "y yocto", -21: "z zepto", -18: "a atto", -15: "f femto",
    -12: "p pico", -9: "n nano", -6: "u µ micro", -3: "m milli", -2: "c centi", -1: "d deci", 1: "da deca",
    2: "h hecto", 3: "k kilo", 6: "M mega", 9: "G giga", 12: "T tera", 15: "P peta", 18: "E exa",
    21: "Z zetta", 24: "Y yotta", 27: "R ronna", 30: "Q quetta",
}.items() for prefix in prefixes.split()}
# fmt: on

# The dimensions of units that no other units define, by the word in place of a definition.
_BASE = {name: Dimension(**{name: 1}) for name in Dimension._fields} | {"frequency": FREQUENCY}


class UnitRow(NamedTuple):
    """A row of `units.csv`: the names of a unit, and its definition by a number and others, or by `_BASE`."""

    names: str
    definition: str
    prefixed: str  # the names that take a short prefix, such as k; a long one goes with longer names
    remark: str  # the source of the value, or which of several units of this name it is


_LINES = Path(__file__).with_name("units.csv").read_text("utf-8").splitlines()
TABLE = tuple(UnitRow(*line.split(",")) for line in _LINES[1:])  # the units of mechanics courses

_ONE = Unit("1", Fraction(1), 0, DIMENSIONLESS)

# The rows of the table by each of their names.
_ROWS = {name: row for row in TABLE for name in row.names.split()}


def _may_follow(name: str, prefix: str) -> bool:
    """Whether the prefix may stand before this name: a short one before symbols, a long one before words."""
    row = _ROWS.get(name)
    if row is None or len(prefix) <= 2:
        return row is not None and name in row.prefixed.split()
    return len(name) > 3 and bool(row.prefixed)


def known_names() -> list[str]:
    """Every name of the table, also with the SI prefixes that it may have."""
    prefixed = (prefix + name for prefix in PREFIXES for name in _ROWS if _may_follow(name, prefix))
    return [name for name in dict.fromkeys(["1", *_ROWS, *prefixed]) if name not in NO_UNITS]


@lru_cache(maxsize=1024)
def _from_table(name: str) -> Unit | None:
    if name == "1" or name in _ROWS:
        return _ONE if name == "1" else _defined(name, _ROWS[name].definition)
    for prefix, power in PREFIXES.items():
        rest = name.removeprefix(prefix)
        if rest != name and _may_follow(rest, prefix):
            return _defined(name, f"1e{power} {rest}")
    return None


def is_unit(name: str) -> bool:
    """Whether a name is that of a unit."""
    return _from_table(name) is not None


def _defined(name: str, definition: str) -> Unit:
    """The unit that a row of the table defines by others: `550 ft lbf/s`, `1/16 lb`, `pi/180 rad`."""
    if definition in _BASE:
        return Unit(name, Fraction(1), 0, _BASE[definition])
    number, _, units = definition.partition(" ")
    if not re.match(r"[0-9]|pi", number):
        number, units = "1", definition
    above, _, below = number.partition("/")
    pi_power = (above == "pi") - (below == "pi")
    factor = Fraction(above.replace("pi", "1")) / Fraction((below or "1").replace("pi", "1"))
    return Unit(name, factor, pi_power, DIMENSIONLESS).times(parse_unit(units))


@lru_cache(maxsize=128)
def _hint_for(name: str) -> str:
    stem = name.rstrip("0123456789")
    if stem != name and _from_table(stem):
        return f"write a power as `{stem}^{name.removeprefix(stem)}`"
    if same := [f"`{unit}`" for unit in known_names() if unit.lower() == name.lower()]:
        return f"case matters, {question(*same)}"
    if folded(name) in UNITS_BY_WORD:
        return f"write `{UNITS_BY_WORD[folded(name)][0]}`"
    near = get_close_matches(name, known_names(), cutoff=0.7)
    if product := re.fullmatch(r"(k?g|[km]?N)([ckm]?m)", name):  # products that are often written as one word
        near = [" ".join(product.groups())]
    if near:
        return question(*(f"`{unit}`" for unit in near))
    return "units are those of the SI with their prefixes, and others of mechanics, `rigidcli explain units`"


# --- reading

# Characters for which ASCII, or another character of the same look, is read.
_SPELLINGS = str.maketrans(
    {"°": "deg", "′": "arcmin", "″": "arcsec", "Å": "angstrom", "\u212b": "angstrom"}
    | {"μ": "µ", "\u2126": "Ω", "ℓ": "l", "·": "*", "⋅": "*", "−": "-"}
)
_JOINED = re.compile(r"(?<=[^\W_])[.-](?=[^\W\d_])")  # the point of `kg.m^2` and the hyphen of `N-m`
# A name, a power, or any other character, which is a sign or an error.
_TOKEN = re.compile(r"[^\W\d_]\w*|1(?=\s*/)|(?:\^|\*\*)\s*[-+]?[0-9]+|\S")


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """The unit that a text such as `g/cm^3`, `N m` or `1/s` names.

    Raises ValueProblem for a text that is no unit, or names one that is unknown, ambiguous, offset (`degC`),
    or too large or too small for a float.
    """
    if len(text) > LONGEST_UNIT:
        raise ValueProblem(f"a unit of {len(text)} characters, expected at most {LONGEST_UNIT}")
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
    head = tokens.popleft()
    if head == "(":
        unit = _product(tokens)
        if tokens.popleft() != ")":
            raise ValueProblem("a parenthesis is not closed in a unit")
    elif head == "1" or head[:1].isalpha():
        if head in NO_UNITS:
            reason, _, hint = NO_UNITS[head].partition(": ")
            raise ValueProblem(f"`{head}` {reason}", hint=hint)
        if (found := _from_table(head)) is None:
            raise ValueProblem(f"unknown unit `{head}`", hint=_hint_for(head))
        unit = found
    else:
        raise _unexpected(head)
    if len(tokens[0]) > 1 and tokens[0][0] in "^*":
        power = int(tokens.popleft().lstrip("^* "))
        bits = max(unit.factor.numerator, unit.factor.denominator).bit_length()
        if abs(power) > HIGHEST_POWER_OF_UNIT or bits * abs(power) > MOST_BITS_OF_FACTOR:
            raise ValueProblem(
                f"power {power} in a unit is out of bounds", hint=f"at most {HIGHEST_POWER_OF_UNIT}"
            )
        unit = _ONE.times(unit, power)
    return unit


def _unexpected(head: str) -> ValueProblem:
    return ValueProblem(f"unexpected `{head}` in a unit" if head else "a unit ends too early")


# --- units in one word

# Units that people run together; a power belongs to the last, as in `kgm^2` and `rads^-1`.
_SYMBOLS = ("rad", "rev", "deg", "min", "kg", "km", "cm", "mm", "kN", "N", "J", "W", "m", "s", "g", "h")
MOST_READINGS_OF_UNIT = 8  # the most readings of one unit

# The pattern of a name in a unit with its power.
UNIT_NAME = r"(?P<name>[^\W\d]\w*)(?P<power>-\d+|\s*(?:\^|\*\*)\s*(?:\(\s*[-+]?\d+\s*\)|[-+]?\d+))?"
_UNIT_NAME = re.compile(UNIT_NAME)


def names_of_units(text: str) -> list[str]:
    """The names in the text of a unit."""
    return [match["name"] for match in _UNIT_NAME.finditer(text)]


def unit_readings(text: str, spelled: Callable[[str, str], list[str]]) -> list[Unit]:
    """The readings of a unit; `spelled` gives those of one name with its power. Raises ValueProblem."""
    text = text.replace("°", "deg") if not re.search(r"°\s*[A-Za-z]|\w°", text) else text
    names = [spelled(match["name"], power_of(match["power"])) for match in _UNIT_NAME.finditer(text)]
    units: dict[tuple[Fraction, int, Dimension], Unit] = {}
    first: ValueProblem | None = None
    for choice in islice(product(*names), MOST_READINGS_OF_UNIT):
        each = iter(choice)
        try:
            if "°" in text:
                raise ValueProblem("unknown unit")  # a degree Celsius has its zero elsewhere
            unit = parse_unit(_UNIT_NAME.sub(lambda match: next(each), text))  # noqa: B023
            if not 1e-100 < unit.scale < 1e100:
                raise ValueProblem("the unit is too large or too small")
            if product_of := re.fullmatch(r"\(([^()]*)\)", unit.text):
                unit = replace(unit, text=product_of[1].replace("*", " "))
            units.setdefault((unit.factor, unit.pi_power, unit.dimension), unit)
        except ValueProblem as problem:
            first = first or problem
    if not units:
        assert first is not None
        raise first
    return list(units.values())


def power_of(text: str | None) -> str:
    """A power as it stands behind the name of a unit: `^2` for `**2`, `^-1` for `-1`."""
    power = re.sub(r"[\s()]", "", text or "").replace("**", "^")
    return f"^{power}" if power.startswith("-") else power


def run_together(word: str, most: int = 4) -> list[tuple[str, ...]]:
    """The products of two or more different symbols that a word spells."""
    found: list[tuple[str, ...]] = []
    for symbol in _SYMBOLS:
        rest = word.removeprefix(symbol)
        if rest == word or not rest or most < 2:
            continue
        further = [(rest,)] if rest in _SYMBOLS else []
        ways = [*further, *run_together(rest, most - 1)]
        found += [(symbol, *way) for way in ways if symbol not in way]
    return found


@lru_cache(maxsize=1024)
def unit_of(text: str, dimension: Dimension | None) -> Unit:
    """The unit of this text, which must fit the dimension. Raises ValueProblem.

    A unit in one word, such as `rads^-1`, is the product that fits. Without a dimension, as in a parameter,
    it needs a negative power and one reading: `ms^-2` may be `m/s^2`, and `1/ms^2`.
    """
    may_be_product = dimension is not None or re.search("[-⁻−]", text) is not None
    try:
        unit = parse_unit(text)
        if dimension is not None:
            check_dimension(unit.text, unit.dimension, dimension)
    except ValueProblem:
        products = _products(text) if may_be_product else []
        fitting = [each for each in products if dimension in (None, each.dimension)]
        if len(fitting) != 1:
            raise
        return fitting[0]
    others = _products(text) if dimension is None and may_be_product else []
    if any(each.dimension != unit.dimension for each in others):
        hint = "a blank separates units, as in `m s^-2`; milliseconds stand below a bar, as in `1/ms^2`"
        raise ValueProblem(f"{shown(text)} can be read in two ways", hint=hint)
    return unit


def _products(text: str) -> list[Unit]:
    """The units that a text may mean in which words may be products: `rad s^-1` for `rads^-1`."""

    def spelled(name: str, power: str) -> list[str]:
        known = [f"{name}{power}"] * is_unit(name)
        if known and not power.startswith("^-"):
            return known  # `mN` and `mm` are no products
        products = [f"({'*'.join(parts)}{power})" for parts in run_together(name)]
        return [*known, *products] or [f"{name}{power}"]

    plain = re.sub(SUPERSCRIPT, lambda raised: "^" + raised[0].translate(LOWERED), text)
    with suppress(ValueProblem):
        return [replace(unit, text=text.strip()) for unit in unit_readings(plain, spelled)]
    return []


# --- quantities as they are typed


def exact_text(number: Fraction, pi_power: int) -> str:
    """`number` pi^`pi_power` in the expression language, exactly."""
    text = f"{number.numerator}/{number.denominator}"
    if number.denominator == 1:
        text = str(number.numerator)
    elif abs(number) < 2**1000 and Fraction(decimal := repr(float(number))) == number:
        text = decimal
    return text if pi_power == 0 else f"{text}*pi" if pi_power == 1 else f"{text}*pi**{pi_power}"


_QUANTITY = re.compile(
    rf"""\s*(?P<digits>[-+−]?+(?>[0-9]++\.?+[0-9]*+|\.[0-9]++))
    (?: [eE](?P<e>[-+−]?[0-9]++)
      | \s*[*·⋅]\s*10 (?: (?:\^|\*\*)(?P<power>[-+−]?[0-9]++) | (?P<raised>{SUPERSCRIPT}) )
    )?+
    (?P<gap>\s*)(?P<unit>(?: (?!{SUPERSCRIPT})[^\W\d_] | [°′″] | (?<=\s)1/ ).*)""",
    re.DOTALL | re.VERBOSE,
)


_POWER_OF_TEN = re.compile(rf"^(\s*[-+−]?)10(?=\^|\*\*|{SUPERSCRIPT})")  # alone, as in `10^-3 m`


class Written(NamedTuple):
    """A quantity as it is typed: a decimal number of any size, and a text that may be a unit."""

    digits: str
    unit: str
    touches: bool
    """Whether there is no blank between them."""


@lru_cache(maxsize=4096)
def split_quantity(text: str) -> Written | None:
    """The number and the unit of `5 cm` or `6*10^24 kg`; None for other texts.

    A quantity is a decimal number and a text that begins like a unit: a letter, `°`, `′`, `″`, or `1/`
    after a blank. Neither part is judged here.
    """
    match = _QUANTITY.fullmatch(_POWER_OF_TEN.sub(r"\g<1>1*10", text))
    if match is None:
        return None
    power = match["e"] or match["power"] or (match["raised"] or "").translate(LOWERED)
    number = f"{match['digits']}e{power}" if power else match["digits"]
    return Written(number.replace("−", "-"), match["unit"].rstrip(), not match["gap"])


# A quotient of two numbers, and a text that may be a unit.
_QUOTIENT = re.compile(r"\s*(\d+(?:\.\d*)?)\s*/\s*(\d+(?:\.\d*)?)\s+(\S.*)")


def quantity_meant(text: str) -> str | None:
    """The quantity `0.5 m` that is meant by `1/2 m`, which cannot be read; None for other texts."""
    match = _QUOTIENT.fullmatch(text)
    if match is None or not is_unit(match[3]) or not float(match[2]):
        return None
    return f"{float(match[1]) / float(match[2])!r} {match[3]}"


_GROUPED = re.compile(
    r"(?P<sign>[-+]?\s*)(?P<digits>[1-9]\d{0,2}(?:(?P<sep>[,. '])\d{3})(?:(?P=sep)\d{3})*)"
    r"(?P<fraction>[.,]\d+)?"
    r"(?![\d'])(?![.,]\d)(?P<rest>.*)",
    re.DOTALL,
)
"""A number whose commas, points, blanks or apostrophes may stand for thousands."""


def without_separators(text: str) -> list[str]:
    """The readings of a number whose commas, points or blanks may separate thousands."""
    grouped = _GROUPED.fullmatch(text)
    if grouped is None:
        return [text]
    digits, sign, fraction = grouped["digits"], grouped["sep"], grouped["fraction"] or ""
    if fraction[:1] == sign:
        return [text]
    whole = f"{grouped['sign']}{re.sub(r'[^0-9]', '', digits)}{fraction.replace(',', '.')}{grouped['rest']}"
    is_decimal = sign in ",." and digits.count(sign) == 1 and not fraction
    return [text, whole] if is_decimal else [whole]
