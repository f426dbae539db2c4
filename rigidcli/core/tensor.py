"""Inertia tensors: how they add, shift and turn, and which of them a body can have.

The inertia tensor of a body about a point O is I = sum m (r^2 1 - r r^T), r taken from O. Products
of inertia stand off the diagonal with a minus sign: Ixy = -sum m x y. With this sign I is a
tensor, so that L = I.omega and T = omega.I.omega/2 hold in any axes.

A slender body has a moment that may be smaller than the rounding of the others. So `Inertia` keeps the
tensor along the axes in which it has most digits, with a bound on the rounding of each entry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import EPS, Array, Floats, Scalar
from rigidcli.errors import ValueProblem

PHYSICAL_SLACK = 1e-10
"""How far, relative to its trace, a tensor may miss an inequality before no body can have it."""

ROUNDING = 64 * EPS
"""The relative error that rounding leaves in a sum of products, with a margin for long sums."""

MISPLACED = 8 * EPS
"""The relative error that rounding leaves in a vector or tensor that is turned, or a point that is moved."""


IDENTITY = np.eye(3, dtype=int)
"""The axes of a body that is not turned."""

IDENTITY.setflags(write=False)


def misplaced(*vectors: Array) -> float:
    """By how much rounding may misplace a sum of `vectors` (3, m), each turned; exact ones not at all."""
    sizes = [math.hypot(*vector.tolist()) for vector in vectors if vector.dtype != object]
    return MISPLACED * sum(sizes) if len(sizes) == len(vectors) else 0.0


def spread_noise(mass: Scalar, spread: Array, error: float) -> Floats:
    """A bound on the rounding errors (3 by 3, kg m^2) of the tensor of a `mass` about some point.

    `spread` (3, m) is its root mean square distance from the point along each axis. Places are off by at most
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
    axes: Array = field(default_factory=lambda: IDENTITY)

    @classmethod
    def of(cls, entries: Array, noise: Floats | float = 0.0) -> Inertia:
        """Of `entries` with the relative rounding errors of short sums, and a `noise` besides."""
        return cls(
            entries, np.zeros((3, 3)) if entries.dtype == object else ROUNDING * np.abs(entries) + noise
        )

    @classmethod
    def of_sums(cls, mass: Scalar, centre: Array, sums: Array) -> Inertia:
        """Of rounded places with that `mass`, by the `sums` of m r r^T (3 by 3, kg m^2), r from `centre`."""
        entries = from_second_moments(1, sums)
        if entries.dtype == object:
            return cls.of(entries)
        spread = np.sqrt(sums.diagonal() / mass)
        return cls.of(entries, spread_noise(mass, spread, misplaced(centre, spread)))

    @property
    def tensor(self) -> Array:
        """The tensor along the axes of space, as those of `axes` are called here; noise is zero."""
        return self.in_space().without_noise()

    @property
    def is_turned(self) -> bool:
        """Whether the entries are along other axes than those in whose components `axes` are given."""
        return self.axes is not IDENTITY and bool((self.axes != IDENTITY).any())

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
        hidden = np.abs(self.entries) <= self.noise
        return np.where(hidden & np.isfinite(self.noise), 0.0, self.entries) if hidden.any() else self.entries

    def turned(self, rotation: Array) -> Inertia:
        """After the body was turned by `rotation` (3 by 3)."""
        if rotation.dtype != object and not self.is_turned and (rotation == IDENTITY).all():
            return self
        axes = rotation @ self.axes
        if axes.dtype != object:
            # One step of the Newton-Schulz iteration takes out what rounding has added to the angles between.
            axes = axes @ (1.5 * IDENTITY - axes.T @ axes / 2)
        return Inertia(self.entries, self.noise, axes)

    def shifted(self, mass: Scalar, d: Array, error: float = 0.0) -> Inertia:
        """About the point at `d` (3, m, to within `error`) from the centre of mass, about which it was.

        With a negative mass it is the way back.
        """
        d = self.axes.T @ d
        noise = self.noise if d.dtype == object else self.noise + spread_noise(mass, np.abs(d), error)
        return Inertia(shift_from_com(self.entries, mass, d), noise, self.axes)

    def __add__(self, other: Inertia) -> Inertia:
        """Of both bodies; along axes that they have in common, if they have."""
        one, two = (self, other) if (self.axes == other.axes).all() else (self.in_space(), other.in_space())
        return Inertia(one.entries + two.entries, one.noise + two.noise, one.axes)

    def moment_about(self, axis: Array) -> tuple[Scalar, float]:
        """The moment about an `axis` (3, unit), and a bound on its rounding error, both in kg m^2."""
        along = self.axes.T @ axis
        moment = along @ self.entries @ along
        if along.dtype == object:
            return moment, 0.0
        widest = np.abs(along) + MISPLACED
        turning = 2 * MISPLACED * np.abs(self.entries).sum(axis=0) @ widest
        return moment, self.noise_along(widest) + turning

    def noise_along(self, axis: Array) -> Scalar:
        """A bound on the rounding error of the moment about an `axis` (3, unit) along the entries'."""
        along: Any = np.abs(axis)
        bound: Scalar = along @ self.noise @ along
        return bound

    def momentum(self, omega: Array) -> Array:
        """Angular momentum (..., 3; kg m^2/s) at angular velocities `omega` (..., 3; rad/s)."""
        momentum: Array = omega @ self.axes @ self.entries @ self.axes.T
        return momentum


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
    rounding = ROUNDING * np.trace(tensor)
    return all(-value <= within + rounding for value, within in zip(values, reach, strict=True))


def require_physical(tensor: Array, halves: Floats | float = 0.0) -> str | None:
    """Raise ValueProblem unless some body has this tensor about its centre of mass.

    The entries stand for all that are at most `halves` (kg m^2) away; a note says so where that is needed.
    """
    failure = shortfall(tensor)
    if failure is None:
        return None
    text, amount = failure
    if is_within_digits(tensor, np.broadcast_to(halves, (3, 3))):
        return f"{text} (by {amount:.2g} kg m^2), which is less than the rounding of the digits typed"
    raise ValueProblem(
        f"no body has this inertia tensor: {text} (by {amount:.3g} kg m^2)",
        hint="no principal moment is negative, or larger than the sum of the other two",
    )
