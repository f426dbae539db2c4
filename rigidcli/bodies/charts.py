"""Shapes as images of unit boxes: where a point of the box comes to lie, and how much of the shape is there.

Each map is a polynomial in coordinates from 0 to 1 and in the cosines and sines of angles, so that it takes
arrays of floats and exact numbers alike; its measure is its Jacobian. Round shapes know the distances from
the axis and from the centre, which are simple in their coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Scalar

FACES_OF_RIGHT_ANGLE = 8  # faces along a right angle: 32 round a circle look round, and make a light file
# A face of less than this share of the largest is an edge or a point of the shape, but for rounding.
LEAST_FACE = 1e-12


class Arc(NamedTuple):
    """A coordinate that is an angle, from 0 to its `end` (rad), which has this cosine and sine."""

    end: Scalar
    cos: Scalar
    sin: Scalar

    @classmethod
    def quarters(cls, count: int, n: Arithmetic) -> Arc:
        """A right angle (1), half a circle (2), or all of it (4)."""
        return cls(count * n.pi / 2, (0, -1, 1)[count // 2], int(count == 1))


class Spot(NamedTuple):
    """Where a point lies, seen from the origin of its chart (m), and the measure there.

    `s` and `r` are its distances (m) from the axis and from the natural origin of the shape, where they
    are simpler than roots.
    """

    x: Any
    y: Any
    z: Any
    measure: Any
    s: Any = None
    r: Any = None


@dataclass(frozen=True, eq=False)
class Chart:
    """A shape, or a part of one, as the image of coordinates from 0 to 1; angles among them have an `Arc`.

    `place` takes one argument a coordinate, of an angle the pair of its cosine and its sine. `origin` (3, m)
    is where the places are seen from, in the shape's own axes. The last `simplex` coordinates add up
    to 1 at most.
    """

    coordinates: tuple[Arc | None, ...]
    place: Callable[..., Spot]
    origin: Any = (0, 0, 0)
    simplex: int = 0

    def at(self, points: Floats) -> Spot:
        """The image of points (d by n)."""
        spot = self.place(*map(_argument, self.coordinates, points))
        measure = spot.measure * math.prod(turn.end for turn in self.coordinates if turn is not None)
        parts = (*spot[:3], measure, *spot[4:])
        return Spot(*(None if part is None else np.broadcast_to(part, points.shape[1]) for part in parts))

    def net(self, count: int) -> Floats:
        """Points (d by n) with so many along each coordinate."""
        depth = len(self.coordinates)
        return np.indices((count,) * depth).reshape(depth, -1) / (count - 1)

    def rule(self, coordinate: int, degree: int = 0) -> tuple[Floats, Floats]:
        """Nodes from 0 to 1 and weights along a coordinate, for polynomials of this `degree` in the place.

        The measure and products of two places add at most five degrees. Along an angle, the polynomials are
        in its sine and cosine.
        """
        turn, count = self.coordinates[coordinate], 8 + degree
        if right_angles(turn) == 4:
            return np.arange(count) / count, np.full(count, 1 / count)  # exact for harmonics below `count`
        return gauss(4 + (degree + 1) // 2 if turn is None else 8 + count)

    def faces(self) -> list[Floats]:
        """Faces of 3 or 4 corners (k by 3, m) in the shape's own axes; a curve is one line."""
        dimensions = len(self.coordinates)
        if dimensions == 1:
            return [self._grid()]
        if dimensions == 2:
            grids = [self._grid()]
        else:
            # The two ends of a full turn meet inside the shape.
            ended = [k for k, turn in enumerate(self.coordinates) if right_angles(turn) < 4]
            grids = [self._grid(k, end) for k in ended for end in (0.0, 1.0)]
        corners = [(grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]) for grid in grids]
        quads = np.vstack([np.stack(each, axis=2).reshape(-1, 4, 3) for each in corners])
        doubled = np.linalg.norm(np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]), axis=1)
        quads = quads[doubled > LEAST_FACE * doubled.max()]
        # Two corners coincide where a face is a triangle, as at the middle of a disk.
        sides = np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2)
        return [quad[side > LEAST_FACE * sides.max()] for quad, side in zip(quads, sides, strict=True)]

    def _grid(self, fixed: int | None = None, end: float = 0.0) -> Floats:
        """Places (by each coordinate, 3) in all of the shape, or where a `fixed` coordinate has its `end`."""
        steps = [1 if arc is None else FACES_OF_RIGHT_ANGLE * right_angles(arc) for arc in self.coordinates]
        axes = [np.array([end]) if k == fixed else np.linspace(0, 1, 1 + n) for k, n in enumerate(steps)]
        grids = np.meshgrid(*axes, indexing="ij")
        spot = self.at(np.array([grid.ravel() for grid in grids]))
        places = np.stack([spot.x, spot.y, spot.z], axis=-1) + np.asarray(self.origin, dtype=np.float64)
        return places.reshape(*(len(axis) for axis in axes if len(axis) > 1), 3)


