"""Integrals over a unit box of functions that are smooth between surfaces, with an estimate of their error.

There are three ways, each for what the one before cannot do:

- A product of Gauss's rules is taken with more and more nodes until its sums stand.
- Lines are cut at the surfaces, and Gauss's rule is taken on each piece, one coordinate after the other.
  Lines of the outer coordinates are cut where the cuts of the inner ones begin and end.
- Boxes are halved where the rule of A. Genz and A. Malik (J. Comput. Appl. Math. 6 (1980) 295) says that the
  error is largest, as points with an infinite value need it.

The last two are done twice, with other lines or boxes; the error is ten times the change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from rigidcli.bodies.genz_malik import BLOCK, blockwise, over_boxes
from rigidcli.core.arithmetic import Floats

Integrand: TypeAlias = Callable[[Floats], Floats]
"""Values (c by n) at points (d by n) of the unit box; the first is positive, and the scale of all."""


class Surfaces(NamedTuple):
    """The surfaces on which a function of points (d by n to n) of the unit box has these `heights`."""

    function: Callable[[Floats], Floats]
    heights: tuple[float, ...] = (0.0,)


GOAL = 1e-13
"""The relative change at which sums stand: a margin above the rounding of long sums."""

MARGIN = 10.0
"""The error in units of the change from one run to the other, which may share a part of their errors."""

FEW, MOST = 400_000, 4_000_000
"""The most points of a way: of one that may settle a smooth function before its lines are cut, and of any."""

ENOUGH, SMOOTH_ENOUGH = 1e-8, 1e-9
"""Relative errors that are small enough to try no other way, of a function with kinks and of a smooth one."""

NODES = (8, 12, 18, 28)
"""Nodes on each piece of a line, step by step until the two runs agree; the second run has one more."""

STEPS = 14
"""Steps by which a cut is found; each third one halves the interval that holds it."""


HALVINGS = 40
"""Halvings of the steps of a search: below the rounding of a coordinate from 0 to 1."""

LEAST_BOX = 1e-10
"""The sides of a box whose error still counts, where the integral is infinite or beyond this way."""

SHORTEST = 1e-13
"""Pieces of lines below this are the rounding of a cut that is there twice."""


class Integral(NamedTuple):
    """The `values` (c) of an integral, and their `error` in units of the first."""

    values: Floats
    error: float


def integral(f: Integrand, surfaces: Sequence[Surfaces], periodic: Sequence[bool], smooth: bool) -> Integral:
    """The integral of `f` over the unit box, the best that any of the ways gives.

    Each coordinate (0 to 3 of them) may be `periodic`. At the `surfaces` the function may have kinks or jumps
    or change quickly. Where it is `smooth` as far as is known beforehand, lines are cut last.
    """
    depth = len(periodic)
    best = _products(f, periodic) if smooth else None
    if best is not None:
        return best
    best = Integral(np.zeros(1), np.inf)
    for way, work in ((_by_boxes, FEW), (_by_lines, MOST), (_by_boxes, MOST)):
        if (way is _by_boxes and (not depth or (work == FEW and not smooth))) or not (depth or surfaces):
            continue
        counted = _Counted(f, surfaces, work)
        with suppress(_ExhaustedError):
            # Two runs differ in their lines or boxes; both go on until they agree.
            for one, other in zip(way(counted, depth, 0), way(counted, depth, 1), strict=False):
                found = Integral(other, max(MARGIN * _distance(one, other), GOAL))
                best = min(best, found, key=lambda each: each.error)
                if best.error <= (SMOOTH_ENOUGH if smooth else ENOUGH):
                    return best
    return best


class _ExhaustedError(Exception):
    """A way takes more points than it may."""


class _Counted:
    """An integrand and surfaces that count their points, and raise _ExhaustedError beyond the `work`."""

    def __init__(self, f: Integrand, surfaces: Sequence[Surfaces], work: int) -> None:
        self.left = self.work = work
        self.f = self._counting(f, 1)
        self.surfaces = [Surfaces(self._counting(each.function, 8), each.heights) for each in surfaces]

    def _counting(self, function: Callable[[Floats], Floats], share: int) -> Callable[[Floats], Floats]:
        """The function; so many of its points count as one, as an integrand has ten values."""

        def counting(points: Floats) -> Floats:
            self.left -= 1 + points.shape[1] // share
            if self.left < 0:
                raise _ExhaustedError
            return function(points)

        return counting


def downhill(function: Callable[[Floats], Floats], points: Floats, step: float) -> Floats:
    """Points (d by n) of the unit box from which steps, half as long each time, have gone downhill."""
    lowest = function(points)
    for halving in range(HALVINGS):
        for k, side in product(range(len(points)), (-1, 1)):
            moved = points.copy()
            moved[k] = np.clip(moved[k] + side * step / 2**halving, 0, 1)
            values = function(moved)
            better = values < lowest
            points, lowest = np.where(better, moved, points), np.where(better, values, lowest)
    return points


def _products(f: Integrand, periodic: Sequence[bool]) -> Integral | None:
    """Sums over products of nodes that stand for two steps; None where 36 in each coordinate are too few.

    Where a function is periodic, even nodes are better than Gauss's.
    """
    changes, last = [np.inf], None
    for count in (6, 10, 14, 20, 28, 36):
        even = (0.5 + np.arange(count)) / count, np.full(count, 1 / count)
        rules = [even if turns else _gauss(count) for turns in periodic]
        points = np.array(list(product(*(nodes for nodes, _ in rules)))).T.reshape(len(rules), -1)
        factors = np.array([np.prod(each) for each in product(*(weights for _, weights in rules))])
        values = blockwise(f, points) @ factors
        if last is not None:
            changes.append(_distance(values, last))
            if max(changes[-2:]) <= GOAL:
                return Integral(values, max(changes[-1] * MARGIN, np.finfo(float).eps))
        last = values
    return None


def _distance(one: Floats, other: Floats) -> float:
    """The largest change, in units of the first value; infinite where there is no value."""
    change = float(np.abs(one - other).max() / abs(other[0])) if other[0] else np.inf
    return change if np.isfinite(change) else np.inf


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss's rule from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (1 + nodes) / 2, weights / 2


# --- lines


def _by_lines(counted: _Counted, depth: int, which: int) -> Iterator[Floats]:
    """The integral along lines that are cut at the surfaces, with more nodes each time."""
    surfaces = counted.surfaces
    order = _order(surfaces, depth)
    # The two runs take the outer coordinates in turn, and look at other points of the lines.
    order = order if which == 0 else [*order[:-1][::-1], *order[-1:]]
    samples = (15, 18)[which]
    levels = [list(surfaces)]
    for k in reversed(order[1:]):
        levels.append([outer for one in levels[-1] for outer in _outlines(one, k, samples)])
    levels.reverse()
    whole = np.zeros((depth, 1))
    outermost = [_crossings(each, order[0], whole, samples) for each in levels[0]] if depth else []
    for count in NODES:
        points, weights = whole, np.ones(1)
        for k, cutting in zip(order, levels, strict=False):
            found = outermost if k == order[0] else [_crossings(each, k, points, samples) for each in cutting]
            points, weights = _between(found, k, points, weights, count + which)
        values = np.zeros(1)
        for begin in range(0, points.shape[1], BLOCK):
            values = values + counted.f(points[:, begin : begin + BLOCK]) @ weights[begin : begin + BLOCK]
        yield values


def _order(surfaces: Sequence[Surfaces], depth: int) -> list[int]:
    """The coordinates, that along which surfaces are crossed most often last."""
    chance = np.random.default_rng(1)
    crossed = []
    for k in range(depth):
        lines = chance.random((depth, 64))
        crossed.append(sum(_crossings(one, k, lines, 17)[0].size for one in surfaces))
    return sorted(range(depth), key=crossed.__getitem__)


def _sampled(function: Callable[[Floats], Floats], k: int, lines: Floats, places: Floats) -> Floats:
    """Values (n by m) along n lines (d by n) in coordinate k, at m places, the same or each line's own."""
    count, own = lines.shape[1], np.broadcast_to(places, (lines.shape[1], places.shape[-1]))
    points = np.repeat(lines, own.shape[1], axis=1)
    points[k] = own.ravel()
    return function(points).reshape(count, -1)


