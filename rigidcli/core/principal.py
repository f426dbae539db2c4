"""Principal moments and axes in one canonical frame: groups of equal moments, signs, handedness.

Where moments are equal, or a sign is free, the laws of mechanics leave a choice; here it is made
once, in the same way for floats and exact numbers, so that equal tensors get equal axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.core.tensor import LEAST_MOMENT, without_rounding
from rigidcli.errors import ComputationError

# Moments that differ by less, in units of the largest, are one group: rounding decides their axes.
EQUAL_MOMENTS = 1e-12
# Squared components of an axis that differ by less count as equally large, and the first is taken.
PIVOT_TIE = 1e-9

BodyClass: TypeAlias = Literal["point", "linear", "spherical", "oblate", "prolate", "asymmetric"]


class PrincipalFrame(NamedTuple):
    """Moments (3, ascending, kg m^2), axes (rows e1, e2, e3, right-handed) and groups of equal moments.

    Exact moments are not `ordered` when their order depends on symbols without a value.
    """

    moments: Array
    axes: Array
    groups: tuple[tuple[int, ...], ...]
    ordered: bool = True


def principal_frame(tensor: Floats) -> PrincipalFrame:
    """The principal frame of a body with that `tensor` (3 by 3, kg m^2).

    A moment below LEAST_MOMENT of the largest is zero. Raises ComputationError for entries beyond the range
    of floats.
    """
    if not np.isfinite(tensor).all():
        raise ComputationError("the inertia tensor is beyond the range of floating-point numbers")
    moments, rows = principal_moments(tensor)
    if moments[2] == 0:
        return PrincipalFrame(moments, np.eye(3), ((0, 1, 2),))
    groups = _groups(moments)
    return PrincipalFrame(moments, canonical_axes(rows, groups), groups)


def principal_moments(tensor: Floats) -> tuple[Floats, Floats]:
    """The moments (3, ascending) of a `tensor` (3 by 3), and unit vectors along their axes (rows)."""
    moments, columns = np.linalg.eigh(without_rounding(tensor))
    moments[moments <= LEAST_MOMENT * moments[2]] = 0.0
    return moments, columns.T


def _groups(values: Array) -> tuple[tuple[int, ...], ...]:
    """Indices of the ascending `values` in groups of equal ones."""
    # The two moments of a body without one of the three are equal by the triangle inequality.
    equal = EQUAL_MOMENTS if values[0] > 0 else np.inf
    groups = [[0]]
    for index, tolerance in ((1, EQUAL_MOMENTS), (2, equal)):
        if values[index] - values[index - 1] <= tolerance * values[2]:
            groups[-1].append(index)
        else:
            groups.append([index])
    return tuple(map(tuple, groups))


def canonical_axes(rows: Floats, groups: Sequence[Sequence[int]]) -> Floats:
    """Rows e1, e2, e3 from a unit vector along the axis of each moment (rows).

    e1 and e3 have a positive largest component, and e2 = e3 x e1 makes the frame right-handed. Where two
    moments are equal, the axis of the third one comes first. The coordinate axis that lies nearest to the
    plane across it is projected on that plane. Of components or axes that tie, the first counts.
    """
    if len(groups) == 1:
        return np.eye(3)
    # Numbers one by one, because arrays as small as these take ten times as long.
    first, _, third = rows.tolist()
    if len(groups) == 2:
        axis = first if len(groups[0]) == 1 else third
        pivot = _first_largest([-component * component for component in axis])
        width = math.sqrt(1 - axis[pivot] ** 2)
        across = [((k == pivot) - axis[pivot] * component) / width for k, component in enumerate(axis)]
        first, third = (axis, _cross(axis, across)) if axis is first else (across, axis)
    e1, e3 = _oriented(first), _oriented(third)
    return np.array([e1, _cross(e3, e1), e3])


def _oriented(axis: list[float]) -> list[float]:
    """A unit vector or its negative: the largest component is positive, and no zero has a sign."""
    sign = math.copysign(1.0, axis[_first_largest([component * component for component in axis])])
    return [sign * component + 0.0 for component in axis]


def _first_largest(values: Sequence[float]) -> int:
    """The index of the largest value, of those that are about equally large the first."""
    least = max(values) - PIVOT_TIE
    return next(k for k, value in enumerate(values) if value >= least)


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """The vector product; np.cross takes longer."""
    (u, v, w), (x, y, z) = a, b
    return [v * z - w * y, w * x - u * z, u * y - v * x]


def body_class(frame: PrincipalFrame) -> BodyClass | None:
    """What the moments say of the body, as for a top or a molecule; None where that depends on symbols."""
    if frame.moments[2] == 0:
        return "point"
    if frame.moments[0] == 0:
        return "linear"
    names: dict[tuple[int, ...], BodyClass] = {
        (3,): "spherical",
        (2, 1): "oblate",
        (1, 2): "prolate",
        (1, 1, 1): "asymmetric",
    }
    name = names[tuple(map(len, frame.groups))]
    return name if frame.ordered or name in ("spherical", "asymmetric") else None


def residual(tensor: Array, frame: PrincipalFrame) -> float:
    """max |I e - lambda e| / lambda3 over the three axes; 0 for a point."""
    largest = frame.moments[2]
    if largest == 0:
        return 0.0
    error = frame.axes @ (tensor / largest) - frame.axes * (frame.moments / largest)[:, None]
    return max(math.hypot(*row) for row in error.tolist())
