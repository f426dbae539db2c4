"""The shapes: a function for each, from its dimensions to its mass properties in closed form and its points.

The parameters after the first are the keys of a document, their types the numbers that may stand there, and
the first line of the docstring is the description of the shape.

Second moments are means over the shape about its centre of mass, so that Ixx = M (<y^2> + <z^2>). Each
formula is a sum of terms of one sign wherever that can be: a thin tube or cap keeps its digits.
Source: J. L. Meriam, L. G. Kraige, Engineering Mechanics: Dynamics, table D/4, for the common
shapes; frustum, cap and capsule are integrated. Tests hold every formula against quadrature.
"""

# Annotations here are objects, not texts: the dimensions of a section are made of them.

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidcli.bodies import charts, solids
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask, Scalar
from rigidcli.errors import ValueProblem
from rigidcli.fields.quantities import Length, OptionalLength, Size2, Size3


class Geometry(NamedTuple):
    """The measure, the centre of mass and the spread of a shape with a uniform density, in its own axes.

    `measure` is the volume (m^3), area (m^2) or length (m); `centre` is (x, y, z) in m from the natural
    origin; `second` holds the means of x^2, y^2, z^2 about the centre (m^2), or of all of r r^T
    (3 by 3) where local axes are not principal.
    """

    measure: Scalar
    centre: Any
    second: Any


class Figure(NamedTuple):
    """A shape of given dimensions, as functions that are called when their values are needed.

    `contains` says which points (x, y, z in m, floats) a solid or flat shape fills, its surface included.
    `corners` (k by 3, m) are given for a flat shape in a plane of its own, which is z = 0 to `contains`.
    """

    geometry: Callable[[], Geometry]
    charts: Callable[[], Sequence[charts.Chart]]
    contains: Callable[[Floats, Floats, Floats], Mask] | None = None
    corners: Callable[[], Floats] | None = None


ORIGIN = (0, 0, 0)  # the centre of a shape that is symmetric about its natural origin


def _powers(a: Scalar, b: Scalar, degree: int) -> Scalar:
    """a^n + a^(n-1) b + ... + b^n, which is (a^(n+1) - b^(n+1)) / (a - b) without cancellation."""
    return sum(a ** (degree - k) * b**k for k in range(degree + 1))


def _read(length: Scalar, n: Arithmetic) -> str:
    """A length in a message: its number, or its letters."""
    number = n.value(length)
    return f"read `{length}`" if number is None else f"read {number:.6g} m"


def _require_material(n: Arithmetic, outer: Scalar, inner: Scalar) -> None:
    if n.sign(outer - inner) in (0, -1):
        message = f"{_read(inner, n)}, expected less than outer_radius"
        raise ValueProblem(message, path=("inner_radius",))


# --- flat shapes


def plate(n: Arithmetic, size: Size2) -> Figure:
    """A thin rectangle, normal along z; origin at its centre."""
    x, y = size
    return Figure(
        lambda: Geometry(x * y, ORIGIN, [x**2 / 12, y**2 / 12, 0]),
        lambda: [charts.block(x, y, None)],
        lambda X, Y, Z: (abs(2 * X) <= x) & (abs(2 * Y) <= y),
    )


def disk(n: Arithmetic, radius: Length) -> Figure:
    """A thin disk, normal along z; origin at its centre."""
    return annulus(n, radius, 0)


def annulus(n: Arithmetic, outer_radius: Length, inner_radius: OptionalLength) -> Figure:
    """A thin disk with a concentric hole, normal along z; origin at its centre."""
    R, r = outer_radius, inner_radius
    _require_material(n, R, r)
    across = (R**2 + r**2) / 4
    return Figure(
        lambda: Geometry(n.pi * ((R - r) * (R + r)), ORIGIN, [across, across, 0]),
        lambda: [charts.sector(R, n, r)],
        lambda x, y, z: (x**2 + y**2 <= R**2) & (x**2 + y**2 >= r**2),
    )


def half_disk(n: Arithmetic, radius: Length) -> Figure:
    """The half y >= 0 of a thin disk, normal along z; origin at the centre of the straight edge."""
    R = radius
    along = R**2 * (9 * n.pi**2 - 64) / (36 * n.pi**2)
    return Figure(
        lambda: Geometry(n.pi * R**2 / 2, (0, 4 * R / (3 * n.pi), 0), [R**2 / 4, along, 0]),
        lambda: [charts.sector(R, n, quarters=2)],
        lambda x, y, z: (x**2 + y**2 <= R**2) & (y >= 0),
    )


