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
from rigidcli.bodies.charts import Chart, right_angles
from rigidcli.bodies.density import PAIRS, VARIABLES, places, symmetric, values
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
    parts = [part.moments(about, units) for part in _parts(density, charts, unit)]
    sums = np.sum([part.values for part in parts], axis=0)
    mass = float(sums[0])
    if not mass > 0:
        where = "the density leaves no mass at the points where it was looked at"
        raise ValueProblem(f"{where}: {mass:.6g} kg; a peak may be narrower", path=("density",))
    error = float(sum(part.error * abs(part.values[0]) for part in parts)) / mass
    if not error <= WORST:
        raise _too_sudden()
    com = about + units * sums[1:4] / mass
    second = symmetric(sums[4:]) / mass - np.outer(sums[1:4], sums[1:4]) / mass**2
    np.fill_diagonal(second, np.maximum(second.diagonal(), 0.0))
    inertia = tensor.Inertia.of_sums(mass, com, mass * second * np.outer(units, units))
    noise = error * mass * tensor.from_second_moments(1, np.outer(size, size))
    inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
    misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(size))
    return MassProperties(mass, com, inertia, misplaced, integrated=error)


def require_possible(density: Any, charts: Sequence[Chart], unit: str) -> None:
    """Raise ValueProblem for a density that is negative somewhere, or has no value.

    It is looked at on a net, and from the lowest points of the net a search goes on. What is narrower than
    the net may escape it.
    """
    for _ in _parts(density, charts, unit):
        pass


def _parts(density: Formula, charts: Sequence[Chart], unit: str) -> Iterator[_Part]:
    least = -np.inf
    for chart in charts:
        part = _Part(density, chart, unit)
        found = part.density(part.net)[0]
        highest = float(np.where(np.isfinite(found), found, 0.0).max())
        part.least = least = max(least, -NEGATIVE * highest) if highest > 0 else least
        part.density(part.lowest(part.net[:, np.argsort(found, kind="stable")[:WATCHED]]))
        yield part


