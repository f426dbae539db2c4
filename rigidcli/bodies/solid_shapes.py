"""Shapes that fill a volume, one class each: dimensions, anchors, and mass properties in closed form.

Second moments are means over the shape about its centre of mass, so that Ixx = M (<y^2> + <z^2>). Each
formula is a sum of terms of one sign wherever that can be: a thin tube or cap keeps its digits.
Source: J. L. Meriam, L. G. Kraige, Engineering Mechanics: Dynamics, table D/4, for the common
shapes; frustum, cap and capsule are integrated. Tests hold every formula against quadrature.
"""

# Annotations here are objects, not texts: pydantic reads them, for each shape those of all its bases anew.

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np

from rigidcli.bodies import charts, solids
from rigidcli.bodies.geometry import ORIGIN, Bounds, Geometry, powers, round_bounds
from rigidcli.bodies.shape import Hollow, Solid
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.errors import ValueProblem
from rigidcli.fields.quantities import AsList, Length, OptionalLength, Size2, Size3, Vector3


class Sphere(Solid):
    """A solid ball; origin at its centre."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(4 * n.pi * R**3 / 3, ORIGIN, 3 * [R**2 / 5], round_bounds(R, -R, R))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.ball(self.radius, n)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return x**2 + y**2 + z**2 <= self.radius**2


class HollowSphere(Solid, Hollow):
    """A ball with a concentric spherical hole; origin at its centre."""

    def geometry(self, n: Arithmetic) -> Geometry:
        R, r = self.outer_radius, self.inner_radius
        volume = 4 * n.pi * (R - r) * powers(R, r, 2) / 3
        spread = powers(R, r, 4) / (5 * powers(R, r, 2))
        return Geometry(volume, ORIGIN, 3 * [spread], round_bounds(R, -R, R))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.ball(self.outer_radius, n, self.inner_radius)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return self.is_between(x**2 + y**2 + z**2)


class Ellipsoid(Solid):
    """A solid ellipsoid; origin at its centre."""

    semi_axes: Size3

    def geometry(self, n: Arithmetic) -> Geometry:
        a, b, c = self.semi_axes
        bounds = (-a, a), (-b, b), (-c, c)
        return Geometry(4 * n.pi * a * b * c / 3, ORIGIN, [a**2 / 5, b**2 / 5, c**2 / 5], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.ball(1, n, stretch=self.semi_axes)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b, c = self.semi_axes
        return (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 <= 1


class Cone(Solid):
    """A circular cone opening to +z; origin at its apex."""

    ANCHORS: ClassVar = {"apex": lambda s: ORIGIN, "base": lambda s: (0, 0, s.height)}
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        second = [3 * R**2 / 20, 3 * R**2 / 20, 3 * h**2 / 80]
        return Geometry(n.pi * R**2 * h / 3, (0, 0, 3 * h / 4), second, round_bounds(R, 0, h))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.tapered(charts.sector(1, n), self.height, 0, self.radius)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 <= (self.radius * z / self.height) ** 2) & (z >= 0) & (z <= self.height)


class Frustum(Solid):
    """A cone cut parallel to its base, along +z; origin at the centre of the bottom."""

    ANCHORS: ClassVar = {"top": lambda s: (0, 0, s.height)}
    bottom_radius: OptionalLength
    top_radius: OptionalLength
    height: Length

    def check(self, n: Arithmetic) -> None:
        if n.sign(self.bottom_radius + self.top_radius) == 0:
            raise ValueProblem("`bottom_radius` and `top_radius` are both zero")

    def geometry(self, n: Arithmetic) -> Geometry:
        a, b, h = self.bottom_radius, self.top_radius, self.height
        s = powers(a, b, 2)
        centre = h * (a**2 + 2 * a * b + 3 * b**2) / (4 * s)
        across = 3 * powers(a, b, 4) / (20 * s)
        along = 3 * h**2 * (a**4 + 4 * a**3 * b + 10 * a**2 * b**2 + 4 * a * b**3 + b**4) / (80 * s**2)
        bounds = round_bounds(max(a, b, key=n.size), 0, h)
        return Geometry(n.pi * h * s / 3, (0, 0, centre), [across, across, along], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.tapered(charts.sector(1, n), self.height, self.bottom_radius, self.top_radius)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        radius = self.bottom_radius + (self.top_radius - self.bottom_radius) * z / self.height
        return (x**2 + y**2 <= radius**2) & (z >= 0) & (z <= self.height)


class Pyramid(Solid):
    """A right pyramid on a rectangle, apex at +z; origin at the centre of the base."""

    ANCHORS: ClassVar = {"apex": lambda s: (0, 0, s.height)}
    base: Size2
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        (x, y), h = self.base, self.height
        bounds = (-x / 2, x / 2), (-y / 2, y / 2), (0, h)
        return Geometry(x * y * h / 3, (0, 0, h / 4), [x**2 / 20, y**2 / 20, 3 * h**2 / 80], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.tapered(charts.block(*self.base, None), self.height, 1, 0)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        (a, b), scale = self.base, 1 - z / self.height
        return (abs(2 * x) <= a * scale) & (abs(2 * y) <= b * scale) & (z >= 0)


class Hemisphere(Solid):
    """A solid half ball bulging to +z; origin at the centre of the flat face."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        second = [R**2 / 5, R**2 / 5, 19 * R**2 / 320]
        return Geometry(2 * n.pi * R**3 / 3, (0, 0, 3 * R / 8), second, round_bounds(R, 0, R))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.ball(self.radius, n, quarters=1)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 + z**2 <= self.radius**2) & (z >= 0)


