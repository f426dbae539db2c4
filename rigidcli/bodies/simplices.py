"""Triangles and tetrahedra as charts: in floats many at a time, and exact ones by their own coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from rigidcli.bodies.charts import Barycentric, Chart, Spot, spread
from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Scalar


@dataclass(frozen=True, eq=False)
class Simplices(Chart):
    """Triangles or tetrahedra by their vertices (n by k by 3, m), seen from the `origin`."""

    vertices: Any = ()

    @property
    def pieces(self) -> int:
        """How many there are."""
        return len(self.vertices)

    def at(self, points: Floats) -> Spot:
        """The image of points; see `Chart`."""
        which = points[0].astype(int)
        vertices = self.vertices[which].transpose(1, 2, 0)
        return spread(_in_simplex(vertices, _sizes(self.vertices)[which], points[1:]), points.shape[1])


def _sizes(vertices: Floats) -> Floats:
    """The Jacobian of each simplex (n): twice its area, or six times its volume."""
    edges = vertices[:, 1:] - vertices[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    if edges.shape[1] == 2:
        return np.asarray(np.linalg.norm(normal, axis=1))
    sizes: Floats = np.abs((normal * edges[:, 2]).sum(axis=1))
    return sizes


def _in_simplex(vertices: Any, size: Any, units: Any) -> Spot:
    """The point of a simplex (k by 3) at Duffy's coordinates; `size` is k - 1 factorial times its measure."""
    left: Any = 1
    place = vertices[0]
    measure = size
    for k, unit in enumerate(units):
        place = place + left * unit * (vertices[k + 1] - vertices[0])
        left = left * (1 - unit)
        measure = measure * (1 if k == len(units) - 1 else (1 - unit) ** (len(units) - 1 - k))
    x, y, z = place
    return Spot(x, y, z, measure)


def simplices(vertices: Array, measures: Sequence[Scalar], n: Arithmetic) -> Sequence[Chart]:
    """Triangles or tetrahedra (n by k by 3, m) with these areas or volumes."""
    count = vertices.shape[1] - 1
    origin = vertices[0, 0]
    offsets = vertices - origin
    if not n.exact:
        return [Simplices((None,) * count, Spot, origin, offsets)]

    def place(own: Any, size: Any, *units: Any) -> Spot:
        x, y, z = own[0] + sum(unit * (end - own[0]) for unit, end in zip(units, own[1:], strict=True))
        return Spot(x, y, z, size)

    sizes = [measure * math.factorial(count) for measure in measures]
    return [
        Chart((Barycentric(),) * count, partial(place, own, size), origin)
        for own, size in zip(offsets, sizes, strict=True)
    ]
