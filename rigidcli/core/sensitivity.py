"""How far one rounding of each input turns an orientation: no formula in floats is more accurate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.rotation import angles_between

ROUNDING_OF_QUATERNION = 2.0**-50
"""The least error (rad) of an orientation, from the rounding of the four components of its quaternion."""

MOST_TIMES = 64
"""The most times that are looked at, besides the last one: each costs an orientation for each input."""

ULPS_MOVED = 16
"""Units in the last place by which an input is moved: more than the rounding of the formulas."""

LARGEST_LINEAR_TURN = 0.1
"""Beyond this angle (rad) between the two motions the linear estimate means nothing."""


def representative(times: Floats) -> Floats:
    """Evenly chosen ones of the times (n), the first and the last among them."""
    return np.append(times[:: 1 + len(times) // MOST_TIMES], times[-1:])


def to_rounding(
    orientations: Callable[[Sequence[Any]], Floats],
    inputs: Sequence[Any],
    sizes: Sequence[Any],
    reference: Floats,
    ulps: int = ULPS_MOVED,
) -> Floats:
    """The largest angle (m, rad, at most pi) by which one rounding of each input turns m motions.

    `reference` (m, n, 4) are their orientations, and `orientations` gives those at other inputs. Each of
    the `inputs`, a number or one for each motion, is moved by so many `ulps` of its size, and the angle
    is divided by that number. The angles are combined as a root of the sum of squares. Where a moved
    input takes the body somewhere else altogether, nothing is certain, and the angle is pi.
    """
    squares = np.zeros(reference.shape[:2])
    for place, size in enumerate(sizes):
        if np.any(size):
            moved = [*inputs[:place], inputs[place] + ulps * EPS * size, *inputs[place + 1 :]]
            angle = angles_between(reference, orientations(moved))
            squares += np.where(angle < LARGEST_LINEAR_TURN, angle / ulps, np.pi) ** 2
    largest: Floats = np.clip(np.sqrt(squares.max(axis=1, initial=0.0)), ROUNDING_OF_QUATERNION, np.pi)
    return largest
