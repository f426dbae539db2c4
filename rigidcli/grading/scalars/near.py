"""Whether a number, in the unit in which it was typed, is the reference, or a multiple of it.

It is compared in that unit, so that half of one in the last figure means what the student meant by it.
"""

from __future__ import annotations

import math

from rigidcli.grading.numbers import NOISE, Written, margin
from rigidcli.grading.scalars.key import MOST_PERIODS, Key


def is_near(key: Key, number: float, scale: float, factor: float = 1.0) -> bool:
    """Whether a number, in a unit of `scale`, is the reference times a factor, by the tolerance of the key.

    A factor below 1 takes an absolute tolerance with it, which would cover all that is small.
    """
    if number == 0 and abs(key.reference) <= key.noise:
        return True
    target = factor * (key.reference / scale)
    gap = _gap(key, number, target, scale)
    if gap == math.inf or (target == 0.0 and key.reference != 0.0):
        return False
    size, rounding = target, 0.0
    if key.period is not None:
        size = min(abs(number - gap), key.period / scale)
        if gap != number - target:
            rounding = NOISE * max(abs(number), abs(target))
    return abs(gap) <= margin(size, key.tolerance, scale / key.plain / min(1.0, abs(factor))) + rounding


def is_rounded(key: Key, written: Written, scale: float) -> bool:
    """Whether an answer, in a unit of `scale`, is the reference rounded to the digits that are written."""
    gap = _gap(key, written.value, key.reference / scale, scale)
    return abs(gap) <= written.half_a_digit * (1 + NOISE)


def _gap(key: Key, number: float, target: float, scale: float) -> float:
    """How far a number is from its target, both in a unit of `scale`; infinite for what is beyond numbers."""
    gap = number - target
    if not math.isfinite(gap):
        return math.inf
    if key.period is None:
        return gap
    period = key.period / scale
    return math.remainder(gap, period) if 0 < period >= abs(number) / MOST_PERIODS else math.inf
