"""The pair of Dormand and Prince for many starts at once: variables by starts, in arrays.

Each start has its own steps, so that it moves as it does alone, whatever the others are. All of them try
their next step at once; those that have come to the end, or fail, leave the arrays. A start fails whose steps
get too short, or too many, or may go over something narrow: it is left to the integration of a single start.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.dormand_prince import SAMPLED_AT_ONCE, ArraySteps, array_step, norms, padded
from rigidcli.core.runge_kutta import SMALLEST_SCALE, STEPS_PER_REPORT, March, rounding_errors, sides
from rigidcli.core.second_run import MISSED, other_tolerance
from rigidcli.core.solution import ORIGIN_OF_TIME, SHORTEST_STEP, Flow, InitialValues, columns, slopes_of
from rigidcli.errors import ComputationError

# The most steps of a start in arrays: the few starts that need more are quicker alone.
MOST_TOGETHER = 20_000
LARGEST = 1e150  # Energies have squares of variables: those of larger ones are beyond the range of floats.
LOOKS_AHEAD = 1024  # Steps from one estimate of whether the most steps are enough to the next.
# Floats of the states that are stepped at once, so that the arrays of the stages stay in the cache.
AT_ONCE = 8192
# Starts that are stepped at once at least: with fewer, calls of numpy take longer than the arithmetic.
FEWEST_AT_ONCE = 256
# Steps this much shorter than those before follow a function that jumps or has corners: alone it is quicker.
SUDDEN = 1e-4
LOOKED_AT = 4  # Starts whose first steps tell how much work all are.
ONE_OF = 8  # One start in so many has a second solution where results do not show digits.
# One start in so many may wait for the others: to take these out of the arrays takes as long as a step.
MOST_WAITING = 16

Places: TypeAlias = NDArray[np.int_]


class Paths(NamedTuple):
    """The states of m starts at k times (k by n by m), their steps (m), and the largest sizes (n by m).

    The starts that are to be followed `alone` (m) have none.
    """

    states: Floats
    steps: NDArray[np.int_]
    largest: Floats
    alone: Mask

    def of(self, some: Places) -> Paths:
        """The paths from the starts at some places."""
        return Paths(self.states[..., some], self.steps[some], self.largest[:, some], self.alone[some])


class ManyStarts(NamedTuple):
    """The equations y' = f(t, y) of n variables, and how they are solved: the arguments of `integrate`.

    `parts` are the slices of the blocks of variables whose errors are bounded. Behind them are those of
    `integrals` over the time, whose errors are bounded beside their largest sizes, and parameters, which have
    no slope. `moving` gives the functions whose zeros and extremes may hide a narrow wall. `tolerance` and
    `longest` may differ from start to start (m).
    """

    flow: Flow
    roundings: Flow | None
    moving: Flow
    parts: Sequence[slice]
    tolerance: float | Floats
    longest: float | Floats
    stops: Sequence[float]
    integrals: Sequence[slice] = ()

    def is_watched(self, starts: Floats) -> bool:
        """Whether there are functions whose zeros and extremes may hide something."""
        return len(columns(self.moving)(np.zeros(1), *starts[:, :1])) > 0

    def of(self, some: Places, count: int) -> ManyStarts:
        """The problem for some of so many starts."""
        tolerance, longest = (np.broadcast_to(each, count)[some] for each in (self.tolerance, self.longest))
        return self._replace(tolerance=tolerance, longest=longest)


# A function like `paths`.
Follow: TypeAlias = Callable[[ManyStarts, Floats, Floats], Paths]


def paths(problem: ManyStarts, starts: Floats, times: Floats) -> Paths:
    """The solutions from `starts` (n by m) at t = 0, at the `times` (k), to the last of them."""
    count, size = starts.shape[1], max(FEWEST_AT_ONCE, AT_ONCE // len(starts))
    parts = []
    for first in range(0, count, size):
        real = min(size, count - first)
        some = first + padded(real)
        part = _Lanes(problem.of(some, count), starts[:, some], times).followed()
        parts.append([each[..., :real] for each in part])
    return Paths(*(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True)))


def twice(
    problem: ManyStarts,
    starts: Floats,
    times: Floats,
    distance: Callable[[Paths, Paths], Floats],
    every: int = 1,
    follow: Follow = paths,
) -> tuple[Paths, Floats]:
    """The solutions, and how far (k by m) they are from second ones, to the tolerance of a second run.

    `distance` gives that of some starts, and `follow` their solutions. Those without a second solution are
    `alone`, too.

    Both go through the same arrays: calls of numpy take longer than the arithmetic of a few hundred starts.

    With `every`, one start in so many has a second solution, and the others count as far off as the worst of
    these; but all have one where that is far enough to be looked into, or something narrow is watched for.
    Which starts are alone must not depend on which have a second solution: then the first solutions decide.
    """
    count = starts.shape[1]

    def compared(some: Places) -> tuple[Paths, Mask, Floats]:
        """The first solutions, and of some of them which have no second one, and how far it is off."""
        both = np.concatenate([np.arange(count), some])
        two = problem.of(both, count)
        two = two._replace(tolerance=np.where(np.arange(len(both)) < count, two.tolerance, coarse))
        found = follow(two, starts[:, both], times)
        first, second = found.of(both[:count]), found.of(np.arange(count, len(both)))
        mine = first.of(some)
        lost = mine.alone | second.alone
        return first, lost, np.where(lost, 0.0, distance(mine, second))

    coarse = other_tolerance(float(problem.tolerance))
    if every > 1 and not problem.is_watched(starts):
        first, _, apart = compared(np.arange(0, count, every))
        if apart.max() > MISSED:
            return first, compared(np.arange(count))[2]
        return first, np.broadcast_to(apart.max(axis=1, keepdims=True), (len(times), count))
    first, lost, apart = compared(np.arange(count))
    return first._replace(alone=first.alone | lost), apart


def outlook(problem: ManyStarts, starts: Floats, end: float) -> float:
    """About how many steps a start (of n by m) takes to the end, by the first steps of a few of them."""
    sizes, found = tuple(part.stop - part.start for part in problem.parts), list[float]()
    for start in starts[:, :: 1 + starts.shape[1] // LOOKED_AT].T:
        one = InitialValues(
            problem.flow, start, (0.0, end), float(problem.tolerance), sizes, float(problem.longest)
        )
        with suppress(ComputationError):
            march = March(one)
            next(march.steps, None)
            found.append((len(march.times) - 1) * end / march.t)
    return sum(found) / max(1, len(found))


class _Going(NamedTuple):
    """What belongs to each start on its way; all arrays have a column for each start.

    These are the time, the length of the next step, its bound and its tolerance, the state and its slope,
    the least sizes and the floors of the blocks, the largest sizes so far, the number of steps, whether the
    last try of a step has failed, and when the next sample is due. The last two have the times (first row)
    and the watched values at the ends of the last two steps.
    """

    t: Floats
    h: Floats
    longest: Floats
    tolerance: Floats
    y: Floats
    k: Floats
    least: Floats
    floors: Floats
    largest: Floats
    steps: Floats
    failed: Array
    due: Floats
    older: Floats
    last: Floats


class _Lanes:
    """Starts on their way; their number is a multiple of `dormand_prince.COLUMNS`."""

    def __init__(self, problem: ManyStarts, starts: Floats, times: Floats) -> None:
        self.problem, self.times = problem, times
        self.f, self.watched = problem.flow(np), columns(problem.moving)
        self.roundings = None if problem.roundings is None else problem.roundings(np)
        self.parts = [*problem.parts, *problem.integrals]
        self.measured, count = problem.parts[-1].stop, starts.shape[1]
        self.end = float(times[-1])
        self.states = np.full((len(times), len(starts), count), np.nan)
        begun = np.searchsorted(times, 0.0, side="right")
        self.states[:begun] = starts
        self.alone = np.zeros(count, dtype=bool)
        self.wanted: list[tuple[Any, ...]] = []
        self.count = 0  # of the samples in them
        t, blocks = np.zeros(count), (len(self.parts), count)
        longest = np.minimum(np.broadcast_to(problem.longest, count), self.end)
        watched = np.vstack([t, self.watched(t, *starts)])
        self.all = _Going(
            t,
            np.minimum(self.end / 1000, longest),
            longest,
            np.broadcast_to(problem.tolerance, count).copy(),
            starts.copy(),
            slopes_of(self.f, t, starts),
            np.full(blocks, SMALLEST_SCALE),
            np.zeros(blocks),
            np.abs(starts),
            np.zeros(count),
            np.zeros(count, dtype=bool),
            np.full(count, np.append(times, np.inf)[begun]),
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
        self.alone |= ~(np.abs(self.states) < LARGEST).all(axis=(0, 1))
        return Paths(self.states, self.all.steps.astype(int), self.all.largest, self.alone)

    def _find_least(self) -> None:
        """Find the least sizes as `runge_kutta.least_sizes` does; that of an integral is its later size."""
        parts, (y, k) = self.parts, (self.all.y, self.all.k)
        share = np.array([1e-3 * ~(y[part].any(axis=0) | k[part].any(axis=0)) for part in parts])
        share[len(self.problem.parts) :] = 1.0
        if share.any() and len(parts) > 1:
            crude = self.problem._replace(
                parts=[slice(self.measured)], integrals=(), tolerance=1e-6, moving=lambda _: lambda *_: ()
            )
            largest = _Lanes(crude, y, self.times[-1:]).followed().largest
            self.all.least[:] = np.maximum(norms(largest, parts) * share, SMALLEST_SCALE)

    def _cross(self, goal: float, beyond: float) -> None:
        """Go to the time just beyond a stop; at the start only where the slopes jump."""
        h, (t, _, _, _, y, k, *_) = beyond - goal, self.all
        slopes = slopes_of(self.f, np.full_like(t, beyond), y + h * k)
        jumps = np.linalg.norm(slopes - k, axis=0) > 0.01 * np.maximum(*(
            np.linalg.norm(each, axis=0) for each in (slopes, k)
        ))  # fmt: skip
        go = jumps if goal == 0 else np.ones_like(jumps)
        np.copyto(y, y + h * (k + slopes) / 2, where=go)
        np.copyto(t, beyond, where=go)
        k[:] = slopes_of(self.f, t, y)

    def _march(self, goal: float) -> None:
        """Follow all starts to the goal; those that do not get there are `alone`."""
        going, active, done = self.all, np.arange(len(self.alone)), self.alone | (self.all.t >= goal)
        method: ArraySteps | None = None
        turn, own = 0, self.problem.parts
        while True:
            left = len(done) - int(np.count_nonzero(done))
            if method is None or not left or left < len(done) - len(done) // MOST_WAITING:
                for whole, part in zip(self.all, going, strict=True):
                    whole[..., active] = part
                if not left:
                    return
                # Some that are done fill the columns up.
                active = active[np.argsort(done, kind="stable")[: len(padded(left))]]
                going = _Going(*(part[..., active] for part in self.all))
                done = self.alone[active] | (going.t == goal)
                method = ArraySteps(self.f, going.y.shape, going.tolerance, self.parts)
            if not turn % STEPS_PER_REPORT:
                errors = rounding_errors(self.f, self.roundings, going.t, going.h, going.y, self.measured)
                # Those of integrals stay zero: a function that jumps must not pass for rounding errors.
                going.floors[: len(own)] = 2 * norms(errors, own) / going.tolerance
            going, bad = self._stepped(method, goal, active, going)
            if turn and not turn % LOOKS_AHEAD:
                bad |= self.end - going.t > (MOST_TOGETHER - going.steps) * going.h
            done |= going.t == goal
            if np.count_nonzero(bad := bad & ~done):
                self.alone[active[bad]] = True
                done |= bad
            turn += 1

    def _stepped(self, method: ArraySteps, goal: float, active: Places, going: _Going) -> tuple[_Going, Mask]:
        """The starts after one try of a step each, and which of them are to be followed alone.

        A start that waits at the goal makes a step of no length.
        """
        t, y, k = going.t, going.y, going.k
        left = goal - t
        # What is left is shared by two steps, so that the last one is no mere rest.
        to = t + np.where(left < 2 * going.h, left / 2, going.h)
        np.copyto(to, goal, where=left <= going.h)
        h = to - t
        sizes = np.maximum(going.floors * h, going.least)
        error, after, slopes = method.with_error(t, h, y, k, sizes)
        failed = ~(error <= 1.0)
        for ends, begins in ((to, t), (after, y), (slopes, k)):
            np.copyto(ends, begins, where=failed)
        moved = to > t
        is_due = to >= going.due
        if np.count_nonzero(is_due):
            self._want(np.flatnonzero(is_due), active, going, to)
        # No step is more than six times as long as the last, and none grows after one that failed.
        growth = np.minimum(0.9 / np.sqrt(np.sqrt(np.sqrt(error))), np.where(going.failed, 1.0, 6.0))
        h = np.minimum(h * np.fmax(growth, 0.1), going.longest)
        bad = failed & (h < SHORTEST_STEP * np.maximum(t, ORIGIN_OF_TIME * self.end))
        if self.problem.integrals:
            bad |= failed & (h * going.steps < SUDDEN * t)
        older, last = going.older, going.last
        if len(last) > 1:
            now = np.vstack([to, self.watched(to, *after)])
            bad |= moved & narrow(older, last, now)
            older, last = np.where(moved, last, older), np.where(moved, now, last)
        going = going._replace(
            t=to,
            h=np.where(left > 0, h, going.h),
            y=after,
            k=slopes,
            largest=np.maximum(going.largest, np.abs(after)),
            steps=going.steps + moved,
            failed=failed,
            older=older,
            last=last,
        )
        return going, bad

    def _want(self, some: Places, active: Places, going: _Going, to: Floats) -> None:
        """Note the samples that are inside the steps of some starts, and where these steps begin."""
        first = np.searchsorted(self.times, going.due[some])
        last = np.searchsorted(self.times, to[some], side="right")
        going.due[some] = np.append(self.times, np.inf)[last]
        count = last - first
        which = np.repeat(some, count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first, count)
        self.wanted.append((place, active[which], going.t[which], going.y[:, which]))
        self.count += len(which)
        if self.count > SAMPLED_AT_ONCE:
            self._sample()

    def _sample(self) -> None:
        """Take a step to each sample from the beginning of the step that it is in."""
        if self.wanted:
            place, which, t, y = (np.concatenate(parts, axis=-1) for parts in zip(*self.wanted, strict=True))
            self.wanted, self.count = [], 0
            self.states[place, :, which] = array_step(self.f, t, self.times[place] - t, y).T


def narrow(first: Floats, second: Floats, third: Floats) -> Mask:
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
    result: Mask = np.logical_or.reduce(passes | turns, axis=0)
    return result
