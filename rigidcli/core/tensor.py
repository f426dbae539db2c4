"""Inertia tensors: how they add, shift and turn, and which of them a body can have.

The inertia tensor of a body about a point O is I = sum m (r^2 1 - r r^T), r taken from O. Products
of inertia stand off the diagonal with a minus sign: Ixy = -sum m x y. With this sign I is a
tensor, so that L = I.omega and T = omega.I.omega/2 hold in any axes.

Everything is centred first and shifted afterwards. Forming sum m r^2 - M c^2 instead loses all
digits for a small body far from the origin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Scalar
from rigidcli.errors import ValueProblem

PHYSICAL_SLACK = 1e-10
"""How far, relative to its trace, a tensor may miss an inequality before no body can have it."""

FAR = 1e3
"""Beyond this ratio of M c^2 to the second moments about c, their difference loses more than three digits."""


ROUNDING = 64 * float(np.finfo(np.float64).eps)
"""The relative error that rounding leaves in a sum of products, with a margin for long sums."""

MISPLACED = 8 * float(np.finfo(np.float64).eps)
"""The relative error that rounding leaves in a vector or tensor that is turned, or a point that is moved."""


def misplaced(*vectors: Array) -> float:
    """By how much rounding may misplace a sum of `vectors` (3, m), each turned; exact ones not at all."""
    if any(vector.dtype == object for vector in vectors):
        return 0.0
    return MISPLACED * sum(float(np.linalg.norm(vector)) for vector in vectors)


def spread_noise(mass: Scalar, spread: Array, error: float) -> Floats:
    """A bound on the rounding errors (3 by 3, kg m^2) of the tensor of a `mass` about some point.

    `spread` (3, m) is its root mean square distance from the point along each axis. Each place is known to
    `error` (m), so that what lies on an axis may seem to lie beside it.
    """
    if spread.dtype == object:
        return np.zeros((3, 3))
    widest = spread + error
    products = np.outer(widest, ROUNDING / 2 * widest + error)
    noise: Floats = np.abs(from_second_moments(mass, products + products.T))
    return noise


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """An inertia tensor, by its `entries` (3 by 3, kg m^2) along the axes in which they were worked out.

    `axes` (3 by 3) has these as columns: a body that is only turned keeps its entries, and with them a moment
    that would vanish beside the rounding of the others. `noise` (3 by 3, kg m^2) bounds the rounding errors
    of the entries. It decides what is zero; exact numbers have none.
    """

    entries: Array
    noise: Floats
    axes: Array = field(default_factory=lambda: np.eye(3, dtype=int))

    @classmethod
    def of(cls, entries: Array, noise: Floats | float = 0.0) -> Inertia:
        """Of `entries` with the relative rounding errors of short sums, and a `noise` besides."""
        return cls(
            entries, np.zeros((3, 3)) if entries.dtype == object else ROUNDING * np.abs(entries) + noise
        )

    @classmethod
    def of_sums(cls, mass: Scalar, centre: Array, sums: Array, error: float = 0.0) -> Inertia:
        """Of places with that `mass`, by the `sums` of m r r^T (3 by 3, kg m^2), r from `centre` (3, m).

        Their coordinates are rounded, and the centre is known to `error` (m) besides.
        """
        entries = from_second_moments(1, sums)
        if entries.dtype == object:
            return cls.of(entries)
        spread = np.sqrt(sums.diagonal() / mass)
        return cls.of(entries, spread_noise(mass, spread, error + misplaced(centre, spread)))

    @property
    def tensor(self) -> Array:
        """The tensor along the axes of space, as those of `axes` are called here; noise is zero."""
        return self.in_space().without_noise()

    @property
    def is_turned(self) -> bool:
        """Whether the entries are along other axes than those in whose components `axes` are given."""
        return bool((self.axes != np.eye(3, dtype=int)).any())

    def in_space(self) -> Inertia:
        """The same by its entries along the axes in whose components `axes` are given."""
        if not self.is_turned:
            return self
        entries = rotate(self.entries, self.axes)
        if entries.dtype == object:
            return Inertia.of(entries)
        # The entries of `axes` are rounded alike, large or small.
        size = np.abs(self.axes)
        rounding = MISPLACED * np.abs(self.entries).sum(axis=0) @ (size + MISPLACED).T
        return Inertia(entries, size @ self.noise @ size.T + np.add.outer(rounding, rounding))

    def without_noise(self) -> Array:
        """The entries, zero where they may be rounding errors alone."""
        if self.entries.dtype == object:
            return self.entries
        return np.where(np.abs(self.entries) <= self.noise, 0.0, self.entries)

    def turned(self, rotation: Array) -> Inertia:
        """After the body was turned by `rotation` (3 by 3)."""
        axes = rotation @ self.axes
        if axes.dtype != object:
            # One step of the Newton-Schulz iteration takes out what rounding has added to the angles between.
            axes = axes @ (1.5 * np.eye(3) - axes.T @ axes / 2)
        return replace(self, axes=axes)

    def shifted(self, mass: Scalar, d: Array, error: float = 0.0) -> Inertia:
        """About the point at `d` (3, m, to within `error`) from the centre of mass, about which it was.

        With a negative mass it is the way back.
        """
        d = self.axes.T @ d
        noise = self.noise if d.dtype == object else self.noise + spread_noise(mass, np.abs(d), error)
        return replace(self, entries=shift_from_com(self.entries, mass, d), noise=noise)

    def times(self, sign: int) -> Inertia:
        """Of a body (1), or of a hole of its form (-1)."""
        return replace(self, entries=sign * self.entries)

    def __add__(self, other: Inertia) -> Inertia:
        """Of both bodies; along axes that they have in common, if they have."""
        one, two = (self, other) if (self.axes == other.axes).all() else (self.in_space(), other.in_space())
        return replace(one, entries=one.entries + two.entries, noise=one.noise + two.noise)

    def moment_about(self, axis: Array) -> tuple[Scalar, float]:
        """The moment about an `axis` (3, unit), and a bound on its rounding error, both in kg m^2."""
        along = self.axes.T @ axis
        moment = along @ self.entries @ along
        if along.dtype == object:
            return moment, 0.0
        widest = np.abs(along) + MISPLACED
        turning = 2 * MISPLACED * np.abs(self.entries).sum(axis=0) @ widest
        return moment, float(self.noise_along(widest) + turning)

    def noise_along(self, axis: Floats) -> float:
        """A bound on the rounding error of the moment about an `axis` (3, unit) along the entries'."""
        return float(np.abs(axis) @ self.noise @ np.abs(axis))

    def momentum(self, omega: Array) -> Array:
        """Angular momentum (..., 3; kg m^2/s) at angular velocities `omega` (..., 3; rad/s)."""
        momentum: Array = omega @ self.axes @ self.entries @ self.axes.T
        return momentum


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """What a body is to its motion: mass (kg), centre of mass (3, m), inertia about it.

    Rounding may misplace the centre of mass by `error` (m). Of a body without a known mass the tensor
    cannot be shifted: `inertia` is then about the point `com`, and `at_com` says whether that
    is its centre of mass.
    """

    mass: Scalar | None
    com: Array
    inertia: Inertia
    error: float = 0.0
    at_com: bool = True

    @property
    def tensor(self) -> Array:
        """The tensor about the centre of mass, along the axes of its components (3 by 3, kg m^2)."""
        return self.inertia.tensor


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
        nothing = Inertia.of(n.array(np.zeros((3, 3), dtype=int)))
        return _sum_exactly([MassProperties(point[0], point[1:], nothing) for point in points], n)
    mass, origin = points[:, 0], points[0, 1:]
    total = mass.sum()
    offset = points[:, 1:] - origin
    centre = (mass @ offset) / total
    offset = offset - centre
    com, extent = origin + centre, offset[np.argmax((offset**2).sum(axis=1))]
    inertia = Inertia.of_sums(total, com, (offset * mass[:, None]).T @ offset)
    return MassProperties(total, com, inertia, misplaced(com, extent))


