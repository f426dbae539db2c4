"""Euler's equations by scipy: an integration that shares no code with the program's."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigidcli.core import rotation

Floats: TypeAlias = NDArray[np.float64]

Torque: TypeAlias = Callable[[float, Floats, Floats], Floats]
"""A torque along the body's axes, from t, the quaternion from body to space, and omega in the body."""


def integrated(
    tensor: Floats, omega: Floats, times: Floats, torque: Torque | None = None
) -> tuple[Floats, Floats]:
    """omega (n, 3) along the body's axes and quaternions (n, 4), integrated in omega and not in L."""
    inverse = np.linalg.inv(tensor)

    def rate(t: float, y: Floats) -> Floats:
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        (a, b, c, d), (w1, w2, w3), (l1, l2, l3) = q.tolist(), w.tolist(), (tensor @ w).tolist()
        turning = [
            -(b * w1 + c * w2 + d * w3) / 2,
            (a * w1 + c * w3 - d * w2) / 2,
            (a * w2 + d * w1 - b * w3) / 2,
            (a * w3 + b * w2 - c * w1) / 2,
        ]
        acting = np.array([w3 * l2 - w2 * l3, w1 * l3 - w3 * l1, w2 * l1 - w1 * l2])
        if torque is not None:
            acting += torque(t, q, w)
        return np.array([*turning, *(inverse @ acting)])

    start = np.concatenate([[1.0, 0, 0, 0], omega])
    slack = 1e-13 * np.concatenate([np.ones(4), np.full(3, np.linalg.norm(omega))])
    solved = solve_ivp(rate, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=slack)
    assert solved.success
    return solved.y[4:].T, solved.y[:4].T


def same_turn(q: Floats, p: Floats) -> float:
    """The largest angle between orientations (rad)."""
    return float(2 * np.linalg.norm(rotation.compose(q * [1, -1, -1, -1], p)[:, 1:], axis=1).max())
