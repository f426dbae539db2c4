"""The factors by which people's numbers are wrong, and their names."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rigidcli.fields.dimensions import DIMENSIONLESS
from rigidcli.fields.units import Unit

TENS = tuple(10.0**power for power in range(1, 13))
"""What a slip in a power of ten comes to."""

LOST = (2, 3, 4, 5, 6, 8, 12, 3 / 2, 4 / 3, 5 / 2, math.sqrt(2), math.sqrt(3), math.pi)
"""Numbers that get lost in a formula."""

TURN = 2 * math.pi


def common_factor(ratio: float, unit: Unit | None, path: tuple[str, ...], slack: float) -> str | None:
    """The code of the one factor that an answer has, to a relative `slack`; None where it has no name.

    The `unit` and the `path` of the result tell which factors are likely: a 2 pi is one of rates only.
    """
    codes = [
        code
        for code, factor in _factors(unit, path)
        if abs(factor - 1) > 2 * slack and abs(ratio / factor - 1) <= slack
    ]
    return codes[0] if codes else None


def _factors(unit: Unit | None, path: tuple[str, ...]) -> Iterator[tuple[str, float]]:
    """Codes and factors, the likely ones first."""
    dimension = DIMENSIONLESS if unit is None else unit.dimension
    is_rate = dimension.time in (1, -1) and not (dimension.mass or dimension.length)
    unknown = unit is None and not path
    yield "sign_error", -1.0
    either_way = [("power_of_ten", TENS)]
    if dimension.angle or dimension.time or dimension == DIMENSIONLESS:
        either_way.append(("degrees_radians", (180 / math.pi,)))
    if is_rate or dimension.cycle or unknown:
        either_way.append(("frequency_vs_angular_frequency", (TURN,)))
    either_way.append(("constant_factor", LOST))
    for code, factors in either_way:
        for factor in factors:
            yield code, factor
            yield code, 1 / factor
