"""The balances of energy and angular momentum along an integrated motion, as a check of the integration.

The work of the torque, the integral of N.omega, is the change of the kinetic energy, and the integral of N in
space is the change of L in space. Both integrals are done by Gauss-Legendre quadrature along the solution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Solution
from rigidcli.language import code
from rigidcli.language.tree import Node
from rigidcli.mechanics import rigid_body

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

_Torque: TypeAlias = Callable[[Floats, Floats], Floats]
"""The torque (n, 3) along the body's axes at times (n) and states (n, 7)."""

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


def balance_errors(
    torque: Sequence[Node], moments: Floats, solution: Solution, *, tolerance: float, timed: bool
) -> BalanceErrors:
    """The errors for a `torque` along the axes of the `moments` (3 trees in the names of `rigid_body.STATE`).

    The `solution` has been integrated to a `tolerance`; `timed` says that the torque depends on time. All is
    done in units of the largest L and omega, so that squares of tiny and huge numbers are within range.
    """
    states = solution.at(solution.knots)
    unit, rate = float(np.abs(states[:, 4:]).max()), float(np.abs(states[:, 4:] / moments).max())
    if not unit:
        return BalanceErrors({"energy": 0.0, "angular_momentum": 0.0}, np.empty((0, 2)))
    acting = _in_units(torque, unit)
    inertia = moments * (rate / unit)
    omega, momentum = states[:, 4:] / moments / rate, states[:, 4:] / unit
    panels = _panels(solution.knots, omega, rate, timed)
    sums = np.zeros((len(states), 4))
    np.add.at(sums, panels.step + 1, _gained(acting, inertia, unit, solution, panels))
    sums = np.cumsum(sums, axis=0)
    quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    energy = np.einsum("ij,ij->i", omega, momentum) / 2
    has = np.column_stack([energy, rotation.turned(quaternions, momentum)])
    largest = np.linalg.norm(has[:, 1:], axis=1).max()
    missing = (has - has[0] - sums) / [(energy + np.abs(sums[:, 0])).max(), *[largest] * 3]
    lost = np.linalg.norm(missing[:, 1:], axis=1).max()
    drift = {"energy": float(np.abs(missing[:, 0]).max()), "angular_momentum": float(lost)}
    blind = np.linalg.norm(np.diff(missing, axis=0), axis=1) > MISSED * tolerance
    return BalanceErrors(drift, _places(np.flatnonzero(blind), acting, panels, solution.knots, states))


def _in_units(torque: Sequence[Node], unit: float) -> _Torque:
    """The torque in a `unit`. Where it has no value it counts as zero, and the balance shows the error."""
    function = code.function(torque, rigid_body.STATE, {})(np)

    def acting(times: Floats, states: Floats) -> Floats:
        with np.errstate(all="ignore"):
            now = np.column_stack(np.broadcast_arrays(*function(times, *states.T))) / unit
        return np.nan_to_num(now, nan=0.0, posinf=0.0, neginf=0.0)

    return acting


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


def _gained(acting: _Torque, inertia: Floats, unit: float, solution: Solution, panels: _Panels) -> Floats:
    """Work, and impulse in space, of the torque in each panel (m by 4)."""
    gained = np.zeros((len(panels.step), 4))
    for first in range(0, len(gained), PANELS_AT_ONCE):
        block = slice(first, first + PANELS_AT_ONCE)
        width = panels.width[block, None]
        times = panels.left[block, None] + width * (1 + NODES) / 2
        states = solution.at(times.ravel())
        now = acting(times.ravel(), states)
        power = np.einsum("ij,ij->i", now, states[:, 4:] / unit / inertia)
        values = np.column_stack([power, rotation.turned(states[:, :4], now)])
        gained[block] = np.einsum("pn,pnk->pk", width / 2 * WEIGHTS, values.reshape(*times.shape, 4))
    return gained


def _places(
    blind: NDArray[np.int_], acting: _Torque, panels: _Panels, knots: Floats, states: Floats
) -> Floats:
    """Spans of time (k by 2) in the steps `blind` in which the torque changes most suddenly.

    It is looked at along the straight line from the state (m by 7) at one knot to the next: what is in
    between, the step does not know.
    """
    spans = []
    for step in blind[:MOST_PLACES]:
        mine = slice(*np.searchsorted(panels.step, [step, step + 1]))
        left, width = panels.left[mine], panels.width[mine]
        times = (left[:, None] + width[:, None] * (1 + NODES) / 2).ravel()
        share = ((times - knots[step]) / (knots[step + 1] - knots[step]))[:, None]
        now = acting(times, states[step] + share * (states[step + 1] - states[step]))
        impulse = np.einsum("n,pnk->pk", WEIGHTS, now.reshape(len(left), -1, 3))
        sudden = np.linalg.norm(np.diff(np.pad(impulse, ((1, 1), (0, 0)), "edge"), 2, axis=0), axis=1)
        ends = np.append(left[1:], knots[step + 1])
        spans += [(left[k], ends[k]) for k in np.flatnonzero(sudden >= SUDDEN * sudden.max())]
    return np.array(spans[:MOST_PLACES]).reshape(-1, 2)
