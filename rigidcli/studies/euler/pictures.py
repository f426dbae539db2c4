"""The pictures of `euler`: omega in time, the polhode, and the trace of an axis on the sphere."""

from __future__ import annotations

import numpy as np

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import ROUNDING_OF_SUM
from rigidcli.picture import Mark, Panel, Picture, Ruler
from rigidcli.report import Column, Table
from rigidcli.studies.euler.motion import Trajectory
from rigidcli.studies.pictures.closed import polhode_picture, trace_picture

FAR = 3.0
"""How far apart components of omega are that have panels of their own, in units of their largest change."""


def omega(motion: Trajectory, samples: Table) -> Picture:
    """The components of omega, as the samples have them, in time."""
    t, turning = (_column(samples, key) for key in ("t", "omega"))
    panels, names = [], ("ω₁", "ω₂", "ω₃")
    for group in _groups(turning.values):
        marks = (
            Mark("line", np.column_stack([t.values, turning.values[:, k]]), names[k], style=k) for k in group
        )
        name = ", ".join(names[k] for k in group)
        panels.append(Panel((Ruler("t", unit=t.unit), Ruler(name, unit=turning.unit)), tuple(marks)))
    return Picture("omega", "angular velocity along the axes of the body", tuple(panels))


def _groups(values: Floats) -> list[list[int]]:
    """Which components (n, 3) share a panel: one far from the others has its own.

    So the small wobble of a fast top is seen.
    """
    low, high = values.min(axis=0), values.max(axis=0)
    order = [int(place) for place in np.argsort(low, kind="stable")]
    changes, groups = float((high - low).max()), [order[:1]]
    for place in order[1:]:
        gap = low[place] - high[groups[-1]].max()
        is_apart = gap > FAR * changes > ROUNDING_OF_SUM * np.abs(values).max()
        groups = [*groups, [place]] if is_apart else [*groups[:-1], sorted([*groups[-1], place])]
    return groups


def polhode(motion: Trajectory, samples: Table) -> Picture:
    """The path of omega in the body, on the ellipsoid of the energy at the start."""
    frame = motion.problem.frame
    path = _column(samples, "omega").values @ frame.axes.T
    return polhode_picture(frame.moments, path, motion.free is not None)


def trace(motion: Trajectory, samples: Table) -> Picture:
    """The path in space of the top's axis, or of e3."""
    third = motion.problem.third
    is_top = motion.problem.weight.any()
    name = "the axis of the top" if is_top and motion.free is None else "e₃"
    axis = rotation.turned(motion.orientation, third)
    return trace_picture(axis, name, f"path of {name} on the unit sphere")


def _column(samples: Table, key: str) -> Column:
    return next(column for column in samples.columns if column.key == key)