def triangle(n: Arithmetic, vertices: solids.Triangle) -> Figure:
    """A thin triangle, its vertices as given, in space or (two coordinates) in the plane z = 0."""
    return polygon(n, vertices)


def polygon(n: Arithmetic, vertices: solids.Outline) -> Figure:
    """A thin plane polygon without crossings, its vertices in order, in space or in the plane z = 0."""

    def corners() -> Floats:
        return np.array(vertices, dtype=np.float64)

    def outline() -> Floats:
        turn, origin = solids.plane_of(corners())
        return np.asarray(((corners() - origin) @ turn)[:, :2])

    def parts() -> list[charts.Chart]:
        triangles, areas = solids.triangles(n.array(vertices), n)
        return [charts.simplex(*part, n) for part in zip(triangles, areas, strict=True)]

    return Figure(
        lambda: Geometry(*solids.polygon(n.array(vertices), n)),
        parts,
        lambda x, y, z: solids.in_polygon(outline(), x, y),
        corners=corners,
    )


# --- solids of one section along z


def _prism(section: Figure, height: Scalar) -> Figure:
    """What a flat shape or a curve covers when it is moved along z, half of the height to each side."""

    def geometry() -> Geometry:
        measure, centre, second = section.geometry()
        flat = np.diag(second) if isinstance(second, list) else second
        return Geometry(measure * height, centre, flat + np.diag([0, 0, height**2 / 12]))

    inside = section.contains
    return Figure(
        geometry,
        lambda: [charts.prism(chart, height) for chart in section.charts()],
        inside and (lambda x, y, z: inside(x, y, z) & (abs(z) <= height / 2)),
    )


def box(n: Arithmetic, size: Size3) -> Figure:
    """A rectangular block; origin at its centre."""
    x, y, z = size
    return _prism(plate(n, (x, y)), z)


def cube(n: Arithmetic, side: Length) -> Figure:
    """A cube; origin at its centre."""
    block = box(n, (side, side, side))
    return block._replace(geometry=lambda: block.geometry()._replace(measure=side**3))  # rounded once


def cylinder(n: Arithmetic, radius: Length, height: Length) -> Figure:
    """A circular cylinder along z; origin at its centre."""
    return _prism(disk(n, radius), height)


def tube(n: Arithmetic, outer_radius: Length, inner_radius: OptionalLength, height: Length) -> Figure:
    """A cylinder along z with a coaxial hole; origin at its centre."""
    return _prism(annulus(n, outer_radius, inner_radius), height)


def elliptic_cylinder(n: Arithmetic, semi_axes: Size2, height: Length) -> Figure:
    """A cylinder along z on an ellipse; origin at its centre."""
    a, b = semi_axes
    ellipse = Figure(
        lambda: Geometry(n.pi * a * b, ORIGIN, [a**2 / 4, b**2 / 4, 0]),
        lambda: [charts.stretched(charts.sector(1, n), a, b)],
        lambda x, y, z: (x / a) ** 2 + (y / b) ** 2 <= 1,
    )
    return _prism(ellipse, height)


def half_cylinder(n: Arithmetic, radius: Length, height: Length) -> Figure:
    """The half y >= 0 of a cylinder along z; origin at the centre of the flat face."""
    return _prism(half_disk(n, radius), height)


# --- other solids


def sphere(n: Arithmetic, radius: Length) -> Figure:
    """A solid ball; origin at its centre."""
    return ellipsoid(n, 3 * (radius,))._replace(charts=lambda: [charts.ball(radius, n)])


def hollow_sphere(n: Arithmetic, outer_radius: Length, inner_radius: OptionalLength) -> Figure:
    """A ball with a concentric spherical hole; origin at its centre."""
    R, r = outer_radius, inner_radius
    _require_material(n, R, r)
    s = _powers(R, r, 2)
    return Figure(
        lambda: Geometry(4 * n.pi * (R - r) * s / 3, ORIGIN, 3 * [_powers(R, r, 4) / (5 * s)]),
        lambda: [charts.ball(R, n, r)],
        lambda x, y, z: (x**2 + y**2 + z**2 <= R**2) & (x**2 + y**2 + z**2 >= r**2),
    )