def looked_at(
    function: Callable[[Floats], Floats], k: int, lines: Floats, samples: int
) -> tuple[Floats, Floats]:
    """Places (n by m) along n lines (d by n) in coordinate k, in ascending order, and the values there.

    Beside even places there are the vertices of parabolas through three values, so that what is narrow
    shows where the function itself is smooth; and twice more about the highest and the lowest value.
    """
    even = np.linspace(0, 1, samples)
    values = _sampled(function, k, lines, even)
    left, middle, right = values[:, :-2], values[:, 1:-1], values[:, 2:]
    with np.errstate(all="ignore"):
        offset = (left - right) / (2 * (left - 2 * middle + right))
    places = np.broadcast_to(even, values.shape)
    new = even[1:-1] + np.where(np.abs(offset) <= 1, offset, 0.0) / (samples - 1)
    for sign in (1, -1, 1, -1):
        places, values = np.hstack([places, new]), np.hstack([values, _sampled(function, k, lines, new)])
        order = np.argsort(places, axis=1)
        places, values = np.take_along_axis(places, order, axis=1), np.take_along_axis(values, order, axis=1)
        best = np.clip((sign * values).argmax(axis=1), 1, values.shape[1] - 2)[:, None] + np.arange(-1, 2)
        new = _vertex(np.take_along_axis(places, best, axis=1), np.take_along_axis(values, best, axis=1))
    return places, values


