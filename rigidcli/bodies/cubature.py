"""Integrals over a unit box of functions of up to three coordinates, with an estimate of their error.

- Of a smooth function, products of Gauss's rules are taken with more and more nodes until they agree.
- Where a function has kinks or jumps, lines are cut there, one coordinate after the other, and Gauss's rule
  is taken on each piece. Lines of the outer coordinates are cut where the cuts of the inner ones begin and
  end.
- Else boxes are halved where the rule of A. Genz and A. Malik (J. Comput. Appl. Math. 6 (1980) 295) has the
  largest error.

Lines and boxes are taken twice, in different places. The error is ten times the change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats

Numbers: TypeAlias = NDArray[np.intp]

Integrand: TypeAlias = Callable[[Floats], Floats]
"""Values (c by n) at points (d by n) of the unit box; the first is positive, and the scale of all."""

Kink: TypeAlias = Callable[[Floats], Floats]
"""A function (d by n to n) with another sign on each side of a kink or a jump of an integrand."""

WORST = 1e-4
"""The largest relative error that an answer may have."""

GOAL = 1e-13
"""The relative change at which sums agree: a margin above the rounding of long sums."""

ENOUGH, FAIR = 1e-9, 1e-8
"""Relative errors at which no further points are taken: of a smooth function, and of one with kinks."""

POOR = 1e-6
"""The relative error of lines above which boxes are tried, too: they can do better where kinks are many."""

MARGIN = 10.0
"""The error in units of the change from one run to the other, which may share a part of their errors."""

MOST = 4_000_000
"""The most points of a run, which take some seconds."""

BLOCK = 100_000
"""Points worked at a time, which bounds the memory."""

PRODUCTS = (12, 16, 22, 30, 42)
"""Nodes along each coordinate of a product of rules; twelve see what is as wide as a tenth of the box."""

PIECES = (8, 12, 18, 28)
"""Nodes on each piece of a line; the second run has one more."""

FIRST = {1: (8, 9), 2: (24, 29), 3: (12, 15)}
"""The first boxes of the two runs along each of so many coordinates."""

TINY = 1e-13
"""Pieces of lines below this are the rounding of a cut that is there twice; smaller boxes are not halved."""

NEAR = 1e-7
"""The sides of the boxes that are first taken at a peak: less than a peak that may be answered."""


@dataclass(frozen=True, slots=True, eq=False)
class Integral:
    """The `values` (c) of an integral, and their `error` in units of the first."""

    values: Floats
    error: float


def integral(
    f: Integrand, periodic: Sequence[bool], kinks: Sequence[Kink], peaks: Sequence[Floats], cost: int
) -> Integral:
    """The integral of `f` over the unit box, with as many coordinates as may be `periodic`.

    At the `peaks` (points, d) it may be much larger than elsewhere. A value of `f` counts as `cost` points.
    """
    depth = len(periodic)
    if not depth:
        return Integral(f(np.zeros((0, 1)))[:, 0], float(np.finfo(float).eps))
    if not kinks and not peaks and (found := _by_products(f, periodic)):
        return found
    best = Integral(np.zeros(1), np.inf)
    enough = FAIR if kinks else ENOUGH
    for way in (_by_lines, _by_boxes) if kinks and not peaks else (_by_boxes,):
        if best.error <= POOR:
            break
        runs = [way(_Work(f, kinks, peaks, cost), depth, which) for which in (0, 1)]
        with suppress(_ExhaustedError):
            old, new = [best, best], [next(run) for run in runs]
            while best.error > enough and new != old:
                one, other = new
                change = MARGIN * _distance(one.values, other.values)
                error = max(change, one.error, other.error, GOAL)
                best = min(best, Integral(other.values, error), key=lambda each: each.error)
                old, new = new, [next(run, last) for run, last in zip(runs, new, strict=True)]
    return best


class _ExhaustedError(Exception):
    """A run takes more points than it may."""


class _Work:
    """An integrand with its kinks and peaks; it counts its points, and raises _ExhaustedError beyond MOST."""

    def __init__(self, f: Integrand, kinks: Sequence[Kink], peaks: Sequence[Floats], cost: int) -> None:
        self.left = float(MOST)
        self.f = self._counting(f, cost)
        # A kink is a part of a density, and an integrand has ten values.
        self.kinks = [self._counting(kink, cost / 8) for kink in kinks]
        self.peaks = peaks

    def _counting(self, function: Callable[[Floats], Floats], cost: float) -> Callable[[Floats], Floats]:
        def counting(points: Floats) -> Floats:
            self.left -= 1 + cost * points.shape[1]
            if self.left < 0:
                raise _ExhaustedError
            return function(points)

        return counting


def downhill(function: Callable[[Floats], Floats], points: Floats, step: float) -> Floats:
    """Points (d by n) of the unit box after a search downhill, with steps that are halved each time."""
    around = np.array(list(product((0, -1, 1), repeat=len(points)))).T
    each = np.arange(points.shape[1])
    while step > np.finfo(float).eps:
        moved = np.clip(points[:, :, None] + step * around[:, None], 0, 1)
        values = function(moved.reshape(len(points), -1)).reshape(each.size, -1)
        points, step = moved[:, each, values.argmin(axis=1)], step / 2
    return points


def _by_products(f: Integrand, periodic: Sequence[bool]) -> Integral | None:
    """Sums over products of nodes that agree; None where the most nodes are too few.

    Where a function is periodic, even nodes are better than Gauss's.
    """
    before, last, values = np.inf, np.inf, np.zeros(1)
    for count in PRODUCTS:
        even = (0.5 + np.arange(count)) / count, np.full(count, 1 / count)
        rules = [even if turns else _gauss(count) for turns in periodic]
        points = np.array(list(product(*(nodes for nodes, _ in rules)))).T
        weights = np.array([np.prod(own) for own in product(*(own for _, own in rules))])
        old, values = values, _summed(f, points, weights)
        before, last = last, _distance(old, values)
        if max(before, last) <= GOAL:
            return Integral(values, max(MARGIN * last, float(np.finfo(float).eps)))
    # Sums converge ever faster, so that the change before the last one is far above the error.
    return Integral(values, before) if last <= before <= ENOUGH else None


def _distance(one: Floats, other: Floats) -> float:
    """The largest change, in units of the first value; infinite where there is no value."""
    change = float(np.abs(one - other).max() / abs(other[0])) if other[0] else np.inf
    return change if np.isfinite(change) else np.inf


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss's rule from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (1 + nodes) / 2, weights / 2


def _summed(f: Integrand, points: Floats, weights: Floats) -> Floats:
    blocks = [slice(at, at + BLOCK) for at in range(0, weights.size, BLOCK)]
    return np.asarray(sum(f(points[:, block]) @ weights[block] for block in blocks))


# --- lines


def _by_lines(work: _Work, depth: int, which: int) -> Iterator[Integral]:
    """The integral along lines that are cut at the kinks, with more nodes each time."""
    samples = (15, 18)[which]  # where lines are searched for kinks, so that few pass by both runs
    order = _order(work.kinks, depth)
    # The two runs take the outer coordinates in turn.
    order = order if which == 0 else [*order[:-1][::-1], order[-1]]
    levels: list[Sequence[Kink]] = [work.kinks]
    for k in order[:0:-1]:
        levels.insert(0, [outer for kink in levels[0] for outer in _outlines(kink, k, samples)])
    whole = np.zeros((depth, 1))
    outermost = [_crossings(kink, order[0], whole, samples) for kink in levels[0]]
    for count in PIECES:
        points, weights = whole, np.ones(1)
        for k, kinks in zip(order, levels, strict=True):
            cuts = [_crossings(kink, k, points, samples) for kink in kinks] if k != order[0] else outermost
            points, weights = _between(cuts, k, points, weights, count + which)
        yield Integral(_summed(work.f, points, weights), 0.0)


def _order(kinks: Sequence[Kink], depth: int) -> list[int]:
    """The coordinates; along the last of them, kinks are crossed most often."""
    lines = np.random.default_rng(1).random((depth, 64))
    crossed = [sum(_crossings(kink, k, lines, 15)[0].size for kink in kinks) for k in range(depth)]
    return sorted(range(depth), key=crossed.__getitem__)


def _along(function: Kink, k: int, lines: Floats, places: Floats) -> Floats:
    """Values (n by m) along n lines (d by n) in coordinate k, at m places of each (n by m)."""
    points = np.repeat(lines, places.shape[1], axis=1)
    points[k] = places.ravel()
    return function(points).reshape(places.shape)


def _looked_at(function: Kink, k: int, lines: Floats, samples: int) -> tuple[Floats, Floats]:
    """Places (n by m) along n lines (d by n) in coordinate k, in ascending order, and the values there.

    Beside even places these are the vertices of parabolas through three neighbours, so that a short piece of
    the other sign is seen; then once more about the highest and the lowest value.
    """
    rows = np.arange(lines.shape[1])[:, None]
    places = np.tile(np.linspace(0, 1, samples), (lines.shape[1], 1))
    values = _along(function, k, lines, places)
    for sign in (0, 1, -1):
        best = (sign * values).argmax(axis=1)[:, None] if sign else np.arange(samples)[None, 1:-1]
        middle = np.clip(best, 1, places.shape[1] - 2)
        at, height = ([part[rows, middle + side] for side in (-1, 0, 1)] for part in (places, values))
        left, right = at[0] - at[1], at[2] - at[1]
        down, up = height[0] - height[1], height[2] - height[1]
        with np.errstate(all="ignore"):
            step = (left**2 * up - right**2 * down) / (2 * (left * up - right * down))
        new = at[1] + np.where((left < step) & (step < right), step, (left + right) / 4)
        places, values = np.hstack([places, new]), np.hstack([values, _along(function, k, lines, new)])
        ascending = np.argsort(places, axis=1)
        places, values = places[rows, ascending], values[rows, ascending]
    return places, values


def _outlines(kink: Kink, k: int, samples: int) -> list[Kink]:
    """Kinks in the other coordinates, at which the crossings along coordinate k begin or end.

    There the kink passes an end of the line, or only touches it.
    """

    def end(place: float, points: Floats) -> Floats:
        return _along(kink, k, points, np.full((points.shape[1], 1), place))[:, 0]

    def most(sign: int, points: Floats) -> Floats:
        return np.asarray(sign * (sign * _looked_at(kink, k, points, samples)[1]).max(axis=1))

    return [partial(end, 0.0), partial(end, 1.0), partial(most, 1), partial(most, -1)]


def _crossings(kink: Kink, k: int, lines: Floats, samples: int) -> tuple[Numbers, Floats]:
    """Where lines cross a kink: the numbers of the lines (m), and the places (m)."""
    places, values = _looked_at(kink, k, lines, samples)
    line, at = np.nonzero((values[:, 1:] > 0) != (values[:, :-1] > 0))
    low, high, below, above = (part[line, at + side] for part in (places, values) for side in (0, 1))
    points, kept = lines[:, line].copy(), np.zeros(line.size)
    # The rule of false position with the halved values of Illinois, and bisection: 14 steps give all digits.
    for step in range(14 if line.size else 0):
        share = 0.5 if step % 3 == 2 else np.clip(below / (below - above), 1e-3, 1 - 1e-3)
        points[k] = place = low + share * (high - low)
        value = kink(points)
        same = (value > 0) == (below > 0)
        above, below = (
            np.where(same, np.where(kept > 0, above / 2, above), value),
            np.where(same, value, np.where(kept < 0, below / 2, below)),
        )
        low, high = np.where(same, place, low), np.where(same, high, place)
        kept = np.where(same, 1, -1)
    return line, points[k]


def _between(
    cuts: Sequence[tuple[Numbers, Floats]], k: int, lines: Floats, weights: Floats, count: int
) -> tuple[Floats, Floats]:
    """Points along lines in coordinate k, so many in each piece between two cuts, and the weights there."""
    ends = np.arange(lines.shape[1])
    line = np.concatenate([ends, *(own for own, _ in cuts), ends])
    place = np.concatenate([np.zeros(ends.size), *(own for _, own in cuts), np.ones(ends.size)])
    order = np.lexsort((place, line))
    line, place = line[order], place[order]
    width = np.diff(place)
    pieces = np.flatnonzero((line[1:] == line[:-1]) & (width > TINY))
    nodes, own = _gauss(count)
    # A root at an end of a piece becomes smooth in u where t = u^3 (10 - 15 u + 6 u^2).
    shares, slopes = nodes**3 * (10 + nodes * (6 * nodes - 15)), 30 * (nodes * (1 - nodes)) ** 2
    points = np.repeat(lines[:, line[pieces]], count, axis=1)
    points[k] = (place[pieces, None] + width[pieces, None] * shares).ravel()
    return points, (weights[line[pieces], None] * width[pieces, None] * (own * slopes)).ravel()


# --- boxes


class _Rule(NamedTuple):
    """Points (d by m) from -1 to 1, their weights (m), and those of a rule of a lower degree (m)."""

    points: Floats
    weights: Floats
    lower: Floats
    fourth: Floats
    """Weights (d by m) of the fourth difference along each coordinate."""


def _genz_malik(d: int) -> _Rule:
    """The rule of degree 7 with the one of degree 5 in it; for one coordinate, Gauss's of 15 and 7 nodes."""
    if d == 1:
        (many, heavy), (few, light) = np.polynomial.legendre.leggauss(15), np.polynomial.legendre.leggauss(7)
        both = np.append(heavy / 2, 0 * few), np.append(0 * many, light / 2)
        return _Rule(np.append(many, few)[None], *both, np.zeros((1, 22)))
    near, far, corner = np.sqrt([9 / 70, 9 / 10, 9 / 19])
    signs = np.array(list(product((-1, 0, 1), repeat=d))).T
    single, double, every = (signs[:, np.abs(signs).sum(axis=0) == count] for count in (1, 2, d))
    kinds = [np.zeros((d, 1)), near * single, far * single, far * double, corner * every]
    sizes = [kind.shape[1] for kind in kinds]
    centre = [(12824 - 9120 * d + 400 * d**2) / 19683, (729 - 950 * d + 50 * d**2) / 729]
    weights = [centre[0], 980 / 6561, (1820 - 400 * d) / 19683, 200 / 19683, 6859 / 19683 / 2**d]
    lower = [centre[1], 245 / 486, (265 - 100 * d) / 1458, 25 / 729, 0.0]
    # The fourth difference: of the near points less a seventh of that of the far ones, (9/70)/(9/10).
    along = np.abs(single).astype(np.float64)
    rest = np.zeros((d, sizes[3] + sizes[4]))
    fourth = np.hstack([np.full((d, 1), -2 * (1 - 1 / 7)), along, -along / 7, rest])
    return _Rule(np.hstack(kinds), np.repeat(weights, sizes), np.repeat(lower, sizes), fourth)


