"""What mistakes make of the key of a trajectory: other times, factors, digits, or columns exchanged.

Each is a key that reads an answer in another way. What shift or frequency it is, is told from some of the
rows: the best of many guesses, in the grid of the key, is made better by minimising the deviation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.factors import CONSTANTS, DEGREES, TENS, TURN
from rigidcli.grading.matching import assigned
from rigidcli.grading.trajectories.key import COVERED, Key, Rows
from rigidcli.grading.trajectories.splines import Trajectory

FACTORS = {
    "sign_error": (-1.0,),
    "degrees_radians": (DEGREES, 1 / DEGREES),
    "frequency_vs_angular_frequency": (TURN, 1 / TURN),
    "constant_factor": (*CONSTANTS, *(1 / factor for factor in CONSTANTS)),
    "power_of_ten": (*TENS, *(1 / factor for factor in TENS)),
}
"""What columns are multiplied by, by the mistake that it is; only angular velocities by a whole turn."""

OF_FREQUENCIES = ("degrees_radians", "frequency_vs_angular_frequency")
"""Those of them that may be the ratio of two frequencies, too."""

TIME_UNITS = (60.0, 3600.0, 1e3, 1e6)
"""Units of time that stand for seconds by mistake, or seconds for them."""

LEAST_SEEN = 10.0
"""How large a column must be, or what it must change by, to show a factor or a frequency, in margins."""

DECIMALS = tuple(10.0**-n for n in range(-6, 10))
"""Units of the last place that a column may be rounded to."""

WHOLE = 1e-6
"""How far from whole numbers rounded values are, in these units."""

COARSEST = 0.1
"""The largest such unit that still shows how a column moves, in units of its range."""

QUARTERS, GROWING = 4, 2.0
"""In the last of so many parts of the time, an error that grows is so much larger than in the first."""

SMALL, BARELY = 0.05, 0.1
"""The most that it may become, in units of a column's range, and the least, in margins."""

PROBES = 32
"""Rows at which a factor, a shift or another frequency is looked for."""

ENOUGH = 0.3
"""The part of these of which a shift or a frequency must tell what they are."""

LEAST_GUESSES, MOST_GUESSES, PER_CROSSING = 101, 2001, 10
"""Shifts or frequencies that are tried, more of them where the motion is faster."""

HIGHEST_RATIO = 3.3
"""Of frequencies that are looked for; the lowest is its inverse."""

OSCILLATING = 2
"""Crossings of its middle from which a motion has a frequency."""

PROMISING = 0.25
"""Deviation, in units of the columns' ranges, of a guess from which it can get better: its phase is right to
a fraction of a radian."""

ROUGH, FINE = 1e-2, 1e-8
"""How exactly a parameter is found, in units of the distance of guesses: at first, and then if it fits."""

NEAR = 0.02
"""Deviation, in units of the columns' ranges, that one leaves at most which has been found roughly."""

FAR = 4.0
"""The largest square of a deviation in these units that counts: beyond, one row is as wrong as another."""

CLEARLY, FAINT = 0.05, 0.01
"""Another frequency leaves at most the first part of a deviation, and this is more than the second one of a
column's range: less may as well be that of a coarse integration."""


# --- other values


@lru_cache(1)  # several mistakes ask it of one answer
def _failing(key: Key, rows: Rows) -> tuple[Mask, Floats, Floats]:
    """Which columns are wrong (m), with the values and what is expected (k by m); none where rows are few."""
    if key.lacks(rows):
        return np.zeros(len(key.columns), dtype=bool), rows.values, rows.values
    _, values, expected = key.compared(rows)
    return rows.present & (key.misses(values, expected) > 1).any(axis=0), values, expected


def _scaled(reading: Key, rows: Rows, factors: Sequence[float], columns: Mask) -> Iterator[Key]:
    """The reading by which each of these columns has the factor that fits it best, if some rows fit."""
    _, values, expected = reading.compared(rows)
    some, sizes = _probed(len(values)), np.array(factors)
    scaled = values[some] / sizes[:, None, None]
    right = np.broadcast_to(expected[some], scaled.shape)
    flat = reading.misses(scaled.reshape(-1, len(columns)), right.reshape(-1, len(columns)))
    off = flat.reshape(scaled.shape).max(axis=1, initial=0.0)
    if (off.min(axis=0) <= 1)[columns].all():
        yield replace(reading, factors=np.where(columns, sizes[off.argmin(axis=0)], 1.0))


