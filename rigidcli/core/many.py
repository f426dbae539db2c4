"""The pair of Dormand and Prince for many starts at once: variables by starts, in arrays.

Each start has steps of its own, so that it moves as it does alone, whatever the others are. All of them take
their next step together; those at the end, or in trouble, are left out of the arrays. Trouble is left to the
integration of one start: steps that get too short, or too many, or that may go over something narrow.
The stages and the error of a step are those of `dormand_prince`, with its numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import dormand_prince
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.runge_kutta import LEAST, ROUND, sides
from rigidcli.core.solution import ORIGIN, SHORTEST, Elements, Flow

MOST_TOGETHER = 20_000
"""The most steps of a start among others: the few that need more are quicker alone."""

TOGETHER = 16_384
"""Floats of the states that are worked at once, so that the arrays of the stages stay in the cache."""

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


class Problem(NamedTuple):
    """The equations y' = f(t, y) of n variables, and how they are solved: the arguments of `integrate`.

    `moving` gives the functions whose zeros and extremes may hide a narrow wall.
    """

    flow: Flow
    roundings: Flow | None
    moving: Flow
    blocks: tuple[int, ...]
    tolerance: float
    longest: float
    stops: Sequence[float]


def paths(problem: Problem, starts: Floats, times: Floats) -> Paths:
    """The solutions from `starts` (n by m) at t = 0, at the `times` (k), to the last of them."""
    size = max(256, TOGETHER // len(starts))
    parts = [
        _Lanes(problem, starts[:, first : first + size], times).followed()
        for first in range(0, starts.shape[1], size)
    ]
    return Paths(
        np.concatenate([part.states for part in parts], axis=2),
        np.concatenate([part.steps for part in parts]),
        np.concatenate([part.largest for part in parts], axis=1),
        np.concatenate([part.alone for part in parts]),
    )


def twice(problem: Problem, starts: Floats, times: Floats) -> tuple[Paths, Paths]:
    """The solutions, and second ones to the other tolerance that `estimate.compared` takes."""
    other = problem.tolerance * (100 if problem.tolerance <= 1e-5 else 0.01)
    return paths(problem, starts, times), paths(problem._replace(tolerance=other), starts, times)


@cache
def _stepper(blocks: tuple[int, ...]) -> Callable[..., Any]:
    """A step of `dormand_prince.source` for arrays."""
    step: Callable[..., Any] = dormand_prince.compiled(
        dormand_prince.source_for_arrays(blocks), dormand_prince.OF_ARRAYS
    )
    return step


class _Lanes:
    """Starts on their way. What is not over all of them is over the `active` ones, which go on."""

    def __init__(self, problem: Problem, starts: Floats, times: Floats, most: int = MOST_TOGETHER) -> None:
        self.problem, self.times, self.most = problem, times, most
        self.f, self.moving = problem.flow(np), problem.moving(np)
        count = starts.shape[1]
        self.end = float(times[-1])
        self.longest = min(problem.longest, self.end)
        self.states = np.full((len(times), len(starts), count), np.nan)
        self.next = np.full(count, np.searchsorted(times, 0.0, side="right"))
        self.states[: self.next[0]] = starts
        self.steps, self.largest = np.zeros(count, dtype=int), np.abs(starts)
        self.alone = np.zeros(count, dtype=bool)
        self.wanted: list[tuple[Any, ...]] = []
        self.t, self.y = np.zeros(count), starts.copy()
        self.k = _rows(self.f, self.t, self.y)
        self.h = np.full(count, min(self.end / 1000, self.longest))
        self.least = np.full((len(problem.blocks), count), LEAST)
        watched = _rows(self.moving, self.t, self.y)
        self.before = [[self.t.copy(), watched.copy()] for _ in range(2)]

    def followed(self) -> Paths:
        with np.errstate(all="ignore"):
            self.alone |= ~np.isfinite(self.k).all(axis=0)
            self._find_least()
            for goal, beyond in sides(0.0, self.problem.stops, self.end):
                self._march(goal)
                if beyond > goal:
                    self._cross(goal, beyond)
            self._sample()
        self.alone |= ~np.isfinite(self.states).all(axis=(0, 1))
        return Paths(self.states, self.steps, self.largest, self.alone)

    def _find_least(self) -> None:
        """Give a block that begins with nothing, and at rest, a least size, as `least_sizes` does."""
        parts = _parts(self.problem.blocks)
        empty = np.array([~(self.y[part].any(axis=0) | self.k[part].any(axis=0)) for part in parts])
        if empty.any() and len(parts) > 1:
            crude = self.problem._replace(
                blocks=(len(self.y),), tolerance=1e-6, moving=lambda _: lambda *_: ()
            )
            largest = _Lanes(crude, self.y, self.times[-1:], 4 * ROUND).followed().largest
            sizes = np.array([np.hypot.reduce(largest[part], axis=0) for part in parts])
            self.least = np.maximum(1e-3 * sizes * empty, LEAST)

    def _cross(self, goal: float, beyond: float) -> None:
        """Go beyond a stop, at which the slopes may jump, as `runge_kutta` does."""
        h = beyond - goal
        slopes = _rows(self.f, np.full_like(self.t, beyond), self.y + h * self.k)
        jumps = np.linalg.norm(slopes - self.k, axis=0) > 0.01 * np.maximum(*(
            np.linalg.norm(each, axis=0) for each in (slopes, self.k)
        ))  # fmt: skip
        go = jumps if goal == 0 else np.ones_like(jumps)
        self.y = np.where(go, self.y + h * (self.k + slopes) / 2, self.y)
        self.t = np.where(go, beyond, self.t)
        self.k = _rows(self.f, self.t, self.y)

    def _march(self, goal: float) -> None:
        """Follow all starts to the goal; those that do not get there are `alone`."""
        step, f = _stepper(self.problem.blocks), self.f
        active = np.flatnonzero(~self.alone & (self.t < goal))
        t, h, y, k, least = (a[..., active] for a in (self.t, self.h, self.y, self.k, self.least))
        old, last = ([time[active], values[:, active]] for time, values in self.before)
        large, steps = self.largest[:, active], self.steps[active]
        failures, turn = np.zeros(len(active), dtype=int), 0
        while len(active):
            if not turn % ROUND:
                floors = self._floors(t, y, k, h)
            left = goal - t
            to = np.where(left <= h, goal, t + np.where(left < 2 * h, left / 2, h))
            error, after, slopes = step(f, t, to - t, y, k, floors, least, self.problem.tolerance)
            good, h = (error <= 1.0) & (left > 0), to - t
            scaled = np.where(error > 0, 0.9 / np.sqrt(np.sqrt(np.sqrt(error))), 6.0)
            longer = np.clip(np.minimum(scaled, np.where(failures > 0, 1.0, 6.0)), 0.3, 6.0)
            shorter = np.where(error < np.inf, np.maximum(0.1, scaled), 0.25)
            failures = np.where(good, 0, failures + (left > 0))
            self._want(active, t, to, y, good)
            steps += good
            bad = (failures > 40) | (steps > self.most)
            bad |= h < SHORTEST * np.maximum(t, ORIGIN * self.end)
            np.copyto(t, to, where=good)
            for whole, rows in ((y, after), (k, slopes)):
                for old_row, row in zip(whole, rows, strict=True):
                    np.copyto(old_row, row, where=good)
            np.maximum(large, np.abs(y), out=large)
            h = np.minimum(h * np.where(good, longer, shorter), self.longest)
            if len(last[1]):
                now = _rows(self.moving, t, y)
                bad |= good & _narrow((*old, *last, t, now))
                old = [np.where(good, new, value) for value, new in zip(old, last, strict=True)]
                last = [np.where(good, new, value) for value, new in zip(last, (t, now), strict=True)]
            bad &= left > 0
            self.alone[active[bad]] = True
            turn += 1
            done = bad | (t == goal)
            if done.sum() > len(done) // 8 or done.all():
                pairs = [(self.t, t), (self.h, h), (self.y, y), (self.k, k)]
                pairs += [(self.largest, large), (self.steps, steps)]
                pairs += [*zip(self.before[0], old, strict=True), *zip(self.before[1], last, strict=True)]
                for whole, part in pairs:
                    whole[..., active] = part
                keep = ~done
                active, failures = active[keep], failures[keep]
                t, h, y, k, least, floors = (a[..., keep] for a in (t, h, y, k, least, floors))
                large, steps = large[:, keep], steps[keep]
                old, last = ([value[..., keep] for value in values] for values in (old, last))

    def _floors(self, t: Floats, y: Floats, k: Floats, h: Floats) -> Floats:
        """As in `runge_kutta.floors`: the size of f, for each block, below which it is rounding errors."""
        noise = np.zeros_like(y)
        if self.problem.roundings is not None:
            noise = EPS * _rows(self.problem.roundings(np), t, y)
            noise = np.fmax(noise, np.abs(k - _rows(self.f, t, y + 4 * h * noise)))
        for bit in range(max(1, (len(y) - 1).bit_length())):
            signs = np.where(np.arange(len(y)) >> bit & 1, 1.0, -1.0)[:, None]
            for move in (-5 * EPS, -3 * EPS, 3 * EPS, 5 * EPS):
                other = _rows(self.f, t * (1 + move), y * (1 + move * signs))
                noise = np.fmax(noise, np.abs(k - other))
        sizes = [np.hypot.reduce(noise[part], axis=0) for part in _parts(self.problem.blocks)]
        return np.nan_to_num(2 * np.array(sizes) / self.problem.tolerance, posinf=0.0)

    def _want(self, active: Any, t: Floats, to: Floats, y: Floats, good: Marks) -> None:
        """Remember the samples inside the steps that are good."""
        first = self.next[active]
        last = np.where(good, np.searchsorted(self.times, to, side="right"), first)
        some = np.flatnonzero(last > first)
        if len(some):
            self.next[active] = last
            count = (last - first)[some]
            which = np.repeat(some, count)
            place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first[some], count)
            self.wanted.append((place, active[which], t[which], y[:, which]))
            if sum(len(entry[0]) for entry in self.wanted) > dormand_prince.BLOCK:
                self._sample()

    def _sample(self) -> None:
        """Take a shorter step to each sample, from where the step begins in which it is."""
        if self.wanted:
            place, which, t, y = (np.concatenate(parts, axis=-1) for parts in zip(*self.wanted, strict=True))
            self.wanted = []
            self.states[place, :, which] = dormand_prince.array_step(self.f, t, self.times[place] - t, y).T


def _parts(blocks: Sequence[int]) -> list[slice]:
    return [slice(end - size, end) for size, end in zip(blocks, accumulate(blocks), strict=True)]


def _rows(f: Elements, t: Floats, y: Floats) -> Floats:
    rows = f(t, *y)
    return np.array([np.broadcast_to(row, t.shape) for row in rows]).reshape(len(rows), *t.shape)


def _narrow(knots: tuple[Floats, ...]) -> Marks:
    """Whether two steps may go over something narrow, by three values (f by m) of what is watched.

    A parabola through them, or the way from one to the next, then comes much nearer to zero than both ends
    are, and changes by more than 1.
    """
    t0, v0, t1, v1, t2, v2 = knots
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
