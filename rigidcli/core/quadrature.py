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
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

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

_END = 1 - 1e-9
"""Where an end of a panel is looked at: inside, so that it is on the right side of a jump."""

_UNSEEN = 0.002
"""What lies between the last node and the end, in units of the panel: its weight in the error."""

NARROWEST = 2.0**-44
"""Panels that are narrower, in units of the line, are not halved: their nodes would be one point."""

LINES = 512
"""Lines that are worked on together: their samples stay in the cache, and memory is bounded."""

OVERHEAD = 1000
"""What a call for a few points costs more than these, in points."""

BISECTIONS = 50
"""Halvings by which a zero is found between two samples: to a part in 10^15."""

GOLDEN = (5**0.5 - 1) / 2
"""The part that is left of an interval in each step of the golden-section search."""

SECTIONS = 40
"""Steps of that search: to a part in 10^8, beyond which a smooth function does not change."""

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

MOST_PIECES = 5
"""Pieces in which it is tried."""


def _interpolating(x: Floats) -> Floats:
    """The weights of the values at NODES[1:-1] in that of the polynomial through them at places x (n)."""
    gaps = NODES[1:-1, None] - NODES[1:-1]
    np.fill_diagonal(gaps, 1.0)
    offsets = x[:, None] - NODES[1:-1]
    terms = 1 / (gaps.prod(axis=1) * np.where(offsets == 0, 1e-100, offsets))
    weights: Floats = terms / terms.sum(axis=1, keepdims=True)
    return weights


