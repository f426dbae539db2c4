"""Densities that vary over a shape: expressions in its own x, y, z, r and s."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationInfo

from rigidcli.bodies.charts import Spot
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats
from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import DENSITY
from rigidcli.fields.environment import BoundExpression
from rigidcli.fields.quantities import Quantity
from rigidcli.fields.section import environment

if TYPE_CHECKING:
    from rigidcli.language.tree import Node

# What a density may depend on: places in the shape's own axes (m), r = |(x, y, z)|, s = |(x, y)|.
VARIABLES = ("x", "y", "z", "r", "s")
# Bare densities between these are those of gases in kg/m^3, and of solids and liquids in g/cm^3.
GAS, HEAVY = 0.5, 25.0
# What the reference says of a density.
SAID = "A number, or an expression in the place: the shape's own x, y, z, r = |(x, y, z)|, s = |(x, y)|"
NEGATIVE = 1e-12  # how far below zero a density may come by rounding, in units of its largest value
# The factors of moments among 1, x, y, z: the mass comes first, then the moments of x, y, z, x^2, xy.
FIRST, SECOND = np.triu_indices(4)


@dataclass(frozen=True)
class Density(Quantity):
    """Marks a field as a density: a number with a dimension, or an expression in `VARIABLES`."""

    def read(self, raw: object, info: ValidationInfo) -> Any:
        """The SI value, or an expression where it varies over the shape. A parameter hides a variable."""
        env = environment(info)
        assert self.dimension is not None
        if not isinstance(raw, str):
            value = super().read(raw, info)
            is_bare = self.dimension == DENSITY and isinstance(raw, float | Decimal) and float(raw) % 1 != 0
            if is_bare and GAS < float(value) < HEAVY:
                env.log.note(f"a density of {raw} kg/m^3 is that of a gas; {raw} g/cm^3 meant?")
            return value
        variables = tuple(name for name in VARIABLES if name not in env.declared)
        hidden = env.names_in(raw, VARIABLES).intersection(VARIABLES).difference(variables)
        notes = (f"`{name}` in a density is the parameter, not a place in the shape" for name in hidden)
        env.log.note(*notes)
        formula = env.formula(raw, self.dimension, variables)
        return super().read(raw, info) if formula.expression.names.isdisjoint(variables) else formula


def places(
    spot: Spot, origin: Any, names: Collection[str] = VARIABLES, hypot: Callable[[Any, Any], Any] = np.hypot
) -> dict[str, Any]:
    """What x, y, z, and variables of these names, are at points of a chart with this `origin`."""
    x, y, z = (part + start for part, start in zip((spot.x, spot.y, spot.z), origin, strict=True))
    at = {"x": x, "y": y, "z": z}
    if "s" in names or "r" in names:
        at["s"] = hypot(x, y) if spot.s is None else spot.s
    if "r" in names:
        at["r"] = hypot(at["s"], z) if spot.r is None else spot.r
    return at


def values(node: Node, formula: BoundExpression, at: Mapping[str, Floats]) -> Floats:
    """The values (n) of a part of a formula; infinite or NaN where there are none."""
    from rigidcli.language.expression import array

    return np.broadcast_to(array(node, {**at, **formula.constants}), at["x"].shape)


def at_points(formula: BoundExpression, points: Floats) -> Floats:
    """The density (n) at points (3 by n, m); infinite or NaN where there is none."""
    x, y, z = points
    return values(formula.expression.root, formula, places(Spot(x, y, z, 1), (0, 0, 0)))


def require_density(density: Floats, at: Floats, least: float, unit: str) -> None:
    """Raise ValueProblem if a density (n) at places (3 by n, m) is below the `least`, or has no value."""
    if not (density >= least).all():
        worst = int(np.argmin(density))
        value, where = density[worst], place_text(at[:, worst], np.abs(at).max() or 1)
        what = f"negative ({value:.6g} {unit})" if np.isfinite(value) else "without a value"
        raise ValueProblem(f"the density is {what} at x, y, z = {where} m of the shape", path=("density",))


def place_text(place: Floats, size: float) -> str:
    """A place (3) in a body of this size, without the noise of rounding."""
    return f"({', '.join(f'{round(coordinate / size, 8) * size + 0:.6g}' for coordinate in place)})"


def centred(moments: Array, n: Arithmetic = FLOAT) -> tuple[Any, Array, Array]:
    """Mass, centre (3), sums of m r r^T about it (3 by 3) of integrals (10). Raises ValueProblem."""
    matrix = np.empty((4, 4), dtype=moments.dtype)
    matrix[FIRST, SECOND] = matrix[SECOND, FIRST] = moments
    mass = matrix[0, 0]
    if n.sign(mass) in (0, -1) or not (n.exact or np.isfinite(moments).all()):
        message = f"the density leaves no mass: {n.size(mass):.6g} kg"
        raise ValueProblem(message, path=("density",), hint="a narrow peak of it may not have been seen")
    centre = n.tidy(matrix[0, 1:] / mass)
    return mass, centre, n.tidy(matrix[1:, 1:] - mass * np.outer(centre, centre))
