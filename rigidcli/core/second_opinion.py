"""How far an integrated solution is off, told by a second one whose errors are larger by a known ratio.

A solution is off by the errors of its steps, by the rounding of each step, and by that of its start. The
second solution has a larger tolerance, and its state is moved by as many times the rounding errors of the
first: at the start, where what is exact in fewer digits stays as it is, and again where each of some pieces
of the span begins. So it also shows what two plain solutions share. What both differ by, over the ratio,
is the error of the first one, as long as it is small. Where it is not, as in chaotic motion, the second
solution is pulled back towards the first, and what is taken off counts in the ratio from there on. Lyapunov
exponents are measured so: G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.solution import FINEST, ROUNDING, Solution
from rigidcli.errors import ComputationError

COARSEST = 1e-3
"""A tolerance to which no second solution is close: errors of one so coarse are in no proportion to it."""

POWER = 2 / 3
"""The ratio is at most this power of that of COARSEST to the tolerance: 1e4 at 1e-9, and 100 at 1e-6.

With larger ones, claims at crude tolerances were two digits too small; with smaller ones, time is lost.
"""

LEAST_RATIO = 10.0
"""The least ratio of the tolerances; a first solution too crude for it is compared with a finer one."""

MARGIN = 8.0
"""What the estimate is multiplied by: without, errors of 64 motions were up to seven times as large."""

PIECES = 32
"""The most pieces of the span. With each, steps begin small, which takes some more of them."""

STEPS = 64
"""The least steps of the first solution in a piece, so that the second one takes several there."""

ROUNDED = 0.85
"""The rounding errors of a step, in units of the rounding of its state. They add up as in a random walk."""

LOST = 0.1
"""A difference in units of the size of the state, or in rad, that is in no proportion to its cause."""

PATIENCE = 4
"""Pieces after which a difference must be small again: while bodies pass closely it is large for a moment."""

CLOSER = 1e-2
"""By what the difference and, up to the end of that piece, the tolerance are multiplied where it is large."""

ATTEMPTS = 3
"""How often a piece is tried, each time more closely, before all digits are given up."""


@dataclass(frozen=True, slots=True)
class _Pair:
    """How to `follow` a second solution, the `states` of the first at some `times`, and which times count.

    These are all that are `asked` for; the others are ends of pieces. `distance` is that of states.
    """

    follow: Callable[[Floats, tuple[float, float], float], Solution]
    distance: Callable[[Floats, Floats], Floats]
    times: Floats
    states: Floats
    asked: Mask

    def compared(self, ends: Floats, state: Floats, tolerance: float) -> tuple[int, Floats, float] | None:
        """How many pieces further both solutions are close, the second state there, the largest distance.

        The pieces have these `ends`, and `state` is that of the second solution at the first of them. None
        where the solutions are not close at one of the times, or at no end.
        """
        worst = 0.0
        for piece, span in enumerate(pairwise(ends.tolist()), 1):
            try:
                second = self.follow(state, span, tolerance)
            except ComputationError:
                return None
            inside = slice(*np.searchsorted(self.times, span, side="right"))
            states = second.at(self.times[inside])
            apart = self.distance(states, self.states[inside])
            worst, state = float(apart.max(initial=worst, where=self.asked[inside])), states[-1]
            if not worst <= LOST:
                return None
            if apart[-1] <= LOST:
                return piece, state, worst
        return None


def estimated_error(
    first: Solution,
    tolerance: float,
    follow: Callable[[Floats, tuple[float, float], float], Solution],
    distance: Callable[[Floats, Floats], Floats],
    times: Floats,
    stops: Floats,
    ratio: float,
    made: Floats | None = None,
) -> tuple[float, float | None]:
    """The largest error of a solution at some `times` (k), and where its last digit is lost, if it is.

    It has been integrated to a `tolerance`, from small steps at each of the `stops`. `follow` gives another
    solution from a state (n), over a span of time, to a tolerance that is larger by the `ratio` at most.
    `distance` tells how far states (k by n) are from those of the first solution. Beside the rounding of its
    state, each step has `made` errors (steps by n) that the other solution makes as well.
    """
    tolerance = max(tolerance, FINEST)
    ratio = min(ratio, (COARSEST / tolerance) ** POWER)
    other = ratio * tolerance
    if ratio < LEAST_RATIO:
        ratio, other = 1.0, tolerance * CLOSER
    pieces = min(PIECES, max(1, first.steps // STEPS))
    ends = np.union1d(first.knots[np.linspace(0, first.steps, pieces + 1).astype(int)], stops)
    begun = np.searchsorted(first.knots, ends)
    taken = np.diff(begun)
    seen = np.union1d(ends, times)
    pair, ours = _Pair(follow, distance, seen, first.at(seen), np.isin(seen, times)), first.at(ends)
    units = np.tile(ROUNDED * ROUNDING * np.sqrt(taken)[:, None], ours.shape[1])
    if made is not None:
        added = np.sqrt(np.add.reduceat(made**2, begun[:-1]))
        units = np.hypot(
            units, np.divide(added, np.abs(ours[1:]), out=np.zeros_like(added), where=ours[1:] != 0)
        )
    error, now, attempts, failed = 0.0, other, 1, 0
    before = piece, apart, unit = 0, np.zeros_like(ours[0]), np.full_like(ours[0], ROUNDING)
    while piece < len(taken):
        begin = _rounded(ours[piece] + apart, np.minimum(unit * ratio, LOST))
        found = pair.compared(ends[piece : piece + 1 + PATIENCE], begin, now)
        if found is None:
            if attempts == ATTEMPTS or ratio < ROUNDING:
                return 1.0, float(ends[piece + 1])
            attempts, failed = attempts + 1, piece
            # A large difference lies on a curve: it is made smaller where it was still small.
            piece, apart, unit = before
            apart, ratio, now = apart * CLOSER, ratio * CLOSER, now * CLOSER
            # The same tolerance as that of the first solution would only repeat it.
            now = now if now > LEAST_RATIO * tolerance else min(now, tolerance * CLOSER)
            before = piece, apart, unit
            continue
        if piece >= failed:
            now, attempts = other, 1
        before = piece, apart, unit
        count, state, off = found
        piece += count
        error = max(error, MARGIN * off / ratio)
        if error > LOST:
            return 1.0, float(ends[piece])
        apart, unit = state - ours[piece], units[piece - 1]
    return error, None


def _rounded(state: Floats, unit: Floats) -> Floats:
    """The state (n) in numbers of fewer digits, of relative units (n), each rounded to the farther neighbour.

    What needs no more digits stays as it is.
    """
    share, exponent = np.frexp(state)
    grain = 2.0 ** np.ceil(np.log2(unit) - 1)
    below = np.floor(share / grain)
    farther = below + (share / grain - below < 0.5)
    return np.where(below * grain == share, state, np.ldexp(farther * grain, exponent))
