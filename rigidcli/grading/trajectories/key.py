"""The key of a trajectory: what is right at any time, and how near an answer must be.

An answer is right where each judged column is within its margin at the answer's own times. The margin is by
the question's tolerance of the column's size, which is its largest value over the span (that of an angle at
most half a period). A table whose rows are too far apart to tell what is between them is compared at its own
times instead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.trajectories.conserved import Conserved
from rigidcli.grading.trajectories.splines import Trajectory, interpolated, smooth

OFF = 0.25
"""The part of a margin that a spline, or rounding, may be off by."""

MOVING = 4
"""The range of a column that changes, in margins."""

COVERED = 0.99
"""The part of the span that an answer must cover."""

SHOWN = 0.5
"""The part of a column's range that must be seen in the rows: of a swing, not just the returns."""

SLACK = 1e-9
"""How far beyond the span, in units of it, a time still belongs to it."""

SAME_TIME = 1e-6
"""How far times that are the same may be apart, in units of the span: they may be typed with few digits."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an answer has: `times` (k), and the columns of the key (k by m), NaN where one is missing."""

    times: Floats
    values: Floats

    @property
    def present(self) -> Mask:
        """Which columns are not missing (m)."""
        return np.asarray(~np.isnan(self.values).all(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right, from `start` to `stop`; beyond `horizon` the motion cannot be predicted.

    An answer must have the first `required` of the `columns` (m), and all `needed` ones; others are judged
    where they are handed in. `margins` and `periods` (m) tell how near a column must be, and modulo what:
    infinite for one that is not judged, or is no angle. Rows may be `gap` apart, in units of the span. `grid`
    (g by m) are the columns at `instants` (g) up to the horizon, and `ranges` (m) what they change by there,
    at least their margins. The columns at `quaternion` have a common sign without meaning, those at `rates`
    are angular velocities. With `in_si`, all are in SI units. Of a key that is compared at its own `times`
    (n), these are such.

    A mistake reads an answer in another way: its time t is `rate` t + `shift` of the reference, its columns
    are divided by the `factors` (m), and stand in another `order`.
    """

    columns: tuple[str, ...]
    required: int
    needed: frozenset[str]
    reference: Trajectory
    start: float
    stop: float
    horizon: float
    gap: float
    margins: Floats
    periods: Floats
    quaternion: tuple[int, ...]
    rates: tuple[int, ...]
    in_si: bool
    conserved: tuple[Conserved, ...]
    instants: Floats
    grid: Floats
    ranges: Floats
    times: Floats | None = None
    rate: float = 1.0
    shift: float = 0.0
    factors: Floats | float = 1.0
    order: tuple[int, ...] = ()

    @property
    def span(self) -> float:
        """How long the motion is."""
        return self.stop - self.start

    @property
    def moving(self) -> Mask:
        """Which of the judged columns change (m)."""
        return self.ranges > MOVING * self.margins

    @property
    def crossings(self) -> int:
        """How often one of the columns that change crosses the middle of its range."""
        grid = self.grid[:, self.moving]
        above = grid > (grid.max(axis=0, initial=-np.inf) + grid.min(axis=0, initial=np.inf)) / 2
        return int((above[1:] != above[:-1]).sum(axis=0).max(initial=0))

    def at(self, times: Floats) -> Floats:
        """The columns (k by m) at `times` (k)."""
        return self.reference(np.clip(times, self.start, self.stop))

    def roughly_at(self, times: Floats) -> Floats:
        """The same from the grid, for `times` (k) up to the horizon."""
        return np.column_stack([np.interp(times, self.instants, column) for column in self.grid.T])

    def read_with(
        self,
        *,
        rate: float = 1.0,
        shift: float = 0.0,
        factors: Floats | float = 1.0,
        order: tuple[int, ...] = (),
        more: Floats | float = 0.0,
        whole: bool = False,
    ) -> Key:
        """The key by which an answer is right that is read in this way, with margins that are `more`.

        The span is the part of which an answer from start to stop tells, or the `whole` of it.
        """
        ends = (-np.inf, np.inf) if whole else sorted(rate * end + shift for end in (self.start, self.stop))
        start, stop = max(self.start, ends[0]), min(self.stop, ends[1])
        part = self.grid[(self.instants >= start) & (self.instants <= stop)]
        return replace(
            self,
            needed=frozenset(),
            conserved=(),
            start=start,
            stop=stop,
            horizon=min(self.horizon, stop),
            margins=self.margins + more,
            ranges=np.maximum(np.ptp(part, axis=0) if len(part) else 0.0, self.margins),
            rate=rate,
            shift=shift,
            factors=factors,
            order=order,
        )

    def read(self, rows: Rows) -> Rows:
        """The rows of an answer as the key reads them."""
        values = rows.values[:, self.order] if self.order else rows.values
        forwards = slice(None, None, 1 if self.rate > 0 else -1)
        times = self.rate * rows.times + self.shift
        return Rows(times[forwards], (values / self.factors)[forwards])

    def written(self, times: Floats) -> Rows:
        """An answer that reads as the reference at these times."""
        values = self.at(times) * self.factors
        if self.order:
            values = values[:, np.argsort(self.order)]
        forwards = slice(None, None, 1 if self.rate > 0 else -1)
        return Rows(((times - self.shift) / self.rate)[forwards], values[forwards])

    def inside(self, times: Floats, until: float) -> Mask:
        """Which times belong to the span, or the part of it until a time."""
        slack = SLACK * self.span
        return np.asarray((times >= self.start - slack) & (times <= until + slack))

    def lacks(self, rows: Rows) -> str:
        """What is wrong with the times of an answer; empty where nothing is."""
        return self._lacks(self.read(rows).times)

    def _lacks(self, times: Floats) -> str:
        longest = (self.gap + SAME_TIME) * self.span
        near = times[(times >= self.start - longest) & (times <= self.stop + longest)]
        own = np.clip(near, self.start, self.stop)
        if not len(own) or np.ptp(own) < COVERED * self.span:
            return f"read times from {times[0]:g} to {times[-1]:g}" if len(times) else "there are none"
        if np.diff(own).max() > longest:
            return "the gaps between its rows are too long"
        own = times[self.inside(times, self.horizon)]
        seen = np.ptp(self.roughly_at(own), axis=0) if len(own) else 0.0
        unseen = self.moving & (seen < SHOWN * self.ranges)
        if not len(own) or unseen[: self.required].any():
            return "it has too few rows to show the motion"
        return ""

    def compared(self, rows: Rows, until: float | None = None) -> tuple[Floats, Floats, Floats]:
        """Times (k), values and what is expected (both k by m), up to the horizon or another time.

        Values are NaN that cannot be told: at a time of the key to which the answer has no row, where its
        rows are too far apart to tell what is between them.
        """
        rows = self.read(rows)
        if self.times is not None:
            rows = self._sampled(rows, self.times)
        own = self.inside(rows.times, self.horizon if until is None else until)
        return rows.times[own], rows.values[own], self.at(rows.times[own])

    def _sampled(self, rows: Rows, times: Floats) -> Rows:
        """The rows of an answer at these times, of which it has a row, or from its rows about them."""
        slack, apart = SAME_TIME * self.span, np.diff(rows.times, prepend=-np.inf) > 0
        rows = Rows(rows.times[apart], rows.values[apart])
        times = times[(times >= rows.times[0] - slack) & (times <= rows.times[-1] + slack)]
        after = np.searchsorted(rows.times, times).clip(1, len(rows.times) - 1)
        near = after - (times - rows.times[after - 1] < rows.times[after] - times)
        values = smooth(np.nan_to_num(rows.values), self.periods, self.quaternion)
        between, off = interpolated(rows.times, values, self.margins, self.horizon)
        told = np.where(rows.present & (off <= OFF * self.margins), between(times), np.nan)
        has_row = np.abs(rows.times[near] - times) <= slack
        values = np.where(has_row[:, None], rows.values[near], told)
        # Where the rows that it has at these times would do alone, others are needless.
        own = has_row | bool(self._lacks(times[has_row])) | ~np.isnan(told[:, rows.present]).any(axis=1)
        return Rows(times[own], values[own])

    def misses(self, values: Floats, expected: Floats) -> Floats:
        """By how much values are off, in units of the margins (all k by m)."""
        places = list(self.quaternion)
        if places:
            values = values.copy()
            opposite = np.nansum(values[:, places] * expected[:, places], axis=1) < 0
            values[np.ix_(opposite, places)] *= -1.0
        return np.abs(self.wrapped(values - expected)) / self.margins

    def wrapped(self, differences: Floats) -> Floats:
        """Differences of the columns (... by m), those of angles to the nearest of their periods.

        Those that are so large that their digits do not tell the rest stay as they are.
        """
        own = np.where(np.isfinite(self.periods), self.periods, 1.0)
        told = np.isfinite(self.periods) & (np.spacing(np.abs(differences)) <= OFF * self.margins)
        return np.where(told, differences - own * np.round(differences / own), differences)
