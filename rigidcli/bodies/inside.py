"""How often a surface of triangles goes round a point: once inside, never outside; seen along straight lines.

The lines run in one direction, oblique to what people draw. Along each of them every crossing of the surface
changes the number of windings by one, up or down as the triangle is wound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.edges import SIDES, blocks
from rigidcli.core.arithmetic import Floats

OBLIQUE = (0.12357, -0.07913)
"""The lines are along (-a, -b, 1), with these a and b: not along the faces of things with right angles."""

MOST_PAIRS = 5_000_000
"""The most pairs of a triangle and a line that are looked at, which takes a quarter of a second."""

CHUNK = 1_000_000
"""The most such pairs at once, which bounds the memory."""

TOUCHING = 1e-6
"""Crossings nearer than this, in units of the box, are one: single precision may exchange them."""


class Crossings(NamedTuple):
    """Where lines cross a surface: their numbers, the heights (z), and +1 where the way up leads outwards."""

    lines: NDArray[np.intp]
    heights: Floats
    senses: NDArray[np.intp]


class Overlap(NamedTuple):
    """A place (3) that a surface encloses so many times, and not once or not at all."""

    place: Floats
    windings: int


def _sheared(points: Floats, centre: Floats) -> Floats:
    """Coordinates (..., 3, n) in which the lines are along the third axis."""
    # Entry by entry, so that equal vertices have equal coordinates to the last bit, wherever they stand.
    d = points - centre[:, None]
    d[..., 0, :] += OBLIQUE[0] * d[..., 2, :]
    d[..., 1, :] += OBLIQUE[1] * d[..., 2, :]
    return d


def _crossings(corners: Floats, centre: Floats, points: Floats) -> Crossings | None:
    """Where the lines through `points` (k, 3) cross the surface, about `centre` (3); heights are from it.

    A line that meets an edge has no crossings. None where there would be too many pairs to look at.
    """
    u, v, _ = _sheared(points.T, centre)
    order, none = np.argsort(u), np.empty(0, dtype=np.intp)
    u, v = u[order], v[order]
    budget = MOST_PAIRS
    parts = [(none, np.empty(0), none)]
    spoilt = np.zeros(len(u), dtype=bool)
    for block in blocks(corners):
        d = _sheared(block, centre)
        first = np.searchsorted(u, d[:, 0].min(axis=0))
        counts = np.searchsorted(u, d[:, 0].max(axis=0), side="right") - first
        budget -= int(counts.sum())
        if budget < 0 and len(u) > 1:
            return None
        some = np.flatnonzero(counts)
        groups = np.cumsum(counts[some]) // CHUNK
        for triangles in np.split(some, np.flatnonzero(np.diff(groups)) + 1):
            repeats = counts[triangles]
            triangle = np.repeat(triangles, repeats)
            line = np.arange(triangle.size) + np.repeat(
                first[triangles] - np.cumsum(repeats) + repeats, repeats
            )
            parts.append(_crossed(d, triangle, line, u, v, spoilt))
    lines, heights, senses = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    kept = ~spoilt[lines]
    return Crossings(order[lines[kept]], heights[kept], senses[kept])


def _crossed(
    d: Floats,
    triangle: NDArray[np.intp],
    line: NDArray[np.intp],
    u: Floats,
    v: Floats,
    spoilt: NDArray[np.bool_],
) -> Crossings:
    """The crossings among pairs of a triangle and a line; lines through edges are noted as `spoilt`."""
    heights = d[:, 1][:, triangle]
    near = (heights.min(axis=0) <= v[line]) & (heights.max(axis=0) >= v[line])
    triangle, line = triangle[near], line[near]
    x, y, z = d.transpose(1, 0, 2)[:, :, triangle]
    x, y = x - u[line], y - v[line]
    # Twice the area that an edge spans with the line. The same edge, run the other way, gives its negative
    # to the last bit: no line slips through between two triangles.
    areas = np.array([x[i] * y[j] - x[j] * y[i] for i, j in SIDES])
    outwards, inwards = areas.min(axis=0) > 0, areas.max(axis=0) < 0
    hit = outwards | inwards
    spoilt[line[((areas.min(axis=0) == 0) | (areas.max(axis=0) == 0)) & ~hit]] = True
    areas = areas[:, hit]
    weights = areas[[1, 2, 0]] / areas.sum(axis=0)
    return Crossings(line[hit], (weights * z[:, hit]).sum(axis=0), np.where(outwards[hit], 1, -1))


def crossings(corners: Floats, centre: Floats, points: Floats) -> tuple[int, Crossings]:
    """Those of `_crossings` of the lines through one in so many of the points, and that number."""
    step = 1
    while (crossed := _crossings(corners, centre, points[::step])) is None:
        step *= 4
    return step, crossed


def overlap(corners: Floats, box: Floats, points: Floats, orientation: int) -> Overlap | None:
    """A place where the windings are not 0 or 1, if there is one on the lines through points (k, 3).

    One below 0 comes first, as it leaves no body; elsewhere parts overlap. `box` (2 by 3) holds the closed
    surface; `orientation` is -1 where it is wound inside out.
    """
    centre = box.mean(axis=0)
    step, crossed = crossings(corners, centre, points)
    order = np.lexsort((-crossed.heights, crossed.lines))
    # On its whole way a line gets out as often as in, so that one sum serves for all lines. One that does not
    # is so near to an edge that rounding decides.
    balance = np.bincount(crossed.lines, crossed.senses, minlength=len(points))
    order = order[balance[crossed.lines[order]] == 0]
    line, height, sense = (part[order] for part in crossed)
    below = np.cumsum(sense) * orientation
    gap = -np.diff(height, append=0.0)
    gap[np.diff(line, append=-1) != 0] = 0.0
    thick = gap > TOUCHING * np.linalg.norm(box[1] - box[0])
    for wrong in (thick & (below < 0), thick & (below > 1)):
        if wrong.any():
            worst = int(np.argmax(np.where(wrong, gap, 0.0)))
            point = points[::step][line[worst]] - centre
            rise = height[worst] - gap[worst] / 2 - point[2]
            place = centre + point + rise * np.array([-OBLIQUE[0], -OBLIQUE[1], 1.0])
            return Overlap(place, int(below[worst]))
    return None


def windings(corners: Floats, box: Floats, points: Floats) -> NDArray[np.intp]:
    """How often a closed surface in the `box` (2 by 3) goes round points (k, 3).

    A point on a line that meets an edge counts as outside. Where there are too many pairs of a triangle and a
    line, some of the points are looked at, and the others have 1.
    """
    centre, counts = box.mean(axis=0), np.ones(len(points), dtype=np.intp)
    step, crossed = crossings(corners, centre, points)
    some = points[::step]
    above = crossed.heights > (some[:, 2] - centre[2])[crossed.lines]
    counts[::step] = np.bincount(crossed.lines[above], crossed.senses[above], minlength=len(some))
    return counts
