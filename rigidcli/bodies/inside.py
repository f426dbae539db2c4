"""How often a surface of triangles goes round a point: once inside, never outside; seen along straight lines.

The lines run in one direction, oblique to what people draw. Along each of them every crossing of the surface
changes the number of windings by one, up or down as the triangle is wound.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.edges import SIDES, Read
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


def crossings(read: Read, centre: Floats, points: Floats) -> Crossings | None:
    """Where the lines through `points` (k, 3) cross the surface, about `centre` (3); heights are from it.

    A line that meets an edge has no crossings. None where there would be too many pairs to look at.
    """
    u, v, _ = _sheared(points.T, centre)
    order, none = np.argsort(u), np.empty(0, dtype=np.intp)
    u, v = u[order], v[order]
    budget = MOST_PAIRS
    found: list[Crossings] = []
    spoilt = np.zeros(len(u), dtype=bool)
    for block in read():
        d = _sheared(block, centre)
        first = np.searchsorted(u, d[:, 0].min(axis=0))
        counts = np.searchsorted(u, d[:, 0].max(axis=0), side="right") - first
        budget -= int(counts.sum())
        if budget < 0:
            return None
        for triangles in _chunks(counts):
            repeats = counts[triangles]
            ends = np.cumsum(repeats)
            line = np.arange(ends[-1]) + np.repeat(first[triangles] - ends + repeats, repeats)
            triangle = np.repeat(triangles, repeats)
            found.append(_crossed(d, triangle, line, u, v, spoilt))
    lines = np.concatenate([none, *(part.lines for part in found)])
    heights = np.concatenate([np.empty(0), *(part.heights for part in found)])
    senses = np.concatenate([none, *(part.senses for part in found)])
    kept = ~spoilt[lines]
    return Crossings(order[lines[kept]], heights[kept], senses[kept])


def _chunks(counts: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """The numbers of the triangles with counts, in groups of not much more than CHUNK pairs."""
    some = np.flatnonzero(counts)
    groups = np.cumsum(counts[some]) // CHUNK
    yield from np.split(some, np.flatnonzero(np.diff(groups)) + 1) if some.size else ()


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
    # Twice the area that each edge spans with the line. The same edge, run the other way, gives its negative
    # to the last bit: no line slips through between two triangles.
    areas = np.array([x[i] * y[j] - x[j] * y[i] for i, j in SIDES])
    outwards, inwards = areas.min(axis=0) > 0, areas.max(axis=0) < 0
    hit = outwards | inwards
    spoilt[line[((areas.min(axis=0) == 0) | (areas.max(axis=0) == 0)) & ~hit]] = True
    areas = areas[:, hit]
    weights = areas[[1, 2, 0]] / areas.sum(axis=0)
    return Crossings(line[hit], (weights * z[:, hit]).sum(axis=0), np.where(outwards[hit], 1, -1))


def overlap(read: Read, box: Floats, points: Floats, orientation: int) -> Overlap | None:
    """A place where the windings are not 0 or 1, if there is one on the lines through points (k, 3).

    One below 0 comes first, as it leaves no body; elsewhere parts overlap. `box` (2 by 3) holds the closed
    surface; `orientation` is -1 where it is wound inside out.
    """
    centre = box.mean(axis=0)
    found = crossings(read, centre, points)
    while found is None and len(points) > 1:
        points = points[::4]
        found = crossings(read, centre, points)
    if found is None or not found.lines.size:
        return None
    order = np.lexsort((-found.heights, found.lines))
    # On its whole way a line gets out as often as in, so that one sum serves for all lines. One that does not
    # is so near to an edge that rounding decides.
    order = order[np.bincount(found.lines, found.senses)[found.lines[order]] == 0]
    line, height, sense = (part[order] for part in found)
    if not line.size:
        return None
    below = np.cumsum(sense) * orientation
    gap = np.append(height[:-1] - height[1:], 0.0)
    gap[np.append(line[1:] != line[:-1], True)] = 0.0
    thick = gap > TOUCHING * np.linalg.norm(box[1] - box[0])
    for wrong in (thick & (below < 0), thick & (below > 1)):
        if wrong.any():
            worst = int(np.argmax(np.where(wrong, gap, 0.0)))
            point = points[line[worst]] - centre
            rise = height[worst] - gap[worst] / 2 - point[2]
            place = centre + point + rise * np.array([-OBLIQUE[0], -OBLIQUE[1], 1.0])
            return Overlap(place, int(below[worst]))
    return None


def windings(read: Read, box: Floats, points: Floats) -> NDArray[np.intp] | None:
    """How often a closed surface in the `box` (2 by 3) goes round each of the points (k, 3).

    A point on a line that meets an edge is told to be outside. None where there are too many pairs of a
    triangle and a line to look at.
    """
    centre = box.mean(axis=0)
    found = crossings(read, centre, points)
    if found is None:
        return None
    above = found.heights > (points[:, 2] - centre[2])[found.lines]
    counts = np.bincount(found.lines[above], found.senses[above], minlength=len(points))
    return counts.astype(np.intp)
