"""Searches along many lines at a time: where functions pass zero, and where they are lowest."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask

Along = Callable[[Array, Floats], Floats]
"""Values (n) of functions on lines: of which of them (n), and at which places from 0 to 1 on it (n)."""

STEPS = 8
"""Steps of Ridders's method to a zero between two samples; a smooth function needs fewer."""

BISECTIONS = 50
"""Halvings by which zeros are found that this method has missed: to a part in 10^15."""

FOUND = 1e-13
"""A zero is found when the function changes its sign within this distance, in units of the line."""

SAMPLES = 17
"""Places on each line at which functions are looked at before a search."""

FLAT = 1e-9
"""A function that changes by less, in units of its largest value, has no peak: this is rounding."""

WIDEST = 0.1
"""The net of a search for the lowest point at its beginning, in units of the box."""

NETS = 9
"""Samples along each of so many coordinates, from the lowest of which `lowest_within` begins."""

FITS = 3
"""Steps of that search. Each fits a parabola to neighbours on a net, which then gets finer by FINER."""

FINER = 1 / 8
"""From an eighth of the line to 1/512 of it. The error of the place is some 10^-6 then, and that of the
lowest value its square."""

NEAR_ZERO = 0.5
"""A function may reach zero if the parabola through samples goes down to less, in units of the middle one."""

STILL = 1e-9
"""The curvature of what has none, in units of the largest difference on a net."""

LARGEST = 1e100
"""What is taken instead of an infinite value, or of none."""

TINY = float(np.finfo(np.float64).tiny)
"""What is divided by instead of zero."""

SEARCH = 60
"""Steps of that search: to a part in 10^12, as the net gets finer by a third in each."""


