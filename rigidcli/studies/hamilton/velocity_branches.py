"""The velocities that have given momenta, by numbers: where no closed form of them is known.

Where the mass matrix M = dp/dv is regular, p(v) can be inverted; where M is singular, branches meet. One
velocity has intervals between the zeros of M. On each of them p(v) is monotonic, so that all velocities
with given momenta are found. Several velocities are sought by Newton's method, from rest and from random
points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ComputationError
from rigidcli.language import code
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.studies.hamilton.derivation import Derivation

SPEEDS = np.geomspace(1e-9, 1e9, 3601)
"""The speeds at which it is looked for changes of the sign of M: two hundred in each factor of ten."""

MOST_INTERVALS = 64
"""The most changes of the sign of M that are followed up, beginning with the smallest speeds."""

NEAR, GROWTH = 1e-6, 1.01
"""A momentum that grows by this factor over the last such part of an interval has no limit at its end."""

STARTS = 40
"""Random velocities from which Newton's method sets out, besides rest."""

SAME = 1e-6
"""Two solutions are one if they differ by less than this, in units of their size."""

VANISHING = 1e-2
"""A determinant of M below this, in units of its largest along an orbit that ends, is about to be zero."""

MOST_HALVINGS = 5_000
"""The most steps to one velocity: intervals may have to be halved down to the smallest float."""

OVERFLOW = 1e100
"""Momenta beyond this, a millionth beside an end, belong to no pole: floats end there."""

ENDLESS = 1e12
"""Ends of intervals beyond this are where floats end, as of exp(v^2), and not where the branch does."""

NO_VALUE = 2.0
"""What stands for the sign of M where it has no value."""

_Momenta: TypeAlias = Callable[[Floats], tuple[Floats, Floats]]
"""The momenta (n by k) and mass matrices (k by n by n) of velocities (n by k)."""


@dataclass(frozen=True, slots=True)
class Interval:
    """Velocities from `low` to `high`, on which p(v) is monotonic, and the momenta at these two ends."""

    low: float
    high: float
    momentum_low: float
    momentum_high: float

    def velocities(self, name: str) -> str:
        """The interval in words."""
        return _between(self.low, self.high, name)

    def momenta(self, name: str) -> str:
        """The momenta of these velocities in words."""
        ends = self.momentum_low, self.momentum_high
        return _between(min(ends), max(ends), name)


def _between(low: float, high: float, name: str) -> str:
    low, high = (end if abs(end) < ENDLESS else math.copysign(math.inf, end) for end in (low, high))
    if math.isfinite(low) and not math.isfinite(high):
        return f"{name} > {low:.6g}"
    above = f" < {high:.6g}" if math.isfinite(high) else ""
    if math.isfinite(low):
        return f"{low:.6g} < {name}{above}"
    return f"{name}{above}" if above else f"any {name}"


def intervals(derivation: Derivation, known: Mapping[str, float]) -> list[Interval]:
    """The branches of one velocity, ascending; all other names have `known` values."""
    momenta = _momenta(derivation, known)

    def signs(v: Floats) -> Floats:
        p, masses = momenta(v[None])
        return np.where(np.isfinite(p[0]) & np.isfinite(masses[:, 0, 0]), np.sign(masses[:, 0, 0]), NO_VALUE)

    speeds = np.concatenate([-SPEEDS[::-1], [0.0], SPEEDS])
    kinds = signs(speeds)
    # Where M touches zero only, as that of v^4 does, or is lost in rounding at large speeds, no branch ends.
    touching = 1 + np.flatnonzero((kinds[1:-1] == 0) & (kinds[:-2] == kinds[2:]))
    kinds[touching] = kinds[touching - 1]
    regular = np.flatnonzero(kinds)
    if not regular.size:
        return []
    kinds[: regular[0]], kinds[regular[-1] :] = kinds[regular[0]], kinds[regular[-1]]
    changes = np.flatnonzero(kinds[1:] != kinds[:-1])
    is_cut = len(changes) > MOST_INTERVALS
    nearest = np.sort(changes[np.argsort(np.abs(speeds[changes]), kind="stable")][:MOST_INTERVALS])
    found, low = [], -math.inf
    for place in [*map(int, nearest), len(speeds) - 1]:
        high, following = (math.inf, 0.0)
        if place < len(speeds) - 1:
            high, following = _edge(signs, speeds, kinds, place)
        if abs(kinds[place]) == 1:
            sides = [(_endless(momenta, v, inwards), inwards) for v, inwards in ((low, 1), (high, -1))]
            ends = [_momentum(momenta, v, inwards) for v, inwards in sides]
            found.append(Interval(sides[0][0], sides[1][0], *ends))
        low = following
    return found[1:-1] if is_cut else found


def _edge(
    signs: Callable[[Floats], Floats], speeds: Floats, kinds: Floats, place: int
) -> tuple[float, float]:
    """The last velocity of one kind and the first of the next, behind a place among speeds."""
    low, high = speeds[place : place + 2]
    if 0 in kinds[place : place + 2]:
        return (low, low) if kinds[place] == 0 else (high, high)
    while (middle := (low + high) / 2) not in (low, high):
        if signs(np.array([middle]))[0] == kinds[place]:
            low = middle
        else:
            high = middle
    return float(low), float(high)


def _endless(momenta: _Momenta, end: float, inwards: int) -> float:
    """An end of an interval; infinite where it is only that of floats, as momenta are as large beside it."""
    if not math.isfinite(end):
        return end
    beside = momenta(np.array([[end + inwards * NEAR * (abs(end) or 1.0)]]))[0][0, 0]
    return -inwards * math.inf if abs(beside) > OVERFLOW else end


