"""Integrals of a density over a shape, in floats, with an estimate of their error."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NoReturn

import numpy as np

from rigidcli.bodies import cubature
from rigidcli.bodies.charts import Chart, turn_is_whole
from rigidcli.bodies.density import PAIRS, VARIABLES, of_node, places, symmetric, values
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.environment import Formula
from rigidcli.language import tree

NET = 13
"""Points along each coordinate of a net in which a density is first looked at: 2,197 in a solid."""

WATCHED = 24
"""Points of the net from which the lowest density is searched for, by halved steps."""

FEW = 4
"""Points of the net from which the extremes of the argument of a function are searched for."""

PEAK = 5.0
"""A function that rises by this factor between the points of a net is not seen well enough by others."""

APART = 1e-3
"""Searches that end farther apart than this, in the unit box, have met a ridge and not one peak."""

NEGATIVE = 1e-12
"""How far below zero a density may come by rounding, in units of its largest value."""

SPREAD = 0.2
"""A body that is narrower, in units of the shape, is integrated once more about its own centre of mass."""


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
    return Field(density, charts, geometry, unit).properties()


def require_possible(density: Any, charts: Sequence[Chart], geometry: Any, unit: str) -> None:
    """Raise ValueProblem for a density that is negative somewhere, or has no value."""
    Field(density, charts, geometry, unit).require_possible()


class Field:
    """A density over the charts of a shape; `geometry` is that of the shape if it were uniform."""

    def __init__(self, formula: Formula, charts: Sequence[Chart], geometry: Any, unit: str) -> None:
        self.formula, self.charts, self.unit = formula, charts, unit
        self.root = formula.expression.root
        self.about = np.array(geometry.centre, dtype=np.float64)
        second = np.array(geometry.second, dtype=np.float64)
        self.size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
        self.names = tree.names_in(self.root)
        self.least = -np.inf

    def properties(self) -> MassProperties:
        """Mass, centre of mass and tensor, each with its error.

        Raises ValueProblem for a density that is negative somewhere, and ComputationError where the error
        is too large.
        """
        self.require_possible()
        mass, com, second, error = self._sums()
        spread = np.sqrt(second.diagonal())
        if (spread < SPREAD * self.size).any():
            self.about, self.size = com, np.maximum(2 * spread, cubature.NEAR * self.size)
            mass, com, second, error = self._sums()
        if not error <= cubature.WORST:
            raise _too_sudden()
        inertia = tensor.Inertia.of_sums(mass, com, mass * second)
        noise = error * mass * tensor.from_second_moments(1, np.outer(self.size, self.size))
        inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
        misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(self.size))
        return MassProperties(mass, com, inertia, misplaced, integrated=error)

    def _sums(self) -> tuple[float, Floats, Floats, float]:
        """The mass (kg), the centre of mass (3, m), the mean of r r^T about it (3 by 3, m^2), and an error.

        The error is that of the mass, and of the moments in units of the mass and of `size`. Moments are
        taken about the point `about`.
        """
        parts = [self._integral(chart, piece) for chart in self.charts for piece in range(chart.pieces)]
        sums = np.sum([part.values for part in parts], axis=0)
        mass = float(sums[0])
        if not mass > 0:
            where = "the density leaves no mass at the points where it was looked at"
            raise ValueProblem(f"{where}: {mass:.6g} kg; a peak may be narrower", path=("density",))
        error = sum(part.error * abs(part.values[0]) for part in parts) / mass
        first, second = sums[1:4] / mass, symmetric(sums[4:]) / mass
        second -= np.outer(first, first)
        np.fill_diagonal(second, np.maximum(second.diagonal(), 0.0))
        return mass, self.about + self.units * first, second * np.outer(self.units, self.units), float(error)

    @property
    def units(self) -> Floats:
        """The lengths (3, m) in which moments are taken."""
        return np.where(self.size > 0, self.size, 1.0)

    def _integral(self, chart: Chart, piece: int) -> cubature.Integral:
        """The ten moments of the density over one piece of a chart, in the coordinates on which it hangs.

        Along the others the integrands are simple, and a rule with a few nodes is exact.
        """
        chart = min((chart, *chart.slices), key=lambda each: self._moving(each).sum())
        moving = self._moving(chart)
        still = np.flatnonzero(~moving).tolist()
        rules = [chart.rule(k) for k in still]
        nodes = np.array(list(product(*(own for own, _ in rules)))).T.reshape(len(still), -1 if still else 1)
        weights = np.array([math.prod(each) for each in product(*(own for _, own in rules))])

        def whole(points: Floats, nodes: Floats) -> Floats:
            """Points in all coordinates (1 + d by n m), for those in some of them and m nodes."""
            found = np.empty((1 + moving.size, points.shape[1], nodes.shape[1]))
            found[0] = piece
            found[1 + np.flatnonzero(moving)] = points[:, :, None]
            found[1 + np.array(still, dtype=int)] = nodes[:, None]
            return found.reshape(len(found), -1)

        def moments(points: Floats) -> Floats:
            density, known, measure = self._density(chart, whole(points, nodes))
            offset = [(known[name] - self.about[k]) / self.units[k] for k, name in enumerate("xyz")]
            mass = density * measure
            first = [mass * own for own in offset]
            second = [first[i] * offset[j] for i, j in PAIRS]
            return np.asarray(np.reshape([mass, *first, *second], (10, points.shape[1], -1)) @ weights)

        def part(node: tree.Node, level: float, points: Floats) -> Floats:
            """How far a part of the density is above a level."""
            known = self._located(chart, whole(points, nodes[:, :1]))[0]
            return np.nan_to_num(of_node(node, self.formula, known) - level)

        net = np.split(chart.net(NET), chart.pieces, axis=1)[piece]
        kinks = [partial(part, node, level) for node, level in _kinks(self.root) if self._varies(node)]
        peaks = list(self._peaks(chart, net, moving))
        turning = [turn_is_whole(chart.coordinates[k]) for k in np.flatnonzero(moving)]
        return cubature.integral(moments, turning, kinks, peaks, weights.size)

    def _varies(self, node: tree.Node) -> bool:
        return not tree.names_in(node).isdisjoint({*VARIABLES} - self.formula.constants.keys())

    def _peaks(self, chart: Chart, net: Floats, moving: Mask) -> Iterator[Floats]:
        """Points at which a function in the density is much higher than on a net of points (1 + d by n).

        They have the `moving` coordinates. A search goes on from the extremes of the function's argument. The
        function is compared with a net of which no point is at a place that people like.

        Raises ComputationError for a narrow ridge, of which boxes about a point would see a part only.
        """
        beside = np.vstack([net[:1], 0.0137 + 0.9683 * net[1:]])
        here, there = (self._located(chart, points)[0] for points in (net, beside))
        whole = np.array([turn_is_whole(chart.coordinates[k]) for k in np.flatnonzero(moving)], dtype=bool)
        for node, inner in _functions(self.root):
            if not self._varies(inner):
                continue
            heights, usual = of_node(inner, self.formula, here), np.abs(of_node(node, self.formula, there))
            for sign in (1, -1):

                def argument(points: Floats, inner: tree.Node = inner, sign: int = sign) -> Floats:
                    at = self._located(chart, _with_piece(net, points))[0]
                    return np.nan_to_num(sign * of_node(inner, self.formula, at))

                start = net[1:, np.argsort(sign * heights)[:FEW]]
                ends = _with_piece(net, cubature.downhill(argument, start, 1 / (NET - 1)))
                highest = np.abs(of_node(node, self.formula, self._density(chart, ends)[1]))
                high = ends[1:, highest > PEAK * usual[np.isfinite(usual)].max()][moving]
                if np.isfinite(highest).all() and high.size:
                    across = np.abs(high - high[:, :1])
                    # A peak on the half-plane where an angle begins is met at both ends of the angle.
                    across[whole] = np.minimum(across[whole], 1 - across[whole])
                    if len(high) > 1 and across.max() > APART:
                        raise _too_sudden()
                    yield from high.T

    def _moving(self, chart: Chart) -> Mask:
        """The coordinates (d) of a chart on which variables of the density hang."""
        depth = len(chart.coordinates)
        found = np.zeros(depth, dtype=bool)
        for start, other in ((0.2137, 0.7391), (0.3719, 0.8963)):
            points = np.full((1 + depth, 1 + depth), start)
            points[1:][np.eye(depth, 1 + depth, 1, dtype=bool)] = other
            for piece in range(chart.pieces):
                points[0] = piece
                known = self._located(chart, points)[0]
                found |= np.any(
                    [known[name][1:] != known[name][0] for name in known if name in self.names], axis=0
                )
        return found

    def _located(self, chart: Chart, points: Floats) -> tuple[Mapping[str, Floats], Floats]:
        """What the variables of the density are at points of a chart, and the measure there."""
        spot = chart.at(points)
        return places(spot, chart.origin, self.names), spot.measure

    def _density(self, chart: Chart, points: Floats) -> tuple[Floats, Mapping[str, Floats], Floats]:
        """The density at points, their places and the measure there; refused where it is no density.

        It may be infinite at a point, where the integral is still finite.
        """
        known, measure = self._located(chart, points)
        density = values(self.formula, known)
        bad = np.flatnonzero(~(density >= self.least))
        if bad.size:
            self._refuse_near(chart, points[:, bad[:1]])
        return density, known, measure

    def _refuse_near(self, chart: Chart, point: Floats) -> NoReturn:
        """Raise ValueProblem for the density at a point (1 + d by 1), or where it is lowest near it."""
        known = self._located(chart, self._lowest(chart, point))[0]
        density = float(values(self.formula, known)[0])
        where = ", ".join(f"{known[name][0]:.6g}" for name in "xyz")
        what = f"negative ({density:.6g} {self.unit})" if np.isfinite(density) else "without a value"
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the shape", path=("density",))

    def _lowest(self, chart: Chart, points: Floats) -> Floats:
        """Points (1 + d by n) of one piece of a chart from which a search has gone downhill."""

        def density(places: Floats) -> Floats:
            return values(self.formula, self._located(chart, _with_piece(points, places))[0])

        return _with_piece(points, cubature.downhill(density, points[1:], 1 / (NET - 1)))

    def require_possible(self) -> None:
        """Raise ValueProblem for a density that is negative somewhere, or has no value.

        It is looked at on a net, and from the lowest points of the net a search goes on. What is narrower
        than the net may escape it; each point at which integrals are taken is looked at besides.
        """
        highest = 0.0
        for chart in self.charts:
            for net in np.split(chart.net(NET), chart.pieces, axis=1):
                density = self._density(chart, net)[0]
                highest = max(highest, float(np.where(np.isfinite(density), density, 0.0).max()))
                self.least = -NEGATIVE * highest
                watched = net[:, np.argsort(density, kind="stable")[:WATCHED]]
                self._density(chart, self._lowest(chart, watched))


def _too_sudden() -> ComputationError:
    return ComputationError(
        f"the density changes too much, or too suddenly, for a relative error of {cubature.WORST:g}",
        hint="give the body in `parts`, so that the density is smooth in each of them",
    )


def _with_piece(like: Floats, points: Floats) -> Floats:
    """Points (1 + d by n) for those without the first row, in the piece of others (1 + d by m)."""
    return np.vstack([np.full(points.shape[1], like[0, 0]), points])


def _functions(root: tree.Node) -> Iterator[tuple[tree.Node, tree.Node]]:
    """The functions, quotients and powers in a density that may be narrow, with their arguments."""
    for node in tree.nodes([root]):
        match node:
            case tree.Power(_, tree.Number(_, value)) if value == int(value):
                continue
            case tree.Call(_, (inner, *_)) | tree.Power(inner, _) | tree.Reciprocal(inner):
                yield node, inner


def _kinks(root: tree.Node) -> Iterator[tuple[tree.Node, float]]:
    """The arguments of functions in a density, and the levels where these have a kink, a jump or an end."""
    for node, inner in _functions(root):
        match node:
            case tree.Call("abs" | "sign" | "sqrt" | "log" | "atan2") | tree.Power(_, tree.Number()):
                yield inner, 0.0
            case tree.Call("asin" | "acos"):
                yield from ((inner, -1.0), (inner, 1.0))
