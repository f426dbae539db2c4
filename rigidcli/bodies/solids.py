"""Bodies bounded by flat faces: integrals of simplices and polygons, and their vertices in documents."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo

from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.quantities import AsList, Coordinate, Vector3
from rigidcli.fields.section import environment

# A simplex or polygon of less area or volume than this, in units of its size squared or cubed, is flat.
DEGENERATE = 1e-13
PLANAR_TOLERANCE = 1e-9  # how far vertices may lie off their common plane, in units of the polygon's size


def simplex_measure(vertices: Array, n: Arithmetic) -> Scalar:
    """Area (m^2) of a triangle (3 by 3), or volume (m^3) of a tetrahedron (4 by 3); 0 if it is flat."""
    edges = vertices[1:] - vertices[0]
    normal = np.cross(edges[0], edges[1])
    if len(edges) == 2:
        measure = n.hypot(*normal) / 2
    else:
        signed = normal @ edges[2]
        measure = n.sqrt(n.tidied(signed**2)) / 6 if n.exact else abs(signed) / 6
    if not n.exact and measure <= DEGENERATE * np.abs(edges).max() ** len(edges):
        return 0.0
    return measure


def simplex_moments(vertices: Array) -> tuple[Array, Array]:
    """Centre (3, m) and mean r r^T about it (3 by 3, m^2) of a triangle or tetrahedron (k by 3).

    For k vertices at d_i from the centre the mean is sum d_i d_i^T / (k (k + 1)).
    """
    count, offset = len(vertices), vertices - vertices[0]
    centre = offset.sum(axis=0) / count
    offset = offset - centre
    return vertices[0] + centre, (offset.T @ offset) / (count * (count + 1))


def in_simplex(vertices: Floats, points: Floats) -> Mask:
    """Which of the points (3 by n, m) lie in the tetrahedron (4 by 3, m)."""
    weights = np.linalg.solve((vertices[1:] - vertices[0]).T, points - vertices[0][:, None])
    return np.asarray((weights >= 0).all(axis=0) & (weights.sum(axis=0) <= 1))


def polygon(vertices: Array, n: Arithmetic) -> tuple[Scalar, Array, Array]:
    """Area (m^2), centre (3, m) and mean r r^T about it (3 by 3, m^2) of a plane polygon (k by 3, m).

    The polygon is a fan of triangles with signed areas, which also serves where it is not convex.
    """
    size = 1 if n.exact else float(np.abs(vertices - vertices[0]).max())
    offsets = (vertices - vertices[0]) / size
    area, weights = _shares(offsets, _fan(vertices), n)
    moments = [simplex_moments(offsets[list(corners)]) for corners in _fan(vertices)]
    centre = weights @ np.array([third for third, _ in moments])
    second = sum(
        weight * (spread + np.outer(third - centre, third - centre))
        for weight, (third, spread) in zip(weights, moments, strict=True)
    )
    return area * size**2, vertices[0] + centre * size, np.asarray(second) * size**2


def triangles(vertices: Array, n: Arithmetic) -> tuple[Array, Array]:
    """A plane polygon (k by 3, m) as triangles (k - 2 by 3 by 3, m) that do not overlap, and their areas.

    Ears are cut off one by one (G. Meisters, Am. Math. Monthly 82 (1975) 648). Vertices that hang on symbols
    without a value make a fan, whose areas may be negative: this serves for polynomials only.
    """
    values = [n.value(coordinate) for coordinate in vertices.flat]
    corners = _fan(vertices)
    if None not in values:
        points = np.array(values, dtype=np.float64).reshape(vertices.shape)
        turn, origin = plane_of(points)
        corners = _ears(((points - origin) @ turn)[:, :2])
    area, weights = _shares(vertices, corners, n)
    return vertices[np.array(corners)], area * weights


def _fan(vertices: Array) -> list[tuple[int, int, int]]:
    return [(0, k, k + 1) for k in range(1, len(vertices) - 1)]


def _shares(vertices: Array, corners: Sequence[Sequence[int]], n: Arithmetic) -> tuple[Scalar, Array]:
    """The area of a plane polygon (m^2), and each triangle's share of it, negative if wound the other way."""
    a, b, c = vertices[np.array(corners).T]
    areas = np.cross(b - a, c - a)
    normal = areas.sum(axis=0)
    return n.hypot(*normal) / 2, (areas @ normal) / (normal @ normal)


def _ears(outline: Floats) -> list[tuple[int, int, int]]:
    """The triangles, by their vertices, that are cut off a simple polygon (k by 2) one after another."""
    left, ears = list(range(len(outline))), []
    turning = np.sign(_sides(outline[:-1], outline[1:], outline[0]).sum())
    small = DEGENERATE * np.ptp(outline, axis=0).max() ** 2

    def is_ear(place: int) -> bool:
        """Whether the corner can be cut off; one that is flat can, too."""
        a, b, c = (outline[left[k % len(left)]] for k in (place - 1, place, place + 1))
        others = outline[[left[(place + k) % len(left)] for k in range(2, len(left) - 1)]]
        beside = [turning * _sides(p, q, others) < -small for p, q in ((a, b), (b, c), (c, a))]
        return bool(turning * _sides(a, b, c) >= -small and np.any(beside, axis=0).all())

    while len(left) > 3:
        place = next((k for k in range(len(left)) if is_ear(k)), None)
        if place is None:
            raise ComputationError("the polygon has nearly coincident edges")
        ears.append((left[place - 1], left[place], left[(place + 1) % len(left)]))
        del left[place]
    return [*ears, (left[0], left[1], left[2])]


def _sides(a: Floats, b: Floats, points: Floats) -> Floats:
    """Twice the signed areas of the triangles (a, b, point), positive for points to the left of a to b."""
    along, away = b - a, points - a
    return np.asarray(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])


