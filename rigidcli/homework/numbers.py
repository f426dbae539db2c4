"""Numbers in answers, read as they are typed, with their units and figures.

    read_numbers("20,8 rad/s", None)         # a pure number is asked for: Unreadable
    read_numbers("~22.4 rpm", unit)[0]       # .value in SI units, .figures 3

A comma between digits is a decimal comma.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, islice, product
from types import MappingProxyType
from typing import Any

from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields import units
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS, Dimension, check_dimension, dimension_of
from rigidcli.fields.units import HIGHEST_POWER_OF_UNIT, PREFIXES, Unit, parse_unit
from rigidcli.fields.words import SPELLED_UNITS, UNITS_BY_WORD, folded
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.language import tree, typed
from rigidcli.language.expression import real
from rigidcli.language.latex import plain
from rigidcli.language.numerals import UNSIGNED
from rigidcli.language.tokens import GREEK, rewritten, rules
from rigidcli.language.words import CALLED, CONSTANTS, RESERVED, Words, said, table

LONGEST_NUMBER = 400  # characters
# The share of a number that rounding may change: a value on the very limit of a tolerance is accepted.
ROUNDING = 1e-9
PURE = Unit("", Fraction(1), 0, DIMENSIONLESS)
_KNOWN = frozenset(units.known_names())
_OTHER = "|".join(sorted({*CALLED, *CONSTANTS, "e"} - {"sec"}))
# A number or a function in a formula, or a word that may be a unit with its power.
_WORD = re.compile(rf"{UNSIGNED}|(?:{_OTHER})(?![^\W\d])|{units.UNIT_NAME}")
MOST_SPELLINGS = 8  # the most readings of the units in one formula
MOST_MEANINGS = 1000  # the most ways to take the letters of one formula as the quantities they usually are
_COUNTED = rf"(?:{'|'.join(sorted(RESERVED - {'t', 'sec'}))})(?![^\W\d])"
_UNIT_BEGINS = rf"[(\[]*(?!{_COUNTED})[^\W\d_]|[°%]"
_PER = rf"/\s*(?!{_COUNTED})[^\W\d_]"
_DECIMAL = re.compile(
    rf"(?P<sign>[-+]?)\s*(?P<mantissa>(?>{typed.DECIMAL}))"
    r"(?:(?:e|\s?E)(?P<e>[-+]?\d++)|(?:\s*[*xX.]\s*|\s+)10\s*(?:\^|\*\*|(?<=[xX]10)(?=-\d))\s*(?P<open>\()?\s*(?P<p>[-+]?\s*\d++)(?(open)\s*\)))?+"
    rf"(?:(?:\s*(?:\*\s*)?(?={_UNIT_BEGINS}|{_PER})|\s+(?=1\s*/))(?P<unit>.+))?\s*",
    re.DOTALL,
)
# A number with digits in brackets behind it: `12.5(2) J`, `0.91(6)`.
_LAST_DIGITS = re.compile(r"[-+]?\d+[.,]\d*(?=(?P<last>\(\d{1,2}\))\s*(?:[^\W\d]|\Z))")
# The beginning of a remark in words, or of doubt: `(clockwise)`, `?`.
_REMARK = re.compile(
    r"\s*[,(\[\s]\s*(?!(?:per|pro|par|por|over)\b)(?=[^\d=/]*[^\W\d]{3}[^\d=/]*\Z)|\s*(?=\?\s*\Z)"
)
# A power of ten whose exponent came down to the line: `2.47 x 10-3`.
_POWER_LOST = re.compile(rf"(?P<mantissa>[-+]?{typed.DECIMAL})\s*[*xX]\s*10\s*-\s*(?P<power>\d\d?)(?![\d.,])")
# What stands before a value that is repeated: `12.5 J (0.0125 kJ)`, `20.8 rad/s or 199 rpm`.
_AGAIN = re.compile(
    rf"\s*(?:[(\[]|[,;]?\s*\b{said('or', 'same')}(?=\s)|[,;]\s"
    r"|(?<=[^\W\d_])\s/\s)\s*[=≈~]?\s*(?=[-+]?(?:[\d.π√(\\]|pi|sqrt))",
    re.IGNORECASE,
)
_ROUNDED = re.compile(r"\s*(?:[≈≃]|\\approx(?!\w))\s*(?=[-+]?[\d.])")
# A decimal point that is raised, as in `20·8`, and not the sign of a product, as in `2·10^3`.
_RAISED_POINT = re.compile(r"(?<![\d·.,^*/])(\d+)·(?!10(?!\d))(\d+)(?![\d·.,^*⁰¹²³⁴-⁹])")
# Words behind an answer that may take it back.
_TAKEN_BACK = re.compile(rf"(?i)\b(?!no units?\b){said('not', 'wrong', 'or', 'doubt')}|\?")
# What stands between a formula without units and its unit.
_BEHIND = re.compile(rf"(?<=[\w.)])\s+(?={_UNIT_BEGINS}|1\s*/|{_PER})")


@dataclass(frozen=True, slots=True)
class TypedNumber:
    """A number as it was typed: `value` in SI units, of which its unit is `scale`; `typed` is in that unit.

    `mantissa` has the digits before a power of ten; it is empty for an expression such as `2*pi`. `remark`
    has the words behind its unit. `in_thousands`: its one point or comma is read as one between thousands.
    """

    value: float
    typed: float
    scale: float
    unit: Unit | None = None
    mantissa: str = ""
    remark: str = field(default="", compare=False)
    in_thousands: bool = field(default=False, compare=False)

    @property
    def figures(self) -> int:
        """The significant figures that are typed, zeros at the end among them; 0 for an expression."""
        digits = self.mantissa.replace(".", "")
        return len(digits.lstrip("0")) or len(digits[:1])

    @property
    def half_a_digit(self) -> float:
        """Half a unit of the last figure that is typed, in SI units; 0 for zero and for an expression."""
        if not self.figures or not self.typed:
            return 0.0
        power = math.floor(math.log10(abs(self.typed))) + 1 - self.figures
        return 0.5 * 10.0**power * abs(self.scale)

    def may_be_a_slip(self, asked: float) -> bool:
        """Whether `1.250 mm`, read as 1250 mm, may be 1.25 m, where `asked` is the scale of the unit asked.

        Nobody doubts thousands in the unit that is asked, nor in `rpm` where radians per second are.
        """
        ratios = self.scale / asked, self.scale
        if not self.in_thousands or math.isclose(self.scale, asked):
            return False
        return any(_is_power_of_ten(ratio) and not math.isclose(ratio, 1) for ratio in ratios)

    @property
    def read_as(self) -> str:
        """The number as it is shown to the student."""
        digits = f"{self.typed:.15g}" if self.mantissa else f"{self.typed:.12g}"
        return digits if self.unit is None else f"{digits} {self.unit.text}"


def _is_power_of_ten(ratio: float) -> bool:
    return math.isclose(ratio, 10.0 ** round(math.log10(ratio)))


def read_numbers(answer: Tree, unit: Unit | None = None, place: str = "") -> list[TypedNumber]:
    """The readings of a decimal number or an expression of numbers, in its own unit or else in `unit`.

    A unit must fit `unit`; where that is None, a pure number is asked for. Raises Unreadable.
    """
    try:
        return _those_read(lambda number: [in_dimension(number, unit)], readings_of(answer, unit, place))
    except ValueProblem as misfit:
        raise Unreadable("unit_incompatible", with_hint(misfit), place=place) from None


def _those_read(read: Callable[[Any], list[TypedNumber]], ways: Iterable[Any]) -> list[TypedNumber]:
    """The numbers that `read` makes of these ways; if it can read none, the first problem is raised."""
    found, problems = list[TypedNumber](), list[Exception]()
    for way in ways:
        try:
            found += read(way)
        except (ValueProblem, Unreadable) as problem:
            problems.append(problem)
    if problems and not found:
        raise problems[0]
    return found


def in_dimension(number: TypedNumber, unit: Unit | None) -> TypedNumber:
    """A number with its value in SI units, where a quantity like `unit` is asked. Raises ValueProblem."""
    if number.unit is None:
        return number
    scale = scale_in(number.unit, unit or PURE)
    return replace(number, value=number.typed * scale, scale=scale)


def readings_of(answer: Tree, unit: Unit | None = None, place: str = "") -> list[TypedNumber]:
    """The readings of a number in its own unit, whatever that measures, the most usual first.

    A number without one is in `unit`. Raises Unreadable.
    """
    if isinstance(answer, list | dict) or answer is None:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected one number", place=place)
    text = str(answer)
    if len(text) > LONGEST_NUMBER:
        raise Unreadable("too_large", f"{len(text)} characters", place=place)
    if equal := _told_twice(text, unit, place):
        return equal
    point = _RAISED_POINT.sub(r"\1.\2", text)
    if point != text:
        ways = text.replace("·", "*"), point
        return _those_read(lambda way: readings_of(way, unit, place), ways)
    try:
        last, _ = typed.last_member(plain(typed.undecorated(rewritten(text, _SIGNS))))
        last = rewritten(typed.undecorated(last), _AROUND).strip()
        whole = units.without_separators(last)[1:]

        def read(way: str) -> list[TypedNumber]:
            return [replace(each, in_thousands=way in whole) for each in _numbers(way, unit, place)]

        return _those_read(read, _variants(last))
    except ExpressionError as error:
        says = advice(error)
        is_strange = "has no value" in error.message and re.search(r"(?:\A|\s)\d", text)
        if is_strange or re.match("unexpected|no operator before|the expression ends", error.message):
            says = "give one number" if unit in (None, PURE) else "give the number and its unit"
        message = f"read {shown(answer)}: {says}"
        raise Unreadable(error.code or "not_a_number", message, place=place) from None


def _told_twice(text: str, unit: Unit | None, place: str) -> list[TypedNumber]:
    """The readings of a value that is told again, or rounded: `3/8 ≈ 0.38`, `12.5 J (0.0125 kJ)`; else none.

    Raises Unreadable where what is told again is another value.
    """
    for between in (_ROUNDED, _AGAIN):
        told, both = between.split(text, maxsplit=2), list[list[TypedNumber]]()
        for part in told if len(told) == 2 else ():
            both.append([])
            with suppress(Unreadable, ValueProblem):
                both[-1] += [in_dimension(each, unit) for each in readings_of(part.rstrip(" )]"), unit)]
        pairs = [pair for pair in product(*both) if _agree(*pair)] if both else []
        # Behind a bracket, a number without a unit may be a factor.
        if between is _AGAIN and both and both[0] and not pairs and any(each.unit for each in both[1]):
            raise Unreadable("wrong_shape", typed.TWO_ANSWERS, place=place)
        if pairs:
            return list(dict.fromkeys(chain.from_iterable(pairs)))
    return []


def _agree(one: TypedNumber, other: TypedNumber) -> bool:
    """Whether two numbers are the same within half a unit of their last figures."""
    if one.may_be_a_slip(other.scale) or other.may_be_a_slip(one.scale):
        return False
    halves = sum(each.half_a_digit for each in (one, other) if each.figures > 1)
    return abs(one.value - other.value) <= ROUNDING * abs(one.value) + (1 + ROUNDING) * halves


def _variants(text: str) -> list[str]:
    """The texts with plain digits that a number may stand for: `1,234` is 1.234 or 1234."""
    if lost := _POWER_LOST.match(text):  # what was a superscript is a difference now
        return [f"{lost['mantissa']}e-{lost['power']}{text[lost.end() :]}", f"1*{text}"]
    if doubtful := _LAST_DIGITS.match(text):  # a product, or digits that are uncertain or repeat
        behind, repeating = text[doubtful.end("last") :], 12 * doubtful["last"].strip("()")
        return [text, f"{doubtful[0]}{behind}", f"{doubtful[0]}{repeating}{behind}"]
    return units.without_separators(text)


def _numbers(text: str, unit: Unit | None, place: str) -> list[TypedNumber]:
    """The readings of a number whose digits stand without separators. Raises ExpressionError, Unreadable."""
    decimal = _DECIMAL.fullmatch(text)
    if decimal is None:
        return _worked_out(text, unit)
    mantissa = decimal["mantissa"].replace(",", ".")
    power = (decimal["e"] or decimal["p"] or "0").replace(" ", "")
    amount = float(f"{decimal['sign']}{mantissa}e{power}")
    if amount == 0 and mantissa.strip("0."):
        raise ExpressionError("it is too small for a number")
    if decimal["unit"] is None:
        return [_number(amount, None, unit, mantissa)]
    try:
        several, remark = _units_before_words(decimal["unit"], unit, place)
    except Unreadable:
        with suppress(ValueProblem):
            return _worked_out(text, unit)
        raise
    return [replace(_number(amount, own, unit, mantissa), remark=remark) for own in several]


def _number(amount: float, own: Unit | None, unit: Unit | None, mantissa: str = "") -> TypedNumber:
    """A number in its `own` unit, or else in `unit`. Raises ExpressionError beyond the range of floats."""
    scale = own.scale if own else 1.0 if unit is None else unit.scale
    if not math.isfinite(amount * scale):
        raise ExpressionError("it is beyond the range of numbers")
    return TypedNumber(amount * scale, amount, scale, own, mantissa)


def _units_before_words(text: str, unit: Unit | None, place: str) -> tuple[Sequence[Unit | None], str]:
    """The readings of a unit, and a remark behind it: `rad/s (clockwise)`. Raises Unreadable."""
    for end in (len(text), *(remark.start() for remark in islice(_REMARK.finditer(text), 8))):
        with suppress(Unreadable):
            several = read_units(text[:end], unit, place) if end else [None]
            return several, text[end:].strip("()[], \n")
    if unit is PURE and re.fullmatch(rf"(?i){said('counted')}", text):
        return [None], text  # what is counted: 3 coordinates
    if len(re.findall(r"[^\W\d_]{3,}", text)) > 1:
        words = f"read {shown(text)}: words behind the number, give the number and its unit"
        raise Unreadable("unit_incompatible", words, place=place)
    return read_units(text, unit, place), ""  # it says what is wrong


def taken_back(remark: str) -> str:
    """Why a person must look at an answer with this remark behind it; empty for a harmless one."""
    return f"a remark may take the answer back: {shown(remark)}" if _TAKEN_BACK.search(remark) else ""


LARGEST_UNCERTAINTY = 0.1  # as a share of the value: beyond, a wrong number would be within it


def too_uncertain(answer: Tree) -> str:
    """Why a person must look at a number with a large uncertainty behind it: `20.8 ± 10 rad/s`."""
    uncertain = re.search(_UNCERTAIN, str(answer))
    if uncertain is None or (uncertain["own"] or uncertain["unit"] or "") != (uncertain["unit"] or ""):
        return ""
    with suppress(ValueError):
        number, _, _ = uncertain["value"].partition(uncertain["unit"] or "\0")
        value, off = (float(each.replace(",", ".")) for each in (number, uncertain["off"]))
        share = off / 100 if uncertain["percent"] else off / abs(value or math.inf)
        if share > LARGEST_UNCERTAINTY:
            return f"the uncertainty is large: {shown(uncertain[0].strip())}"
    return ""


SLIP = "a point or comma is read as one between thousands, but it may be a decimal one in another unit"
CONTRADICTION = "the members of the chain of equalities are not equal"


def no_name(side: str) -> str:
    """Why a person must look at an answer with this side left of `=`."""
    return f"what stands before `=` is no name: {shown(side.strip())}"


def _si(match: re.Match[str]) -> str:
    """A quantity of the LaTeX package siunitx: `\\SI{20.8}{\\radian\\per\\second}` or `\\SI{20.8}{rad/s}`."""
    unit = rewritten(re.sub(rf"\\({'|'.join(PREFIXES)})\s*\\", r"\\\1", match[2]), _POWERS_IN_WORDS)
    unit = re.sub(r"\\per\s*\\?(\w+)", r"/\1", re.sub(r"(?<=\w)[.~](?=\\?\w)", " ", unit)).replace("\\", " ")
    return f"{match[1]} {unit}"


def _in_degrees(match: re.Match[str]) -> str:
    minutes, seconds = (Fraction((match[part] or "0").replace(",", ".")) for part in ("min", "sec"))
    whole = Fraction(match["deg"].lstrip("+-")) + minutes / 60 + seconds / 3600
    return f"{'-' * match['deg'].startswith('-')}{float(whole)!r} deg"


_POWERS_IN_WORDS = rules(
    (r"\s*(?:\\|\b)squared\b", "^2"),
    (r"\s*(?:\\|\b)cubed\b", "^3"),
    (r"(?:\A|[ -])(?:sq(?:uare|\.)|quadrat) ?(\w+)", r" \1^2"),
)
_MINUTES = rf"(?P<min>{typed.DECIMAL})\s*(?:'|′|’|arcmin|min\b)"
_SECONDS = rf"(?P<sec>{typed.DECIMAL})\s*(?:\"|″|''|”|arcsec)"
# Signs of units, ratios, mixed fractions and powers of ten, and their plain forms.
_SIGNS = rules(
    (r"\A\s*(\d+(?:[.,]\d+)?)(?::| : | to )(\d)\s*\Z", r"\1/\2"),
    (r"(?<=\d)~(?=[A-Za-z\\])", " "),  # the blank of LaTeX
    (r"(?<=\d)\s*\^\s*\{?o\}?(?!\w)", "°"),
    (r"(?<=\d)(?:\*\^|[dD])(?=[-+]?\d)", "e"),  # 1*^3 in Mathematica, 1d3 in Fortran
    (r"(\d\s*(?:h|min))\s*(?=\d+(?:\.\d+)?\s*(?:min|s|sec)\b)", r"\1 + "),  # 1 h 20 min
    (r"\A\s*(?:minus|negative)\s+(?=[\d.])", "-"),
    (r"(?<=\d)\s*(?:degrees? of freedom|d\.?o\.?f\.?)(?!\w)", ""),
    (rf"(?P<deg>[-+]?\d+)\s*(?:[°º]|deg)\s*{_MINUTES}(?:\s*{_SECONDS})?", _in_degrees),
    (r"(?<=\d)\s*′", " arcmin"),
    (r"(?<=\d)\s*″", " arcsec"),
    (r"\\ang\s*\{([^{};]*)\}", r"\1 deg"),
    (r"\\(?:SI|qty)\s*\{([^{}]*)\}\s*\{((?:[^{}]|\{[^{}]*\})*)\}", _si),
    (r"\A\s*(\d+)\s*\\[dt]?frac\s*(?:\{(\d+)\}\s*\{(\d+)\}|(\d)(\d))", r"(\1 + \2\4/\3\5)"),
    (  # a whole number and a fraction that is added to it: 12 1/2
        r"(?<![\w.,/^*])(\d+) +(\d{1,2}) ?/ ?(\d{1,2})(?![\d/.,])",
        lambda m: f"({m[1]} + {m[2]}/{m[3]})" if int(m[2]) < int(m[3]) else m[0],
    ),
    ("[Å\u212b]", "angstrom"),
    ("μ(?=[A-Za-z])", "\N{MICRO SIGN}"),
)
_UNIT_NAME = r"[^\W\d_][\w^/. ·*²³⁻-]*?"
_UNCERTAIN = (
    rf"(?P<open>\()?(?P<value>\d[\d.,]*(?:[eE][-+]?\d+)?(?P<unit>\s*{_UNIT_NAME})?)\s*(?:±|\+/?[-−]|-/?\+|\\pm)\s*"
    rf"(?P<off>{typed.DECIMAL})(?P<percent>\s*%)?(?(unit)(?P<own>\s*{_UNIT_NAME}(?=\s*\)?\s*\Z))?)\s*(?(open)\)|(?![\w(]*\())"
)
# A number without its uncertainty: `(3.12 ± 0.02) m` is `3.12 m`; and a quantity in brackets: `(12.5 J)`.
_AROUND = rules(
    (_UNCERTAIN, r"\g<value> "),
    (r"(?<=\d)\s+(?=[eE][-+]?\d)", ""),
    (r"\A\s*\(([^()]*\d\s*[^\W\d][^()]*)\)\s*\Z", r"\1"),
)


# --- formulas whose names are units


def _worked_out(text: str, unit: Unit | None) -> list[TypedNumber]:
    """The readings of a formula whose names are units: `2 pi rad/24 h`, `1/2 (4 kg) (2.5 m/s)^2`, `sin 30°`.

    Of `10 + 2.5 J` the unit is that of all. Raises ExpressionError, ValueProblem.
    """
    found, problems = dict[TypedNumber, None](), list[ValueProblem]()
    blank = None if re.search(r"[a-z]{2}.*\bdeg", text) else _BEHIND.search(text)
    if blank is not None:
        with suppress(ExpressionError, Unreadable):
            root = typed.expressions(text[: blank.start()], Words(()), leading=False)[0]
            amount, several = _value(root), read_units(text[blank.end() :], unit)
            found |= dict.fromkeys(_number(amount, own, unit) for own in several)
    for spelled in _in_known_units(rewritten(text, _WRITTEN_OUT), unit):
        words = units.names_of_units(spelled)
        names = _KNOWN.intersection(words)
        try:
            if strange := [word for word in words if _is_one_letter_repeated(word)]:
                raise ExpressionError(f"{shown(strange[0])} has no value")  # `sss` is no cube of a second
            for root in typed.expressions(spelled, Words(sorted(names)), leading=False):
                found |= dict.fromkeys(_of_root(root, unit))
        except ValueProblem as problem:
            is_strange = problem.code == "unknown_symbol"
            what = problem.message.removeprefix("read ")
            problems.append(ExpressionError(f"{what} has no value") if is_strange else problem)
    if problems and not found:
        raise problems[0]
    return list(found)


def _is_one_letter_repeated(word: str) -> bool:
    return len(word) > 1 and set(word) == {word[0]} and word not in _KNOWN


def _value(root: tree.Node, scales: Mapping[str, float] = MappingProxyType({})) -> float:
    """The value of a formula; zero where that is proved, as of `cos(pi/2)`. Raises ExpressionError."""
    amount = real(root, scales)
    with suppress(ExpressionError):
        bare = tree.bound(root, dict.fromkeys(scales, tree.ONE))
        amount = 0.0 if abs(amount) < ROUNDING and is_zero(from_tree(bare)) else amount
    return amount


def _in_known_units(text: str, unit: Unit | None) -> Iterator[str]:
    """The text with the names of units for the words that may mean some, in each usual reading."""
    own = set() if unit is None else set(units.names_of_units(unit.text))
    ways = [
        _unit_spelled(word["name"], units.power_of(word["power"]), own) if word["name"] else [word[0]]
        for word in _WORD.finditer(text)
    ]
    for choice in islice(product(*ways), MOST_SPELLINGS):
        each = iter(choice)
        yield _WORD.sub(lambda word: f" {next(each)}", text)  # noqa: B023


def _of_root(root: tree.Node, unit: Unit | None) -> list[TypedNumber]:
    """The readings of a formula of numbers and names of units. Raises ExpressionError, ValueProblem."""
    parts = list(tree.nodes([root]))
    constants = [part for part in parts if isinstance(part, tree.Constant)]
    if not constants and not any(isinstance(part, tree.Number) for part in parts):
        raise ExpressionError("there is no number in it")
    sums = [[tree.names_in(term) for term in part.terms] for part in parts if isinstance(part, tree.Sum)]
    if any(any(names) and not all(names) for names in sums):
        raise ExpressionError("the terms of this sum have units of different kinds")
    known = {name: parse_unit(name) for name in tree.names_in(root)}
    amount = _value(root, {name: each.scale for name, each in known.items()})
    # A factor of the dimension 1 tells a pure number from what has none, such as the root of a metre.
    dimensions = {"1": DIMENSIONLESS} | {name: each.dimension for name, each in known.items()}
    dimension = dimension_of(tree.Product((tree.Name("1"), root)), dimensions)
    if dimension is None or max(map(abs, dimension)) > HIGHEST_POWER_OF_UNIT:
        raise ExpressionError("this is no product of powers of units")
    if dimension != DIMENSIONLESS:
        return [_number(amount, Unit(dimension.unit, Fraction(1), 0, dimension), unit)]
    is_inverse = {getattr(part, "function", "") for part in parts} & {"asin", "acos", "atan", "atan2"}
    if unit is None or not unit.dimension.angle or not (is_inverse or constants):
        return [_number(amount, None, unit)]
    # made of pi or of an inverse function
    text = "rad" if unit.dimension == ANGLE else re.sub(r"\b(?:deg|rev|rpm)\b", "rad", unit.text)
    in_si = _number(amount, Unit(text, Fraction(1), 0, unit.dimension), unit)
    return [in_si] if unit.dimension == ANGLE else [_number(amount, None, unit), in_si]


# --- units

# The units of quantities by the names that usually have no other meaning.
UNITS_OF = {
    name: [parse_unit(unit) for unit in several.split("|")]
    for several, names in table(__file__, "quantities.csv")
    for name in names.split()
}
_LETTERS = Words([name for name in UNITS_OF if len(name) == 1 or name in GREEK], is_open=True)


def _usual_units(letter: str) -> list[Unit]:
    """The units that the quantity of a letter, with an index or not, may have; none if it may be any."""
    return UNITS_OF.get(re.sub(r"(?:_.*|\d+)\Z", "", letter), [])


def may_be_in(units: Sequence[Unit], formula: tree.Node) -> bool:
    """Whether a formula may have one of these units, if its letters are the quantities that they usually are.

    A letter that the table lacks may be anything.
    """
    usual = {name: _usual_units(name) for name in tree.names_in(formula)}
    if not all(usual.values()):
        return True
    found = set[Dimension | None]()
    for choice in islice(product(*usual.values()), MOST_MEANINGS):
        dimensions = {name: unit.dimension for name, unit in zip(usual, choice, strict=True)}
        with suppress(ValueProblem):  # of a sum of different dimensions
            found.add(dimension_of(formula, dimensions))
    units_found = [Unit("", Fraction(1), 0, own) for own in found if own is not None]
    return found == {None} or any(fits(unit, own) for unit in units for own in units_found)


# A number before letters, but for `1/f` and `2 pi/T`; a sum, or a function.
_NO_PRODUCT = re.compile(rf"(?<![\w^.])(?!1\s*/|2[\s*]*pi)[\d.]|[-+]|(?!pi){_COUNTED}")


def is_product_in(side: str, unit: Unit) -> bool:
    """Whether what stands left of `=` is a product of letters that has this unit: `I omega`, `2 pi/T`.

    With a power it may be another quantity of that unit, as `m v^2` beside an energy; but a pure number such
    as `I/(M R^2)` has no other meaning.
    """
    if _NO_PRODUCT.search(side) or (unit is not PURE and re.search(r"\^|\*\*", side)):
        return False
    with suppress(ExpressionError):
        formula = typed.expressions(side, _LETTERS, leading=False)[0]
        return all(map(_usual_units, tree.names_in(formula))) and may_be_in([unit], formula)
    return False


def fits(unit: Unit, asked: Unit) -> bool:
    """Whether a quantity in a unit may be given where one in another unit is asked."""
    with suppress(ValueProblem):
        return scale_in(unit, asked) > 0
    return False


def read_units(text: str, expected: Unit | None = None, place: str = "") -> list[Unit]:
    """The readings of a unit: `ms` is a millisecond, and a metre times a second.

    Names of the `expected` one may stand in it, too. Raises Unreadable.
    """
    text = rewritten(text.strip(), _WRITTEN_OUT).strip()
    missing = text.count("(") - text.count(")")
    text = text + ")" * missing if missing > 0 else text.removesuffix(")" * -missing)
    if re.fullmatch("%|percent|Prozent|pour ?cent|por ciento", text):
        return [Unit("%", Fraction(1, 100), 0, DIMENSIONLESS)]
    if twice := re.fullmatch(r"([^\s()]+)\s*\(([^\W\d_]+)\)", text):  # as in `J (joules)`
        unit, again = (read_units(part, expected, place)[0] for part in twice.groups())
        if (unit.scale, unit.dimension) == (again.scale, again.dimension):
            return [unit]
    own = set() if expected is None else set(units.names_of_units(expected.text))
    try:
        found = units.unit_readings(text, lambda name, power: _unit_spelled(name, power, own))
        if expected and expected.dimension.angle and re.fullmatch(r"1\s*/\s*min|min\^-1", text):
            found.append(parse_unit("rpm"))  # what turns is counted
        is_behind_in = re.match(r"\(?in ", text)  # `in kg m^2`, and inches
        return [*found, *read_units(text.replace("in ", "", 1), expected, place)] if is_behind_in else found
    except ValueProblem as problem:
        message = f"read {shown(text)}: {advice(problem)}"
        raise Unreadable("unit_incompatible", message, place=place) from None


def _unit_spelled(name: str, power: str, own: set[str]) -> list[str]:
    """The readings of one name in a unit: `m2` is m^2, and `ms^-1` also m s^-1."""
    stem = name.rstrip("0123456789")
    ways: list[str] = []
    digits = name.removeprefix(stem)
    for part, raised in ((name, power), (stem, power or f"^{digits}" * bool(digits))):
        if part in _KNOWN or part in own:
            ways.append(f"{part}{raised}")
        if part not in own and (meant := _unit_called(part)):
            ways.append(f"{meant}{raised}")
        # `ms^-1` is usually a metre by a second; a unit without such a power is itself, as `mN` and `mm`
        if part not in _KNOWN or raised.startswith("^-"):
            ways += [f"({'*'.join(parts)}{raised})" for parts in units.run_together(part)]
    return list(dict.fromkeys(ways)) or [f"{name}{power}"]


def _unit_called(name: str) -> str:
    words = SPELLED_UNITS.get(name)
    small = name.lower()
    if not words and name not in _KNOWN:
        is_known = len(small) > 2 and small in _KNOWN
        words = UNITS_BY_WORD.get(folded(name)) or SPELLED_UNITS.get(small) or (small,) * is_known
    return words[0] if words else ""


_WRITTEN_OUT = [
    *rules((r"\A(?:per|pro|par|por)\s", "/"), (r"\s(?:per|pro|par|por)\s", "/"), (r"\A\s*/", "1/")),
    *rules(
        (r"(?<=[^\s*/(])\s+1\s*/\s*(?=[^\W\d])", "/"),
    ),  # 2 pi 1/s
    *_POWERS_IN_WORDS,
    *rules((r"\[", "("), (r"\]", ")")),
]


def scale_in(unit: Unit, asked: Unit) -> float:
    """The size of a unit in SI units, where a quantity in the unit that is `asked` is expected.

    Beyond what documents accept, an angle is a pure number, a hertz is 1/s, and what a frequency counts are
    turns (`rev/s`, `rpm`, and degrees, but not radians). Raises ValueProblem where the unit does not fit.
    """
    given, expected = unit.dimension, asked.dimension
    for frequency, other, sign in ((expected, unit, -1), (given, asked, 1)):
        turning = frequency._replace(cycle=0, angle=frequency.cycle)
        if other.dimension == turning and other.pi_power == turning.angle != 0:
            return unit.scale * (2 * math.pi) ** (sign * turning.angle)
    is_hertz = expected.cycle and given == expected._replace(cycle=0)
    if given == expected._replace(angle=-1) and unit.pi_power == -1:
        return unit.scale * 2 * math.pi  # a period is a time for each turn: `s/cycle`
    if not is_hertz and (given, expected) != (ANGLE, DIMENSIONLESS):
        check_dimension(unit.text, given, expected)
    return unit.scale


def with_hint(problem: ValueProblem) -> str:
    """What a problem says, in one line."""
    return problem.message if problem.hint is None else f"{problem.message} ({problem.hint})"


# What the readers of documents say of a formula or a unit, and what a student reads instead.
_ADVICE = [(re.compile(pattern), instead) for pattern, instead in table(__file__, "advice.tsv")]


def advice(problem: ValueProblem) -> str:
    """What a student has to write where a formula or a unit cannot be read."""
    return rewritten(with_hint(problem).replace("`**`", "`^`"), _ADVICE)
