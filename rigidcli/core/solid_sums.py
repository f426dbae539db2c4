"""Integrals of a density over the inside of a surface of triangles, by a rule that is exact for polynomials.

Each triangle and a central point are the corners of a tetrahedron, whose volume is negative where the
triangle is seen from outside. What sticks out of the body is thus counted as often with one sign as with
the other, and the sums are right for a polynomial on any closed surface. In a tetrahedron the rule is the
conical product of those of Gauss and Jacobi (A. Stroud, Approximate Calculation of Multiple Integrals, 1971,
section 2.5).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.edges import Read

MOMENTS = 2
"""The degree of the largest moments that are taken, those of r r^T."""

INSIDE = 1e-6
"""A point sees all of a surface if it is so far, in units of the box, on the inner side of each triangle.

Ten times the tolerance to which the linear programme is solved.
"""


class Sums(NamedTuple):
    """The integral of a density; its centre (3), and the mean of r r^T about it (3 by 3).

    Rounding errors are larger by the factor `cancelled` than in a sum without negative terms.
    """

    total: float
    centre: Floats
    second: Floats
    cancelled: float


def nodes(degree: int) -> int:
    """How many points the rule has in each tetrahedron, for a density of this degree."""
    return _along(degree) ** 3


def _along(degree: int) -> int:
    """Nodes along each coordinate: so many are exact up to twice their number, less one."""
    return (degree + MOMENTS) // 2 + 1


def _rule(degree: int) -> tuple[Floats, Floats]:
    """Shares (n by 3) of a triangle's corners, seen from the central point, in each node; weights (n)."""
    from scipy.special import roots_jacobi  # heavy, and only densities that vary need it

    count = _along(degree)
    found = [roots_jacobi(count, 0, power) for power in (2, 1, 0)]
    (u, v, w), weights = ([part[k] for part in found] for k in (0, 1))
    u, v, w = np.meshgrid(*((1 + place) / 2 for place in (u, v, w)), indexing="ij")
    shares = np.stack([u * (1 - v), u * v * (1 - w), u * v * w], axis=-1).reshape(-1, 3)
    product = np.einsum("i,j,k->ijk", *weights).ravel()
    return shares, product / product.sum()


def summed(read: Read, density: Callable[[Floats], Floats], degree: int, apex: Floats, about: Floats) -> Sums:
    """The integrals of a density of this degree, with tetrahedra that meet in the `apex` (3).

    `density` takes points (3 by n). Moments are summed about the point `about` (3).
    """
    shares, weights = _rule(degree)
    sizes, total, first, products = np.zeros(2), 0.0, np.zeros(3), np.zeros((3, 3))
    for block in read():
        corners = block - apex[:, None]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0], axis=0)
        volumes = (corners[0] * normal).sum(axis=0) / 6
        for share, weight in zip(shares, weights, strict=True):
            place = np.tensordot(share, corners, axes=1) + apex[:, None]
            mass = weight * volumes * density(place)
            offset = place - about[:, None]
            size = np.abs(mass)
            sizes += size.sum(), size @ (offset * offset).sum(axis=0)
            total += float(mass.sum())
            first += offset @ mass
            products += (offset * mass) @ offset.T
    centre = first / total
    second = products / total - np.outer(centre, centre)
    sums = np.abs([total, np.trace(products)])
    cancelled = float((sizes / sums).max()) if sums.all() else np.inf
    return Sums(total, about + centre, (second + second.T) / 2, cancelled)


def point_that_sees_all(triangles: Floats) -> Floats | None:
    """A point (3) from which all triangles (n, 3, 3), wound outwards, are seen from inside.

    No tetrahedron is negative then. It is the origin, where densities may have a tip, or else the point that
    is farthest inside all the planes of triangles. None where there is no such point.
    """
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    size = float((high - low).max())
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    faces = lengths > 0
    normals = normals[faces] / lengths[faces, None]
    levels = (normals * (triangles[faces, 0] - low)).sum(axis=1) / size
    if (levels >= normals @ -low / size).all():
        return np.zeros(3)
    from scipy.optimize import linprog  # heavy, and only some densities need it

    # The largest distance t with n . x + t <= n . a for each plane.
    rows = np.column_stack([normals, np.ones(len(normals))])
    bounds = [*((0, side) for side in (high - low) / size), (None, 1)]
    found = linprog([0, 0, 0, -1], A_ub=rows, b_ub=levels, bounds=bounds)
    if found.x is None or found.x[3] < INSIDE:
        return None
    point: Floats = low + size * found.x[:3]
    return point
