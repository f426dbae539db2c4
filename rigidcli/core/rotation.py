"""Rotation matrices, and unit quaternions (scalar first) many at a time.

All rotations are active: r -> R r turns the body, the axes stay.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Decimal
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS, Arithmetic, Array, Floats, Scalar
from rigidcli.errors import ValueProblem


def direction(vector: Sequence[Scalar], arithmetic: Arithmetic) -> Array:
    """The unit vector along `vector` (3). Raises ValueProblem for the zero vector."""
    length = arithmetic.hypot(*vector)
    if length == 0:
        raise ValueProblem("read the zero vector, expected a direction")
    return arithmetic.array([component / length for component in vector])


def from_axis_angle(axis: Sequence[Scalar], angle: Scalar, arithmetic: Arithmetic) -> Array:
    """Turn by `angle` (rad, right-handed) about `axis` (3, any length): Rodrigues' formula."""
    x, y, z = n = direction(axis, arithmetic)
    cross, identity = arithmetic.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.eye(3, dtype=int)
    # 1 - cos keeps its digits for small angles as 2 sin^2 of half the angle.
    versine = 1 - arithmetic.cos(angle) if arithmetic.exact else 2 * arithmetic.sin(angle / 2) ** 2
    return identity + arithmetic.sin(angle) * cross + versine * (np.outer(n, n) - identity)


def from_euler(angles: Sequence[Scalar], sequence: str, arithmetic: Arithmetic) -> Array:
    """Intrinsic turns by `angles` (3, rad) about the body's axes named in `sequence`, such as `zxz`.

    R = R_first(angle 1) R_second(angle 2) R_third(angle 3), body to space.
    """
    rotation = arithmetic.array(np.eye(3, dtype=int))
    for name, angle in zip(sequence, angles, strict=True):
        rotation = rotation @ from_axis_angle(np.eye(3, dtype=int)["xyz".index(name)], angle, arithmetic)
    return rotation


def from_quaternion(quaternion: Sequence[Scalar], arithmetic: Arithmetic) -> Array:
    """The turn of a quaternion (w, x, y, z) of any length but zero, body to space."""
    largest = max(quaternion, key=lambda component: abs(arithmetic.size(component)))
    if largest == 0:
        raise ValueProblem("read the zero quaternion, expected a rotation")
    w, x, y, z = (component / largest for component in quaternion)
    square = w * w + x * x + y * y + z * z
    doubled = arithmetic.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    return doubled / square


def from_matrix(rows: Sequence[Sequence[Scalar]], arithmetic: Arithmetic) -> tuple[Array, float]:
    """The rotation that `rows` (3 by 3) stand for, and the largest entry of R^T R - 1 as they were typed.

    Floats may be off by half a unit in the last digit that was typed, of three digits at least, or by 1e-9.
    The nearest rotation is taken: U V^T of the singular value decomposition (N. Higham, Functions of
    Matrices, section 8.1). Raises ValueProblem for anything else, reflections included. Exact entries must
    be exactly a rotation.
    """
    matrix = arithmetic.array(rows)
    if max(abs(arithmetic.size(entry)) for entry in matrix.flat) > 2:
        raise ValueProblem("this matrix is no rotation: none has entries beyond 1")
    defect = arithmetic.tidy(matrix.T @ matrix - np.eye(3, dtype=int))
    misses = np.abs([[arithmetic.size(entry) for entry in row] for row in defect])
    miss = float(misses.max())
    allowed = np.full((3, 3), 1e-9)
    if not arithmetic.exact:
        # The last digit of entries that are printed with equally many digits, or decimals.
        typed = [Decimal(f"{entry:.15g}").normalize().as_tuple() for entry in matrix.flat]
        digits = min(max(len(one.digits) for one in typed), max(-int(one.exponent) for one in typed))
        half, sums = 0.5 * 10.0**-digits if digits >= 3 else 0.0, np.abs(matrix).sum(axis=0)
        allowed = np.maximum(allowed, half * np.add.outer(sums, sums) + 3 * half**2)
    if (misses > allowed).any() or (arithmetic.exact and any(entry != 0 for entry in defect.flat)):
        raise ValueProblem(
            f"this matrix is no rotation: R^T R differs from 1 by {miss:.3g}",
            hint="give `axis` and `angle`, or more digits" if miss < 1e-2 else None,
        )
    determinant = matrix[0] @ np.cross(matrix[1], matrix[2])
    if arithmetic.size(determinant) < 0:
        raise ValueProblem("this matrix is a reflection (its determinant is -1), expected a rotation")
    if arithmetic.exact:
        return matrix, miss
    if miss <= 1e-9:  # one step of the Newton-Schulz iteration for the same: 1e-9 becomes 1e-18
        return matrix - matrix @ defect / 2, miss
    left, _, right = np.linalg.svd(matrix)
    return left @ right, miss


