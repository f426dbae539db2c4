"""Integrals of a density over the inside of a surface of triangles, by a rule that is exact for polynomials.

Each triangle and a central point are the corners of a tetrahedron, whose volume is negative where the
triangle is seen from outside. What sticks out of the body is thus counted as often with one sign as with
the other, and the sums are right for a polynomial on any closed surface. In a tetrahedron the rule is the
conical product of those of Gauss (A. Stroud, Approximate Calculation of Multiple Integrals, 1971,
section 2.5), with the measure in the place of Jacobi's weights.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidcli.bodies.edges import Read
from rigidcli.core.arithmetic import Floats

MOMENTS = 2
"""The degree of the largest moments that are taken, those of r r^T."""


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
    return math.prod(_along(degree))


def _along(degree: int) -> list[int]:
    """Nodes along each of three coordinates: so many are exact up to twice their number, less one.

    The measure has the square of the first coordinate, and the second one as a factor.
    """
    return [(degree + MOMENTS + power) // 2 + 1 for power in (2, 1, 0)]


def _rule(degree: int) -> tuple[Floats, Floats]:
    """Shares (n by 3) of a triangle's corners, seen from the central point, in each node; weights (n)."""
    found = [np.polynomial.legendre.leggauss(count) for count in _along(degree)]
    u, v, w = np.meshgrid(*((1 + place) / 2 for place, _ in found), indexing="ij")
    shares = np.stack([u * (1 - v), u * v * (1 - w), u * v * w], axis=-1).reshape(-1, 3)
    product = (u * u * v * np.einsum("i,j,k->ijk", *(weights for _, weights in found))).ravel()
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
