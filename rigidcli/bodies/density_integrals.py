"""Integrals of a density over a shape in floats, with an estimate of their error."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.bodies import cubature
from rigidcli.bodies.charts import Chart, right_angles
from rigidcli.bodies.cubature import Peaks
from rigidcli.bodies.density import (
    NEGATIVE,
    VARIABLES,
    centred,
    places,
    require_density,
    values,
)
from rigidcli.core import tensor
from rigidcli.core.arithmetic import EPS, Arithmetic, Floats, Mask
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError
from rigidcli.fields.environment import BoundExpression
from rigidcli.language import tree
from rigidcli.language.expression import array

if TYPE_CHECKING:
    from rigidcli.bodies.primitives import Figure

# Points along each coordinate of a net in which a density is first looked at: 2,197 in a solid.
POINTS_OF_NET = 13
SEARCHES_FROM_NET = 8  # points of the net from which the least value is searched for, by halved steps
SEARCHES_FROM_ANYWHERE = 100  # such searches from random places: one may miss a ridge, hardly all
# The quantile of the heights on a net that counts as the usual height of a function with ridges.
USUAL_QUANTILE = 0.95
RISE_OF_PEAK = 5.0  # a function has a peak where it is this many times its usual height
LAST_STEP = 1e-8  # the last step of a search, in units of the box: shorter than peaks that count
STEP_FROM_POINT = 1e-6  # how far beside a point without a value a density is looked at, in units of the box
# The highest degree of a polynomial for which a product rule is small: 23 by 46 by 38 nodes in a ball.
HIGHEST_DEGREE = 30
KINKED = ("abs", "sign", "atan2")  # functions that have a kink or a jump where their argument is zero
WORST_ERROR = 1e-4  # the largest relative error that an answer may have


def integrated(density: BoundExpression, figure: Figure, unit: str, n: Arithmetic) -> MassProperties:
    """Mass properties of a shape with a density that varies, in the `unit` of messages.

    Raises ValueProblem for a density that no body has, and ComputationError where integrals cannot be had.
    """
    if n.exact:
        from rigidcli.bodies.density_exact import exact_properties

        return exact_properties(density, figure.charts(), n)
    # Sums are taken about the centre of the uniform shape, in units of its spread.
    about, second = (np.array(part, dtype=np.float64) for part in figure.geometry()[1:])
    size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
    looked = looked_at(density, figure.charts(), unit)
    parts = [part.moments(about, np.where(size > 0, size, 1.0)) for part in looked]
    mass, centre, sums = centred(np.sum([integrals for integrals, _ in parts], axis=0))
    error = float(sum(own for _, own in parts) / mass)
    if not error <= WORST_ERROR:
        raise ComputationError(
            f"the density changes too much, or too suddenly, for a relative error of {WORST_ERROR:g}",
            hint="give the body in `parts`, so that the density is smooth in each of them",
        )
    np.fill_diagonal(sums, np.maximum(sums.diagonal(), 0.0))
    squares = np.outer(size, size)
    # Coordinates and products that the error of the integrals may have made are zero.
    com = tensor.rounded_off(about + size * centre, error * float(np.linalg.norm(size)))
    central = tensor.from_second_moments(1, sums * squares)
    central = tensor.rounded_off(central, error * mass * squares * (1 - tensor.IDENTITY))
    return MassProperties(float(mass), com, central, integrated=error)


def degree_of(formula: BoundExpression, r: int | None = None, s: int | None = None) -> int | None:
    """The degree of a density as a polynomial in the place; None where it is none.

    `r` and `s` are the degrees of these distances; of one that has none, even powers have a degree.
    """
    places: dict[str, int | None] = {"x": 1, "y": 1, "z": 1, "r": r, "s": s}
    degrees = {name: places[name] for name in places.keys() - formula.constants.keys()}

    def of(node: tree.Node) -> int | None:
        if isinstance(node, tree.Name):
            return degrees.get(node.name, 0)
        if isinstance(node, tree.Power) and tree.names_in(node.exponent).isdisjoint(degrees):
            exponent = float(array(node.exponent, formula.constants))
            if exponent > 0 and exponent % 2 == 0 and node.base in (tree.Name("r"), tree.Name("s")):
                return int(exponent)
            degree = of(node.base)
            if degree is not None and exponent > 0 and exponent % 1 == 0:
                return degree * int(exponent)
        inner = [of(operand) for operand in tree.operands(node)]
        known = [degree for degree in inner if degree is not None]
        if len(known) < len(inner):
            return None
        if isinstance(node, tree.Product):
            return sum(known)
        highest = max(known, default=0)
        return highest if isinstance(node, tree.Sum | tree.Negative) or highest == 0 else None

    return of(formula.expression.root)


def looked_at(density: Any, charts: Sequence[Chart], unit: str, is_searched: bool = True) -> list[ChartPart]:
    """The density over each chart.

    Raises ValueProblem where it is negative or has no value: at the points of a net, and where a search from
    its lowest points ends, if it `is_searched`. What is narrower than the net may escape it.
    """
    parts = [ChartPart(density, chart, unit) for chart in charts]
    heights = [part.value(part.root, part.net) for part in parts]
    every = np.hstack(heights)
    highest = every[np.isfinite(every)].max(initial=0.0)
    for part, own in zip(parts, heights, strict=True):
        part.least = -NEGATIVE * highest
        # Between points of the net, the least value of Chebyshev's polynomials is lower by half of this.
        if part.degree is not None and own.min() > 0.01 * part.degree**2 * highest:
            continue
        part.density(np.hstack([part.net, part.extremes(part.root, 1)]) if is_searched else part.net)
    return parts


class ChartPart:
    """A density over one chart, at points (d by n) of those coordinates of the unit box on which it hangs.

    Along the others the density stays the same, and a rule with a few nodes is exact for its moments.
    """

    def __init__(self, formula: BoundExpression, chart: Chart, unit: str) -> None:
        self.formula, self.chart, self.unit, self.least = formula, chart, unit, -np.inf
        self.root = formula.expression.root
        self.names = tree.names_in(self.root)
        net, depth = chart.net(POINTS_OF_NET), len(chart.coordinates)
        spot = chart.at(net)
        self.degree = degree_of(formula, *(None if part is None else 1 for part in (spot.r, spot.s)))
        at = places(spot, chart.origin, self.names)
        grids = [np.reshape(at[name], [POINTS_OF_NET] * depth) for name in self.names & at.keys()]
        moving = [any(np.ptp(grid, axis=k).any() for grid in grids) for k in range(depth)]
        self.moving = np.array(moving, dtype=bool)
        self.net = net[self.moving][:, (net[~self.moving] == 0).all(axis=0)]
        self.pieces = [right_angles(chart.coordinates[k]) for k in range(depth) if moving[k]]
        rules = [chart.rule(k) for k in range(depth) if not moving[k]]
        self.nodes, self.weights = cubature.product_rule(rules)

    def at(self, points: Floats, nodes: Floats) -> tuple[Floats, dict[str, Floats]]:
        """The measure and the variables at the points (n), for each of m nodes in the other coordinates."""
        whole = np.empty((self.moving.size, points.shape[1], nodes.shape[1]))
        whole[self.moving], whole[~self.moving] = points[:, :, None], nodes[:, None]
        spot = self.chart.at(whole.reshape(self.moving.size, -1))
        return spot.measure, places(spot, self.chart.origin, self.names)

    def value(self, node: tree.Node, points: Floats) -> Floats:
        """The values (n) of a part of the formula."""
        return values(node, self.formula, self.at(points, self.nodes[:, :1])[1])

    def density(self, points: Floats) -> tuple[Floats, Floats]:
        """The mass in the measure of the unit box (n m), and the places (3 by n m, m), at each of m nodes.

        It may be infinite at a point, where the integral is still finite. Raises ValueProblem where there is
        no density, or a negative one.
        """
        measure, at = self.at(points, self.nodes)
        density, place = values(self.root, self.formula, at), np.array([at[axis] for axis in "xyz"])
        if np.isnan(density).any():
            # Such as 0/0: a density without a value at single points has one beside them.
            steps = STEP_FROM_POINT * np.where(points < 0.5, 1, -1) * (1 + np.arange(len(points)))[:, None]
            beside = values(self.root, self.formula, self.at(points + steps, self.nodes)[1])
            density = np.where(np.isnan(density), beside, density)
        require_density(density, place, self.least, self.unit)
        with np.errstate(invalid="ignore"):  # where a density without bounds meets a vanishing measure
            return density * measure, place

    def extremes(self, node: tree.Node, sign: int) -> Floats:
        """Points at which a part of the formula is least (1) or largest (-1), by searches.

        They begin at the best points of the net, and at random ones.
        """

        def height(points: Floats) -> Floats:
            return np.nan_to_num(sign * self.value(node, points))

        best = np.argsort(height(self.net), kind="stable")[:SEARCHES_FROM_NET]
        others = np.random.default_rng(1).random((len(self.net), SEARCHES_FROM_ANYWHERE))
        start = np.hstack([self.net[:, best], others])
        return cubature.downhill(height, start, 1 / (POINTS_OF_NET - 1), LAST_STEP)

    def moments(self, about: Floats, units: Floats) -> tuple[Floats, float]:
        """The integrals (10) of the density times products of 1, x, y, z, and their error.

        Places are seen from the point `about` (3, m), in `units` (3, m).
        """

        def moments(points: Floats) -> Floats:
            mass, place = self.density(points)
            place -= about[:, None]
            place /= units[:, None]
            products = np.empty((10, mass.size))  # in the order of FIRST and SECOND
            products[0], products[1:4] = mass, mass * place
            products[4:7], products[7:9] = products[1] * place, products[2] * place[1:]
            products[9] = products[3] * place[2]
            return np.asarray(products.reshape(10, -1, self.weights.size) @ self.weights)

        if self.degree is not None and self.degree <= HIGHEST_DEGREE:
            # One product rule is exact: all coordinates of the chart are then its own.
            chart, self.moving = self.chart, np.ones_like(self.moving)
            rules = [chart.rule(k, self.degree) for k in range(self.moving.size)]
            points, weights = cubature.product_rule(rules)
            self.nodes, self.weights = np.empty((0, 1)), np.ones(1)
            integrals = moments(points) @ weights
            return integrals, EPS * abs(integrals[0])
        peaks, is_kinked = self._peaks()
        integrals, error = cubature.integral(
            moments, peaks, self.pieces, self.weights.size, is_kinked=is_kinked
        )
        return integrals, error * abs(integrals[0])

    def _peaks(self) -> tuple[Peaks, bool]:
        """The peaks of the functions in the formula, and whether one of them has kinks or jumps."""
        is_kinked, places, bound = False, [self.net[:, :0]], [self.net[:, :0] > 0]
        for function in tree.nodes([self.root]):
            node = _argument(function)
            if node is None or tree.names_in(node).isdisjoint({*VARIABLES} - self.formula.constants.keys()):
                continue
            ends = [self.extremes(node, sign) for sign in (1, -1)]
            low, high = (self.value(node, points) for points in ends)
            is_kinked |= low.min() < 0 < high.max() and getattr(function, "function", None) in KINKED
            # A net that misses places such as 0, 1/2 and 1, where people put peaks.
            usual = self._heights(function, 0.0137 + 0.9683 * self.net)
            of_ridge = RISE_OF_PEAK * np.quantile(usual, USUAL_QUANTILE)
            for points in ends:
                self.density(points)  # which is refused where it is negative in a narrow place
                heights = self._heights(function, points)
                places.append(points[:, heights > max(of_ridge, heights.max() / RISE_OF_PEAK)])
                bound.append(self._is_bound(function, places[-1]))
        return Peaks(partial(self._heights, self.root), np.hstack(places), np.hstack(bound)), is_kinked

    def _heights(self, function: tree.Node, points: Floats) -> Floats:
        return np.nan_to_num(np.abs(self.value(function, points)), posinf=0.0)

    def _is_bound(self, function: tree.Node, points: Floats) -> Mask:
        """Whether a function falls along each coordinate from its peaks (d by n).

        It does not along the angles at the middle of a ball.
        """
        least, falls = self._heights(function, points) / RISE_OF_PEAK, np.empty(points.shape, dtype=bool)
        for k in range(len(points)):
            along = np.repeat(points, POINTS_OF_NET, axis=1)
            along[k] = np.tile(np.linspace(0, 1, POINTS_OF_NET), points.shape[1])
            falls[k] = self._heights(function, along).reshape(-1, POINTS_OF_NET).min(axis=1) <= least
        return falls


def _argument(node: tree.Node) -> tree.Node | None:
    """The argument of a function, quotient or power that may be narrow; None of other parts of a density."""
    match node:
        case tree.Power(_, tree.Number(_, value)) if value == int(value):
            return None
        case tree.Call(_, (inner, *_)) | tree.Power(inner, _) | tree.Reciprocal(inner):
            return inner
    return None