def onto(axis: Sequence[Scalar], arithmetic: Arithmetic) -> Array:
    """The shortest turn that brings +z onto `axis` (3, any length); about x for an axis along -z."""
    x, y, z = direction(axis, arithmetic)
    across = x * x + y * y
    if arithmetic.sign(across) == 0:
        flip = arithmetic.sign(z)
        return arithmetic.array(np.diag([1, flip, flip]))
    if arithmetic.exact:
        # The same turn, written out: nothing is lost near -z, and the columns stay short.
        bend = 1 / (1 + z)
        rows = [[1 - x * x * bend, -x * y * bend, x], [-x * y * bend, 1 - y * y * bend, y], [-x, -y, z]]
        return arithmetic.tidy(arithmetic.array(rows))
    if arithmetic.size(z) < 0:
        return from_quaternion([across, -y * (1 - z), x * (1 - z), 0], arithmetic)
    return from_quaternion([1 + z, -y, x, 0], arithmetic)


def as_quaternion(matrix: Floats) -> Floats:
    """The unit quaternion (4) of a rotation matrix (3 by 3), its scalar not negative.

    From the largest of its components, S. W. Shepperd, J. Guidance and Control 1 (1978) 223.
    """
    trace = np.trace(matrix)
    # Row k of this symmetric matrix is 4 q_k q, by the entries of R.
    fourfold = np.empty((4, 4))
    fourfold[0, 0] = 1 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        fourfold[0, i + 1] = fourfold[i + 1, 0] = matrix[k, j] - matrix[j, k]
        fourfold[j + 1, k + 1] = fourfold[k + 1, j + 1] = matrix[j, k] + matrix[k, j]
        fourfold[i + 1, i + 1] = 1 + 2 * matrix[i, i] - trace
    row = fourfold[np.argmax(np.diag(fourfold))]
    quaternion: Floats = row / np.linalg.norm(row)
    return -quaternion if quaternion[0] < 0 else quaternion


def compose(p: Array, q: Array) -> Array:
    """The products p q of quaternions (..., 4), of numbers or of trees: q turns first."""
    p0, p1, p2, p3 = np.moveaxis(p, -1, 0)
    q0, q1, q2, q3 = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            p0 * q0 - p1 * q1 - p2 * q2 - p3 * q3,
            p0 * q1 + p1 * q0 + p2 * q3 - p3 * q2,
            p0 * q2 - p1 * q3 + p2 * q0 + p3 * q1,
            p0 * q3 + p1 * q2 - p2 * q1 + p3 * q0,
        ],
        axis=-1,
    )


def inverse(q: Array) -> Array:
    """The unit quaternions (..., 4) of the turns back."""
    back: Array = q * [1, -1, -1, -1]
    return back


def turned(q: Array, v: Array) -> Array:
    """The vectors v (..., 3) turned by unit quaternions q (..., 4): v + 2 q0 (q x v) + 2 q x (q x v).

    Both may be of numbers or of trees. The length is right to first order in that of q.
    """
    around = q[..., 1:]
    once = 2 * np.cross(around, v)
    result: Array = v + q[..., :1] * once + np.cross(around, once)
    return result


def angles_between(p: Floats, q: Floats) -> Floats:
    """The angles (..., rad, 0 to pi) between orientations (..., 4), also tiny ones, whatever the signs."""
    between = compose(inverse(p), q)
    angles: Floats = 2 * np.arctan2(np.linalg.norm(between[..., 1:], axis=-1), np.abs(between[..., 0]))
    return angles


