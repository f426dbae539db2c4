"""Integrals of a density over a shape, in floats, with an estimate of their error."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rigidcli.bodies import cubature
from rigidcli.bodies.charts import Chart, turn_is_whole
from rigidcli.bodies.density import PAIRS, of_node, places, symmetric, values
from rigidcli.core import tensor
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.environment import Formula
from rigidcli.language import tree

ROUGH = 1e-4
"""The largest relative error of an answer: what is further off is refused."""

NET = 13
"""Points along each coordinate of a net in which a density is first looked at: 2,197 in a solid."""

FEW = 4
"""Points of the net from which the extremes of the argument of a function are searched for."""

WATCHED = 24
"""Points of the net from which the lowest density is searched for, by halved steps."""

NEGATIVE = 1e-12
"""How far below zero a density may come by rounding, in units of its largest value."""

SPREAD = 0.2
"""A body that is narrower, in units of the shape, is integrated once more about its own centre of mass."""

NARROWEST = 1e-6
"""The least unit of length of the moments, in units of the shape."""

MOST_WAVES = 40
"""The most half waves of a sine whose zeros are cuts: more are seen by the halving of boxes, if at all."""


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


class Sums(NamedTuple):
    """The mass (kg), the centre of mass (3, m) and the mean of r r^T about it (3 by 3, m^2).

    `error` is that of the mass, and of the moments in units of the mass and of `size` (3, m).
    """

    mass: float
    com: Floats
    second: Floats
    error: float


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
        found = self._sums()
        spread = np.sqrt(found.second.diagonal())
        if (spread < SPREAD * self.size).any():
            self.about, self.size = found.com, np.maximum(2 * spread, NARROWEST * self.size)
            found = self._sums()
        mass, com, second, error = found
        if not error <= ROUGH:
            raise ComputationError(
                f"the density changes too much, or too suddenly, for a relative error of {ROUGH:g}",
                hint="give the body in `parts`, so that the density is smooth in each of them",
            )
        inertia = tensor.Inertia.of_sums(mass, com, mass * second)
        noise = error * mass * tensor.from_second_moments(1, np.outer(self.size, self.size))
        inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
        misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(self.size))
        return MassProperties(mass, com, inertia, misplaced, integrated=error)

    def _sums(self) -> Sums:
        """The integrals, with moments taken about the point `about` in units of `size`."""
        parts = [self._integral(chart, piece) for chart in self.charts for piece in range(chart.pieces)]
        sums = np.sum([part.values for part in parts], axis=0)
        mass = float(sums[0])
        if not mass > 0:
            where = "the density leaves no mass at the points where it was looked at"
            raise ValueProblem(f"{where}: {mass:.6g} kg; a peak may be narrower", path=("density",))
        error = sum(part.error * abs(part.values[0]) for part in parts) / mass
        first, pairs = sums[1:4] / mass, sums[4:] / mass
        second = symmetric(pairs) - np.outer(first, first)
        second[[0, 1, 2], [0, 1, 2]] = np.maximum(second.diagonal(), 0.0)
        units = self.units
        return Sums(mass, self.about + units * first, second * np.outer(units, units), float(error))

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
            found = np.empty((10, density.size))
            offset = [(known[name] - self.about[k]) / self.units[k] for k, name in enumerate("xyz")]
            np.multiply(density, measure, out=found[0])
            for k in range(3):
                np.multiply(found[0], offset[k], out=found[1 + k])
            for k, (i, j) in enumerate(PAIRS):
                np.multiply(found[1 + i], offset[j], out=found[4 + k])
            return np.asarray(found.reshape(10, points.shape[1], -1) @ weights)

        def height(node: tree.Node, points: Floats) -> Floats:
            """The values of a part of the density."""
            known, _ = self._located(chart, whole(points, nodes[:, :1]))
            return np.nan_to_num(of_node(node, self.formula, known))

        net_points = chart.net(NET)
        net = self._located(chart, net_points)[0]
        steep = {node: (inner, heights) for node, inner, heights in self._steep(net)}
        surfaces = [cubature.Surfaces(partial(height, inner), heights) for inner, heights in steep.values()]
        narrow = any(self._is_narrow(chart, net_points, node, inner) for node, (inner, _) in steep.items())
        smooth = not any(isinstance(node, tree.Call) and node.function in KINKED for node in steep)
        turning = [turn_is_whole(chart.coordinates[k]) for k in np.flatnonzero(moving)]
        return cubature.integral(moments, surfaces, turning, smooth and not narrow)

    def _is_narrow(self, chart: Chart, net: Floats, node: tree.Node, inner: tree.Node) -> bool:
        """Whether a function in the density is much higher between the points of a net than on it.

        A search goes on from the extremes of its argument on the net; the density is looked at there.
        """
        known, _ = self._located(chart, net)
        heights, seen = (of_node(each, self.formula, known) for each in (inner, node))
        for sign in (1, -1):

            def argument(places: Floats, sign: int = sign) -> Floats:
                at = self._located(chart, np.vstack([np.zeros(places.shape[1]), places]))[0]
                return np.nan_to_num(sign * of_node(inner, self.formula, at))

            ends = net[:, np.argsort(sign * heights)[:FEW]]
            ends[1:] = cubature.downhill(argument, ends[1:], 1 / (NET - 1))
            _, at, _ = self._density(chart, ends)
            highest = np.abs(of_node(node, self.formula, at))
            if np.isfinite(highest).all() and highest.max() > NARROW * np.abs(seen[np.isfinite(seen)]).max():
                return True
        return False

    def _steep(self, net: Mapping[str, Floats]) -> Iterator[tuple[tree.Node, tree.Node, tuple[float, ...]]]:
        """Functions in the density, their arguments, and the heights of these at which they have a kink, or
        between which they change quickly."""
        for node in tree.nodes([self.root]):
            match node:
                case tree.Call(function, (argument, *_)):
                    inner, kind = argument, function
                case tree.Power(base, tree.Number(_, value)) if value == int(value):
                    continue
                case tree.Power(base, tree.Number()):
                    inner, kind = base, "root"
                case tree.Power(base, _) | tree.Reciprocal(base):
                    inner, kind = base, "inverse"
                case _:
                    continue
            if not tree.names_in(inner) & set(net):
                continue
            values = of_node(inner, self.formula, net)
            values = values[np.isfinite(values)]
            heights = _heights(kind, float(values.min()), float(values.max())) if values.size else []
            if heights:
                yield node, inner, tuple(sorted(set(heights)))

    def _moving(self, chart: Chart) -> Mask:
        """The coordinates (d) of a chart on which variables of the density hang."""
        depth = len(chart.coordinates)
        found = np.zeros(depth, dtype=bool)
        for start, other in ((0.2137, 0.7391), (0.3719, 0.8963)):
            points = np.full((1 + depth, chart.pieces), start)
            points[0] = np.arange(chart.pieces)
            here = self._located(chart, points)[0]
            for k in range(depth):
                moved = points.copy()
                moved[1 + k] = other
                there = self._located(chart, moved)[0]
                found[k] |= any((here[name] != there[name]).any() for name in here if name in self.names)
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
        point = self._lowest(chart, point)
        known, _ = self._located(chart, point)
        density = float(values(self.formula, known)[0])
        where = ", ".join(f"{known[name][0]:.6g}" for name in "xyz")
        what = f"negative ({density:.6g} {self.unit})" if np.isfinite(density) else "without a value"
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the shape", path=("density",))

    def _lowest(self, chart: Chart, points: Floats) -> Floats:
        """Points (1 + d by n) of a chart from which a search has gone downhill."""

        def density(places: Floats) -> Floats:
            return values(self.formula, self._located(chart, np.vstack([points[:1], places]))[0])

        return np.vstack([points[:1], cubature.downhill(density, points[1:], 1 / (NET - 1))])

    def require_possible(self) -> None:
        """Raise ValueProblem for a density that is negative somewhere, or has no value.

        It is looked at on a net, and from the lowest points of the net a search goes on. What is narrower
        than the net may escape it; each point at which integrals are taken is looked at besides.
        """
        highest = 0.0
        for chart in self.charts:
            net = chart.net(NET)
            density, _, _ = self._density(chart, net)
            highest = max(highest, float(np.where(np.isfinite(density), density, 0.0).max()))
            low = self._lowest(chart, net[:, np.argsort(density, kind="stable")[:WATCHED]])
            density = values(self.formula, self._located(chart, low)[0])
            self.least = -NEGATIVE * highest
            if not (density >= self.least).all():
                self._refuse_near(chart, low[:, [int(np.argmin(np.nan_to_num(density, nan=-np.inf)))]])


NARROW = 5.0
"""A function that rises by this factor between the points of a net is not seen well enough by others."""

KINKED = frozenset({"abs", "sign", "sqrt", "log", "asin", "acos", "atan2"})
"""Functions with a kink, a jump or an end, where no product of Gauss's rules converges quickly."""


def _heights(kind: str, low: float, high: float) -> list[float]:
    """The levels between which a function of this kind is smooth, for arguments between about two values."""
    match kind:
        case "abs" | "sign" | "sqrt" | "log" | "root" | "atan2":
            return [0.0]
        case "asin" | "acos":
            return [-1.0, 1.0]
        case "tanh" | "atan":
            return [side * level for level in (0.0, 1.5, 6.0, 20.0) for side in (1, -1)]
        case "exp":
            return [top - below for top in {0.0, max(high, 0.0)} for below in (1, 4, 10, 20, 36)]
        case "sin" | "cos" | "tan" | "cot" | "sec" | "csc":
            waves = range(math.ceil(low / math.pi), math.floor(high / math.pi) + 1)
            return [wave * math.pi for wave in waves] if 2 < len(waves) <= MOST_WAVES else []
        case "inverse":
            sides = [side for side, is_there in ((1, high > 0), (-1, low < 0)) if is_there]
            return [0.0, *(max(-low, high) * side / 10.0**power for power in range(1, 11) for side in sides)]
        case _:
            return []
