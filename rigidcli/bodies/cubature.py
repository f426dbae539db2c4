"""Integrals over a unit box of functions of up to three coordinates, with an estimate of their error.

The box is cut in smaller ones, which have products of Gauss's rules, and boxes are halved where the highest
coefficients of the function in Legendre's polynomials are largest. Where it has kinks or jumps, the integral
along one coordinate is taken first, on lines that are cut there. All is done twice with different points: the
error is ten times the difference, or thirty times beside kinks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import TypeAlias

import numpy as np

from rigidcli.bodies.charts import gauss
from rigidcli.core.arithmetic import EPS, Floats

Function: TypeAlias = Callable[[Floats], Floats]
"""Values (n, or c by n) at points (d by n) of the unit box. A kink is where such a one changes its sign."""

ENOUGH, FEW = 3e-13, 40_000
"""The relative error that is small enough after so many points; it grows as the square of their number."""

HOPELESS, MANY = 0.01, 600_000
"""A relative error that is larger than this after so many points will not become small."""

MOST = 2_400_000
"""The most points, which take some seconds."""

NODES = 8
"""Nodes along each coordinate of a box; the second run has one more."""

ON_PIECE, ON_LINE = 18, 50
"""Nodes on each piece of a line, also with one more in the second run; and points for which a line counts."""

SAMPLES = (15, 18)
"""Places along a line where kinks are looked for: in the two runs, so that few pass by both."""

BLOCK = 30_000
"""The most points worked at a time, which bounds the memory."""

TINY = 1e-13
"""Boxes and pieces below this are not cut further: they are the rounding of a place."""

UNSEEN = 1e-3
"""The least share of a box's urgency that its halves keep, as they may have missed what it saw.

