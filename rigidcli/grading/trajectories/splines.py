"""A trajectory between its samples: columns without jumps, and the spline through them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats

Trajectory: TypeAlias = Callable[[Floats], Floats]
"""The columns (k by m) at times (k)."""

ORDERS = (7, 5, 3, 1)
"""Degrees of the splines through samples: low ones are better where a motion is not smooth."""

EXACT = 1e-3
"""The part of a margin that is as good as nothing: no further degree is tried."""


def smooth(values: Floats, periods: Floats, quaternion: Sequence[int]) -> Floats:
    """Columns (n by m) without the jumps of angles by a period, and of quaternions to the opposite sign."""
    values, places = values.copy(), list(quaternion)
    for place in np.flatnonzero(np.isfinite(periods)):
        values[:, place] = np.unwrap(values[:, place], period=periods[place])
    turned = (values[1:, places] * values[:-1, places]).sum(axis=1) < 0
    values[1:, places] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    return values


def interpolated(times: Floats, values: Floats, margins: Floats, end: float) -> tuple[Trajectory, Floats]:
    """The spline through samples (n by m), and by how much it may be off between them (m).

    That is estimated up to the time `end` from every second sample, by which the others are missed by more.
    """
    from scipy.interpolate import make_interp_spline

    found: list[tuple[float, Trajectory, Floats]] = []
    rows = slice(1, 2 * int((times[1:-1:2] <= end).sum()), 2)
    for degree in ORDERS:
        # A spline of high degree may not be told from samples that are very near to each other.
        with suppress(np.linalg.LinAlgError):
            if degree < len(times[::2]):
                half = make_interp_spline(times[::2], values[::2], degree)
                off = np.abs(half(times[rows]) - values[rows]).max(axis=0, initial=0.0)
                worst = float(np.nan_to_num(off / margins, nan=np.inf).max())
                found.append((worst, make_interp_spline(times, values, degree), off))
                if worst < EXACT:
                    break
    return min(found, key=lambda each: each[0])[1:]
