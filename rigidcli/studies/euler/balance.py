"""The balances of energy and angular momentum along an integrated motion, as a check of the integration.

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
"""Nodes and weights of the Gauss-Legendre quadrature in a panel; it is exact to the degree 11."""

PANEL = 0.8
"""Largest angle (rad) by which the body turns in a panel, so that the torque varies little in it."""

FINE = 20_000
"""Least number of panels for a torque that depends on time, as it may act for a short while only."""

PANELS_AT_ONCE = 10_000
"""Panels that are evaluated together, which bounds the memory that a long motion takes."""

MISSED = 100
"""A step whose balance is off by more than this, in units of the tolerance, has gone over a torque."""

SUDDEN = 0.01
"""Steps are repeated where the torque changes by more than this, in units of its most sudden change."""

MOST_PLACES = 500
"""Largest number of spans of time that are repeated, which bounds the time that a rough torque takes."""


@dataclass(frozen=True, slots=True, eq=False)
class BalanceErrors:
    """By how much the balances of energy and angular momentum are violated at the ends of the steps.

    `drift` is the largest error of each, in units of the largest energy and angular momentum. `missed`
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
    """The largest components of angular momentum and omega: units in which no square is out of range."""

    momentum: float
    omega: float


def balance_errors(
    torque: Sequence[Node], moments: Floats, solution: Solution, *, tolerance: float, timed: bool
) -> BalanceErrors:
    """The errors for a `torque` along the axes of the `moments` (3 trees in the names of `rigid_body.STATE`).

    The `solution` has been integrated to a `tolerance`; `timed` says that the torque depends on time.
    """
    states = solution.at(solution.knots)
    scale = _Scale(float(np.abs(states[:, 4:]).max()), float(np.abs(states[:, 4:] / moments).max()))
    if not scale.momentum:
        return BalanceErrors({"energy": 0.0, "angular_momentum": 0.0}, np.empty((0, 2)))
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
    return BalanceErrors(drift, _places(blind, torque, panels, solution.knots, states, scale))


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
        # A torque without a value beside the solution counts as zero, and its balance shows the error.
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
        spans += [(left[k], ends[k]) for k in np.flatnonzero(sudden >= SUDDEN * sudden.max())]
    return np.array(spans[:MOST_PLACES]).reshape(-1, 2)