def _vertex(places: Floats, values: Floats) -> Floats:
    """Where parabolas through three points (n by 3 each) turn (n by 1), if that is between the outer ones."""
    left, right = places[:, 0] - places[:, 1], places[:, 2] - places[:, 1]
    down, up = values[:, 0] - values[:, 1], values[:, 2] - values[:, 1]
    with np.errstate(all="ignore"):
        step = (left**2 * up - right**2 * down) / (2 * (left * up - right * down))
    inside = (left < step) & (step < right)
    return (places[:, 1] + np.where(inside, step, (left + right) / 4))[:, None]


def _outlines(surfaces: Surfaces, k: int, samples: int) -> list[Surfaces]:
    """Surfaces in the other coordinates, at which the crossings along coordinate k begin or end.

    There the surfaces pass an end of the line, or only touch it.
    """
    function, heights = surfaces

    def end(place: float, points: Floats) -> Floats:
        return _sampled(function, k, points, np.array([place]))[:, 0]

    def most(sign: int, points: Floats) -> Floats:
        return np.asarray(sign * (sign * looked_at(function, k, points, samples)[1]).max(axis=1))

    functions = partial(end, 0.0), partial(end, 1.0), partial(most, 1), partial(most, -1)
    return [Surfaces(each, heights) for each in functions]


