"""How often a surface of triangles goes round a point: once inside, never outside; seen along straight lines.

The lines run in one direction, oblique to what people draw. Along each of them every crossing of the surface
changes the number of windings by one, up or down as the triangle is wound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.edges import SIDES, blocks
from rigidcli.core.arithmetic import Floats

OBLIQUE = (0.12357, -0.07913)
"""The lines are along (-a, -b, 1), with these a and b: not along the faces of things with right angles."""

MOST_PAIRS = 5_000_000
"""The most pairs of a triangle and a line that are looked at, which takes a quarter of a second."""

CHUNK = 1_000_000
"""About the most such pairs at once, which bounds the memory."""


def windings(corners: Floats, box: Floats, points: Floats) -> NDArray[np.intp]:
    """How often a closed surface in the `box` (2 by 3) goes round points (k, 3).

    A point on a line that meets an edge counts as outside. Where there are too many pairs of a triangle and a
    line, some of the points are looked at, and the others have 1.
    """
    counts, step = np.ones(len(points), dtype=np.intp), 1
    while (some := _counted(corners, box.mean(axis=0), points[::step])) is None:
        step *= 4
    counts[::step] = some
    return counts


def _counted(corners: Floats, centre: Floats, points: Floats) -> NDArray[np.intp] | None:
    """The windings round points, in coordinates about `centre` (3); None where there are too many pairs."""
    order = np.argsort(_sheared(points.T, centre)[0])
    u, v, w = _sheared(points[order].T, centre)
    counts, is_spoilt, pairs = np.zeros(len(u), dtype=np.intp), np.zeros(len(u), dtype=bool), 0
    for block in blocks(corners):
        d = _sheared(block, centre)
        first = np.searchsorted(u, d[:, 0].min(axis=0))
        lines = np.searchsorted(u, d[:, 0].max(axis=0), side="right") - first
        pairs += int(lines.sum())
        if pairs > MOST_PAIRS and len(u) > 1:
            return None
        some = np.flatnonzero(lines)
        for triangles in np.array_split(some, 1 + lines.sum() // CHUNK):
            number = lines[triangles]
            triangle = np.repeat(triangles, number)
            line = np.arange(len(triangle)) + np.repeat(first[triangles] - np.cumsum(number) + number, number)
            y = d[:, 1][:, triangle]
            near = (y.min(axis=0) <= v[line]) & (y.max(axis=0) >= v[line])
            line, (x, y, z) = line[near], d.transpose(1, 0, 2)[:, :, triangle[near]]
            x, y = x - u[line], y - v[line]
            # Twice the area that an edge spans with the line. The same edge, run the other way, gives its
            # negative to the last bit: no line slips through between two triangles.
            areas = np.array([x[i] * y[j] - x[j] * y[i] for i, j in SIDES])
            low, high = areas.min(axis=0), areas.max(axis=0)
            is_hit = (low > 0) | (high < 0)
            is_spoilt[line[((low == 0) | (high == 0)) & ~is_hit]] = True
            line, areas, z = line[is_hit], areas[:, is_hit], z[:, is_hit]
            height = (areas[[1, 2, 0]] * z).sum(axis=0) / areas.sum(axis=0)
            np.add.at(counts, line, np.where(height > w[line], np.sign(areas[0]).astype(np.intp), 0))
    counts[is_spoilt] = 0
    windings = np.empty_like(counts)
    windings[order] = counts
    return windings


def _sheared(points: Floats, centre: Floats) -> Floats:
    """Coordinates (..., 3, n) in which the lines are along the third axis."""
    # Entry by entry, so that equal vertices have equal coordinates to the last bit, wherever they stand.
    d = points - centre[:, None]
    d[..., 0, :] += OBLIQUE[0] * d[..., 2, :]
    d[..., 1, :] += OBLIQUE[1] * d[..., 2, :]
    return d
