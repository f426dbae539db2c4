"""Integrals of a density over a shape, in floats, with a bound on their error by an estimate."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rigidcli.bodies.density import PAIRS, of_node, places, symmetric, values
from rigidcli.bodies.density_terms import Term, terms
from rigidcli.core import line_search, quadrature, tensor
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.core.boxes import Boxes, joined
from rigidcli.core.charts import Chart
from rigidcli.core.cuts import Cuts
from rigidcli.core.kinks import Narrow
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.environment import Formula
from rigidcli.language.tree import Name, Node, names_in

ROUGH = 1e-6
"""The relative error that integrals may have: densities that need more work for it are refused."""

GOAL = 1e-12
"""The relative error that is aimed at."""

LOCATED = 1e-2
"""The relative error with which it is found where a body is, and how wide."""

NARROWEST = 1e-6
"""The least unit of length of the moments, in units of the shape."""

WORK = 2e9
"""Operations on numbers that are spent on a body: two to five seconds, as functions take their time."""

EACH_POINT = 300
"""The operations that one point costs besides those of the density, for ten moments."""

EACH_PLACE = 60
"""The operations that a point costs at which only a part of the density is worked out."""

OPERATION_LENGTH = 3
"""So many characters of an expression stand for an operation, about."""

NET = 13
"""Points along each coordinate of a net in which a density is first looked at: 2,197 in a solid."""

WATCHED = 24
"""Points of the net from which the lowest and the highest density are searched for."""

NEGATIVE = 1e-12
"""How far below zero a density may come by rounding, in units of its largest value."""

ENDLESS = 1.2
"""What a density with an end does not grow by twice, when a search for its largest value comes from 10^-4 to
10^-7 of the shape, and from there to 10^-10. The logarithm of the distance does."""

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
    """Raise ValueProblem for a density that is negative or infinite somewhere; see `Field`."""
    Field(density, charts, geometry, unit).require_possible()


class Sums(NamedTuple):
    """The mass (kg), the centre of mass (3, m) and the mean of r r^T about it (3 by 3, m^2).

    `error` bounds those of the mass, and of the moments in units of the mass and of `size` (3, m).
    """

    mass: float
    com: Floats
    second: Floats
    size: Floats
    error: float


class Field:
    """A density over the charts of a shape; `geometry` is that of the shape if it were uniform."""

    def __init__(self, formula: Formula, charts: Sequence[Chart], geometry: Any, unit: str) -> None:
        self.formula, self.charts, self.unit = formula, charts, unit
        self.about = np.array(geometry.centre, dtype=np.float64)
        second = np.array(geometry.second, dtype=np.float64)
        self.size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
        self.names = names_in(formula.expression.root)
        self.budget = quadrature.Budget(WORK)
        self.least = -np.inf

    def properties(self) -> MassProperties:
        """Mass, centre of mass and tensor, each with a bound on its error.

        A body that is much narrower than the shape is integrated once more about its own centre of mass, as
        far as that can be had. Raises ValueProblem for a density that is negative or infinite somewhere, and
        ComputationError where the integrals would take too long.
        """
        self.require_possible()
        try:
            integrands = self._integrands()
            rough = self._sums(integrands, LOCATED, LOCATED)
            spread = np.sqrt(rough.second.diagonal())
            if (spread < SPREAD * self.size).any():
                self.about, self.size = rough.com, np.maximum(2 * spread, NARROWEST * self.size)
                integrands = self._integrands()
            found = self._sums(integrands, ROUGH, GOAL)
        except quadrature.Exhausted:
            raise _too_sudden() from None
        mass, com, second, size, error = found
        inertia = tensor.Inertia.of_sums(mass, com, mass * second)
        noise = error * mass * tensor.from_second_moments(1, np.outer(size, size))
        inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
        misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(size))
        return MassProperties(mass, com, inertia, misplaced, integrated=error)

    def _sums(self, integrands: Sequence[quadrature.Integrand], rough: float, goal: float) -> Sums:
        """The integrals, with moments taken about the point `about` in units of `size`."""
        found = quadrature.integral(integrands, rough, goal, self.budget)
        mass = float(found.values[0])
        if not mass > 0:
            where = "the density leaves no mass at the points where it was looked at"
            raise ValueProblem(f"{where}: {mass:.6g} kg; a peak may be narrower", path=("density",))
        first, pairs = found.values[1:4] / mass, found.values[4:] / mass
        second = symmetric(pairs) - np.outer(first, first)
        second[[0, 1, 2], [0, 1, 2]] = np.maximum(second.diagonal(), 0.0)
        units = self.units
        return Sums(
            mass, self.about + units * first, second * np.outer(units, units), self.size, found.error / mass
        )

    @property
    def units(self) -> Floats:
        """The lengths (3, m) in which moments are taken."""
        return np.where(self.size > 0, self.size, 1.0)

    def _integrands(self) -> list[quadrature.Integrand]:
        """The terms of the density with their first and second moments, over each chart."""
        parts = terms(self.formula.expression.root)
        return [self._integrand(term, len(parts) == 1, chart) for term in parts for chart in self.charts]

    def _integrand(self, term: Term, is_all: bool, chart: Chart) -> quadrature.Integrand:
        """One term over one chart, in the coordinates on which it hangs.

        Along the others the integrands are simple, and a rule with a few nodes is exact.
        """
        names = names_in(term.node)
        is_askew = bool(term.narrow) and names.isdisjoint(
            "rs"
        )  # strips have no axis round which it would turn
        found = (*chart.slices, chart) if is_askew else (chart, *chart.slices)
        chart = min(found, key=lambda each: self._moving(each, names).sum())
        moving = self._moving(chart, names)
        still = np.flatnonzero(~moving).tolist()
        rules = [chart.rule(k) for k in still]
        nodes = np.array(list(product(*(own for own, _ in rules)))).T
        weights = np.array([math.prod(each) for each in product(*(own for _, own in rules))])

        def whole(points: Floats, nodes: Floats) -> Floats:
            """Points in all coordinates (1 + d by n m), for those in some of them and m nodes."""
            if not len(still):
                return points
            found = np.empty((1 + moving.size, points.shape[1], nodes.shape[1]))
            found[np.append(0, 1 + np.flatnonzero(moving))] = points[:, :, None]
            found[1 + np.array(still)] = nodes[:, None]
            return found.reshape(len(found), -1)

        def moments(points: Floats) -> Floats:
            density, known, measure = self._density(chart, whole(points, nodes))
            if not is_all:
                density = of_node(term.node, self.formula, known)
            found = np.empty((10, density.size))
            offset = [(known[name] - self.about[k]) / self.units[k] for k, name in enumerate("xyz")]
            np.multiply(density, measure, out=found[0])
            for k in range(3):
                np.multiply(found[0], offset[k], out=found[1 + k])
            for k, (i, j) in enumerate(PAIRS):
                np.multiply(found[1 + i], offset[j], out=found[4 + k])
            return found.reshape(10, points.shape[1], -1) @ weights if len(still) else found

        def part(node: Node, points: Floats) -> Floats:
            return of_node(node, self.formula, self._located(chart, whole(points, nodes[:, :1]))[0])

        spot = chart.at(np.zeros((1 + moving.size, 1)))
        simple = [Name(name) for name in "rs" if getattr(spot, name) is not None]
        length = len(self.formula.expression.text) / OPERATION_LENGTH
        spending = self.budget.spending
        cuts = [cut for cut, moves in zip(chart.cuts(), moving, strict=True) if moves]
        narrow = [
            Narrow(
                spending(partial(part, each.core), EACH_PLACE),
                spending(partial(part, each.argument), EACH_PLACE),
                spending(partial(part, each.guide), EACH_PLACE),
                each.function,
                each.steep,
            )
            for each in term.narrow
            if each.core not in simple
        ]
        boxes = joined(Boxes.between(piece, cuts) for piece in range(chart.pieces))
        each = (EACH_POINT + length) * len(weights)
        return quadrature.Integrand(spending(moments, each), Cuts(narrow, boxes))

    def _moving(self, chart: Chart, names: Collection[str]) -> Mask:
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
                found[k] |= any((here[name] != there[name]).any() for name in here if name in names)
        return found

    def _located(self, chart: Chart, points: Floats) -> tuple[Mapping[str, Floats], Floats]:
        """What the variables of the density are at points of a chart, and the measure there."""
        spot = chart.at(points)
        return places(spot, chart.origin, self.names), spot.measure

    def _density(self, chart: Chart, points: Floats) -> tuple[Floats, Mapping[str, Floats], Floats]:
        """The density at points, their places and the measure there; refused where it is no density."""
        known, measure = self._located(chart, points)
        density = values(self.formula, known)
        bad = np.flatnonzero(~(np.isfinite(density) & (density >= self.least)))
        if bad.size:
            self._refuse_near(chart, points[:, bad[:1]])
        return density, known, measure

    def _signed(self, chart: Chart, sign: int, points: Floats) -> Floats:
        return sign * self._density(chart, points)[0]

    def _refuse_near(self, chart: Chart, point: Floats) -> NoReturn:
        """Raise ValueProblem for the density at a point (1 + d by 1), or where it is lowest near it."""

        def density(points: Floats) -> Floats:
            return values(self.formula, self._located(chart, points)[0])

        if np.isfinite(density(point)).all():
            point, _ = line_search.lowest_points(density, point)
        self._refuse(density(point)[0], self._located(chart, point)[0], 0)

    def _refuse(self, density: float, known: Mapping[str, Floats], index: int, but: str = "") -> NoReturn:
        """Raise ValueProblem for the density at one of the points."""
        where = ", ".join(f"{known[name][index]:.6g}" for name in "xyz")
        what = f"negative ({density:.6g} {self.unit})" if np.isfinite(density) else "infinite"
        what = but or ("without a value" if np.isnan(density) else what)
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the shape", path=("density",))

    def require_possible(self) -> None:
        """Raise ValueProblem for a density that is negative or infinite.

        It is looked at on a net, and from the lowest and the highest points of the net a search goes on. What
        is narrower than the net may escape it; each point at which integrals are taken is looked at besides.
        """
        nets = [chart.net(NET) for chart in self.charts]
        seen = [self._density(chart, net)[0] for chart, net in zip(self.charts, nets, strict=True)]
        self.least = -NEGATIVE * max(float(density.max()) for density in seen)
        for chart, net, density in zip(self.charts, nets, seen, strict=True):
            order = np.argsort(density, kind="stable")
            for sign, watched in ((1, order[:WATCHED]), (-1, order[-WATCHED:])):
                signed = partial(self._signed, chart, sign)
                points, told = line_search.lowest_points(signed, net[:, watched])
                coarse, middle, fine = np.abs(told[[17, 34, 51]])
                endless = (fine > ENDLESS * middle) & (middle > ENDLESS * coarse)
                if sign < 0 and endless.any():
                    known, _ = self._located(chart, points)
                    self._refuse(np.inf, known, int(np.argmax(endless)), "without an upper bound")


def _too_sudden() -> ComputationError:
    return ComputationError(
        f"the density changes too much, or too suddenly, for a relative error of {ROUGH:g}",
        hint="give the body in `parts`, so that the density is smooth in each of them",
    )
