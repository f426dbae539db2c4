"""Every shape against quadrature over a parametrisation of its own, written from the table of the interface.

The parametrisations are smooth in coordinates from 0 to 1, so that Gauss-Legendre nodes give all digits; each
is itself tied to an indicator (which points belong to the shape), and that to the shape's `contains`.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import rigidcli
from rigidcli.bodies.shapes import SHAPES, Lamina, Region
from rigidcli.errors import DocumentError
from tests.bodies.test_solids import OUTLINES
from tests.tables import rows_of

Floats = NDArray[np.float64]
Dimensions = Mapping[str, Any]
Patch = Callable[[Floats, Floats, Floats], tuple[Any, Any, Any, Any]]
"""From u, v, w (0 to 1 each) to x, y, z and the Jacobian; a surface leaves out w, a curve v and w."""

few = settings(max_examples=40)

TAU = 2 * math.pi


# --- parametrisations


def _block(low: Sequence[float], high: Sequence[float]) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        sides = [b - a for a, b in zip(low, high, strict=True)]
        x, y, z = (a + side * t for a, side, t in zip(low, sides, (u, v, w), strict=True))
        return x, y, z, math.prod(side for side in sides if side)

    return patch


def _stack(
    height: float,
    square: Callable[[Floats], Any],
    *,
    hole: float = 0.0,
    sweep: float = TAU,
    sign: float = 1.0,
    stretch: tuple[float, float] = (1.0, 1.0),
    start: float = 0.0,
) -> Patch:
    """Round slices: at z = start + sign t, with t from 0 to `height`, a disk of radius^2 `square(t)`."""

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        t = height * u
        outer = np.sqrt(square(t))
        rho = hole + (outer - hole) * w
        phi = sweep * v
        jacobian = height * sweep * rho * (outer - hole) * stretch[0] * stretch[1]
        return stretch[0] * rho * np.cos(phi), stretch[1] * rho * np.sin(phi), start + sign * t, jacobian

    return patch


def _ball(outer: float, inner: float = 0.0, axes: Sequence[float] = (1, 1, 1)) -> Patch:
    """Spherical coordinates: radius, cosine of the polar angle, azimuth; stretched to an ellipsoid."""

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        s, c, phi = inner + (outer - inner) * u, 2 * w - 1, TAU * v
        rho = s * np.sqrt(1 - c**2)
        a, b, h = axes
        jacobian = 2 * TAU * (outer - inner) * s**2 * a * b * h
        return a * rho * np.cos(phi), b * rho * np.sin(phi), h * s * c, jacobian

    return patch


def _torus(major: float, minor: float) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        s, turn, phi = minor * u, TAU * w, TAU * v
        rho = major + s * np.cos(turn)
        return rho * np.cos(phi), rho * np.sin(phi), s * np.sin(turn), minor * TAU * TAU * s * rho

    return patch


def _pyramid(x: float, y: float, height: float) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        left = 1 - w
        return x * (u - 0.5) * left, y * (v - 0.5) * left, height * w, x * y * height * left**2

    return patch


def _tetrahedron(corners: Any) -> Patch:
    base, *rest = np.array(corners, dtype=float)
    edges = np.array(rest) - base

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        parts = u, v * (1 - u), w * (1 - u) * (1 - v)
        x, y, z = (sum(part * edge[k] for part, edge in zip(parts, edges, strict=True)) for k in range(3))
        return x, y, z, abs(np.linalg.det(edges)) * (1 - u) ** 2 * (1 - v)

    return patch


def _triangle(corners: Any, origin: Any) -> Patch:
    a, b, c = (np.append(np.array(corner, dtype=float), 0.0)[:3] for corner in corners)
    start = a - np.append(np.array(origin, dtype=float), 0.0)[:3]

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        x, y, z = (start[k] + u * (b - a)[k] + v * (1 - u) * (c - a)[k] for k in range(3))
        return x, y, z, np.linalg.norm(np.cross(b - a, c - a)) * (1 - u)

    return patch


def _raised(flat: Patch, height: float) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        x, y, _, area = flat(u, v, w)
        return x, y, height * (w - 0.5), height * area

    return patch


def _shell(height: float, radius: Callable[[Floats], Any], element: float, sign: float = 1.0) -> Patch:
    """A surface round z: radius(t) at z = sign t; `element` is what dt dphi is multiplied by."""

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        t, phi = height * u, TAU * v
        return radius(t) * np.cos(phi), radius(t) * np.sin(phi), sign * t, height * TAU * element

    return patch


def _cone_shell(radius: float, height: float) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        slant, phi = math.sqrt(radius**2 + height**2), TAU * v
        return radius * u * np.cos(phi), radius * u * np.sin(phi), height * u, slant * TAU * radius * u

    return patch


def _sphere_shell(radius: float, low: float) -> Patch:
    """Archimedes: dA = R dz dphi."""

    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        z, phi = low + (radius - low) * u, TAU * v
        rho = np.sqrt(radius**2 - z**2)
        return rho * np.cos(phi), rho * np.sin(phi), z, radius * (radius - low) * TAU

    return patch


def _ring(radius: float) -> Patch:
    return lambda u, v, w: (radius * np.cos(TAU * u), radius * np.sin(TAU * u), 0.0, TAU * radius)


def _constant(square: float) -> Callable[[Floats], Any]:
    return lambda t: square + 0 * t


# --- the table of shapes


def _round(x: Any, y: Any) -> Any:
    return x * x + y * y


class Dims(dict[str, Any]):
    """Dimensions, each also an attribute."""

    __getattr__ = dict.__getitem__


@dataclass(frozen=True)
class Reference:
    """What the interface says of a shape; coordinates of the patches count from `origin`."""

    rank: int
    patches: Callable[[Any], list[Patch]]
    inside: Callable[[Any, Any, Any, Any], Any] | None = None
    anchors: Mapping[str, Callable[[Any], Sequence[float]]] | None = None
    origin: Callable[[Any], Sequence[float]] = lambda d: (0.0, 0.0, 0.0)
    samples: list[Dimensions] = field(default_factory=list)


def _cylinder_base(d: Any) -> Sequence[float]:
    return 0.0, 0.0, -d.height / 2


def _apex_of_cone(d: Any) -> Sequence[float]:
    return 0.0, 0.0, 0.0


def _base_of_cone(d: Any) -> Sequence[float]:
    return 0.0, 0.0, d.height


def _half(size: Sequence[float]) -> tuple[list[float], list[float]]:
    return [-side / 2 for side in size], [side / 2 for side in size]


def _capsule(d: Any) -> list[Patch]:
    R, h = d.radius, d.height
    # From a pole inwards, so that slices near the poles are exact.
    return [
        _stack(R, lambda t: t * (2 * R - t), start=-h / 2 - R),
        _stack(h, _constant(R**2), start=-h / 2),
        _stack(R, lambda t: t * (2 * R - t), start=h / 2 + R, sign=-1.0),
    ]


def _in_capsule(d: Any, x: Any, y: Any, z: Any) -> Any:
    R, h = d.radius, d.height
    middle = (_round(x, y) <= R * R) & (z <= h / 2) & (z >= -h / 2)
    return middle | (_round(x, y) + (z - h / 2) ** 2 <= R * R) | (_round(x, y) + (z + h / 2) ** 2 <= R * R)


def _in_triangle(corners: Any, x: Any, y: Any) -> Any:
    (ax, ay), (bx, by), (cx, cy) = corners
    first = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    second = (cx - bx) * (y - by) - (cy - by) * (x - bx)
    third = (ax - cx) * (y - cy) - (ay - cy) * (x - cx)
    return ((first >= 0) & (second >= 0) & (third >= 0)) | ((first <= 0) & (second <= 0) & (third <= 0))


def _in_tetrahedron(d: Any, x: Any, y: Any, z: Any) -> Any:
    """On the inner side of each of the four faces."""
    corners = [np.array(corner, dtype=float) for corner in d.vertices]
    points, inside = np.stack([x, y, z], axis=-1), np.ones(np.shape(x), dtype=bool)
    for k in range(4):
        a, b, c = corners[:k] + corners[k + 1 :]
        normal = np.cross(b - a, c - a)
        inside &= ((points - a) @ normal) * ((corners[k] - a) @ normal) >= 0
    return inside


def _moved(outline: Sequence[Sequence[float]], shift: Sequence[float]) -> list[list[float]]:
    return [[a + b for a, b in zip(vertex, shift, strict=True)] for vertex in outline]


# Polygons with a triangulation by hand: vertices, and triples of vertices that fill them without overlap.
L_SHAPE: list[list[float]] = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]
ARROW: list[list[float]] = [[0, 0], [4, 3], [0, 1], [-4, 3]]
GNOMON: list[list[float]] = [[2, -1], [2, 1], [0.5, 1], [0.5, 3], [-1, 3], [-1, -1]]
STRIP: list[list[float]] = [[0, 0], [1e-3, 0], [1e-3, 1e3], [0, 1e3]]
TRIANGLES: list[tuple[list[list[float]], list[tuple[int, int, int]]]] = [
    (L_SHAPE, [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]),
    (ARROW, [(0, 1, 2), (0, 2, 3)]),
    (GNOMON, [(0, 1, 2), (0, 2, 5), (2, 3, 4), (2, 4, 5)]),
    (STRIP, [(0, 1, 2), (0, 2, 3)]),
    (ARROW[::-1], [(3, 2, 1), (3, 1, 0)]),
    (_moved(L_SHAPE, [1e8, -3e8]), [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]),
]
TURN: Floats = np.array(Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix())


def _dissection(vertices: Any) -> list[tuple[int, int, int]]:
    return next(triangles for outline, triangles in TRIANGLES if outline == vertices)


def _polygon_patches(d: Any) -> list[Patch]:
    corners = d.vertices
    return [_triangle([corners[k] for k in triple], corners[0]) for triple in _dissection(corners)]


def _in_polygon(d: Any, x: Any, y: Any, z: Any) -> Any:
    parts = [_in_triangle([d.vertices[k][:2] for k in triple], x, y) for triple in _dissection(d.vertices)]
    return np.any(parts, axis=0)


def _first_vertex(d: Any) -> Sequence[float]:
    x, y, *z = d.vertices[0]
    return x, y, *(z or [0.0])


def _in_frustum(d: Any, x: Any, y: Any, z: Any) -> Any:
    a, b, h = d.bottom_radius, d.top_radius, d.height
    return (z >= 0) & (z <= h) & (np.hypot(x, y) <= (a * (h - z) + b * z) / h)


REFERENCES: dict[str, Reference] = {
    "box": Reference(
        3,
        lambda d: [_block(*_half(d.size))],
        lambda d, x, y, z: (abs(x) <= d.size[0] / 2) & (abs(y) <= d.size[1] / 2) & (abs(z) <= d.size[2] / 2),
        {"corner": lambda d: [-side / 2 for side in d.size]},
    ),
    "cube": Reference(
        3,
        lambda d: [_block(*_half(3 * [d.side]))],
        lambda d, x, y, z: (abs(x) <= d.side / 2) & (abs(y) <= d.side / 2) & (abs(z) <= d.side / 2),
        {"corner": lambda d: 3 * [-d.side / 2]},
    ),
    "sphere": Reference(
        3,
        lambda d: [_ball(d.radius)],
        lambda d, x, y, z: _round(x, y) + z * z <= d.radius**2,
    ),
    "hollow_sphere": Reference(
        3,
        lambda d: [_ball(d.outer_radius, d.inner_radius)],
        lambda d, x, y, z: (
            (np.sqrt(_round(x, y) + z * z) <= d.outer_radius)
            & (np.sqrt(_round(x, y) + z * z) >= d.inner_radius)
        ),
    ),
    "ellipsoid": Reference(
        3,
        lambda d: [_ball(1.0, axes=d.semi_axes)],
        lambda d, x, y, z: (
            (x / d.semi_axes[0]) ** 2 + (y / d.semi_axes[1]) ** 2 + (z / d.semi_axes[2]) ** 2 <= 1
        ),
    ),
    "cylinder": Reference(
        3,
        lambda d: [_stack(d.height, _constant(d.radius**2), start=-d.height / 2)],
        lambda d, x, y, z: (_round(x, y) <= d.radius**2) & (abs(z) <= d.height / 2),
        Dims(base=_cylinder_base),
    ),
    "tube": Reference(
        3,
        lambda d: [_stack(d.height, _constant(d.outer_radius**2), hole=d.inner_radius, start=-d.height / 2)],
        lambda d, x, y, z: (
            (np.hypot(x, y) <= d.outer_radius) & (np.hypot(x, y) >= d.inner_radius) & (abs(z) <= d.height / 2)
        ),
        Dims(base=_cylinder_base),
    ),
    "elliptic_cylinder": Reference(
        3,
        lambda d: [_stack(d.height, _constant(1.0), stretch=d.semi_axes, start=-d.height / 2)],
        lambda d, x, y, z: (
            ((x / d.semi_axes[0]) ** 2 + (y / d.semi_axes[1]) ** 2 <= 1) & (abs(z) <= d.height / 2)
        ),
        Dims(base=_cylinder_base),
    ),
    "half_cylinder": Reference(
        3,
        lambda d: [_stack(d.height, _constant(d.radius**2), sweep=math.pi, start=-d.height / 2)],
        lambda d, x, y, z: (_round(x, y) <= d.radius**2) & (abs(z) <= d.height / 2) & (y >= 0),
    ),
    "cone": Reference(
        3,
        lambda d: [_stack(d.height, lambda t: (d.radius * t / d.height) ** 2)],
        lambda d, x, y, z: (z <= d.height) & (np.hypot(x, y) * d.height <= d.radius * z),
        {"apex": _apex_of_cone, "base": _base_of_cone},
    ),
    "frustum": Reference(
        3,
        lambda d: [
            _stack(
                d.height, lambda t: (d.bottom_radius + (d.top_radius - d.bottom_radius) * (t / d.height)) ** 2
            )
        ],
        _in_frustum,
        {"top": _base_of_cone},
    ),
    "pyramid": Reference(
        3,
        lambda d: [_pyramid(d.base[0], d.base[1], d.height)],
        lambda d, x, y, z: (
            (z >= 0)
            & (abs(x) / d.base[0] <= (1 - z / d.height) / 2)
            & (abs(y) / d.base[1] <= (1 - z / d.height) / 2)
        ),
        {"apex": _base_of_cone},
    ),
    "hemisphere": Reference(
        3,
        lambda d: [_stack(d.radius, lambda t: (d.radius - t) * (d.radius + t))],
        lambda d, x, y, z: (_round(x, y) + z * z <= d.radius**2) & (z >= 0),
    ),
    "spherical_cap": Reference(
        3,
        lambda d: [_stack(d.cap_height, lambda t: t * (2 * d.radius - t), sign=-1.0)],
        lambda d, x, y, z: (_round(x, y) + z * z <= d.radius**2) & (z >= d.radius - d.cap_height),
        origin=lambda d: (0.0, 0.0, d.radius),
    ),
    "capsule": Reference(
        3,
        _capsule,
        _in_capsule,
    ),
    "torus": Reference(
        3,
        lambda d: [_torus(d.major_radius, d.minor_radius)],
        lambda d, x, y, z: (np.sqrt(_round(x, y)) - d.major_radius) ** 2 + z * z <= d.minor_radius**2,
    ),
    "tetrahedron": Reference(
        3,
        lambda d: [_tetrahedron(d.vertices)],
        _in_tetrahedron,
        origin=_first_vertex,
    ),
    "prism": Reference(
        3,
        lambda d: [_raised(patch, d.height) for patch in _polygon_patches(d)],
        lambda d, x, y, z: _in_polygon(d, x, y, z) & (abs(z) <= d.height / 2),
        anchors=Dims(base=_cylinder_base),
        origin=_first_vertex,
    ),
    "spherical_shell": Reference(2, lambda d: [_sphere_shell(d.radius, -d.radius)]),
    "hemispherical_shell": Reference(2, lambda d: [_sphere_shell(d.radius, 0.0)]),
    "cylindrical_shell": Reference(
        2,
        lambda d: [_shell(d.height, _constant(d.radius), d.radius)],
        anchors=Dims(base=_cylinder_base),
        origin=_cylinder_base,
    ),
    "conical_shell": Reference(
        2,
        lambda d: [_cone_shell(d.radius, d.height)],
        anchors={"apex": _apex_of_cone, "base": _base_of_cone},
    ),
    "plate": Reference(
        2,
        lambda d: [_block(*_half([*d.size, 0.0]))],
        lambda d, x, y, z: (abs(x) <= d.size[0] / 2) & (abs(y) <= d.size[1] / 2),
        {"corner": lambda d: [-d.size[0] / 2, -d.size[1] / 2, 0.0]},
    ),
    "disk": Reference(
        2,
        lambda d: [_flat(d.radius)],
        lambda d, x, y, z: _round(x, y) <= d.radius**2,
    ),
    "annulus": Reference(
        2,
        lambda d: [_flat(d.outer_radius, d.inner_radius)],
        lambda d, x, y, z: (np.hypot(x, y) <= d.outer_radius) & (np.hypot(x, y) >= d.inner_radius),
    ),
    "half_disk": Reference(
        2,
        lambda d: [_flat(d.radius, sweep=math.pi)],
        lambda d, x, y, z: (_round(x, y) <= d.radius**2) & (y >= 0),
    ),
    "triangle": Reference(
        2,
        lambda d: [_triangle(d.vertices, d.vertices[0])],
        lambda d, x, y, z: _in_triangle([vertex[:2] for vertex in d.vertices], x, y),
        origin=_first_vertex,
    ),
    "polygon": Reference(
        2,
        _polygon_patches,
        _in_polygon,
        origin=_first_vertex,
    ),
    "rod": Reference(
        1,
        lambda d: [lambda u, v, w: (0.0, 0.0, d.length * (u - 0.5), d.length)],
        anchors={"end": lambda d: [0.0, 0.0, -d.length / 2]},
    ),
    "ring": Reference(1, lambda d: [_ring(d.radius)]),
}


def _flat(outer: float, inner: float = 0.0, sweep: float = TAU) -> Patch:
    def patch(u: Floats, v: Floats, w: Floats) -> tuple[Any, Any, Any, Any]:
        rho, phi = inner + (outer - inner) * u, sweep * v
        return rho * np.cos(phi), rho * np.sin(phi), 0.0, (outer - inner) * sweep * rho

    return patch


WRITTEN = yaml.safe_load(Path(__file__).with_name("samples.yaml").read_text(encoding="utf-8"))
WRITTEN["prism"] = [{"vertices": outline, "height": 2.5} for outline, _ in TRIANGLES[:3]]
WRITTEN["polygon"] = [{"vertices": outline} for outline, _ in TRIANGLES]
for name, dimensions in WRITTEN.items():
    REFERENCES[name].samples.extend(map(Dims, dimensions))

CASES = [
    pytest.param(shape, d, id=f"{shape}-{index}")
    for shape, reference in REFERENCES.items()
    for index, d in enumerate(reference.samples)
]
REGIONS = [case for case in CASES if REFERENCES[str(case.values[0])].inside is not None]


# --- quadrature


@dataclass(frozen=True)
class Spread:
    """Measure, centre from the natural origin, and mean r r^T about the centre."""

    measure: float
    centre: Floats
    second: Floats

    def tensor(self, mass: float) -> Floats:
        """Each moment as the sum of the two squares across, so that small ones keep their digits."""
        (xx, yy, zz), tensor = np.diag(self.second), -self.second
        np.fill_diagonal(tensor, [yy + zz, xx + zz, xx + yy])
        return mass * tensor


def _nodes(rank: int, count: int) -> tuple[list[Floats], Floats]:
    """Gauss-Legendre points of [0, 1]^rank, each a flat array, and their weights."""
    x, weight = np.polynomial.legendre.leggauss(count)
    axes = np.meshgrid(*rank * [(x + 1) / 2], indexing="ij")
    weights = np.prod(np.meshgrid(*rank * [weight / 2], indexing="ij"), axis=0)
    points = [axis.ravel() for axis in axes]
    return points + (3 - rank) * [np.zeros(weights.size)], weights.ravel()


def _sampled(shape: str, d: Dimensions, count: int) -> tuple[Floats, Floats]:
    """Points (3 by n, from the shape's `origin`) and what each weighs in the measure."""
    reference = REFERENCES[shape]
    uvw, weight = _nodes(reference.rank, count)
    columns, weights = [], []
    for patch in reference.patches(d):
        x, y, z, jacobian = (
            np.broadcast_to(np.asarray(part, dtype=float), weight.shape) for part in patch(*uvw)
        )
        columns.append(np.stack([x, y, z]))
        weights.append(weight * jacobian)
    return np.hstack(columns), np.concatenate(weights)


def quadrature(shape: str, d: Dimensions, count: int = 18) -> Spread:
    """The integrals over a shape, each worked once."""
    key = f"{shape} {count} {json.dumps(d)}"
    if key not in _WORKED:
        _WORKED[key] = _integrals(shape, d, count)
    return _WORKED[key]


_WORKED: dict[str, Spread] = {}


def _integrals(shape: str, d: Dimensions, count: int) -> Spread:
    points, weights = _sampled(shape, d, count)
    measure = math.fsum(weights)
    centre = np.array([math.fsum(weights * row) for row in points]) / measure
    arms = points - centre[:, None]
    second = np.array([[math.fsum(weights * a * b) for b in arms] for a in arms]) / measure
    return Spread(measure, np.array(REFERENCES[shape].origin(d)) + centre, second)


# --- documents


def loaded(body: Mapping[str, Any], **rest: Any) -> Any:
    return rigidcli.loads(json.dumps({"body": dict(body), **rest}))


def result(body: Mapping[str, Any], **rest: Any) -> Any:
    return rigidcli.inertia(loaded(body, **rest))


def entry_error(found: Any, expected: Floats) -> float:
    """Largest difference, in units of the largest entry."""
    return float(np.abs(np.asarray(found, dtype=float) - expected).max() / np.abs(expected).max())


def _reach(shape: str, d: Dimensions) -> float:
    """The size of the numbers from which a centre comes: the shape's own and its distance from the origin."""
    points, _ = _sampled(shape, d, 6)
    return float(np.abs(points).max() + np.abs(REFERENCES[shape].origin(d)).max())


# --- completeness


def test_every_shape_has_a_reference() -> None:
    assert list(REFERENCES) == list(SHAPES)
    assert all(len(reference.samples) >= 2 for reference in REFERENCES.values())


def test_every_solid_and_lamina_has_an_indicator() -> None:
    for name, shape in SHAPES.items():
        assert issubclass(shape, Region) == (REFERENCES[name].inside is not None), name
        assert issubclass(shape, Lamina) == (issubclass(shape, Region) and REFERENCES[name].rank == 2)


# --- the references themselves


@pytest.mark.parametrize(("shape", "d"), CASES)
def test_the_quadrature_has_converged(shape: str, d: Dimensions) -> None:
    one, two = quadrature(shape, d), quadrature(shape, d, 16)
    assert one.measure == pytest.approx(two.measure, rel=1e-14, abs=0)
    assert entry_error(one.second, two.second) < 1e-14


@pytest.mark.parametrize("shape", [name for name, reference in REFERENCES.items() if reference.inside])
def test_parametrisation_and_indicator_describe_one_shape(shape: str) -> None:
    reference = REFERENCES[shape]
    assert reference.inside is not None
    # Flat, of ordinary proportions, and with its vertices in the plane z = 0.
    d = reference.samples[0]
    points, weights = _sampled(shape, d, 10)
    points = points + np.array(reference.origin(d))[:, None]
    assert np.all(reference.inside(d, *points))
    margin = 0.1 * np.ptp(points, axis=1)
    low, high = points.min(axis=1) - margin, points.max(axis=1) + margin
    # One point somewhere in each cell of a grid: the error of the count is a thousandth.
    rng, count = np.random.default_rng(17), 48
    cells = np.stack(np.meshgrid(*3 * [np.arange(count)], indexing="ij")).reshape(3, -1)
    grid = low[:, None] + (high - low)[:, None] * (cells + rng.uniform(size=cells.shape)) / count
    if reference.rank == 2:
        grid[2] = 0.0
    filled = grid[:, reference.inside(d, *grid)]
    share = np.prod((high - low)[: reference.rank]) / grid.shape[1]
    assert filled.shape[1] * share == pytest.approx(weights.sum(), rel=5e-3, abs=0)
    mean = (points * weights).sum(axis=1) / weights.sum()
    assert filled.mean(axis=1) == pytest.approx(mean, abs=2e-3 * np.ptp(points))


# --- mass properties


@pytest.mark.parametrize(("shape", "d"), CASES)
def test_measure_centre_and_tensor_against_quadrature(shape: str, d: Dimensions) -> None:
    expected = quadrature(shape, d)
    density = 2.5
    found = result({"shape": shape, "density": density, **d})
    assert found["mass"] == pytest.approx(density * expected.measure, rel=1e-14, abs=0)
    assert np.abs(found["center_of_mass"] - expected.centre).max() <= 1e-13 * _reach(shape, d)
    assert entry_error(found["tensor_com"], expected.tensor(found["mass"])) <= 1e-14
    small, moments = np.diag(found["tensor_com"]), np.diag(expected.tensor(found["mass"]))
    assert small == pytest.approx(moments, rel=1e-14, abs=0)


@pytest.mark.parametrize(("shape", "d"), CASES)
def test_about_a_far_point(shape: str, d: Dimensions) -> None:
    mass, size = 3.0, _reach(shape, d)
    point = np.array([700.0, -1100.0, 500.0]) * size
    expected = quadrature(shape, d)
    arm = expected.centre - point
    steiner = mass * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
    found = result({"shape": shape, "mass": mass, **d}, about=point.tolist())
    assert entry_error(found["tensor"], expected.tensor(mass) + steiner) <= 1e-13
    assert np.array_equal(found["about"], point)


# --- which points a shape fills


def _is_told_by_its_indicator(shape: Any, d: Any) -> bool:
    """Whether the indicator speaks of the shape where it is; that of a triangle speaks of the plane z = 0."""
    return shape != "triangle" or all(len(vertex) == 2 for vertex in d["vertices"])


@pytest.mark.parametrize(
    ("shape", "d"), [case for case in REGIONS if _is_told_by_its_indicator(*case.values)]
)
def test_contains_agrees_with_the_indicator(shape: str, d: Dimensions) -> None:
    region, reference = loaded({"shape": shape, "mass": 1, **d}).body, REFERENCES[shape]
    assert reference.inside is not None
    rng = np.random.default_rng(11)
    samples, _ = _sampled(shape, d, 8)
    samples = samples + np.array(reference.origin(d))[:, None]
    low, high = samples.min(axis=1), samples.max(axis=1)
    margin = 0.15 * (high - low)
    points = rng.uniform(low - margin, high + margin, (3000, 3)).T
    if reference.rank == 2:
        points[2] = 0.0
    # Points of the shape, too, where it fills next to nothing of its box.
    points = np.hstack([points, samples[:, ::3]])
    expected = reference.inside(d, *points)
    found = region.contains(*points)
    # Where the two differ, a step of rounding must change the indicator: the point is on the surface.
    step = 4e-15 * np.abs(points).max()
    for index in np.flatnonzero(found != expected):
        near = points[:, index, None] + step * np.array(list(itertools.product((-1, 0, 1), repeat=3))).T
        values = reference.inside(d, *near)
        assert values.any(), points[:, index]
        assert not values.all(), points[:, index]
    assert expected.any()
    assert not expected.all()


@pytest.mark.parametrize(("shape", "d"), REGIONS)
def test_the_net_is_in_the_shape_and_a_ball_holds_both(shape: str, d: Dimensions) -> None:
    region, reference = loaded({"shape": shape, "mass": 1, **d}).body, REFERENCES[shape]
    net, (middle, radius) = region.net(), region.extent()
    steps = 1e-9 * radius * np.array([[0, 0, 0], *np.eye(3), *-np.eye(3)])
    if np.linalg.norm(middle) < 1e3 * radius:  # farther out, places are rounded by more than a step
        assert np.any([region.contains(*(net + step[:, None])) for step in steps], axis=0).all()
    points = np.hstack([_sampled(shape, d, 8)[0] + np.array(reference.origin(d))[:, None], net])
    assert (np.linalg.norm(points - middle[:, None], axis=0) <= radius).all()


def test_a_triangle_in_space_fills_its_plane() -> None:
    vertices = np.array([[1.0, 2, 3], [-3, 1, 5], [0.5, -7, 2]])
    region = loaded({"shape": "triangle", "mass": 1, "vertices": vertices.tolist()}).body
    weights = np.random.default_rng(3).uniform(-0.4, 1, (3, 400))
    weights[2] = 1 - weights[0] - weights[1]
    points = vertices.T @ weights
    assert region.contains(*points).tolist() == (weights > 0).all(axis=0).tolist()
    assert not region.contains(*(points + np.array([[0], [0], [1e-6]]))).any()


# --- anchors and placement


ANCHOR_CASES = [
    pytest.param(shape, d, anchor, id=f"{shape}-{anchor}-{index}")
    for shape, reference in REFERENCES.items()
    for anchor in (None, "com", *(reference.anchors or {}))
    for index, d in enumerate(reference.samples[:2])
]


def _expected_anchor(shape: str, d: Dimensions, anchor: str | None, centre: Floats) -> Floats:
    if anchor is None:
        return np.zeros(3)
    return centre if anchor == "com" else np.array((REFERENCES[shape].anchors or {})[anchor](d))


def test_the_anchors_are_those_of_the_table_and_no_others() -> None:
    for name, shape in SHAPES.items():
        assert set(shape.ANCHORS) == set(REFERENCES[name].anchors or {}), name


@pytest.mark.parametrize(("shape", "d", "anchor"), ANCHOR_CASES)
def test_the_anchor_lands_on_the_position(shape: str, d: Dimensions, anchor: str | None) -> None:
    expected = quadrature(shape, d)
    size = _reach(shape, d)
    pivot = _expected_anchor(shape, d, anchor, expected.centre)
    position = np.array([3.0, -2.0, 0.5]) * size
    axis, angle = np.array([2.0, -1.0, 2.0]) / 3, 1.1
    shortest = np.array([1.0, 2.0, 0.0]) / math.sqrt(5) * math.acos(2 / 3)  # z x axis, by the angle between
    body: dict[str, Any] = {"shape": shape, "mass": 3.0, "position": position.tolist(), **d}
    if anchor is not None:
        body["anchor"] = anchor
    ways: list[tuple[dict[str, Any], Floats]] = [
        ({}, np.eye(3)),
        (
            {"rotation": {"axis": axis.tolist(), "angle": angle}},
            Rotation.from_rotvec(axis * angle).as_matrix(),
        ),
        ({"axis": [2, -1, 2]}, Rotation.from_rotvec(shortest).as_matrix()),
    ]
    for extra, turn in ways:
        found = result(body | extra)
        com = position + turn @ (expected.centre - pivot)
        assert np.abs(found["center_of_mass"] - com).max() <= 2e-14 * size
        assert entry_error(found["tensor_com"], turn @ expected.tensor(3.0) @ turn.T) <= 1e-13
        # Seen from the anchor, the body is where its dimensions say.
        about = result(body | extra, about=position.tolist())
        arm = turn @ (expected.centre - pivot)
        there = turn @ expected.tensor(3.0) @ turn.T + 3.0 * (
            float(arm @ arm) * np.eye(3) - np.outer(arm, arm)
        )
        assert entry_error(about["tensor"], there) <= 1e-13


# --- scale laws


def scaled(value: Any, factor: float) -> Any:
    return [scaled(item, factor) for item in value] if isinstance(value, list) else value * factor


@few
@given(st.sampled_from(CASES), st.integers(-60, 60), st.integers(-100, 100))
def test_mass_and_length_scale_every_shape_exactly(case: Any, a: int, m: int) -> None:
    shape, d = case.values
    one = result({"shape": shape, "mass": 3.0, **d})
    length, mass = 2.0**a, 2.0**m
    other = result(
        {"shape": shape, "mass": 3.0 * mass, **{key: scaled(value, length) for key, value in d.items()}}
    )
    assert np.array_equal(other["center_of_mass"], one["center_of_mass"] * length)
    assert np.array_equal(other["tensor_com"], one["tensor_com"] * (mass * length**2))


# --- limits


@pytest.mark.parametrize(
    ("body", "moments"),
    [
        ({"shape": "hemisphere"}, [83 / 320, 83 / 320, 2 / 5]),
        (
            {"shape": "half_cylinder", "height": 1},
            [1 / 3 - 16 / (9 * math.pi**2), 1 / 3, 1 / 2 - 16 / (9 * math.pi**2)],
        ),
        ({"shape": "cone", "height": 1}, [3 / 20 + 3 / 80, 3 / 20 + 3 / 80, 3 / 10]),
        ({"shape": "conical_shell", "height": 1}, [1 / 4 + 1 / 18, 1 / 4 + 1 / 18, 1 / 2]),
        ({"shape": "hemispherical_shell"}, [5 / 12, 5 / 12, 2 / 3]),
    ],
)
def test_published_moments(body: dict[str, Any], moments: list[float]) -> None:
    """J. L. Meriam, L. G. Kraige, Engineering Mechanics: Dynamics, table D/4."""
    found = np.diag(result({**body, "radius": 1, "mass": 1})["tensor_com"])
    assert found == pytest.approx(moments, rel=1e-14, abs=0)


# --- polygons


def _exact_outline(vertices: Sequence[Sequence[float]]) -> tuple[float, Floats]:
    """Area, and tensor of a unit of mass about the centre, of a polygon: Green's theorem in fractions."""
    points = [(Fraction(x), Fraction(y)) for x, y in vertices]
    sums = [Fraction(0)] * 6
    for (x, y), (X, Y) in zip(points, points[1:] + points[:1], strict=True):
        cross = x * Y - X * y
        terms = (
            Fraction(1, 2),
            (x + X) / 6,
            (y + Y) / 6,
            (x * x + x * X + X * X) / 12,
            (y * y + y * Y + Y * Y) / 12,
            (2 * x * y + x * Y + X * y + 2 * X * Y) / 24,
        )
        sums = [total + cross * term for total, term in zip(sums, terms, strict=True)]
    area, sx, sy, sxx, syy, sxy = sums
    xx, yy, xy = sxx / area - (sx / area) ** 2, syy / area - (sy / area) ** 2, sxy / area - sx * sy / area**2
    return float(abs(area)), np.array([[yy, -xy, 0], [-xy, xx, 0], [0, 0, xx + yy]], dtype=float)


STARS = st.lists(st.floats(0.2, 2.0), min_size=3, max_size=9).map(
    lambda radii: [
        [r * math.cos(0.3 + TAU * k / len(radii)), r * math.sin(0.3 + TAU * k / len(radii))]
        for k, r in enumerate(radii)
    ]
)


@few
@given(STARS | st.sampled_from(OUTLINES[:4]), st.booleans(), st.integers(0, 8))
def test_polygons_in_space_against_greens_theorem(
    outline: list[list[float]], backwards: bool, start: int
) -> None:
    area, inertia = _exact_outline(outline)
    ordered = np.roll(outline, start, axis=0)[:: -1 if backwards else 1]
    vertices = np.hstack([ordered, np.zeros((len(outline), 1))]) @ TURN.T + np.array([5.0, -3.0, 8.0])
    found = result({"shape": "polygon", "vertices": vertices.tolist(), "density": 1})
    assert found["mass"] == pytest.approx(area, rel=2e-14, abs=0)
    assert entry_error(found["tensor_com"], area * TURN @ inertia @ TURN.T) <= 1e-13


# --- refusals

REFUSED: list[tuple[str, dict[str, Any], str]] = rows_of(__file__, "refused")


@pytest.mark.parametrize(("shape", "d", "word"), REFUSED)
def test_what_is_no_shape_is_refused(shape: str, d: dict[str, Any], word: str) -> None:
    with pytest.raises(DocumentError, match=word):
        loaded({"shape": shape, "mass": 1, **d})