def zeros(f: Callable[[Floats, Array], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) where functions change their sign between `low` and `high`.

    `f` takes places and the indices of the functions. C. Ridders, IEEE Trans. Circuits Syst. 26 (1979) 979.
    """
    left = np.arange(low.size)
    x, start, end = (low + high) / 2, low, high
    at_low, at_high = (f(side, left) if left.size else low for side in (low, high))
    positive = at_low > 0
    for _ in range(STEPS):
        if not left.size:
            break
        middle = (low + high) / 2
        at_middle, old = f(middle, left), x[left]
        with np.errstate(invalid="ignore", divide="ignore"):
            step = (middle - low) * np.sign(at_low - at_high) * at_middle
            new = middle + step / np.sqrt(at_middle**2 - at_low * at_high)
        new = np.where(np.isfinite(new), np.clip(new, low, high), middle)
        at_new, sign = f(new, left), positive[left]
        before = new < middle
        a, at_a = np.where(before, new, middle), np.where(before, at_new, at_middle)
        b, at_b = np.where(before, middle, new), np.where(before, at_middle, at_new)
        first, last = (at_a > 0) != sign, (at_b > 0) == sign
        low, high = np.where(last, b, np.where(first, low, a)), np.where(last, high, np.where(first, a, b))
        at_low = np.where(last, at_b, np.where(first, at_low, at_a))
        at_high = np.where(last, at_high, np.where(first, at_a, at_b))
        x[left] = new
        moving = np.abs(new - old) > FOUND
        left, low, high = left[moving], low[moving], high[moving]
        at_low, at_high = at_low[moving], at_high[moving]
    every = np.arange(x.size)
    sides = (
        [f(np.clip(x + side, start, end), every) > 0 for side in (-FOUND, FOUND)]
        if every.size
        else [positive, ~positive]
    )
    those = np.flatnonzero((sides[0] != positive) | (sides[1] == positive))
    low, high = start[those], end[those]
    for _ in range(BISECTIONS if those.size else 0):
        middle = (low + high) / 2
        same = (f(middle, those) > 0) == positive[those]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    x[those] = (low + high) / 2
    return x


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


def lowest_within(f: Callable[[Floats], Floats], points: Floats, axes: Array) -> Floats:
    """The points (1 + d by n) at which a function is lowest when some of their coordinates are free.

    A place inside, where it is lower than round it, goes before one at an end where it is lower still.
    `axes` (m by n) has these coordinates, counted from 0, of each point. They go from 0 to 1.
    """
    free, every = len(axes), np.arange(points.shape[1])

    def moved(places: Floats) -> Floats:
        """Points (1 + d by n by p) with these places (m by n by p) on the free coordinates."""
        trial = np.repeat(points[:, :, None], places.shape[2], axis=2)
        trial[1 + axes, every] = places
        return trial

    def values(places: Floats) -> Floats:
        return f(moved(places).reshape(len(points), -1)).reshape(places.shape[1:])

    net = np.array(list(product(np.linspace(0, 1, NETS), repeat=free))).T
    net = np.broadcast_to(net[:, None], (free, every.size, net.shape[1]))
    seen = values(net)
    seen = np.where(np.isnan(seen), np.inf, seen)
    inside = _is_low_inside(seen.reshape(-1, *[NETS] * free)).reshape(seen.shape)
    seen[~inside & inside.any(axis=1, keepdims=True)] = np.inf
    best = net[:, every, seen.argmin(axis=1)]
    return moved(_lowest(values, best, 1 / (NETS - 1))[:, :, None])[..., 0]


def _is_low_inside(grid: Floats) -> Mask:
    """Which values on nets (n by p by p ...) are lower than both neighbours along each axis."""
    found = np.ones(grid.shape, dtype=bool)
    for axis in range(1, grid.ndim):
        ends = np.pad(grid, [(int(k == axis),) * 2 for k in range(grid.ndim)], constant_values=-np.inf)
        along = np.moveaxis(ends, axis, 0)
        found &= np.moveaxis((along[1:-1] < along[:-2]) & (along[1:-1] < along[2:]), 0, axis)
    return found


def _lowest(values: Callable[[Floats], Floats], best: Floats, width: float) -> Floats:
    """Where functions are lowest near the places `best` (m by n), from 0 to 1 along each coordinate.

    `values` gives them (n by p) at places (m by n by p). Parabolas are fitted to neighbours, first those at
    this distance.
    """
    around = np.array(list(product((-1, 0, 1), repeat=len(best)))).T
    gradient, curvature = _fits(around)
    each, still = np.arange(best.shape[1]), STILL * np.eye(len(best))
    for _ in range(FITS if each.size else 0):
        trial = np.clip(best[:, :, None] + width * around[:, None], 0, 1)
        seen = values(trial)
        seen = np.where(np.isfinite(seen), seen, LARGEST)
        offset = seen - seen.min(axis=1, keepdims=True)
        offset = offset / np.maximum(offset.max(axis=1, keepdims=True), TINY)
        bend = np.einsum("np,ijp->nij", offset, curvature) + still
        step = -np.linalg.solve(bend, (offset @ gradient.T)[..., None])[..., 0].T
        fitted = np.clip(best + width * np.clip(step, -1, 1), 0, 1)[..., None]
        trial = np.concatenate([trial, fitted], axis=2)
        best = trial[:, each, np.column_stack([seen, values(fitted)]).argmin(axis=1)]
        width *= FINER
    return best


def _fits(around: Array) -> tuple[Floats, Floats]:
    """The weights of values on a net of 3^m in the gradient (m by p) and the curvature (m by m by p)."""
    terms = [np.ones(around.shape[1]), *around]
    pairs = [(i, j) for i in range(len(around)) for j in range(i + 1)]
    terms += [around[i] * around[j] for i, j in pairs]
    inverse = np.asarray(np.linalg.pinv(np.array(terms, dtype=np.float64).T), dtype=np.float64)
    second: Floats = np.zeros((len(around), *around.shape))
    for (i, j), row in zip(pairs, inverse[1 + len(around) :], strict=True):
        second[i, j] += row
        second[j, i] += row
    return inverse[1 : 1 + len(around)], second


def crossings(f: Along, values: Floats) -> tuple[Array, Floats]:
    """Where functions on lines pass zero: the index of the line, and the place from 0 to 1.

    `values` are the `samples`. Between two of one sign they may pass zero twice, where they turn back.
    """
    t, signs = np.linspace(0, 1, SAMPLES), np.sign(values)
    on, at = np.argwhere((signs[:, 1:] > 0) != (signs[:, :-1] > 0)).T
    over, near = np.argwhere(_may_reach_zero(values)).T
    once = np.diff(SAMPLES * over + near, append=np.inf) > 1  # two neighbours may see the same turn
    over, near = over[once], near[once]
    start, end = t[np.maximum(near - 1, 0)], t[np.minimum(near + 1, SAMPLES - 1)]
    found = np.clip(_turned(f, over, t[near], signs[over, near]), start, end)
    beyond = f(over, found) * signs[over, near] < 0
    over, found = over[beyond], found[beyond]
    low = np.concatenate([t[at], start[beyond], found])
    high = np.concatenate([t[at + 1], found, end[beyond]])
    on = np.concatenate([on, over, over])
    return on, zeros(lambda x, those: f(on[those], x), low, high)


def turns(f: Along, values: Floats) -> tuple[Array, Floats]:
    """Where functions on lines turn back: the index of the line, and the place from 0 to 1.

    `values` are the `samples`.
    """
    t = np.linspace(0, 1, SAMPLES)
    steps = directions(values)
    on, at = np.argwhere(steps[:, 1:] * steps[:, :-1] < 0).T
    return on, _turned(f, on, t[at + 1], -steps[on, at])


def _turned(f: Along, on: Array, near: Floats, sign: Array) -> Floats:
    """Where functions on lines (n) are lowest, or highest where the `sign` is -1, near to places."""

    def lower(places: Floats) -> Floats:
        values = f(np.repeat(on, places.shape[2]), places.ravel())
        return np.asarray(sign[:, None] * values.reshape(places.shape[1:]), dtype=np.float64)

    found: Floats = _lowest(lower, near[None], 1 / (SAMPLES - 1))[0]
    return found


def _may_reach_zero(values: Floats) -> Mask:
    """Which of the samples (n by m) are those next to where functions may reach zero, and turn back.

    These are such that the parabola through three neighbours is lowest near the middle, or between an end and
    the next one, and near zero there.
    """
    sign = np.sign(values[:, 1:-1])
    left, middle, right = (sign * part for part in (values[:, :-2], values[:, 1:-1], values[:, 2:]))
    with np.errstate(invalid="ignore", divide="ignore"):
        bend, slope = left + right - 2 * middle, (right - left) / 2
        place = -slope / bend
        near = (bend > 0) & (left > 0) & (right > 0) & (middle + slope * place / 2 < NEAR_ZERO * middle)
    found = np.zeros(values.shape, dtype=bool)
    found[:, 1:-1] = near & (np.abs(place) <= 0.6)
    found[:, 0] = (near & (place < -0.4))[:, 0] & (place[:, 0] > -1.2)
    found[:, -1] = (near & (place > 0.4))[:, -1] & (place[:, -1] < 1.2)
    return found


def samples(f: Along, count: int) -> Floats:
    """The values (count by SAMPLES) of functions at places on so many lines."""
    t = np.tile(np.linspace(0, 1, SAMPLES), count)
    return f(np.repeat(np.arange(count), SAMPLES), t).reshape(count, SAMPLES)


def directions(values: Floats) -> Floats:
    """Whether samples along lines (n by m) grow (1), fall (-1), or stay as they are (0) to the next."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(values)
        size = np.abs(np.where(np.isfinite(values), values, 0.0)).max(axis=-1, keepdims=True)
        return np.where(np.abs(steps) > FLAT * size, np.sign(steps), 0.0)
