"""Principal moments and axes in one canonical frame: groups of equal moments, signs, handedness.

Where moments are equal, or a sign is free, the laws of mechanics leave a choice; here it is made
once, in the same way for floats and exact numbers, so that equal tensors get equal axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ComputationError

EQUAL_MOMENTS = 1e-12
"""Moments that differ by less, in units of the largest, are one group: rounding decides their axes."""

ZERO_MOMENT = 64 * float(np.finfo(np.float64).eps)
"""A moment below this, in units of the largest, is the rounding noise of a zero."""

PIVOT_TIE = 1e-9
"""Squared components of an axis that differ by less count as equally large, and the first is taken."""

BodyClass: TypeAlias = Literal["point", "linear", "spherical", "oblate", "prolate", "asymmetric"]


@dataclass(frozen=True, slots=True, eq=False)
class PrincipalFrame:
    """Moments (3, ascending, kg m^2), axes (rows e1, e2, e3, right-handed) and groups of equal moments.

    Exact moments are not `ordered` when their order depends on symbols without a value.
    """

    moments: Array
    axes: Array
    groups: tuple[tuple[int, ...], ...]
    ordered: bool = True


def principal_frame(tensor: Array) -> PrincipalFrame:
    """The principal frame of a symmetric tensor (3 by 3, floats, kg m^2).

    An axis is uncertain by about eps I3 / gap, where gap is the distance to the next moment.
    """
    scale = float(np.abs(tensor).max())
    if scale == 0:
        return PrincipalFrame(np.zeros(3), np.eye(3), ((0, 1, 2),))
    values, vectors = np.linalg.eigh(tensor / scale)
    values[values < ZERO_MOMENT * values[2]] = 0.0
    groups = _groups(values)
    projectors = [vectors[:, group] @ vectors[:, group].T for group in map(list, groups)]
    return PrincipalFrame(values * scale, canonical_axes(projectors, groups), groups)


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


def canonical_axes(projectors: Sequence[Floats], groups: Sequence[Sequence[int]]) -> Floats:
    """Rows e1, e2, e3 from the projector (3 by 3) on the space of each group of equal moments.

    In a group, the coordinate axis that lies nearest to the space is projected on it and
    normalised, and so on with what is left of the space; of coordinate axes that lie equally near, the
    first. For a single axis this is the rule "largest component positive". e3 = e1 x e2 makes the
    frame right-handed, and e3 yields.
    """
    axes = []
    for projector, group in zip(projectors, groups, strict=True):
        for _ in group:
            nearness = projector.diagonal()
            if not np.isfinite(nearness).all():
                raise ComputationError("the principal axes cannot be told")
            pivot = next(k for k in range(3) if nearness[k] >= max(nearness) - PIVOT_TIE)
            axis = projector[:, pivot] / math.sqrt(projector[pivot, pivot])
            projector = projector - np.outer(axis, axis)
            axes.append(axis)
    e1, e2, _ = axes
    return np.array([e1, e2, np.cross(e1, e2)])


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
    error = (tensor / largest) @ frame.axes.T - frame.axes.T * (frame.moments / largest)
    return float(np.linalg.norm(error, axis=0).max())
