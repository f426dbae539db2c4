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

import numpy as np

from rigidcli.bodies.density import VARIABLES, at_points
from rigidcli.bodies.mesh_checks import Checked
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ExpressionError, ValueProblem
from rigidcli.fields.environment import Formula

MOST_POINTS = 50_000_000
"""The most points at which a polynomial is worked out for its integrals, which takes some three seconds."""

NET = 17
"""Points along each side of the box of a mesh at which a polynomial is looked at, where they are inside."""

NEGATIVE = 1e-12
"""How far below zero a density may come by rounding, in units of its largest value."""


def properties(formula: Formula, mesh: Checked, unit: float, contains: Callable[..., Mask]) -> MassProperties:
    """Mass, centre of mass and tensor, along the axes of a file whose coordinates are in a `unit` (m).

    `contains` tells which points (x, y, z in m) are inside.

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
    sizes, first, products = np.zeros(2), np.zeros(4), np.zeros((3, 3))
    for block in mesh.read():
        corners = block - apex[:, None]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0], axis=0)
        volumes = turn * (corners[0] * normal).sum(axis=0) / 6
        for share, weight in zip(shares, weights, strict=True):
            offset = np.tensordot(share, corners, axes=1)
            mass = weight * volumes * at_points(formula, (offset + apex[:, None]) * unit)
            sizes += np.abs(mass).sum(), np.abs(mass) @ (offset * offset).sum(axis=0)
            first += np.append(mass.sum(), offset @ mass)
            products += (offset * mass) @ offset.T
    total, centre = float(first[0]), first[1:] / first[0]
    if not (total > 0 and np.isfinite(products).all()):
        raise ValueProblem(f"the density leaves no mass: {total * unit**3:.6g} kg", path=("density",))
    second = (products + products.T) / (2 * total) - np.outer(centre, centre)
    # Rounding errors are larger by this than in sums without negative terms.
    cancelled = float((sizes / [total, np.trace(products)]).max())
    inertia = tensor.Inertia.of_sums(total * unit**3, centre * unit, total * unit**5 * second)
    inertia = replace(inertia, noise=cancelled * inertia.noise)
    com, spread = (apex + centre) * unit, np.sqrt(np.maximum(second.diagonal(), 0.0)) * unit
    # Rounded places change the density, the more so the farther the mesh is from its origin.
    misplaced = degree * np.abs(surface.box).max() / surface.size * highest / (total / abs(surface.volume))
    rounding = float(np.finfo(np.float64).eps * (cancelled + misplaced))
    error = tensor.misplaced(com, spread) * max(1.0, cancelled)
    return MassProperties(total * unit**3, com, inertia, error, integrated=rounding)


def _degree(formula: Formula) -> int:
    """The degree of a density in x, y, z. Raises ComputationError where it is no polynomial."""
    from rigidcli.algebra.expansion import coefficients
    from rigidcli.algebra.expressions import expr, power, symbol
    from rigidcli.algebra.reading import from_tree

    x, y, z = (symbol(name) for name in "xyz")
    s, r = (power(square, Fraction(1, 2)) for square in (x**2 + y**2, x**2 + y**2 + z**2))
    known = dict(zip(VARIABLES, (x, y, z, r, s), strict=True))
    known.update({name: expr(Fraction(float(value))) for name, value in formula.constants.items()})
    try:
        found = coefficients(from_tree(formula.expression.root, known), "xyz")
    except ExpressionError:
        found = None
    if found is None:
        raise ComputationError(
            "a density inside a mesh is a polynomial in x, y, z, r**2 and s**2, and this is none",
            hint="cut the mesh into `parts`, each with a density of its own, or describe it by shapes",
        )
    return max(map(sum, found), default=0)


def _rule(degree: int) -> tuple[Floats, Floats]:
    """Shares (n by 3) of a triangle's corners, seen from the central point, in each node; weights (n).

    The rule is exact for a density of this degree times the products of two places. So many nodes along a
    coordinate are exact up to twice their number, less one; the measure has the square of the first
    coordinate, and the second one as a factor.
    """
    found = [np.polynomial.legendre.leggauss((degree + 2 + power) // 2 + 1) for power in (2, 1, 0)]
    u, v, w = np.meshgrid(*((1 + place) / 2 for place, _ in found), indexing="ij")
    shares = np.stack([u * (1 - v), u * v * (1 - w), u * v * w], axis=-1).reshape(-1, 3)
    product = (u * u * v * np.einsum("i,j,k->ijk", *(weights for _, weights in found))).ravel()
    return shares, product / product.sum()


def _highest(formula: Formula, mesh: Checked, unit: float, contains: Callable[..., Mask]) -> float:
    """The highest density at the vertices of a mesh.

    Raises ValueProblem for one that is negative at a vertex, or at a net of points inside.
    """
    low, high = mesh.surface.box * unit
    net = low[:, None] + (high - low)[:, None] * np.indices((NET,) * 3).reshape(3, -1) / (NET - 1)
    vertices = (block.transpose(1, 0, 2).reshape(3, -1) * unit for block in mesh.read())
    highest = 0.0
    for points in chain(vertices, [net[:, contains(*net)]]):
        found = at_points(formula, points)
        highest = max(highest, float(found.max(initial=0.0)))
        wrong = np.flatnonzero(~(found >= -NEGATIVE * highest))
        if wrong.size:
            worst = wrong[np.argmin(found[wrong])]
            where = ", ".join(f"{coordinate:.6g}" for coordinate in points[:, worst])
            what = f"negative ({found[worst]:.6g} kg/m^3)"
            what = what if np.isfinite(found[worst]) else "not finite"
            raise ValueProblem(
                f"the density is {what} at x, y, z = ({where}) m of the mesh", path=("density",)
            )
    return highest