def ellipsoid(n: Arithmetic, semi_axes: Size3) -> Figure:
    """A solid ellipsoid; origin at its centre."""
    a, b, c = semi_axes
    return Figure(
        lambda: Geometry(4 * n.pi * a * b * c / 3, ORIGIN, [a**2 / 5, b**2 / 5, c**2 / 5]),
        lambda: [charts.stretched(charts.ball(1, n), a, b, c)],
        lambda x, y, z: (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 <= 1,
    )


def frustum(
    n: Arithmetic, bottom_radius: OptionalLength, top_radius: OptionalLength, height: Length
) -> Figure:
    """A cone cut parallel to its base, along +z; origin at the centre of the bottom."""
    a, b, h = bottom_radius, top_radius, height
    if n.sign(a + b) == 0:
        raise ValueProblem("`bottom_radius` and `top_radius` are both zero")
    s = _powers(a, b, 2)
    centre = h * (a**2 + 2 * a * b + 3 * b**2) / (4 * s)
    across = 3 * _powers(a, b, 4) / (20 * s)
    along = 3 * h**2 * (a**4 + 4 * a**3 * b + 10 * a**2 * b**2 + 4 * a * b**3 + b**4) / (80 * s**2)
    return Figure(
        lambda: Geometry(n.pi * h * s / 3, (0, 0, centre), [across, across, along]),
        lambda: [charts.tapered(charts.sector(1, n), h, a, b)],
        lambda x, y, z: (x**2 + y**2 <= (a + (b - a) * z / h) ** 2) & (z >= 0) & (z <= h),
    )


def cone(n: Arithmetic, radius: Length, height: Length) -> Figure:
    """A circular cone opening to +z; origin at its apex."""
    R, h = radius, height
    second = [3 * R**2 / 20, 3 * R**2 / 20, 3 * h**2 / 80]
    simple = Geometry(n.pi * R**2 * h / 3, (0, 0, 3 * h / 4), second)
    return frustum(n, 0, R, h)._replace(geometry=lambda: simple)


def pyramid(n: Arithmetic, base: Size2, height: Length) -> Figure:
    """A right pyramid on a rectangle, apex at +z; origin at the centre of the base."""
    (a, b), h = base, height
    second = [a**2 / 20, b**2 / 20, 3 * h**2 / 80]
    return Figure(
        lambda: Geometry(a * b * h / 3, (0, 0, h / 4), second),
        lambda: [charts.tapered(charts.block(a, b, None), h, 1, 0)],
        lambda x, y, z: (abs(2 * x) <= a * (1 - z / h)) & (abs(2 * y) <= b * (1 - z / h)) & (z >= 0),
    )


def hemisphere(n: Arithmetic, radius: Length) -> Figure:
    """A solid half ball bulging to +z; origin at the centre of the flat face."""
    return spherical_cap(n, radius, radius)._replace(charts=lambda: [charts.ball(radius, n, quarters=1)])


def spherical_cap(n: Arithmetic, radius: Length, cap_height: Length) -> Figure:
    """What a plane cuts off a ball, on its +z side; origin at the centre of the ball."""
    R, h = radius, cap_height
    if n.sign(2 * R - h) == -1:
        message = f"{_read(h, n)}, expected at most twice the radius"
        raise ValueProblem(message, path=("cap_height",))
    rest = 3 * R - h
    centre = 3 * (2 * R - h) ** 2 / (4 * rest)
    across = h * (20 * R**2 - 15 * R * h + 3 * h**2) / (20 * rest)
    along = h**2 * (40 * R**2 - 24 * R * h + 3 * h**2) / (80 * rest**2)
    return Figure(
        lambda: Geometry(n.pi * h**2 * rest / 3, (0, 0, centre), [across, across, along]),
        lambda: [charts.cap(R, h, n)],
        lambda x, y, z: (x**2 + y**2 + z**2 <= R**2) & (z >= R - h),
    )


def capsule(n: Arithmetic, radius: Length, height: OptionalLength) -> Figure:
    """A cylinder along z of the given height with half balls on both ends; origin at its centre."""
    R, h = radius, height
    cylinder, balls = 3 * h / (3 * h + 4 * R), 4 * R / (3 * h + 4 * R)  # shares of the volume
    across = cylinder * R**2 / 4 + balls * R**2 / 5
    along = cylinder * h**2 / 12 + balls * (R**2 / 5 + 3 * R * h / 8 + h**2 / 4)

    def parts() -> list[charts.Chart]:
        half = charts.ball(R, n, quarters=1)
        ends = [charts.moved(half, side * h / 2, side) for side in (1, -1)]
        return [charts.prism(charts.sector(R, n), h), *ends]

    return Figure(
        lambda: Geometry(n.pi * R**2 * (3 * h + 4 * R) / 3, ORIGIN, [across, across, along]),
        parts,
        lambda x, y, z: x**2 + y**2 + np.maximum(abs(z) - h / 2, 0) ** 2 <= R**2,
    )


def torus(n: Arithmetic, major_radius: Length, minor_radius: Length) -> Figure:
    """A ring of circular section round z; origin at its centre."""
    R, r = major_radius, minor_radius
    if n.sign(R - r) == -1:
        raise ValueProblem(
            f"{_read(r, n)}, expected at most major_radius",
            path=("minor_radius",),
            hint="a spindle torus passes through itself and is no body",
        )
    across = R**2 / 2 + 3 * r**2 / 8
    return Figure(
        lambda: Geometry(2 * n.pi**2 * R * r**2, ORIGIN, [across, across, r**2 / 4]),
        lambda: [charts.torus(R, r, n)],
        lambda x, y, z: (np.hypot(x, y) - R) ** 2 + z**2 <= r**2,
    )


def prism(n: Arithmetic, vertices: solids.FlatOutline, height: Length) -> Figure:
    """A prism on a polygon in x and y, half of its height to each side; a wedge is that of a triangle."""

    outline = polygon(n, vertices)._replace(
        contains=lambda x, y, z: solids.in_polygon(np.array(vertices, dtype=np.float64)[:, :2], x, y)
    )
    return _prism(outline, height)


def tetrahedron(n: Arithmetic, vertices: solids.Tetrahedron) -> Figure:
    """A tetrahedron, its vertices as given."""
    corners = n.array(vertices)
    measure = solids.simplex_measure(corners, n)
    return Figure(
        lambda: Geometry(measure, *solids.simplex_moments(corners)),
        lambda: [charts.simplex(corners, measure, n)],
        lambda *points: solids.in_simplex(np.array(vertices, dtype=np.float64), np.stack(points)),
    )


# --- curved shells and wires, which have no thickness


def spherical_shell(n: Arithmetic, radius: Length) -> Figure:
    """A thin sphere; origin at its centre."""
    return Figure(
        lambda: Geometry(4 * n.pi * radius**2, ORIGIN, 3 * [radius**2 / 3]),
        lambda: [charts.sphere(radius, n)],
    )


def hemispherical_shell(n: Arithmetic, radius: Length) -> Figure:
    """A thin half sphere bulging to +z; origin at the centre of its rim."""
    R = radius
    return Figure(
        lambda: Geometry(2 * n.pi * R**2, (0, 0, R / 2), [R**2 / 3, R**2 / 3, R**2 / 12]),
        lambda: [charts.sphere(R, n, quarters=1)],
    )


def cylindrical_shell(n: Arithmetic, radius: Length, height: Length) -> Figure:
    """A thin cylinder along z, open at both ends; origin at its centre."""
    return _prism(ring(n, radius), height)


def conical_shell(n: Arithmetic, radius: Length, height: Length) -> Figure:
    """The thin lateral surface of a cone opening to +z; origin at its apex."""
    R, h = radius, height
    second = [R**2 / 4, R**2 / 4, h**2 / 18]
    return Figure(
        lambda: Geometry(n.pi * R * n.hypot(R, h), (0, 0, 2 * h / 3), second),
        lambda: [charts.cone_surface(R, h, n)],
    )


def rod(n: Arithmetic, length: Length) -> Figure:
    """A thin straight rod along z; origin at its centre."""
    return Figure(
        lambda: Geometry(length, ORIGIN, [0, 0, length**2 / 12]),
        lambda: [charts.block(None, None, length)],
    )


def ring(n: Arithmetic, radius: Length) -> Figure:
    """A thin circular ring, normal along z; origin at its centre."""
    R = radius
    return Figure(
        lambda: Geometry(2 * n.pi * R, ORIGIN, [R**2 / 2, R**2 / 2, 0]),
        lambda: [charts.ring(R, n)],
    )
