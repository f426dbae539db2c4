"""Whether holes are where something is: the density left at points of every hole must not be negative.

A hole outside its body, larger than it, overlapping another, or denser than what it is cut from, can
leave a total mass and tensor that look harmless; at some point in the hole the material then falls
below zero. The points are images of those of a unit box, as for integrals and pictures: of a round hole,
half a per cent of its radius may escape them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from rigidcli.bodies.density import at_points
from rigidcli.bodies.form import Form
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.shape import Lamina, NoValueError, Region, Shape, floats
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import Path, ValueProblem
from rigidcli.fields.environment import Formula

GRID, FINE = 9, 33
"""Points along each side of the unit box inside a hole, and on its surface: 11 degrees apart in a circle."""

MARGIN = 1e-9
"""How far points of a hole are drawn in and bodies are grown, in units of their size: beyond all rounding."""

UNPLACED = {"name": None, "position": None, "rotation": None, "axis": None, "mass": None, "density": None}
"""What the points of a shape do not depend on."""

DENSITY_SLACK = 0.01
"""How much denser than its body a hole may be, in units of its own density: given masses are rounded."""


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """A form that is no composite, in a composite: +1 or -1 for a hole, its place, and the way to it."""

    form: Form
    sign: int = 1
    rotation: Array = field(default_factory=lambda: np.eye(3, dtype=int))
    displacement: Array = field(default_factory=lambda: np.zeros(3, dtype=int))
    path: Path = ()

    def fills_unknown_space(self) -> bool:
        """Whether the form does not say where its mass is, as a known tensor does not."""
        return not isinstance(self.form, Shape | Mesh) and not hasattr(self.form, "points")

    def fills_space(self) -> bool:
        """Whether the form has an inside, of which it can give points."""
        return isinstance(self.form, Region) or (isinstance(self.form, Mesh) and not self.form.shell)

    def is_like(self, other: Leaf) -> bool:
        """Whether both are solid, or both flat: their densities have one unit."""
        return self.fills_space() and isinstance(self.form, Lamina) == isinstance(other.form, Lamina)

    def within(self, place: tuple[Array, Array], sign: int, path: Path) -> Leaf:
        """The leaf seen from the composite in which its own is placed."""
        turn, shift = place
        moved = turn @ self.displacement + shift
        return Leaf(self.form, self.sign * sign, turn @ self.rotation, moved, (*path, *self.path))


def density_round(hole: Leaf, leaves: Sequence[Leaf], n: Arithmetic) -> Scalar:
    """The density that all parts have, or else the one part in which a hole lies wholly.

    Raises ValueProblem where there is no such part, or its density varies.
    """
    parts = [leaf for leaf in leaves if leaf.sign > 0 and leaf.is_like(hole)]
    densities = [_density(leaf.form, n) for leaf in parts]
    if not _are_alike(densities, n):
        region, regions = _Placed.of(hole, n), [_Placed.of(leaf, n) for leaf in parts]
        if region is None or None in regions:
            densities = []  # where symbols without a value place them, nothing is sure to lie in anything
        else:
            points = region.samples()
            holds = [other is not None and other.reaches(points, region.size).all() for other in regions]
            densities = [density for density, is_round in zip(densities, holds, strict=True) if is_round]
    if not _are_alike(densities, n):
        message = "missing: the hole does not lie in one part, of one density"
        raise ValueProblem(message, path=(*hole.path, "density"))
    density: Scalar = densities[0]
    return density


def _density(form: Form, n: Arithmetic) -> Any:
    """The density of a region or mesh: a number, or a formula where it varies."""
    assert isinstance(form, Region | Mesh)
    return form.density if isinstance(form.density, Formula) else form.mean_density(n)


def _are_alike(densities: Sequence[Any], n: Arithmetic) -> bool:
    """Whether there is one density, which does not vary."""
    if not densities or any(isinstance(density, Formula) for density in densities):
        return False
    return all(n.sign(n.tidied(density - densities[0])) == 0 for density in densities)


def require_material(leaves: Sequence[Leaf], n: Arithmetic) -> None:
    """Raise ValueProblem where a hole takes away what is not there.

    Nothing is said where dimensions depend on symbols without a value, and of bodies in which a
    known tensor stands for a shape that nobody has given.
    """
    for leaf in leaves:
        if leaf.sign < 0 and not leaf.fills_space():
            raise ValueProblem("no hole can be of this form, expected a solid or flat shape", path=leaf.path)
    regions = [_Placed.of(leaf, n) for leaf in leaves if leaf.fills_space()]
    placed = [region for region in regions if region is not None]
    if len(placed) < len(regions) or any(leaf.sign > 0 and leaf.fills_unknown_space() for leaf in leaves):
        return
    corners = np.array([region.corners() for region in placed])
    low, high = corners.min(axis=2), corners.max(axis=2)
    slack = 4 * MARGIN * np.abs(corners).max()
    for index, region in enumerate(placed):
        if region.sign < 0:
            near = ((low <= high[index] + slack) & (high >= low[index] - slack)).all(axis=1)
            others = [placed[k] for k in np.flatnonzero(near)]
            _require_material_in(region, [other for other in others if other.flat == region.flat])


def _require_material_in(region: _Placed, others: Sequence[_Placed]) -> None:
    holes = [other for other in others if other.sign < 0]
    if len(holes) == 1 and any(other.surrounds(region) for other in others if other.sign > 0):
        return
    points = region.samples()
    if not points.size:
        raise ValueProblem(
            f"the hole is thinner than {MARGIN:g} of its size, and rounding hides where it is",
            path=region.path,
            hint="leave it out, or give a shell as a body of its own",
        )
    there, taken = np.zeros(points.shape[1]), np.zeros(points.shape[1])
    for other in others:
        if other.sign > 0:
            there += other.density_at(points, other.reaches(points, region.size))
        else:
            taken += other.density_at(points, other.contains(points, region.size))
    slack = DENSITY_SLACK * region.density_at(points, np.ones(points.shape[1], dtype=bool))
    worst = int(np.argmax(taken - there - slack))
    if taken[worst] - there[worst] > slack[worst]:
        amounts = f"{taken[worst]:.6g} from {there[worst]:.6g} {region.shape.UNIT}"
        what = f"more is taken away than is there ({amounts})"
        where = ", ".join(f"{coordinate:.6g}" for coordinate in points[:, worst])
        reason = what if there[worst] else "the hole reaches outside the body"
        raise ValueProblem(f"{reason}: at ({where}) m", path=region.path)


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """A solid or flat shape, or a mesh, in its place, in floats."""

    shape: Region | Mesh
    sign: int
    rotation: Floats
    displacement: Floats
    density: float | Formula
    path: Path

    @classmethod
    def of(cls, leaf: Leaf, n: Arithmetic) -> _Placed | None:
        """The region of a leaf; None when some number of it has no value."""
        shape = leaf.form
        try:
            turn, shift = (np.array(floats(part.tolist(), n)) for part in (leaf.rotation, leaf.displacement))
            if isinstance(shape, Region):
                shape = shape.model_copy(update=floats(shape.__dict__, n))
        except NoValueError:
            return None
        density = _density(shape, FLOAT)
        if isinstance(shape, Region):
            plane, origin = shape.plane()
            turn, shift = turn @ plane, turn @ origin + shift
            shape = shape.model_copy(update=UNPLACED)  # shapes of one size are equal then
        assert isinstance(shape, Region | Mesh)
        return cls(shape, leaf.sign, turn, shift, density, leaf.path)

    @property
    def flat(self) -> bool:
        """Whether it fills an area, and no volume."""
        return isinstance(self.shape, Lamina)

    @property
    def size(self) -> float:
        """The longest side of the bounding box, m."""
        return float(max(high - low for low, high in self.shape.bounds()))

    def corners(self) -> Floats:
        """The corners (3 by 8, m) of its bounding box, drawn in a little."""
        bounds = np.array(self.shape.bounds())
        signs = (1 - MARGIN) * np.array(list(product((-1, 1), repeat=3)))
        corners = bounds.mean(axis=1) + signs * np.ptp(bounds, axis=1) / 2
        placed: Floats = self.rotation @ corners.T + self.displacement[:, None]
        return placed

    def density_at(self, points: Floats, inside: Mask) -> Floats:
        """The density at the points (3 by n) that are inside, and zero at the others."""
        if not isinstance(self.density, Formula):
            return np.where(inside, self.density, 0.0)
        local = self.rotation.T @ (points - self.displacement[:, None])
        if isinstance(self.shape, Region):
            plane, origin = self.shape.plane()
            local = plane @ local + origin[:, None]
        return np.where(inside, at_points(self.density, np.where(inside, local, np.nan)), 0.0)

    def contains(self, points: Floats, size: float, step: Sequence[float] = (0, 0, 0)) -> Mask:
        """Which of the points (3 by n), moved by `step` along local axes, it fills.

        A plane is as thick as rounding makes it for bodies of the given size (m).
        """
        local = self.rotation.T @ (points - self.displacement[:, None])
        x, y, z = local + np.reshape(step, (3, 1))
        inside = self.shape.contains(x, y, z)
        return inside & (abs(z) <= 2 * MARGIN * max(size, self.size)) if self.flat else inside

    def reaches(self, points: Floats, size: float) -> Mask:
        """Which of the points it fills or all but touches: between parts side by side is no gap."""
        step = (self.shape.MARGIN if isinstance(self.shape, Mesh) else MARGIN) * max(size, self.size)
        near = self.contains(points, size)
        for direction in (*np.eye(3), *-np.eye(3)):
            near = near | self.contains(points, size, step * direction)
        return near

    def surrounds(self, hole: _Placed) -> bool:
        """Whether it holds a box about the `hole` and is as dense: then no points in it need be looked at."""
        if not self.shape.CONVEX or isinstance(hole.density, Formula) or isinstance(self.density, Formula):
            return False
        is_dense = hole.density - self.density <= DENSITY_SLACK * hole.density
        return is_dense and bool(self.reaches(hole.corners(), hole.size).all())

    def samples(self) -> Floats:
        """Points of the region (3 by n): a grid over it, its corners and its surface, drawn in a little."""
        own = self.shape.samples() if isinstance(self.shape, Mesh) else _samples(self.shape)
        placed: Floats = self.rotation @ own + self.displacement[:, None]
        return placed


@lru_cache(maxsize=8)
def _samples(shape: Region) -> Floats:
    """Points of the shape (3 by n): images of a net in its unit boxes, and of a finer one on their sides."""
    plane, origin = shape.plane()
    parts = []
    for chart in shape.maps(FLOAT):
        fine = chart.net(FINE)
        sides = fine[:, ((fine == 0) | (fine == 1)).any(axis=0)]
        spot = chart.at(MARGIN + (1 - 2 * MARGIN) * np.hstack([chart.net(GRID), sides]))
        places = np.array([spot.x, spot.y, spot.z]) + np.reshape(chart.origin, (3, 1))
        local = plane.T @ (places - np.reshape(origin, (3, 1)))
        parts.append(local[:, shape.contains(*local)])
    return np.hstack(parts)
