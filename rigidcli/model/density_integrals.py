"""Integrals of a density over a shape, in floats, with a bound on their error by an estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rigidcli.core import quadrature, tensor
from rigidcli.core.arithmetic import Arithmetic, Floats
from rigidcli.core.charts import Chart, Spot
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.model.density import VARIABLES, of_node, places, values
from rigidcli.model.environment import Formula
from rigidcli.symbolic.language.tree import Name, Node, Power, Reciprocal, insides, names_in, rebuilt

ROUGH = 1e-6
"""The relative error that integrals may have: densities that need more work for it are refused."""

EFFORTS = ((1e-12, 1.5e9), (ROUGH, 2e9))
"""Relative errors to be tried for, and so many operations on numbers for each: about one second and three."""

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

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""The entries of a symmetric matrix."""


def integrated(
    density: Formula, charts: Sequence[Chart], geometry: Any, unit: str, n: Arithmetic
) -> MassProperties:
    """Mass properties of a shape with a density that varies, in the `unit` of messages.

    `geometry` is that of the shape if it were uniform: its centre and its spread, about which sums are taken.

    Raises ValueProblem for a density that no body has, and ComputationError where integrals cannot be had.
    """
    if n.exact:
        from rigidcli.model.density_exact import exact_properties

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
        self.hangs_on = _hangs_on(formula.expression.root)
        self.centre = np.array(geometry.centre, dtype=np.float64)
        second = np.array(geometry.second, dtype=np.float64)
        self.size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
        self.least = -np.inf

    def properties(self) -> MassProperties:
        """Mass, centre of mass and tensor, each with a bound on its error.

        Raises ValueProblem for a density that is negative or infinite somewhere, and ComputationError where
        the integrals would take too long.
        """
        self.require_possible()
        found = self.sums(self.centre, self.size)
        spread = np.sqrt(found.second.diagonal())
        if (spread < SPREAD * self.size).any():
            found = self.sums(found.com, 2 * spread)
        mass, com, second, size, error = found
        inertia = tensor.Inertia.of_sums(mass, com, mass * second)
        noise = error * mass * tensor.from_second_moments(1, np.outer(size, size))
        inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
        misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(size))
        return MassProperties(mass, com, inertia, misplaced, integrated=error)

    def sums(self, about: Floats, size: Floats) -> Sums:
        """The integrals, with moments taken about a point (3, m) in units of `size` (3, m)."""
        units = np.where(size > 0, size, 1.0)
        integrands = [self._integrand(chart, about, units) for chart in self.charts]
        found, mass = None, 0.0
        with suppress(quadrature.Exhausted):
            for integrand in integrands:
                integrand.left = EFFORTS[0][1] / len(integrands)
                integrand.look()
            found = _integral(integrands, np.inf, EFFORTS[0][1])
            mass = float(found.values[0])
            if not mass > 0:
                raise ValueProblem(f"the density leaves no mass: {mass:.6g} kg", path=("density",))
        for goal, operations in EFFORTS:
            with suppress(quadrature.Exhausted):
                if found is not None and found.error > goal * mass:
                    found = _integral(integrands, goal * mass / 5, operations)
                    mass = float(found.values[0])
        if found is None or not found.error <= ROUGH * mass:
            raise ComputationError(
                f"the density changes too much, or too suddenly, for a relative error of {ROUGH:g}",
                hint="give the body in `parts`, so that the density is smooth in each of them",
            )
        first, pairs = found.values[1:4] / mass, found.values[4:] / mass
        second = np.empty((3, 3))
        for mean, (i, j) in zip(pairs, _PAIRS, strict=True):
            second[i, j] = second[j, i] = mean - first[i] * first[j]
        second[[0, 1, 2], [0, 1, 2]] = np.maximum(second.diagonal(), 0.0)
        return Sums(mass, about + units * first, second * np.outer(units, units), size, found.error / mass)

    def _integrand(self, chart: Chart, about: Floats, units: Floats) -> quadrature.Integrand:
        """The density with its first and second moments, as a function of the coordinates of a chart."""
        start = np.array(chart.origin, dtype=np.float64) - about

        def moments(points: Floats) -> Floats:
            density, spot = self._density(chart, points)
            offset = (np.array([spot.x, spot.y, spot.z]) + start[:, None]) / units[:, None]
            weight = density * spot.measure
            first = weight * offset
            return np.vstack([weight, first, *(first[i] * offset[j] for i, j in _PAIRS)])

        def narrow(node: Node, points: Floats) -> Floats:
            return of_node(node, self.formula, places(chart.at(points), chart.origin))

        functions = [quadrature.Narrow(partial(narrow, node)) for node in self.hangs_on]
        length = len(self.formula.expression.text)
        each = EACH_POINT + length / OPERATION_LENGTH
        part = EACH_PLACE + length / OPERATION_LENGTH / max(1, len(functions))
        return quadrature.Integrand(
            moments, functions, chart.cuts(), chart.probes(), chart.pieces, (each, part)
        )

    def _density(self, chart: Chart, points: Floats) -> tuple[Floats, Spot]:
        """The density at points of a chart, and their places; refused where it is no density."""
        spot = chart.at(points)
        known = places(spot, chart.origin)
        density = values(self.formula, known)
        bad = np.flatnonzero(~(np.isfinite(density) & (density >= self.least)))
        if bad.size:
            self._refuse(density[bad[0]], known, bad[0])
        return density, spot

    def _signed(self, chart: Chart, sign: int, points: Floats) -> Floats:
        return sign * self._density(chart, points)[0]

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
        nets = [(chart, chart.net(NET)) for chart in self.charts]
        seen = [self._density(chart, net)[0] for chart, net in nets]
        self.least = -NEGATIVE * max(float(density.max()) for density in seen)
        for (chart, net), density in zip(nets, seen, strict=True):
            order = np.argsort(density, kind="stable")
            for sign, watched in ((1, order[:WATCHED]), (-1, order[-WATCHED:])):
                search = partial(self._signed, chart, sign)
                points, told = quadrature.lowest_points(search, net[:, watched])
                coarse, middle, fine = np.abs(told[[17, 34, 51]])
                endless = (fine > ENDLESS * middle) & (middle > ENDLESS * coarse)
                if sign < 0 and endless.any():
                    where = int(np.argmax(endless))
                    known = places(chart.at(points), chart.origin)
                    self._refuse(np.inf, known, where, "without an upper bound")


def _integral(
    integrands: Sequence[quadrature.Integrand], tolerance: float, operations: float
) -> quadrature.Integral:
    """The sum over all of them. Raises Exhausted where that takes more operations."""
    found = []
    for integrand in integrands:
        integrand.left = operations / len(integrands)
        found.append(integrand.integral(tolerance / len(integrands)))
    values = np.sum([part.values for part in found], axis=0)
    return quadrature.Integral(values, sum(part.error for part in found))


def _hangs_on(root: Node) -> list[Node]:
    """What a density may not be smooth for: see `tree.insides`; and distances, and what it is divided by."""
    found = insides(root)

    def walk(node: Node) -> Node:
        if isinstance(node, Reciprocal):
            found.add(node.operand.base if isinstance(node.operand, Power) else node.operand)
        if node in (Name("r"), Name("s")):
            found.add(node)
        return rebuilt(node, walk)

    walk(root)
    return [node for node in sorted(found, key=repr) if not names_in(node).isdisjoint(VARIABLES)]
