"""Variants: parameters of the documents that have another value for each student.

Each parameter is drawn by itself: SHA-256 (FIPS 180-4, section 6.2) is applied to the seed, the name of the
parameter and the name of the student, and the digest, as a whole number, is taken modulo the number of
values. So a value is the same in every run, on every machine and in every version of Python; another student,
or another parameter, changes nothing for the others; and every value comes up equally often, as some are
favoured by less than one part in 10^70.
"""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from decimal import Context, Decimal, Inexact
from hashlib import sha256
from typing import Any, TypeAlias

from rigidcli.document.parameters import read_names
from rigidcli.errors import ValueProblem, at, gathered, shown
from rigidcli.fields.section import refuse
from rigidcli.fields.units import Unit, parse_unit, split_quantity

MOST_VALUES = 1000  # of a variant: each of them is tried in every document, which takes milliseconds
MOST_VARIANTS = 20  # more parameters with variants than any assignment has
# The keys of a range, and what they mean.
RANGE = {
    "from": "the first value of a range: `from: 2 cm`",
    "to": "its last value: `to: 5 cm`",
    "step": "from each value to the next: `step: 5 mm`",
}
Values: TypeAlias = Mapping[str, str]  # values of parameters, as they are typed: `{"a": "2.5 cm"}`
# The JSON Schema of all variants.
_VALUE = {"type": ["number", "string"]}
_LIST = {"type": "array", "items": _VALUE, "minItems": 1, "maxItems": MOST_VALUES, "uniqueItems": True}
_KEYS = {key: _VALUE | {"description": about} for key, about in RANGE.items()}
_RANGE = {"type": "object", "properties": _KEYS, "required": [*RANGE], "additionalProperties": False}
_EACH = {"anyOf": [_LIST, _RANGE]}
SCHEMA: dict[str, Any] = {
    "type": "object", "minProperties": 1, "maxProperties": MOST_VARIANTS, "additionalProperties": _EACH,
}  # fmt: skip
EXAMPLES = "such as [1, 2, 3] or {from: 2 cm, to: 5 cm, step: 5 mm}"
EXACTLY = Context(prec=50, traps=[Inexact])  # a quotient whose decimals do not end is an error
# A decimal number of a size, and with as many digits, as people type.
_DECIMAL = re.compile(r"[-+]?(?=\.?[0-9])(?=[0-9.]{1,20}(?![0-9.]))[0-9]*\.?[0-9]*(?:[eE][-+]?[0-9]{1,2})?")
# What stands in braces in a title: the name of a variant, or a part of a formula.
_BRACES = re.compile(r"\{\s*([^{}]+?)\s*\}")
# A name in braces that is no argument in LaTeX, such as the one of `\sqrt{x}` or `v_{max}`.
NAME_IN_BRACES = re.compile(r"(?<![\w\\^_}])\{\s*([^\W\d]\w*)\s*\}")