def _crossings(surfaces: Surfaces, k: int, lines: Floats, samples: int) -> tuple[Floats, Floats]:
    """Where lines cross the surfaces: the numbers of the lines (m), and the places (m)."""
    function, heights = surfaces
    places, values = looked_at(function, k, lines, samples)
    found = [_brackets(places, values - height, height) for height in heights]
    line, low, high, below, above, height = map(np.concatenate, zip(*found, strict=True))
    points = lines[:, line].copy()
    kept = np.zeros(line.size)
    for step in range(STEPS if line.size else 0):
        # The rule of false position with the halved values of Illinois, and bisection.
        share = 0.5 if step % 3 == 2 else np.clip(below / (below - above), 1e-3, 1 - 1e-3)
        points[k] = place = low + share * (high - low)
        value = function(points) - height
        same = (value > 0) == (below > 0)
        above, below = (
            np.where(same, np.where(kept > 0, above / 2, above), value),
            np.where(same, value, np.where(kept < 0, below / 2, below)),
        )
        low, high = np.where(same, place, low), np.where(same, high, place)
        kept = np.where(same, 1, -1)
    return line, points[k]


def _brackets(places: Floats, values: Floats, height: float) -> tuple[Floats, ...]:
    """Intervals with a change of sign: line, ends, values at the ends, and the height."""
    line, place = np.nonzero((values[:, 1:] > 0) != (values[:, :-1] > 0))
    ends = (part[line, place + side] for part in (places, values) for side in (0, 1))
    return line, *ends, np.full(line.size, height)


def _between(
    found: Sequence[tuple[Floats, Floats]], k: int, lines: Floats, weights: Floats, count: int
) -> tuple[Floats, Floats]:
    """Points along lines in coordinate k, between the crossings that are `found`, and the weights there."""
    ends = np.arange(lines.shape[1])
    line = np.concatenate([ends, *(own for own, _ in found), ends])
    place = np.concatenate([np.zeros(ends.size), *(own for _, own in found), np.ones(ends.size)])
    order = np.lexsort((place, line))
    line, place = line[order], place[order]
    width = np.diff(place)
    pieces = np.flatnonzero((line[1:] == line[:-1]) & (width > SHORTEST))
    nodes, own = _gauss(count)
    # A root at an end of a piece becomes smooth in u where t = u^3 (10 - 15 u + 6 u^2).
    shares, slopes = nodes**3 * (10 + nodes * (6 * nodes - 15)), 30 * (nodes * (1 - nodes)) ** 2
    points = np.repeat(lines[:, line[pieces]], count, axis=1)
    points[k] = (place[pieces, None] + width[pieces, None] * shares).ravel()
    return points, (weights[line[pieces], None] * width[pieces, None] * (own * slopes)).ravel()


# --- boxes


def _by_boxes(counted: _Counted, depth: int, which: int) -> Iterator[Floats]:
    """The integral by halving the boxes with the largest errors, until these are small or points run out.

    There is none where boxes shrink to a point and their errors do not: the integral is infinite.
    """
    f, enough = counted.f, counted.left - 2 * counted.work // 5
    first = np.array([0.0, (0.5, 0.4371)[which], 1.0])
    corners = np.array(list(product(range(2), repeat=depth))).T
    low, high = first[corners], first[corners + 1]
    values, errors, axes = over_boxes(f, low, high)
    while counted.left > enough:
        total = values.sum(axis=1)
        if not np.isfinite(total).all() or errors.sum() <= GOAL * abs(total[0]):
            break
        order = np.argsort(-errors)
        worst = order[: 1 + np.searchsorted(errors[order].cumsum(), errors.sum() / 2)][:2000]
        if (high - low)[:, worst].max(axis=0).min() < LEAST_BOX:
            return
        middle = (low[axes[worst], worst] + high[axes[worst], worst]) / 2
        lows, highs = np.tile(low[:, worst], 2), np.tile(high[:, worst], 2)
        each = np.arange(worst.size)
        highs[axes[worst], each] = lows[axes[worst], worst.size + each] = middle
        new = over_boxes(f, lows, highs)
        kept = np.delete(np.arange(errors.size), worst)
        low, high = np.hstack([low[:, kept], lows]), np.hstack([high[:, kept], highs])
        values = np.hstack([values[:, kept], new[0]])
        errors, axes = np.append(errors[kept], new[1]), np.append(axes[kept], new[2])
    yield np.asarray(values.sum(axis=1))
