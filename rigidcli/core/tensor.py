"""Inertia tensors: how they add, shift and turn, and which of them a body can have.

The inertia tensor of a body about a point O is I = sum m (r^2 1 - r r^T), r taken from O. Products
of inertia stand off the diagonal with a minus sign: Ixy = -sum m x y. With this sign I is a
tensor, so that L = I.omega and T = omega.I.omega/2 hold in any axes.

Everything is centred first and shifted afterwards. Forming sum m r^2 - M c^2 instead loses all
digits for a small body far from the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Scalar
from rigidcli.errors import ValueProblem

PHYSICAL_SLACK = 1e-10
"""How far, relative to its trace, a tensor may miss an inequality before no body can have it."""

FAR = 1e3
"""Beyond this ratio of M c^2 to the second moments about c, their difference loses more than three digits."""


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """What a body is to its motion: mass (kg), centre of mass (3, m), tensor about it (3 by 3, kg m^2).

    Of a body without a known mass the tensor cannot be shifted: `tensor` is then about the
    point `com`, and `at_com` says whether that is its centre of mass.
    """

    mass: Scalar | None
    com: Array
    tensor: Array
    at_com: bool = True


def point_tensor(d: Array) -> Array:
    """Tensor of a unit mass at `d` (3, m) about the origin: d^2 1 - d d^T (3 by 3, m^2)."""
    return from_second_moments(1, np.outer(d, d))


def shift_from_com(tensor: Array, mass: Scalar, d: Array) -> Array:
    """Tensor about the point at `d` from the centre of mass, from that about the centre of mass.

    Steiner's parallel-axis theorem, for all nine components at once.
    """
    return tensor + mass * point_tensor(d)


def shift_to_com(tensor: Array, mass: Scalar, d: Array) -> Array:
    """Tensor about the centre of mass, from that about the point at `d` from it."""
    return tensor - mass * point_tensor(d)


def rotate(tensor: Array, rotation: Array) -> Array:
    """Tensor of the body after it was turned by `rotation` (3 by 3): R I R^T, kept symmetric."""
    turned: Array = rotation @ tensor @ rotation.T
    half: Array = (turned + turned.T) / 2
    return half


def from_second_moments(mass: Scalar, second: Array) -> Array:
    """Tensor about the centre of mass from the mean of r r^T there (3 by 3, m^2): M (tr C 1 - C)."""
    xx, yy, zz = second.diagonal()
    # Not the trace less an entry: that rounds away the small moment of a slender body.
    tensor: Array = -second
    tensor[[0, 1, 2], [0, 1, 2]] = [yy + zz, zz + xx, xx + yy]
    return mass * tensor


def of_points(points: Array, n: Arithmetic = FLOAT) -> MassProperties:
    """Mass properties of point masses, rows (m, x, y, z) in kg and m; k by 4, k at least 1."""
    if n.exact:
        return _sum_exactly(
            [MassProperties(point[0], point[1:], n.array(np.zeros((3, 3), dtype=int))) for point in points], n
        )
    mass, origin = points[:, 0], points[0, 1:]
    total = mass.sum()
    offset = points[:, 1:] - origin
    centre = (mass @ offset) / total
    offset = offset - centre
    second = (offset * mass[:, None]).T @ offset
    return MassProperties(total, origin + centre, from_second_moments(1, second))


def about(points: Array, point: Array) -> Array:
    """Tensor of point masses, rows (m, x, y, z) in kg and m, about `point` (3, m)."""
    offset = points[:, 1:] - point
    return from_second_moments(1, (offset * points[:, :1]).T @ offset)


def of_blocks(read: Callable[[], Iterable[Floats]]) -> MassProperties:
    """Mass properties of point masses in blocks (n by 4: m, x, y, z in kg and m), in bounded memory.

    `read` starts the blocks from the beginning. All sums are taken about the centre of the first block, one
    matrix product a block; should that turn out to be far from the centre of mass, as
    when the first points are light and distant, they are taken once more about the latter. NaN comes out when
    a mass is not positive, or a value not finite.
    """
    centre, sums = _sums(read, None)
    mass, shift = sums[0, 0], sums[0, 1:] / sums[0, 0]
    second = sums[1:, 1:] - mass * np.outer(shift, shift)
    if mass * (shift @ shift) > FAR * np.trace(second):
        centre, sums = _sums(read, centre + shift)
        shift = sums[0, 1:] / mass
        second = sums[1:, 1:] - mass * np.outer(shift, shift)
    return MassProperties(float(mass), centre + shift, from_second_moments(1, second))


def _sums(read: Callable[[], Iterable[Floats]], centre: Floats | None) -> tuple[Floats, Floats]:
    """A point, by default the centre of the first block, and the sum of m (1, d) (1, d)^T about it."""
    total = np.zeros((4, 4))
    offsets = weighted = np.ones((4, 0))
    for block in read():
        count = len(block)
        if centre is None:
            centre = (block[:, :1] * block[:, 1:]).sum(axis=0) / block[:, 0].sum()
        if offsets.shape[1] < count:
            offsets, weighted = np.ones((4, count)), np.empty((4, count))
        # Columns of points, in place: numpy's inner loops are then long, and memory stays in the cache.
        d, w = offsets[:, :count], weighted[:, :count]
        np.subtract(block.T[1:], centre[:, None], out=d[1:])
        w[0] = block[:, 0]
        if not w[0].min() > 0:
            return centre, np.full((4, 4), np.nan)
        np.multiply(d[1:], w[0], out=w[1:])
        total += w @ d.T
    assert centre is not None
    return centre, total


def combine(parts: Iterable[MassProperties], n: Arithmetic = FLOAT) -> MassProperties:
    """The bodies, of known mass, taken as one. A hole is a part with negative mass and tensor.

    Raises ValueProblem when the masses cancel, so that there is no centre of mass.
    """
    parts = list(parts)
    masses = np.array([part.mass for part in parts])
    coms = np.array([part.com for part in parts])
    mass = masses.sum()
    if mass == 0:
        raise ValueProblem("the masses of the parts and holes add up to zero")
    if n.exact:
        return _sum_exactly(parts, n)
    com = coms[0] + masses @ (coms - coms[0]) / mass
    tensors = [
        shift_from_com(part.tensor, own, d) for part, own, d in zip(parts, masses, coms - com, strict=True)
    ]
    return MassProperties(mass, com, np.sum(tensors, axis=0))


def _sum_exactly(parts: Iterable[MassProperties], n: Arithmetic) -> MassProperties:
    """Bodies taken as one by sums about the origin: exact numbers lose no digits there, and stay short."""
    mass: Any = 0
    first, tensor = n.array([0, 0, 0]), n.array(np.zeros((3, 3), dtype=int))
    for part in parts:
        own: Any = part.mass
        mass = mass + own
        first = first + own * part.com
        tensor = tensor + shift_from_com(part.tensor, own, part.com)
    com = n.tidy(first / mass)
    return MassProperties(mass, com, n.tidy(shift_to_com(n.tidy(tensor), mass, com)))


def place(body: MassProperties, rotation: Array, displacement: Array) -> MassProperties:
    """`body` turned about the origin by `rotation` (3 by 3), then moved by `displacement` (3, m)."""
    com = rotation @ body.com + displacement
    return replace(body, com=com, tensor=rotate(body.tensor, rotation))


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


def require_physical(tensor: Array) -> None:
    """Raise ValueProblem unless some body has this tensor about its centre of mass."""
    failure = shortfall(tensor)
    if failure is not None:
        text, amount = failure
        raise ValueProblem(
            f"no body has this inertia tensor: {text} (by {amount:.3g} kg m^2)",
            hint="no principal moment is negative, or larger than the sum of the other two",
        )
