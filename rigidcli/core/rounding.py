"""What the rounding of inputs does to an orientation: no method can tell it better from floats."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.rotation import angles_between

EPS = float(np.finfo(np.float64).eps)

SAMPLES = 64
"""Of how many times, at most, the worst is looked for, besides the last one."""


def some(times: Floats) -> Floats:
    """Some of the times (n), the last one among them."""
    return np.append(times[:: 1 + len(times) // SAMPLES], times[-1:])


def sensitivity(orientations: Callable[[Floats], Floats], inputs: Floats, reference: Floats) -> float:
    """How far (rad, at most pi) the `reference` orientations (n, 4) move when the inputs change by rounding.

    Each of the `inputs` (m) that is not zero grows by one unit in the last place, one at a time; the angles
    to the `orientations` of these are combined as a root of the sum of squares, and the largest is returned.
    """
    squares = np.zeros(len(reference))
    for index in np.flatnonzero(inputs):
        changed = inputs.copy()
        changed[index] = np.nextafter(inputs[index], math.copysign(math.inf, inputs[index]))
        squares += angles_between(reference, orientations(changed)) ** 2
    # In this order, `min` makes pi of what is not a number.
    return max(4 * EPS, min(math.pi, math.sqrt(squares.max(initial=0.0))))
