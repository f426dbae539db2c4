"""The pair of Dormand and Prince for many starts at once: variables by starts, in arrays.

Each start has its own steps, so that it moves as it does alone, whatever the others are. All of them try
their next step at once; those that have come to the end, or fail, leave the arrays. A start fails whose steps
get too short, or too many, or may go over something narrow: it is left to the integration of a single start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import dormand_prince
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.runge_kutta import SMALLEST_SCALE, STEPS_PER_REPORT, sides
from rigidcli.core.second_run import other_tolerance
from rigidcli.core.solution import ORIGIN_OF_TIME, SHORTEST_STEP, Flow, columns

MOST_TOGETHER = 20_000
"""The most steps of a start in arrays: the few starts that need more are quicker alone."""

LOOKS_AHEAD = 1024
"""Steps from one estimate of whether the most steps are enough to the next."""

AT_ONCE = 16_384
"""Floats of the states that are stepped at once, so that the arrays of the stages stay in the cache."""

Marks: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """The states of m starts at k times (k by n by m), their steps (m), and the largest sizes (n by m).

    The starts that are to be followed `alone` (m) have none.
    """

    states: Floats
    steps: NDArray[np.int_]
    largest: Floats
    alone: Marks


class ManyStarts(NamedTuple):
    """The equations y' = f(t, y) of n variables, and how they are solved: the arguments of `integrate`.

    `parts` are the slices of the blocks of variables whose errors are bounded. Variables behind the last of
    them may be parameters, which have no slope, or integrals. `moving` gives the functions whose zeros and
    extremes may hide a narrow wall. `longest` may differ from start to start (m).
    """

    flow: Flow
    roundings: Flow | None
    moving: Flow
    parts: Sequence[slice]
    tolerance: float
    longest: float | Floats
    stops: Sequence[float]


def paths(problem: ManyStarts, starts: Floats, times: Floats) -> Paths:
    """The solutions from `starts` (n by m) at t = 0, at the `times` (k), to the last of them."""
    count, size = starts.shape[1], max(256, AT_ONCE // len(starts))
    longest = np.broadcast_to(problem.longest, count)
    parts = []
    for first in range(0, count, size):
        some = first + dormand_prince.padded(min(size, count - first))
        part = _Lanes(problem._replace(longest=longest[some]), starts[:, some], times).followed()
        real = min(size, count - first)
        parts.append([each[..., :real] for each in (part.states, part.steps, part.largest, part.alone)])
    return Paths(*(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True)))


def twice(problem: ManyStarts, starts: Floats, times: Floats) -> tuple[Paths, Paths]:
    """The solutions, and second ones to the tolerance of a second run."""
    other, first = (
        problem._replace(tolerance=other_tolerance(problem.tolerance)),
        paths(problem, starts, times),
    )
    return first, paths(other, np.where(first.alone, np.nan, starts), times)


class _Going(NamedTuple):
    """What belongs to each start on its way; all arrays have a column for each start.

    These are the time, the length of the next step, the state and its slope, the least sizes and the floors
    of the blocks, the largest sizes so far, the number of steps, and how often the next step has failed. The
    last two have the times (first row) and the watched values at the ends of the last two steps.
    """

    t: Floats
    h: Floats
    y: Floats
    k: Floats
    least: Floats
    floors: Floats
    largest: Floats
    steps: Floats
    failures: Floats
    older: Floats
    last: Floats

    def taken(self, places: NDArray[np.int_]) -> _Going:
        return _Going(*(part[..., places] for part in self))


class _Lanes:
    """Starts on their way; their number is a multiple of `dormand_prince.COLUMNS`."""

    def __init__(self, problem: ManyStarts, starts: Floats, times: Floats, most: int = MOST_TOGETHER) -> None:
        self.problem, self.times, self.most = problem, times, most
        self.f, self.watched = problem.flow(np), columns(problem.moving)
        self.measured, count = problem.parts[-1].stop, starts.shape[1]
        self.end = float(times[-1])
        self.longest = np.minimum(problem.longest, self.end)
        self.states = np.full((len(times), len(starts), count), np.nan)
        self.next = np.full(count, np.searchsorted(times, 0.0, side="right"))
        self.states[: self.next[0]] = starts
        self.alone = np.zeros(count, dtype=bool)
        self.wanted: list[tuple[Any, ...]] = []
        t, blocks = np.zeros(count), (len(problem.parts), count)
        watched = np.vstack([t, self.watched(t, *starts)])
        self.all = _Going(
            t,
            np.minimum(self.end / 1000, self.longest),
            starts.copy(),
            dormand_prince.slopes_of(self.f, t, starts),
            np.full(blocks, SMALLEST_SCALE),
            np.zeros(blocks),
            np.abs(starts),
            np.zeros(count),
            np.zeros(count),
            watched.copy(),
            watched,
        )

    def followed(self) -> Paths:
        with np.errstate(all="ignore"):
            self.alone |= ~np.isfinite(self.all.k).all(axis=0)
            self._find_least()
            for goal, beyond in sides(0.0, self.problem.stops, self.end):
                self._march(goal)
                if beyond > goal:
                    self._cross(goal, beyond)
            self._sample()
        self.alone |= ~np.isfinite(self.states).all(axis=(0, 1))
        return Paths(self.states, self.all.steps.astype(int), self.all.largest, self.alone)

    def _find_least(self) -> None:
        """Find the least sizes as `runge_kutta.least_sizes` does."""
        parts, (y, k) = self.problem.parts, (self.all.y, self.all.k)
        empty = np.array([~(y[part].any(axis=0) | k[part].any(axis=0)) for part in parts])
        if empty.any() and len(parts) > 1:
            crude = self.problem._replace(
                parts=[slice(self.measured)], tolerance=1e-6, moving=lambda _: lambda *_: ()
            )
            largest = _Lanes(crude, y, self.times[-1:], 4 * STEPS_PER_REPORT).followed().largest
            self.all.least[:] = np.maximum(
                1e-3 * dormand_prince.norms(largest, parts) * empty, SMALLEST_SCALE
            )

    def _cross(self, goal: float, beyond: float) -> None:
        """Go to the time just beyond a stop; at the start only where the slopes jump."""
        h, (t, _, y, k, *_) = beyond - goal, self.all
        slopes = dormand_prince.slopes_of(self.f, np.full_like(t, beyond), y + h * k)
        jumps = np.linalg.norm(slopes - k, axis=0) > 0.01 * np.maximum(*(
            np.linalg.norm(each, axis=0) for each in (slopes, k)
        ))  # fmt: skip
        go = jumps if goal == 0 else np.ones_like(jumps)
        np.copyto(y, y + h * (k + slopes) / 2, where=go)
        np.copyto(t, beyond, where=go)
        k[:] = dormand_prince.slopes_of(self.f, t, y)

    def _march(self, goal: float) -> None:
        """Follow all starts to the goal; those that do not get there are `alone`."""
        done, active, going, turn = self.alone | (self.all.t >= goal), np.arange(len(self.alone)), self.all, 0
        while True:
            if done.sum() > len(done) // 8 or done.all():
                if turn:
                    for whole, part in zip(self.all, going, strict=True):
                        whole[..., active] = part
                if done.all():
                    return
                # Some that are done fill the columns up.
                rest = np.argsort(done, kind="stable")[: len(dormand_prince.padded((~done).sum()))]
                active = active[rest]
                going = self.all.taken(active)
            if not turn % STEPS_PER_REPORT:
                going.floors[:] = self._floors(going)
            going, bad = self._stepped(goal, active, going)
            if turn and not turn % LOOKS_AHEAD:
                bad |= self.end - going.t > (self.most - going.steps) * going.h
            self.alone[active[bad]] = True
            done = self.alone[active] | (going.t == goal)
            turn += 1

    def _stepped(self, goal: float, active: NDArray[np.int_], going: _Going) -> tuple[_Going, Marks]:
        """The starts after one try of a step each, and which of them are to be followed alone."""
        t, h, y, k, least, floors, largest, steps, failures, older, last = going
        left = goal - t
        is_going = left > 0
        to = np.where(left <= h, goal, t + np.where(left < 2 * h, left / 2, h))
        h = to - t
        error, after, slopes = dormand_prince.array_step_with_error(
            self.f, t, h, y, k, np.maximum(floors * h, least), self.problem.tolerance, self.problem.parts
        )
        good = (error <= 1.0) & is_going
        self._want(active, t, to, y, good)
        scaled = np.where(error > 0, 0.9 / np.sqrt(np.sqrt(np.sqrt(error))), 6.0)
        longer = np.clip(np.minimum(scaled, np.where(failures > 0, 1.0, 6.0)), 0.3, 6.0)
        shorter = np.where(error < np.inf, np.maximum(0.1, scaled), 0.25)
        failures = np.where(good, 0, failures + is_going)
        steps += good
        bad = (
            (failures > 40)
            | (steps > self.most)
            | (h < SHORTEST_STEP * np.maximum(t, ORIGIN_OF_TIME * self.end))
        )
        for whole, part in ((t, to), (y, after), (k, slopes)):
            np.copyto(whole, part, where=good)
        np.maximum(largest, np.abs(y), out=largest)
        h = np.minimum(h * np.where(good, longer, shorter), self.longest[active])
        h = np.where(is_going, h, going.h)  # those that wait at a stop go on from there
        if len(last) > 1:
            now = np.vstack([t, self.watched(t, *y)])
            bad |= good & _narrow(older, last, now)
            older, last = np.where(good, last, older), np.where(good, now, last)
        going = _Going(t, h, y, k, least, floors, largest, steps, failures, older, last)
        return going, bad & is_going

    def _floors(self, going: _Going) -> Floats:
        """What `runge_kutta.floors` gives, for each start."""
        t, h, y, k, *_ = going
        noise = np.zeros_like(y)
        rows = np.arange(len(y))[:, None]
        if self.problem.roundings is not None:
            errors = EPS * dormand_prince.slopes_of(self.problem.roundings(np), t, y)
            moved = np.abs(k - dormand_prince.slopes_of(self.f, t, y + 4 * h * errors))
            noise = np.fmax(errors, moved)
        for bit in range(max(1, (self.measured - 1).bit_length())):
            signs = np.where(rows < self.measured, np.where(rows >> bit & 1, 1.0, -1.0), 0.0)
            for move in (-5 * EPS, -3 * EPS, 3 * EPS, 5 * EPS):
                other = dormand_prince.slopes_of(self.f, t * (1 + move), y * (1 + move * signs))
                noise = np.fmax(noise, np.abs(k - other))
        sizes = dormand_prince.norms(noise, self.problem.parts)
        return np.nan_to_num(2 * sizes / self.problem.tolerance, posinf=0.0)

    def _want(self, active: NDArray[np.int_], t: Floats, to: Floats, y: Floats, good: Marks) -> None:
        """Note the samples that are inside the good steps, and where these steps begin."""
        first = self.next[active]
        last = np.where(good, np.searchsorted(self.times, to, side="right"), first)
        some = np.flatnonzero(last > first)
        if len(some):
            self.next[active] = last
            count = (last - first)[some]
            which = np.repeat(some, count)
            place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first[some], count)
            self.wanted.append((place, active[which], t[which], y[:, which]))
            if sum(len(entry[0]) for entry in self.wanted) > dormand_prince.SAMPLED_AT_ONCE:
                self._sample()

    def _sample(self) -> None:
        """Take a step to each sample from the beginning of the step that it is in."""
        if self.wanted:
            place, which, t, y = (np.concatenate(parts, axis=-1) for parts in zip(*self.wanted, strict=True))
            self.wanted = []
            self.states[place, :, which] = dormand_prince.array_step(self.f, t, self.times[place] - t, y).T


def _narrow(first: Floats, second: Floats, third: Floats) -> Marks:
    """Whether two steps may go over something narrow, by the watched values at their three ends.

    The first row of each is the times (1 + f by m).

    A parabola through them, or the way from one to the next, then comes much nearer to zero than both ends
    are, and changes by more than 1.
    """
    (t0, *_), (t1, *_), (t2, *_) = first, second, third
    v0, v1, v2 = first[1:], second[1:], third[1:]
    slope, other = (v1 - v0) / (t1 - t0), (v2 - v1) / (t2 - t1)
    bend = (other - slope) / (t2 - t0)
    middle = t1 - (slope + bend * (t1 - t0)) / (2 * bend)  # where the parabola turns
    turn = v1 + (middle - t1) * (slope + bend * (t1 - t0)) / 2
    inside = (middle > t0) & (middle < t2)
    near = np.minimum(np.abs(v0), np.abs(v2))
    changed = np.abs(v2 - v1) > 1
    passes = (v1 * v2 < 0) & changed
    turns = inside & (np.abs(turn) < near / 4) & (np.abs(v0 - turn) + np.abs(v2 - turn) > 1)
    result: Marks = np.logical_or.reduce(passes | turns, axis=0)
    return result
