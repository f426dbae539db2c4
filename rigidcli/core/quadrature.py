"""Integrals over boxes of up to three dimensions, of functions with kinks, jumps and peaks.

They are taken coordinate by coordinate, along many lines at a time. Each line is cut where kinks, jumps and
peaks are, so that the integrand is smooth on each of its panels, or has roots at their ends, which a change
of the variable takes away. All panels have one rule of Gauss, with more nodes until the integrals stay as
they are: they converge as fast as those of analytic functions do.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.boxes import replaced
from rigidcli.core.cuts import Cuts
from rigidcli.core.kinks import Function
from rigidcli.core.panels import panels

LINES = 512
"""Lines that are worked on together: their samples stay in the cache, and memory is bounded."""

OVERHEAD = 500
"""What a call for a few points costs more than these, in points."""

NODES = (6, 8, 11, 15, 20, 27, 36, 48, 64, 85, 113)
"""The nodes on each panel, one number after the other."""

GROWTH = 4 / 3
"""By how much these grow at each step."""

FALL = 0.3
"""The part of the change before that an error is at least: where cuts are missing, changes are erratic."""

SAFETY = 2.5
"""What errors are more than changes, as convergence may be slow there."""

LAST = 0.1
"""The part of all work that may be spent where the error is rough enough already, and there are kinks."""

ROUNDING = 64 * float(np.finfo(np.float64).eps)
"""The relative error that rounding leaves in the sum of a panel."""


class Exhausted(Exception):  # noqa: N818 - an outcome, for those who ask for less then
    """The integral needs more evaluations than are allowed."""


class Budget:
    """The operations that may still be spent; then `Exhausted` is raised."""

    def __init__(self, left: float) -> None:
        self.all = self.left = left

    def spending(self, function: Function, each: float) -> Function:
        """The function, a point of which costs so many."""

        def spent(points: Floats) -> Floats:
            self.left -= (points.shape[1] + OVERHEAD) * each
            if self.left < 0:
                raise Exhausted
            return function(points)

        return spent


class Integral(NamedTuple):
    """Integrals (k), and a bound on the error of each, by an estimate."""

    values: Floats
    error: float


def integral(integrands: Sequence[Integrand], rough: float, goal: float, budget: Budget) -> Integral:
    """The sum of integrals, to a relative error of `goal` in the first, or as far as the budget allows.

    Raises Exhausted where not even a relative error of `rough` can be had.
    """
    while True:
        values = np.sum(np.broadcast_arrays(*(each.values for each in integrands)), axis=0)
        error, size = sum(each.error for each in integrands), abs(values[0])
        worst = max(integrands, key=lambda each: each.error)
        if error <= goal * size or (np.isfinite(error) and not size > 0):
            break
        spare = budget.left if error > rough * size else budget.left - (1 - LAST) * budget.all
        if worst.next_cost > spare:
            if error > rough * size:
                raise Exhausted
            break
        worst.refine(budget)
    return Integral(values, error)


class Integrand:
    """Functions to be integrated over boxes that are cut, k functions at a time.

    `values` (k) and `error` are those of the integrals with the most nodes that have been tried. The error is
    what these have changed, or a part of what those before them have, summed over the panels of the first
    coordinate: a change that is small by chance is not believed. `next_cost` is what more nodes will cost.
    """

    def __init__(self, function: Function, cuts: Cuts) -> None:
        self.function, self.cuts = function, cuts
        self.values, self.error, self.next_cost = np.zeros(1), np.inf, 0.0
        self._panels, self._change = np.zeros((0, 0)), np.inf
        self._tried, self._cost = 0, np.inf

    def refine(self, budget: Budget) -> None:
        """Take the next number of nodes."""
        if self._tried == len(NODES):
            raise Exhausted
        left = budget.left
        boxes = len(self.cuts.boxes.piece)
        points = np.vstack([np.arange(boxes, dtype=np.float64), np.zeros((self.cuts.depth, boxes))])
        sums, _ = self._over(0, points, NODES[self._tried])
        size = np.abs(sums).sum(axis=1).max()
        # What is learnt of narrow functions on the way may move cuts: then nothing is known of the change.
        known = sums.shape == self._panels.shape
        change = np.abs(sums - self._panels).sum(axis=1).max() if known else np.inf
        before = self._change * max(FALL, self._change / size if size else 1.0)
        unsure = SAFETY * max(change, before) if self.cuts.depth else 0.0
        self.values, self.error = sums.sum(axis=1), unsure + ROUNDING * size
        cost = left - budget.left
        growth = min(GROWTH**self.cuts.depth, cost / self._cost if np.isfinite(self._cost) else np.inf)
        self._panels, self._change, self._cost, self._tried = sums, change, cost, self._tried + 1
        self.next_cost = cost * growth if self._tried < len(NODES) else np.inf

    def _over(self, level: int, fixed: Floats, count: int) -> tuple[Floats, Array]:
        """Integrals (k by p) over coordinates from `level` on, from points (1 + d by n), by so many nodes.

        They are those on panels along the first of these; with them comes the point of each.
        """
        cuts = self.cuts
        if not cuts.depth:
            places, measure = cuts.boxes.at(fixed)
            return self.function(places) * measure, np.arange(fixed.shape[1])
        axis = cuts.order[level, fixed[0].astype(int)]
        line, low, high, graded = panels(cuts, level, fixed)
        width = (high - low)[:, None]
        x, weight = np.where(graded[:, None], _rule(count, True)[:, None], _rule(count, False)[:, None])
        t = low[:, None] + width * x
        if level == cuts.depth - 1:
            places, measure = cuts.boxes.lines(fixed, axis).along(line, t)
            values = self.function(places) * measure
        else:
            on = np.repeat(line, count)
            values = self._inner(level + 1, replaced(fixed[:, on], axis[on], t.ravel()), count)
        return (values.reshape(len(values), *t.shape) * (width * weight)).sum(axis=2), line

    def _inner(self, level: int, points: Floats, count: int) -> Floats:
        """The integrals (k by n) over coordinates from `level` on, from points (1 + d by n)."""
        found = []
        for start in range(0, points.shape[1], LINES):
            own = points[:, start : start + LINES]
            sums, line = self._over(level, own, count)
            totals = np.zeros((len(sums), own.shape[1]))
            np.add.at(totals.T, line, sums.T)
            found.append(totals)
        return np.hstack(found)


@cache
def _rule(count: int, is_graded: bool) -> Floats:
    """Gauss's places from 0 to 1, and their weights (2 by n).

    A graded rule is in a variable in which roots of the distance from either end are smooth.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    x, w = (1 + nodes) / 2, weights / 2
    return np.array([x * x * (3 - 2 * x), 6 * x * (1 - x) * w] if is_graded else [x, w])