@dataclass(frozen=True, slots=True)
class Variants:
    """The `values` of each parameter, as they are typed, and the `seed` that decides who gets which."""

    seed: str
    values: Mapping[str, tuple[str, ...]]

    def of(self, student: str) -> dict[str, str]:
        """The values of the student of this name; blanks, capitals and the order of its words do not count.

        So the same student is meant by `Doe, Jane` of one list and `jane doe` of another.
        """
        name = unicodedata.normalize("NFKC", student).casefold()
        person = " ".join(sorted(re.findall(r"[^\W_]+", name))) or name

        drawn = {}
        for parameter, values in self.values.items():
            digest = sha256(json.dumps([self.seed, parameter, person]).encode()).digest()
            drawn[parameter] = values[int.from_bytes(digest, "big") % len(values)]
        return drawn

    def trials(self) -> list[dict[str, str]]:
        """Three variants for a test of the keys: all first values, all last ones, and those in the middle."""
        firsts, lasts = ({name: each[end] for name, each in self.values.items()} for end in (0, -1))
        middle = {name: values[len(values) // 2] for name, values in self.values.items()}
        return [*{words(values): values for values in (firsts, lasts, middle)}.values()]


# --- titles


def words(values: Values) -> str:
    """Values for people: `m = 2 kg, a = 2.5 cm`."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def named_in(title: str, names: Mapping[str, Any]) -> set[str]:
    """Those of the `names` that stand in braces in a title."""
    return names.keys() & set(_BRACES.findall(title))


def filled(title: str, values: Values, own: Values) -> str:
    """A title with the `values` in place of their names in braces; other braces stay.

    Behind it stand those of the document's `own` values that it does not name: the student needs them all.
    """
    rest = words({name: value for name, value in own.items() if name not in named_in(title, values)})
    text = _BRACES.sub(lambda braces: values.get(braces[1], braces[0]), title)
    return f"{text} ({rest})" if text and rest else text or rest


# --- reading


def read_variants(raw: object, info: object = None) -> dict[str, tuple[str, ...]]:
    """The values of each variant. Raises ValueProblem, or ValidationError with all problems."""
    if not isinstance(raw, Mapping) or not 1 <= len(raw) <= MOST_VARIANTS:
        read = f"{len(raw)} of them" if isinstance(raw, Mapping) else shown(raw)
        message = f"read {read}, expected 1 to {MOST_VARIANTS} parameters with their values"
        raise ValueProblem(message, hint="as in `variants: {m: [1, 2, 3]}`")
    spelling, problems = read_names(raw, has_time=False)
    variants = {}
    for key in spelling.values():
        with gathered(problems, key):
            variants[key] = read_values(raw[key])
    refuse("variants", problems)
    return variants


def read_values(raw: object) -> tuple[str, ...]:
    """The values of a list or a range, as texts. Raises ValueProblem."""
    if isinstance(raw, Mapping):
        return _spaced(raw)
    if not isinstance(raw, list):
        meant = f"write `[{raw}]`" if isinstance(raw, str) else None
        raise ValueProblem(f"read {shown(raw)}, expected a list of values, {EXAMPLES}", hint=meant)
    if not 1 <= len(raw) <= MOST_VALUES:
        raise ValueProblem(f"read {len(raw):,} values, expected 1 to {MOST_VALUES:,}", hint=EXAMPLES)
    for place, value in enumerate(raw):
        with at(place):
            if not isinstance(value, str) or not value.strip():
                raise ValueProblem(f"read {shown(value)}, expected a number, or a quantity such as `2 cm`")
            if value in raw[:place]:
                hint = "leave one out: every value comes up equally often"
                raise ValueProblem(f"{shown(value)} stands twice", hint=hint)
    return tuple(value.strip() for value in raw)


def _spaced(raw: Mapping[str, Any]) -> tuple[str, ...]:
    """The values of a range, exactly, in the unit of its start. Raises ValueProblem."""
    for key in (*raw, *RANGE):
        if key not in RANGE or raw.get(key) is None:
            wrong = f"`{key}` is missing" if key in RANGE else f"unknown key {shown(key)}"
            raise ValueProblem(f"{wrong}, expected from, to and step", hint=EXAMPLES)
    start, end, by = (shown(raw[key]) for key in RANGE)
    first, unit = _amount(raw, "from", None)
    last, step = (_amount(raw, key, unit)[0] for key in ("to", "step"))
    with at("step"):
        if step == 0:
            raise ValueProblem(f"read {by}, expected a step that is not zero")
        if (last - first) / step < 0:
            hint = "exchange `from` and `to`"
            raise ValueProblem(f"a step of {by} leads from {start} away from {end}", hint=hint)
        count = int((last - first) / step) + 1
        if count > MOST_VALUES:
            message = f"there are {count:,} values in it, expected at most {MOST_VALUES:,}"
            raise ValueProblem(message, hint="write a longer step")
    numbers = ((first + place * step).normalize() for place in range(count))
    unit_text = f" {unit.text}" if unit else ""
    values = tuple(f"{n:f}{unit_text}" if abs(n.adjusted()) < 16 else f"{n:e}{unit_text}" for n in numbers)
    if (last - first) % step:
        message = f"steps of {by} from {start} do not end at {end}"
        raise ValueProblem(message, path=("to",), hint=f"write `to: {values[-1]}`")
    return values


def _amount(raw: Mapping[str, Any], key: str, unit: Unit | None) -> tuple[Decimal, Unit | None]:
    """A bound of a range, or its step, in the `unit` of its start, if that has one. Raises ValueProblem."""
    with at(key):
        written = split_quantity(raw[key]) if isinstance(raw[key], str) else None
        digits = written.digits if written else str(raw[key]).strip()
        if not _DECIMAL.fullmatch(digits):
            raise ValueProblem(f"read {shown(raw[key])}, expected a number, or a quantity such as `2 cm`")
        amount, own = Decimal(digits), parse_unit(written.unit) if written else None
        if key == "from" or own == unit:
            return amount, own
        if own and unit and (own.dimension, own.pi_power) == (unit.dimension, unit.pi_power):
            ratio = own.factor / unit.factor
            with suppress(Inexact):
                return EXACTLY.divide(EXACTLY.multiply(amount, ratio.numerator), ratio.denominator), unit
        hint = f"write all three in `{unit.text}`" if unit else "write the unit behind all three"
        read = f"read {shown(raw[key])} beside {shown(raw['from'])}"
        raise ValueProblem(f"{read}, expected one unit", hint=hint)
