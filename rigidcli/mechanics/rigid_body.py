"""The equations of motion of a rigid body as expression trees, for whichever engine is to integrate them.

State: the quaternion q0..q3 from the body's axes to those of space, and the angular momentum L1..L3 along
the body's axes, about the point O. With omega_i = L_i / I_i along principal axes,

    q' = q (0, omega) / 2,        L' = L x omega + N.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.language.tree import Name, Node

STATE = ("t", "q0", "q1", "q2", "q3", "L1", "L2", "L3")  # the arguments of the equations


def equations(moments: Floats, torque: Sequence[Node]) -> list[Node]:
    """The derivatives of q0..q3, L1..L3 by time along principal axes.

    `moments` (3, kg m^2, positive) and `torque` (3 trees in the names of STATE) are along these axes.
    """
    scalar, *others = map(Name, STATE[1:])
    q, L = np.array(others[:3]), np.array(others[3:])
    half = 1 / (2 * moments) * L
    exact = [1 / Fraction(float(moment)) for moment in moments]
    # (L x omega)_1 = L2 L3 (1/I3 - 1/I2): the difference is rounded once, however near the moments are.
    gyroscopic = [float(exact[k] - exact[j]) * L[j] * L[k] for j, k in ((1, 2), (2, 0), (0, 1))]
    forced = [own + driven for own, driven in zip(gyroscopic, torque, strict=True)]
    return [-(q @ half), *(half * scalar + np.cross(q, half)), *forced]