def _rule() -> tuple[Floats, Floats, Floats]:
    """The nodes from -1 to 1 with both ends, and the weights of Kronrod and of Gauss, zero at the ends."""
    positive, weights = np.array(_KRONROD).T
    nodes = np.concatenate([-positive[:-1], positive[::-1]])
    kronrod = np.concatenate([weights[:-1], weights[::-1]])
    gauss = np.zeros(len(nodes))
    gauss[1::2] = np.polynomial.legendre.leggauss(len(nodes) // 2)[1]
    padded = [np.concatenate([[0.0], row, [0.0]]) for row in (kronrod, gauss)]
    return np.concatenate([[-_END], nodes, [_END]]), padded[0], padded[1]


NODES, KRONROD_WEIGHTS, GAUSS_WEIGHTS = _rule()


_AT_ENDS = np.pad(-_interpolating(np.array([-_END, _END])).T, ((1, 1), (0, 0)))
_AT_ENDS[0, 0] = _AT_ENDS[-1, 1] = 1.0
"""The weights that tell how far the polynomial through the nodes misses the values at both ends."""


class Exhausted(Exception):  # noqa: N818 - an outcome, for those who ask for less then
    """The integral needs more evaluations than are allowed."""


class Integral(NamedTuple):
    """Integrals (k), and a bound on the error of each, by an estimate."""

    values: Floats
    error: float


@dataclass
class Integrand:
    """What is to be integrated over 0 to 1 in each coordinate, and over several pieces.

    `values` takes points (1 + d by n), the first row being the index of the piece, and gives the values of
    k functions (k by n). Each of `narrow` takes points, too: where its values (n) pass zero, or are largest
    or smallest, the integrand may have a jump, a kink or a peak. `cuts` are places on each coordinate at
    which panels begin and end, 0 and 1 among them; `probes` are places where such functions are looked at.
    """

    values: Callable[[Floats], Floats]
    narrow: Sequence[Callable[[Floats], Floats]]
    cuts: Sequence[Floats]
    probes: Sequence[Floats]
    pieces: int = 1
    _left: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        """Forget the narrow functions near which the integrand does nothing that the nodes do not see."""
        self._left = np.inf
        harmful: set[int] = set()
        for level in range(1, len(self.cuts) + 1):
            others = [UNRELATED if k != level else (0.0,) for k in range(1, len(self.cuts) + 1)]
            pieces = np.unique(np.linspace(0, self.pieces - 1, MOST_PIECES).astype(int))
            harmful |= self._harmful(level, np.array(list(product(pieces, *others))).T)
        self.narrow = [self.narrow[k] for k in sorted(harmful)]

    def integral(self, tolerance: float, evaluations: float) -> Integral:
        """The integrals, the error of each below `tolerance` where that can be reached.

        Raises Exhausted when it takes more evaluations of `values` and of `narrow` than are allowed.
        """
        self._left = evaluations
        values, errors = self._over(1, np.arange(self.pieces, dtype=np.float64)[None], tolerance)
        return Integral(values.sum(axis=1), float(errors.sum()))

    def _spend(self, points: int) -> None:
        self._left -= points + OVERHEAD
        if self._left < 0:
            raise Exhausted

    def _over(self, level: int, fixed: Floats, tolerance: float) -> tuple[Floats, Floats]:
        """Integrals (k by n) over coordinates from `level` on, the others being `fixed`, and errors (n)."""
        if level > len(self.cuts):
            self._spend(fixed.shape[1])
            return self.values(fixed), np.zeros(fixed.shape[1])
        if fixed.shape[1] > LINES:
            blocks = range(0, fixed.shape[1], LINES)
            found = [self._over(level, fixed[:, start : start + LINES], tolerance) for start in blocks]
            return np.hstack([values for values, _ in found]), np.hstack([errors for _, errors in found])
        line, low, high = self._panels(level, fixed)
        totals, errors = np.zeros((0, fixed.shape[1])), np.zeros(fixed.shape[1])
        while line.size:
            half = (high - low) / 2
            t = (low + high)[:, None] / 2 + half[:, None] * NODES
            points = np.vstack([np.repeat(fixed[:, line], len(NODES), axis=1), t.reshape(1, -1)])
            values, inner = self._over(level + 1, points, tolerance / 2)
            values = values.reshape(len(values), -1, len(NODES))
            kronrod, own, rounding = _worked_out(values, half)
            done = (own <= np.maximum(tolerance / 10, rounding)) | (high - low < NARROWEST)
            totals = totals if len(totals) else np.zeros((len(values), fixed.shape[1]))
            np.add.at(totals.T, line[done], kronrod[:, done].T)
            own += rounding + half * (inner.reshape(-1, len(NODES)) @ KRONROD_WEIGHTS)
            np.add.at(errors, line[done], own[done])
            middle = (low + high)[~done] / 2
            line = np.tile(line[~done], 2)
            low, high = np.append(low[~done], middle), np.append(middle, high[~done])
        return totals, errors

    def _panels(self, level: int, fixed: Floats) -> tuple[Array, Floats, Floats]:
        """The panels to begin with: the line on which each lies, its beginning and its end."""
        count, cuts = fixed.shape[1], self.cuts[level - 1]
        lines, places = [np.repeat(np.arange(count), len(cuts))], [np.tile(cuts, count)]
        for probe in product(*self.probes[level:]) if self.narrow else ():
            inner = np.repeat(np.array([[0.0, *probe]]).T, count, axis=1)
            for function in self.narrow:
                on, found = self._special(function, level, np.vstack([fixed, inner]))
                lines.append(on)
                places.append(found)
        line, place = np.concatenate(lines), np.concatenate(places)
        order = np.lexsort((place, line))
        line, place = line[order], place[order]
        panels = (line[1:] == line[:-1]) & (np.diff(place) > NARROWEST)
        return line[1:][panels], place[:-1][panels], place[1:][panels]

    def _special(
        self, function: Callable[[Floats], Floats], level: int, lines: Floats
    ) -> tuple[Array, Floats]:
        """Where a narrow function passes zero or turns back: the index of each line, and the place on it.

        Lines are points (1 + d by n), of which the coordinate of this level is replaced.
        """
        cuts, count = self.cuts[level - 1], lines.shape[1]
        t = np.append(cuts[0], (cuts[:-1, None] + np.diff(cuts)[:, None] / 2 * (1 + NODES)).ravel())
        t[len(NODES) :: len(NODES)] = cuts[1:]

        def sampled(line: Array, places: Floats) -> Floats:
            self._spend(places.size)
            return function(_with(lines[:, line], level, places))

        values = sampled(np.repeat(np.arange(count), len(t)), np.tile(t, count)).reshape(count, len(t))
        on, at = np.argwhere((values[:, 1:] > 0) != (values[:, :-1] > 0)).T
        zeros = _zeros(lambda x: sampled(on, x), t[at], t[at + 1])
        with np.errstate(invalid="ignore"):
            steps = np.diff(values)
            size = np.nanmax(np.abs(values), axis=1, initial=0.0, where=np.isfinite(values))[:, None]
            steps = np.where(np.abs(steps) > FLAT * size, np.sign(steps), 0.0)
        over, at = np.argwhere(steps[:, 1:] * steps[:, :-1] < 0).T
        lowest = _lowest(lambda x: -steps[over, at] * sampled(over, x), t[at], t[at + 2])
        return np.append(on, over), np.append(zeros, lowest)

    def _harmful(self, level: int, lines: Floats) -> set[int]:
        """The narrow functions (by index) at whose zeros and peaks the integrand is not as its nodes say."""
        harmful = set()
        cuts, count = self.cuts[level - 1], lines.shape[1]
        low, high = cuts[:-1], cuts[1:]
        t = ((low + high)[:, None] / 2 + (high - low)[:, None] / 2 * NODES[1:-1]).ravel()
        values = self.values(_with(np.repeat(lines, t.size, axis=1), level, np.tile(t, count)))
        size = np.abs(values).max(axis=1, keepdims=True)
        values = values.reshape(len(values), count, len(low), -1)
        for index, function in enumerate(self.narrow):
            on, places = self._special(function, level, lines)
            if not places.size:
                continue
            panel = np.clip(np.searchsorted(cuts, places, side="right") - 1, 0, len(low) - 1)
            x = (2 * places - low[panel] - high[panel]) / (high - low)[panel]
            expected = np.einsum("kpn,pn->kp", values[:, on, panel], _interpolating(x))
            surprise = np.abs(self.values(_with(lines[:, on], level, places)) - expected)
            if not (surprise <= SURPRISE * size).all():
                harmful.add(index)
        return harmful


def _with(points: Floats, level: int, places: Floats) -> Floats:
    """Points with another coordinate of this level."""
    changed = points.copy()
    changed[level] = places
    return changed


def _worked_out(values: Floats, half: Floats) -> tuple[Floats, Floats, Floats]:
    """Integrals (k by n) over panels of these half widths (n), from values at the nodes (k by n by nodes).

    With them come the errors (n) of the rule, and those that rounding leaves.
    """
    kronrod = half * (values @ KRONROD_WEIGHTS)
    raw = np.abs(kronrod - half * (values @ GAUSS_WEIGHTS))
    mean = (kronrod / (2 * half))[..., None]
    spread = half * (np.abs(values - mean) @ KRONROD_WEIGHTS)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(spread > 0, spread * np.minimum(1, (200 * raw / spread) ** 1.5), raw)
    own += _UNSEEN * half * np.abs(values @ _AT_ENDS).max(axis=-1)
    rounding = ROUNDING * half * (np.abs(values) @ KRONROD_WEIGHTS)
    return kronrod, own.max(axis=0), rounding.max(axis=0)


def _zeros(f: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Places (n) where functions change their sign between `low` and `high`, by bisection."""
    if not low.size:
        return low
    positive = f(low) > 0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        same = (f(middle) > 0) == positive
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2


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