Where the function is smooth, its highest terms fall by 2^-8.
"""

NEAR, BESIDE = 1e-7, 1e-2
"""The sides of the first boxes that hold a peak, and of those beside it: below those of peaks that count."""

AT_ONCE = 1e200
"""The urgency of boxes at a peak, which are halved before all others."""


def integral(
    f: Function,
    kinks: Sequence[Function],
    peaks: Sequence[Floats],
    is_seen: Callable[[Floats, Floats], bool],
    pieces: Sequence[int],
    cost: int,
) -> tuple[Floats, float]:
    """The integral of `f` over the unit box (c), and its error in units of the first, which is positive.

    The box is first cut in so many `pieces` along each coordinate. At the `peaks` (points, d) the function
    may be much larger than elsewhere; one that goes on along a coordinate has NaN for it. The error is
    infinite unless all `is_seen` in the boxes with these corners and sides (d by n). A value of `f` counts as
    `cost` points.
    """
    runs: tuple[Function, ...] = f, f
    margin, enough = 10.0, ENOUGH
    if kinks:
        # Both runs may pass by the same edge of a kink.
        cost, margin, enough = cost * ON_LINE, 30.0, 1e4 * ENOUGH
        lines = np.random.default_rng(1).random((len(pieces), 64))
        cuts = [[_crossings(kink, k, lines, SAMPLES[0]) for kink in kinks] for k in range(len(pieces))]
        along = int(np.argmax([(np.hstack(places) < 1).sum() for places in cuts]))  # most often crossed
        # A root of the function may come near a line without crossing it: short pieces bear that better.
        ends = np.linspace(0, 1, 1 + 4 * pieces[along])
        runs = tuple(partial(_along_lines, f, kinks, along, ends, which) for which in (0, 1))
        pieces = [*pieces[:along], *pieces[along + 1 :]]
    return _refined(runs, pieces, peaks, is_seen, cost, margin, enough)


def downhill(function: Function, points: Floats, step: float, last: float) -> Floats:
    """Points (d by n) of the unit box after a search downhill, with steps that are halved each time.

    The `last` ones are so short that the least value of a smooth function is found but for rounding.
    """
    around = np.array(list(product((0, -1, 1), repeat=len(points)))).T
    columns, count = np.arange(points.shape[1]), around.shape[1]
    while step > last:
        moved = np.clip(points[:, :, None] + step * around[:, None], 0, 1)
        values = function(moved.reshape(len(points), columns.size * count)).reshape(columns.size, count)
        points, step = moved[:, columns, values.argmin(axis=1)], step / 2
    return points


def product_rule(rules: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """Nodes (d by n) and weights (n) of the product of rules for one coordinate each."""
    nodes, weights = (product(*(rule[which] for rule in rules)) for which in (0, 1))
    return np.array(list(nodes)).T, np.array([math.prod(factors) for factors in weights])


# --- boxes, each a column: lower corner, sides and the urgency to halve each (3 d), both integrals (2 c)


def _refined(
    runs: Sequence[Function],
    pieces: Sequence[int],
    peaks: Sequence[Floats],
    is_seen: Callable[[Floats, Floats], bool],
    cost: int,
    margin: float,
    enough: float,
) -> tuple[Floats, float]:
    """The integral (c) of the second of two functions, and so many times its change from the first."""
    depth = len(pieces)
    sides = np.reshape([1 / number for number in pieces], (depth, 1))
    low = np.indices(tuple(pieces)).reshape(depth, math.prod(pieces)) * sides
    boxes = _in_boxes(runs, low, np.broadcast_to(sides, low.shape), np.zeros(low.shape))
    points = cost * NODES**depth
    used = points * boxes.shape[1]
    while True:
        low, size, urgency = boxes[: 3 * depth].reshape(3, depth, boxes.shape[1])
        one, two = boxes[3 * depth :].reshape(2, -1, boxes.shape[1]).sum(axis=2)
        urgency = np.where(size > TINY, urgency, 0.0)
        for peak in peaks:
            bound = ~np.isnan(peak)
            at, own = low[bound].T, size[bound].T
            reach = np.where(own > BESIDE, own, 0.0)
            holds = ((peak[bound] >= at - reach) & (peak[bound] <= at + own + reach)).all(axis=1)
            sides = np.where(bound[:, None], size, 0.0)
            urgency[(sides == sides.max(axis=0)) & (sides > NEAR) & holds] = AT_ONCE
        worst = urgency.max(axis=0, initial=0.0)
        with np.errstate(all="ignore"):
            error = float(np.nan_to_num(margin * np.abs(two - one).max() / abs(two[0]), nan=np.inf))
        is_small = used > FEW and error < enough * (used / FEW) ** 2
        is_vain = used > MOST or (used > MANY and error > HOPELESS) or worst.sum() <= TINY * abs(two[0])
        if (is_small or is_vain) and worst.max() < AT_ONCE:
            return two, max(error, EPS) if is_seen(low, size) else np.inf
        descending = np.argsort(-worst)
        half = 1 + int(np.searchsorted(worst[descending].cumsum(), worst.sum() / 2))
        chosen = descending[: min(half, max(1, BLOCK // points))]
        column, axes = np.arange(2 * chosen.size), urgency[:, chosen].argmax(axis=0).repeat(2)
        low, size, kept = boxes[: 3 * depth, chosen].repeat(2, axis=1).reshape(3, depth, column.size)
        size[axes, column] /= 2
        low[axes, column] += size[axes, column] * (column % 2)
        boxes = np.hstack([np.delete(boxes, chosen, 1), _in_boxes(runs, low, size, UNSEEN * kept)])
        used += points * column.size


def _in_boxes(runs: Sequence[Function], low: Floats, size: Floats, least: Floats) -> Floats:
    """Boxes with these corners and sides, of at `least` this urgency along each side (all d by n).

    Where a function is infinite it counts as zero. The second one has one node more along each side.
    """
    depth, n = low.shape
    urgency, both = least, []
    for count, f in enumerate(runs, NODES):
        nodes, weights = gauss(count)
        grid = nodes[np.indices((count,) * depth).reshape(depth, 1, count**depth)]
        values = f((low[:, :, None] + size[:, :, None] * grid).reshape(depth, n * count**depth))
        values = np.where(np.isfinite(values), values, 0.0).reshape(-1, n, *[count] * depth)
        values = values * size.prod(axis=0).reshape(-1, *[1] * depth)
        # Coefficients of the two highest of Legendre's polynomials.
        high = (
            np.polynomial.legendre.legvander(2 * nodes - 1, count - 1)[:, -2:] * weights[:, None] * 2 * count
        )
        tails = np.zeros((depth, n))
        for k in range(depth):
            tail = np.abs(np.moveaxis(values, 2 + k, -1) @ high).max(axis=-1)
            for _ in range(depth - 1):
                tail = tail @ weights
            tails[k] = tail.max(axis=0)
        urgency = np.maximum(urgency, tails)
        for _ in range(depth):
            values = values @ weights
        both.append(values)
    return np.vstack([low, size, urgency, *both])


# --- lines


def _along_lines(
    f: Function, kinks: Sequence[Function], k: int, ends: Floats, which: int, points: Floats
) -> Floats:
    """The integrals of `f` (c by n) along lines in coordinate k, at points (d - 1 by n) in the others.

    The lines are cut at the places `ends` and where `kinks` change their sign.
    """
    lines = np.insert(points, k, 0.0, axis=0)
    cuts = [_crossings(kink, k, lines, SAMPLES[which]) for kink in kinks]
    places = np.sort(np.hstack([np.tile(ends, (lines.shape[1], 1)), *cuts]))
    width = np.diff(places)
    pieces = width > TINY
    start, width = places[:, :-1][pieces], width[pieces]
    nodes, weights = gauss(ON_PIECE + which)
    # A root at an end of a piece becomes smooth in u where t = u^3 (10 - 15 u + 6 u^2).
    shares, slopes = nodes**3 * (10 + nodes * (6 * nodes - 15)), 30 * (nodes * (1 - nodes)) ** 2
    parts = []
    for part in np.array_split(np.arange(width.size), 1 + width.size * nodes.size // BLOCK):
        at = np.repeat(lines[:, pieces.nonzero()[0][part]], nodes.size, axis=1)
        at[k] = (start[part, None] + width[part, None] * shares).ravel()
        parts.append(f(at).reshape(-1, part.size, nodes.size) @ (weights * slopes) * width[part])
    values = np.hstack(parts)
    sums = np.zeros((len(values), *pieces.shape))
    sums[:, pieces] = values
    return np.asarray(sums.sum(axis=2))


def _crossings(kink: Function, k: int, lines: Floats, samples: int) -> Floats:
    """Where lines (d by n) in coordinate k cross a kink: places (n by m), filled up with ones.

    Signs are compared at even places and at the vertices of parabolas through three neighbours, so that a
    short piece of the other sign is seen.
    """

    def along(lines: Floats, places: Floats) -> Floats:
        points = np.repeat(lines, places.size // lines.shape[1], axis=1)
        points[k] = places.ravel()
        return kink(points).reshape(places.shape)

    places = np.tile(np.linspace(0, 1, samples), (lines.shape[1], 1))
    values = along(lines, places)
    down, up = values[:, :-2] - values[:, 1:-1], values[:, 2:] - values[:, 1:-1]
    with np.errstate(all="ignore"):
        step = (down - up) / (2 * (down + up))
    vertices = places[:, 1:-1] + np.where(abs(step) < 1, step, 0.5) / (samples - 1)
    places = np.sort(np.hstack([places, vertices]))
    above = along(lines, places) > 0
    line, at = np.nonzero(above[:, 1:] != above[:, :-1])
    low, high, start = places[line, at], places[line, at + 1], above[line, at]
    while line.size and (high - low).max() > EPS:
        middle = (low + high) / 2
        same = (along(lines[:, line], middle) > 0) == start
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    crossed = np.ones((lines.shape[1], places.shape[1] - 1))
    crossed[line, at] = high
    return crossed
