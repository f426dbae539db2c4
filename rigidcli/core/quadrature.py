"""Integrals over boxes of up to three dimensions, of functions with kinks, jumps and peaks.

They are taken coordinate by coordinate, along many lines at a time. Each line is cut where kinks, jumps and
peaks are, and its panels are halved until the error is small. Goals become finer step by step, so that each
step knows the size of what it is to find, and the last one that is reached is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.boxes import replaced
from rigidcli.core.cuts import NARROWEST, Cuts
from rigidcli.core.kinks import Function
from rigidcli.core.kronrod import GRADED, PLAIN, worked_out

LINES = 512
"""Lines that are worked on together: their samples stay in the cache, and memory is bounded."""

OVERHEAD = 500
"""What a call for a few points costs more than these, in points."""

INNER = 0.1
"""The error that integrals along inner lines may have, in units of that of outer ones."""

GOALS = (1e-4, 1e-6, 1e-9, 1e-12)
"""Relative errors that are aimed at one after the other, each with what the one before has told."""

LAST = 0.1
"""The part of all work after which no finer goal is tried where there are kinks, jumps and peaks."""


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


def integral(integrands: Sequence[Integrand], rough: float, budget: Budget) -> Integral:
    """The sum of integrals, to a part in 10^12 of the first of them, or as far as the budget allows.

    Raises Exhausted where not even a relative error of `rough` can be had.
    """
    found = [integrand.integral(np.inf) for integrand in integrands]
    for goal in GOALS:
        size = abs(sum(each.values[0] for each in found))
        error = sum(each.error for each in found)
        if error <= GOALS[-1] * size or not size > 0:
            break
        last = LAST if any(integrand.cuts.active.any() for integrand in integrands) else 1.0
        if error <= rough * size and budget.left < (1 - last) * budget.all:
            break
        share = goal * size / len(found)
        try:
            for k, integrand in enumerate(integrands):
                if found[k].error > share:
                    found[k] = min(found[k], integrand.integral(share), key=lambda each: each.error)
        except Exhausted:
            if error > rough * size:
                raise
            break
    values = np.sum([each.values for each in found], axis=0)
    return Integral(values, float(sum(each.error for each in found)))


class Integrand:
    """Functions to be integrated over boxes that are cut, k functions at a time."""

    def __init__(self, values: Function, cuts: Cuts) -> None:
        self.values, self.cuts = values, cuts

    def integral(self, tolerance: float) -> Integral:
        """The integrals, to about this absolute error in the first of them."""
        count = len(self.cuts.boxes.piece)
        points = np.vstack([np.arange(count, dtype=np.float64), np.zeros((self.cuts.depth, count))])
        values, errors = self._over(0, points, tolerance * np.ones(count) / count)
        return Integral(values.sum(axis=1), float(errors.sum()))

    def _over(self, level: int, fixed: Floats, tolerance: Floats) -> tuple[Floats, Floats]:
        """Integrals (k by n) over coordinates from `level` on, from points (1 + d by n); and errors (n)."""
        count = fixed.shape[1]
        if count > LINES:
            found = [
                self._over(level, fixed[:, start : start + LINES], tolerance[start : start + LINES])
                for start in range(0, count, LINES)
            ]
            return np.hstack([values for values, _ in found]), np.hstack([errors for _, errors in found])
        box = fixed[0].astype(int)
        cuts = self.cuts
        if not cuts.depth:
            places, measure = cuts.boxes.at(fixed)
            return self.values(places) * measure, np.zeros(count)
        axis, is_last = cuts.order[level, box], level == cuts.depth - 1
        lines = cuts.boxes.lines(fixed, axis) if is_last else None
        totals, errors = np.zeros((0, count)), np.zeros(count)
        waiting: tuple[Array, ...]
        waiting, graded = cuts.panels(level, fixed)
        while waiting[0].size:
            line, low, high = (part[-LINES:] for part in waiting)
            waiting = tuple(part[:-LINES] for part in waiting)
            rule = GRADED if graded[line[-1]] else PLAIN
            same = graded[line] == graded[line[-1]]
            waiting = tuple(
                np.append(part, own[~same]) for part, own in zip(waiting, (line, low, high), strict=True)
            )
            line, low, high = line[same], low[same], high[same]
            width = high - low
            t = low[:, None] + width[:, None] * rule.places
            if lines is not None:
                places, measure = lines.along(line, t)
                values, inner = self.values(places) * measure, np.zeros(t.size)
            else:
                hurry = np.where(
                    rule.kronrod > 0, INNER, np.inf
                )  # ends only tell whether there is a surprise
                on = np.repeat(line, len(rule.places))
                points = replaced(fixed[:, on], axis[on], t.ravel())
                values, inner = self._over(level + 1, points, (tolerance[line][:, None] * hurry).ravel())
            values, inner = values.reshape(len(values), *t.shape), inner.reshape(t.shape)
            kronrod, own, rounding = worked_out(values, inner, width, rule)
            wrong = width * (inner @ rule.kronrod) + own + rounding
            done = (own <= np.maximum(tolerance[line], rounding)) | (width < NARROWEST)
            totals = totals if len(totals) else np.zeros((len(values), count))
            np.add.at(totals.T, line[done], kronrod[:, done].T)
            np.add.at(errors, line[done], wrong[done])
            middle = (low + high)[~done] / 2
            halves = np.tile(line[~done], 2), np.append(low[~done], middle), np.append(middle, high[~done])
            waiting = tuple(map(np.append, waiting, halves))
        return totals, errors
