"""Densities that vary inside a mesh: polynomials on any, others where one point sees all of the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NoReturn

import numpy as np

from rigidcli.bodies.density import places, values
from rigidcli.bodies.geometry import Geometry
from rigidcli.core import line_search, solid_sums, surfaces, tensor
from rigidcli.core.arithmetic import FLOAT, Floats, Mask
from rigidcli.core.charts import Spot
from rigidcli.core.edges import Read
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.simplices import Simplices
from rigidcli.core.surfaces import Surface
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.environment import Formula
from rigidcli.language import tree

MOST_PIECES = 400
"""The most triangles of a mesh with a density that is no polynomial: its integrals take about two seconds."""

MOST_POINTS = 50_000_000
"""The most points at which a polynomial is worked out for its integrals, which takes some three seconds."""

HIGHEST = 40
"""The highest degree of a density that is summed as a polynomial."""

NET = 17
"""Points along each side of the box of a mesh at which a polynomial is looked at, where they are inside."""

WATCHED = 8
"""The lowest of them, from which a search for the lowest density begins."""

MOST_SEARCHED = 5_000
"""The most triangles of a mesh in which this search goes on beyond the net."""

NEGATIVE = 1e-12
"""How far below zero a density may come by rounding, in units of its largest value."""

ROUNDING = 16 * float(np.finfo(np.float64).eps)
"""What rounding may move a point by, in units of the largest coordinate."""

INSIDE = 1e-6
"""A point sees all of a surface if it is so far, in units of the box, on the inner side of each triangle.