def plane_of(vertices: Array) -> tuple[Array, Array]:
    """Rotation and displacement (3, m) from z = 0 to a polygon (k by 3). Raises ValueProblem for a line."""
    spokes = vertices - vertices[0]
    spokes = spokes / np.linalg.norm(spokes, axis=1).max()
    first = spokes[np.argmax((spokes**2).sum(axis=1))]
    second = spokes[np.argmax((np.cross(first, spokes) ** 2).sum(axis=1))]
    axes, lengths = np.linalg.qr(np.array([first, second]).T)
    if abs(lengths[1, 1]) <= DEGENERATE:
        raise ValueProblem("the vertices lie on a line")
    x, y = (axes * np.sign(lengths.diagonal())).T
    return np.array([x, y, np.cross(x, y)]).T, vertices[0]


def in_polygon(outline: Floats, x: Floats, y: Floats) -> Mask:
    """Which points lie in the plane polygon `outline` (k by 2): an odd number of edges is to their right."""
    inside = np.zeros(np.shape(x), dtype=bool)
    for (x1, y1), (x2, y2) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if y1 != y2:
            inside ^= ((y1 > y) != (y2 > y)) & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside


def require_simple_polygon(vertices: Array, n: Arithmetic) -> None:
    """Raise ValueProblem unless the polygon (k by 3) is plane, has an area and does not cross itself.

    Nothing is said of vertices whose shape, not only its scale, depends on symbols without a value.
    """
    offsets = vertices - vertices[0]
    if n.exact:
        # In units of one of the coordinates, a scale without a value drops out.
        unit = next((offset for offset in offsets.flat if n.sign(offset) != 0), 1)
        offsets = n.tidy(offsets / unit)
    values = [n.value(coordinate) for coordinate in offsets.flat]
    if None in values:
        return
    points = np.array(values, dtype=np.float64).reshape(vertices.shape)
    size = np.abs(points - points[0]).max()
    if size == 0:
        raise ValueProblem("the vertices are one point")
    _, foremost, places = np.unique(points, axis=0, return_index=True, return_inverse=True)
    earlier = foremost[places.ravel()]
    for vertex in np.flatnonzero(earlier != np.arange(len(points)))[:1]:
        raise ValueProblem(f"the vertices {earlier[vertex]} and {vertex} are one point (counted from 0)")
    turn, origin = plane_of(points)
    flat = (points - origin) @ turn / size
    off = np.abs(flat[:, 2]).max()
    if off > PLANAR_TOLERANCE:
        raise ValueProblem(f"the vertices are not in one plane: one is off by {off:.3g} of its size")
    for first, second in _crossings(flat[:, :2]):
        raise ValueProblem(f"the edges from vertex {first} and from vertex {second} meet (counted from 0)")


def _crossings(outline: Array) -> Iterator[tuple[int, int]]:
    """Edges of the closed outline (k by 2) that meet and are no neighbours, by their first vertices."""
    start, end, count = outline, np.roll(outline, -1, axis=0), len(outline)

    def side(a: Array, b: Array, c: Array) -> Array:
        area = _sides(a, b, c)
        return np.where(np.abs(area) < DEGENERATE, 0, np.sign(area))

    for i in range(count):
        others = np.arange(i + 2, count - (i == 0))
        a, b, c, d = start[i], end[i], start[others], end[others]
        straddle = (side(a, b, c) * side(a, b, d) <= 0) & (side(c, d, a) * side(c, d, b) <= 0)
        low, high = np.minimum(a, b), np.maximum(a, b)
        near = (np.minimum(c, d) <= high + DEGENERATE) & (np.maximum(c, d) >= low - DEGENERATE)
        yield from ((i, int(j)) for j in others[straddle & near.all(axis=-1)])


# --- vertices in a document


def _in_space(vertex: tuple[Scalar, ...]) -> tuple[Scalar, Scalar, Scalar]:
    x, y, *z = vertex
    return x, y, z[0] if z else 0 * x


def _opened(vertices: tuple[Any, ...]) -> tuple[Any, ...]:
    """The vertices without a last one that repeats the first, as in GeoJSON."""
    return vertices[:-1] if len(vertices) > 3 and vertices[-1] == vertices[0] else vertices


def _not_flat(vertices: tuple[Any, ...], info: ValidationInfo) -> tuple[Any, ...]:
    n = environment(info).arithmetic
    if n.sign(simplex_measure(n.array(vertices), n)) == 0:
        raise ValueProblem(f"the vertices lie {'on a line' if len(vertices) == 3 else 'in a plane'}")
    return vertices


def _simple(vertices: tuple[Any, ...], info: ValidationInfo) -> tuple[Any, ...]:
    n = environment(info).arithmetic
    require_simple_polygon(n.array(vertices), n)
    return vertices


Vertex = Annotated[
    tuple[Coordinate, ...], AsList, Field(min_length=2, max_length=3), AfterValidator(_in_space)
]
Triangle = Annotated[tuple[Vertex, Vertex, Vertex], AsList, AfterValidator(_not_flat)]
Tetrahedron = Annotated[tuple[Vector3, Vector3, Vector3, Vector3], AsList, AfterValidator(_not_flat)]
FlatVertex = Annotated[tuple[Coordinate, Coordinate], AsList, AfterValidator(_in_space)]
_CORNERS = AsList, Field(min_length=3, max_length=1000), AfterValidator(_opened), AfterValidator(_simple)
Outline = Annotated[(tuple[Vertex, ...], *_CORNERS)]
FlatOutline = Annotated[(tuple[FlatVertex, ...], *_CORNERS)]
