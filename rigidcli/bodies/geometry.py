"""What the dimensions of a shape tell: its measure, centre, spread and extent."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

from rigidcli.core.arithmetic import Scalar

Bounds: TypeAlias = tuple[tuple[float, float], ...]
"""The least box round a shape: (low, high) along each local axis, m."""


class Geometry(NamedTuple):
    """A shape with a uniform density: its measure, centre of mass, spread and extent, in its own axes.

    `measure` is the volume (m^3), area (m^2) or length (m); `centre` is (x, y, z) in m from the natural
    origin; `second` holds the means of x^2, y^2, z^2 about the centre (m^2), or of all of r r^T
    (3 by 3) where local axes are not principal; `bounds` is empty where `Region.bounds` works it out.
    """

    measure: Scalar
    centre: Any
    second: Any
    bounds: Bounds = ()


ORIGIN = (0, 0, 0)
"""The centre of a shape that is symmetric about its natural origin."""


def round_bounds(radius: float, low: float, high: float) -> Bounds:
    """Bounds of what is round about z."""
    return (-radius, radius), (-radius, radius), (low, high)


def powers(a: Scalar, b: Scalar, degree: int) -> Scalar:
    """a^n + a^(n-1) b + ... + b^n, which is (a^(n+1) - b^(n+1)) / (a - b) without cancellation."""
    return sum(a ** (degree - k) * b**k for k in range(degree + 1))
