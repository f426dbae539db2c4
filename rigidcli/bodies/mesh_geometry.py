"""Surfaces of triangles: what they enclose, whether they are closed, and how often they go round a point.

The corners of triangles are arrays of shape (3, 3, n): vertex, coordinate, triangle. Vertices are one where
their coordinates are equal; keys of 64 bits tell them apart.

The volume is a sum of tetrahedra with one vertex at a central point and signed volumes, so that the
divergence theorem does the rest (B. Mirtich, J. Graphics Tools 1 (1996) 31; D. Eberly, Polyhedral Mass
Properties). A surface goes once round what is inside, and never round what is outside. That is seen along
straight lines, oblique to what people draw: every crossing of the surface changes the number of windings by
one, up or down as the triangle is wound.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask

Keys: TypeAlias = NDArray[np.uint64]

# The most triangles of a block, 0.3 MB, which stays in the cache; small ones cost time to begin with.
BLOCK_TRIANGLES = 4_000
# The edges of a triangle, by its vertices, in the sense in which it is wound.
SIDES = ((0, 1), (1, 2), (2, 0))

# Odd numbers whose bits look random: multiplication by them modulo 2^64 spreads every bit upwards.
_MIX = np.array(
    [0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93, 0xA0761D6478BD642F],
    dtype=np.uint64,
)

_HALF = np.uint64(32)

# Beyond this ratio of c^2 to the mean square distance from c, sums are taken anew about the centre c.
FAR_FROM_ORIGIN_OF_SUMS = 10.0
# A surface encloses nothing if its volume is below this, in units of its area and the diagonal of its box.
# Coordinates of single precision, as STL has them, leave a volume of this size between two sides of a sheet.
FLATTEST = 1e-7
# The lines are along (-a, -b, 1), with these a and b: not along the faces of things with right angles.
OBLIQUE = (0.12357, -0.07913)
# The most pairs of a triangle and a line that are looked at, which takes a quarter of a second.
MOST_PAIRS = 5_000_000
PAIRS_AT_ONCE = 1_000_000  # about the most such pairs at once, which bounds the memory
# Squares along a side of a net of lines: most are empty, and its table of 2 MB stays in the cache.
SQUARES_OF_SIDE = 500


# --- the vertices and the edges


def blocks(corners: Floats) -> Iterator[Floats]:
    """The triangles in blocks (3, 3, k) of doubles, each in the place of the last one, in the cache."""
    block = np.empty((3, 3, min(BLOCK_TRIANGLES, corners.shape[2])))
    for start in range(0, corners.shape[2], BLOCK_TRIANGLES):
        part = corners[:, :, start : start + BLOCK_TRIANGLES]
        now = block[:, :, : part.shape[2]]
        now[...] = part
        yield now


def _mixed(keys: Keys, factor: np.uint64) -> Keys:
    keys = keys * factor
    keys ^= keys >> _HALF
    return keys


def vertex_keys(block: Floats) -> Keys:
    """A key for each vertex (3, n) of a block, which depends on nothing but its coordinates; -0 is 0.

    Those of a million different vertices are different, but for a chance of one in 10^7.
    """
    bits = np.add(block, 0.0, dtype=np.float64, order="C").view(np.uint64)
    # Single precision leaves the lower bits zero, and a product alone would never fill them. Without the one
    # here, a sign would cancel a change of the last digit.
    bits *= _MIX[4]
    bits ^= bits >> _HALF
    keys = bits[:, 0] * _MIX[0] + bits[:, 1] * _MIX[1] + bits[:, 2] * _MIX[2]
    keys ^= keys >> np.uint64(29)
    return _mixed(keys, _MIX[3])


def fingerprint(keys: Keys) -> int:
    """A number of triangles (keys: 3 by n) whose sum over a closed surface is zero modulo 2^64.

    The idea: draw the surface on a plane, each vertex at a random point (p, q) that follows from its key.
    The signed area of a triangle is a sum of three terms, one for each edge, which changes its sign with the
    sense of the edge. In a closed surface each edge is run once in either sense, so that all areas together
    are zero, wherever the points are. An edge without a partner leaves its term, which is zero with a chance
    of a few in 2^64. So one pass over blocks of triangles decides, without a table of edges in memory.
    """
    p, q = keys, _mixed(keys, _MIX[4])
    area = (p[1] - p[0]) * (q[2] - q[0]) - (p[2] - p[0]) * (q[1] - q[0])
    return int(area.sum())


class Unpaired(NamedTuple):
    """How many edges run in one sense more often than in the other, and the first of them.

    `uses` is the number of its triangles: if an edge belongs to one triangle alone, only such are counted.
    `edge` (2, 3) has its ends, in the sense in which it runs more often. The edges that are
    counted hang together in as many groups as there are `holes`.
    """

    number: int
    uses: int
    edge: Floats
    holes: int


def unpaired(corners: Floats) -> Unpaired | None:
    """The edges of a surface that lack a partner; None where each has one."""
    keys = vertex_keys(corners)
    one, two = (np.concatenate([keys[side[end]] for side in SIDES]) for end in (0, 1))
    both = _mixed(np.minimum(one, two) * _MIX[0] + np.maximum(one, two), _MIX[1])
    senses = (one < two).astype(np.int8) - (one > two).astype(np.int8)  # 0 for an edge without length
    different, places = np.unique(both, return_inverse=True)
    balance = np.bincount(places, senses, len(different))
    uses = np.bincount(places, senses != 0, len(different))
    wrong = balance != 0
    if not wrong.any():
        return None
    if (wrong & (uses == 1)).any():
        wrong &= uses == 1
    first = int(np.argmax(wrong[places] & (senses * balance[places] > 0)))
    side, triangle = divmod(first, corners.shape[2])
    edge = corners[list(SIDES[side]), :, triangle].astype(np.float64) + 0.0
    open_edges = wrong[places] & (senses != 0)
    holes = len(np.unique(components(np.stack([one[open_edges], two[open_edges]]))))
    return Unpaired(int(wrong.sum()), int(uses[places[first]]), edge, holes)


def merged(corners: Floats, box: Floats, distance: float) -> tuple[Floats, int]:
    """The triangles in a `box` (2 by 3) with vertices nearer than `distance` made one, and how many moved.

    Two such vertices share a cell of at least one of eight grids: the cells have twice that side, and the
    grids differ by half a cell.
    """
    _, first, places = np.unique(vertex_keys(corners), return_index=True, return_inverse=True)
    vertices = corners.transpose(0, 2, 1).reshape(-1, 3)[first].astype(np.float64)
    cells = ((vertices - box[0]) / (2 * distance)).T
    shifts = np.array(list(product((0.0, 0.5), repeat=3)))
    grids = [vertex_keys(np.floor(cells + shift[:, None])[None])[0] for shift in shifts]
    labels = components(np.stack([_mixed(own + np.uint64(k), _MIX[4]) for k, own in enumerate(grids)]))
    _, chosen, group = np.unique(labels, return_index=True, return_inverse=True)
    meant = vertices[chosen][group]
    moved = int((meant != vertices).any(axis=1).sum())
    return np.ascontiguousarray(meant[places.reshape(3, -1)].transpose(0, 2, 1)), moved


def components(keys: Keys) -> NDArray[np.intp]:
    """The label of the connected component of each triangle, by the keys (3, n) of its vertices.

    Labels of vertices are lowered to the least one of a triangle until none changes. Each label is a vertex,
    too, so that whole parts are lowered at once (Y. Shiloach, U. Vishkin, J. Algorithms 3 (1982) 57).
    """
    vertices, places = np.unique(keys, return_inverse=True)
    corners = places.reshape(keys.shape)
    label = np.arange(len(vertices))
    while True:
        own = label[corners]
        least: NDArray[np.intp] = own.min(axis=0)
        if (own == least).all():
            return least
        np.minimum.at(label, own, least[None])
        while (label[label] != label).any():
            label = label[label]


# --- integrals


class Surface:
    """A surface of triangles, in the unit of its `corners` (3, 3, n; of either precision), and sums over it.

    `box` (2 by 3) holds the least and the largest coordinates, and `size` is its diagonal. The surface
    `is_closed` where each edge has triangles on both sides that agree about inside and outside, and `is_flat`
    where there is no space inside. `volume` is negative where it is wound inside out. Sums are taken about
    the point `origin` (3), and `centre` (3) is seen from there: that is the middle of the first block, or the
    centre itself where it is far from there. Where sums overflow, numbers are not finite, and the box is not
    where a coordinate is not.
    """

    @np.errstate(over="ignore", invalid="ignore")
    def __init__(self, corners: Floats) -> None:
        self.corners, self.triangles = corners, corners.shape[2]
        residue, self.box = 0, np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        self._begin(np.zeros(3))
        for start, block in enumerate(blocks(corners)):
            low, high = block.min(axis=(0, 2)), block.max(axis=(0, 2))
            if start == 0:
                self._begin((low + high) / 2)
            self.box = np.array([np.minimum(self.box[0], low), np.maximum(self.box[1], high)])
            residue = (residue + fingerprint(vertex_keys(block))) % 2**64
            self._add(block)
        if self.centre @ self.centre > FAR_FROM_ORIGIN_OF_SUMS * np.trace(self.second):
            self._begin(self.origin + self.centre)
            for block in blocks(corners):
                self._add(block)
        self.size = float(np.linalg.norm(self.box[1] - self.box[0]))
        self.is_closed = residue == 0
        self.is_flat = abs(self.volume) <= FLATTEST * self.area * self.size

    def _begin(self, origin: Floats) -> None:
        self.origin, self.area, self.volume = origin, 0.0, 0.0
        self._sizes, self._first, self._products = np.zeros(2), np.zeros(3), np.zeros((3, 3))

    def _add(self, block: Floats) -> None:
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
            return np.asarray(self._first / (4 * np.float64(self.volume)))

    @property
    def second(self) -> Floats:
        """The mean of r r^T about the centre (3 by 3)."""
        with np.errstate(divide="ignore"):
            # That of a tetrahedron with vertices at d, of sum s, is (sum d d^T + s s^T)/20 about the origin.
            mean = self._products / (20 * np.float64(self.volume))
        return np.asarray(mean - np.outer(self.centre, self.centre))

    @property
    def cancelled(self) -> float:
        """By how much rounding errors are larger than in a sum without negative terms."""
        sums = np.abs([self.volume, np.trace(self._products) * 4 / 5])
        return float((self._sizes / sums).max()) if sums.all() else np.inf

    def some(self, which: slice | NDArray[np.intp]) -> Floats:
        """The triangles (k, 3, 3: triangle, vertex, coordinate) of these numbers."""
        return self.corners[:, :, which].transpose(2, 0, 1).astype(np.float64)

    def windings(self, points: Floats) -> NDArray[np.intp]:
        """How often the surface, if it is closed, goes round points (k, 3).

        A point on a line that meets an edge counts as outside. Where there are too many pairs of a triangle
        and a line, some of the points are looked at, and the others have 1.
        """
        counts, step = np.ones(len(points), dtype=np.intp), 1
        while (some := _windings(self.corners, self.box.mean(axis=0), points[::step])) is None:
            step *= 4
        counts[::step] = some
        return counts


def normals(triangles: Floats) -> Floats:
    """Unit vectors (k, 3) out of triangles (k, 3, 3); zero where one has no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(across / np.where(lengths == 0, 1, lengths))


