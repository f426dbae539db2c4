"""How far one rounding of each input turns an orientation: no formula in floats is more accurate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.rotation import angles_between

LEAST = 2.0**-50
"""The least error (rad) of an orientation: the rounding of the quaternion itself, of four components."""

SAMPLES = 64
"""The most times that are looked at, besides the last one: each costs as many orientations as inputs."""

GROWN = 16
"""Units in the last place by which an input is moved: the formulas round by less, which would hide it."""

LOST = 0.1
"""Where a moved input turns the body by more (rad), the motion is no longer near the other one."""


def representative(times: Floats) -> Floats:
    """Evenly chosen ones of the times (n), the first and the last among them."""
    return np.append(times[:: 1 + len(times) // SAMPLES], times[-1:])


def to_rounding(
    orientations: Callable[[Sequence[Any]], Floats],
    inputs: Sequence[Any],
    sizes: Sequence[Any],
    reference: Floats,
    grown: int = GROWN,
) -> Floats:
    """The largest angle (m, rad, at most pi) by which one rounding of each input turns m motions.

    `reference` (m, n, 4) are their orientations, and `orientations` gives those at other inputs. Each of the
    `inputs`, a number or one for each motion, grows by so many roundings of its size as `grown`; the angles
    are combined as a root of the sum of squares. Where an input takes the body somewhere else altogether,
    nothing is certain, and the angle is pi.
    """
    squares = np.zeros(reference.shape[:2])
    for place, size in enumerate(sizes):
        if np.any(size):
            moved = [*inputs[:place], inputs[place] + grown * EPS * size, *inputs[place + 1 :]]
            angle = angles_between(reference, orientations(moved))
            squares += np.where(angle < LOST, angle / grown, np.pi) ** 2
    largest: Floats = np.clip(np.sqrt(squares.max(axis=1, initial=0.0)), LEAST, np.pi)
    return largest
