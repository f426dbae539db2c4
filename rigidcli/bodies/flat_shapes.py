"""Flat shapes, one class each. All else is as in `solid_shapes`."""

# Annotations here are objects, not texts: pydantic reads them, for each shape those of all its bases anew.

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field

from rigidcli.bodies import charts, solids
from rigidcli.bodies.geometry import ORIGIN, Bounds, Geometry, round_bounds
from rigidcli.bodies.shape import Hollow, Lamina
from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ValueProblem, at
from rigidcli.fields.quantities import AsList, Coordinate, Length, Size2


def _in_space(vertex: tuple[Scalar, ...]) -> tuple[Scalar, Scalar, Scalar]:
    x, y, *z = vertex
    return x, y, z[0] if z else 0 * x


Vertex = Annotated[
    tuple[Coordinate, ...], AsList, Field(min_length=2, max_length=3), AfterValidator(_in_space)
]


class Plate(Lamina):
    """A thin rectangle, normal along z; origin at its centre."""

    ANCHORS: ClassVar = {"corner": lambda s: (-s.size[0] / 2, -s.size[1] / 2, 0)}
    size: Size2

    def geometry(self, n: Arithmetic) -> Geometry:
        x, y = self.size[:2]  # a box, of which it is the section, has three sides
        bounds = (-x / 2, x / 2), (-y / 2, y / 2), (0, 0)
        return Geometry(x * y, ORIGIN, [x**2 / 12, y**2 / 12, 0], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.block(*self.size[:2], None)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b = self.size[:2]
        return (abs(2 * x) <= a) & (abs(2 * y) <= b)


class Disk(Lamina):
    """A thin disk, normal along z; origin at its centre."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(n.pi * R**2, ORIGIN, [R**2 / 4, R**2 / 4, 0], round_bounds(R, 0, 0))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.sector(self.radius, n)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return x**2 + y**2 <= self.radius**2


class Annulus(Lamina, Hollow):
    """A thin disk with a concentric hole, normal along z; origin at its centre."""

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r = self.outer_radius, self.inner_radius
        across = (R**2 + r**2) / 4
        return Geometry(n.pi * (R - r) * (R + r), ORIGIN, [across, across, 0], round_bounds(R, 0, 0))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.sector(self.outer_radius, n, self.inner_radius)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return self.is_between(x**2 + y**2)


class HalfDisk(Lamina):
    """The half y >= 0 of a thin disk, normal along z; origin at the centre of the straight edge."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        along = R**2 * (9 * n.pi**2 - 64) / (36 * n.pi**2)
        bounds = (-R, R), (0, R), (0, 0)
        return Geometry(n.pi * R**2 / 2, (0, 4 * R / (3 * n.pi), 0), [R**2 / 4, along, 0], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.sector(self.radius, n, quarters=2)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= self.radius**2) & (y >= 0)


class _Flat(Lamina):
    """A lamina given by its vertices, in a plane of its own."""

    vertices: tuple[tuple[Scalar, ...], ...]

    def plane(self) -> tuple[Array, Array]:
        return solids.plane_of(self.corners())

    def faces(self) -> list[Floats]:
        return [self.corners()]

    def _outline(self) -> Array:
        turn, origin = self.plane()
        return ((self.corners() - origin) @ turn)[:, :2]

    def bounds(self) -> Bounds:
        outline = self._outline()
        (x, y), (X, Y) = outline.min(axis=0), outline.max(axis=0)
        return (x, X), (y, Y), (0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return solids.in_polygon(self._outline(), x, y)


class Triangle(_Flat):
    """A thin triangle, its vertices as given, in space or (two coordinates) in the plane z = 0."""

    vertices: Annotated[tuple[Vertex, Vertex, Vertex], AsList]

    def check(self, n: Arithmetic) -> None:
        if n.sign(solids.simplex_measure(n.array(self.vertices), n)) == 0:
            raise ValueProblem("the vertices lie on a line", path=("vertices",))

    def geometry(self, n: Arithmetic) -> Geometry:
        vertices = n.array(self.vertices)
        return Geometry(solids.simplex_measure(vertices, n), *solids.simplex_moments(vertices))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.simplex(n.array(self.vertices), self.geometry(n).measure, n)]


def _opened(vertices: tuple[Any, ...]) -> tuple[Any, ...]:
    """The vertices without a last one that repeats the first, as in GeoJSON."""
    return vertices[:-1] if len(vertices) > 3 and vertices[-1] == vertices[0] else vertices


class Polygon(_Flat):
    """A thin plane polygon without crossings, its vertices in order, in space or in the plane z = 0."""

    CONVEX: ClassVar = False
    vertices: Annotated[
        tuple[Vertex, ...], AsList, Field(min_length=3, max_length=1000), AfterValidator(_opened)
    ]

    def check(self, n: Arithmetic) -> None:
        with at("vertices"):
            solids.require_simple_polygon(n.array(self.vertices), n)

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(*solids.polygon(n.array(self.vertices), n))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        parts = zip(*solids.triangles(n.array(self.vertices), n), strict=True)
        return [charts.simplex(vertices, area, n) for vertices, area in parts]
