"""Integrals of a density over a shape, in floats, with a bound on their error by an estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rigidcli.core import line_search, quadrature, tensor
from rigidcli.core.arithmetic import Arithmetic, Floats
from rigidcli.core.charts import Chart
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.model.density import PAIRS, VARIABLES, of_node, places, symmetric, values
from rigidcli.model.environment import Formula
from rigidcli.symbolic.language.tree import Name, Node, Power, Reciprocal, insides, names_in, rebuilt

ROUGH = 1e-6
"""The relative error that integrals may have: densities that need more work for it are refused."""

FINE = 1e-12
"""The relative error that is tried for."""

WORK = 2e9
"""Operations on numbers that are spent on a body: two to five seconds, as functions take their time."""

RESERVED = 0.6
"""The part of them that is left when an error of `ROUGH` is enough."""

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
        self.about = np.array(geometry.centre, dtype=np.float64)
        second = np.array(geometry.second, dtype=np.float64)
        self.size = np.sqrt(3 * (second if second.ndim == 1 else second.diagonal()))
        pieces = [chart.pieces for chart in charts]
        self.first = np.cumsum([0, *pieces[:-1]])
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
            integrand = self._integrand()
            found = self._sums(integrand, WORK)
            spread = np.sqrt(found.second.diagonal())
            if (spread < SPREAD * self.size).any():
                self.about, self.size = found.com, 2 * spread
                with suppress(quadrature.Exhausted, ComputationError):
                    found = self._sums(integrand, WORK)
        except quadrature.Exhausted:
            raise _too_sudden() from None
        mass, com, second, size, error = found
        inertia = tensor.Inertia.of_sums(mass, com, mass * second)
        noise = error * mass * tensor.from_second_moments(1, np.outer(size, size))
        inertia = replace(inertia, noise=inertia.noise + np.abs(noise))
        misplaced = tensor.misplaced(com) + error * float(np.linalg.norm(size))
        return MassProperties(mass, com, inertia, misplaced, integrated=error)

    def _sums(self, integrand: quadrature.Integrand, work: float) -> Sums:
        """The integrals, with moments taken about the point `about` in units of `size`."""
        found = integrand.integral(FINE, ROUGH, lambda: self.budget.left < work * RESERVED)
        mass = float(found.values[0])
        if not mass > 0:
            raise ValueProblem(f"the density leaves no mass: {mass:.6g} kg", path=("density",))
        if not found.error <= ROUGH * mass:
            raise _too_sudden()
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

    def _integrand(self) -> quadrature.Integrand:
        """The density with its first and second moments, over the coordinates of all charts."""

        def moments(points: Floats) -> Floats:
            density, known, measure = self._density(points)
            offset = (np.array([known[name] for name in "xyz"]) - self.about[:, None]) / self.units[:, None]
            weight = density * measure
            first = weight * offset
            return np.vstack([weight, first, *(first[i] * offset[j] for i, j in PAIRS)])

        def narrow(node: Node, points: Floats) -> Floats:
            return of_node(node, self.formula, self._located(points)[0])

        length = len(self.formula.expression.text) / OPERATION_LENGTH
        part = EACH_PLACE + length / max(1, len(self.hangs_on))
        return quadrature.Integrand(
            self.budget.spending(moments, EACH_POINT + length),
            [self.budget.spending(partial(narrow, node), part) for node in self.hangs_on],
            quadrature.joined(
                quadrature.Cells.between(first + piece, chart.cuts())
                for first, chart in zip(self.first, self.charts, strict=True)
                for piece in range(chart.pieces)
            ),
        )

    def _located(self, points: Floats) -> tuple[dict[str, Floats], Floats]:
        """What the variables of the density are at points, and the measure there."""
        names = (*VARIABLES, "measure")
        found = np.empty((len(names), points.shape[1]))
        which = np.searchsorted(self.first, points[0], side="right") - 1
        for k in np.unique(which):
            those = np.flatnonzero(which == k)
            own = points[:, those]
            own[0] -= self.first[k]
            spot = self.charts[k].at(own)
            known = places(spot, self.charts[k].origin)
            found[:, those] = [*(known[name] for name in VARIABLES), spot.measure]
        return dict(zip(VARIABLES, found, strict=False)), found[-1]

    def _density(self, points: Floats) -> tuple[Floats, dict[str, Floats], Floats]:
        """The density at points, their places and the measure there; refused where it is no density."""
        known, measure = self._located(points)
        density = values(self.formula, known)
        bad = np.flatnonzero(~(np.isfinite(density) & (density >= self.least)))
        if bad.size:
            self._refuse(density[bad[0]], known, bad[0])
        return density, known, measure

    def _signed(self, sign: int, points: Floats) -> Floats:
        return sign * self._density(points)[0]

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
        for net, first in zip(nets, self.first, strict=True):
            net[0] += first
        seen = [self._density(net)[0] for net in nets]
        self.least = -NEGATIVE * max(float(density.max()) for density in seen)
        for net, density in zip(nets, seen, strict=True):
            order = np.argsort(density, kind="stable")
            for sign, watched in ((1, order[:WATCHED]), (-1, order[-WATCHED:])):
                points, told = line_search.lowest_points(partial(self._signed, sign), net[:, watched])
                coarse, middle, fine = np.abs(told[[17, 34, 51]])
                endless = (fine > ENDLESS * middle) & (middle > ENDLESS * coarse)
                if sign < 0 and endless.any():
                    known, _ = self._located(points)
                    self._refuse(np.inf, known, int(np.argmax(endless)), "without an upper bound")


def _too_sudden() -> ComputationError:
    return ComputationError(
        f"the density changes too much, or too suddenly, for a relative error of {ROUGH:g}",
        hint="give the body in `parts`, so that the density is smooth in each of them",
    )


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
