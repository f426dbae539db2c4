"""The surfaces of shapes as plane faces, and wires as lines, in the axes of the shape."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np

from rigidcli.bodies.shape import Shape
from rigidcli.core.arithmetic import Floats

TURNS = 32
"""Faces round a circle: enough to look round, and few enough for a light file."""

ARC = 9
"""Points along a quarter of a circle."""

Faces: TypeAlias = list[Floats]


def _turned(profile: Iterable[tuple[float, float]]) -> Faces:
    """The surface that a line of points (distance from z, z) sweeps on its way round z."""
    angle = np.linspace(0, 2 * np.pi, TURNS + 1)
    radius, z = np.array(list(profile), dtype=float).T
    x, y = np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    grid = np.stack([x, y, np.outer(z, np.ones_like(angle))], axis=-1)
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return list(np.stack(corners, axis=2).reshape(-1, 4, 3))


def _arc(
    radius: float, start: float, end: float, z: float = 0.0, r: float = 0.0
) -> list[tuple[float, float]]:
    """Points of a profile on a circle about (r, z), by angles from +z (rad)."""
    count = max(2, int(np.ceil(abs(end - start) / (np.pi / 2) * ARC)) + 1)
    return [(r + radius * np.sin(a), z + radius * np.cos(a)) for a in np.linspace(start, end, count)]


def _prism(outline: Floats, low: float, high: float, top: float = 1.0) -> Faces:
    """Bottom, top and sides over an outline (n, 2); the top is smaller by the factor `top`."""
    bottom = np.column_stack([outline, np.full(len(outline), low)])
    roof = np.column_stack([outline * top, np.full(len(outline), high)])
    following = np.roll(bottom, -1, axis=0), np.roll(roof, -1, axis=0)
    sides = list(np.stack([bottom, following[0], following[1], roof], axis=1)) if high > low else []
    return [bottom, *([roof] if high > low and top else []), *sides]


def _rectangle(x: float, y: float) -> Floats:
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]], dtype=float) / 2


def _half_disk(radius: float) -> Floats:
    angle = np.linspace(0, np.pi, TURNS // 2 + 1)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _scaled(faces: Faces, factors: tuple[float, float, float]) -> Faces:
    return [face * np.array(factors, dtype=float) for face in faces]


def ball(radius: float) -> Faces:
    """The surface of a ball about the origin."""
    return _turned(_arc(radius, 0, np.pi))


def _cylinder(radius: float, height: float) -> Faces:
    return _turned([(0, -height / 2), (radius, -height / 2), (radius, height / 2), (0, height / 2)])


def _tube(outer: float, inner: float, height: float) -> Faces:
    h = height / 2
    return _turned([(inner, -h), (outer, -h), (outer, h), (inner, h), (inner, -h)])


def _capsule(s: Any) -> Faces:
    upper = _arc(s.radius, 0, np.pi / 2, s.height / 2)
    return _turned([*upper, *_arc(s.radius, np.pi / 2, np.pi, -s.height / 2)])


def _cap(s: Any) -> Faces:
    low = s.radius - s.cap_height
    return _turned([*_arc(s.radius, 0, float(np.arccos(low / s.radius))), (0, low)])


def _tetrahedron(s: Any) -> Faces:
    a, b, c, d = np.array(s.vertices, dtype=float)
    return [np.array(face) for face in ([a, b, c], [a, b, d], [a, c, d], [b, c, d])]


def _flat(s: Any) -> Faces:
    return [np.array(s.vertices, dtype=float)]


SURFACES: dict[str, Callable[[Any], Faces]] = {
    "box": lambda s: _prism(_rectangle(*s.size[:2]), -s.size[2] / 2, s.size[2] / 2),
    "cube": lambda s: _prism(_rectangle(s.side, s.side), -s.side / 2, s.side / 2),
    "sphere": lambda s: ball(s.radius),
    "hollow_sphere": lambda s: [*ball(s.outer_radius), *ball(s.inner_radius)],
    "ellipsoid": lambda s: _scaled(ball(1), s.semi_axes),
    "cylinder": lambda s: _cylinder(s.radius, s.height),
    "tube": lambda s: _tube(s.outer_radius, s.inner_radius, s.height),
    "elliptic_cylinder": lambda s: _scaled(_cylinder(1, s.height), (*s.semi_axes, 1)),
    "half_cylinder": lambda s: _prism(_half_disk(s.radius), -s.height / 2, s.height / 2),
    "cone": lambda s: _turned([(0, 0), (s.radius, s.height), (0, s.height)]),
    "frustum": lambda s: _turned([(0, 0), (s.bottom_radius, 0), (s.top_radius, s.height), (0, s.height)]),
    "pyramid": lambda s: _prism(_rectangle(*s.base), 0, s.height, 0),
    "hemisphere": lambda s: _turned([*_arc(s.radius, 0, np.pi / 2), (0, 0)]),
    "spherical_cap": _cap,
    "capsule": _capsule,
    "torus": lambda s: _turned(_arc(s.minor_radius, 0, 2 * np.pi, r=s.major_radius)),
    "tetrahedron": _tetrahedron,
    "spherical_shell": lambda s: ball(s.radius),
    "hemispherical_shell": lambda s: _turned(_arc(s.radius, 0, np.pi / 2)),
    "cylindrical_shell": lambda s: _turned([(s.radius, -s.height / 2), (s.radius, s.height / 2)]),
    "conical_shell": lambda s: _turned([(0, 0), (s.radius, s.height)]),
    "plate": lambda s: _prism(_rectangle(*s.size), 0, 0),
    "disk": lambda s: _turned([(0, 0), (s.radius, 0)]),
    "annulus": lambda s: _turned([(s.inner_radius, 0), (s.outer_radius, 0)]),
    "half_disk": lambda s: _prism(_half_disk(s.radius), 0, 0),
    "triangle": _flat,
    "polygon": _flat,
    "rod": lambda s: [np.array([[0, 0, -s.length / 2], [0, 0, s.length / 2]], dtype=float)],
    "ring": lambda s: [
        np.array([[s.radius * np.cos(a), s.radius * np.sin(a), 0] for a in np.linspace(0, 2 * np.pi, 65)])
    ],
}
"""The surface of each shape; of a wire a single line of points."""


def surface(shape: Shape) -> Faces:
    """The faces (each k by 3, m) of a shape, or the one line (k by 3) of a wire, in its own axes."""
    return SURFACES[shape.shape](shape)
