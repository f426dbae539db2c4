"""The shapes, one class each: dimensions, anchors, and mass properties in closed form.

Second moments are means over the shape about its centre of mass, so that Ixx = M (<y^2> + <z^2>). Each
formula is a sum of terms of one sign wherever that can be: a thin tube or cap keeps its digits.
Sources: J. L. Meriam, L. G. Kraige, Engineering Mechanics: Dynamics, table D/4, for the common shapes;
the others are integrals of the indicator `contains`, by which every formula is tested.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from rigidcli.core import solids
from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ValueProblem
from rigidcli.model.base import AsList, Coordinate, Length, OptionalLength, Vector3
from rigidcli.model.shape import Bounds, Geometry, Lamina, Shape, Shell, Solid, Wire

Size2 = Annotated[tuple[Length, Length], AsList]
Size3 = Annotated[tuple[Length, Length, Length], AsList]


def _in_space(vertex: tuple[Scalar, ...]) -> tuple[Scalar, Scalar, Scalar]:
    x, y, *z = vertex
    return x, y, z[0] if z else 0 * x


Vertex = Annotated[
    tuple[Coordinate, ...], AsList, Field(min_length=2, max_length=3), AfterValidator(_in_space)
]

ORIGIN = (0, 0, 0)


def _require_less(n: Arithmetic, small: Scalar, large: Scalar, key: str, limit: str) -> None:
    if n.sign(large - small) in (0, -1):
        raise ValueProblem(f"read {n.size(small):.6g} m, expected less than {limit}", path=(key,))


def _round(radius: float, low: float, high: float) -> Bounds:
    """Bounds of what is round about z."""
    return (-radius, radius), (-radius, radius), (low, high)


def _powers(a: Scalar, b: Scalar, degree: int) -> Scalar:
    """a^n + a^(n-1) b + ... + b^n, which is (a^(n+1) - b^(n+1)) / (a - b) without cancellation."""
    return sum(a ** (degree - k) * b**k for k in range(degree + 1))


class Box(Solid):
    """A rectangular block; origin at its centre."""

    ANCHORS: ClassVar = {"corner": lambda s: tuple(-side / 2 for side in s.size)}
    shape: Literal["box"]
    size: Size3

    def geometry(self, n: Arithmetic) -> Geometry:
        x, y, z = self.size
        return Geometry(x * y * z, ORIGIN, [side**2 / 12 for side in self.size])

    def bounds(self) -> Bounds:
        x, y, z = (side / 2 for side in self.size)
        return (-x, x), (-y, y), (-z, z)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b, c = self.size
        return (abs(2 * x) <= a) & (abs(2 * y) <= b) & (abs(2 * z) <= c)


class Cube(Solid):
    """A cube; origin at its centre."""

    ANCHORS: ClassVar = {"corner": lambda s: 3 * (-s.side / 2,)}
    shape: Literal["cube"]
    side: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(self.side**3, ORIGIN, 3 * [self.side**2 / 12])

    def bounds(self) -> Bounds:
        return _round(self.side / 2, -self.side / 2, self.side / 2)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (abs(2 * x) <= self.side) & (abs(2 * y) <= self.side) & (abs(2 * z) <= self.side)


class Sphere(Solid):
    """A solid ball; origin at its centre."""

    shape: Literal["sphere"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(4 * n.pi * self.radius**3 / 3, ORIGIN, 3 * [self.radius**2 / 5])

    def bounds(self) -> Bounds:
        return _round(self.radius, -self.radius, self.radius)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return x**2 + y**2 + z**2 <= self.radius**2


class HollowSphere(Solid):
    """A ball with a concentric spherical hole; origin at its centre."""

    shape: Literal["hollow_sphere"]
    outer_radius: Length
    inner_radius: OptionalLength

    def check(self, n: Arithmetic) -> None:
        _require_less(n, self.inner_radius, self.outer_radius, "inner_radius", "outer_radius")

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r = self.outer_radius, self.inner_radius
        volume = 4 * n.pi * (R - r) * _powers(R, r, 2) / 3
        return Geometry(volume, ORIGIN, 3 * [_powers(R, r, 4) / (5 * _powers(R, r, 2))])

    def bounds(self) -> Bounds:
        return _round(self.outer_radius, -self.outer_radius, self.outer_radius)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        square = x**2 + y**2 + z**2
        return (square <= self.outer_radius**2) & (square >= self.inner_radius**2)


class Ellipsoid(Solid):
    """A solid ellipsoid; origin at its centre."""

    shape: Literal["ellipsoid"]
    semi_axes: Size3

    def geometry(self, n: Arithmetic) -> Geometry:
        a, b, c = self.semi_axes
        return Geometry(4 * n.pi * a * b * c / 3, ORIGIN, [axis**2 / 5 for axis in self.semi_axes])

    def bounds(self) -> Bounds:
        a, b, c = self.semi_axes
        return (-a, a), (-b, b), (-c, c)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b, c = self.semi_axes
        return (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 <= 1


class Cylinder(Solid):
    """A circular cylinder along z; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    shape: Literal["cylinder"]
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        return Geometry(n.pi * R**2 * h, ORIGIN, [R**2 / 4, R**2 / 4, h**2 / 12])

    def bounds(self) -> Bounds:
        return _round(self.radius, -self.height / 2, self.height / 2)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= self.radius**2) & (abs(z) <= self.height / 2)