def _momentum(momenta: _Momenta, end: float, inwards: int) -> float:
    """The momentum at an end of an interval; infinite where it grows without bound."""
    if math.isfinite(end):
        near, v = end + inwards * NEAR * (abs(end) or 1.0), end
    else:
        near, v = -inwards * SPEEDS[-1] / 10, -inwards * SPEEDS[-1]
    before, at = momenta(np.array([[near, v]]))[0][0]
    if not math.isfinite(end) and abs(at) < abs(before) / 2:
        return 0.0
    grows = not math.isfinite(at) or abs(at) / GROWTH > abs(before)
    return math.copysign(math.inf, at if not math.isnan(at) else before) if grows else float(at)


def velocities(derivation: Derivation, known: Mapping[str, float], p: Floats) -> list[Floats]:
    """Velocities (n each) with the momenta p (n): all for one velocity, for several as many as are found."""
    momenta = _momenta(derivation, known)
    return _of_one(derivation, known, momenta, p[0]) if len(p) == 1 else _of_several(momenta, p)


def require_regular(
    derivation: Derivation, parameters: Mapping[str, float], times: Floats, q: Floats, v: Floats, least: float
) -> None:
    """Raise ComputationError if M becomes singular along q and v (k by n) at times (k).

    That is where its determinant changes its sign, or ends below `least`, in units of its largest.
    """
    assert derivation.momenta is not None
    entries = [to_tree(e) for row in derivation.momenta.mass_matrix for e in row]
    names = (TIME, *derivation.phase.coordinates, *derivation.velocity_names)
    f = code.function(entries, names, {name: value for name, value in parameters.items() if name != TIME})(np)
    with np.errstate(all="ignore"):
        rows = [np.broadcast_to(row, times.shape) for row in f(times, *q.T, *v.T)]
        sizes = np.linalg.det(np.array(rows).T.reshape(len(times), v.shape[1], -1))
    sizes *= np.sign(sizes[0]) or 1.0
    if sizes.min() < 0 < sizes.max() or abs(sizes[-1]) < least * np.abs(sizes).max():
        place = int(np.argmax(sizes < 0)) or len(times) - 1
        rates = zip(derivation.velocity_names, v[place], strict=True)
        there = ", ".join(f"{name} = {value:.6g}" for name, value in rates)
        raise ComputationError(
            f"the mass matrix becomes singular at t = {times[place]:.6g}, where {there}: "
            "this branch of the velocities ends there",
            hint="take a shorter span",
        )


def _of_one(derivation: Derivation, known: Mapping[str, float], momenta: _Momenta, p: float) -> list[Floats]:
    from scipy.optimize import brentq

    def miss(v: float) -> float:
        return float(momenta(np.array([[v]]))[0][0, 0]) - p

    found = []
    for interval in intervals(derivation, known):
        low, high = np.clip((interval.low, interval.high), -SPEEDS[-1], SPEEDS[-1])
        at_low, at_high = miss(low), miss(high)
        if np.isfinite([at_low, at_high]).all() and np.sign(at_low) * np.sign(at_high) <= 0:
            tiny = np.finfo(np.float64).tiny
            v = brentq(miss, low, high, xtol=tiny, rtol=1e-15, maxiter=MOST_HALVINGS)
            # Where |v| has a kink, the momentum jumps over values that no velocity has.
            if abs(miss(v)) <= SAME * max(abs(p), abs(miss(v) + p)):
                found.append(np.array([v]))
    return found


def _of_several(momenta: _Momenta, p: Floats) -> list[Floats]:
    from scipy.optimize import root

    def miss(v: Floats) -> tuple[Floats, Floats]:
        found, masses = momenta(v[:, None])
        return found[:, 0] - p, masses[0]

    chance = np.random.default_rng(1)
    starts = [np.zeros(len(p))]
    starts += [chance.normal(size=len(p)) * 10 ** chance.uniform(-3, 3) for _ in range(STARTS)]
    found: list[Floats] = []
    for start in starts:
        with np.errstate(all="ignore"):
            solution = root(miss, start, jac=True, tol=1e-14)
        v, (miss_there, mass) = solution.x, miss(solution.x)
        with suppress(np.linalg.LinAlgError):
            # At large velocities momenta may come close to values, to all digits, that they never have.
            scale, blur = np.abs(v).max() or 1.0, np.abs(miss_there) + np.finfo(np.float64).eps * np.abs(p)
            is_near = (np.abs(np.linalg.inv(mass)) @ blur).max() <= NEAR * scale
            if is_near and all(np.abs(v - known).max() > SAME * scale for known in found):
                found.append(v)
    return found


def _momenta(derivation: Derivation, known: Mapping[str, float]) -> _Momenta:
    assert derivation.momenta is not None
    names = derivation.velocity_names
    entries = [*derivation.momenta.definitions, *(e for row in derivation.momenta.mass_matrix for e in row)]
    constants = {name: value for name, value in known.items() if name not in names}
    f = code.function([to_tree(e) for e in entries], names, constants)(np)
    size = len(names)

    def momenta(v: Floats) -> tuple[Floats, Floats]:
        with np.errstate(all="ignore"):
            rows = np.array([np.broadcast_to(row, v.shape[1:]) for row in f(*v)], dtype=np.float64)
        return rows[:size], np.moveaxis(rows[size:].reshape(size, size, -1), 2, 0)

    return momenta