def _probed(count: int) -> NDArray[np.int64]:
    """Some of so many rows, at irregular distances: of regular ones, several frequencies look the same."""
    return np.unique((np.arange(PROBES) * (math.sqrt(5) - 1) / 2 % 1 * count).astype(np.int64))


def fitting(code: str) -> Callable[[Key, Rows], Iterator[Key]]:
    """What makes the keys with a factor of this mistake in each wrong column, or in the frequency."""

    def fits(key: Key, rows: Rows) -> Iterator[Key]:
        failing, _, expected = _failing(key, rows)
        large = np.abs(expected).max(axis=0, initial=0.0) > LEAST_SEEN * key.margins
        if code == "frequency_vs_angular_frequency":
            large &= np.isin(np.arange(len(large)), key.rates)
        if failing.any() and large[failing].all():
            yield from _scaled(key.read_with(), rows, FACTORS[code], failing)
        if failing.any() and code in OF_FREQUENCIES:
            for ratio in FACTORS[code]:
                yield from _faster(key, rows, ratio)

    return fits


def permuted(key: Key, rows: Rows) -> Iterator[Key]:
    """The key in which the wrong columns are in the order that fits best."""
    failing, values, expected = _failing(key, rows)
    places, order = np.flatnonzero(failing), np.arange(len(key.columns))
    away = [np.abs(key.wrapped(values[:, [place]] - expected)).max(axis=0) for place in places]
    if len(away) > 1:
        order[places[assigned((np.array(away) <= key.margins)[:, places])]] = places
        yield key.read_with(order=tuple(order.tolist()))


def rounded(key: Key, rows: Rows) -> Iterator[Key]:
    """The key with as many decimal places as each wrong column has."""
    failing, values, _ = _failing(key, rows)
    more = np.zeros(len(failing))
    for place in np.flatnonzero(failing):
        written = (values[:, place] / unit for unit in DECIMALS)
        whole = [bool((np.abs(each - np.round(each)) < WHOLE).all()) for each in written]
        unit = DECIMALS[whole.index(True)] if any(whole) else np.inf
        if unit > COARSEST * key.ranges[place]:
            return
        more[place] = unit / 2
    if failing.any():
        yield key.read_with(more=more)


def grows(key: Key, rows: Rows) -> bool:
    """Whether the error of every column that moves grows from nothing and stays small.

    That is what too coarse an integration does; so does a constant that is not quite right.
    """
    times, values, expected = key.compared(rows)
    off, moving = key.misses(values, expected), rows.present & key.moving
    part = (QUARTERS * (times - key.start) / (key.horizon - key.start)).astype(int).clip(0, QUARTERS - 1)
    if not moving.any() or not np.isin(np.arange(QUARTERS), part).all():
        return False
    worst = np.array([off[part == quarter].max(axis=0) for quarter in range(QUARTERS)])
    is_growing = (worst[-1] > np.maximum(GROWING * worst[0], BARELY)) & (worst[-1] >= worst[1])
    is_small = (worst * key.margins <= SMALL * key.ranges).all(axis=0)
    return bool((is_growing & is_small & (off[0] <= 1))[moving].all())


# --- other times


def in_other_units(key: Key) -> Iterator[Key]:
    """The keys of times in other units than seconds."""
    for unit in TIME_UNITS:
        yield key.read_with(rate=1 / unit, whole=True)
        yield key.read_with(rate=unit, whole=True)


def shifted(key: Key, rows: Rows) -> Iterator[Key]:
    """The key of x(t + s), with the shift s that fits best."""
    low, high, whole = -0.5 * key.span, 0.5 * key.span, bool(key.lacks(rows))
    if whole:  # its times must cover the span, wherever they begin
        edge = (1 - COVERED) * key.span
        low, high = key.stop - edge - rows.times[-1], key.start + edge - rows.times[0]
    found = _found(key, rows, low, high, lambda shift: (np.ones_like(shift), shift)) if low <= high else None
    if found is not None:
        yield key.read_with(shift=found[1], whole=whole)


def backwards(key: Key, rows: Rows) -> Iterator[Key]:
    """The key of a motion from the end to the beginning, rates perhaps with the other sign."""
    reading = key.read_with(rate=-1.0, shift=rows.times[0] + rows.times[-1])
    if not key.lacks(rows) and not reading.lacks(rows):
        for found in _scaled(reading, rows, (1.0, -1.0), rows.present):
            if (np.asarray(found.factors) > 0)[rows.present & key.moving].any():
                yield found