class Tube(Solid):
    """A cylinder along z with a coaxial hole; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    shape: Literal["tube"]
    outer_radius: Length
    inner_radius: OptionalLength
    height: Length

    def check(self, n: Arithmetic) -> None:
        _require_less(n, self.inner_radius, self.outer_radius, "inner_radius", "outer_radius")

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r, h = self.outer_radius, self.inner_radius, self.height
        across = (R**2 + r**2) / 4
        return Geometry(n.pi * (R - r) * (R + r) * h, ORIGIN, [across, across, h**2 / 12])

    def bounds(self) -> Bounds:
        return _round(self.outer_radius, -self.height / 2, self.height / 2)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        square = x**2 + y**2
        ring = (square <= self.outer_radius**2) & (square >= self.inner_radius**2)
        return ring & (abs(z) <= self.height / 2)


class EllipticCylinder(Solid):
    """A cylinder along z on an ellipse; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    shape: Literal["elliptic_cylinder"]
    semi_axes: Size2
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        (a, b), h = self.semi_axes, self.height
        return Geometry(n.pi * a * b * h, ORIGIN, [a**2 / 4, b**2 / 4, h**2 / 12])

    def bounds(self) -> Bounds:
        (a, b), h = self.semi_axes, self.height
        return (-a, a), (-b, b), (-h / 2, h / 2)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b = self.semi_axes
        return ((x / a) ** 2 + (y / b) ** 2 <= 1) & (abs(z) <= self.height / 2)


class HalfCylinder(Solid):
    """The half y >= 0 of a cylinder along z; origin at the centre of the flat face."""

    shape: Literal["half_cylinder"]
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        y, along = _half_disk(n, R)
        return Geometry(n.pi * R**2 * h / 2, (0, y, 0), [R**2 / 4, along, h**2 / 12])

    def bounds(self) -> Bounds:
        R, h = self.radius, self.height
        return (-R, R), (0, R), (-h / 2, h / 2)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= self.radius**2) & (y >= 0) & (abs(z) <= self.height / 2)


def _half_disk(n: Arithmetic, radius: Scalar) -> tuple[Scalar, Scalar]:
    """Height of the centre of mass over the straight edge, and mean square distance from there."""
    return 4 * radius / (3 * n.pi), radius**2 * (9 * n.pi**2 - 64) / (36 * n.pi**2)


class Cone(Solid):
    """A circular cone opening to +z; origin at its apex."""

    ANCHORS: ClassVar = {"apex": lambda s: ORIGIN, "base": lambda s: (0, 0, s.height)}
    shape: Literal["cone"]
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        across = 3 * R**2 / 20
        return Geometry(n.pi * R**2 * h / 3, (0, 0, 3 * h / 4), [across, across, 3 * h**2 / 80])

    def bounds(self) -> Bounds:
        return _round(self.radius, 0, self.height)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= (self.radius * z / self.height) ** 2) & (z >= 0) & (z <= self.height)


