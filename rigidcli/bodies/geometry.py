"""What a shape of given dimensions is: its measure, its spread, and the points that it fills."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigidcli.bodies.charts import Chart
from rigidcli.core.arithmetic import Floats, Mask, Scalar


class Geometry(NamedTuple):
    """The measure, the centre of mass and the spread of a shape with a uniform density, in its own axes.

    `measure` is the volume (m^3), area (m^2) or length (m); `centre` is (x, y, z) in m from the natural
    origin; `second` holds the means of x^2, y^2, z^2 about the centre (m^2), or of all of r r^T
    (3 by 3) where local axes are not principal.
    """

    measure: Scalar
    centre: Any
    second: Any


class Figure(NamedTuple):
    """A shape of given dimensions, as functions that are called when their values are needed.

    `contains` says which points (x, y, z in m, floats) a solid or flat shape fills, its surface included.
    `corners` (k by 3, m) are given for a flat shape in a plane of its own, which is z = 0 to `contains`.
    """

    geometry: Callable[[], Geometry]
    charts: Callable[[], Sequence[Chart]]
    contains: Callable[[Floats, Floats, Floats], Mask] | None = None
    corners: Callable[[], Floats] | None = None
