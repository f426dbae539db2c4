"""Trajectories that are right at other times: in another unit, shifted, backwards, or faster and slower.

Each is a way to get times of the reference from those of an answer. What shift or frequency it is, is told
from some of the rows: the best of many guesses, in the grid of the key, is made better step by step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.trajectories.key import Key, Rows

TIME_UNITS = (60.0, 3600.0, 1e3, 1e6)
"""Units of time that stand for seconds by mistake, or seconds for them."""

ENOUGH = 0.5
"""The part of the rows of which a mistake must tell what they are."""

EDGE = 0.01
"""How far from the ends of the span, in units of it, times may begin and end."""

PROBES = 32
"""Rows at which a shift or another frequency is looked for."""

LEAST_GUESSES, MOST_GUESSES = 101, 2001
PER_CROSSING = 10
"""Shifts or frequencies that are tried, more of them where the motion is faster."""

LOWEST_RATIO = 0.3
"""Of frequencies; the highest is its inverse."""

RATIOS = {
    "frequency_wrong": (2.0, 3.0),
    "frequency_vs_angular_frequency": (2 * math.pi,),
    "degrees_radians": (180 / math.pi,),
}
"""Ratios of frequencies that are tried by themselves, as are their inverses, by the mistake that each is."""

FEW = 8
"""Rows that are enough for these."""

SEEN = 10.0
"""What a column that moves must change by in these rows, in margins."""

CLEARLY = 0.05
"""The part of an answer's deviation that another frequency leaves."""

FAINT = 0.01
"""A deviation, in units of a column's range, that may as well be that of a coarse integration."""

ROUNDS, NARROWER = 12, 4
"""How often finer ones about the best are tried, each time in a range so much narrower."""

PATIENCE = 3
"""Rounds after which what does not get better any more, and is not near, is given up."""

OSCILLATING = 2
"""Crossings of its middle from which a motion has a frequency."""

PROMISING = 0.5
"""Deviation, in units of the columns' ranges, of a first guess from which it can get better."""

FAR = 4.0
"""The largest square of a deviation in these units that counts: beyond, one row is as wrong as another."""

Retiming: TypeAlias = Callable[[Floats, Floats], Floats]
"""Times of the reference for a parameter (p by 1) and times of an answer (k)."""


def with_inverses(factors: Sequence[float]) -> tuple[float, ...]:
    """Factors, and one over each."""
    return (*factors, *(1 / factor for factor in factors))


def in_other_unit(key: Key, rows: Rows) -> bool:
    """Whether its times are in another unit than seconds."""
    for factor in with_inverses(TIME_UNITS):
        times = rows.times / factor
        if _covers(key, times) and _agrees(key, rows, times):
            return True
    return False


def backwards(key: Key, rows: Rows) -> bool:
    """Whether it runs from the end to the beginning, columns that are rates perhaps with the other sign."""
    for turn in (key.start + key.stop, rows.times[0] + rows.times[-1]):
        times = turn - rows.times
        same, opposite = _fitting(key, rows, times), _fitting(key, rows, times, (-1.0,))
        if (same | opposite)[rows.present].all() and (same & key.moving).any():
            return True
    return False


def shifted(key: Key, rows: Rows) -> bool:
    """Whether it is x(t + s), and is not what is expected as it stands."""
    if rows.failing is None:
        edge = EDGE * key.span
        low, high = key.stop - edge - rows.times[-1], key.start + edge - rows.times[0]
        if low > high:  # its times do not cover the span, wherever they begin
            return False
        shifts = np.linspace(low, high, LEAST_GUESSES)
    else:
        shifts = np.linspace(-0.5, 0.5, _guesses(key)) * key.span
    times = _found(key, rows, shifts, lambda shift, t: t + shift)
    return times is not None and _agrees(key, rows, times) and not _agrees(key, rows, rows.times)


def by_ratio(key: Key, rows: Rows, ratios: Sequence[float]) -> bool:
    """Whether it is x(a t) with one of the ratios a, as far as its rows can be compared."""
    for ratio in with_inverses(ratios):
        times = key.start + ratio * (rows.times - key.start)
        inside = (times >= key.start) & (times <= key.horizon)
        if inside.sum() < FEW:
            continue
        expected = key.at(times[inside])
        seen = np.ptp(expected, axis=0) > SEEN * key.margins
        misses = _misses(key, rows.values[inside], expected, (1.0, ratio, 1 / ratio))
        if seen[key.moving].all() and (misses <= 1)[rows.present].all():
            return True
    return False


def at_other_frequency(key: Key, rows: Rows) -> bool:
    """Whether it is x(a t), and clearly so; rates may then have a factor a, and amplitudes 1/a."""
    if by_ratio(key, rows, RATIOS["frequency_wrong"]):
        return True
    ratios = np.geomspace(LOWEST_RATIO, 1 / LOWEST_RATIO, _guesses(key))
    times = _found(key, rows, ratios, lambda ratio, t: key.start + ratio * (t - key.start), rates=True)
    if times is None:
        return False
    ratio = float((times[-1] - key.start) / (rows.times[-1] - key.start))
    factors = (1.0, ratio, 1 / ratio)
    return _agrees(key, rows, times, factors) and _is_clear(key, rows, times, factors)