class _Boxes(NamedTuple):
    """Boxes (n) by their corners (d by n), with integrals (c by n), errors (n) and the sides to halve (n)."""

    low: Floats
    high: Floats
    values: Floats
    errors: Floats
    axes: Numbers

    @classmethod
    def of(cls, f: Integrand, rule: _Rule, low: Floats, high: Floats) -> _Boxes:
        """The integrals of `f`, which counts as zero at a point where it is infinite."""
        half, middle = (high - low) / 2, (high + low) / 2
        points = (middle[:, :, None] + half[:, :, None] * rule.points[:, None]).reshape(len(low), -1)
        found = f(points)
        values = np.where(np.isfinite(found), found, 0.0).reshape(len(found), low.shape[1], -1)
        sizes = (high - low).prod(axis=0)
        total = values @ rule.weights * sizes
        errors = np.abs(values @ rule.lower * sizes - total).max(axis=0)
        differences = np.abs(np.einsum("cnm,dm->cdn", values, rule.fourth)).max(axis=0)
        # Of equal differences the longest side is halved.
        sides = differences * (1 + 1e-6 * half / half.max()) + 1e-300 * half
        return cls(low, high, total, errors, np.argmax(sides, axis=0))

    @property
    def sides(self) -> Floats:
        """The longest side of each (n)."""
        return np.asarray((self.high - self.low).max(axis=0))

    def apart(self, point: Floats) -> Floats:
        """How far the point (d) is outside of each (n); not above zero inside."""
        return np.asarray(np.maximum(self.low - point[:, None], point[:, None] - self.high).max(axis=0))

    def halved(self, f: Integrand, rule: _Rule, chosen: Numbers, axes: Numbers) -> _Boxes:
        """The boxes, of which the `chosen` ones (m) are halved along these coordinates (m)."""
        each = np.arange(chosen.size)
        low, high = np.tile(self.low[:, chosen], 2), np.tile(self.high[:, chosen], 2)
        high[axes, each] = low[axes, chosen.size + each] = (low[axes, each] + high[axes, each]) / 2
        new = _Boxes.of(f, rule, low, high)
        pairs = zip(self, new, strict=True)
        return _Boxes(*(np.concatenate([np.delete(old, chosen, -1), own], axis=-1) for old, own in pairs))


