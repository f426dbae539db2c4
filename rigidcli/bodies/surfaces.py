"""Surfaces of triangles: their area, what they enclose, and whether they are closed.

The volume is a sum of tetrahedra with one vertex at a central point and signed volumes, so that the
divergence theorem does the rest (B. Mirtich, J. Graphics Tools 1 (1996) 31; D. Eberly, Polyhedral Mass
Properties). The corners of triangles are arrays of shape (3, 3, n): vertex, coordinate, triangle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.edges import blocks, fingerprint, vertex_keys
from rigidcli.core.arithmetic import Floats

FAR = 10.0
"""Beyond this ratio of c^2 to the mean square distance from c, sums are taken anew about the centre c."""

FLAT = 1e-7
"""A surface encloses nothing if its volume is below this, in units of its area and the diagonal of its box.

Coordinates of single precision, as STL has them, leave a volume of this size between two sides of a sheet.
"""


class NotFiniteError(ValueError):
    """A coordinate that is no finite number, in the triangle of this number, from 0."""

    def __init__(self, triangle: int) -> None:
        super().__init__(f"triangle {triangle}")
        self.triangle = triangle


class Surface:
    """A surface of triangles, in the unit of its `corners` (3, 3, n; of either precision), and sums over it.

    `box` (2 by 3) holds the least and the largest coordinates. `residue` is zero where each edge has
    triangles on both sides that agree about inside and outside. `volume` is negative where the surface is
    wound inside out. Sums are taken about the point `origin` (3), and `centre` (3) is seen from there: that
    is the middle of the first block, or the centre itself where it is far from there. Where sums overflow,
    numbers are not finite. Raises NotFiniteError.
    """

    @np.errstate(over="ignore", invalid="ignore")
    def __init__(self, corners: Floats) -> None:
        self.corners, self.triangles = corners, corners.shape[2]
        self.residue, self.box = 0, np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        self._begin(np.zeros(3))
        for start, block in enumerate(blocks(corners)):
            low, high = block.min(axis=(0, 2)), block.max(axis=(0, 2))
            if not np.isfinite(low + high).all():
                raise NotFiniteError(int(np.argmin(np.isfinite(corners).all(axis=(0, 1)))))
            if start == 0:
                self._begin((low + high) / 2)
            self.box = np.array([np.minimum(self.box[0], low), np.maximum(self.box[1], high)])
            self.residue = (self.residue + fingerprint(vertex_keys(block))) % 2**64
            self._add(block)
        if self.centre @ self.centre > FAR * np.trace(self.second):
            self._begin(self.origin + self.centre)
            for block in blocks(corners):
                self._add(block)

    def _begin(self, origin: Floats) -> None:
        """Begin the sums about a point (3)."""
        self.origin, self.area, self.volume = origin, 0.0, 0.0
        self._sizes, self._first, self._products = np.zeros(2), np.zeros(3), np.zeros((3, 3))

    def _add(self, block: Floats) -> None:
        """Add the triangles of a block to the sums."""
        d = block - self.origin[:, None]
        a, b = d[1] - d[0], d[2] - d[0]
        x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        areas = np.sqrt(x * x + y * y + z * z) / 2
        volumes = (d[0, 0] * x + d[0, 1] * y + d[0, 2] * z) / 6
        self.area += float(areas.sum())
        self.volume += float(volumes.sum())
        total, sizes = d.sum(axis=0), np.abs(volumes)
        self._sizes += sizes.sum(), sizes @ (total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
        self._first += total @ volumes
        for vertex in (*d, total):
            self._products += (vertex * volumes) @ vertex.T

    @property
    def centre(self) -> Floats:
        """The centre (3), from the origin of the sums."""
        with np.errstate(divide="ignore"):
            centre: Floats = self._first / (4 * np.float64(self.volume))
        return centre

    @property
    def second(self) -> Floats:
        """The mean of r r^T about the centre (3 by 3).

        That of a tetrahedron with vertices at d is (sum d d^T + s s^T)/20 about the origin, where s is their
        sum.
        """
        with np.errstate(divide="ignore"):
            mean = self._products / (20 * np.float64(self.volume))
        second: Floats = mean - np.outer(self.centre, self.centre)
        return second

    @property
    def cancelled(self) -> float:
        """By how much rounding errors are larger than in a sum without negative terms."""
        sums = np.abs([self.volume, np.trace(self._products) * 4 / 5])
        return float((self._sizes / sums).max()) if sums.all() else np.inf

    def some(self, which: slice | NDArray[np.intp]) -> Floats:
        """The triangles (k, 3, 3: triangle, vertex, coordinate) of these numbers."""
        return self.corners[:, :, which].transpose(2, 0, 1).astype(np.float64)

    @property
    def size(self) -> float:
        """The diagonal of the box."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @property
    def is_closed(self) -> bool:
        """Whether each edge has triangles on both sides that agree about inside and outside."""
        return self.residue == 0

    @property
    def is_flat(self) -> bool:
        """Whether there is no space inside."""
        return abs(self.volume) <= FLAT * self.area * self.size


def normals(triangles: Floats) -> Floats:
    """Unit vectors (k, 3) out of triangles (k, 3, 3); zero where one has no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    unit: Floats = across / np.where(lengths == 0, 1, lengths)
    return unit


def simplified(corners: Floats, box: Floats, cells: int) -> Floats:
    """Triangles (k, 3, 3) like those of a surface in a `box` (2 by 3), but few enough to be drawn.

    Space is cut into cells, so many along the longest side. Vertices in one cell become one, and triangles
    that have no area then are left out (J. Rossignac, P. Borrel, in: Modeling in Computer Graphics, 1993).
    """
    length = float((box[1] - box[0]).max()) / cells
    vertices = np.zeros(((cells + 1) ** 3, 3))
    numbers = [np.empty((3, 0), dtype=np.intp)]
    for block in blocks(corners):
        place = ((block - box[0][:, None]) / length).astype(np.intp)
        number = (place[:, 0] * (cells + 1) + place[:, 1]) * (cells + 1) + place[:, 2]
        vertices[number] = block.transpose(0, 2, 1)
        one, two, three = number
        numbers.append(np.unique(number[:, (one != two) & (two != three) & (three != one)], axis=1))
    triangles: Floats = vertices[np.unique(np.concatenate(numbers, axis=1), axis=1).T]
    return triangles
