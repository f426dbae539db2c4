"""Motion to and fro in one degree of freedom: its turning points, period and action, by quadrature.

Where H(q, p) = a(q) p^2 + b(q) p + c(q) keeps the value E, with D = b^2 - 4 a (c - E),

    qdot = 2 a p + b = +-sqrt(D),        p = (-b +- sqrt(D))/(2 a),

so that q turns where D vanishes, and between two such points q1 < q2

    T = 2 integral dq/sqrt(D),           J = integral of p dq over a period = integral sqrt(D)/a dq.

With q = (q1 + q2)/2 + (q2 - q1)/2 sin s both integrands are smooth and periodic in s, and the midpoint rule
converges geometrically. Sources: L. Landau, E. Lifshitz, Mechanics, section 11; L. N. Trefethen,
J. A. C. Weideman, SIAM Review 56 (2014) 385.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.events import valleys

# D, a, and the sum of the sizes of the terms of D, at coordinates (k).
Discriminant = Callable[[Floats], tuple[Floats, Floats, Floats]]
STRETCH_GROWTH = 1.3  # Ratio of the lengths of neighbouring stretches in which a turning point is sought.
# Coordinates in each stretch at which D is evaluated; near its minima there are more.
LOOKS_IN_A_STRETCH = 64
# Where they stand in it: also very near to its beginning, as a start may be at the top of a barrier.
SHARES = np.concatenate([[0.0], 2.0 ** np.arange(-40, -6), np.arange(1, LOOKS_IN_A_STRETCH + 2) / 64])
# Stretches on each side of the start; without a turning point in them q counts as unbounded.
MOST_STRETCHES = 200
MOST_NODES = 1 << 16  # The most nodes of the rule; a motion near a separatrix needs many.
# Relative change between a rule and that with twice the nodes, below which the integrals have converged.
CONVERGED = 1e-12
# The largest relative error of a period that is reported: near a separatrix six digits are left.
LARGEST_ERROR_TOLD = 1e-6
# Below this share of its largest value, D passes zero; a larger last value is beside a pole.
SHARE_AT_A_ZERO = 1e-8
# D is zero but for rounding below this share of its terms, as beside a start at rest.
ROUNDING_OF_ZERO = 16 * EPS


class Libration(NamedTuple):
    """The turning points (2), the period (s), and the action over a period, with their relative error."""

    turning_points: tuple[float, float]
    period: float
    action: float
    error: float


def libration(function: Discriminant, start: float, size: float) -> Libration | None:
    """The motion to and fro through a coordinate `start`; `size` is a length on which D may change.

    None where q does not turn on both sides, or the integrals do not converge.
    """
    with np.errstate(all="ignore"):
        first, last = (_turning_point(function, start, side * size) for side in (-1.0, 1.0))
        return None if first is None or last is None or first >= last else _between(function, first, last)


def _between(function: Discriminant, first: float, last: float) -> Libration | None:
    before, nodes, change, rounding = (math.inf, math.inf), 16, math.inf, 0.0
    while change > max(CONVERGED, rounding) and nodes <= MOST_NODES:
        period, action, rounding = _integrals(function, first, last, nodes)
        change = max(abs(before[0] / period - 1), abs(before[1] / action - 1))
        before, nodes = (period, action), 2 * nodes
    error = change + rounding
    return Libration((first, last), period, action, error) if error < LARGEST_ERROR_TOLD else None


def _turning_point(function: Discriminant, start: float, step: float) -> float | None:
    """The place nearest to the start, on one side, behind which D is negative; None if none is found.

    A start at which D vanishes is one itself if D is negative beyond it.
    """
    near, reach, largest = start, step, 0.0

    def discriminant(places: Floats) -> Floats:
        return function(places.ravel())[0].reshape(places.shape)

    for _ in range(MOST_STRETCHES):
        # The last two places are the first of the next stretch.
        places = near + reach * SHARES
        # A low barrier is narrow at its top.
        _, tops, _ = valleys(discriminant, places, discriminant(places), np.ones(len(places)))
        places = np.sort(np.concatenate([places, tops]))[:: 1 if step > 0 else -1][1:]
        values, _, sizes = function(places)
        known = ~(np.abs(values) <= ROUNDING_OF_ZERO * sizes)
        places, values = places[known], values[known]
        beyond = np.flatnonzero(~(values > 0) | np.isinf(values))
        if len(beyond):
            inside = places[beyond[0] - 1] if beyond[0] else near
            largest = max(largest, values[: beyond[0]].max(initial=0.0))
            return _narrowed(function, float(inside), float(places[beyond[0]]), largest)
        near, reach, largest = near + reach, reach * STRETCH_GROWTH, values.max(initial=largest)
        if not math.isfinite(near + reach):
            return None
    return None


def _narrowed(function: Discriminant, inside: float, outside: float, largest: float) -> float | None:
    """The end of the interval of positive D; None where D ends there without passing zero, as at a pole."""
    begin = inside
    while (middle := (inside + outside) / 2) not in (inside, outside):
        value = function(np.array([middle]))[0][0]
        if 0 < value < math.inf:
            inside, largest = middle, max(largest, value)
        else:
            outside = middle
    last, _, size = (float(each[0]) for each in function(np.array([inside])))
    is_zero = last <= max(SHARE_AT_A_ZERO * largest, ROUNDING_OF_ZERO * size)
    return inside if inside == begin or is_zero else None


def _integrals(function: Discriminant, first: float, last: float, nodes: int) -> tuple[float, float, float]:
    """The period and the action by the midpoint rule in s, and the relative error of T by rounding of D."""
    s = (np.arange(nodes) + 0.5) * math.pi / nodes - math.pi / 2
    half = (last - first) / 2
    # From the nearer end, so that no digits cancel: 1 -+ sin s = 2 sin^2((pi/2 -+ s)/2).
    below, above = (2 * half * np.sin((math.pi / 2 + side * s) / 2) ** 2 for side in (1, -1))
    places = np.where(below < above, first + below, last - above)
    values, curvature, sizes = function(places)
    rates, slopes = np.sqrt(values), half * np.cos(s)
    parts = slopes / rates
    rounding = EPS * (parts * sizes / (2 * values)).sum() / parts.sum()
    period, action = 2 * math.pi / nodes * parts.sum(), math.pi / nodes * (slopes * rates / curvature).sum()
    return float(period), abs(float(action)), float(rounding)
