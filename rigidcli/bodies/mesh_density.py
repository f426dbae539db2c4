"""Densities that vary inside a mesh: polynomials, integrated exactly over tetrahedra.

Each triangle and a central point are the corners of a tetrahedron, whose volume is negative where the
triangle is seen from outside. What sticks out of the body is thus counted as often with one sign as with
the other, and the sums are right for a polynomial on any closed surface. In a tetrahedron the rule is the
conical product of those of Gauss (A. Stroud, Approximate Calculation of Multiple Integrals, 1971,
section 2.5), with the measure in the place of Jacobi's weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import chain
from typing import Any

import numpy as np

from rigidcli.bodies.charts import Chart, Spot
from rigidcli.bodies.density import FIRST, NEGATIVE, SECOND, at_points, centred, impossible
from rigidcli.bodies.edges import blocks
from rigidcli.bodies.mesh_checks import Checked
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.fields.environment import Formula

MOST_POINTS = 50_000_000
"""The most points at which a polynomial is worked out for its integrals, which takes some three seconds."""

NET = 17
"""Points along each side of the box of a mesh at which a polynomial is looked at, where they are inside."""


def properties(formula: Formula, mesh: Checked, unit: float, contains: Callable[..., Mask]) -> MassProperties:
    """Mass, centre of mass and tensor, along the axes of a file whose coordinates are in a `unit` (m).

    `contains` says which points (x, y, z in m) are inside.

    Raises ValueProblem for a density that no body has, and ComputationError for one that is no polynomial.
    """
    surface, degree = mesh.surface, _degree(formula)
    shares, weights = _rule(degree)
    if len(weights) * surface.triangles > MOST_POINTS:
        raise ComputationError(
            f"{surface.triangles:,} triangles are too many for a density of degree {degree}",
            hint="simplify the mesh",
        )
    highest = _highest(formula, mesh, unit, contains)
    apex, turn = surface.origin + surface.centre, -1 if mesh.is_inward else 1
    moments, sizes = np.zeros((4, 4)), np.zeros((4, 4))
    for block in blocks(surface.corners):
        corners = block - apex[:, None]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0], axis=0)
        volumes = turn * (corners[0] * normal).sum(axis=0) / 6
        for share, weight in zip(shares, weights, strict=True):
            offset = np.tensordot(share, corners, axes=1)
            mass = weight * volumes * at_points(formula, (offset + apex[:, None]) * unit)
            factors = np.vstack([np.ones_like(mass), offset])
            moments += (mass * factors) @ factors.T
            sizes += (np.abs(mass) * factors) @ factors.T
    total, centre, sums = centred(moments[FIRST, SECOND])
    mean = total / abs(surface.volume)
    # Rounding errors are larger by this than in sums without negative terms.
    cancelled = max(sizes[0, 0] / total, np.trace(sizes[1:, 1:]) / np.trace(moments[1:, 1:]))
    total, centre, sums = total * unit**3, centre * unit, sums * unit**5
    inertia = tensor.Inertia.of_sums(total, centre, sums)
    inertia = replace(inertia, noise=cancelled * inertia.noise)
    com, spread = apex * unit + centre, np.sqrt(np.maximum(sums.diagonal(), 0.0) / total)
    # Rounded places change the density, the more so the farther the mesh is from its origin.
    misplaced = degree * np.abs(surface.box).max() / surface.size * highest / mean
    rounding = float(np.finfo(np.float64).eps * (cancelled + misplaced))
    error = tensor.misplaced(com, spread) * max(1.0, cancelled)
    return MassProperties(float(total), com, inertia, error, integrated=rounding)


def _degree(formula: Formula) -> int:
    """The degree of a density in x, y, z. Raises ComputationError where it is no polynomial."""
    from rigidcli.algebra.expansion import coefficients
    from rigidcli.algebra.expressions import symbol
    from rigidcli.bodies.density_exact import placed

    space = Chart((None, None, None), lambda x, y, z: Spot(x, y, z, 1))
    constants: dict[str, Any] = {name: Fraction(float(own)) for name, own in formula.constants.items()}
    try:
        density = placed(Formula(formula.expression, constants), space, list(map(symbol, "xyz")))[1]
        polynomial = coefficients(density, "xyz")
    except ExpressionError:
        polynomial = None
    if polynomial is None:
        raise ComputationError(
            "a density inside a mesh is a polynomial in x, y, z, r**2 and s**2, and this is none",
            hint="cut the mesh into `parts`, each with a density of its own, or describe it by shapes",
        )
    return max(map(sum, polynomial), default=0)


def _rule(degree: int) -> tuple[Floats, Floats]:
    """Shares (n by 3) of a triangle's corners, seen from the central point, in each node; weights (n).

    The rule is exact for a density of this degree times the products of two places. So many nodes along a
    coordinate are exact up to twice their number, less one; the measure has the square of the first
    coordinate, and the second one as a factor.
    """
    rules = [np.polynomial.legendre.leggauss((degree + 2 + power) // 2 + 1) for power in (2, 1, 0)]
    u, v, w = np.meshgrid(*((1 + nodes) / 2 for nodes, _ in rules), indexing="ij")
    shares = np.stack([u * (1 - v), u * v * (1 - w), u * v * w], axis=-1).reshape(-1, 3)
    product = (u * u * v * np.einsum("i,j,k->ijk", *(weights for _, weights in rules))).ravel()
    return shares, product / product.sum()


def _highest(formula: Formula, mesh: Checked, unit: float, contains: Callable[..., Mask]) -> float:
    """The highest density at the vertices of a mesh.

    Raises ValueProblem for one that is negative at a vertex, or at a net of points inside.
    """
    low, high = mesh.surface.box * unit
    net = low[:, None] + (high - low)[:, None] * np.indices((NET,) * 3).reshape(3, -1) / (NET - 1)
    vertices = (block.transpose(1, 0, 2).reshape(3, -1) * unit for block in blocks(mesh.surface.corners))
    highest = 0.0
    for points in chain(vertices, [net[:, contains(*net)]]):
        density = at_points(formula, points)
        highest = max(highest, float(density.max(initial=0.0)))
        if not (density >= -NEGATIVE * highest).all():
            worst = int(np.argmin(density))
            raise impossible(float(density[worst]), points[:, worst], "kg/m^3", "mesh")
    return highest
