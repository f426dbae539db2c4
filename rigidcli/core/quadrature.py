"""Integrals over unit boxes of up to three dimensions, of functions that are smooth but for kinks and jumps.

The box is cut into cells, and those with the largest errors are halved. In a cell the integral is taken
coordinate by coordinate, along many lines at a time, and each line is cut where a function that the
integrand hangs on passes zero or turns back: there kinks, jumps and peaks are. The coordinate along which
these functions change most comes last, so that lines pass through their surfaces rather than along them;
the integral over it is then smooth in the others but where a surface meets the faces of the cell, and there
the lines of the others are cut.

Source: R. I. Saye, SIAM J. Sci. Comput. 37 (2015) A993, for the choice of the last coordinate and the cuts
at faces. A cell in which no coordinate is good for all of a surface shows a large error, and is halved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from rigidcli.core import line_search
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.kronrod import GRADED, PLAIN, interpolating, worked_out

NARROWEST = 2.0**-44
"""Panels that are narrower, in units of the cell, are not halved: their nodes would be one point."""

LINES = 512
"""Lines that are worked on together: their samples stay in the cache, and memory is bounded."""

TOGETHER = 64
"""Cells that are halved together, at most."""

OVERHEAD = 500
"""What a call for a few points costs more than these, in points."""

SURPRISE = 1e-6
"""How far an integrand may miss the polynomial through the nodes, in units of its largest value, before
cells are cut where a narrow function passes zero or turns back."""

WINDOW = 0.2
"""The part of a line round such a place on which this is tried."""

ASKEW = 0.37
"""Where in this part the place is, unless an end is near: not in the middle, where a node is."""

UNRELATED = (0.0, 0.2137, 0.5, 0.7391, 1.0)
"""Coordinates of the lines on which this is tried: ends, the middle, and such as no document has."""

TRIED = 8
"""Cells in which it is tried, at most."""

NET = 5
"""Points along each coordinate at which a cell is looked at for narrow functions."""

EXTREMES = 3
"""So many of the lowest and of the highest points are tried in the search for the extremes of a function."""

INNER = 0.05
"""The error that inner integrals may have, in units of what is aimed at."""

PROGRESS = 1e-3
"""What is aimed at first, in units of the error so far: errors of inner integrals are no hurry before."""

TINY = float(np.finfo(np.float64).tiny)
"""What is divided by instead of zero."""

Function = Callable[[Floats], Floats]
"""Values (n, or k by n) at points (1 + d by n); the first row is the index of the piece."""


class Exhausted(Exception):  # noqa: N818 - an outcome, for those who ask for less then
    """The integral needs more evaluations than are allowed."""


class Cells(NamedTuple):
    """Boxes: the piece in which each lies (n), and where its coordinates begin and end (d by n)."""

    piece: Floats
    low: Floats
    high: Floats

    @classmethod
    def between(cls, piece: int, cuts: Sequence[Floats]) -> Cells:
        """All the boxes between cuts on each coordinate."""
        low = np.array(list(product(*(cut[:-1] for cut in cuts)))).T
        high = np.array(list(product(*(cut[1:] for cut in cuts)))).T
        return cls(np.full(low.shape[1], float(piece)), low, high)

    def taken(self, those: Array) -> Cells:
        """Some of them."""
        return Cells(self.piece[those], self.low[:, those], self.high[:, those])

    def split(self, axis: Array, place: Floats) -> Cells:
        """Both parts of each, cut at a place on the coordinate `axis`."""
        each = np.arange(len(self.piece))
        low, high = self.low.copy(), self.high.copy()
        low[axis, each] = high[axis, each] = place
        return joined([self._replace(high=high), self._replace(low=low)])

    def cut_at(self, point: Floats) -> Cells:
        """The cells, those around a point (1 + d) cut there."""
        cells = self
        for axis, place in enumerate(point[1:]):
            within = (cells.low < point[1:, None]) | np.isclose(cells.low, point[1:, None], atol=CLOSE)
            within &= (cells.high > point[1:, None]) | np.isclose(cells.high, point[1:, None], atol=CLOSE)
            across = (cells.low[axis] + CLOSE < place) & (place < cells.high[axis] - CLOSE)
            hit = within.all(axis=0) & across & (cells.piece == point[0])
            those = np.flatnonzero(hit)
            cut = cells.taken(those).split(np.full(those.size, axis), np.full(those.size, place))
            cells = joined([cells.taken(np.flatnonzero(~hit)), cut])
        return cells


NEAR = 0.125
"""Where a cell is cut that has a peak at a corner, in units of its width, from there."""

LONGER = 1.5
"""How much longer the last coordinate of a cell is than another when it is halved instead."""

CLOSE = 1e-9
"""Cells are not cut nearer to their faces than this, in units of the box."""


def joined(parts: Iterable[Cells]) -> Cells:
    """Cells one after the other."""
    return Cells(*(np.concatenate(rows, axis=-1) for rows in zip(*parts, strict=True)))


class Integral(NamedTuple):
    """Integrals (k), and a bound on the error of each, by an estimate."""

    values: Floats
    error: float


class Budget:
    """The operations that may still be spent; then `Exhausted` is raised."""

    def __init__(self, left: float) -> None:
        self.left = left

    def spending(self, function: Function, each: float) -> Function:
        """The function, a point of which costs so many."""

        def spent(points: Floats) -> Floats:
            self.left -= (points.shape[1] + OVERHEAD) * each
            if self.left < 0:
                raise Exhausted
            return function(points)

        return spent


class Integrand:
    """Functions to be integrated over cells: k of them at a time, where they take points (1 + d by n).

    Where functions in `narrow` pass zero, or are largest or smallest, the integrand may have a jump, a kink
    or a peak. Those near which the integrand does nothing that the nodes do not see are forgotten.
    """

    def __init__(self, values: Function, narrow: Sequence[Function], cells: Cells) -> None:
        self.values, self.cells, self.depth = values, cells, len(cells.low)
        self.narrow: list[Function] = []
        self.peaks: list[Floats] = []
        found = [(function, self._peaks(function)) for function in narrow]
        for function, peaks in found:
            if self._is_harmful(function, peaks):
                self.narrow.append(function)
                self.peaks.extend(peaks)
        for peak in self.peaks:
            self.cells = self.cells.cut_at(peak)
        some = self._some()
        seen = [self._on_net(function, some)[1] for function in self.narrow]
        self.graded = np.any([steep.any(axis=1) for steep in seen], axis=0) & np.full(self.depth, bool(seen))

    def integral(self, fine: float, rough: float, enough: Callable[[], bool]) -> Integral:
        """The integrals, the error of each at most `fine` in units of the first of them, or nearly so.

        An error of `rough` is taken as soon as it is `enough`, or as the budget is exhausted.
        """
        values, errors = self._worked_out(self.cells, np.inf)
        with suppress(Exhausted):
            while True:
                size, error = values.sum(axis=1)[0], errors.sum()
                goal = (rough if enough() else fine) * size
                if error <= goal or not size > 0:
                    break
                own = errors.sum(axis=0)
                order = np.argsort(-own, kind="stable")
                rest = error - np.cumsum(own[order])
                worst = order[: min(TOGETHER, 1 + int(np.searchsorted(-rest, -goal / 2)))]
                cells = self.cells.taken(worst)
                cells = self._of(cells).halved(errors[:, worst])
                new, its = self._worked_out(cells, INNER * max(goal, PROGRESS * error))
                kept = np.delete(np.arange(own.size), worst)
                self.cells = joined([self.cells.taken(kept), cells])
                values, errors = np.hstack([values[:, kept], new]), np.hstack([errors[:, kept], its])
        return Integral(values.sum(axis=1), float(errors.sum()))

    def _worked_out(self, cells: Cells, tolerance: float) -> tuple[Floats, Floats]:
        """Integrals over cells (k by n), and their errors by the coordinate in which they arise (d by n)."""
        found = []
        for start in range(0, len(cells.piece), TOGETHER):
            some = cells.taken(np.arange(start, min(start + TOGETHER, len(cells.piece))))
            found.append(self._of(some).integrals(tolerance))
        values, errors = zip(*found, strict=True)
        return np.hstack(values), np.hstack(errors)

    def _of(self, cells: Cells) -> _Batch:
        """Cells with what their narrow functions do, as far as a net in each shows."""
        count, depth = len(cells.piece), self.depth
        order = np.tile(np.arange(depth)[:, None], count)
        if not self.narrow:
            return _Batch(self, cells, order, np.zeros((0, count), dtype=bool))
        change, active = np.zeros((depth, count)), []
        for function in self.narrow:
            here, steep = self._on_net(function, cells)
            change += np.where(here, steep / np.maximum(steep.sum(axis=0), TINY), 0.0)
            active.append(here)
        return _Batch(self, cells, np.argsort(change, axis=0, kind="stable"), np.array(active))

    def _net(self, cells: Cells) -> Floats:
        """Points on a net in each of the cells."""
        net = np.array(list(product(np.linspace(0, 1, NET), repeat=self.depth))).T
        places = cells.low[:, :, None] + (cells.high - cells.low)[:, :, None] * net[:, None]
        return np.vstack([np.repeat(cells.piece, net.shape[1]), places.reshape(self.depth, -1)])

    def _on_net(self, function: Function, cells: Cells) -> tuple[Mask, Floats]:
        """Whether a function passes zero or turns back in cells (n), and how much it changes (d by n)."""
        count, sizes = len(cells.piece), []
        grid = function(self._net(cells)).reshape(count, *[NET] * self.depth)
        positive = (grid > 0).reshape(count, -1)
        here: Mask = np.asarray(positive.any(axis=1) & ~positive.all(axis=1))
        for axis in range(self.depth):
            along = np.moveaxis(grid, axis + 1, -1).reshape(count, -1, NET)
            steps = line_search.directions(along)
            here = np.logical_or(here, (steps[..., 1:] * steps[..., :-1] < 0).any(axis=(1, 2)))
            with np.errstate(invalid="ignore"):
                steep = np.abs(np.diff(along))
            sizes.append(np.where(np.isfinite(steep) & (steps != 0), steep, 0.0).sum(axis=(1, 2)))
        return here, np.array(sizes)

    def _peaks(self, function: Function) -> list[Floats]:
        """The points (1 + d) at which a narrow function is lowest and highest, as far as is found."""
        points = self._net(self._some())
        order, found = np.argsort(function(points), kind="stable"), []
        for sign, start in ((1, order[:EXTREMES]), (-1, order[-EXTREMES:])):
            places, told = line_search.lowest_points(partial(_signed, function, sign), points[:, start])
            found.append(places[:, int(np.argmin(told[-1]))])
        return found

    def _some(self) -> Cells:
        """Cells that stand for all of them."""
        count = len(self.cells.piece)
        return self.cells.taken(np.unique(np.linspace(0, count - 1, TRIED).astype(int)))

    def _is_harmful(self, function: Function, peaks: Sequence[Floats]) -> bool:
        """Whether the integrand is not as its nodes say where a narrow function passes zero or turns back."""
        nodes, depth, some = PLAIN.places[1:-1], self.depth, self._some()
        starts = np.array(list(product(UNRELATED, repeat=depth))).T
        places = some.low[:, :, None] + (some.high - some.low)[:, :, None] * starts[:, None]
        lines = np.vstack([np.repeat(some.piece, starts.shape[1]), places.reshape(depth, -1)])
        low, high = (np.repeat(ends, starts.shape[1], axis=1) for ends in some[1:])
        for peak in peaks:
            around = (self.cells.piece == peak[0]) & (self.cells.low <= peak[1:, None]).all(axis=0)
            around &= (self.cells.high >= peak[1:, None]).all(axis=0)
            cell = self.cells.taken(np.flatnonzero(around)[:1])
            lines = np.hstack([lines, peak[:, None]])
            low, high = np.hstack([low, cell.low]), np.hstack([high, cell.high])
        for axis in range(depth):
            own = np.flatnonzero(
                (lines[1 + axis] == low[axis]) | (np.arange(lines.shape[1]) >= places[0].size)
            )
            along = lines[:, own], np.full(own.size, axis), low[axis, own], high[axis, own]
            on, found = line_search.special(partial(_along, function, *along), own.size)
            if not found.size:
                continue
            first = np.clip(found - ASKEW * WINDOW, 0.0, 1.0 - WINDOW)
            t = (first[:, None] + WINDOW * nodes).ravel()
            values = _along(self.values, *along, np.repeat(on, nodes.size), t).reshape(
                -1, on.size, nodes.size
            )
            expected = np.einsum("kpn,pn->kp", values, interpolating(nodes, (found - first) / WINDOW))
            there = _along(self.values, *along, on, found)
            size = np.maximum(np.abs(values).max(axis=(1, 2)), np.abs(there).max(axis=1))
            if not (np.abs(there - expected) <= SURPRISE * size[:, None]).all():
                return True
        return False


class _Batch(NamedTuple):
    """Cells that are integrated together.

    `order` (d by n) has their coordinates, the innermost last; `active` (by function and cell) tells which
    narrow functions pass zero or turn back in them.
    """

    integrand: Integrand
    cells: Cells
    order: Array
    active: Mask

    def integrals(self, tolerance: float) -> tuple[Floats, Floats]:
        """Integrals over the cells (k by n), and their errors by coordinate (d by n)."""
        points = np.vstack([self.cells.piece, self.cells.low])
        count = points.shape[1]
        values, errors = self._over(0, points, np.arange(count), np.full(count, tolerance))
        by_coordinate = np.empty_like(errors)
        np.put_along_axis(by_coordinate, self.order, errors, axis=0)
        return values, by_coordinate

    def halved(self, errors: Floats) -> Cells:
        """Both halves of each cell, across the coordinate in which most of its errors (d by n) arise.

        Where a surface is in the cell, its last coordinate may not be good for all of it: this is halved
        if it is longer. A cell that has a peak at a corner is cut near it.
        """
        cells, each = self.cells, np.arange(len(self.cells.piece))
        axis, last = errors.argmax(axis=0), self.order[-1]
        width = cells.high - cells.low
        axis = np.where(
            self.active.any(axis=0) & (width[last, each] > LONGER * width[axis, each]), last, axis
        )
        near_low, near_high = np.zeros(width.shape, dtype=bool), np.zeros(width.shape, dtype=bool)
        for peak in self.integrand.peaks:
            at_low, at_high = (np.abs(side - peak[1:, None]) <= CLOSE * width for side in cells[1:])
            corner = (at_low | at_high).all(axis=0) & (cells.piece == peak[0])
            near_low, near_high = near_low | (at_low & corner), near_high | (at_high & corner)
        part = np.where(near_low, NEAR, np.where(near_high, 1 - NEAR, 0.5))
        return cells.split(axis, (cells.low + part * width)[axis, each])

    def _over(self, level: int, fixed: Floats, cell: Array, tolerance: Floats) -> tuple[Floats, Floats]:
        """Integrals (k by n) over coordinates from `level` on of points in cells, and errors by level."""
        depth, count = len(self.order), fixed.shape[1]
        if level == depth:
            return self.integrand.values(fixed), np.zeros((depth, count))
        if count > LINES:
            found = [
                self._over(level, *(part[..., start : start + LINES] for part in (fixed, cell, tolerance)))
                for start in range(0, count, LINES)
            ]
            return np.hstack([values for values, _ in found]), np.hstack([errors for _, errors in found])
        axis = self.order[level, cell]
        graded = self.integrand.graded[axis]
        start = self.cells.low[axis, cell]
        length = self.cells.high[axis, cell] - start
        totals, errors = np.zeros((0, count)), np.zeros((depth, count))
        waiting: tuple[Array, ...] = self._panels(level, fixed, cell)
        while waiting[0].size:
            line, low, high = (part[-LINES:] for part in waiting)
            waiting = tuple(part[:-LINES] for part in waiting)
            rule = GRADED if graded[line[-1]] else PLAIN
            same = graded[line] == graded[line[-1]]
            waiting = tuple(
                np.append(part, own[~same]) for part, own in zip(waiting, (line, low, high), strict=True)
            )
            line, low, high = line[same], low[same], high[same]
            hurry = np.where(rule.kronrod > 0, 1.0, np.inf)  # ends only tell whether there is a surprise
            width = high - low
            t = low[:, None] + width[:, None] * rule.places
            on = np.repeat(line, len(rule.places))
            points = _with(fixed[:, on], axis[on], start[on] + length[on] * t.ravel())
            needed = (tolerance[line][:, None] * hurry).ravel()
            values, inner = self._over(level + 1, points, cell[on], needed)
            values, width = values.reshape(len(values), *t.shape), width * length[line]
            inner = inner.reshape(depth, *t.shape)
            kronrod, own, rounding = worked_out(values, inner.sum(axis=0), width, rule)
            wrong = width * (inner @ rule.kronrod)
            wrong[level] += own + rounding
            done = (own <= np.maximum(tolerance[line], rounding)) | (high - low < NARROWEST)
            done |= level < depth - 1
            totals = totals if len(totals) else np.zeros((len(values), count))
            np.add.at(totals.T, line[done], kronrod[:, done].T)
            np.add.at(errors.T, line[done], wrong[:, done].T)
            middle = (low + high)[~done] / 2
            halves = np.tile(line[~done], 2), np.append(low[~done], middle), np.append(middle, high[~done])
            waiting = tuple(map(np.append, waiting, halves))
        return totals, errors

    def _panels(self, level: int, fixed: Floats, cell: Array) -> tuple[Array, Floats, Floats]:
        """The panels to begin with: the line on which each lies, its beginning and its end, from 0 to 1.

        Lines are cut where narrow functions pass zero or turn back, on the faces that the cell has in the
        coordinates that are still to come.
        """
        count, depth = fixed.shape[1], len(self.order)
        lines, places = [np.tile(np.arange(count), 2)], [np.repeat([0.0, 1.0], count)]
        ends = np.array([self.cells.low, self.cells.high])
        for function, active in zip(self.integrand.narrow, self.active, strict=True):
            those = np.flatnonzero(active[cell])
            for sides in product((0, 1), repeat=depth - 1 - level) if those.size else ():
                own, its = fixed[:, those], cell[those]
                for inner, side in enumerate(sides, level + 1):
                    axis = self.order[inner, its]
                    own = _with(own, axis, ends[side, axis, its])
                axis = self.order[level, its]
                start, end = ends[:, axis, its]

                on, found = line_search.special(partial(_along, function, own, axis, start, end), those.size)
                lines.append(those[on])
                places.append(found)
        line, place = np.concatenate(lines), np.concatenate(places)
        order = np.lexsort((place, line))
        line, place = line[order], place[order]
        panels = (line[1:] == line[:-1]) & (np.diff(place) > NARROWEST)
        return line[1:][panels], place[:-1][panels], place[1:][panels]


def _signed(function: Function, sign: int, points: Floats) -> Floats:
    return sign * function(points)


def _along(
    function: Function, lines: Floats, axis: Array, low: Floats, high: Floats, on: Array, t: Floats
) -> Floats:
    """Values on lines (1 + d by n) along a coordinate of each, between these ends: on which, and where."""
    return function(_with(lines[:, on], axis[on], low[on] + (high - low)[on] * t))


def _with(points: Floats, axis: Array | int, places: Floats) -> Floats:
    """Points (1 + d by n) with other places on a coordinate of each, counted from 0."""
    changed = points.copy()
    changed[axis + 1, np.arange(points.shape[1])] = places
    return changed
