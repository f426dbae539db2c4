"""Where boxes and lines are cut, so that integrands have their kinks, jumps and peaks at the ends.

An integrand hangs on narrow functions: where one of them passes zero or turns back, a kink, a jump or a peak
may be. The coordinate along which these functions change most, without turning back, comes last: its lines
pass through their surfaces rather than along them. A box in which they turn back along every coordinate is
taken as cones from the point where they are lowest or highest. What is narrow round a point, or in a shell
about it, is then crossed by every ray alike.

Sources: R. I. Saye, SIAM J. Sci. Comput. 37 (2015) A993, for the choice of the last coordinate and the cuts
at faces; M. G. Duffy, SIAM J. Numer. Anal. 19 (1982) 1260, for cones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

import numpy as np

from rigidcli.core import line_search
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.boxes import Boxes, Lines, joined, replaced
from rigidcli.core.kinks import NEAR, Function, Narrow

NARROWEST = 2.0**-44
"""Panels that are narrower, in units of the box, are not halved: their nodes would be one point."""

UNSEEN = 40
"""By how much more the argument of a smooth function varies in a box, in units of what is steep, before cuts
are needed. Panels find what is wider by halves: a Gaussian whose width is a twentieth of the box, say."""

NET = 5
"""Points along each coordinate at which a box is looked at for narrow functions."""

UNRELATED = (0.2137, 0.4361, 0.8791)
"""Coordinates of lines on which it is tried whether all turn back at one place."""

STARTS = (0, 2, 5)
"""Where searches for the extremes of a function begin, by the order of its values on the net."""

REACH = 0.3
"""The width of their nets at the beginning, in units of the box."""

SAME = 1e-4
"""So far from each other these places may be, in units of the box."""

STEP = 1e-4
"""A step from an extreme at a face, which tells whether the function is level there."""

NO_DISTANCE = 1e-9
"""What is zero at an apex, in units of the largest value in a cone."""

TINY = float(np.finfo(np.float64).tiny)
"""What is divided by instead of zero."""


class Cuts:
    """Boxes, cut where `narrow` functions ask for it, and the cuts of lines in them.

    `active` (by function and box) tells which of these matter where, and `order` (d by n) has the coordinates
    of each box, the last being that along which these change most.
    """

    def __init__(self, narrow: Sequence[Narrow], boxes: Boxes) -> None:
        self.boxes = boxes
        self.depth = len(boxes.low)
        self.narrow, self.largest = narrow, np.zeros(len(narrow))
        self.rough = np.array([each.function is None for each in narrow], dtype=bool)
        active = np.array([self._is_harmful(k) for k in range(len(narrow))], dtype=bool)
        self.active = active.reshape(len(narrow), len(boxes.piece))
        if self.active.any() and self.depth > 1:
            self._cut_where_all_turn()
            self._cut_into_cones()
        change, turned = np.zeros(self.boxes.low.shape), np.zeros(self.boxes.low.shape, dtype=bool)
        for each, here in zip(narrow, self.active, strict=True):
            steep, turns = self._on_net(each.core)
            change += np.where(here, steep / np.maximum(steep.sum(axis=0), TINY), 0.0)
            turned |= here & (turns > 0)
        change += len(narrow) * ~turned
        self.extremes = np.zeros((len(narrow), 2, *self.boxes.low.shape))
        for k, here in enumerate(self.active):
            those = np.flatnonzero(here if self.depth > 1 else False)
            self.extremes[k][..., those] = self._extremes(narrow[k].core, those)[2]
        for ray, last in zip(self.boxes.ray, (np.inf, np.finfo(np.float64).max), strict=True):
            rays = np.flatnonzero(ray >= 0)
            change[ray[rays], rays] = last
        self.order = np.argsort(change, axis=0, kind="stable")

    def panels(self, level: int, fixed: Floats) -> tuple[tuple[Array, Floats, Floats], Mask]:
        """The panels to begin with: the line on which each lies, its beginning and its end, from 0 to 1.

        With them comes on which lines there may be roots of the distance from an end.

        Lines are cut where narrow functions pass zero or turn back, on the faces that the box has in the
        coordinates that are still to come, and where these are those of the extremes; and where arguments
        have changed so much from there, or from the ends, that what is narrow is over.

        With them comes on which lines there may be roots of the distance from an end.
        """
        count = fixed.shape[1]
        box = fixed[0].astype(int)
        line, place = np.tile(np.arange(count), 2), np.repeat([0.0, 1.0], count)
        graded = np.zeros(count, dtype=bool)
        for k, narrow in enumerate(self.narrow):
            those = np.flatnonzero(self.active[k, box])
            faces = product((0.0, 1.0), repeat=self.depth - 1 - level)
            through = self.extremes[k] if level < self.depth - 1 else ()
            for sides in (*faces, *through) if those.size else ():
                own = fixed[:, those]
                for inner in range(level + 1, self.depth):
                    axis = self.order[inner, box[those]]
                    side = sides[inner - level - 1] if isinstance(sides, tuple) else sides[axis, box[those]]
                    own = replaced(own, axis, side)
                lines = self.boxes.lines(own, self.order[level, box[those]])
                if not lines.way.any():
                    continue
                seen = line_search.special(_along(narrow.core, lines), those.size)
                on, found = np.append(seen[0], seen[2]), np.append(seen[1], seen[3])
                if self.rough[k]:
                    graded[those[on]] = True
                    line, place = np.append(line, those[on]), np.append(place, found)
                on = np.append(on, np.tile(np.arange(those.size), 2))
                found = np.append(found, np.repeat([0.0, 1.0], those.size))
                arguments = narrow.argument(lines.at(on, found))
                self._note(k, arguments)
                matters = narrow.matters(arguments, self.largest[k])
                if self.rough[k]:
                    matters &= np.abs(arguments) > NO_DISTANCE * self.largest[k]
                on, found = on[matters], found[matters]
                if level < self.depth - 1:
                    graded[those[on[(found > 0) & (found < 1)]]] = True
                beside, further = narrow.widths(lines, on, found, arguments[matters])
                line = np.concatenate([line, those[on], those[beside]])
                place = np.concatenate([place, found, further])
        order = np.lexsort((place, line))
        line, place = line[order], place[order]
        panels = (line[1:] == line[:-1]) & (np.diff(place) > NARROWEST)
        return (line[1:][panels], place[:-1][panels], place[1:][panels]), graded

    def _at(self, function: Function, points: Floats) -> Floats:
        """A function at points in boxes."""
        return function(self.boxes.at(points)[0])

    def _net(self) -> Floats:
        """Points on a net in each of the boxes (1 + d by n NET^d)."""
        net = np.array(list(product(np.linspace(0, 1, NET), repeat=self.depth))).T
        count = len(self.boxes.piece)
        which = np.repeat(np.arange(count), net.shape[1])
        return np.vstack([which, np.tile(net, count)])

    def _is_harmful(self, k: int) -> Mask:
        """Whether something narrow may be in boxes (n)."""
        values = self._at(self.narrow[k].argument, self._net()).reshape(len(self.boxes.piece), -1)
        self._note(k, values)
        values = np.where(np.isfinite(values), values, 0.0)
        low, high, sizes = values.min(axis=1), values.max(axis=1), np.abs(values)
        if self.narrow[k].function is not None:
            return np.asarray(high - low > UNSEEN * self.narrow[k].steep)
        return np.asarray((low <= 0) & (high >= 0) | (sizes.min(axis=1) < NEAR * sizes.max(axis=1)))

    def _note(self, k: int, arguments: Floats) -> None:
        """Keep the largest value that is known of a narrow function, or of the argument of a kink."""
        function = self.narrow[k].function
        with np.errstate(all="ignore"):
            values = np.abs(arguments if function is None else function(arguments))
        self.largest[k] = max(self.largest[k], np.max(values, where=np.isfinite(values), initial=0.0))

    def _on_net(self, function: Function) -> tuple[Floats, Array]:
        """How much a function changes along coordinates (d by n), and how often it turns back (d by n)."""
        count, sizes, turns = len(self.boxes.piece), [], []
        grid = self._at(function, self._net()).reshape(count, *[NET] * self.depth)
        for axis in range(self.depth):
            along = np.moveaxis(grid, axis + 1, -1).reshape(count, -1, NET)
            steps = line_search.directions(along)
            turns.append((steps[..., 1:] * steps[..., :-1] < 0).sum(axis=2).max(axis=1))
            with np.errstate(invalid="ignore"):
                steep = np.abs(np.diff(along))
            sizes.append(np.where(np.isfinite(steep) & (steps != 0), steep, 0.0).sum(axis=(1, 2)))
        return np.reshape(sizes, (self.depth, count)), np.reshape(turns, (self.depth, count))

    def _cut_where_all_turn(self) -> None:
        """Cut boxes where all lines along a coordinate turn back at one place, as round an axis they do.

        This is for narrow functions that are not lowest or highest at a point inside, as there cones begin.
        """
        starts = np.array(list(product(UNRELATED, repeat=self.depth))).T
        count = starts.shape[1]
        for axis, (k, narrow) in product(range(self.depth), enumerate(self.narrow)):
            those = np.flatnonzero(self.active[k] & (self._on_net(narrow.core)[1][axis] == 1))
            those = those[~self._extremes(narrow.core, those)[1]]
            points = np.vstack([np.repeat(those, count), np.tile(starts, those.size)])
            lines = self.boxes.lines(points, np.full(points.shape[1], axis))
            _, _, on, places = line_search.special(_along(narrow.core, lines), lines.power.size)
            every = np.zeros((those.size, count))
            every[:] = np.nan
            every.flat[on] = places
            with np.errstate(invalid="ignore"):
                at_one = np.ptp(every, axis=1) < SAME
            if at_one.any():
                own, places = self.boxes.taken(those[at_one]), every[at_one, 0]
                places = own.low[axis] + (own.high - own.low)[axis] * places
                self.boxes.high[axis, those[at_one]] = own.low[axis] = places
                self.boxes = joined([self.boxes, own])
                self.active = np.hstack([self.active, self.active[:, those[at_one]]])

    def _cut_into_cones(self) -> None:
        """Take as cones the boxes in which a narrow function turns back along every coordinate.

        In three dimensions, so are then the faces of cones which it crosses, and on which it turns back.
        """
        for level in range(self.depth - 1):
            boxes, active = self.boxes, self.active
            needed = np.zeros(len(boxes.piece), dtype=bool)
            apex = boxes.low.copy()
            for k, here in enumerate(active):
                _, turns = self._on_net(self.narrow[k].core)
                rays = np.arange(self.depth)[:, None] == boxes.ray[0]
                once = ((turns < 2) | rays).all(axis=0) & here & ~needed
                once &= (boxes.ray[0] >= 0) & self._crosses(k) if level else True
                those = np.flatnonzero(once)
                places, free, _ = self._extremes(self.narrow[k].core, those)
                chosen = ((turns > 0) | rays).all(axis=0)[those] | (free & (level == 0) & (not self.rough[k]))
                apex[:, those[chosen]] = places[:, chosen]
                needed[those[chosen]] = True
            those, rest = np.flatnonzero(needed), np.flatnonzero(~needed)
            if not those.size:
                break
            cones, sources = boxes.taken(those).cones(level, apex[:, those])
            self.boxes = joined([boxes.taken(rest), cones])
            self.active = np.hstack([active[:, rest], active[:, those[sources]]])
        for k in np.flatnonzero(self.rough).tolist():  # a kink at the apex is none along the rays
            tips = np.abs(self.narrow[k].argument(np.vstack([self.boxes.piece, self.boxes.apex[0]])))
            values = np.abs(self._at(self.narrow[k].argument, self._net())).reshape(tips.size, -1)
            self.active[k] &= (self.boxes.ray[0] < 0) | (tips > NO_DISTANCE * values.max(axis=1))

    def _crosses(self, k: int) -> Mask:
        """Whether a narrow function does what it does on the faces of cones (n), too."""
        net = self._net()
        ends = replaced(net, np.maximum(self.boxes.ray[0], 0)[net[0].astype(int)], 1.0)
        core, arguments = (
            self._at(function, ends).reshape(len(self.boxes.piece), -1)
            for function in (self.narrow[k].core, self.narrow[k].argument)
        )
        passes = (core.min(axis=1) <= 0) & (core.max(axis=1) >= 0)
        return np.asarray(passes | self.narrow[k].matters(arguments, self.largest[k]).any(axis=1))

    def _extremes(self, function: Function, those: Array) -> tuple[Floats, Mask, Floats]:
        """The places (d by n) in boxes at which a function is lowest, or highest if this is farther inside.

        Those of cones are on their faces. With them comes whether the function is so not only in the box
        (n); and the lowest and the highest places (2 by d by n) in the unit box.
        """
        if not those.size:
            return np.zeros((self.depth, 0)), np.zeros(0, dtype=bool), np.zeros((2, self.depth, 0))
        net = self._net().reshape(1 + self.depth, len(self.boxes.piece), -1)[:, those]
        best, rays = [], self.boxes.ray[0]

        def at(points: Floats) -> Floats:
            ray = rays[points[0].astype(int)]
            some = ray >= 0
            if some.any():
                points = points.copy()
                points[:, some] = replaced(points[:, some], ray[some], 1.0)
            return self._at(function, points)

        values = at(net.reshape(len(net), -1)).reshape(those.size, -1)
        each = np.arange(those.size)
        for sign in (1, -1):
            order = (sign * values).argsort(axis=1, kind="stable")
            start = np.concatenate([net[:, each, order[:, k]] for k in STARTS], axis=1)
            found, told = line_search.lowest_points(partial(_signed, at, sign), start, REACH)
            lowest = told[-1].reshape(len(STARTS), -1).argmin(axis=0)
            best.append(found[1:].reshape(self.depth, len(STARTS), -1)[:, lowest, each])
        inside = []
        for unit in best:
            here, steps = at(np.vstack([those, unit])), []
            for axis in range(self.depth):
                for width in (STEP, 2 * STEP):
                    moved = unit.copy()
                    moved[axis] += np.where(unit[axis] > 0.5, -width, width)
                    steps.append(np.abs(at(np.vstack([those, moved])) - here))
            near, far = np.array(steps).reshape(self.depth, 2, -1).transpose(1, 0, 2)
            inside.append(((unit > STEP) & (unit < 1 - STEP)) | (far > 3 * near) | (far == 0))
        unit = np.where(inside[0].sum(axis=0) >= inside[1].sum(axis=0), best[0], best[1])
        free = np.where(
            inside[0].sum(axis=0) >= inside[1].sum(axis=0), inside[0].all(axis=0), inside[1].all(axis=0)
        )
        low, high = self.boxes.low[:, those], self.boxes.high[:, those]
        return low + (high - low) * unit, free, np.array(best)


def _along(function: Function, lines: Lines) -> Callable[[Array, Floats], Floats]:
    """A function on lines: of which of them, and the places on them."""
    return lambda on, t: function(lines.at(on, t))


def _signed(function: Function, sign: int, points: Floats) -> Floats:
    return sign * function(points)
