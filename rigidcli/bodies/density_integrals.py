"""Integrals of a density over a shape, in floats, with an estimate of their error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from rigidcli.bodies import cubature
from rigidcli.bodies.charts import Chart, right_angles
from rigidcli.bodies.density import FIRST, NEGATIVE, SECOND, VARIABLES, centred, impossible, places, values
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError
from rigidcli.fields.environment import Formula
from rigidcli.language import tree

NET = 13
"""Points along each coordinate of a net in which a density is first looked at: 2,197 in a solid."""

STARTS = 8
"""Points of the net from which the least value is searched for, by halved steps."""

PEAK = 5.0
"""A function that rises by this factor between the points of a net is not seen well enough by others."""

APART = 1e-3
"""Searches that end farther apart than this, in the unit box, have met a ridge and not one peak."""

KINKED = ("abs", "sign", "atan2")
"""Functions that have a kink or a jump where their argument is zero."""

WORST = 1e-4
"""The largest relative error that an answer may have."""


def integrated(
    density: Formula, charts: Sequence[Chart], geometry: Any, unit: str, n: Arithmetic
) -> MassProperties:
    """Mass properties of a shape with a density that varies, in the `unit` of messages.

    `geometry` is that of the shape if it were uniform: its centre and its spread, about which sums are taken.

    Raises ValueProblem for a density that no body has, and ComputationError where integrals cannot be had.
    """
    if n.exact:
        from rigidcli.bodies.density_exact import exact_properties

        return exact_properties(density, charts, n)
    about, second = (np.array(part, dtype=np.float64) for part in geometry[1:3])
    size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
    units = np.where(size > 0, size, 1.0)
    parts = [part.moments(about, units) for part in looked_at(density, charts, unit)]
    mass, centre, sums = centred(np.sum([integrals for integrals, _ in parts], axis=0))
    error = float(sum(own * abs(integrals[0]) for integrals, own in parts) / mass)
    if not error <= WORST:
        raise _too_sudden()
    com = about + units * centre
    np.fill_diagonal(sums, np.maximum(sums.diagonal(), 0.0))
    inertia = tensor.Inertia.of_sums(mass, com, sums * np.outer(units, units))
    noise = error * mass * tensor.from_second_moments(1, np.outer(size, size))
    inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
    misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(size))
    return MassProperties(float(mass), com, inertia, misplaced, integrated=error)


def looked_at(density: Any, charts: Sequence[Chart], unit: str) -> list[Part]:
    """The density over each chart.

    Raises ValueProblem where it is negative or has no value: at the points of a net, and where a search
    from its lowest points ends. What is narrower than the net may escape it.
    """
    parts = [Part(density, chart, unit) for chart in charts]
    root = density.expression.root
    heights = np.hstack([part.value(root, part.net) for part in parts])
    highest = heights[np.isfinite(heights)].max(initial=0.0)
    for part in parts:
        part.least = -NEGATIVE * highest
        part.density(np.hstack([part.net, part.extremes(root, 1)]))
    return parts


class Part:
    """A density over one chart, whose points (d by n) are those of the unit box."""

    def __init__(self, formula: Formula, chart: Chart, unit: str) -> None:
        self.formula, self.chart, self.unit, self.least = formula, chart, unit, -np.inf
        self.root = formula.expression.root
        self.names = tree.names_in(self.root)
        self.net = chart.net(NET)

    def value(self, node: tree.Node, points: Floats) -> Floats:
        """The values (n) of a part of the formula."""
        return values(node, self.formula, places(self.chart.at(points), self.chart.origin, self.names))

    def density(self, points: Floats) -> tuple[Floats, Floats]:
        """The mass in the measure of the unit box (n), and the places (3 by n, m); refused where it is none.

        It may be infinite at a point, where the integral is still finite.
        """
        spot = self.chart.at(points)
        at = places(spot, self.chart.origin, self.names)
        density = values(self.root, self.formula, at)
        bad = np.flatnonzero(~(density >= self.least))
        if bad.size:
            lowest = cubature.downhill(partial(self.value, self.root), points[:, bad[:1]], 1 / (NET - 1))
            spot = self.chart.at(lowest)
            place = np.array(spot[:3])[:, 0] + self.chart.origin
            raise impossible(float(self.value(self.root, lowest)[0]), place, self.unit, "shape")
        return density * spot.measure, np.array([at["x"], at["y"], at["z"]])

    def extremes(self, node: tree.Node, sign: int) -> Floats:
        """Points at which a part of the formula is least (1) or largest (-1), by searches from the net."""

        def height(points: Floats) -> Floats:
            return np.nan_to_num(sign * self.value(node, points))

        start = self.net[:, np.argsort(height(self.net), kind="stable")[:STARTS]]
        return cubature.downhill(height, start, 1 / (NET - 1))

    def moments(self, about: Floats, units: Floats) -> tuple[Floats, float]:
        """The integrals (10) of the density times products of 1, x, y, z, and their error.

        Places are seen from the point `about` (3, m), in `units` (3, m). Along coordinates on which the
        density does not hang the integrands are simple, and a rule with a few nodes is exact.
        """
        moving = self._moving()
        still = np.flatnonzero(~moving).tolist()
        rules = [self.chart.rule(k) for k in still]
        nodes = np.array(list(product(*(own for own, _ in rules)))).T.reshape(len(still), -1 if still else 1)
        weights = np.array([math.prod(factors) for factors in product(*(own for _, own in rules))])

        def whole(points: Floats, nodes: Floats) -> Floats:
            """Points in all coordinates (d by n m), for n points in some of them and m nodes."""
            joined = np.empty((moving.size, points.shape[1], nodes.shape[1]))
            joined[moving], joined[still] = points[:, :, None], nodes[:, None]
            return joined.reshape(moving.size, -1)

        def moments(points: Floats) -> Floats:
            mass, place = self.density(whole(points, nodes))
            factors = np.vstack([np.ones_like(mass), (place - about[:, None]) / units[:, None]])
            return np.asarray(
                (mass * factors[FIRST] * factors[SECOND]).reshape(10, -1, weights.size) @ weights
            )

        def argument(node: tree.Node, points: Floats) -> Floats:
            return np.nan_to_num(self.value(node, whole(points, nodes[:, :1])))

        kinks, peaks = list[cubature.Kink](), list[Floats]()
        for function in tree.nodes([self.root]):
            node = _argument(function)
            if node is None or tree.names_in(node).isdisjoint({*VARIABLES} - self.formula.constants.keys()):
                continue
            ends = np.hstack([self.extremes(node, sign) for sign in (1, -1)])
            low, *_, high = np.sort(self.value(node, ends))
            if low < 0 < high and isinstance(function, tree.Call) and function.function in KINKED:
                kinks.append(partial(argument, node))
            peaks += self._peaks(function, ends, moving)
        pieces = [right_angles(self.chart.coordinates[k]) for k in np.flatnonzero(moving)]
        return cubature.integral(moments, [] if peaks else kinks, peaks, pieces, weights.size)

    def _moving(self) -> Mask:
        """The coordinates (d) of the chart on which variables of the density hang."""
        depth = len(self.chart.coordinates)
        at = places(self.chart.at(self.net), self.chart.origin, self.names)
        grids = [np.reshape(at[name], [NET] * depth) for name in self.names & at.keys()]
        return np.array([any(np.ptp(grid, axis=k).any() for grid in grids) for k in range(depth)])

    def _peaks(self, function: tree.Node, ends: Floats, moving: Mask) -> list[Floats]:
        """Those of the ends of two searches at which a function in the density is much higher than on a net.

        No point of that net is at a place that people like. Raises ComputationError for a narrow ridge, of
        which boxes about a point would see a part only.
        """
        usual = np.abs(self.value(function, 0.0137 + 0.9683 * self.net))
        self.density(ends)
        highest = np.abs(self.value(function, ends))
        is_high = np.isfinite(highest) & (highest > PEAK * usual[np.isfinite(usual)].max())
        is_round = [right_angles(self.chart.coordinates[k]) == 4 for k in np.flatnonzero(moving)]
        peaks = []
        for half in np.split(np.arange(is_high.size), 2):
            high = ends[:, half[is_high[half]]][moving]
            across = np.abs(high - high[:, :1])
            # A peak where an angle begins is met at both ends of the angle.
            across[is_round] = np.minimum(across[is_round], 1 - across[is_round])
            if across.max(initial=0.0) > APART:
                raise _too_sudden()
            peaks += list(high.T)
        return peaks


def _too_sudden() -> ComputationError:
    return ComputationError(
        f"the density changes too much, or too suddenly, for a relative error of {WORST:g}",
        hint="give the body in `parts`, so that the density is smooth in each of them",
    )


def _argument(node: tree.Node) -> tree.Node | None:
    """The argument of a function, quotient or power that may be narrow; None of other parts of a density."""
    match node:
        case tree.Power(_, tree.Number(_, value)) if value == int(value):
            return None
        case tree.Call(_, (inner, *_)) | tree.Power(inner, _) | tree.Reciprocal(inner):
            return inner
    return None