def spread(triangles: Floats, labels: NDArray[np.intp], count: int) -> tuple[NDArray[np.intp], Floats]:
    """Points (`count`, 3) spread evenly over triangles (k, 3, 3), and the numbers of their triangles.

    Triangles with the same of the `labels` (k) get as many as those with another, each by its area. Within
    a triangle, the points are those of M. Roberts' sequence R2 (2018), folded into the half of a square.
    """
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    areas = np.linalg.norm(np.cross(a, b), axis=1)
    of_part = np.bincount(labels, areas)[labels]
    share = np.cumsum(areas / np.where(of_part == 0, 1, of_part))
    numbers = np.searchsorted(share, (np.arange(count) + 0.5) / count * share[-1])
    along = np.outer([0.7548776662466927, 0.5698402909980532], np.arange(1, count + 1)) % 1
    x, y = np.where(along.sum(axis=0) > 1, 1 - along, along)[:, :, None]
    return numbers, triangles[numbers, 0] + x * a[numbers] + y * b[numbers]


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
    return np.asarray(vertices[np.unique(np.concatenate(numbers, axis=1), axis=1).T])


# --- inside and outside


def _windings(corners: Floats, centre: Floats, points: Floats) -> NDArray[np.intp] | None:
    """The windings round points, in coordinates about `centre` (3); None where there are too many pairs.

    The idea: in sheared coordinates (u, v, w) the line through a point goes along w. It meets a triangle if
    the projection of the triangle on (u, v) holds the point: all three edges turn round it in one sense. A
    net of squares drops the triangles without a line near them. The lines are sorted by u, so that those
    between the least and the largest u of a triangle are one range. All pairs of a triangle and a line of its
    range are then worked as arrays, repeated as often as the range is long.
    """
    order = np.argsort(_sheared(points.T, centre)[0])
    u, v, w = _sheared(points[order].T, centre)
    counts, is_spoilt, pairs = np.zeros(len(u), dtype=np.intp), np.zeros(len(u), dtype=bool), 0
    squares = _Squares(u, v)
    for block in blocks(corners):
        d = _sheared(block, centre)
        low, high = np.minimum(np.minimum(d[0], d[1]), d[2]), np.maximum(np.maximum(d[0], d[1]), d[2])
        some = np.flatnonzero(squares.hold_lines(low[:2], high[:2]))
        first = np.searchsorted(u, low[0, some])
        number = np.searchsorted(u, high[0, some], side="right") - first
        pairs += int(number.sum())
        if pairs > MOST_PAIRS and len(u) > 1:
            return None
        for part in np.array_split(np.arange(len(some)), 1 + number.sum() // PAIRS_AT_ONCE):
            line = np.repeat(first[part] - np.cumsum(number[part]) + number[part], number[part])
            line, triangle = line + np.arange(len(line)), np.repeat(some[part], number[part])
            near = (low[1, triangle] <= v[line]) & (high[1, triangle] >= v[line])
            line, (x, y, z) = line[near], d.transpose(1, 0, 2)[:, :, triangle[near]]
            x, y = x - u[line], y - v[line]
            # Twice the area that an edge spans with the line. The same edge, run the other way, gives its
            # negative to the last bit: no line slips through between two triangles.
            areas = np.array([x[i] * y[j] - x[j] * y[i] for i, j in SIDES])
            least, most = areas.min(axis=0), areas.max(axis=0)
            is_hit = (least > 0) | (most < 0)
            is_spoilt[line[((least == 0) | (most == 0)) & ~is_hit]] = True
            line, areas, z = line[is_hit], areas[:, is_hit], z[:, is_hit]
            height = (areas[[1, 2, 0]] * z).sum(axis=0) / areas.sum(axis=0)
            np.add.at(counts, line, np.where(height > w[line], np.sign(areas[0]).astype(np.intp), 0))
    counts[is_spoilt] = 0
    windings = np.empty_like(counts)
    windings[order] = counts
    return windings


class _Squares:
    """A net of squares over lines at (u, v), with the number of lines below and left of each of its corners.

    Four of these numbers tell of most triangles in a large mesh that they have no line near them
    (F. Crow, Computer Graphics 18 (1984) 207).
    """

    def __init__(self, u: Floats, v: Floats) -> None:
        self.low = np.array([[u.min()], [v.min()]])
        self.per_length = SQUARES_OF_SIDE / (max(float(np.ptp(u)), float(np.ptp(v))) or 1.0)
        table = np.zeros((SQUARES_OF_SIDE + 1, SQUARES_OF_SIDE + 1), dtype=np.int32)
        np.add.at(table, tuple(self._places(np.array([u, v])) + 1), 1)
        self.below = table.cumsum(axis=0).cumsum(axis=1)

    def _places(self, points: Floats) -> NDArray[np.int32]:
        places: Floats = (points - self.low) * self.per_length
        return np.clip(places, 0, SQUARES_OF_SIDE - 1, out=places).astype(np.int32)

    def hold_lines(self, low: Floats, high: Floats) -> Mask:
        """Whether there are lines in the squares that rectangles from `low` to `high` (2, n) touch."""
        (a, b), (c, d), below = self._places(low), self._places(high) + 1, self.below
        return np.asarray(below[c, d] - below[a, d] - below[c, b] + below[a, b] > 0)


def _sheared(points: Floats, centre: Floats) -> Floats:
    """Coordinates (..., 3, n) in which the lines are along the third axis."""
    # Entry by entry, so that equal vertices have equal coordinates to the last bit, wherever they stand.
    d = points - centre[:, None]
    d[..., 0, :] += OBLIQUE[0] * d[..., 2, :]
    d[..., 1, :] += OBLIQUE[1] * d[..., 2, :]
    return d
