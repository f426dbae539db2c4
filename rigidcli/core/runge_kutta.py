"""Integration by the Runge-Kutta pair of Dormand and Prince, in steps as long as its errors allow.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
section II.4 for the length of the steps. Differences: rounding errors of f show when its arguments move by an
ulp, and no step is shortened for them; a step ends at each time at which something sudden is expected.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.dormand_prince import METHOD, norms, sampler, slices, stepper
from rigidcli.core.solution import (
    MOST_NUMBERS,
    MOST_STEPS,
    NO_VALUE,
    ORIGIN_OF_TIME,
    SHORTEST_STEP,
    Elements,
    Function,
    InitialValues,
    Solution,
    State,
    TooManySteps,
    finite,
    hopeless,
    largest,
    slopes_of,
    stopped,
)
from rigidcli.errors import ComputationError

STEPS_PER_REPORT = 128  # Steps from one estimate of rounding errors, and one report of progress, to the next.
SMALLEST_SCALE = 1e-280  # Smallest scale of a variable.
# Jumps of f that are crossed one after the other: with more, the solution would slide along the jump.
MOST_JUMPS = 16
FAR = 1e6  # What is so many shortest steps away from a jump or a pole is far from it.


class March:
    """The solution of a problem by steps of the pair, as far as it has come, in `times` and `states`.

    `least` has for each block the size to which its error is relative at least. `steps` go on.

    Raises Stopped where f has no value at the start.
    """

    def __init__(self, problem: InitialValues, least: State | None = None) -> None:
        self.problem, roundings = problem, problem.roundings
        self.f, self.step, self.parts = problem.function(), stepper(problem.blocks), slices(problem.blocks)
        self.elements, self.roundings = problem.flow(np), None if roundings is None else roundings(np)
        self.t, self.end = problem.span
        self.span, self.tolerance = self.end - self.t, problem.tolerance
        self.longest, self.project = problem.longest, problem.project
        self.y: State = tuple(problem.start.tolist())
        self.k: State = self.f(self.t, *self.y)
        self.times, self.states = array("d", [self.t]), array("d", self.y)
        self.h = math.copysign(min(abs(self.span) / 1000, self.longest), self.span)
        self.least = least_sizes(problem, self.f) if least is None else least
        self.landed = self.jumped = self.t  # the ends of the last crossed stop, and of the last jump
        self.failures = self.taken = self.jumps = 0
        self._estimate_floors()
        self.steps = self._steps()

    def _steps(self) -> Iterator[float]:
        """Go to the end. Every `STEPS_PER_REPORT` steps it yields the time that it has reached.

        Raises:
            Stopped: there is no solution as far as the end.
            TooManySteps: there are more than MOST_STEPS, or will be if the later half of them goes on.
        """
        most = min(MOST_STEPS, MOST_NUMBERS // len(self.y))
        edges = sides(self.t, self.problem.stops, self.end)
        goal, beyond = next(edges)
        while self.t != self.end:
            if goal == self.t:
                self._cross_stop(beyond)
                goal, beyond = next(edges)
            elif self._is_taken(goal):
                is_due = not self.taken % STEPS_PER_REPORT
                if is_due:
                    if hopeless(self.times, self.taken, self.end, most):
                        raise TooManySteps(self.problem.name, self.taken, self.t, self.end, most)
                    yield self.t
                # At a stop f may jump, which must not pass for rounding errors.
                if (is_due or abs(self.h) > 4 * self.reach) and self.t != goal:
                    self._estimate_floors()

    def solution(self, note: str | None = None) -> Solution:
        """The solution as far as it has come."""
        knots = np.frombuffer(self.times)
        path = np.frombuffer(self.states).reshape(len(knots), -1)
        sample = sampler(self.problem.flow, knots, path)
        steps, sizes = len(knots) - 1, largest(path)
        return Solution(steps, METHOD, "runge-kutta", self.tolerance, knots, sample, sizes, self.least, note)

    def _cross_stop(self, beyond: float) -> None:
        """Go to the time just `beyond` a stop; at the start only where the slopes jump."""
        h = beyond - self.t
        with suppress(*NO_VALUE):
            slope = self.f(beyond, *(value + h * rate for value, rate in zip(self.y, self.k, strict=True)))
            rates = zip(self.y, self.k, slope, strict=True)
            after = [value + h * (one + two) / 2 for value, one, two in rates]
            slope = self.f(beyond, *after)
            jump, size = math.dist(self.k, slope), max(math.hypot(*self.k), math.hypot(*slope))
            if (len(self.times) > 1 or jump > 0.01 * size) and all(map(math.isfinite, slope)):
                self.landed = beyond
                self._append(beyond, after, slope)

    def _append(self, t: float, y: State, k: State) -> None:
        self.t, self.y, self.k = t, y, k
        self.times.append(t)
        self.states.extend(y)

    def _is_taken(self, goal: float) -> bool:
        """Try a step towards the goal, and choose the length of the next one.

        Raises Stopped where steps are too short.
        """
        t, h, left = self.t, self.h, goal - self.t
        size, distance = abs(h), abs(left)
        if size < self._shortest():
            h = math.copysign(min(self._shortest(), distance), h)
            self._jump(h)
            error = 0.0
        else:
            # What is left is shared by two steps, so that the last one is no mere rest.
            to = goal if distance <= size else t + (left / 2 if distance < 2 * size else h)
            # Times are what a solution is asked by: the step is their difference, free of rounding.
            h = to - t
            try:
                error, y, k = self.step(self.f, t, h, self.y, self.k, self.floors, self.least, self.tolerance)
                if self.project is not None and error <= 1.0:
                    y = self.project(to, y)
                    k = self.f(to, *y)
            except NO_VALUE:
                error = math.nan
            if not error <= 1.0:
                self.failures += 1
                self.h = h * (max(0.1, 0.9 * error**-0.125) if error < math.inf else 0.25)
                if self.failures == 4 and t != self.landed:  # rounding errors may be the reason
                    self._estimate_floors()
                return False
            self._append(to, y, k)
        # No step is more than six times as long as the last, and none grows after one that failed.
        growth = min(0.9 * error**-0.125 if error else 6.0, 1.0 if self.failures else 6.0)
        h *= growth
        self.h = h if abs(h) <= self.longest else math.copysign(self.longest, h)
        self.failures, self.taken = 0, self.taken + 1
        return True

    def _shortest(self) -> float:
        return SHORTEST_STEP * max(abs(self.t), ORIGIN_OF_TIME * abs(self.span))

    def _jump(self, h: float) -> None:
        """Take the shortest step h, across a jump of f. Raises Stopped where there is none."""
        far = abs(self.t - self.jumped) > FAR * self._shortest()
        self.jumps, self.failures = 1 if far else self.jumps + 1, 0
        recent, to = self.states[-STEPS_PER_REPORT * len(self.y) :], self.t + h
        crossed = _crossed(self.f, to, h, self.y, self.k, recent) if self.jumps <= MOST_JUMPS else None
        if crossed is None:
            raise stopped(self.f, self.t, self.y, self.span, self.problem.name)
        self.jumped = to
        self._append(to, *crossed)

    def _estimate_floors(self) -> None:
        """Find the size of each block of f below which it is rounding errors, divided by the tolerance."""
        self.reach = abs(self.h)
        t, y, k = np.array([self.t]), np.array(self.y)[:, None], np.array(self.k)[:, None]
        errors = rounding_errors(self.elements, self.roundings, t, self.h, y, len(y))
        sizes = 2 * norms(errors, self.parts)
        last = abs(self.t - self.times[-2]) if self.taken else math.inf
        if last < FAR * self._shortest():  # a pole may be near, which must not pass for rounding errors
            sizes = np.minimum(sizes, 1e-4 * norms(k, self.parts))
        self.floors = tuple((sizes[:, 0] / self.tolerance).tolist())


def sides(start: float, stops: Sequence[float], end: float) -> Iterator[tuple[float, float]]:
    """The times just before and just after the start and each of the `stops`, and twice the end.

    Between the two are a few units in the last place: what jumps at a stop does so between them.
    """
    span = end - start
    before, ahead = start, math.copysign(1.0, span)
    for stop in (start, *stops):
        reach = ahead * SHORTEST_STEP / 4 * max(abs(stop), ORIGIN_OF_TIME * abs(span))
        low, high = (start if stop == start else stop - reach), stop + reach
        if ahead * high < ahead * end and ahead * (high - before) > 0:
            yield (low if ahead * (low - before) > 0 else before), high
            before = high
    yield end, end


def least_sizes(problem: InitialValues, f: Function) -> State:
    """The least size of each block; for one that begins at zero, at rest, a thousandth of its later size.

    Such a block grows like a power of the time. While it is small, no step follows it to a relative accuracy,
    and none need.
    """
    (t, end), y, parts = problem.span, problem.start.tolist(), slices(problem.blocks)
    k = f(t, *y)
    empty = [not any(y[part]) and not any(k[part]) for part in parts]
    if not any(empty):
        return (SMALLEST_SCALE,) * len(parts)
    states = array("d", y)
    with suppress(ComputationError, *NO_VALUE):
        if len(parts) > 1:
            crude = problem._replace(tolerance=1e-6, blocks=(len(y),), roundings=None, project=None)
            pilot = March(crude)
            states = pilot.states
            # Where friction holds a body, the steps would never end.
            deque(itertools.islice(pilot.steps, 64), maxlen=0)
        else:
            step = stepper(problem.blocks)
            states.extend(step(f, t, (end - t) / 1000, y, k, (0.0,), (math.inf,), 1e-6)[1])
    path = np.abs(np.frombuffer(states).reshape(-1, len(y)))
    sizes = [float(np.hypot.reduce(path[:, part], axis=1).max()) for part in parts]
    return tuple(max(1e-3 * size * none, SMALLEST_SCALE) for none, size in zip(empty, sizes, strict=True))


def _crossed(
    f: Function, to: float, h: float, y: State, k: State, recent: Sequence[float]
) -> tuple[State, State] | None:
    """The state (n) and its slope at time `to`, the shortest step h away, if f has a jump between.

    Dry friction has one where the velocity is zero. It is a jump if no variable moves by more than 1e-10 of
    its size in the `recent` states (m n); one that was zero in all of them may begin to move.
    """
    after = [value + h * slope for value, slope in zip(y, k, strict=True)]
    if not finite(f, to, after):
        return None
    slopes = f(to, *after)
    for i, (one, two) in enumerate(zip(k, slopes, strict=True)):
        if abs(h) * max(abs(one), abs(two)) > 1e-10 * max(map(abs, recent[i :: len(y)])) > 0:
            return None
    return after, slopes


def rounding_errors(
    f: Elements, roundings: Elements | None, t: Floats, h: Floats | float, y: Floats, measured: int
) -> Floats:
    """The rounding errors (n by m) in the values of f at times t (m) and states y (n by m).

    A body at rest in equilibrium has no other value. To find them, f is evaluated with the time and the first
    `measured` variables moved by a few ulps. `roundings` gives those of small differences, which in a few
    steps h (m) get from one variable into others.
    """
    moves = _moves(len(y), measured)
    with np.errstate(all="ignore"):
        k, errors = slopes_of(f, t, y), np.zeros_like(y)
        if roundings is not None:
            errors = EPS * slopes_of(roundings, t, y)
            errors = np.fmax(errors, np.abs(k - slopes_of(f, t, y + 4 * h * errors)))
        # All moves stand side by side: variables by moves by m.
        moved = y[:, None] * moves[1:]
        other = slopes_of(f, (t * moves[0]).ravel(), moved.reshape(len(y), -1)).reshape(moved.shape)
        errors = np.fmax(errors, np.fmax.reduce(np.abs(other - k[:, None]), axis=1))
    errors[errors == np.inf] = 0.0
    return errors


@cache
def _moves(count: int, measured: int) -> Floats:
    """Factors (1 + n by moves by 1) of the time and of n variables; those that are `measured` move.

    They are near 1, and move any two variables to the same side, and to different ones.
    """
    places, bits = np.arange(count)[:, None], np.arange(max(1, (measured - 1).bit_length()))
    signs = np.where(places < measured, 2.0 * (places >> bits & 1) - 1.0, 0.0)
    signs = np.vstack([np.ones(len(bits)), signs])
    moves: Floats = 1 + EPS * (signs[:, :, None] * [-5.0, -3.0, 3.0, 5.0]).reshape(1 + count, -1, 1)
    return moves
