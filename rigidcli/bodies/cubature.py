"""Integrals over a unit box of functions of up to three coordinates, with an estimate of their error.

The box is cut in smaller ones, which have products of Gauss's rules, and those are halved in which the
highest coefficients of the function in Legendre's polynomials are largest. Where it has kinks or jumps, the
integral along one coordinate is taken first, on lines that are cut there. All of it is done twice, with
other points: the error is ten times the change, or thirty times beside kinks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats

Function: TypeAlias = Callable[[Floats], Floats]
"""Values (c by n) at points (d by n) of the unit box; the first is positive, and the scale of all."""

Kink: TypeAlias = Callable[[Floats], Floats]
"""A function (d by n to n) with another sign on each side of a kink or a jump of an integrand."""

MARGIN, BESIDE_KINKS = 10.0, 30.0
"""The error in units of the change from one run to the other: both may pass by the same edge of a kink."""

LEVELS = (40_000, 1e-12, np.inf), (160_000, 1e-11, np.inf), (600_000, 1e-9, 0.01), (2_400_000, np.inf, np.inf)
"""Points of a run, the relative error that is small enough, and the one at which there is no hope.

The most points take some seconds.
"""

NODES = 8
"""Nodes along each coordinate of a box; the second run has one more."""

ON_PIECE, ON_LINE = 18, 50
"""Nodes on each piece of a line, also with one more in the second run; and points for which a line counts."""

SAMPLES = (15, 18)
"""Places along a line where kinks are looked for: in the two runs, so that few pass by both."""

BLOCK = 60_000
"""Points worked at a time, which bounds the memory."""

TINY = 1e-13
"""Boxes and pieces below this are not cut further: they are the rounding of a place."""

NEAR = 1e-7
"""The sides of the boxes that are first taken at a peak: less than a peak that may be answered."""


@dataclass(frozen=True, slots=True, eq=False)
class Integral:
    """The `values` (c) of an integral, and their `error` in units of the first."""

    values: Floats
    error: float


def integral(
    f: Function, kinks: Sequence[Kink], peaks: Sequence[Floats], pieces: Sequence[int], cost: int
) -> Integral:
    """The integral of `f` over the unit box, which is first cut in so many `pieces` along each coordinate.

    At the `peaks` (points, d) it may be much larger than elsewhere. A value of `f` counts as `cost` points.
    """
    if not pieces:
        return Integral(f(np.zeros((0, 1)))[:, 0], float(np.finfo(float).eps))
    best = Integral(np.zeros(1), np.inf)
    along = _most_crossed(kinks, len(pieces))
    rest = [*pieces[:along], *pieces[along + 1 :]]
    for level, (points, enough, hopeless) in enumerate(LEVELS):
        runs, ends = [], np.linspace(0, 1, 1 + pieces[along] * (1 + level))
        for which in (0, 1):
            if kinks:
                line = partial(_along_lines, f, kinks, along, ends, which)
                runs.append(_by_boxes(line, rest, (), points, cost * ON_LINE, which))
            else:
                runs.append(_by_boxes(f, pieces, peaks, points, cost, which))
        with np.errstate(all="ignore"):
            margin = BESIDE_KINKS if kinks else MARGIN
            change = float(margin * np.abs(runs[1] - runs[0]).max() / abs(runs[1][0]))
        if change < best.error:
            best = Integral(runs[1], max(change, float(np.finfo(float).eps)))
        if not (10_000 * enough if kinks else enough) < best.error < hopeless:
            break
    return best


def downhill(function: Kink, points: Floats, step: float) -> Floats:
    """Points (d by n) of the unit box after a search downhill, with steps that are halved each time."""
    around = np.array(list(product((0, -1, 1), repeat=len(points)))).T
    each = np.arange(points.shape[1])
    while step > np.finfo(float).eps:
        moved = np.clip(points[:, :, None] + step * around[:, None], 0, 1)
        values = function(moved.reshape(len(points), -1)).reshape(each.size, -1)
        points, step = moved[:, each, values.argmin(axis=1)], step / 2
    return points


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss's rule from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (1 + nodes) / 2, weights / 2


# --- boxes


def _by_boxes(
    f: Function, pieces: Sequence[int], peaks: Sequence[Floats], most: int, cost: int, which: int
) -> Floats:
    """The integral with about so many points at `most`, of which a value of `f` counts as `cost`."""
    depth, count = len(pieces), NODES + which
    batch = max(1, BLOCK // (cost * count**depth))
    low = np.indices(tuple(pieces)).reshape(depth, math.prod(pieces)) / np.reshape(pieces, (depth, 1))
    size = np.ones_like(low) / np.reshape(pieces, (depth, 1))
    starts = range(0, low.shape[1], batch)
    parts = [_boxes(f, low[:, at : at + batch], size[:, at : at + batch], count) for at in starts]
    values, tails = (np.hstack(part) for part in zip(*parts, strict=True))
    left = most / (cost * count**depth) - low.shape[1]
    while depth:
        at_peak = np.zeros(low.shape[1], dtype=bool)
        for peak in peaks:
            at_peak |= (
                (low <= peak[:, None]) & (peak[:, None] <= low + size) & (size.max(axis=0) > NEAR)
            ).all(axis=0)
        tails = np.where(size > TINY, tails, 0.0)
        chosen, axes = np.flatnonzero(at_peak), size.argmax(axis=0)
        if not chosen.size:
            worst, axes = tails.max(axis=0), tails.argmax(axis=0)
            if left <= 0 or not worst.sum() > TINY * abs(values[0].sum()):
                break
            descending = np.argsort(-worst)
            half = 1 + int(np.searchsorted(worst[descending].cumsum(), worst.sum() / 2))
            chosen = descending[: min(half, max(1, batch // 2))]
        each, axes = np.arange(chosen.size), axes[chosen]
        start, side = low[:, chosen], size[:, chosen]
        side[axes, each] /= 2
        other = start.copy()
        other[axes, each] += side[axes, each]
        new = np.hstack([start, other]), np.hstack([side, side])
        pairs = zip((low, size, values, tails), (*new, *_boxes(f, *new, count)), strict=True)
        low, size, values, tails = (np.hstack([np.delete(old, chosen, 1), own]) for old, own in pairs)
        left -= 2 * chosen.size
    return np.asarray(values.sum(axis=1))


def _boxes(f: Function, low: Floats, size: Floats, count: int) -> tuple[Floats, Floats]:
    """The integrals of `f` over boxes (c by n), and the size of its highest terms along each side (d by n).

    Where `f` is infinite it counts as zero.
    """
    (nodes, weights), (depth, n) = _gauss(count), low.shape
    grid = np.array(list(product(nodes, repeat=depth))).T.reshape(depth, 1, count**depth)
    values = f((low[:, :, None] + size[:, :, None] * grid).reshape(depth, n * count**depth))
    values = np.where(np.isfinite(values), values, 0.0).reshape(-1, n, *[count] * depth)
    values = values * size.prod(axis=0).reshape(-1, *[1] * depth)
    # Coefficients of the two highest of Legendre's polynomials.
    high = np.polynomial.legendre.legvander(2 * nodes - 1, count - 1)[:, -2:] * weights[:, None] * 2 * count
    tails = []
    for k in range(depth):
        tail = np.abs(np.moveaxis(values, 2 + k, -1) @ high).max(axis=-1)
        for _ in range(depth - 1):
            tail = tail @ weights
        tails.append(tail.max(axis=0))
    for _ in range(depth):
        values = values @ weights
    return values, np.array(tails).reshape(depth, n)


# --- lines


def _along_lines(
    f: Function, kinks: Sequence[Kink], k: int, ends: Floats, which: int, points: Floats
) -> Floats:
    """The integrals of `f` (c by n) along lines in coordinate k, at points (d - 1 by n) in the others.

    The lines are cut at the places `ends` and where `kinks` change their sign.
    """
    lines = np.insert(points, k, 0.0, axis=0)
    count = ON_PIECE + which
    cuts = [_crossings(kink, k, lines, SAMPLES[which]) for kink in kinks]
    cuts.append((np.repeat(np.arange(lines.shape[1]), ends.size), np.tile(ends, lines.shape[1])))
    line, place = (np.concatenate(part) for part in zip(*cuts, strict=True))
    order = np.lexsort((place, line))
    line, place = line[order], place[order]
    width = np.diff(place)
    pieces = np.flatnonzero((line[1:] == line[:-1]) & (width > TINY))
    nodes, weights = _gauss(count)
    # A root at an end of a piece becomes smooth in u where t = u^3 (10 - 15 u + 6 u^2).
    shares, slopes = nodes**3 * (10 + nodes * (6 * nodes - 15)), 30 * (nodes * (1 - nodes)) ** 2
    at = np.repeat(lines[:, line[pieces]], count, axis=1)
    at[k] = (place[pieces, None] + width[pieces, None] * shares).ravel()
    sums = f(at).reshape(-1, pieces.size, count) @ (weights * slopes) * width[pieces]
    return np.add.reduceat(sums, np.flatnonzero(np.diff(line[pieces], prepend=-1)), axis=1)


def _most_crossed(kinks: Sequence[Kink], depth: int) -> int:
    """The coordinate along which kinks are crossed most often."""
    lines = np.random.default_rng(1).random((depth, 64))
    crossed = [sum(_crossings(kink, k, lines, SAMPLES[0])[0].size for kink in kinks) for k in range(depth)]
    return int(np.argmax(crossed))


def _crossings(kink: Kink, k: int, lines: Floats, samples: int) -> tuple[NDArray[np.intp], Floats]:
    """Where lines (d by n) in coordinate k cross a kink: the numbers of the lines (m), and the places (m).

    Signs are compared at even places and at the vertices of parabolas through three neighbours, so that a
    short piece of the other sign is seen.
    """

    def along(places: Floats) -> Floats:
        points = np.repeat(lines, places.shape[1], axis=1)
        points[k] = places.ravel()
        return kink(points).reshape(places.shape)

    places = np.tile(np.linspace(0, 1, samples), (lines.shape[1], 1))
    values = along(places)
    down, up = values[:, :-2] - values[:, 1:-1], values[:, 2:] - values[:, 1:-1]
    with np.errstate(all="ignore"):
        step = (down - up) / (2 * (down + up))
    vertices = places[:, 1:-1] + np.where(abs(step) < 1, step, 0.5) / (samples - 1)
    places, values = np.hstack([places, vertices]), np.hstack([values, along(vertices)])
    ascending = np.argsort(places, axis=1)
    places, values = (np.take_along_axis(part, ascending, axis=1) for part in (places, values))
    line, at = np.nonzero((values[:, 1:] > 0) != (values[:, :-1] > 0))
    low, high, below, above = (part[line, at + side] for part in (places, values) for side in (0, 1))
    points, kept = lines[:, line].copy(), np.zeros(line.size)
    # The rule of false position with the halved values of Illinois, and bisection: 14 steps give all digits.
    for turn in range(24 if line.size else 0):
        share = 0.5 if turn % 3 == 2 else np.clip(below / (below - above), 1e-3, 1 - 1e-3)
        points[k] = place = low + share * (high - low)
        value = kink(points)
        same = (value > 0) == (below > 0)
        above, below = (
            np.where(same, np.where(kept > 0, above / 2, above), value),
            np.where(same, value, np.where(kept < 0, below / 2, below)),
        )
        low, high = np.where(same, place, low), np.where(same, high, place)
        kept = np.where(same, 1, -1)
    return line, points[k]