class Frustum(Solid):
    """A cone cut parallel to its base, along +z; origin at the centre of the bottom."""

    ANCHORS: ClassVar = {"top": lambda s: (0, 0, s.height)}
    shape: Literal["frustum"]
    bottom_radius: OptionalLength
    top_radius: OptionalLength
    height: Length

    def check(self, n: Arithmetic) -> None:
        if n.sign(self.bottom_radius + self.top_radius) == 0:
            raise ValueProblem("`bottom_radius` and `top_radius` are both zero")

    def geometry(self, n: Arithmetic) -> Geometry:
        a, b, h = self.bottom_radius, self.top_radius, self.height
        s = _powers(a, b, 2)
        centre = h * (a**2 + 2 * a * b + 3 * b**2) / (4 * s)
        across = 3 * _powers(a, b, 4) / (20 * s)
        along = 3 * h**2 * (a**4 + 4 * a**3 * b + 10 * a**2 * b**2 + 4 * a * b**3 + b**4) / (80 * s**2)
        return Geometry(n.pi * h * s / 3, (0, 0, centre), [across, across, along])

    def bounds(self) -> Bounds:
        return _round(max(self.bottom_radius, self.top_radius), 0, self.height)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        radius = self.bottom_radius + (self.top_radius - self.bottom_radius) * z / self.height
        return (x**2 + y**2 <= radius**2) & (z >= 0) & (z <= self.height)


class Pyramid(Solid):
    """A right pyramid on a rectangle, apex at +z; origin at the centre of the base."""

    ANCHORS: ClassVar = {"apex": lambda s: (0, 0, s.height)}
    shape: Literal["pyramid"]
    base: Size2
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        (x, y), h = self.base, self.height
        return Geometry(x * y * h / 3, (0, 0, h / 4), [x**2 / 20, y**2 / 20, 3 * h**2 / 80])

    def bounds(self) -> Bounds:
        (x, y), h = self.base, self.height
        return (-x / 2, x / 2), (-y / 2, y / 2), (0, h)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        (a, b), scale = self.base, 1 - z / self.height
        return (abs(2 * x) <= a * scale) & (abs(2 * y) <= b * scale) & (z >= 0)


class Hemisphere(Solid):
    """A solid half ball bulging to +z; origin at the centre of the flat face."""

    shape: Literal["hemisphere"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(2 * n.pi * R**3 / 3, (0, 0, 3 * R / 8), [R**2 / 5, R**2 / 5, 19 * R**2 / 320])

    def bounds(self) -> Bounds:
        return _round(self.radius, 0, self.radius)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 + z**2 <= self.radius**2) & (z >= 0)


class SphericalCap(Solid):
    """What a plane cuts off a ball, on its +z side; origin at the centre of the ball."""

    shape: Literal["spherical_cap"]
    radius: Length
    cap_height: Length

    def check(self, n: Arithmetic) -> None:
        if n.sign(2 * self.radius - self.cap_height) == -1:
            raise ValueProblem(
                f"read {n.size(self.cap_height):.6g} m, expected at most twice the radius",
                path=("cap_height",),
            )

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.cap_height
        rest = 3 * R - h
        across = h * (20 * R**2 - 15 * R * h + 3 * h**2) / (20 * rest)
        along = h**2 * (40 * R**2 - 24 * R * h + 3 * h**2) / (80 * rest**2)
        centre = 3 * (2 * R - h) ** 2 / (4 * rest)
        return Geometry(n.pi * h**2 * rest / 3, (0, 0, centre), [across, across, along])

    def bounds(self) -> Bounds:
        R, h = self.radius, self.cap_height
        widest = R if h >= R else (h * (2 * R - h)) ** 0.5
        return _round(widest, R - h, R)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 + z**2 <= self.radius**2) & (z >= self.radius - self.cap_height)


class Capsule(Solid):
    """A cylinder along z of the given height with half balls on both ends; origin at its centre."""

    shape: Literal["capsule"]
    radius: Length
    height: OptionalLength

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        cylinder, balls = 3 * h / (3 * h + 4 * R), 4 * R / (3 * h + 4 * R)
        across = cylinder * R**2 / 4 + balls * R**2 / 5
        along = cylinder * h**2 / 12 + balls * (R**2 / 5 + 3 * R * h / 8 + h**2 / 4)
        return Geometry(n.pi * R**2 * (3 * h + 4 * R) / 3, ORIGIN, [across, across, along])

    def bounds(self) -> Bounds:
        return _round(self.radius, -self.height / 2 - self.radius, self.height / 2 + self.radius)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        beyond: Floats = np.maximum(abs(z) - self.height / 2, 0)
        return x**2 + y**2 + beyond**2 <= self.radius**2


