"""Heavy symmetric tops: numbers for them, and their motion by the equations in space."""

from __future__ import annotations

import math

import mpmath
import numpy as np
from hypothesis import strategies as st

from tests.core.rigid_motion import Motion, by_series

Start = tuple[float, float, float, float, float, float, float]
"""lambda1, lambda3, spin, tilt, phi-dot, theta-dot, M g R."""

MOMENTS = st.floats(0.05, 20)
WEIGHTS = st.sampled_from([0.0, 1.0, 9.80665]) | st.floats(0.01, 50)
SPINS = st.sampled_from([0.0, 1.0, -3.0, 1e3, -1e5]) | st.floats(-40, 40).map(lambda x: round(x, 6))
TILTS = st.sampled_from([0.1, 1e-6, math.pi / 2, 2.5, 3.1415]) | st.floats(0.01, 3.13)
RATES = st.sampled_from([0.0, 0.0, 0.3, -2.0]) | st.floats(-9, 9).map(lambda x: round(x, 6))


def moved(start: Start, time: float) -> list[float]:
    """theta, phi, phi-dot and theta-dot after `time`, from phi = 0, by the equations of motion."""
    lambda1, lambda3, spin, tilt, precession, rate, weight = start
    omega = [-precession * math.sin(tilt), rate, spin]
    orientation = [math.cos(tilt / 2), 0, math.sin(tilt / 2), 0]
    motion = Motion(np.diag([lambda1, lambda1, lambda3]), omega, orientation, weight=weight)
    (((w1, w2, _), attitude),) = by_series(motion, [time])
    with mpmath.workdps(30):
        x, y, _ = attitude[:, 2]
        z1, z2, z3 = attitude[2, :]
        across = mpmath.hypot(z1, z2)
        phi_dot, theta_dot = (w1 * z1 + w2 * z2) / across**2, (z2 * w1 - z1 * w2) / across
        found = mpmath.atan2(across, z3), mpmath.atan2(y, x), phi_dot, theta_dot
    return list(map(float, found))
