"""Integrals of a density over a shape in floats, with an estimate of their error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from rigidcli.bodies import cubature
from rigidcli.bodies.charts import Chart, Spot, right_angles
from rigidcli.bodies.density import FIRST, NEGATIVE, SECOND, VARIABLES, centred, impossible, places, values
from rigidcli.core import tensor
from rigidcli.core.arithmetic import EPS, Arithmetic, Floats
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
    heights = np.hstack([part.value(part.root, part.net) for part in parts])
    highest = heights[np.isfinite(heights)].max(initial=0.0)
    for part in parts:
        part.least = -NEGATIVE * highest
        part.density(np.hstack([part.net, part.extremes(part.root, 1)]))
    return parts


class Part:
    """A density over one chart, at points (d by n) of those coordinates of the unit box on which it hangs.

    Along the others the density stays the same, and a rule with a few nodes is exact for its moments.
    """

    def __init__(self, formula: Formula, chart: Chart, unit: str) -> None:
        self.formula, self.chart, self.unit, self.least = formula, chart, unit, -np.inf
        self.root = formula.expression.root
        self.names = tree.names_in(self.root)
        net, depth = chart.net(NET), len(chart.coordinates)
        at = places(chart.at(net), chart.origin, self.names)
        grids = [np.reshape(at[name], [NET] * depth) for name in self.names & at.keys()]
        moving = [any(np.ptp(grid, axis=k).any() for grid in grids) for k in range(depth)]
        self.moving = np.array(moving, dtype=bool)
        self.net = net[self.moving][:, (net[~self.moving] == 0).all(axis=0)]
        self.pieces = [right_angles(chart.coordinates[k]) for k in np.flatnonzero(moving)]
        rules = [chart.rule(k) for k in np.flatnonzero(~self.moving)]
        self.nodes = np.array(list(product(*(nodes for nodes, _ in rules)))).T
        self.weights = np.array([math.prod(weights) for weights in product(*(own for _, own in rules))])

    def spot(self, points: Floats, nodes: Floats) -> Spot:
        """Where the points lie, and the measure there, for each of the nodes in the other coordinates."""
        whole = np.empty((self.moving.size, points.shape[1], nodes.shape[1]))
        whole[self.moving], whole[~self.moving] = points[:, :, None], nodes[:, None]
        return self.chart.at(whole.reshape(self.moving.size, -1))

    def value(self, node: tree.Node, points: Floats) -> Floats:
        """The values (n) of a part of the formula."""
        spot = self.spot(points, self.nodes[:, :1])
        return values(node, self.formula, places(spot, self.chart.origin, self.names))

    def density(self, points: Floats) -> tuple[Floats, Floats]:
        """The mass in the measure of the unit box (n m), and the places (3 by n m, m), at each of m nodes.

        It may be infinite at a point, where the integral is still finite. Raises ValueProblem where there is
        no density, or a negative one.
        """
        spot = self.spot(points, self.nodes)
        at = places(spot, self.chart.origin, self.names)
        density = values(self.root, self.formula, at)
        bad = np.flatnonzero(~(density >= self.least))
        if bad.size:
            start = points[:, bad[:1] // self.weights.size]
            lowest = cubature.downhill(partial(self.value, self.root), start, 1 / (NET - 1))
            place = np.array(self.spot(lowest, self.nodes[:, :1])[:3])[:, 0] + self.chart.origin
            raise impossible(float(self.value(self.root, lowest)[0]), place, self.unit, "shape")
        with np.errstate(invalid="ignore"):  # where a density without bounds meets a vanishing measure
            return density * spot.measure, np.array([at["x"], at["y"], at["z"]])

    def extremes(self, node: tree.Node, sign: int) -> Floats:
        """Points at which a part of the formula is least (1) or largest (-1), by searches from the net."""

        def height(points: Floats) -> Floats:
            return np.nan_to_num(sign * self.value(node, points))

        start = self.net[:, np.argsort(height(self.net), kind="stable")[:STARTS]]
        return cubature.downhill(height, start, 1 / (NET - 1))

    def moments(self, about: Floats, units: Floats) -> tuple[Floats, float]:
        """The integrals (10) of the density times products of 1, x, y, z, and their error.

        Places are seen from the point `about` (3, m), in `units` (3, m).
        """

        def moments(points: Floats) -> Floats:
            mass, place = self.density(points)
            factors = np.vstack([np.ones_like(mass), (place - about[:, None]) / units[:, None]])
            products = mass * factors[FIRST] * factors[SECOND]
            return np.asarray(products.reshape(10, -1, self.weights.size) @ self.weights)

        kinks, peaks = list[cubature.Kink](), list[Floats]()
        for function in tree.nodes([self.root]):
            node = _argument(function)
            if node is None or tree.names_in(node).isdisjoint({*VARIABLES} - self.formula.constants.keys()):
                continue
            ends = [self.extremes(node, sign) for sign in (1, -1)]
            low, high = (self.value(node, points) for points in ends)
            if low.min() < 0 < high.max() and getattr(function, "function", None) in KINKED:
                kinks.append(partial(self.value, node))
            for points in ends:
                peaks += self._peaks(function, points)
        return cubature.integral(moments, [] if peaks else kinks, peaks, self.pieces, self.weights.size)

    def _peaks(self, function: tree.Node, ends: Floats) -> list[Floats]:
        """Those of the ends of searches at which a function in the density is much higher than on a net.

        No point of that net is at a place that people like. Raises ComputationError for a narrow ridge, of
        which boxes about a point would see a part only.
        """
        self.density(ends)
        usual, highest = (
            np.nan_to_num(np.abs(self.value(function, points)), posinf=0.0)
            for points in (0.0137 + 0.9683 * self.net, ends)
        )
        high = ends[:, highest > max(PEAK * usual.max(), EPS * highest.max())]
        across = np.abs(high - high[:, :1])
        # A peak where an angle begins is met at both ends of the angle.
        is_round = np.array(self.pieces) == 4
        across[is_round] = np.minimum(across[is_round], 1 - across[is_round])
        if across.max(initial=0.0) > APART:
            raise _too_sudden()
        return list(high.T)


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
