"""Mass, centre of mass and inertia: of point masses, of bodies taken as one, of bodies that are placed.

Everything is centred first and shifted afterwards. Forming sum m r^2 - M c^2 instead loses all
digits for a small body far from the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from rigidcli.core.arithmetic import EPS, FLOAT, Arithmetic, Array, Floats, Scalar
from rigidcli.core.tensor import from_second_moments, rotate, rounded_off, shift_from_com
from rigidcli.errors import ValueProblem

ROUNDING_OF_PLACE = 8 * EPS  # The relative error that rounding leaves in a point that is moved and turned.


class MassProperties(NamedTuple):
    """Mass (kg), centre of mass (3, m) and inertia tensor about it (3 by 3, kg m^2) of a body.

    Without a mass the tensor cannot be shifted: it is then about the point `com`, and `at_com` says whether
    that is the centre of mass. `integrated` is the estimated relative error of integrals over a density that
    varies; None without such integrals.
    """

    mass: Scalar | None
    com: Array
    tensor: Array
    at_com: bool = True
    integrated: float | None = None

    def tensor_about(self, point: Array) -> Array:
        """The tensor about `point` (3, m) of a body that has a mass."""
        assert self.mass is not None
        return shift_from_com(self.tensor, self.mass, self.com - point)

    def missing(self) -> MassProperties:
        """The mass properties of a hole of this form, which are added to take it away."""
        assert self.mass is not None
        return self._replace(mass=-self.mass, tensor=-self.tensor)

    def com_from(self, point: Array) -> Array:
        """The centre of mass from `point` (3, m), where a coordinate that is only rounding is zero."""
        offset: Array = self.com - point
        if offset.dtype == object or not self.mass:
            return offset
        radius = np.sqrt(np.abs(np.trace(self.tensor) / self.mass))
        return rounded_off(offset, ROUNDING_OF_PLACE * (np.abs([self.com, point]).max() + radius))


def of_points(points: Array, n: Arithmetic = FLOAT) -> MassProperties:
    """Mass properties of point masses, rows (m, x, y, z) in kg and m; k by 4, k at least 1."""
    if n.exact:
        nothing = n.array(np.zeros((3, 3), dtype=int))
        single = [MassProperties(point[0], point[1:], nothing) for point in points]
        return _sum_exactly(single, n)
    mass, origin = points[:, 0], points[0, 1:]
    total = mass.sum()
    offset = points[:, 1:] - origin
    centre = (mass @ offset) / total
    offset = offset - centre
    return MassProperties(total, origin + centre, from_second_moments(1, (offset * mass[:, None]).T @ offset))


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
    # Where M c^2 is larger by this much, the difference has lost a digit.
    if mass * (shift @ shift) > 10 * np.trace(second):
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
    """The bodies, which have masses, taken as one. A hole is a part with negative mass and tensor.

    Raises ValueProblem when the masses cancel, so that there is no centre of mass.
    """
    parts = list(parts)
    masses = n.array([part.mass for part in parts])
    mass = masses.sum()
    if mass == 0:
        raise ValueProblem("the masses of the parts and holes add up to zero")

    if n.exact:
        return _sum_exactly(parts, n)
    errors = [abs(part.mass or 0) * part.integrated for part in parts if part.integrated is not None]
    integrated = float(sum(errors) / abs(mass)) if errors else None
    coms = np.array([part.com for part in parts])
    com = coms[0] + masses @ (coms - coms[0]) / mass
    tensor = np.sum([part.tensor_about(com) for part in parts], axis=0)
    return MassProperties(mass, com, tensor, integrated=integrated)


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
    return MassProperties(mass, com, n.tidy(shift_from_com(n.tidy(tensor), -mass, com)))


def place(
    body: MassProperties, rotation: Array, displacement: Array, n: Arithmetic = FLOAT
) -> MassProperties:
    """`body` turned about the origin by `rotation` (3 by 3), then moved by `displacement` (3, m)."""
    com, tensor = rotation @ body.com + displacement, rotate(n.tidy(body.tensor), rotation)
    return body._replace(com=com, tensor=tensor)