def _by_boxes(work: _Work, depth: int, which: int) -> Iterator[Integral]:
    """The integral by halving the boxes with the largest errors, each time with twice the points.

    The error is that of boxes too small to be halved: nearly all of it where the integral is infinite.
    """
    rule = _genz_malik(depth)
    ends = np.linspace(0, 1, 1 + FIRST[depth][which])
    low, high = (
        np.array([grid.ravel() for grid in np.meshgrid(*[side] * depth, indexing="ij")])
        for side in (ends[:-1], ends[1:])
    )
    boxes = _Boxes.of(work.f, rule, low, high)
    for peak in work.peaks:
        while (at := np.flatnonzero((boxes.apart(peak) <= 0) & (boxes.sides > NEAR))).size:
            boxes = boxes.halved(work.f, rule, at, np.argmax((boxes.high - boxes.low)[:, at], axis=0))
    target, agreed = work.left, False
    while not agreed:
        errors = np.where(boxes.sides > TINY, boxes.errors, 0.0)
        total = boxes.values.sum(axis=1)
        stuck = float(boxes.errors.sum() - errors.sum()) / abs(total[0]) if total[0] else np.inf
        agreed = errors.sum() <= GOAL * abs(total[0]) or not stuck <= WORST
        if agreed or work.left <= target:
            yield Integral(total, stuck)
            target = 2 * work.left - MOST
        descending = np.argsort(-errors)
        count = 1 + int(np.searchsorted(errors[descending].cumsum(), errors.sum() / 2))
        worst = descending[: min(count, 2000)]  # so that the next ones are chosen by newer errors
        boxes = boxes.halved(work.f, rule, worst, boxes.axes[worst])
