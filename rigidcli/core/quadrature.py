"""Integrals over unit boxes of up to three dimensions, of functions that are smooth but for kinks and jumps.

The integral is taken coordinate by coordinate, along many lines at a time: by the rule of Gauss and Kronrod
with 21 nodes, on panels that are halved where its error is too large. First, each line is cut where a
function that the integrand hangs on passes zero, or is largest or smallest: there kinks, jumps and peaks
are. So a jump at the bottom of a layer costs no digits, however the layer lies in the coordinates.

Source: R. Piessens and others, QUADPACK (Springer, 1983), section 2.2, for the rule and its error; its
estimate is made larger here by what the integrand does at the ends of a panel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats

_KRONROD = (
    (0.9956571630258081, 0.011694638867371874),
    (0.9739065285171717, 0.032558162307964725),
    (0.9301574913557082, 0.054755896574351995),
    (0.8650633666889845, 0.07503967481091996),
    (0.7808177265864169, 0.0931254545836976),
    (0.6794095682990244, 0.10938715880229764),
    (0.5627571346686047, 0.12349197626206584),
    (0.4333953941292472, 0.13470921731147334),
    (0.2943928627014602, 0.14277593857706009),
    (0.14887433898163122, 0.14773910490133849),
    (0.0, 0.1494455540029169),
)
"""The nodes from 0 to 1 of the rule of Kronrod with 21, and their weights. Every other is one of Gauss."""

_END = 1e-9
"""Where an end of a panel is looked at, in units of it: inside, so that it is on the right side of a jump."""

NARROWEST = 2.0**-44
"""Panels that are narrower, in units of the line, are not halved: their nodes would be one point."""

LINES = 512
"""Lines that are worked on together: their samples stay in the cache, and memory is bounded."""

OVERHEAD = 1000
"""What a call for a few points costs more than these, in points."""

STEPS = 8
"""Steps of Ridders's method to a zero between two samples; a smooth function needs fewer."""

BISECTIONS = 50
"""Halvings by which zeros are found that this method has missed: to a part in 10^15."""

FOUND = 1e-13
"""A zero is found when the function changes its sign within this distance, in units of the line."""

GOLDEN = (5**0.5 - 1) / 2
"""The part that is left of an interval in each step of the golden-section search."""

SECTIONS = 30
"""Steps of that search: to a part in 10^6 of the gap between two samples, or 10^7 of the line."""

FLAT = 1e-9
"""A function that changes by less, in units of its largest value, has no peak: this is rounding."""

ROUNDING = 4 * float(np.finfo(np.float64).eps)
"""The relative error that rounding leaves in the sum of a panel."""


WIDEST = 0.1
"""The net of a search for the lowest point at its beginning, in units of the box."""

SEARCH = 60
"""Steps of that search: to a part in 10^12, as the net gets finer by a third in each."""


SURPRISE = 1e-6
"""How far an integrand may miss the polynomial through the nodes, in units of its largest value, before it is
cut where a narrow function passes zero or turns back."""

UNRELATED = (0.0, 0.2137, 0.5, 0.7391, 1.0)
"""Coordinates of the lines on which this is tried: ends, the middle, and such as no document has."""

MOST_PROBES = 9
"""Places on each coordinate at which narrow functions of others are looked at."""

MOST_PIECES = 5
"""Pieces in which it is tried."""


EXTREMES = 3
"""So many of the lowest and of the highest points are tried in the search for the extremes of a function."""

SAMPLES = 9
"""Points along each coordinate of the net from which they are searched for."""


def _interpolating(nodes: Floats, x: Floats) -> Floats:
    """The weights (n by nodes) of values at `nodes` in the polynomial through them at places x (n)."""
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    offsets = x[:, None] - nodes
    terms = 1 / (gaps.prod(axis=1) * np.where(offsets == 0, 1e-100, offsets))
    weights: Floats = terms / terms.sum(axis=1, keepdims=True)
    return weights