class Torus(Solid):
    """A ring of circular section round z; origin at its centre."""

    shape: Literal["torus"]
    major_radius: Length
    minor_radius: Length

    def check(self, n: Arithmetic) -> None:
        if n.sign(self.major_radius - self.minor_radius) == -1:
            raise ValueProblem(
                f"read {n.size(self.minor_radius):.6g} m, expected at most major_radius",
                path=("minor_radius",),
                hint="a spindle torus passes through itself and is no body",
            )

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r = self.major_radius, self.minor_radius
        across = R**2 / 2 + 3 * r**2 / 8
        return Geometry(2 * n.pi**2 * R * r**2, ORIGIN, [across, across, r**2 / 4])

    def bounds(self) -> Bounds:
        return _round(self.major_radius + self.minor_radius, -self.minor_radius, self.minor_radius)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (np.hypot(x, y) - self.major_radius) ** 2 + z**2 <= self.minor_radius**2


class Tetrahedron(Solid):
    """A tetrahedron, its vertices as given."""

    shape: Literal["tetrahedron"]
    vertices: Annotated[tuple[Vector3, Vector3, Vector3, Vector3], AsList]

    def check(self, n: Arithmetic) -> None:
        if n.sign(solids.simplex_measure(n.array(self.vertices), n)) == 0:
            raise ValueProblem("the vertices lie in a plane", path=("vertices",))

    def geometry(self, n: Arithmetic) -> Geometry:
        vertices = n.array(self.vertices)
        return Geometry(solids.simplex_measure(vertices, n), *solids.simplex_moments(vertices))

    def bounds(self) -> Bounds:
        return solids.bounds(np.array(self.vertices))

    def corners(self) -> Floats:
        return np.array(self.vertices, dtype=np.float64).T

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return solids.in_simplex(np.array(self.vertices, dtype=np.float64), np.stack([x, y, z]))


