"""Whether holes are where something is: the density left at points of every hole must not be negative.

A hole outside its body, larger than it, overlapping another, or denser than what it is cut from, can
leave a total mass and tensor that look harmless; at some point in the hole the material then falls
below zero. The points are those of a net: of a round hole, one per cent of its radius may escape it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import combinations
from typing import Any, cast

import numpy as np

from rigidcli.bodies.density import at_points, place_text
from rigidcli.bodies.form import Form
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.shapes import NET_DRAWN_IN, Lamina, NoValueError, Region, Shape, floats
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import Path, ValueProblem
from rigidcli.fields.environment import BoundExpression

# The most shapes of a composite that are compared with each other, which takes a tenth of a second.
MOST_COMPARED = 100
# How much denser than its body a hole may be, in units of its own density: given masses are rounded.
DENSER_THAN_BODY = 0.01


@dataclass(frozen=True, eq=False)
class Leaf:
    """A form that is no composite, in a composite: +1 or -1 for a hole, its place, and the way to it."""

    form: Form
    sign: int = 1
    rotation: Array = field(default_factory=lambda: np.eye(3, dtype=int))
    displacement: Array = field(default_factory=lambda: np.zeros(3, dtype=int))
    path: Path = ()

    def within(self, place: tuple[Array, Array], sign: int, path: Path) -> Leaf:
        """The leaf seen from the composite in which its own is placed."""
        turn, shift = place
        moved = turn @ self.displacement + shift
        return Leaf(self.form, self.sign * sign, turn @ self.rotation, moved, (*path, *self.path))

    def fills_unknown_space(self) -> bool:
        """Whether the form does not say where its mass is, as a known tensor does not."""
        return not isinstance(self.form, Shape | Mesh) and not hasattr(self.form, "points")

    def fills_space(self) -> bool:
        """Whether the form has an inside, of which it can give points."""
        return isinstance(self.form, Region | Mesh)

    def is_like(self, other: Leaf) -> bool:
        """Whether both are solid, or both flat: their densities have one unit."""
        return self.fills_space() and isinstance(self.form, Lamina) == isinstance(other.form, Lamina)

    @property
    def region(self) -> Region | Mesh:
        """The form, which fills space."""
        return cast("Region | Mesh", self.form)

    def density(self, n: Arithmetic) -> Any:
        """The density: a number, or a formula where it varies."""
        form = self.region
        return form.density if isinstance(form.density, BoundExpression) else form.mean_density(n)

    def in_floats(self, n: Arithmetic) -> Leaf | None:
        """The leaf with floats for all of its numbers; None when one of them has no value."""
        form = self.form
        try:
            turn, shift = (np.array(floats(part.tolist(), n)) for part in (self.rotation, self.displacement))
            if isinstance(form, Region):
                form = form.model_copy(update=floats(form.__dict__, n))
        except NoValueError:
            return None
        return Leaf(form, self.sign, turn, shift, self.path)

    # What follows is for a leaf in floats, which fills space. Points are arrays (3 by k, m).

    @cached_property
    def ball(self) -> tuple[Floats, float]:
        """The middle (3, m) and the radius (m) of a ball that holds the leaf."""
        middle, radius = self.region.extent()
        return self.rotation @ middle + self.displacement, radius

    def points(self) -> Floats:
        """Points of the leaf."""
        placed: Floats = self.rotation @ self.region.net() + self.displacement[:, None]
        return placed

    def density_at(self, points: Floats, inside: Mask) -> Floats:
        """The density at the points that are inside, and zero at the others."""
        density = self.density(FLOAT)
        if not isinstance(density, BoundExpression):
            return np.where(inside, density, 0.0)
        local = self.rotation.T @ (points - self.displacement[:, None])
        return np.where(inside, at_points(density, np.where(inside, local, np.nan)), 0.0)

    def contains(self, points: Floats, step: Sequence[float] = (0, 0, 0)) -> Mask:
        """Which of the points, moved by a `step` along its own axes, it fills."""
        local = self.rotation.T @ (points - self.displacement[:, None]) + np.reshape(step, (3, 1))
        return self.region.contains(*local)

    def reaches(self, points: Floats, hole: Leaf) -> Mask:
        """Which of the points of a hole lie inside, to within a rounding margin at shared faces."""
        size, near = 2 * max(hole.ball[1], self.ball[1]) * self.region.MARGIN, self.contains(points)
        for direction in (*np.eye(3), *-np.eye(3)):
            if (far := np.flatnonzero(~near)).size:
                near[far] = self.contains(points[:, far], size * direction)
        return near


def counted_twice(leaves: Sequence[Leaf], n: Arithmetic) -> Iterator[str]:
    """Notes on shapes of different parts that overlap, outside of holes, at points of their nets.

    Nothing is said of shapes that depend on symbols without a value, and of very many parts.
    """
    regions = [leaf for leaf in leaves if isinstance(leaf.form, Region)]
    if len(regions) > MOST_COMPARED:
        return
    placed = [region for leaf in regions if (region := leaf.in_floats(n)) is not None]
    cut = [region for region in placed if region.sign < 0]
    for one, two in combinations((region for region in placed if region.sign > 0), 2):
        distance = np.linalg.norm(one.ball[0] - two.ball[0])
        if one.path[:2] == two.path[:2] or not one.is_like(two) or distance > one.ball[1] + two.ball[1]:
            continue
        for inner, outer in ((one, two), (two, one)):
            points = inner.points()
            points = points[:, outer.contains(points)]
            if points.size and not np.any([hole.contains(points) for hole in cut], axis=0).all():
                first, second = (".".join(map(str, region.path)) for region in (one, two))
                yield f"{first} and {second} overlap: what both fill counts twice"
                break


def densities_around(bare: Sequence[Leaf], leaves: Sequence[Leaf], n: Arithmetic) -> list[Scalar]:
    """The density of each `bare` hole: that of all parts if they agree, else of the part in which it lies.

    Raises ValueProblem where there is no such part, or its density varies.
    """
    parts = [leaf for leaf in leaves if leaf.sign > 0 and leaf.fills_space()]
    densities, found = [leaf.density(n) for leaf in parts], []
    placed = cache(lambda k: parts[k].in_floats(n))
    for hole in bare:
        alike = [k for k, leaf in enumerate(parts) if leaf.is_like(hole)]
        if not _are_alike([densities[k] for k in alike], n):
            inner, places = hole.in_floats(n), [placed(k) for k in alike]
            if inner is None or None in places:
                alike = []  # where symbols without a value place them, nothing is sure to lie in anything
            else:
                points = inner.points()
                holds = [place is not None and place.reaches(points, inner).all() for place in places]
                alike = [k for k, is_round in zip(alike, holds, strict=True) if is_round]
        if not _are_alike([densities[k] for k in alike], n):
            message = "missing: the hole does not lie in one part, of one density"
            raise ValueProblem(message, path=(*hole.path, "density"))
        found.append(densities[alike[0]])
    return found


def _are_alike(densities: Sequence[Any], n: Arithmetic) -> bool:
    if not densities or any(isinstance(density, BoundExpression) for density in densities):
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
    regions = [leaf.in_floats(n) for leaf in leaves if leaf.fills_space()]
    placed = [region for region in regions if region is not None]
    if len(placed) < len(regions) or any(leaf.sign > 0 and leaf.fills_unknown_space() for leaf in leaves):
        return
    middles, radii = (np.array(parts) for parts in zip(*(region.ball for region in placed), strict=True))
    for hole in placed:
        if hole.sign < 0:
            middle, radius = hole.ball
            reach = (radii + radius) * (1 + 8 * NET_DRAWN_IN)
            near = np.flatnonzero(np.linalg.norm(middles - middle, axis=1) <= reach)
            _require_material_in(hole, [placed[k] for k in near if placed[k].is_like(hole)])


def _require_material_in(hole: Leaf, others: Sequence[Leaf]) -> None:
    points = hole.points()
    if not points.size:
        raise ValueProblem(f"the hole is thinner than {Mesh.MARGIN:g} of its size", path=hole.path)
    own = hole.density_at(points, np.ones(points.shape[1], dtype=bool))
    there, taken = np.zeros_like(own), own
    for other in others:
        if other.sign > 0:
            there = there + other.density_at(points, other.reaches(points, hole))
        elif other is not hole:
            taken = taken + other.density_at(points, other.contains(points))
    worst = int(np.argmax(taken - there - DENSER_THAN_BODY * own))
    if taken[worst] - there[worst] > DENSER_THAN_BODY * own[worst]:
        amounts = f"{taken[worst]:.6g} from {there[worst]:.6g} {hole.region.UNIT}"
        what = f"more is taken away than is there ({amounts})"
        where = place_text(points[:, worst], hole.ball[1])
        reason = what if there[worst] else "the hole reaches outside the body"
        raise ValueProblem(f"{reason}: at {where} m", path=hole.path)
