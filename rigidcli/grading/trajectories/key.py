"""The key of a trajectory: what is right at any time, and how near an answer must be."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.trajectories.conserved import Conserved
from rigidcli.grading.trajectories.dense import Trajectory
from rigidcli.grading.trajectories.following import Following, wrapped

MOVING = 4
"""The range of a column that changes, in margins."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """What is right, from `start` to `stop`; beyond `horizon` the motion cannot be predicted.

    The `reference` has the judged `columns` (m) first, of which an answer must have the first `required`,
    then `further` ones, which it must have for what it is to conserve. `margins` and `periods` (m) tell how
    near a column must be, and modulo what: infinite for one that is no angle. `grid` (g by m) are the judged
    columns at `instants` (g) up to the horizon, and `ranges` (m) what they change by there, at least their
    margins. The columns at `quaternion` have a common sign without meaning, those at `rates` are angular
    velocities. With `in_si`, all are in SI units. `following` tells what rows do beyond the horizon.
    """

    columns: tuple[str, ...]
    required: int
    further: tuple[str, ...]
    reference: Trajectory
    start: float
    stop: float
    horizon: float
    margins: Floats
    periods: Floats
    quaternion: tuple[int, ...]
    rates: tuple[int, ...]
    in_si: bool
    conserved: tuple[Conserved, ...]
    following: Following | None
    instants: Floats
    grid: Floats
    ranges: Floats

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

    def of(self, names: Collection[str]) -> Key:
        """What is judged of an answer that has columns with these names: the required ones, and those."""
        own = [k for k, name in enumerate(self.columns) if k < self.required or name in names]
        count = len(self.columns)
        if len(own) == count:
            return self
        return replace(
            self,
            columns=tuple(self.columns[place] for place in own),
            reference=self.reference.some([*own, *range(count, count + len(self.further))]),
            margins=self.margins[own],
            periods=self.periods[own],
            quaternion=tuple(new for new, place in enumerate(own) if place in self.quaternion),
            rates=tuple(new for new, place in enumerate(own) if place in self.rates),
            following=None if self.following is None else self.following.some(own),
            grid=self.grid[:, own],
            ranges=self.ranges[own],
        )

    def all_at(self, times: Floats) -> Floats:
        """The judged and the further columns (k by m and more) at `times` (k)."""
        return self.reference.at(np.clip(times, self.start, self.stop))

    def at(self, times: Floats) -> Floats:
        """The judged columns (k by m) at `times` (k)."""
        return self.all_at(times)[:, : len(self.columns)]

    def roughly_at(self, times: Floats) -> Floats:
        """The same from the grid, for `times` (k) up to the horizon."""
        return np.column_stack([np.interp(times, self.instants, column) for column in self.grid.T])

    def misses(self, values: Floats, expected: Floats) -> Floats:
        """By how much values are off, in units of the margins (all k by m)."""
        if self.quaternion:
            values = values * self._signs(values, expected)
        return np.abs(self.wrapped(values - expected)) / self.margins

    def wrapped(self, differences: Floats) -> Floats:
        """Differences of the columns (... by m), those of angles to the nearest period."""
        return wrapped(differences, self.periods)

    def _signs(self, values: Floats, expected: Floats) -> Floats:
        """What makes quaternions those that are nearer to what is expected (k by m)."""
        signs = np.ones_like(values)
        places = list(self.quaternion)
        opposite = np.nansum(values[:, places] * expected[:, places], axis=1) < 0
        signs[np.ix_(opposite, places)] = -1.0
        return signs


def without_flips(values: Floats, quaternion: Sequence[int]) -> Floats:
    """Columns (n by m) in which a quaternion does not jump to the opposite one from row to row."""
    values, places = values.copy(), list(quaternion)
    turned = (values[1:, places] * values[:-1, places]).sum(axis=1) < 0
    values[1:, places] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    return values


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an answer has: `times` (k), and the judged columns (k by m), NaN where one is missing.

    `failing` are the places of columns that are not right; None where the times do not cover the span, so
    that only other times can explain the answer.
    """

    times: Floats
    values: Floats
    failing: tuple[int, ...] | None

    @property
    def present(self) -> list[int]:
        """The places of columns that are not missing."""
        return [place for place in range(self.values.shape[1]) if not np.isnan(self.values[0, place])]
