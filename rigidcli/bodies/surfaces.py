"""Surfaces of triangles: their area, what they enclose, and whether they are closed.

The volume is a sum of tetrahedra with one vertex at a central point and signed volumes, so that the
divergence theorem does the rest (B. Mirtich, J. Graphics Tools 1 (1996) 31; D. Eberly, Polyhedral Mass
Properties). All is summed in blocks of triangles, arrays of shape (3, 3, n): vertex, coordinate, triangle.
The inner loops of numpy are then long, and any number of triangles takes the same memory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies.edges import Keys, Read, fingerprint, vertex_keys
from rigidcli.core.arithmetic import Floats

FAR = 10.0
"""Beyond this ratio of c^2 to the mean square distance from c, sums are taken anew about the centre c."""

FLAT = 1e-7
"""A surface encloses nothing if its volume is below this, in units of its area and the diagonal of its box.

Coordinates of single precision, as STL has them, leave a volume of this size between two sides of a sheet.
"""

KEPT = 300_000
"""The most triangles whose vertices are remembered by their keys, to tell which of them hang together."""

PROBES = 256
"""About how many triangles, evenly chosen, are remembered as places where the surface is."""


class Surface:
    """What a surface is, in the unit of its coordinates.

    `box` (2 by 3) holds the least and the largest coordinates. `residue` is zero where each edge has
    triangles on both sides that agree about inside and outside. `volume` is negative where the surface is
    wound inside out. `places` (k, 3) are points of the surface; `keys` (3, n) tell its vertices apart, where
    there are few enough. Sums are taken about the point `origin` (3), and `centre` (3) is seen from there.
    """

    def __init__(self, *, thin: bool) -> None:
        # A triangle and the central point are a tetrahedron; a thin shell consists of the triangles.
        self._corners = 3 if thin else 4
        self.triangles, self.residue = 0, 0
        self.box = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        self.places = np.empty((0, 3))
        self.keys: Keys | None = None
        self.sum_about(np.zeros(3))

    def sum_about(self, origin: Floats) -> None:
        """Begin the sums anew, about a point (3)."""
        self.origin, self.area, self.volume = origin, 0.0, 0.0
        self._sizes, self._first, self._products = np.zeros(2), np.zeros(3), np.zeros((3, 3))

    def add(self, block: Floats) -> None:
        """Add the triangles of a block to the sums."""
        d = block - self.origin[:, None]
        a, b = d[1] - d[0], d[2] - d[0]
        x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        areas = np.sqrt(x * x + y * y + z * z) / 2
        volumes = (d[0, 0] * x + d[0, 1] * y + d[0, 2] * z) / 6
        self.area += float(areas.sum())
        self.volume += float(volumes.sum())
        weights = areas if self._corners == 3 else volumes
        total = d.sum(axis=0)
        sizes = np.abs(weights)
        self._sizes += sizes.sum(), sizes @ (total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
        self._first += total @ weights
        for vertex in (*d, total):
            self._products += (vertex * weights) @ vertex.T

    @property
    def measure(self) -> float:
        """The volume inside, or the area of a thin shell."""
        return self.area if self._corners == 3 else self.volume

    @property
    def centre(self) -> Floats:
        """The centre (3), from the origin of the sums."""
        with np.errstate(divide="ignore"):
            centre: Floats = self._first / (self._corners * np.float64(self.measure))
        return centre

    @property
    def second(self) -> Floats:
        """The mean of r r^T about the centre (3 by 3).

        That of a simplex with k vertices at d is (sum d d^T + s s^T)/(k (k + 1)) about the origin, where s is
        the sum of all d.
        """
        with np.errstate(divide="ignore"):
            mean = self._products / (self._corners * (self._corners + 1) * np.float64(self.measure))
        second: Floats = mean - np.outer(self.centre, self.centre)
        return second

    @property
    def cancelled(self) -> float:
        """By how much rounding errors are larger than in a sum without negative terms."""
        sums = np.abs([self.measure, np.trace(self._products) * self._corners / (self._corners + 1)])
        return float((self._sizes / sums).max()) if sums.all() else np.inf

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


class NotFiniteError(ValueError):
    """A coordinate that is no finite number, in the triangle of this number, from 0."""

    def __init__(self, triangle: int) -> None:
        super().__init__(f"triangle {triangle}")
        self.triangle = triangle


@np.errstate(over="ignore", invalid="ignore")
def measured(read: Read, *, thin: bool) -> Surface:
    """The surface, with the volume inside, or the area where it is a `thin` shell.

    Sums are taken about the middle of the first block, or once more where that is far from the centre.
    Without triangles, or where sums overflow, numbers are zero or not finite. Raises NotFiniteError.
    """
    surface, keys, places = Surface(thin=thin), list[Keys](), [np.empty((0, 3))]
    for block in read():
        low, high = block.min(axis=(0, 2)), block.max(axis=(0, 2))
        if not np.isfinite(low + high).all():
            raise NotFiniteError(surface.triangles + int(np.argmin(np.isfinite(block).all(axis=(0, 1)))))
        if not surface.triangles:
            surface.sum_about((low + high) / 2)
        surface.add(block)
        surface.triangles += block.shape[2]
        surface.box = np.array([np.minimum(surface.box[0], low), np.maximum(surface.box[1], high)])
        own = vertex_keys(block)
        surface.residue = (surface.residue + fingerprint(own)) % 2**64
        places.append(block[:, :, :: max(1, block.shape[2] // PROBES)].mean(axis=0).T)
        keys = [*keys, own] if surface.triangles <= KEPT else []
    centre = surface.centre
    if centre @ centre > FAR * np.trace(surface.second):
        surface.sum_about(surface.origin + centre)
        for block in read():
            surface.add(block)
    points = np.vstack(places)
    surface.places = points[:: max(1, len(points) // PROBES)]
    surface.keys = np.concatenate(keys, axis=1) if keys else None
    return surface


def chosen(read: Read, numbers: NDArray[np.intp]) -> Floats:
    """The triangles (k, 3, 3) with these numbers, which ascend."""
    start, triangles = 0, [np.empty((0, 3, 3))]
    for block in read():
        end = start + block.shape[2]
        own = numbers[(numbers >= start) & (numbers < end)] - start
        triangles.append(block[:, :, own].transpose(2, 0, 1))
        start = end
    return np.vstack(triangles)


def simplified(read: Read, box: Floats, cells: int) -> Floats:
    """Triangles (k, 3, 3) like those of a surface in a `box` (2 by 3), but few enough to be drawn.

    Space is cut into cells, so many along the longest side. Vertices in one cell become one, and triangles
    that have no area then are left out (J. Rossignac, P. Borrel, in: Modeling in Computer Graphics, 1993).
    """
    length = float((box[1] - box[0]).max()) / cells
    vertices = np.zeros(((cells + 1) ** 3, 3))
    corners = [np.empty((3, 0), dtype=np.intp)]
    for block in read():
        place = ((block - box[0][:, None]) / length).astype(np.intp)
        number = (place[:, 0] * (cells + 1) + place[:, 1]) * (cells + 1) + place[:, 2]
        vertices[number] = block.transpose(0, 2, 1)
        one, two, three = number
        corners.append(np.unique(number[:, (one != two) & (two != three) & (three != one)], axis=1))
    triangles: Floats = vertices[np.unique(np.concatenate(corners, axis=1), axis=1).T]
    return triangles