def at_other_frequency(key: Key, rows: Rows) -> Iterator[Key]:
    """The key of x(a t), with the ratio a that fits best, if it clearly does."""
    if key.crossings < OSCILLATING or key.lacks(rows):
        return
    most = math.log(HIGHEST_RATIO)
    found = _found(key, rows, -most, most, lambda power: (np.exp(power), key.start * (1 - np.exp(power))))
    moving = rows.present & key.moving
    for reading in [] if found is None else _faster(key, rows, found[0]):
        left = reading.misses(*reading.compared(rows)[1:])[:, moving].max(axis=0)
        whole = key.misses(*key.compared(rows)[1:])[:, moving].max(axis=0)
        is_seen = whole > FAINT * key.ranges[moving] / key.margins[moving]
        if (left < CLEARLY * whole).all() and is_seen.any():
            yield reading


def _faster(key: Key, rows: Rows, ratio: float) -> Iterator[Key]:
    """The key of x(a t); rates may then have the factor a, and amplitudes 1/a."""
    reading = key.read_with(rate=ratio, shift=key.start * (1 - ratio))
    is_seen = (reading.ranges > LEAST_SEEN * key.margins)[key.moving].all()
    if key.crossings >= OSCILLATING and is_seen and not reading.lacks(rows):
        yield from _scaled(reading, rows, (1.0, ratio, 1 / ratio), rows.present)


def examples(key: Key) -> Iterator[tuple[str, Key]]:
    """Some mistakes, and the keys that they make."""
    angles = np.isfinite(key.periods)
    for code, factors in FACTORS.items():
        if code != "frequency_vs_angular_frequency":
            only = angles | (code != "degrees_radians")
            yield code, key.read_with(factors=np.where(only, factors[0], 1.0))
    order = (*range(1, key.required), 0, *range(key.required, len(key.columns)))
    yield "components_permuted", key.read_with(order=order)
    yield "time_shift", key.read_with(shift=-0.1 * key.span, whole=True)
    yield "time_reversed", key.read_with(rate=-1.0, shift=key.start + key.stop)
    yield "frequency_wrong", key.read_with(rate=0.8, shift=0.2 * key.start)


Way = Callable[[Floats], tuple[Floats, Floats]]
"""The rates and shifts of the times (p each) that parameters (p) stand for."""


def _found(key: Key, rows: Rows, low: float, high: float, way: Way) -> tuple[float, float] | None:
    """The rate and the shift by the parameter from low to high that fits best; None where none comes near."""
    from scipy.optimize import minimize_scalar

    if not (rows.present & np.isfinite(key.margins)).any():
        return None
    some = _probed(len(rows.times))
    few = Rows(rows.times[some], rows.values[some])
    guesses = np.linspace(low, high, min(MOST_GUESSES, max(LEAST_GUESSES, PER_CROSSING * key.crossings)))
    off = _deviation(key, few, *way(guesses), key.roughly_at)
    best, step = guesses[np.argmin(off)], guesses[1] - guesses[0]
    if not off.min() < PROMISING**2:
        return None
    left = (key.margins[key.moving] / key.ranges[key.moving]).max(initial=NEAR)
    for fine in (ROUGH, FINE):
        found = minimize_scalar(
            lambda change: _deviation(key, few, *way(np.array([best + change])), key.at)[0],
            bounds=(max(low - best, -step), min(high - best, step)),
            method="bounded",
            options={"xatol": fine * step},
        )
        if not found.fun < 2 * left**2:
            return None
    rate, shift = way(np.array([best + found.x]))
    return float(rate[0]), float(shift[0])


def _deviation(key: Key, rows: Rows, rate: Floats, shift: Floats, reference: Trajectory) -> Floats:
    """The mean square of what columns are off by for other times (p), in units of their ranges.

    It is FAR where too few rows can be compared. The rate is tried as a factor of the columns, too.
    """
    times = rate[:, None] * rows.times + shift[:, None]
    inside = (times >= key.start) & (times <= key.horizon)
    count = inside.sum(axis=1)
    expected = reference(times.ravel()).reshape(*times.shape, -1)
    squares = []
    for power in (0, 1, -1) if (rate != 1).any() else (0,):
        away = key.wrapped(rows.values / rate[:, None, None] ** power - expected) / key.ranges
        away[~inside] = 0.0
        squares.append(np.minimum(away**2, FAR).sum(axis=1) / np.maximum(count, 1)[:, None])
    total = np.min(squares, axis=0)[:, rows.present & np.isfinite(key.margins)].mean(axis=1)
    least = max(2.0, ENOUGH * len(rows.times) * (key.horizon - key.start) / key.span)
    return np.where(count >= least, total, FAR)