Ten times the tolerance to which the linear programme is solved.
"""

SPREAD = 0.2
"""A body that is narrower, in units of the mesh, is summed once more about its own centre of mass."""


def degree(node: tree.Node) -> int | None:
    """The degree of a tree in x, y, z, even powers of r and s being polynomials; None where it is none."""
    match node:
        case tree.Name("r" | "s"):
            return None
        case tree.Name(name):
            return int(name in ("x", "y", "z"))
        case tree.Negative(operand):
            return degree(operand)
        case tree.Sum(operands) | tree.Product(operands):
            found = [degree(operand) for operand in operands]
            known = [each for each in found if each is not None]
            if len(known) < len(found):
                return None
            return max(known) if isinstance(node, tree.Sum) else sum(known)
        case tree.Power(tree.Name("r" | "s"), tree.Number(_, times)) if times in range(0, HIGHEST + 1, 2):
            return int(times)
        case tree.Power(base, tree.Number(_, times)) if times in range(HIGHEST + 1):
            each = degree(base)
            return None if each is None else each * int(times)
        case tree.Power(base, exponent):
            return _constant(base, exponent)
        case tree.Reciprocal(operand):
            return _constant(operand)
        case tree.Call(_, arguments):
            return _constant(*arguments)
        case _:
            return 0


def _constant(*nodes: tree.Node) -> int | None:
    """Zero where all are constant, and None elsewhere."""
    return 0 if all(degree(node) == 0 for node in nodes) else None


class MeshDensity:
    """A density inside a closed surface in a file, whose coordinates are in a `unit` (m).

    `contains` tells which points (3 by n, m) are inside. It `is_inward` where triangles are wound inside out.
    """

    def __init__(
        self,
        formula: Formula,
        read: Read,
        surface: Surface,
        unit: float,
        is_inward: bool,
        contains: Callable[[Floats], Mask],
    ) -> None:
        self.formula, self.read, self.surface = formula, read, surface
        self.unit, self.is_inward, self.contains = unit, is_inward, contains

    def properties(self) -> MassProperties:
        """Mass, centre of mass and tensor, along the axes of the file and from its origin.

        Raises ValueProblem for a density that no body has, and ComputationError where integrals cannot be
        had.
        """
        known = {name: tree.number(float(value)) for name, value in self.formula.constants.items()}
        power = degree(tree.bound(self.formula.expression.root, known))
        if power is None or power > HIGHEST:
            return self._of_pieces()
        if solid_sums.nodes(power) * self.surface.triangles > MOST_POINTS:
            raise ComputationError(
                f"{self.surface.triangles:,} triangles are too many for a density of degree {power}",
                hint="simplify the mesh",
            )
        return self._of_polynomial(power, self._highest(power))

    def _at(self, points: Floats) -> Floats:
        """The density at points (3 by n) in the unit of the file."""
        x, y, z = points * self.unit
        return values(self.formula, places(Spot(x, y, z, 1), np.zeros(3)))

    def _of_polynomial(self, power: int, highest: float) -> MassProperties:
        """The sums of a polynomial of this degree, whose `highest` value is about this (kg/m^3)."""
        surface, unit = self.surface, self.unit
        apex = surface.origin + surface.centre
        found = solid_sums.summed(self.read, self._at, power, apex, apex)
        if (np.trace(found.second) < SPREAD**2 * np.trace(surface.second)) and np.isfinite(
            found.centre
        ).all():
            found = solid_sums.summed(self.read, self._at, power, apex, found.centre)
        mass = found.total * unit**3 * (-1 if self.is_inward else 1)
        spread = found.second.diagonal()
        if not (mass > 0 and np.isfinite(found.second).all() and (spread >= 0).all()):
            raise ValueProblem(f"the density leaves no mass: {mass:.6g} kg", path=("density",))
        centre, second = (found.centre - apex) * unit, mass * unit**2 * found.second
        inertia = tensor.Inertia.of_sums(mass, centre, second)
        inertia = replace(inertia, noise=found.cancelled * inertia.noise)
        com = found.centre * unit
        # Rounded places change the density, the more so the farther the mesh is from its origin.
        misplaced = (
            power * np.abs(surface.box).max() / surface.size * highest / abs(found.total / surface.volume)
        )
        rounding = float(np.finfo(np.float64).eps * (found.cancelled + misplaced))
        error = tensor.misplaced(com, unit * np.sqrt(spread)) * max(1.0, found.cancelled)
        return MassProperties(mass, com, inertia, error, integrated=rounding)

    def _highest(self, power: int) -> float:
        """The highest density of a polynomial at vertices.

        Raises ValueProblem for one that is negative at vertices, or at a net of points inside, from the
        lowest of which a search goes on. One of degree 1 is lowest at a vertex.
        """
        lowest, highest, place = np.inf, 0.0, np.zeros(3)
        for block in self.read():
            points = block.transpose(1, 0, 2).reshape(3, -1)
            density = self._at(points)
            if not np.isfinite(density).all():
                self._refuse(points[:, np.argmin(np.isfinite(density))])
            highest = max(highest, float(density.max()))
            if density.min() < lowest:
                lowest, place = float(density.min()), points[:, np.argmin(density)]
        if lowest < -NEGATIVE * highest:
            self._refuse(place)
        if power < 2:
            return highest
        low, high = self.surface.box

        def inside(points: Floats) -> Floats:
            spots = low[:, None] + (high - low)[:, None] * points[1:]
            return np.where(self.contains(spots * self.unit), self._at(spots), np.inf)

        net = np.vstack([np.zeros(NET**3), np.indices((NET,) * 3).reshape(3, -1) / (NET - 1)])
        density = inside(net)
        watched = net[:, np.argsort(density, kind="stable")[:WATCHED]]
        if self.surface.triangles <= MOST_SEARCHED:
            watched, _ = line_search.lowest_points(inside, watched)
        density = inside(watched)
        if density.min() < -NEGATIVE * highest:
            self._refuse(low + (high - low) * watched[1:, np.argmin(density)])
        return highest

    def _refuse(self, place: Floats) -> NoReturn:
        density = float(self._at(place[:, None])[0])
        where = ", ".join(f"{coordinate:.6g}" for coordinate in place * self.unit)
        what = f"negative ({density:.6g} kg/m^3)" if np.isfinite(density) else "not finite"
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the mesh", path=("density",))

    def _of_pieces(self) -> MassProperties:
        """The integrals over tetrahedra that fill the body without overlap."""
        from rigidcli.bodies.density_integrals import integrated

        surface, unit = self.surface, self.unit
        if surface.triangles > MOST_PIECES:
            raise ComputationError(
                f"the density is no polynomial, and {surface.triangles:,} triangles are too many for it, "
                f"expected at most {MOST_PIECES}",
                hint="simplify the mesh, or write the density as a polynomial in x, y, z, r**2 and s**2",
            )
        triangles = surfaces.chosen(self.read, np.arange(surface.triangles))
        triangles = triangles[:, ::-1] if self.is_inward else triangles
        apex = point_that_sees_all(triangles)
        if apex is None:
            raise ComputationError(
                "the density is no polynomial, and no point inside the mesh sees all of its surface",
                hint="cut the mesh into `parts` that have such a point, or write the density as a polynomial",
            )
        corners = np.zeros((len(triangles), 4, 3))
        # Drawn in by so little that no rounding puts a point beyond the surface, where a root may end.
        within = 1 - ROUNDING * np.abs(surface.box).max() / surface.size
        corners[:, 1:] = (triangles - apex) * (unit * within)
        solid = np.abs(np.linalg.det(corners[:, 1:])) > 0
        chart = Simplices((None,) * 3, Spot, apex * unit, corners[solid])
        centre = (surface.origin + surface.centre) * unit
        uniform = Geometry(abs(surface.volume) * unit**3, centre, surface.second * unit**2)
        return integrated(self.formula, [chart], uniform, "kg/m^3", FLOAT)


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
