"""Densities that vary inside a mesh: polynomials, whose integrals are sums over its triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NoReturn

import numpy as np

from rigidcli.bodies import cubature, solid_sums
from rigidcli.bodies.charts import Spot
from rigidcli.bodies.density import places, values
from rigidcli.bodies.edges import Read
from rigidcli.bodies.surfaces import Surface
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.environment import Formula
from rigidcli.language import tree

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
            raise ComputationError(
                "a density inside a mesh is a polynomial in x, y, z, r**2 and s**2, and this is none",
                hint="cut the mesh into `parts`, each with a density of its own, or describe it by shapes",
            )
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
            spots = low[:, None] + (high - low)[:, None] * points
            return np.where(self.contains(spots * self.unit), self._at(spots), np.inf)

        net = np.indices((NET,) * 3).reshape(3, -1) / (NET - 1)
        density = inside(net)
        watched = net[:, np.argsort(density, kind="stable")[:WATCHED]]
        if self.surface.triangles <= MOST_SEARCHED:
            watched = cubature.downhill(inside, watched, 1 / (NET - 1))
        density = inside(watched)
        if density.min() < -NEGATIVE * highest:
            self._refuse(low + (high - low) * watched[:, np.argmin(density)])
        return highest

    def _refuse(self, place: Floats) -> NoReturn:
        density = float(self._at(place[:, None])[0])
        where = ", ".join(f"{coordinate:.6g}" for coordinate in place * self.unit)
        what = f"negative ({density:.6g} kg/m^3)" if np.isfinite(density) else "not finite"
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the mesh", path=("density",))