class _Part:
    """A density over one chart, whose points (d by n) are those of the unit box.

    It has `kinks` and `peaks` as in `cubature.integral`, in those of the coordinates on which it hangs.
    """

    def __init__(self, formula: Formula, chart: Chart, unit: str) -> None:
        self.formula, self.chart, self.unit, self.least = formula, chart, unit, -np.inf
        self.names = tree.names_in(formula.expression.root)
        self.net = chart.net(NET)

    def at(self, points: Floats) -> tuple[Mapping[str, Floats], Floats]:
        """What the variables of the density are at points, and the measure there."""
        spot = self.chart.at(points)
        return places(spot, self.chart.origin, self.names), spot.measure

    def value(self, node: tree.Node, points: Floats) -> Floats:
        """The values (n) of a part of the formula."""
        return values(node, self.formula, self.at(points)[0])

    def density(self, points: Floats) -> tuple[Floats, Mapping[str, Floats], Floats]:
        """The density at points, their places and the measure there; refused where it is no density.

        It may be infinite at a point, where the integral is still finite.
        """
        known, measure = self.at(points)
        density = values(self.formula.expression.root, self.formula, known)
        bad = np.flatnonzero(~(density >= self.least))
        if bad.size:
            self._refuse_near(points[:, bad[:1]])
        return density, known, measure

    def lowest(self, points: Floats) -> Floats:
        """The points after a search for the lowest density."""
        return cubature.downhill(partial(self.value, self.formula.expression.root), points, 1 / (NET - 1))

    def _refuse_near(self, point: Floats) -> NoReturn:
        """Raise ValueProblem for the density where it is lowest near a point (d by 1)."""
        known = self.at(self.lowest(point))[0]
        density = float(values(self.formula.expression.root, self.formula, known)[0])
        where = ", ".join(f"{known[name][0]:.6g}" for name in "xyz")
        what = f"negative ({density:.6g} {self.unit})" if np.isfinite(density) else "without a value"
        raise ValueProblem(f"the density is {what} at x, y, z = ({where}) m of the shape", path=("density",))

    def moments(self, about: Floats, units: Floats) -> cubature.Integral:
        """The integrals of the density, of it times x, y, z, and of it times their products (10).

        Places are seen from the point `about` (3, m), in `units` (3, m). Along coordinates on which the
        density does not hang the integrands are simple, and a rule with a few nodes is exact.
        """
        moving = self._moving()
        still = np.flatnonzero(~moving).tolist()
        rules = [self.chart.rule(k) for k in still]
        nodes = np.array(list(product(*(own for own, _ in rules)))).T.reshape(len(still), -1 if still else 1)
        weights = np.array([math.prod(each) for each in product(*(own for _, own in rules))])

        def whole(points: Floats, nodes: Floats) -> Floats:
            """Points in all coordinates (d by n m), for n points in some of them and m nodes."""
            found = np.empty((moving.size, points.shape[1], nodes.shape[1]))
            found[moving], found[still] = points[:, :, None], nodes[:, None]
            return found.reshape(moving.size, -1)

        def moments(points: Floats) -> Floats:
            density, known, measure = self.density(whole(points, nodes))
            offset = [(known[name] - about[k]) / units[k] for k, name in enumerate("xyz")]
            mass = density * measure
            first = [mass * own for own in offset]
            second = [first[i] * offset[j] for i, j in PAIRS]
            return np.asarray(np.reshape([mass, *first, *second], (10, points.shape[1], -1)) @ weights)

        def kink(node: tree.Node, points: Floats) -> Floats:
            return np.nan_to_num(self.value(node, whole(points, nodes[:, :1])))

        kinks, peaks = [], list[Floats]()
        for function, node in _functions(self.formula.expression.root):
            if tree.names_in(node).isdisjoint({*VARIABLES} - self.formula.constants.keys()):
                continue
            ends = self._extremes(node)
            low, *_, high = np.sort(self.value(node, ends))
            if low < 0 < high and isinstance(function, tree.Call) and function.function in KINKED:
                kinks.append(
                    lambda points, node=node: np.nan_to_num(self.value(node, whole(points, nodes[:, :1])))
                )
            peaks += self._peaks(function, ends, moving)
        pieces = [right_angles(self.chart.coordinates[k]) for k in np.flatnonzero(moving)]
        return cubature.integral(moments, [] if peaks else kinks, peaks, pieces, weights.size)

    def _moving(self) -> Mask:
        """The coordinates (d) of the chart on which variables of the density hang."""
        depth = len(self.chart.coordinates)
        found = np.zeros(depth, dtype=bool)
        for start, other in ((0.2137, 0.7391), (0.3719, 0.8963)):
            points = np.full((depth, 1 + depth), start)
            points[np.eye(depth, 1 + depth, 1, dtype=bool)] = other
            known = self.at(points)[0]
            found |= np.any([known[name][1:] != known[name][0] for name in self.names & known.keys()], axis=0)
        return found

    def _extremes(self, node: tree.Node) -> Floats:
        """Points at which a part of the formula is largest or least, by searches from those of the net."""
        heights = self.value(node, self.net)

        def height(sign: int, points: Floats) -> Floats:
            return np.nan_to_num(sign * self.value(node, points))

        starts = [(sign, self.net[:, np.argsort(sign * heights)[:FEW]]) for sign in (1, -1)]
        return np.hstack(
            [cubature.downhill(partial(height, sign), start, 1 / (NET - 1)) for sign, start in starts]
        )

    def _peaks(self, function: tree.Node, ends: Floats, moving: Mask) -> list[Floats]:
        """Those of the ends of two searches at which a function in the density is much higher than on a net.

        No point of that net is at a place that people like. Raises ComputationError for a narrow ridge, of
        which boxes about a point would see a part only.
        """
        usual = np.abs(self.value(function, 0.0137 + 0.9683 * self.net))
        self.density(ends)
        highest = np.abs(self.value(function, ends))
        is_high = np.isfinite(highest) & (highest > PEAK * usual[np.isfinite(usual)].max())
        whole = [right_angles(self.chart.coordinates[k]) == 4 for k in np.flatnonzero(moving)]
        found = []
        for half in np.split(np.arange(is_high.size), 2):
            high = ends[:, half[is_high[half]]][moving]
            across = np.abs(high - high[:, :1])
            # A peak where an angle begins is met at both ends of the angle.
            across[whole] = np.minimum(across[whole], 1 - across[whole])
            if across.max(initial=0.0) > APART:
                raise _too_sudden()
            found += list(high.T)
        return found


def _too_sudden() -> ComputationError:
    return ComputationError(
        f"the density changes too much, or too suddenly, for a relative error of {WORST:g}",
        hint="give the body in `parts`, so that the density is smooth in each of them",
    )


def _functions(root: tree.Node) -> Iterator[tuple[tree.Node, tree.Node]]:
    """The functions, quotients and powers in a density that may be narrow, with their arguments."""
    for node in tree.nodes([root]):
        match node:
            case tree.Power(_, tree.Number(_, value)) if value == int(value):
                continue
            case tree.Call(_, (inner, *_)) | tree.Power(inner, _) | tree.Reciprocal(inner):
                yield node, inner