class SphericalShell(Shell):
    """A thin sphere; origin at its centre."""

    shape: Literal["spherical_shell"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(4 * n.pi * self.radius**2, ORIGIN, 3 * [self.radius**2 / 3])


class HemisphericalShell(Shell):
    """A thin half sphere bulging to +z; origin at the centre of its rim."""

    shape: Literal["hemispherical_shell"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(2 * n.pi * R**2, (0, 0, R / 2), [R**2 / 3, R**2 / 3, R**2 / 12])


class CylindricalShell(Shell):
    """A thin cylinder along z, open at both ends; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    shape: Literal["cylindrical_shell"]
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        return Geometry(2 * n.pi * R * h, ORIGIN, [R**2 / 2, R**2 / 2, h**2 / 12])


class ConicalShell(Shell):
    """The thin lateral surface of a cone opening to +z; origin at its apex."""

    ANCHORS: ClassVar = {"apex": lambda s: ORIGIN, "base": lambda s: (0, 0, s.height)}
    shape: Literal["conical_shell"]
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        area = n.pi * R * n.hypot(R, h)
        return Geometry(area, (0, 0, 2 * h / 3), [R**2 / 4, R**2 / 4, h**2 / 18])


class Plate(Lamina):
    """A thin rectangle, normal along z; origin at its centre."""

    ANCHORS: ClassVar = {"corner": lambda s: (-s.size[0] / 2, -s.size[1] / 2, 0)}
    shape: Literal["plate"]
    size: Size2

    def geometry(self, n: Arithmetic) -> Geometry:
        x, y = self.size
        return Geometry(x * y, ORIGIN, [x**2 / 12, y**2 / 12, 0])

    def bounds(self) -> Bounds:
        x, y = self.size
        return (-x / 2, x / 2), (-y / 2, y / 2), (0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b = self.size
        return (abs(2 * x) <= a) & (abs(2 * y) <= b)


class Disk(Lamina):
    """A thin disk, normal along z; origin at its centre."""

    shape: Literal["disk"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(n.pi * R**2, ORIGIN, [R**2 / 4, R**2 / 4, 0])

    def bounds(self) -> Bounds:
        return _round(self.radius, 0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return x**2 + y**2 <= self.radius**2


class Annulus(Lamina):
    """A thin disk with a concentric hole, normal along z; origin at its centre."""

    shape: Literal["annulus"]
    outer_radius: Length
    inner_radius: OptionalLength

    def check(self, n: Arithmetic) -> None:
        _require_less(n, self.inner_radius, self.outer_radius, "inner_radius", "outer_radius")

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r = self.outer_radius, self.inner_radius
        across = (R**2 + r**2) / 4
        return Geometry(n.pi * (R - r) * (R + r), ORIGIN, [across, across, 0])

    def bounds(self) -> Bounds:
        return _round(self.outer_radius, 0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        square = x**2 + y**2
        return (square <= self.outer_radius**2) & (square >= self.inner_radius**2)


class HalfDisk(Lamina):
    """The half y >= 0 of a thin disk, normal along z; origin at the centre of the straight edge."""

    shape: Literal["half_disk"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        y, along = _half_disk(n, R)
        return Geometry(n.pi * R**2 / 2, (0, y, 0), [R**2 / 4, along, 0])

    def bounds(self) -> Bounds:
        return (-self.radius, self.radius), (0, self.radius), (0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= self.radius**2) & (y >= 0)


class _Flat(Lamina):
    """A lamina given by its vertices, in a plane of its own."""

    vertices: tuple[tuple[Scalar, ...], ...]

    def plane(self) -> tuple[Array, Array]:
        return solids.plane_of(np.array(self.vertices, dtype=np.float64))

    def heart(self) -> Floats:
        turn, origin = self.plane()
        centre: Floats = (super().heart() - origin) @ turn
        return centre

    def corners(self) -> Floats:
        turn, origin = self.plane()
        corners: Floats = ((np.array(self.vertices, dtype=np.float64) - origin) @ turn).T
        return corners

    def _outline(self) -> Array:
        return self.corners()[:2].T

    def bounds(self) -> Bounds:
        outline = self._outline()
        (x, y), (X, Y) = outline.min(axis=0), outline.max(axis=0)
        return (x, X), (y, Y), (0, 0)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return solids.in_polygon(self._outline(), x, y)


class Triangle(_Flat):
    """A thin triangle, its vertices as given, in space or (two coordinates) in the plane z = 0."""

    shape: Literal["triangle"]
    vertices: Annotated[tuple[Vertex, Vertex, Vertex], AsList]

    def check(self, n: Arithmetic) -> None:
        if n.sign(solids.simplex_measure(n.array(self.vertices), n)) == 0:
            raise ValueProblem("the vertices lie on a line", path=("vertices",))

    def geometry(self, n: Arithmetic) -> Geometry:
        vertices = n.array(self.vertices)
        return Geometry(solids.simplex_measure(vertices, n), *solids.simplex_moments(vertices))


class Polygon(_Flat):
    """A thin plane polygon without crossings, its vertices in order, in space or in the plane z = 0."""

    shape: Literal["polygon"]
    vertices: Annotated[tuple[Vertex, ...], AsList, Field(min_length=3, max_length=1000)]

    def check(self, n: Arithmetic) -> None:
        try:
            solids.require_simple_polygon(n.array(self.vertices), n)
        except ValueProblem as problem:
            raise problem.below("vertices") from None

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(*solids.polygon(n.array(self.vertices), n))


class Rod(Wire):
    """A thin straight rod along z; origin at its centre."""

    ANCHORS: ClassVar = {"end": lambda s: (0, 0, -s.length / 2)}
    shape: Literal["rod"]
    length: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(self.length, ORIGIN, [0, 0, self.length**2 / 12])


class Ring(Wire):
    """A thin circular ring, normal along z; origin at its centre."""

    shape: Literal["ring"]
    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(2 * n.pi * R, ORIGIN, [R**2 / 2, R**2 / 2, 0])


SHAPES: dict[str, type[Shape]] = {
    "box": Box,
    "cube": Cube,
    "sphere": Sphere,
    "hollow_sphere": HollowSphere,
    "ellipsoid": Ellipsoid,
    "cylinder": Cylinder,
    "tube": Tube,
    "elliptic_cylinder": EllipticCylinder,
    "half_cylinder": HalfCylinder,
    "cone": Cone,
    "frustum": Frustum,
    "pyramid": Pyramid,
    "hemisphere": Hemisphere,
    "spherical_cap": SphericalCap,
    "capsule": Capsule,
    "torus": Torus,
    "tetrahedron": Tetrahedron,
    "spherical_shell": SphericalShell,
    "hemispherical_shell": HemisphericalShell,
    "cylindrical_shell": CylindricalShell,
    "conical_shell": ConicalShell,
    "plate": Plate,
    "disk": Disk,
    "annulus": Annulus,
    "half_disk": HalfDisk,
    "triangle": Triangle,
    "polygon": Polygon,
    "rod": Rod,
    "ring": Ring,
}