def about(points: Array, point: Array, error: float = 0.0) -> Inertia:
    """Inertia of point masses, rows (m, x, y, z) in kg and m, about `point` (3, m, to within `error`)."""
    offset = points[:, 1:] - point
    return Inertia.of_sums(points[:, 0].sum(), point, (offset * points[:, :1]).T @ offset, error)


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
    com, spread = centre + shift, np.sqrt(second.diagonal() / mass)
    inertia = Inertia.of_sums(mass, centre, sums[1:, 1:]).shifted(-mass, shift)
    return MassProperties(float(mass), com, inertia, misplaced(com, spread))


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
    reach = [part.error + misplaced(own) for part, own in zip(parts, coms - com, strict=True)]
    error = float(np.abs(masses) @ reach / abs(mass))
    inertia = reduce(
        add,
        (
            part.inertia.shifted(own, d, part.error + error)
            for part, own, d in zip(parts, masses, coms - com, strict=True)
        ),
    )
    return MassProperties(mass, com, inertia, error)


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
    return MassProperties(mass, com, Inertia.of(n.tidy(shift_to_com(n.tidy(tensor), mass, com))))


def place(body: MassProperties, rotation: Array, displacement: Array) -> MassProperties:
    """`body` turned about the origin by `rotation` (3 by 3), then moved by `displacement` (3, m)."""
    com, error = rotation @ body.com + displacement, body.error + misplaced(body.com, displacement)
    return replace(body, com=com, inertia=body.inertia.turned(rotation), error=error)


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