def _is_clear(key: Key, rows: Rows, times: Floats, factors: Sequence[float]) -> bool:
    """Whether the answer is much nearer to the reference at other times (k) than as it stands."""
    inside = (times >= key.start) & (times <= key.horizon) & (rows.times <= key.horizon)
    values = rows.values[inside]
    left = _misses(key, values, key.at(times[inside]), factors)
    whole = _misses(key, values, key.at(rows.times[inside]), (1.0,))
    moving = [place for place in rows.present if key.moving[place]]
    is_seen = whole * key.margins > FAINT * key.ranges
    return bool((left < CLEARLY * whole)[moving].all() and is_seen[moving].any())


def _misses(key: Key, values: Floats, expected: Floats, factors: Sequence[float]) -> Floats:
    """The most that columns of an answer (k by m) are off by, each by the best of the factors, in margins."""
    found: Floats = np.min([key.misses(values / each, expected).max(axis=0) for each in factors], axis=0)
    return found


def _fitting(key: Key, rows: Rows, times: Floats, factors: Sequence[float] = (1.0,)) -> Mask:
    """Which columns of the answer are those of the reference at other times (k), but for one of the factors.

    None is where too few of the rows can be compared, or these do not show the motion.
    """
    nothing = np.zeros(rows.values.shape[1], dtype=bool)
    inside = (times >= key.start) & (times <= key.horizon)
    if inside.sum() < _least_rows(key, times):
        return nothing
    expected, values = key.at(times[inside]), rows.values[inside]
    moving = [place for place in rows.present if key.moving[place]]
    if moving and not (np.ptp(expected, axis=0) > 2 * key.margins)[moving].any():
        return nothing
    fitting: Mask = _misses(key, values, expected, factors) <= 1
    return fitting


def _agrees(key: Key, rows: Rows, times: Floats, factors: Sequence[float] = (1.0,)) -> bool:
    """Whether all columns are such."""
    return bool(_fitting(key, rows, times, factors)[rows.present].all())


def _covers(key: Key, times: Floats) -> bool:
    """Whether times cover the span but for a little."""
    return bool(times[0] <= key.start + EDGE * key.span and times[-1] >= key.stop - EDGE * key.span)


def _guesses(key: Key) -> int:
    return min(MOST_GUESSES, max(LEAST_GUESSES, PER_CROSSING * key.crossings))


def _found(
    key: Key, rows: Rows, guesses: Floats, retiming: Retiming, *, rates: bool = False
) -> Floats | None:
    """The times of the reference (k) by the parameter that fits best; None where none comes near.

    The best of the `guesses` is made better by finer ones about it. The parameter of `rates` is tried as a
    factor of the columns, too.
    """
    some = probed(len(rows.times))
    few = Rows(rows.times[some], rows.values[some], rows.failing)
    off = _deviation(key, few, guesses, retiming, rates=rates, exactly=False)
    best = int(np.argmin(off))
    if not off[best] < PROMISING**2:
        return None
    found, step = guesses[best], np.diff(guesses)[max(0, best - 1) : best + 1].max()
    enough = np.mean((key.margins / key.ranges)[rows.present] ** 2)
    last = np.inf
    for turn in range(ROUNDS):
        near = found + step * np.linspace(-1, 1, 2 * NARROWER + 1)
        off = _deviation(key, few, near, retiming, rates=rates, exactly=True)
        found = near[np.argmin(off)]
        if turn >= PATIENCE and off.min() > max(enough, last / 2):
            return None
        last = off.min()
        step /= NARROWER
    return retiming(found, rows.times)


def probed(count: int) -> NDArray[np.int64]:
    """Some of so many rows, at irregular distances: of regular ones, several frequencies look the same."""
    golden = (math.sqrt(5) - 1) / 2
    return np.unique((np.arange(PROBES) * golden % 1 * count).astype(np.int64))


def _deviation(
    key: Key, rows: Rows, guesses: Floats, retiming: Retiming, *, rates: bool, exactly: bool
) -> Floats:
    """The mean square of what columns are off by for each guess (p), in units of their ranges.

    It is FAR where too few rows can be compared.
    """
    times = retiming(guesses[:, None], rows.times)
    inside = (times >= key.start) & (times <= key.horizon)
    count = inside.sum(axis=1)
    reference = key.at if exactly else key.roughly_at
    expected = reference(times.ravel()).reshape(*times.shape, -1)
    squares = []
    for factor in [np.ones_like(guesses)] + ([guesses, 1 / guesses] if rates else []):
        away = key.wrapped(rows.values / factor[:, None, None] - expected) / key.ranges
        away[~inside] = 0.0
        squares.append(np.minimum(away**2, FAR).sum(axis=1) / np.maximum(count, 1)[:, None])
    total = np.min(squares, axis=0)[:, rows.present].mean(axis=1)
    off: Floats = np.where(count >= _least_rows(key, rows.times), total, FAR)
    return off


def _least_rows(key: Key, times: Floats) -> float:
    """The rows of which a mistake must tell what they are."""
    return max(2.0, ENOUGH * len(times) * (key.horizon - key.start) / key.span)
