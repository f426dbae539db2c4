"""What a torque does to a body, added up along a motion that was integrated, and held against the laws.

The work of the torque, the integral of N.omega, is the change of the kinetic energy, and the integral of N in
space is the change of L in space. Both integrals are done by Gauss-Legendre quadrature along the solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.core.solution import Solution
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.tree import Node
from rigidcli.symbolic.mechanics import rigid_body

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
PANEL = 0.8
"""Largest angle (rad) that the body turns by in a panel of the quadrature of its torque."""

FINE = 20_000
"""Panels, at least, for a torque that depends on time, which may act for a short while only."""

PANELS_AT_ONCE = 10_000

MISSED = 100
"""A step that misses a balance by more than this, in units of the tolerance, has not seen the torque."""

PLACED = 0.01
"""Where the torque is more sudden than this, in units of the most sudden place, it is to be done again."""

MOST_PLACES = 500
"""Of which there are that many at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Ledger:
    """By how much the balances of energy and angular momentum are missed at the ends of the steps.

    `drift` is the largest miss of each, in units of the largest energy and angular momentum. `missed`
    are spans of time (k by 2, s) in which the solution does not follow the torque, in order.
    """

    drift: dict[str, float]
    missed: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Panels:
    """The panels of the quadrature: the index of the step of each, its beginning and its width (m)."""

    step: NDArray[np.int_]
    left: Floats
    width: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Scale:
    """The largest components of angular momentum and omega: squares of the tiny and the huge need units."""

    momentum: float
    omega: float


def ledger(
    torque: Sequence[Node], moments: Floats, solution: Solution, *, tolerance: float, timed: bool
) -> Ledger:
    """The ledger of a `torque` (3 trees in the names of `rigid_body.STATE`), along the axes of the `moments`.

    The `solution` has been integrated to a `tolerance`; `timed` says that the torque depends on time.
    """
    states = solution.at(solution.knots)
    scale = _Scale(float(np.abs(states[:, 4:]).max()), float(np.abs(states[:, 4:] / moments).max()))
    if not scale.momentum:
        return Ledger({"energy": 0.0, "angular_momentum": 0.0}, np.empty((0, 2)))
    panels = _panels(solution.knots, states[:, 4:] / moments / scale.omega, scale.omega, timed)
    gained = _gained(torque, moments, solution, panels, scale)
    sums = np.zeros((len(states), 4))
    np.add.at(sums, panels.step + 1, gained)
    sums = np.cumsum(sums, axis=0)
    has = _has(states, moments, scale)
    energy = has[:, 0] + np.abs(sums[:, 0])
    sizes = np.array([energy.max(), *np.repeat(np.linalg.norm(has[:, 1:], axis=1).max(), 3)])
    missing = (has - has[0] - sums) / sizes
    drift = {"energy": float(np.abs(missing[:, 0]).max()), "angular_momentum": _largest(missing[:, 1:])}
    blind = np.linalg.norm(np.diff(missing, axis=0), axis=1) > MISSED * tolerance
    return Ledger(drift, _places(blind, torque, panels, solution.knots, states, scale))


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _has(states: Floats, moments: Floats, scale: _Scale) -> Floats:
    """Kinetic energy, and angular momentum in space, of each of the states (m by 4), in units of `scale`."""
    lengths = np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    momentum = states[:, 4:] / scale.momentum
    omega = states[:, 4:] / moments / scale.omega
    energy = np.einsum("ij,ij->i", omega, momentum) / 2
    return np.column_stack([energy, rotation.turned(states[:, :4] / lengths, momentum)])


def _panels(knots: Floats, omega: Floats, rate: float, timed: bool) -> _Panels:
    """Every step in so many equal parts; `omega` (m by 3) is that at the knots, in units of `rate`."""
    rates = np.linalg.norm(omega, axis=1)
    steps = np.diff(knots)
    parts = np.ceil(np.maximum(rates[:-1], rates[1:]) * (rate * steps) / PANEL)
    if timed:
        parts = np.maximum(parts, np.ceil(FINE * (steps / (knots[-1] - knots[0]))))
    parts = np.maximum(1, parts).astype(int)
    step = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(step)) - np.repeat(np.cumsum(parts) - parts, parts)
    width = (steps / parts)[step]
    return _Panels(step, knots[step] + place * width, width)


def _gained(
    torque: Sequence[Node], moments: Floats, solution: Solution, panels: _Panels, scale: _Scale
) -> Floats:
    """Work, and impulse in space, of the torque in each panel (m by 4), in units of `scale`."""
    acting = code.function(torque, rigid_body.STATE, {})(np)
    gained = np.zeros((len(panels.step), 4))
    for first in range(0, len(gained), PANELS_AT_ONCE):
        block = slice(first, first + PANELS_AT_ONCE)
        width = panels.width[block, None]
        times = panels.left[block, None] + width * (1 + NODES) / 2
        states = solution.at(times.ravel())
        with np.errstate(all="ignore"):
            now = np.column_stack(np.broadcast_arrays(*acting(times.ravel(), *states.T))) / scale.momentum
        # Where the torque has no value beside the solution, what is missing for it will show.
        now = np.nan_to_num(now, nan=0.0, posinf=0.0, neginf=0.0)
        power = np.einsum("ij,ij->i", now, states[:, 4:] / moments / scale.omega)
        values = np.column_stack([power, rotation.turned(states[:, :4], now)])
        gained[block] = np.einsum("pn,pnk->pk", width / 2 * WEIGHTS, values.reshape(*times.shape, 4))
    return gained


def _places(
    blind: Mask,
    torque: Sequence[Node],
    panels: _Panels,
    knots: Floats,
    states: Floats,
    scale: _Scale,
) -> Floats:
    """Spans of time (k by 2) in `blind` steps in which the torque changes most suddenly.

    It is looked at along the straight way from the state (m by 7) at one knot to the next: what is in
    between, the step does not know.
    """
    acting = code.function(torque, rigid_body.STATE, {})(np)
    spans = []
    for step in np.flatnonzero(blind)[:MOST_PLACES]:
        mine = slice(*np.searchsorted(panels.step, [step, step + 1]))
        left, width = panels.left[mine], panels.width[mine]
        times = (left[:, None] + width[:, None] * (1 + NODES) / 2).ravel()
        share = ((times - knots[step]) / (knots[step + 1] - knots[step]))[:, None]
        way = states[step] + share * (states[step + 1] - states[step])
        with np.errstate(all="ignore"):
            now = np.column_stack(np.broadcast_arrays(*acting(times, *way.T))) / scale.momentum
        impulse = np.einsum("n,pnk->pk", WEIGHTS, np.nan_to_num(now).reshape(len(left), -1, 3))
        sudden = np.linalg.norm(np.diff(np.pad(impulse, ((1, 1), (0, 0)), "edge"), 2, axis=0), axis=1)
        ends = np.append(left[1:], knots[step + 1])
        spans += [(left[k], ends[k]) for k in np.flatnonzero(sudden >= PLACED * sudden.max())]
    return np.array(spans[:MOST_PLACES]).reshape(-1, 2)
