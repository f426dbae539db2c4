"""Searches along many lines at a time: where functions pass zero, and where they are lowest."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from rigidcli.core.arithmetic import Array, Floats

STEPS = 8
"""Steps of Ridders's method to a zero between two samples; a smooth function needs fewer."""

BISECTIONS = 50
"""Halvings by which zeros are found that this method has missed: to a part in 10^15."""

FOUND = 1e-13
"""A zero is found when the function changes its sign within this distance, in units of the line."""

GOLDEN = (5**0.5 - 1) / 2
"""The part that is left of an interval in each step of the golden-section search."""

SECTIONS = 30
"""Steps of that search: to a part in 10^6 of the gap between two samples, or 10^7 of the line."""

SAMPLES = 17
"""Places on each line at which functions are looked at before a search."""

FLAT = 1e-9
"""A function that changes by less, in units of its largest value, has no peak: this is rounding."""

WIDEST = 0.1
"""The net of a search for the lowest point at its beginning, in units of the box."""

SEARCH = 60
"""Steps of that search: to a part in 10^12, as the net gets finer by a third in each."""


def zeros(f: Callable[[Floats, Array], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) where functions change their sign between `low` and `high`.

    `f` takes places and the indices of the functions. C. Ridders, IEEE Trans. Circuits Syst. 26 (1979) 979.
    """
    every = np.arange(low.size)
    if not every.size:
        return low
    start, end = low, high
    at_low, at_high = f(low, every), f(high, every)
    positive = at_low > 0
    for _ in range(STEPS):
        middle = (low + high) / 2
        at_middle = f(middle, every)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = (middle - low) * np.sign(at_low - at_high) * at_middle
            x = middle + step / np.sqrt(at_middle**2 - at_low * at_high)
        x = np.where(np.isfinite(x), np.clip(x, low, high), middle)
        at_x = f(x, every)
        before = x < middle
        a, at_a = np.where(before, x, middle), np.where(before, at_x, at_middle)
        b, at_b = np.where(before, middle, x), np.where(before, at_middle, at_x)
        first, last = (at_a > 0) != positive, (at_b > 0) == positive
        low, high = np.where(last, b, np.where(first, low, a)), np.where(last, high, np.where(first, a, b))
        at_low = np.where(last, at_b, np.where(first, at_low, at_a))
        at_high = np.where(last, at_high, np.where(first, at_a, at_b))
    sides = [f(np.clip(x + side, start, end), every) > 0 for side in (-FOUND, FOUND)]
    those = np.flatnonzero((sides[0] != positive) | (sides[1] == positive))
    low, high = start[those], end[those]
    for _ in range(BISECTIONS if those.size else 0):
        middle = (low + high) / 2
        same = (f(middle, those) > 0) == positive[those]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    x[those] = (low + high) / 2
    return x


def lowest(f: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) between `low` and `high` where functions are lowest, by golden sections."""
    if not low.size:
        return low
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = f(left), f(right)
    for _ in range(SECTIONS):
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        new = np.where(lower, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        at_new = f(new)
        left, right = np.where(lower, new, right), np.where(lower, left, new)
        at_left, at_right = np.where(lower, at_new, at_right), np.where(lower, at_left, at_new)
    return (low + high) / 2


def lowest_points(
    f: Callable[[Floats], Floats], points: Floats, widest: float = WIDEST
) -> tuple[Floats, Floats]:
    """Where a function is lowest near each of the `points` (1 + d by n), and its values there (SEARCH by n).

    A search by compass, with steps that are first so wide, in units of the box: each time every point goes
    to the lowest of its neighbours in a net of 3^d, which then gets finer by a third.
    """
    directions = np.array(list(product((0.0, -1.0, 1.0), repeat=len(points) - 1))).T
    best, width, told = points, widest, []
    for _ in range(SEARCH):
        trial = np.repeat(best[:, :, None], directions.shape[1], axis=2)
        trial[1:] = np.clip(trial[1:] + width * directions[:, None], 0.0, 1.0)
        values = f(trial.reshape(len(trial), -1)).reshape(trial.shape[1:])
        choice = np.arange(best.shape[1]), values.argmin(axis=1)
        best = trial[:, *choice]
        told.append(values[choice])
        width *= 2 / 3
    return best, np.array(told)


def special(f: Callable[[Array, Floats], Floats], count: int) -> tuple[Array, Floats, Array, Floats]:
    """Where functions on so many lines pass zero, and where they turn back.

    Of each comes the index of the line, and the place from 0 to 1. `f` takes indices of lines and places on
    them, and gives the values there.
    """
    t = np.linspace(0, 1, SAMPLES)
    values = f(np.repeat(np.arange(count), SAMPLES), np.tile(t, count)).reshape(count, SAMPLES)
    on, at = np.argwhere((values[:, 1:] > 0) != (values[:, :-1] > 0)).T
    passed = zeros(lambda x, those: f(on[those], x), t[at], t[at + 1])
    steps = directions(values)
    over, at = np.argwhere(steps[:, 1:] * steps[:, :-1] < 0).T
    turned = lowest(lambda x: -steps[over, at] * f(over, x), t[at], t[at + 2])
    return on, passed, over, turned


def directions(values: Floats) -> Floats:
    """Whether samples along lines (n by m) grow (1), fall (-1), or stay as they are (0) to the next."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(values)
        size = np.abs(np.where(np.isfinite(values), values, 0.0)).max(axis=-1, keepdims=True)
        return np.where(np.abs(steps) > FLAT * size, np.sign(steps), 0.0)
