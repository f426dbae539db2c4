"""How far the rounding of inputs turns an orientation, which no method can tell better from floats."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.rotation import angles_between
from rigidcli.core.solution import ROUNDING

LEAST = 4 * ROUNDING
"""The least angle (rad) that is told: the rounding of the quaternion itself, of four components."""

SAMPLES = 64
"""The most times that are looked at, besides the last one: each costs as many orientations as inputs."""


def representative(times: Floats) -> Floats:
    """Evenly chosen ones of the times (n), the first and the last among them."""
    return np.append(times[:: 1 + len(times) // SAMPLES], times[-1:])


def to_rounding(orientations: Callable[[Floats], Floats], inputs: Floats, reference: Floats) -> float:
    """The largest angle (rad, at most pi) from the `reference` orientations (n, 4) when inputs are rounded.

    Each of the `inputs` (m) that is not zero grows by one unit in the last place, one at a time. The angles
    to the `orientations` of these are combined as a root of the sum of squares.
    """
    squares = np.zeros(len(reference))
    for index in np.flatnonzero(inputs):
        changed = inputs.copy()
        changed[index] = np.nextafter(inputs[index], math.copysign(math.inf, inputs[index]))
        squares += angles_between(reference, orientations(changed)) ** 2
    # In this order, `min` makes pi of what is not a number.
    return max(LEAST, min(math.pi, math.sqrt(squares.max(initial=0.0))))
