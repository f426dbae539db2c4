"""Numbers in answers, read as they are typed, with their units and figures.

    read_numbers("20,8 rad/s", None)         # a pure number is asked for: Unreadable
    read_numbers("~22.4 rpm", unit)[0]       # .value in SI units, .figures 3

A comma between digits is a decimal comma.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice
from typing import Any

from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields import units
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS, check_dimension
from rigidcli.fields.units import PREFIXES, Unit
from rigidcli.fields.words import SPELLED_UNITS, UNITS_BY_WORD, folded
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.language import tree, typed
from rigidcli.language.expression import real
from rigidcli.language.latex import plain
from rigidcli.language.tokens import rewritten, rules
from rigidcli.language.words import RESERVED, said, table

LONGEST_NUMBER = 400  # characters
# The share of a number that rounding may change: a value on the very limit of a tolerance is accepted.
ROUNDING = 1e-9
PURE = Unit("", Fraction(1), 0, DIMENSIONLESS)
_KNOWN = frozenset(units.known_names())
__COUNTED = rf"(?:{'|'.join(sorted(RESERVED - {'t', 'sec'}))})(?![^\W\d])"
_UNIT_BEGINS = rf"[(\[]*(?!{__COUNTED})[^\W\d_]|[°%]"
_PER = rf"/\s*(?!{__COUNTED})[^\W\d_]"
_DECIMAL = re.compile(
    rf"(?P<sign>[-+]?)\s*(?P<mantissa>(?>{typed.DECIMAL}))"
    r"(?:(?:e|\s?E)(?P<e>[-+]?\d++)|(?:\s*[*xX.]\s*|\s+)10\s*(?:\^|\*\*|(?<=[xX]10)(?=-\d))\s*(?P<open>\()?\s*(?P<p>[-+]?\s*\d++)\s*(?(open)\)))?+"
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
# A number divided by a quantity: `360°/24h`, `2 pi/24h`; of `1/4 s` the unit is a second.
_QUOTIENT = re.compile(
    r"(?P<above>[-+]?[\d.*\s]*(?:pi(?=\s*/)|(?=\s*[°\w])))\s*(?P<unit>°|(?!pi)[^\W\d_]+)?\s*/\s*"
    rf"(?:\((?P<grouped>{typed.DECIMAL})\)\s*/|(?P<below>{typed.DECIMAL})(?(unit)\s*))(?P<per>[^\W\d_]+)"
)
# What stands before a value that is repeated: `12.5 J (0.0125 kJ)`, `20.8 rad/s or 199 rpm`.
_AGAIN = re.compile(
    rf"\s*(?:[(\[]|[,;]?\s*\b{said('or', 'same')}(?=\s)|[,;]\s"
    r"|(?<=[^\W\d_])\s/\s)\s*[=≈~]?\s*(?=[-+]?(?:[\d.π√(\\]|pi|sqrt))",
    re.IGNORECASE,
)
_TERM = rf"[-+]?{typed.DECIMAL}\s*[^\W\d_][^-+()]*"
_SUM = re.compile(rf"{_TERM}(?:\s\+\s*{_TERM})+")  # a sum of quantities: `10 J + 2.5 J`
# Words behind an answer that may take it back.
_TAKEN_BACK = re.compile(rf"(?i)\b(?!no units?\b){said('not', 'wrong', 'or', 'doubt')}|\?")
_BEHIND = re.compile(rf"(?<=[\w.)])\s+(?={_UNIT_BEGINS}|1\s*/|{_PER})")
_COUNTS = ["1/2", "1/3", "1/4", "2/3", "3/4", "0", "1", "2", "3", "4", "5", "6"]
_IN_WORDS = [(re.compile(rf"(?i)\A{said(count)}(?=[\s.!]|\Z)"), count) for count in _COUNTS]
_IN_WORDS.append((re.compile(r"\A\s*(\d+)(?::| : )(\d)\s*\Z"), r"\1/\2"))  # a ratio
# Sums of names of energies before `=`, as in `T + V = 5 J`.
_ENERGIES = re.compile(r"\s*[TVUEKLHW](?:_?\w+)?(?:\s*[-+]\s*[TVUEKLHW](?:_?\w+)?)+\s*")


@dataclass(frozen=True, slots=True)
class TypedNumber:
    """A number as it was typed: `value` in SI units, of which its unit is `scale`; `typed` is in that unit.

    `mantissa` has the digits before a power of ten; it is empty for an expression such as `2*pi`. `remark`
    has the words behind its unit.
    """

    value: float
    typed: float
    scale: float
    unit: Unit | None = None
    mantissa: str = ""
    remark: str = field(default="", compare=False)

    @property
    def figures(self) -> int:
        """The significant figures that are typed, zeros at the end among them; 0 for an expression."""
        digits = self.mantissa.replace(".", "")
        return len(digits.lstrip("0")) or len(digits[:1])

    @property
    def read_as(self) -> str:
        """The number as it is shown to the student."""
        digits = f"{self.typed:.15g}" if self.mantissa else f"{self.typed:.12g}"
        return digits if self.unit is None else f"{digits} {self.unit.text}"


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
    text = str(answer) if place else rewritten(str(answer), _IN_WORDS)
    if len(text) > LONGEST_NUMBER:
        raise Unreadable("too_large", f"{len(text)} characters", place=place)
    told = _AGAIN.split(text, maxsplit=2)
    if len(told) == 2 and (equal := _told_twice(told[0], told[1], unit, place)):
        return equal
    try:
        last, _ = typed.last_member(plain(typed.undecorated(rewritten(text, _SIGNS))))
        last = rewritten(typed.undecorated(last), _AROUND).strip()
        return _those_read(lambda text: _numbers(text, unit, place), _variants(last))
    except ExpressionError as error:
        says = advice(error)
        if re.match("unexpected|no operator before|the expression ends", error.message):
            says = "give one number" if unit in (None, PURE) else "give the number and its unit"
        message = f"read {shown(answer)}: {says}"
        raise Unreadable(error.code or "not_a_number", message, place=place) from None


def _told_twice(value: str, again: str, unit: Unit | None, place: str) -> list[TypedNumber]:
    """The readings of a value that equal the one told behind it; none where one of the two is no value.

    Raises Unreadable where both are values that differ.
    """
    first, second = list[TypedNumber](), list[TypedNumber]()
    for found, text in ((first, value), (second, again.rstrip(" )]"))):
        with suppress(Unreadable, ValueProblem):
            found += [in_dimension(each, unit) for each in readings_of(text, unit)]
    equal = [one for one in first if any(_agree(one, other) for other in second)]
    # Behind a bracket, a number without a unit may be a factor.
    if first and not equal and any(other.unit is not None for other in second):
        raise Unreadable("wrong_shape", typed.TWO_ANSWERS, place=place)
    return equal


def _agree(one: TypedNumber, other: TypedNumber) -> bool:
    """Whether two numbers are the same within half a unit of their last figures."""
    halves = (min(0.5 * 10.0 ** (1 - each.figures), 0.005) for each in (one, other) if each.figures)
    return abs(one.value - other.value) <= (ROUNDING + sum(halves)) * max(abs(one.value), abs(other.value))


def _variants(text: str) -> list[str]:
    """The texts with plain digits that a number may stand for: `1,234` is 1.234 or 1234."""
    if lost := _POWER_LOST.match(text):  # what was a superscript is a difference now
        return [f"{lost['mantissa']}e-{lost['power']}{text[lost.end() :]}", f"1*{text}"]
    if quotient := _QUOTIENT.fullmatch(text):  # `360°/24h` is 15 °/h
        below = quotient["below"] or quotient["grouped"]
        return [text, f"({quotient['above']})/({below}) {quotient['unit'] or ''}/{quotient['per']}"]
    if doubtful := _LAST_DIGITS.match(text):  # a product, or digits that are uncertain or repeat
        behind, repeating = text[doubtful.end("last") :], 12 * doubtful["last"].strip("()")
        return [text, f"{doubtful[0]}{behind}", f"{doubtful[0]}{repeating}{behind}"]
    return units.without_separators(text)


def _numbers(text: str, unit: Unit | None, place: str) -> list[TypedNumber]:
    """The readings of a number whose digits stand without separators. Raises ExpressionError, Unreadable."""

    def number(amount: float, own: Unit | None, mantissa: str = "") -> TypedNumber:
        scale = own.scale if own else 1.0 if unit is None else unit.scale
        if not math.isfinite(amount * scale):
            raise ExpressionError("it is beyond the range of numbers")
        return TypedNumber(amount * scale, amount, scale, own, mantissa)

    if decimal := _DECIMAL.fullmatch(text):
        mantissa = decimal["mantissa"].replace(",", ".")
        power = (decimal["e"] or decimal["p"] or "0").replace(" ", "")
        amount = float(f"{decimal['sign']}{mantissa}e{power}")
        if amount == 0 and mantissa.strip("0."):
            raise ExpressionError("it is too small for a number")
        if decimal["unit"] is None:
            return [number(amount, None, mantissa)]
        if _SUM.fullmatch(text):
            return _sums(text, unit, place)
        several, remark = _units_before_words(decimal["unit"], unit, place)
        return [replace(number(amount, own, mantissa), remark=remark) for own in several]
    node, behind = _value(text)
    amount = real(node, {})
    with suppress(ExpressionError):  # it is proved that `cos(pi/2)` is zero, which no float shows
        amount = 0.0 if abs(amount) < ROUNDING and is_zero(from_tree(node)) else amount
    if behind:
        return [number(amount, own) for own in read_units(behind, unit, place)]
    called = {part.function for part in tree.nodes([node]) if isinstance(part, tree.Call)}
    is_angle = called & {"asin", "acos", "atan", "atan2"} or any(
        isinstance(part, tree.Constant) for part in tree.nodes([node])
    )
    if unit is None or not unit.dimension.angle or not is_angle:  # made of pi or of an inverse function
        return [number(amount, None)]
    text = "rad" if unit.dimension == ANGLE else re.sub(r"\b(?:deg|rev|rpm)\b", "rad", unit.text)
    in_si = number(amount, Unit(text, Fraction(1), 0, unit.dimension))
    return [in_si] if unit.dimension == ANGLE else [number(amount, None), in_si]


def _sums(text: str, unit: Unit | None, place: str) -> list[TypedNumber]:
    """The sum of quantities, in the unit of the first. Raises ExpressionError, Unreadable."""
    first, *others = (_numbers(term.strip(), unit, place)[0] for term in text.split("+"))
    kinds = {each.unit and each.unit.dimension for each in (first, *others)}
    if first.unit is None or len(kinds) > 1:
        raise ExpressionError("the terms of this sum have units of different kinds")
    value = sum((each.value for each in others), first.value)
    return [replace(first, value=value, typed=value / first.scale, mantissa="")]


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


CONTRADICTION = "the members of the chain of equalities are not equal"


def doubt(before: Sequence[str], read: Callable[[str], Any], is_equal: Callable[[Any], bool]) -> str:
    """Why a person must look at an answer behind `=`: a member before it is another value, or no name.

    What can be read is compared; a name alone is only a name. Raises Unreadable where a second answer begins.
    """

    def value(text: str) -> Any:
        with suppress(Unreadable):
            return read(text)

    for place, member in enumerate(before):
        is_name = place == 0 and typed.is_label(typed.slopes(member))
        if is_name and len(member.split()) == 1:
            continue
        if is_name and re.match(rf"(?i)\s*{said('not')}", member):
            return taken_back(member)
        own, shorter = value(member), typed.SECOND_NAME.sub("", member)
        second = value(shorter) if place and shorter != member else None
        # the name behind it begins another answer, unless it is a unit of the same number
        if second is not None and own in (None, second) and not is_equal(second):
            raise Unreadable("wrong_shape", typed.TWO_ANSWERS)
        if own is None and place == 0 and not is_name and not _ENERGIES.fullmatch(member):
            return f"what stands before `=` is no name: {shown(member.strip())}"
        if own is not None and not is_equal(own):
            return CONTRADICTION
    return ""


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
# Signs of units, mixed fractions and powers of ten, and their plain forms.
_SIGNS = rules(
    (r"(?<=\d)~(?=[A-Za-z\\])", " "),  # the blank of LaTeX
    (r"(?<=\d)\s*\^\s*\{?o\}?(?!\w)", "°"),
    (r"(?<=\d)(?:\*\^|[dD])(?=[-+]?\d)", "e"),  # 1*^3 in Mathematica, 1d3 in Fortran
    (r"(\d\s*(?:h|min))\s*(?=\d+(?:\.\d+)?\s*(?:min|s|sec)\b)", r"\1 + "),  # 1 h 20 min
    (r"\A\s*minus\s+(?=[\d.])", "-"),
    (r"(?<=\d)\s*(?:degrees? of freedom|d\.?o\.?f\.?)(?!\w)", ""),
    (r"/\s*\(([^()]*\d)\s*([^\W\d_]+)\)\s*\Z", r"/(\1) /\2"),  # divided by a quantity: 2π/(24 h)
    (rf"(?P<deg>[-+]?\d+)\s*(?:[°º]|deg)\s*{_MINUTES}(?:\s*{_SECONDS})?", _in_degrees),
    (r"(?<=\d)\s*′", " arcmin"),
    (r"(?<=\d)\s*″", " arcsec"),
    (r"\\(?:SI|qty)\s*\{([^{}]*)\}\s*\{([^{}]*)\}", _si),
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
    rf"{typed.DECIMAL}(?:\s*%)?(?(unit)(?:\s*{_UNIT_NAME}(?=\s*\)?\s*\Z))?)\s*(?(open)\)|(?![\w(]*\())"
)
# A number without its uncertainty: `(3.12 ± 0.02) m` is `3.12 m`; and a quantity in brackets: `(12.5 J)`.
_AROUND = rules(
    (_UNCERTAIN, r"\g<value> "),
    (r"(?<=\d)\s+(?=[eE][-+]?\d)", ""),
    (r"\A\s*\(([^()]*\d\s*[^\W\d][^()]*)\)\s*\Z", r"\1"),
    # the factor of a list, with a unit: `(2 kg m^2)*(0.5)`
    (rf"\A\(([-+\d.,*/ ]+)\s((?!{__COUNTED})[^\W\d_][^()]*)\)\*\(([^()]*)\)\Z", r"(\1)*(\3) \2"),
)


def _value(text: str) -> tuple[tree.Node, str]:
    """An expression without names, and the unit behind it, if there is one."""
    if _DIGITS_APART.match(text):
        raise ExpressionError("nothing stands between digits")
    text = re.sub(r"\b(ln|exp|sin|cos|tan)(?=\d)", r"\1 ", text)
    blank = _BEHIND.search(text)
    ways = [] if blank is None else [(text[: blank.start()], text[blank.end() :])]
    if blank is None or re.search(r"[a-z]{2}.*\bdeg", text):
        ways.insert(0, (text, ""))
    for value, behind in ways:
        node = typed.expressions(value, None, leading=False)[0]
        names = sorted(tree.names_in(node))
        if not names:
            return node, behind
    raise ExpressionError(f"{shown(names[0])} has no value")


# Digits with a blank or a sign between them: `12 5`, `1_000`.
_DIGITS_APART = re.compile(r"[-+]?\d[.,\d]*[\s_'][.,\s_']*\d(?!\s*/)")


# --- units


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
        return [*found, *read_units(text[3:], expected, place)] if text.startswith("in ") else found
    except ValueProblem as problem:
        message = f"read {shown(text)}: {advice(problem)}"
        raise Unreadable("unit_incompatible", message, place=place) from None


def _unit_spelled(name: str, power: str, own: set[str]) -> list[str]:
    """The readings of one name in a unit: `m2` is m^2, and `ms^-1` also m s^-1."""
    stem = name.rstrip("0123456789")
    ways: list[str] = []
    for part, raised in ((name, power), (stem, power or f"^{name.removeprefix(stem)}")):
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
