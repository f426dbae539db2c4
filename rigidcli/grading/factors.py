"""The one list of factors by which numbers are wrong, and where each of them is a mistake.

Which there are depends on the dimension of what is asked, and on what the result is: a sign is the sense of
a precession in some, and just a sign in the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from rigidcli.fields.dimensions import DIMENSIONLESS, Dimension

TENS = tuple(10.0**power for power in range(1, 13))
"""What a slip in a power of ten may come to."""

CONSTANTS = (2, 3, 4, 5, 6, 8, 3 / 2, 4 / 3, 5 / 2, math.sqrt(2), math.sqrt(3), math.pi)
"""Numbers that get lost in a formula."""

DEGREES = 180 / math.pi
"""In a radian."""

TURN = 2 * math.pi
"""In radians."""

TURNS_PER_MINUTE = 30 / math.pi
"""In a radian per second."""

KILOMETRES_PER_HOUR = 3.6
"""In a metre per second."""

WEIGHTS = (9.80665, 4.184)
"""A kilogram's weight in newtons, a calorie in joules."""

CONVERSIONS: dict[str, tuple[float, ...]] = {
    "length": (2.54, 0.0254, 25.4, 0.3048, 0.9144, 1.609344, 1609.344),
    "time": (60, 3600, 24, 86_400, 31_557_600),
    "mass": (0.45359237,),
}
"""Units of everyday life in SI units, by what they measure: inch, foot, yard, mile; minute to year; pound."""

ANGLES_OF_PRECESSION = ("psi", "phi_dot")
"""Parts of the names of results whose sign is the sense of a precession ..."""

PRECESSIONS = ("rate", "precession", *ANGLES_OF_PRECESSION)
"""... where precession is what is studied ..."""

NO_PRECESSION = ("growth", "error")
"""... and of those whose sign is not."""


def factors(dimension: Dimension, path: tuple[str, ...], *, unknown: bool) -> Iterator[tuple[str, float]]:
    """Codes and factors for a result; where the dimension is `unknown`, those of all dimensions."""
    yield ("precession_sense" if _is_precession(path) else "sign_error"), -1.0
    for code, sizes in _either_way(dimension, unknown):
        for size in sizes:
            yield code, size
            yield code, 1 / size


def _either_way(dimension: Dimension, unknown: bool) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Codes and the factors by which one multiplies or divides."""
    yield "power_of_ten", TENS
    yield "constant_factor", CONSTANTS
    rate = dimension.time == -1 and not (dimension.mass or dimension.length)
    if dimension.angle or dimension.time or dimension == DIMENSIONLESS:
        yield "degrees_radians", (DEGREES,)
    if rate or unknown or dimension == Dimension(time=1):
        yield "frequency_vs_angular_frequency", (TURN,)
    if rate or unknown:
        yield "unit_conversion", (TURNS_PER_MINUTE,)
    if (dimension.length and dimension.time) or unknown:
        yield "unit_conversion", (KILOMETRES_PER_HOUR,)
    if dimension.mass and dimension.length and dimension.time:
        yield "unit_conversion", WEIGHTS
    for name, sizes in CONVERSIONS.items():
        most = 1 if unknown else abs(getattr(dimension, name))
        yield "unit_conversion", tuple(size**power for size in sizes for power in range(1, most + 1))


def _is_precession(path: tuple[str, ...]) -> bool:
    """Whether the sign of a result is the sense of a precession."""
    last = path[-1] if path else ""
    if any(part in last for part in NO_PRECESSION):
        return False
    names = PRECESSIONS if path[:1] == ("precess",) else ANGLES_OF_PRECESSION
    return any(part in last for part in names)


def times(code: str) -> Callable[[Any], Iterator[Any]]:
    """What makes a key wrong by each factor of a mistake, as far as the tolerance can tell it from 1.

    The key tells its `factors` and its `least_change`, and how it is so many `times` as large.
    """

    def changes(key: Any) -> Iterator[Any]:
        for name, factor in key.factors:
            if name == code and abs(factor - 1) > key.least_change:
                yield key.times(factor)

    return changes