def continuous(q: Floats) -> Floats:
    """Quaternions (..., n, 4) along motions, signed so that none is nearer to the next one's negative."""
    near = np.einsum("...ij,...ij->...i", q[..., 1:, :], q[..., :-1, :])
    signs = np.cumprod(np.where(near < 0, -1.0, 1.0), axis=-1)
    result = q.copy()
    result[..., 1:, :] *= signs[..., None]
    return result


def euler_angles(q: Floats, sequence: str = "zxz") -> Floats:
    """Euler angles (n, 3; rad) of quaternions (n, 4) along a motion: intrinsic turns in the `sequence`.

    The second angle is from 0 to pi, or from -pi/2 to pi/2 where the three axes differ. The others begin from
    -pi to pi and go on beyond that, where the steps between the quaternions, whose signs must be
    continuous, are short enough to tell. At either end of the second angle (gimbal lock) only the sum or
    the difference of the others means something; half of what means nothing is taken to be 0.

    With axes i, j, i and k the third one, q0 + i qi = cos(theta/2) exp(i (phi + psi)/2) and
    qj + i qk = sin(theta/2) exp(i (phi - psi)/2). A sequence i, j, k is one of i, j, i before a quarter
    turn back about j, as Rk(psi) = Rj(pi/2) Ri(-psi) Rj(-pi/2), with psi instead of -psi where i, j, k is
    left-handed.
    """
    first, second, third = ("xyz".index(name) + 1 for name in sequence)
    handed = 1 if (second - first) % 3 == 1 else -1
    if third != first:
        quarter = np.zeros(4)
        quarter[[0, second]] = 0.5**0.5
        q = compose(q, quarter)
    # A sine or cosine of half an angle below this may be a rounded 0: the angle is at its end.
    locked = 16 * EPS
    along = np.hypot(q[:, 0], q[:, first])
    across = np.hypot(q[:, second], q[:, 6 - first - second])
    other = handed * q[:, 6 - first - second]
    half_sum = np.unwrap(np.where(along > locked, np.arctan2(q[:, first], q[:, 0]), 0.0))
    half_difference = np.unwrap(np.where(across > locked, np.arctan2(other, q[:, second]), 0.0))
    middle = 2 * np.arctan2(across, along)
    ends = np.array([half_sum + half_difference, half_sum - half_difference])
    ends -= 2 * np.pi * np.rint(ends[:, :1] / (2 * np.pi))
    if third != first:
        ends[1], middle = -handed * ends[1], middle - np.pi / 2
    return np.column_stack([ends[0], middle, ends[1]])


# The least error (rad) of an orientation, from the rounding of the four components of its quaternion.
ROUNDING_OF_QUATERNION = 2.0**-50
# The most times that are looked at, besides the last one: each costs an orientation for each input.
MOST_TIMES = 64
ULPS_MOVED = 16  # Units in the last place by which an input is moved: more than the rounding of the formulas.
# Beyond this angle (rad) between the two motions the linear estimate means nothing.
LARGEST_LINEAR_TURN = 0.1


def representative(times: Floats) -> Floats:
    """Evenly chosen ones of the times (n), the first and the last among them."""
    return np.append(times[:: 1 + len(times) // MOST_TIMES], times[-1:])


def to_rounding(
    orientations: Callable[[Sequence[Any]], Floats],
    inputs: Sequence[Any],
    reference: Floats,
    ulps: int = ULPS_MOVED,
) -> Floats:
    """The largest angle (m, rad, at most pi) by which one rounding of each input turns m motions.

    `reference` (m, n, 4) are their orientations, and `orientations` gives those at other inputs. Each of
    the `inputs`, a number or one for each motion, is moved by so many `ulps` of its size, and the angle
    is divided by that number. The angles are combined as a root of the sum of squares. Where a moved
    input takes the body somewhere else altogether, nothing is certain, and the angle is pi.
    """
    squares = np.zeros(reference.shape[:2])
    for place, value in enumerate(inputs):
        if np.any(value):
            moved = [*inputs[:place], value + ulps * EPS * value, *inputs[place + 1 :]]
            angle = angles_between(reference, orientations(moved))
            squares += np.where(angle < LARGEST_LINEAR_TURN, angle / ulps, np.pi) ** 2
    largest: Floats = np.clip(np.sqrt(squares.max(axis=1, initial=0.0)), ROUNDING_OF_QUATERNION, np.pi)
    return largest
