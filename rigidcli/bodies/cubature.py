"""Integrals over a unit box of functions of up to three coordinates, with an estimate of their error.

The box is cut in smaller ones, which have products of Gauss's rules. Those with the largest error indicators
are halved, which are the highest coefficients of the function in Legendre's polynomials; and before them
those that have no node near a known peak. All is done twice with different points: the error is ten times
the difference, or forty times where the function has kinks or jumps, of which both rules may miss some.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.charts import gauss
from rigidcli.core.arithmetic import EPS, Floats, Mask

Indices: TypeAlias = NDArray[np.intp]

# Values (n, or c by n) at points (d by n) of the unit box.
Function: TypeAlias = Callable[[Floats], Floats]
# The relative error that is small enough after so many points; it grows as the square of their number.
ERROR_AT_FIRST, FIRST_POINTS = 3e-13, 40_000
# An integral with a larger relative error after so many points is given up.
HOPELESS_ERROR, POINTS_BEFORE_GIVING_UP = 0.01, 600_000
MOST_POINTS = 2_400_000  # the most points of an integral, which take some seconds
NODES_OF_SIDE = 8  # Gauss's nodes along each side of a box in the first run; the second run has one more
POINTS_AT_ONCE = 30_000  # the most points worked at a time, which bounds the memory
SHORTEST = 1e-13  # the shortest side of a box: below it is the rounding of a place
# The fraction of a box's error indicator that its halves inherit, as they may miss what it saw. Where the
# function is smooth, its highest coefficients fall by 2^-8.
INHERITED = 1e-3
# A box is blind to a peak where that is so many times as high as the function at the nodes of the box.
UNSEEN_RISE = 1.5
NEAR_PEAK = 0.1  # how far outside of a box a peak may be to which it can be blind, in units of its sides
AT_ONCE = 1e200  # the error indicator of boxes that are blind to a peak, which are halved before all others


class Peaks(NamedTuple):
    """The `places` (d by m) where the `height` of a function may be very large.

    Along a coordinate to which a peak is not `bound` (d by m), the function goes on about as high.
    """

    height: Function
    places: Floats
    bound: Mask

    def unseen(self, low: Floats, size: Floats) -> Mask:
        """The longest side of each box that is blind to a peak, of those to which the peak is bound.

        The boxes have these corners and sides (all d by n).
        """
        sides = np.zeros(size.shape, dtype=bool)
        first, last = (edge[:, :, None] for edge in (low - NEAR_PEAK * size, low + (1 + NEAR_PEAK) * size))
        within = (first <= self.places[:, None]) & (self.places[:, None] <= last)
        # Pairs of a box and a peak near it, which is at the middle of the box where it is not bound.
        box, peak = np.nonzero(np.all(within | ~self.bound[:, None], axis=0))
        if not box.size:
            return sides
        bound, (near, place) = self.bound[:, peak], np.unique(box, return_inverse=True)
        tops = self.height(np.where(bound, self.places[:, peak], (low + size / 2)[:, box]))
        nodes, _ = product_rule([gauss(NODES_OF_SIDE)] * len(low))
        inside = low[:, near, None] + size[:, near, None] * nodes[:, None]
        seen = self.height(inside.reshape(len(low), -1)).reshape(near.size, len(nodes.T)).max(axis=1)
        is_blind = tops > UNSEEN_RISE * seen[place]
        np.logical_or.at(sides.T, box[is_blind], bound[:, is_blind].T)
        lengths = np.where(sides, size, 0.0)
        return np.asarray(sides & (lengths == lengths.max(axis=0)))


class Boxes(NamedTuple):
    """Boxes, one a column: lower corner, sides, an error indicator a side, and whether a peak is not seen for
    the length of it (all d by n); integrals (c by n)."""

    low: Floats
    size: Floats
    indicator: Floats
    unseen: Mask
    first: Floats
    second: Floats

    def halved(self, f: Function, peaks: Peaks, chosen: Indices, sides: Indices) -> Boxes:
        """The boxes with the `chosen` ones (k) halved, each along one of its `sides` (k)."""
        column, side = np.arange(2 * chosen.size), sides.repeat(2)
        low, size, indicator = (part[:, chosen].repeat(2, axis=1) for part in self[:3])
        size[side, column] /= 2
        low[side, column] += size[side, column] * (column % 2)
        halves = _in_boxes(f, peaks, low, size, INHERITED * indicator)
        parts = zip(self, halves, strict=True)
        return Boxes(*(np.hstack([np.delete(old, chosen, 1), new]) for old, new in parts))


def integral(
    f: Function, peaks: Peaks, pieces: Sequence[int], cost: int, *, is_kinked: bool
) -> tuple[Floats, float]:
    """The integral of `f` over the unit box (c), and its error in units of the first, which is positive.

    The box is first cut in so many `pieces` along each coordinate. The error is infinite while a box is blind
    to one of the `peaks`. A value of `f` counts as `cost` points. A function with kinks or jumps `is_kinked`.
    """
    margin, enough = (40.0, 1e4 * ERROR_AT_FIRST) if is_kinked else (10.0, ERROR_AT_FIRST)
    depth = len(pieces)
    sides = np.reshape([1 / number for number in pieces], (depth, 1))
    low = np.indices(tuple(pieces)).reshape(depth, math.prod(pieces)) * sides
    boxes = _in_boxes(f, peaks, low, np.broadcast_to(sides, low.shape), np.zeros(low.shape))
    points = cost * NODES_OF_SIDE**depth
    used = points * boxes.low.shape[1]
    while True:
        two = boxes.second.sum(axis=1)
        indicator = np.where(boxes.size > SHORTEST, boxes.indicator, 0.0)
        indicator[boxes.unseen] = AT_ONCE
        worst = indicator.max(axis=0, initial=0.0)
        with np.errstate(all="ignore"):
            # Beside kinks the differences have any sign, and their sum may be small by chance.
            gaps = boxes.second - boxes.first
            gap = max(np.abs(gaps.sum(axis=1)).max(), np.linalg.norm(gaps, axis=1).max())
            error = float(np.nan_to_num(margin * gap / abs(two[0]), nan=np.inf))
        error = np.inf if boxes.unseen.any() else max(error, EPS)
        is_small = used > FIRST_POINTS and error < enough * (used / FIRST_POINTS) ** 2
        is_hopeless = used > POINTS_BEFORE_GIVING_UP and error > HOPELESS_ERROR
        if is_small or is_hopeless or used > MOST_POINTS or worst.sum() <= SHORTEST * abs(two[0]):
            return two, error
        # The boxes that hold half of all that the indicators tell are halved.
        descending = np.argsort(-worst)
        half = 1 + int(np.searchsorted(worst[descending].cumsum(), worst.sum() / 2))
        chosen = descending[: min(half, max(1, POINTS_AT_ONCE // points))]
        boxes = boxes.halved(f, peaks, chosen, indicator[:, chosen].argmax(axis=0))
        used += points * 2 * chosen.size


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


# --- boxes


def _in_boxes(f: Function, peaks: Peaks, low: Floats, size: Floats, least: Floats) -> Boxes:
    """Boxes with these corners, sides and `least` error indicators (all d by n).

    Where the function is infinite it counts as zero. The second rule has one node more along each side.
    """
    depth, n = low.shape
    indicator, both = least, []
    for count in (NODES_OF_SIDE, NODES_OF_SIDE + 1):
        nodes, weights = gauss(count)
        grid = nodes[np.indices((count,) * depth).reshape(depth, 1, count**depth)]
        values = f((low[:, :, None] + size[:, :, None] * grid).reshape(depth, n * count**depth))
        values = np.where(np.isfinite(values), values, 0.0).reshape(-1, n, *[count] * depth)
        values = values * size.prod(axis=0).reshape(-1, *[1] * depth)
        # Coefficients of the two highest of Legendre's polynomials.
        vander = np.polynomial.legendre.legvander(2 * nodes - 1, count - 1)
        high = vander[:, -2:] * weights[:, None] * 2 * count
        tails = np.zeros((depth, n))
        for k in range(depth):
            tail = np.abs(np.moveaxis(values, 2 + k, -1) @ high).max(axis=-1)
            for _ in range(depth - 1):
                tail = tail @ weights
            tails[k] = tail.max(axis=0)
        indicator = np.maximum(indicator, tails)
        for _ in range(depth):
            values = values @ weights
        both.append(values)
    return Boxes(low, size, indicator, peaks.unseen(low, size), *both)
