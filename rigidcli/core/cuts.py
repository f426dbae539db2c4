"""Boxes for integrals of functions with kinks, jumps and peaks, and the order of coordinates in them.

An integrand hangs on narrow functions: where one of them passes zero or turns back, a kink, a jump or a peak
may be. The coordinate along which these functions change most, without turning back, comes last: its lines
pass through their surfaces rather than along them. Where the distance from a point has its root, or a
pole is, the box is taken as cones from this point: along each ray it is smooth.

Sources: R. I. Saye, SIAM J. Sci. Comput. 37 (2015) A993, for the choice of the last coordinate; M. G. Duffy,
SIAM J. Numer. Anal. 19 (1982) 1260, for cones.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np

from rigidcli.core import line_search
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.boxes import Boxes, joined
from rigidcli.core.kinks import NEAR, Function, Narrow

UNSEEN = 25
"""By how much more the argument of a smooth function varies in a box, in units of what is steep, before cuts
are needed. Gauss's rule finds what is wider by itself."""

NET = 9
"""Points along each coordinate at which a box is looked at for narrow functions."""

NO_DISTANCE = 1e-9
"""What is zero at an apex, in units of the largest value in a cone."""

TINY = float(np.finfo(np.float64).tiny)
"""What is divided by instead of zero."""


class Cuts:
    """Boxes, cut into cones where `narrow` functions ask for it.

    `active` (by function and box) tells which of these matter where, and `order` (d by n) has the coordinates
    of each box, the last being that along which these change most. `turned` (2 by function by d by n) tells
    whether the guide of a function is lowest, or highest, inside the box along a coordinate. `largest` has
    the largest size of each function that is known, or of its argument if it has kinks, roots or poles.
    """

    def __init__(self, narrow: Sequence[Narrow], boxes: Boxes) -> None:
        self.boxes, self.depth = boxes, len(boxes.low)
        self.narrow, self.largest = narrow, np.zeros(len(narrow))
        self.rough = np.array([each.function is None for each in narrow], dtype=bool)
        active = np.array([self._is_harmful(k) for k in range(len(narrow))], dtype=bool)
        self.active = active.reshape(len(narrow), len(boxes.piece))
        if self.active.any() and self.depth > 1:
            self._cut_into_cones()
        change = np.zeros(self.boxes.low.shape)
        self.turned = np.zeros((2, len(narrow), *change.shape), dtype=bool)
        for k, (each, here) in enumerate(zip(narrow, self.active, strict=True)):
            steep, turned = self._on_net(each.guide)
            change += np.where(here, steep / np.maximum(steep.sum(axis=0), TINY), 0.0)
            self.turned[:, k] = here & turned
        change += len(narrow) * ~self.turned.any(axis=(0, 1))
        rays = np.flatnonzero(self.boxes.ray >= 0)
        change[self.boxes.ray[rays], rays] = np.inf
        self.order = np.argsort(change, axis=0, kind="stable")

    def at(self, function: Function, points: Floats) -> Floats:
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
        values = self.at(self.narrow[k].argument, self._net()).reshape(len(self.boxes.piece), -1)
        self.note(k, values)
        values = np.where(np.isfinite(values), values, 0.0)
        low, high, sizes = values.min(axis=1), values.max(axis=1), np.abs(values)
        if self.narrow[k].function is not None:
            return np.asarray(high - low > UNSEEN * self.narrow[k].steep)
        return np.asarray((low <= 0) & (high >= 0) | (sizes.min(axis=1) < NEAR * sizes.max(axis=1)))

    def note(self, k: int, arguments: Floats) -> None:
        """Keep the largest value that is known of a narrow function, or of the argument of a kink."""
        function = self.narrow[k].function
        with np.errstate(all="ignore"):
            values = np.abs(arguments if function is None else function(arguments))
        self.largest[k] = max(self.largest[k], np.max(values, where=np.isfinite(values), initial=0.0))

    def _on_net(self, function: Function) -> tuple[Floats, Array]:
        """How much a function changes along coordinates (d by n).

        With it comes whether it is lowest, or highest, inside (2 by d by n).
        """
        count = len(self.boxes.piece)
        sizes = np.zeros((self.depth, count))
        turned = np.zeros((2, self.depth, count), dtype=bool)
        grid = self.at(function, self._net()).reshape(count, *[NET] * self.depth)
        for axis in range(self.depth):
            along = np.moveaxis(grid, axis + 1, -1).reshape(count, -1, NET)
            steps = line_search.directions(along)
            turns = np.diff(steps)
            turned[:, axis] = (turns == 2).any(axis=(1, 2)), (turns == -2).any(axis=(1, 2))
            with np.errstate(invalid="ignore"):
                steep = np.abs(np.diff(along))
            sizes[axis] = np.where(np.isfinite(steep) & (steps != 0), steep, 0.0).sum(axis=(1, 2))
        return sizes, turned

    def _cut_into_cones(self) -> None:
        """Take as cones the boxes in which what has roots or poles turns back along every coordinate."""
        boxes, apex = self.boxes, self.boxes.low.copy()
        needed = np.zeros(len(boxes.piece), dtype=bool)
        for k in np.flatnonzero(self.rough).tolist():
            if not self.narrow[k].breaks:
                turned = self._on_net(self.narrow[k].core)[1]
                those = np.flatnonzero(turned.any(axis=0).all(axis=0) & self.active[k] & ~needed)
                apex[:, those] = self._extremes(self.narrow[k].core, those)
                needed[those] = True
        those, rest = np.flatnonzero(needed), np.flatnonzero(~needed)
        if those.size:
            cones, sources = boxes.taken(those).cones(apex[:, those])
            self.boxes = joined([boxes.taken(rest), cones])
            self.active = np.hstack([self.active[:, rest], self.active[:, those[sources]]])
        for k in np.flatnonzero(self.rough).tolist():  # a kink at the apex is none along the rays
            tips = np.abs(self.narrow[k].argument(np.vstack([self.boxes.piece, self.boxes.apex])))
            values = np.abs(self.at(self.narrow[k].argument, self._net())).reshape(tips.size, -1)
            self.active[k] &= (self.boxes.ray < 0) | (tips > NO_DISTANCE * values.max(axis=1))

    def _extremes(self, function: Function, those: Array) -> Floats:
        """The places (d by n) in boxes where a function is lowest, or highest if this is farther inside."""
        axes = np.tile(np.arange(self.depth)[:, None], those.size)
        start = np.vstack([those, np.zeros(axes.shape)])
        found = [
            line_search.lowest_within(partial(signed, partial(self.at, function), sign), start, axes)[1:]
            for sign in (1, -1)
        ]
        depths = [np.minimum(unit, 1 - unit).min(axis=0) for unit in found]
        low, high = self.boxes.low[:, those], self.boxes.high[:, those]
        return low + (high - low) * np.where(depths[0] >= depths[1], *found)


def signed(function: Function, sign: int, points: Floats) -> Floats:
    """A function, or its negative where the `sign` is -1, at points."""
    return sign * function(points)