class SphericalCap(Solid):
    """What a plane cuts off a ball, on its +z side; origin at the centre of the ball."""

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

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.cap(self.radius, self.cap_height, n)]

    def bounds(self) -> Bounds:
        R, h = self.radius, self.cap_height
        widest = R if h >= R else (h * (2 * R - h)) ** 0.5
        return round_bounds(widest, R - h, R)

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (x**2 + y**2 + z**2 <= self.radius**2) & (z >= self.radius - self.cap_height)


class Capsule(Solid):
    """A cylinder along z of the given height with half balls on both ends; origin at its centre."""

    radius: Length
    height: OptionalLength

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        cylinder, balls = 3 * h / (3 * h + 4 * R), 4 * R / (3 * h + 4 * R)
        across = cylinder * R**2 / 4 + balls * R**2 / 5
        along = cylinder * h**2 / 12 + balls * (R**2 / 5 + 3 * R * h / 8 + h**2 / 4)
        bounds = round_bounds(R, -h / 2 - R, h / 2 + R)
        return Geometry(n.pi * R**2 * (3 * h + 4 * R) / 3, ORIGIN, [across, across, along], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        half = charts.ball(self.radius, n, quarters=1)
        ends = [charts.moved(half, side * self.height / 2, side) for side in (1, -1)]
        return [charts.prism(charts.sector(self.radius, n), self.height), *ends]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        beyond: Floats = np.maximum(abs(z) - self.height / 2, 0)
        return x**2 + y**2 + beyond**2 <= self.radius**2


class Torus(Solid):
    """A ring of circular section round z; origin at its centre."""

    CONVEX: ClassVar = False
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
        bounds = round_bounds(R + r, -r, r)
        return Geometry(2 * n.pi**2 * R * r**2, ORIGIN, [across, across, r**2 / 4], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.torus(self.major_radius, self.minor_radius, n)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return (np.hypot(x, y) - self.major_radius) ** 2 + z**2 <= self.minor_radius**2


class Tetrahedron(Solid):
    """A tetrahedron, its vertices as given."""

    vertices: Annotated[tuple[Vector3, Vector3, Vector3, Vector3], AsList]

    def check(self, n: Arithmetic) -> None:
        if n.sign(solids.simplex_measure(n.array(self.vertices), n)) == 0:
            raise ValueProblem("the vertices lie in a plane", path=("vertices",))

    def geometry(self, n: Arithmetic) -> Geometry:
        vertices = n.array(self.vertices)
        return Geometry(solids.simplex_measure(vertices, n), *solids.simplex_moments(vertices))

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.simplex(n.array(self.vertices), self.geometry(n).measure, n)]

    def bounds(self) -> Bounds:
        return solids.bounds(self.corners())

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        return solids.in_simplex(self.corners(), np.stack([x, y, z]))