def right_angles(turn: Arc | None) -> int:
    """How many right angles a coordinate goes over: at least one, also where it is no angle."""
    return 1 if turn is None else math.ceil(2 * turn.end / math.pi - 1e-9)


@cache
def gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes from 0 to 1 and weights of Gauss's rule, exact for polynomials of degree 2 count - 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (1 + nodes) / 2, weights / 2


def _argument(turn: Arc | None, unit: Floats) -> Any:
    return unit if turn is None else (np.cos(turn.end * unit), np.sin(turn.end * unit))


def block(*sides: Scalar | None) -> Chart:
    """What has these sides along x, y and z, its centre at the origin; it has no extent along None."""
    lengths = [side for side in sides if side is not None]

    def place(*units: Any) -> Spot:
        left = iter(units)
        x, y, z = (0 if side is None else side * (2 * next(left) - 1) / 2 for side in sides)
        return Spot(x, y, z, math.prod(lengths, start=1))

    return Chart((None,) * len(lengths), place)


def tapered(section: Chart, height: Scalar, start: Scalar = 1, end: Scalar = 1, bottom: Scalar = 0) -> Chart:
    """What a flat chart fills on its way up from z = `bottom`, while its scale goes from `start` to `end`."""

    def place(u: Any, *rest: Any) -> Spot:
        flat, scale = section.place(*rest), start + (end - start) * u
        s = None if flat.s is None else scale * flat.s
        measure = height * scale**2 * flat.measure
        return Spot(scale * flat.x, scale * flat.y, bottom + height * u, measure, s)

    return replace(section, coordinates=(None, *section.coordinates), place=place)


def prism(section: Chart, height: Scalar) -> Chart:
    """What a flat chart fills when it is moved along z, half of the `height` to either side."""
    return tapered(section, height, bottom=-height / 2)


def stretched(chart: Chart, a: Scalar, b: Scalar, c: Scalar = 1) -> Chart:
    """A chart stretched along x, y and z: distances from its axis and its middle are roots now."""

    def place(*units: Any) -> Spot:
        x, y, z, measure, *_ = chart.place(*units)
        return Spot(a * x, b * y, c * z, a * b * c * measure)

    return replace(chart, place=place)


def revolved(profile: Chart, n: Arithmetic, quarters: int = 4) -> Chart:
    """What a profile in the half plane of x >= 0 and z fills as it turns about z, by right angles.

    Its x is the distance from the axis, and its `r` that from the origin.
    """

    def place(phi: tuple[Any, Any], *rest: Any) -> Spot:
        (cos, sin), flat = phi, profile.place(*rest)
        return Spot(flat.x * cos, flat.x * sin, flat.z, flat.x * flat.measure, flat.x, flat.r)

    return Chart((Arc.quarters(quarters, n), *profile.coordinates), place)


