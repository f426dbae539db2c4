"""Numbers and quantities as they are typed: decimals of any size, and texts behind them that may be units."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from rigidcli.errors import ValueProblem, shown, with_article
from rigidcli.fields.dimensions import Dimension
from rigidcli.fields.units import is_unit
from rigidcli.language.tokens import LOWERED, SUPERSCRIPT


def number_or_text(raw: object, expected: str) -> float | int | str | Decimal:
    """A scalar that may be a number. Raises ValueProblem for anything else."""
    if isinstance(raw, bool) or not isinstance(raw, float | int | str | Decimal):
        raise ValueProblem(f"read {shown(raw)}, expected {expected}")
    if raw in ("NaN", "Infinity", "-Infinity") or (isinstance(raw, float) and not math.isfinite(raw)):
        raise ValueProblem(f"read {shown(raw)}, expected a finite number")
    return raw


def finite(raw: float | int | str | Decimal) -> float:
    """A number as a float. Raises ValueProblem for a text that is no number, and beyond all floats."""
    try:
        value = float(raw)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ValueProblem(f"read {shown(raw)}, expected a finite number")
    return value


def exact_text(number: Fraction, pi_power: int) -> str:
    """`number` pi^`pi_power` in the expression language, exactly."""
    text = f"{number.numerator}/{number.denominator}"
    if number.denominator == 1:
        text = str(number.numerator)
    elif abs(number) < 2**1000 and Fraction(decimal := repr(float(number))) == number:
        text = decimal
    return text if pi_power == 0 else f"{text}*pi" if pi_power == 1 else f"{text}*pi**{pi_power}"


@lru_cache(maxsize=256)
def number_of(dimension: Dimension | None, sign: str | None = None) -> str:
    """A number of this dimension and sign in words, for messages of errors."""
    thing = "number" if not dimension or not any(dimension) else str(dimension)
    return with_article(thing if sign is None else f"{sign} {thing}")


_QUANTITY = re.compile(
    rf"""\s*(?P<digits>[-+−]?+(?>[0-9]++\.?+[0-9]*+|\.[0-9]++))
    (?: [eE](?P<e>[-+−]?[0-9]++)
      | \s*[*·⋅]\s*10 (?: (?:\^|\*\*)(?P<power>[-+−]?[0-9]++) | (?P<raised>{SUPERSCRIPT}) )
    )?+
    (?P<gap>\s*)(?P<unit>(?: (?!{SUPERSCRIPT})[^\W\d_] | [°′″] | (?<=\s)1/ ).*)""",
    re.DOTALL | re.VERBOSE,
)


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
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None
    power = match["e"] or match["power"] or (match["raised"] or "").translate(LOWERED)
    number = f"{match['digits']}e{power}" if power else match["digits"]
    return Written(number.replace("−", "-"), match["unit"].rstrip(), not match["gap"])


_QUOTIENT = re.compile(r"\s*(\d+(?:\.\d*)?)\s*/\s*(\d+(?:\.\d*)?)\s+(\S.*)")
"""A quotient of two numbers, and a text that may be a unit."""


def quantity_meant(text: str) -> str | None:
    """The quantity `0.5 m` that is meant by `1/2 m`, which cannot be read; None for other texts."""
    match = _QUOTIENT.fullmatch(text)
    if match is None or not is_unit(match[3]) or not float(match[2]):
        return None
    return f"{float(match[1]) / float(match[2])!r} {match[3]}"
