"""Whether rows follow the motion where it cannot be predicted.

By the equations of motion, from row to row, where an answer has the whole state and its rows are so near each
other that one step tells: how near that is, is learnt from the reference. Otherwise no column may rest for
much longer, or move much faster, than it ever does on the reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.trajectories.field import Equations

TELLING, DOUBT = 1.0, 5.0
"""How far the reference, and answers, may be from a step, in units of what two rules for it differ by."""

TINY = 1e-3
"""How far both may be besides, in margins."""

STARTS = 1000
"""Rows of the reference from which steps are tried."""

SHORTER = 1.5
"""How often shorter the steps are that are tried next."""

LONGEST_STEP = 1 / 16
"""In units of the span."""

LONGEST_RUN = 256
"""Steps that are added up to see a small error in each."""

RESTS = 8
"""Rows that show that a column rests."""

LONGER, FASTER = 5.0, 5.0
"""How much longer than ever on the reference a column must rest to be found out, or how much faster be."""


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """What rows of the `columns` (m) must do. `margins`, `periods`, `speeds` and `rests` are theirs (m).

    A column has a largest speed, and rests for so long at most. Steps of up to `step` are as the `equations`
    say, of which the state is at `places` (s).
    """

    columns: tuple[str, ...]
    margins: Floats
    periods: Floats
    speeds: Floats
    rests: Floats
    equations: Equations | None = None
    step: float = 0.0

    @property
    def places(self) -> list[int]:
        """Where the columns of the state are (s)."""
        names = () if self.equations is None else self.equations.names
        return [self.columns.index(name) for name in names]

    def some(self, places: Sequence[int]) -> Following:
        """The same for some of the columns."""
        own = list(places)
        columns = tuple(self.columns[place] for place in own)
        whole = self.equations is not None and set(self.equations.names) <= set(columns)
        return Following(
            columns,
            self.margins[own],
            self.periods[own],
            self.speeds[own],
            self.rests[own],
            self.equations if whole else None,
            self.step if whole else 0.0,
        )

    def strays(self, times: Floats, values: Floats) -> float | None:
        """From what time on rows (k, and k by m) do not follow the motion; None where nothing shows it."""
        near = np.diff(times) <= self.step
        strays = [self._resting(times, values), self._jumping(times, values)] if not near.all() else []
        if self.equations is not None and near.any():
            strays.append(self._off_course(self.equations, times, values[:, self.places], near))
        first = [int(np.argmax(stray)) for stray in strays if stray.any()]
        return float(times[min(first)]) if first else None

    def _moves(self, values: Floats, later: Floats) -> Floats:
        """What columns change by (k by m), those of angles by less than half a period."""
        return wrapped(later - values, self.periods)

    def _resting(self, times: Floats, values: Floats) -> Mask:
        """Which rows (k) are followed by others that a column does not leave for too long."""
        rows = np.arange(len(times))
        resting = np.zeros(len(times), dtype=bool)
        for place, rest in enumerate(self.rests):
            last = np.maximum(np.searchsorted(times, times + LONGER * rest), rows + RESTS)
            begin = rows[last < len(times)]
            still = np.ones(len(begin), dtype=bool)
            for part in range(1, RESTS + 1):
                seen = begin + (last[begin] - begin) * part // RESTS
                moves = self._moves(values[begin], values[seen])[:, place]
                still &= np.abs(moves) <= self.margins[place]
            resting[begin] |= still
        return resting

    def _jumping(self, times: Floats, values: Floats) -> Mask:
        """Which rows (k) are followed by one that is too far away."""
        most = FASTER * self.speeds * np.diff(times)[:, None] + 2 * self.margins
        moves = np.abs(self._moves(values[:-1], values[1:]))
        return np.append((moves > most).any(axis=1), False)

    def _off_course(self, equations: Equations, times: Floats, states: Floats, near: Mask) -> Mask:
        """Which rows (k, states k by s) are the last before those to which the equations do not lead."""
        margins, periods, width = self.margins[self.places], self.periods[self.places], np.diff(times)
        rates = equations.at(times, states)
        rough = width[:, None] / 2 * (rates[:-1] + rates[1:])
        moves = rough + wrapped(np.diff(states, axis=0) - rough, periods)
        off, doubt = _misfit(equations, times[:-1], width, states[:-1], moves, rates[:-1], rates[1:], margins)
        spread = (equations.spread(times, states, rates, margins) / margins).max(axis=1)
        doubt = DOUBT * doubt + TINY + width * np.maximum(spread[:-1], spread[1:])
        fine = near & np.isfinite(off).all(axis=1) & np.isfinite(doubt)
        sums = np.vstack([np.zeros(len(margins)), np.cumsum(np.where(fine[:, None], off, 0.0), axis=0)])
        doubts = np.append(0.0, np.cumsum(np.where(fine, doubt, 0.0)))
        gaps = np.append(0, np.cumsum(~fine))
        strays = np.zeros(len(times), dtype=bool)
        run = 1
        while run <= min(LONGEST_RUN, len(times) - 1):
            total = np.abs(sums[run:] - sums[:-run]).max(axis=1)
            unbroken = gaps[run:] == gaps[:-run]
            strays[run - 1 : -1] |= unbroken & (total > 2 + doubts[run:] - doubts[:-run])
            run *= 2
        return strays


def wrapped(differences: Floats, periods: Floats) -> Floats:
    """Differences of columns (... by m), those of angles to the nearest of their periods (m)."""
    own = np.where(np.isfinite(periods), periods, 1.0)
    near = differences - own * np.round(differences / own)
    return np.where(np.isfinite(periods), near, differences)


def _misfit(
    equations: Equations,
    times: Floats,
    width: Floats,
    states: Floats,
    moves: Floats,
    before: Floats,
    behind: Floats,
    margins: Floats,
) -> tuple[Floats, Floats]:
    """By how much steps are not what equations make of them, and by how much two rules for that differ.

    Simpson's rule has an error of fifth order in their width, the trapezoidal one of third (Hermite-Simpson
    collocation; see M. Kelly, SIAM Review 59 (2017), 849, section 4). Both results are in margins, the first
    by columns (k by s), the second the largest of them (k).
    """
    middle = equations.middle(times, width, states, moves, before, behind)
    simpson = width[:, None] / 6 * (before + 4 * middle + behind)
    trapezoid = width[:, None] / 2 * (before + behind)
    return (moves - simpson) / margins, (np.abs(simpson - trapezoid) / margins).max(axis=1)


def following(
    columns: tuple[str, ...],
    times: Floats,
    values: Floats,
    margins: Floats,
    periods: Floats,
    equations: Equations | None,
) -> Following:
    """What follows from samples of the reference (n, and n by m), at equal distances in time."""
    speeds = np.abs(np.diff(values, axis=0) / np.diff(times)[:, None]).max(axis=0)
    rests = np.array([_longest_rest(times, *each) for each in zip(values.T, margins, strict=True)])
    found = Following(columns, margins, periods, speeds, rests)
    if equations is None or not set(equations.names) <= set(columns):
        return found
    whole = replace(found, equations=equations)
    step = _longest_step(equations, times, values[:, whole.places], margins[whole.places])
    return replace(whole, step=step) if step else found


def _longest_rest(times: Floats, column: Floats, margin: float) -> float:
    """For how long a column (n) stays within its margin."""
    longest, begin, values = 0.0, 0, column.tolist()
    for row, value in enumerate(values):
        if abs(value - values[begin]) > margin:
            longest, begin = max(longest, float(times[row] - times[begin])), row
    return max(longest, float(times[-1] - times[begin]))


def _longest_step(equations: Equations, times: Floats, states: Floats, margins: Floats) -> float:
    """The longest time between rows (n, states n by s) for which the reference is near a step; 0 for none."""
    rates = equations.at(times, states)
    wide = int(LONGEST_STEP * len(times))
    while wide >= 1:
        own = np.unique(np.linspace(0, len(times) - 1 - wide, STARTS).astype(int))
        after = own + wide
        moves, width = states[after] - states[own], times[after] - times[own]
        off, doubt = _misfit(
            equations, times[own], width, states[own], moves, rates[own], rates[after], margins
        )
        if (np.abs(off).max(axis=1) <= TELLING * doubt + TINY).all():
            return float(width.min())
        wide = int(wide / SHORTER)
    return 0.0
