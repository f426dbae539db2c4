"""Inertia tensors: how they add, shift and turn, and which of them a body can have.

    I = sum m (r^2 1 - r r^T)      the inertia tensor about a point O (3 by 3, kg m^2), r (m) taken from O
    Ixy = -sum m x y               a product of inertia, with a minus sign: only so is I a tensor
    L = I omega, T = omega.L/2     in any axes
    C = sum m r r^T / M            second moments of a unit mass (3 by 3, m^2): I = M (tr C 1 - C)

Floats hold a tensor to some rounding of its largest entry. So a moment below 1e-13 of the largest is zero:
that of a body of points on a line, and of a rod a million times as long as it is thick no more.
"""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import EPS, Array, Floats, Scalar
from rigidcli.errors import ValueProblem

LEAST_MOMENT = 1e-13  # A principal moment below this, in units of the largest, is zero.
# A product of inertia below this, in units of the largest entry, is the rounding of a zero.
LEAST_PRODUCT = 16 * EPS
# The relative error that rounding leaves in a sum of products, with a margin for long sums.
ROUNDING_OF_SUM = 64 * EPS
# How far, relative to its trace, a tensor may miss an inequality before no body can have it.
PHYSICAL_SLACK = 1e-10
IDENTITY = np.eye(3, dtype=int)  # The axes of a body that is not turned.

IDENTITY.setflags(write=False)

# The least entries of a tensor (3 by 3), in units of the largest.
LEAST_ENTRIES = np.where(IDENTITY, LEAST_MOMENT, LEAST_PRODUCT)


def without_rounding(tensor: Array) -> Array:
    """The tensor with zeros in place of entries that are rounding; exact entries stay."""
    if tensor.dtype == object:
        return tensor
    sizes = np.abs(tensor)
    largest = sizes.max()
    if not largest < np.inf:
        return tensor
    rest: Array = np.where(sizes < largest * LEAST_ENTRIES, 0.0, tensor)
    return rest


def rounded_off(values: Floats, error: Floats | float) -> Floats:
    """The values, zero where one is below its error."""
    rest: Floats = np.where(np.abs(values) < error, 0.0, values)
    return rest


def point_tensor(d: Array) -> Array:
    """Tensor of a unit mass at `d` (3, m) about the origin: d^2 1 - d d^T (3 by 3, m^2)."""
    return from_second_moments(1, np.outer(d, d))


def shift_from_com(tensor: Array, mass: Scalar, d: Array) -> Array:
    """Tensor about the point at `d` from the centre of mass, from that about the centre of mass.

    Steiner's parallel-axis theorem, for all nine components at once. With a negative mass it is the way back.
    """
    return tensor + mass * point_tensor(d)


def rotate(tensor: Array, rotation: Array) -> Array:
    """Tensor of the body after it was turned by `rotation` (3 by 3): R I R^T, kept symmetric."""
    if (rotation == IDENTITY).all():
        return tensor
    turned: Array = rotation @ tensor @ rotation.T
    half: Array = (turned + turned.T) / 2
    return half


def from_second_moments(mass: Scalar, second: Array) -> Array:
    """Tensor about the centre of mass from the mean of r r^T there (3 by 3, m^2): M (tr C 1 - C)."""
    tensor: Array = -second
    xx, yy, zz = second[0, 0], second[1, 1], second[2, 2]
    # Not the trace less an entry: that rounds away the small moment of a slender body.
    tensor[0, 0], tensor[1, 1], tensor[2, 2] = yy + zz, zz + xx, xx + yy
    return mass * tensor


def shortfall(tensor: Array) -> tuple[str, float] | None:
    """The inequality that `tensor` (3 by 3, floats) fails, with by how much in its unit; None if none.

    A body's moments are not negative, and none is larger than the sum of the other two, because
    I1 + I2 - I3 = 2 sum m x3^2 (Landau and Lifshitz, Mechanics, section 32).
    """
    scale = np.abs(tensor).max()
    if scale == 0:
        return None
    low, middle, high = np.linalg.eigvalsh(tensor / scale)
    slack = PHYSICAL_SLACK * abs(low + middle + high)
    if low < -slack:
        return f"lambda1 >= 0 fails: lambda1 = {low * scale:.6g}", float(-low * scale)
    excess = high - low - middle
    if excess > slack:
        text = f"lambda3 <= lambda1 + lambda2 fails: {high * scale:.6g} > {(low + middle) * scale:.6g}"
        return text, float(excess * scale)
    return None


def is_within_digits(tensor: Floats, halves: Floats) -> bool:
    """Whether a body has a tensor near this one, whose entries are off by at most `halves` (both 3 by 3).

    A body's second moments S = (tr I/2) 1 - I are positive: v.S v >= 0. For the v of a negative one, the
    entries of the tensor can raise v.S v by the sum of |1/2 - v v^T| times `halves`.
    """
    values, rows = np.linalg.eigh(np.trace(tensor) / 2 * IDENTITY - tensor)
    reach = [float((np.abs(IDENTITY / 2 - np.outer(v, v)) * halves).sum()) for v in rows.T]
    rounding = ROUNDING_OF_SUM * np.trace(tensor)
    return all(-value <= within + rounding for value, within in zip(values, reach, strict=True))


def require_physical(tensor: Array, halves: Floats | float = 0.0, less: str = "") -> str | None:
    """Raise ValueProblem unless some body has this tensor about its centre of mass.

    The entries stand for all that are at most `halves` (kg m^2) away; a note says so where that is needed.
    The message says `less` what the tensor that was given is taken.
    """
    failure = shortfall(tensor)
    if failure is None:
        return None
    text, amount = failure
    if is_within_digits(tensor, np.broadcast_to(halves, (3, 3))):
        return f"{text} (by {amount:.2g} kg m^2), which is less than the rounding of the digits typed"
    raise ValueProblem(
        f"no body has this inertia tensor{less}: {text} (by {amount:.3g} kg m^2)",
        hint="no principal moment is negative, or larger than the sum of the other two",
    )