def ring(radius: Scalar, n: Arithmetic) -> Chart:
    """A circle round z."""
    return revolved(Chart((), lambda: Spot(radius, 0, 0, 1, r=radius)), n)


def sector(outer: Scalar, n: Arithmetic, inner: Scalar = 0, quarters: int = 4) -> Chart:
    """A disk, an annulus or half a disk (2 quarters) in the plane z = 0."""

    def place(v: Any) -> Spot:
        radius = inner + (outer - inner) * v
        return Spot(radius, 0, 0, outer - inner, r=radius)

    return revolved(Chart((None,), place), n, quarters)


def ball(outer: Scalar, n: Arithmetic, inner: Scalar = 0, quarters: int = 2) -> Chart:
    """A ball, with a hole or without, or its half z >= 0 (1 quarter from the pole)."""

    def place(theta: tuple[Any, Any], u: Any) -> Spot:
        (cos, sin), rho = theta, inner + (outer - inner) * u
        return Spot(rho * sin, 0, rho * cos, (outer - inner) * rho, r=rho)

    return revolved(Chart((Arc.quarters(quarters, n), None), place), n)


def moved(chart: Chart, z: Scalar, side: int) -> Chart:
    """A chart turned upside down if `side` is -1, and then moved along z."""

    def place(*units: Any) -> Spot:
        spot = chart.place(*units)
        return spot._replace(z=z + side * spot.z, r=None)

    return replace(chart, place=place)


def cap(radius: Scalar, height: Scalar, n: Arithmetic) -> Chart:
    """What a plane cuts off a ball, on its +z side, by disks at the polar angles of their rims."""
    cos, sin = (radius - height) / radius, n.sqrt(height * (2 * radius - height)) / radius

    def place(alpha: tuple[Any, Any], v: Any) -> Spot:
        cosine, sine = alpha
        return Spot(radius * sine * v, 0, radius * cosine, radius**2 * sine**2)

    return revolved(Chart((Arc(n.atan2(sin, cos), cos, sin), None), place), n)


def torus(major: Scalar, minor: Scalar, n: Arithmetic) -> Chart:
    """A ring of circular section round z."""

    def place(psi: tuple[Any, Any], v: Any) -> Spot:
        (cos, sin), across = psi, minor * v
        return Spot(major + across * cos, 0, across * sin, minor * across)

    return revolved(Chart((Arc.quarters(4, n), None), place), n)


def sphere(radius: Scalar, n: Arithmetic, quarters: int = 2) -> Chart:
    """A thin sphere, or its half z >= 0 (1 quarter from the pole)."""

    def place(theta: tuple[Any, Any]) -> Spot:
        return Spot(radius * theta[1], 0, radius * theta[0], radius, r=radius)

    return revolved(Chart((Arc.quarters(quarters, n),), place), n)


def cone_surface(radius: Scalar, height: Scalar, n: Arithmetic) -> Chart:
    """The lateral surface of a cone opening to +z, its apex at the origin."""
    slant = n.hypot(radius, height)
    return revolved(Chart((None,), lambda u: Spot(radius * u, 0, height * u, slant, r=slant * u)), n)


def simplex(vertices: Array, measure: Scalar, n: Arithmetic) -> Chart:
    """A triangle or tetrahedron with these vertices (k by 3, m), and of this area or volume.

    In floats the coordinates are Duffy's: the last ones have no effect where one before them is 1.
    """
    edges = vertices[1:] - vertices[0]
    count = len(edges)

    def place(*units: Any) -> Spot:
        left = [1 if n.exact else math.prod(1 - unit for unit in units[:k]) for k in range(count)]
        shares = [unit * own for unit, own in zip(units, left, strict=True)]
        x, y, z = (sum(share * part for share, part in zip(shares, parts, strict=True)) for parts in edges.T)
        return Spot(x, y, z, measure * math.factorial(count) * math.prod(left))

    return Chart((None,) * count, place, vertices[0], count if n.exact else 0)
