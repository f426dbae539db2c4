"""The equations of motion of a rigid body as expression trees, for whichever engine is to integrate them.

State: the quaternion q0..q3 from the body's axes to those of space, and the angular momentum L1..L3 along
the body's axes, about the point O. With omega_i = L_i / I_i along principal axes,

    q' = q (0, omega) / 2,        L' = L x omega + N.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.core.arithmetic import Floats
from rigidcli.symbolic.language.tree import ZERO, Name, Node, minus, number, plus, times

STATE = ("t", "q0", "q1", "q2", "q3", "L1", "L2", "L3")
"""The arguments of the equations."""

Vector: TypeAlias = Sequence[Node]


def equations(moments: Floats, torque: Vector) -> list[Node]:
    """The derivatives of q0..q3, L1..L3 by time along principal axes.

    `moments` (3, kg m^2, positive) and `torque` (3 trees in the names of STATE) are along these axes.
    """
    q, L = [Name(name) for name in STATE[1:5]], [Name(name) for name in STATE[5:]]
    half = [times(number(1 / (2 * moment)), part) for moment, part in zip(moments, L, strict=True)]
    exact = [1 / Fraction(float(moment)) for moment in moments]
    # (L x omega)_1 = L2 L3 (1/I3 - 1/I2): the difference is rounded once, however near the moments are.
    gyroscopic = [times(number(float(exact[k] - exact[j])), L[j], L[k]) for j, k in ((1, 2), (2, 0), (0, 1))]
    forced = [plus(own, driven) for own, driven in zip(gyroscopic, torque, strict=True)]
    return [*compose(q, (ZERO, *half)), *forced]


def scaled(matrix: Floats, vector: Vector) -> list[Node]:
    """The product of a matrix of numbers (n by m) and a vector of trees (m)."""
    return [
        plus(*(times(number(entry), part) for entry, part in zip(row, vector, strict=True))) for row in matrix
    ]


def cross(a: Vector, b: Vector) -> list[Node]:
    """The vector product."""
    return [plus(times(a[j], b[k]), minus(times(a[k], b[j]))) for j, k in ((1, 2), (2, 0), (0, 1))]


def compose(p: Vector, q: Vector) -> list[Node]:
    """The quaternion product p q."""
    scalar = plus(times(p[0], q[0]), *(minus(times(p[k], q[k])) for k in (1, 2, 3)))
    turned = cross(p[1:], q[1:])
    return [
        scalar,
        *(plus(times(p[0], q[k]), times(p[k], q[0]), turned[k - 1]) for k in (1, 2, 3)),
    ]


def rotated(q: Vector, v: Vector, *, back: bool = False) -> list[Node]:
    """The vector v turned by the unit quaternion q, body to space; `back`, from space to body.

    v + 2 q0 (q x v) + 2 q x (q x v), whose length is right to first order in the length of q.
    """
    around = [minus(part) for part in q[1:]] if back else list(q[1:])
    first = [times(number(2.0), part) for part in cross(around, v)]
    second = cross(around, first)
    return [plus(own, times(q[0], once), twice) for own, once, twice in zip(v, first, second, strict=True)]
