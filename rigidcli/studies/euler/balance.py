"""The balances of energy and angular momentum along an integrated motion, as a check of the integration.

The work of the torque, the integral of N.omega, is the change of the kinetic energy, and the integral of N in
space is the change of L in space. Both integrals are done by Gauss-Legendre quadrature in the steps.
"""

from __future__ import annotations

import numpy as np

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import Flow, Solution

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Nodes and weights of the quadrature in a step; it is exact to the degree 11, beyond that of the method."""


def drift_of_balances(torque: Flow, moments: Floats, solution: Solution) -> dict[str, float]:
    """The largest errors of the balances at the ends of steps, in units of the largest energy and |L|.

    The `torque` is along the axes of the `moments` (3, kg m^2), as a flow of time and state. All is done in
    units of the largest L and omega, so that squares of tiny and huge numbers are within range.
    """
    states, steps = solution.at(solution.knots), np.diff(solution.knots)
    unit, rate = float(np.abs(states[:, 4:]).max()), float(np.abs(states[:, 4:] / moments).max())
    if not unit:
        return {"energy": 0.0, "angular_momentum": 0.0}
    acting, gained = torque(np), np.zeros((len(steps), 4))
    with np.errstate(all="ignore"):
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            times = solution.knots[:-1] + steps * (1 + node) / 2
            there = solution.at(times)
            now = np.column_stack(np.broadcast_arrays(*acting(times, *there.T))) / unit
            power = np.einsum("ij,ij->i", now, there[:, 4:] / moments / rate)
            gained += (
                weight / 2 * steps[:, None] * np.column_stack([power, rotation.turned(there[:, :4], now)])
            )
    sums = np.vstack([np.zeros(4), np.cumsum(gained, axis=0)])
    quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    momentum = states[:, 4:] / unit
    energy = np.einsum("ij,ij->i", states[:, 4:] / moments / rate, momentum) / 2
    has = np.column_stack([energy, rotation.turned(quaternions, momentum)])
    missing = np.nan_to_num(has - has[0] - sums, nan=1.0)
    largest = np.linalg.norm(has[:, 1:], axis=1).max()
    return {
        "energy": float(np.abs(missing[:, 0]).max() / (energy + np.abs(sums[:, 0])).max()),
        "angular_momentum": float(np.linalg.norm(missing[:, 1:], axis=1).max() / largest),
    }
