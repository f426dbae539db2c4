"""Meshes whose mass properties are known, as triangles (n, 3, 3), and the files that hold them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Triangles = NDArray[np.float64]

FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])


def quads(corners: NDArray[np.float64]) -> Triangles:
    """Quadrangles (n, 4, 3) cut in two; halves without an area are left out."""
    halves = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    a, b, c = halves.swapaxes(0, 1)
    same = (a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1)
    kept: Triangles = halves[~same]
    return kept


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Triangles:
    """A box between two corners, wound outwards."""
    x, y, z = zip(low, high, strict=True)
    faces = [
        [(x[0], y[0], z[0]), (x[0], y[1], z[0]), (x[1], y[1], z[0]), (x[1], y[0], z[0])],
        [(x[0], y[0], z[1]), (x[1], y[0], z[1]), (x[1], y[1], z[1]), (x[0], y[1], z[1])],
        [(x[0], y[0], z[0]), (x[1], y[0], z[0]), (x[1], y[0], z[1]), (x[0], y[0], z[1])],
        [(x[0], y[1], z[0]), (x[0], y[1], z[1]), (x[1], y[1], z[1]), (x[1], y[1], z[0])],
        [(x[0], y[0], z[0]), (x[0], y[0], z[1]), (x[0], y[1], z[1]), (x[0], y[1], z[0])],
        [(x[1], y[0], z[0]), (x[1], y[1], z[0]), (x[1], y[1], z[1]), (x[1], y[0], z[1])],
    ]
    return quads(np.array(faces, dtype=float))


def revolved(profile: NDArray[np.float64], turns: int) -> Triangles:
    """What a closed profile of points (r, z), clockwise as seen with z upwards, sweeps on its way round z."""
    angle = 2 * np.pi * np.arange(turns) / turns
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(turns)], axis=1)
    points = profile[:, None, [0, 0, 1]] * ring
    following = np.roll(points, -1, axis=0)
    grid = [points, following, np.roll(following, -1, axis=1), np.roll(points, -1, axis=1)]
    return quads(np.stack(grid, axis=2).reshape(-1, 4, 3))


def prism(outline: NDArray[np.float64], low: float, high: float) -> Triangles:
    """A prism over an outline (n, 2), counter-clockwise, of which the first point sees all others."""
    bottom, top = (np.column_stack([outline, np.full(len(outline), z)]) for z in (low, high))
    fan = [(0, k, k + 1) for k in range(1, len(outline) - 1)]
    caps = [top[list(face)] for face in fan] + [bottom[list(face)[::-1]] for face in fan]
    sides = np.stack([bottom, np.roll(bottom, -1, axis=0), np.roll(top, -1, axis=0), top], axis=1)
    return np.concatenate([np.array(caps), quads(sides)])


def inside_out(triangles: Triangles) -> Triangles:
    return triangles[:, ::-1]


def saved(path: Path, triangles: Triangles, header: bytes = b"") -> Path:
    """The triangles as binary STL."""
    facets = np.zeros(len(triangles), FACET)
    facets["vertices"] = triangles
    path.write_bytes(header.ljust(80) + len(triangles).to_bytes(4, "little") + facets.tobytes())
    return path


def text(triangles: Triangles) -> str:
    """The triangles as an STL file of text, every digit written out."""
    facets = [
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x!r} {y!r} {z!r}\n" for x, y, z in facet)
        + " endloop\nendfacet\n"
        for facet in triangles.tolist()
    ]
    return f"solid thing\n{''.join(facets)}endsolid thing\n"


def indexed(triangles: Triangles) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The vertices (k, 3) of the triangles, and their numbers (n, 3)."""
    vertices, numbers = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, numbers.reshape(-1, 3)