class _Rule(NamedTuple):
    """A rule on panels from 0 to 1, the ends of which are the first and the last of its `places`.

    The weights of both rules are zero there; those of `at_ends` (n by 2) tell how far the polynomial through
    the other values misses those at the ends. Between an end and the next place `unseen` is not seen.
    """

    places: Floats
    kronrod: Floats
    gauss: Floats
    at_ends: Floats
    unseen: float

    @classmethod
    def made(cls, places: Callable[[Floats], Any], slope: Callable[[Floats], Any], end: float) -> _Rule:
        """The rule in a variable of which places are a function with this `slope`; `end` is near its ends."""
        positive, weights = np.array(_KRONROD).T
        nodes = (1 + np.concatenate([-positive[:-1], positive[::-1]])) / 2
        kronrod = np.concatenate([weights[:-1], weights[::-1]]) / 2
        gauss = np.zeros(len(nodes))
        gauss[1::2] = np.polynomial.legendre.leggauss(len(nodes) // 2)[1] / 2
        at_ends = np.pad(-_interpolating(nodes, np.array([end, 1 - end])).T, ((1, 1), (0, 0)))
        at_ends[0, 0] = at_ends[-1, 1] = 1.0
        both = [np.pad(row * slope(nodes), 1) for row in (kronrod, gauss)]
        at = places(np.concatenate([[end], nodes, [1 - end]]))
        return cls(at, both[0], both[1], at_ends, float(at[1]) / 2)


PLAIN = _Rule.made(lambda x: x, lambda x: 1 + 0 * x, _END)
"""The rule of Gauss and Kronrod as it is."""

GRADED = _Rule.made(lambda x: x * x * (3 - 2 * x), lambda x: 6 * x * (1 - x), (_END / 3) ** 0.5)
"""The same in a variable in which roots of the distance from either end are smooth."""


class Exhausted(Exception):  # noqa: N818 - an outcome, for those who ask for less then
    """The integral needs more evaluations than are allowed."""


class Integral(NamedTuple):
    """Integrals (k), and a bound on the error of each, by an estimate."""

    values: Floats
    error: float


@dataclass
class Narrow:
    """A function of points (1 + d by n), and the coordinates on which it hangs, counted from 1."""

    values: Callable[[Floats], Floats]
    levels: frozenset[int] = frozenset()


@dataclass
class Integrand:
    """What is to be integrated over 0 to 1 in each coordinate, and over several pieces.

    `values` takes points (1 + d by n), the first row being the index of the piece, and gives the values of
    k functions (k by n). Where values of the functions `narrow` pass zero, or are largest or smallest, the
    integrand may have a jump, a kink or a peak. `cuts` are places on each coordinate at
    which panels begin and end, 0 and 1 among them; `probes` are places where such functions are looked at.
    `costs` are the operations that a point of `values` costs, and one of a narrow function.
    """

    values: Callable[[Floats], Floats]
    narrow: Sequence[Narrow]
    cuts: Sequence[Floats]
    probes: Sequence[Floats]
    pieces: int = 1
    costs: tuple[float, float] = (1.0, 1.0)
    left: float = np.inf
    """The operations that may still be spent; then `Exhausted` is raised."""

    def look(self) -> None:
        """Forget the narrow functions near which the integrand does nothing that the nodes do not see."""
        places = [np.append(0.0, probe) for probe in self.probes]
        depth, harmful = len(self.cuts), []
        pieces = np.unique(np.linspace(0, self.pieces - 1, MOST_PIECES).astype(int))
        nets = [np.linspace(0, 1, SAMPLES)] * depth
        net = np.array(list(product(pieces, *nets))).T
        for function in self.narrow:
            values = self._narrow(function, net)
            function.levels = self._levels(values, (len(pieces), *(SAMPLES for _ in nets)))
            peaks = self._peaks(function, net, values)
            for level in sorted(function.levels):
                others = [UNRELATED if k != level else (0.0,) for k in range(1, depth + 1)]
                lines = np.hstack([np.array(list(product(pieces, *others))).T, peaks])
                if self._is_harmful(function, level, lines):
                    harmful.append(function)
                    places = [np.append(row, peak) for row, peak in zip(places, peaks[1:], strict=True)]
                    break
        self.narrow = harmful
        self.probes = [np.unique(np.round(row, 9))[:MOST_PROBES] for row in places]

    def _levels(self, values: Floats, shape: tuple[int, ...]) -> frozenset[int]:
        """The coordinates along which values on a net of this shape change."""
        grid = values.reshape(shape)
        with np.errstate(invalid="ignore"):
            slack = FLAT * np.abs(grid[np.isfinite(grid)]).max(initial=0.0)
            return frozenset(
                level for level in range(1, len(shape)) if not (np.ptp(grid, axis=level) <= slack).all()
            )

    def _peaks(self, function: Narrow, net: Floats, values: Floats) -> Floats:
        """The points (1 + d by 2) at which a narrow function is lowest and highest, as far as is found."""
        order, found = np.argsort(values, kind="stable"), []
        for sign, start in ((1, order[:EXTREMES]), (-1, order[-EXTREMES:])):
            signed = self._extreme(function, len(self.cuts) + 1, sign)
            points, told = lowest_points(signed, net[:, start])
            found.append(points[:, [int(np.argmin(told[-1]))]])
        return np.hstack(found)

    def integral(self, tolerance: float) -> Integral:
        """The integrals, the error of each below `tolerance` where that can be reached."""
        values, errors = self._over(1, np.arange(self.pieces, dtype=np.float64)[None], tolerance)
        return Integral(values.sum(axis=1), float(errors.sum()))

    def _spend(self, points: int, each: float) -> None:
        self.left -= (points + OVERHEAD) * each
        if self.left < 0:
            raise Exhausted

    def _narrow(self, function: Narrow, points: Floats) -> Floats:
        self._spend(points.shape[1], self.costs[1])
        return function.values(points)

    def _values(self, points: Floats) -> Floats:
        self._spend(points.shape[1], self.costs[0])
        return self.values(points)

    def _over(self, level: int, fixed: Floats, tolerance: float) -> tuple[Floats, Floats]:
        """Integrals (k by n) over coordinates from `level` on, the others being `fixed`, and errors (n)."""
        if level > len(self.cuts):
            return self._values(fixed), np.zeros(fixed.shape[1])
        if fixed.shape[1] > LINES:
            blocks = range(0, fixed.shape[1], LINES)
            found = [self._over(level, fixed[:, start : start + LINES], tolerance) for start in blocks]
            return np.hstack([values for values, _ in found]), np.hstack([errors for _, errors in found])
        line, low, high = self._panels(level, fixed)
        rule = GRADED if any(level in function.levels for function in self.narrow) else PLAIN
        totals, errors = np.zeros((0, fixed.shape[1])), np.zeros(fixed.shape[1])
        while line.size:
            width = high - low
            t = low[:, None] + width[:, None] * rule.places
            points = np.vstack([np.repeat(fixed[:, line], t.shape[1], axis=1), t.reshape(1, -1)])
            values, inner = self._over(level + 1, points, tolerance / 2)
            values = values.reshape(len(values), *t.shape)
            kronrod, own, rounding = _worked_out(values, width, rule)
            done = (own <= np.maximum(tolerance / 10, rounding)) | (width < NARROWEST)
            totals = totals if len(totals) else np.zeros((len(values), fixed.shape[1]))
            np.add.at(totals.T, line[done], kronrod[:, done].T)
            own += rounding + width * (inner.reshape(t.shape) @ rule.kronrod)
            np.add.at(errors, line[done], own[done])
            middle = (low + high)[~done] / 2
            line = np.tile(line[~done], 2)
            low, high = np.append(low[~done], middle), np.append(middle, high[~done])
        return totals, errors

    def _panels(self, level: int, fixed: Floats) -> tuple[Array, Floats, Floats]:
        """The panels to begin with: the line on which each lies, its beginning and its end."""
        count, cuts = fixed.shape[1], self.cuts[level - 1]
        lines, places = [np.repeat(np.arange(count), len(cuts))], [np.tile(cuts, count)]
        for function in self.narrow:
            if level not in function.levels:
                continue
            deeper = [probe if k in function.levels else probe[:1] for k, probe in enumerate(self.probes, 1)]
            tried: list[tuple[Callable[[Floats], Floats], Any, bool]] = []
            tried += [(partial(self._narrow, function), probe, True) for probe in product(*deeper[level:])]
            if level == len(self.cuts) - 1 and level + 1 in function.levels:
                extremes = [self._extreme(function, level + 1, sign) for sign in (1, -1)]
                tried += [(extreme, tried[0][1], False) for extreme in extremes]
            for f, probe, turns in tried:
                inner = np.repeat(np.array([[0.0, *probe]]).T, count, axis=1)
                on, found = self._special(f, level, np.vstack([fixed, inner]), turns=turns)
                lines.append(on)
                places.append(found)
        line, place = np.concatenate(lines), np.concatenate(places)
        order = np.lexsort((place, line))
        line, place = line[order], place[order]
        panels = (line[1:] == line[:-1]) & (np.diff(place) > NARROWEST)
        return line[1:][panels], place[:-1][panels], place[1:][panels]

    def _samples(self, level: int) -> Floats:
        """Places along a coordinate at which narrow functions are looked at, ends and cuts among them."""
        cuts = self.cuts[level - 1]
        inner = cuts[:-1, None] + np.diff(cuts)[:, None] * PLAIN.places[1:-1]
        return np.unique(np.append(inner, cuts))

    def _extreme(self, function: Narrow, level: int, sign: int) -> Callable[[Floats], Floats]:
        """How low a narrow function times `sign` comes over all coordinates from `level` on.

        Where that passes zero, the surface on which the function is zero is touched.
        """
        if level > len(self.cuts):
            return lambda points: sign * self._narrow(function, points)
        if level not in function.levels:
            return self._extreme(function, level + 1, sign)
        deeper, t = self._extreme(function, level + 1, sign), self._samples(level)

        def lowest(points: Floats) -> Floats:
            grid = _with(np.repeat(points, len(t), axis=1), level, np.tile(t, points.shape[1]))
            values = deeper(grid).reshape(-1, len(t))
            best = values.argmin(axis=1)
            low, high = t[np.maximum(best - 1, 0)], t[np.minimum(best + 1, len(t) - 1)]
            found = _lowest(lambda x: deeper(_with(points, level, x)), low, high)
            least: Floats = np.minimum(values.min(axis=1), deeper(_with(points, level, found)))
            return least

        return lowest

    def _special(
        self, function: Callable[[Floats], Floats], level: int, lines: Floats, *, turns: bool = True
    ) -> tuple[Array, Floats]:
        """Where a function passes zero and, if asked, turns back: the index of each line and the place on it.

        Lines are points (1 + d by n), of which the coordinate of this level is replaced.
        """
        t, count = self._samples(level), lines.shape[1]

        def sampled(line: Array, places: Floats) -> Floats:
            return function(_with(lines[:, line], level, places))

        values = sampled(np.repeat(np.arange(count), len(t)), np.tile(t, count)).reshape(count, len(t))
        on, at = np.argwhere((values[:, 1:] > 0) != (values[:, :-1] > 0)).T
        zeros = _zeros(lambda x, those: sampled(on[those], x), t[at], t[at + 1])
        if not turns:
            return on, zeros
        with np.errstate(invalid="ignore"):
            steps = np.diff(values)
            size = np.nanmax(np.abs(values), axis=1, initial=0.0, where=np.isfinite(values))[:, None]
            steps = np.where(np.abs(steps) > FLAT * size, np.sign(steps), 0.0)
        over, at = np.argwhere(steps[:, 1:] * steps[:, :-1] < 0).T
        lowest = _lowest(lambda x: -steps[over, at] * sampled(over, x), t[at], t[at + 2])
        return np.append(on, over), np.append(zeros, lowest)

    def _is_harmful(self, function: Narrow, level: int, lines: Floats) -> bool:
        """Whether the integrand is not as its nodes say where a narrow function passes zero or turns back."""
        on, places = self._special(partial(self._narrow, function), level, lines)
        if not places.size:
            return False
        cuts, nodes = self.cuts[level - 1], PLAIN.places[1:-1]
        panel = np.clip(np.searchsorted(cuts, places, side="right") - 1, 0, len(cuts) - 2)
        low, width = cuts[panel], np.diff(cuts)[panel]
        t = low[:, None] + width[:, None] * nodes
        values = self._values(_with(np.repeat(lines[:, on], len(nodes), axis=1), level, t.ravel()))
        values = values.reshape(len(values), *t.shape)
        expected = np.einsum("kpn,pn->kp", values, _interpolating(nodes, (places - low) / width))
        there = self._values(_with(lines[:, on], level, places))
        size = np.maximum(np.abs(values).max(axis=(1, 2)), np.abs(there).max(axis=1))
        return not (np.abs(there - expected) <= SURPRISE * size[:, None]).all()


def _with(points: Floats, level: int, places: Floats) -> Floats:
    """Points with another coordinate of this level."""
    changed = points.copy()
    changed[level] = places
    return changed


def _worked_out(values: Floats, width: Floats, rule: _Rule) -> tuple[Floats, Floats, Floats]:
    """Integrals (k by n) over panels of these widths (n), from values at places of the rule (k by n by m).

    With them come the errors (n) of the rule, and those that rounding leaves.
    """
    kronrod = width * (values @ rule.kronrod)
    raw = np.abs(kronrod - width * (values @ rule.gauss))
    spread = width * (np.abs(values - (kronrod / width)[..., None]) @ rule.kronrod)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(spread > 0, spread * np.minimum(1, (200 * raw / spread) ** 1.5), raw)
    own += rule.unseen * width * np.abs(values @ rule.at_ends).max(axis=-1)
    rounding = ROUNDING * width * (np.abs(values) @ rule.kronrod)
    return kronrod, own.max(axis=0), rounding.max(axis=0)


def _zeros(f: Callable[[Floats, Array], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) where functions change their sign between `low` and `high`.

    `f` takes places and the indices of the functions. C. Ridders, IEEE Trans. Circuits Syst. 26 (1979) 979.
    """
    every = np.arange(low.size)
    if not every.size:
        return low
    start, end = low, high
    at_low, at_high = f(low, every), f(high, every)
    positive = at_low > 0
    for _ in range(STEPS):
        middle = (low + high) / 2
        at_middle = f(middle, every)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = (middle - low) * np.sign(at_low - at_high) * at_middle
            x = middle + step / np.sqrt(at_middle**2 - at_low * at_high)
        x = np.where(np.isfinite(x), np.clip(x, low, high), middle)
        at_x = f(x, every)
        before = x < middle
        a, at_a = np.where(before, x, middle), np.where(before, at_x, at_middle)
        b, at_b = np.where(before, middle, x), np.where(before, at_middle, at_x)
        first, last = (at_a > 0) != positive, (at_b > 0) == positive
        low, high = np.where(last, b, np.where(first, low, a)), np.where(last, high, np.where(first, a, b))
        at_low = np.where(last, at_b, np.where(first, at_low, at_a))
        at_high = np.where(last, at_high, np.where(first, at_a, at_b))
    sides = [f(np.clip(x + side, start, end), every) > 0 for side in (-FOUND, FOUND)]
    those = np.flatnonzero((sides[0] != positive) | (sides[1] == positive))
    low, high = start[those], end[those]
    for _ in range(BISECTIONS if those.size else 0):
        middle = (low + high) / 2
        same = (f(middle, those) > 0) == positive[those]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    x[those] = (low + high) / 2
    return x


def _lowest(f: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) between `low` and `high` where functions are lowest, by golden sections."""
    if not low.size:
        return low
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = f(left), f(right)
    for _ in range(SECTIONS):
        lower = at_left < at_right
        low, high = np.where(lower, low, left), np.where(lower, right, high)
        new = np.where(lower, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        at_new = f(new)
        left, right = np.where(lower, new, right), np.where(lower, left, new)
        at_left, at_right = np.where(lower, at_new, at_right), np.where(lower, at_left, at_new)
    return (low + high) / 2


def lowest_points(f: Callable[[Floats], Floats], points: Floats) -> tuple[Floats, Floats]:
    """Where a function is lowest near each of the `points` (1 + d by n), and its values there (SEARCH by n).

    A search by compass: in each step every point goes to the lowest of its neighbours in a net of 3^d, which
    then gets finer by a third.
    """
    directions = np.array(list(product((0.0, -1.0, 1.0), repeat=len(points) - 1))).T
    best, width, told = points, WIDEST, []
    for _ in range(SEARCH):
        trial = np.repeat(best[:, :, None], directions.shape[1], axis=2)
        trial[1:] = np.clip(trial[1:] + width * directions[:, None], 0.0, 1.0)
        values = f(trial.reshape(len(trial), -1)).reshape(trial.shape[1:])
        choice = np.arange(best.shape[1]), values.argmin(axis=1)
        best = trial[:, *choice]
        told.append(values[choice])
        width *= 2 / 3
    return best, np.array(told)
