"""Whether holes are where something is: the density left at points of every hole must not be negative.

A hole outside its body, larger than it, overlapping another, or denser than what it is cut from, can
leave a total mass and tensor that look harmless; at some point in the hole the material
then falls below zero. The points are a grid over the hole and, from each of them, the hole's surface along
both directions of every axis, drawn in by a billionth of its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array
from rigidcli.errors import Path, ValueProblem
from rigidcli.model.base import Section
from rigidcli.model.shape import Form, Lamina, Shape, Solid

GRID = 9
"""Points along each side of a hole's bounding box."""

MARGIN = 1e-9
"""How far, in units of the hole's size, points are drawn in and a plane may be off."""

DENSITY_SLACK = 0.01
"""How much denser a hole may be than what it is cut from, in units of its own: masses come rounded."""

BISECTIONS = 40


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """A form that is no composite, in a composite: +1 or -1 for a hole, its place, and the way to it."""

    form: Form
    sign: int
    rotation: Array
    displacement: Array
    path: Path

    def within(self, place: tuple[Array, Array], sign: int, path: Path) -> Leaf:
        """The leaf seen from the composite in which its own is placed."""
        turn, shift = place
        return Leaf(
            self.form,
            self.sign * sign,
            turn @ self.rotation,
            turn @ self.displacement + shift,
            (*path, *self.path),
        )


def leaf(form: Form) -> Leaf:
    """`form` in its own axes."""
    return Leaf(form, 1, np.eye(3, dtype=int), np.zeros(3, dtype=int), ())


def require_material(leaves: Sequence[Leaf], n: Arithmetic) -> None:
    """Raise ValueProblem where a hole takes away what is not there.

    Nothing is said where dimensions depend on symbols without a value, of holes that are neither
    solid nor flat, and of bodies in which a known tensor stands for a shape nobody knows.
    """
    regions = [_Region.of(leaf, n) for leaf in leaves if isinstance(leaf.form, Solid | Lamina)]
    shapeless = any(leaf.sign > 0 and not isinstance(leaf.form, Shape) for leaf in leaves)
    if shapeless or None in regions:
        return
    known = [region for region in regions if region is not None]
    for region in known:
        if region.sign > 0:
            continue
        points = region.samples()
        alike = [
            other for other in known if isinstance(other.shape, Solid) == isinstance(region.shape, Solid)
        ]
        there = sum(
            (other.density * other.contains(points, region.size) for other in alike if other.sign > 0),
            start=np.zeros(points.shape[1]),
        )
        taken = sum(
            (other.density * other.contains(points, region.size) for other in alike if other.sign < 0),
            start=np.zeros(points.shape[1]),
        )
        lack = taken - there
        worst = int(np.argmax(lack))
        if lack[worst] > DENSITY_SLACK * region.density:
            where = ", ".join(f"{coordinate:.6g}" for coordinate in points[:, worst])
            what = (
                "the hole reaches outside the body"
                if there[worst] == 0
                else f"more is taken away than is there ({taken[worst]:.6g} from {there[worst]:.6g} kg/m^3)"
            )
            raise ValueProblem(f"{what}: at ({where}) m", path=region.path)


@dataclass(frozen=True, slots=True, eq=False)
class _Region:
    """A solid or flat shape in its place, in floats."""

    shape: Solid | Lamina
    sign: int
    rotation: Array
    displacement: Array
    density: float
    path: Path

    @classmethod
    def of(cls, leaf: Leaf, n: Arithmetic) -> _Region | None:
        """The region of a leaf; None when some number of it has no value."""
        numbers = _floats([leaf.form.__dict__, leaf.rotation.tolist(), leaf.displacement.tolist()], n)
        if numbers is None:
            return None
        fields, rotation, displacement = numbers
        shape = leaf.form.model_copy(update=fields)
        assert isinstance(shape, Solid | Lamina)
        turn, shift = np.array(rotation), np.array(displacement)
        if isinstance(shape, Lamina):
            plane, origin = shape.plane()
            turn, shift = turn @ plane, turn @ origin + shift
        return cls(shape, leaf.sign, turn, shift, shape.uniform_density(FLOAT), leaf.path)

    @property
    def size(self) -> float:
        """The longest side of the bounding box, m."""
        return float(max(high - low for low, high in self.shape.bounds()))

    def contains(self, points: Array, size: float) -> Array:
        """Which of the points (3 by n) it fills; `size` is the scale on which a plane is thick, m."""
        x, y, z = self.rotation.T @ (points - self.displacement[:, None])
        inside = self.shape.contains(x, y, z)
        return (
            inside & (abs(z) <= MARGIN * max(size, self.size)) if isinstance(self.shape, Lamina) else inside
        )

    def samples(self) -> Array:
        """Points of the region (3 by n): a grid over it, and its surface seen from them along the axes."""
        bounds = np.array(self.shape.bounds())
        middle, half = bounds.mean(axis=1), np.ptp(bounds, axis=1) / 2
        steps = np.linspace(MARGIN - 1, 1 - MARGIN, GRID)
        grid = np.stack(np.meshgrid(steps, steps, steps if half[2] else [0.0], indexing="ij")).reshape(3, -1)
        inner = middle[:, None] + half[:, None] * grid
        inner = inner[:, self.shape.contains(*inner)]
        points = [inner]
        for axis in range(3 if half[2] else 2):
            for sense in (-1.0, 1.0):
                reach = np.zeros((3, 1))
                reach[axis] = 2.0 * sense * half[axis]
                low, high = np.zeros(inner.shape[1]), np.ones(inner.shape[1])
                for _ in range(BISECTIONS):
                    trial = (low + high) / 2
                    inside = self.shape.contains(*(inner + trial * reach))
                    low, high = np.where(inside, trial, low), np.where(inside, high, trial)
                points.append(inner + np.maximum(low - MARGIN, 0.0) * reach)
        placed: Array = self.rotation @ np.hstack(points) + self.displacement[:, None]
        return placed


def _floats(value: Any, n: Arithmetic) -> Any:
    """`value` with every number in it as a float; None when one of them has no value."""
    if isinstance(value, dict):
        items = _floats(list(value.values()), n)
        return None if items is None else dict(zip(value, items, strict=True))
    if isinstance(value, list | tuple):
        items = [_floats(item, n) for item in value]
        return (
            None
            if any(new is None and old is not None for new, old in zip(items, value, strict=True))
            else items
        )
    return value if value is None or isinstance(value, str | bool | Section) else n.value(value)
