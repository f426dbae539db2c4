"""The pictures of `precess`: the effective potential of a top, the trace of an axis, and polhodes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rigidcli.core import free_body, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.heavy_top import heavy_motion
from rigidcli.core.nutation import effective_potential
from rigidcli.core.tensor import Inertia
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.picture import Mark, Panel, Picture, Ruler
from rigidcli.report import Value
from rigidcli.studies.body import body_frame, principal_omega
from rigidcli.studies.common import require_values
from rigidcli.studies.pictures.closed import polhode_picture, trace_picture

COUNT = 1001
"""Points of a curve: more than a screen resolves."""

MOST_NUTATIONS = 24
"""The most nutations in a picture of the trace: more would fill the zone between the limits."""


def potential(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The effective potential of a top, with the energy and the turning points."""
    top, given = _top(document, values)
    low, high = top["theta_min"], top["theta_max"]
    at, energy = effective_potential(*given)
    half = max(0.75 * (high - low), 0.02, 0.02 * (low + high))
    middle = (low + high) / 2
    theta = np.linspace(max(middle - half, 1e-3), min(middle + half, math.pi - 1e-3), COUNT)
    heights = at(theta)
    depth = energy - float(at(np.linspace(low, high, COUNT)[1:-1]).min(initial=energy))
    room = max(depth, float(heights[len(heights) // 4 : -len(heights) // 4].max() - energy))
    heights = np.where(heights <= energy + 1.5 * room, heights, np.nan)
    level = np.array([[theta[0], energy], [theta[-1], energy]])
    marks = (
        Mark("line", np.column_stack([theta, heights]), "V_eff", style=0),
        Mark("line", level, "energy E", style=1),
        Mark("dots", np.array([[low, energy], [high, energy]]), "turning points", style=1),
    )
    rulers = Ruler("θ", unit="rad"), Ruler("V_eff", unit="J")
    return Picture("potential", "effective potential of the tilt", (Panel(rulers, marks),))


def trace(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of the axis of a top on the sphere, over one turn or some nutations; or of a planet's axis."""
    if "top" not in values and "tide" in values and document.tide is not None:
        require_values(document, "a picture")
        axis = _retrograde(float(document.tide.obliquity))
        return trace_picture(
            axis, "axis of the planet", "trace of the axis about the pole of the ecliptic, z"
        )
    top, (lambda1, lambda3, spin, tilt, start, nutation, fall) = _top(document, values)
    if not fall:
        raise UsageError("the trace is that of a top with weight, and this one has none")
    omega = np.array([nutation, start * math.sin(tilt), spin])
    orientation = np.array([math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0])
    period, rate = top["nutation_period"], top["mean_precession_rate"]
    turn = abs(2 * math.pi / rate) if rate else 0.0
    times = np.linspace(0, min(max(turn, period or 0.0), MOST_NUTATIONS * (period or turn)) or 1.0, 4 * COUNT)
    _, path = heavy_motion(lambda1, lambda3, fall, omega, orientation).at(times)
    axis = rotation.turned(path, np.array([0.0, 0.0, 1.0]))
    return trace_picture(axis, "axis of the top", "trace of the axis on the unit sphere, z upward")


def polhode(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of omega in a free body during one period."""
    if "free" not in values:
        raise UsageError("it is drawn for a `body` with `motion.omega`")
    require_values(document, "a picture")
    frame = body_frame(document)
    omega = principal_omega(document, frame)
    body, upright = Inertia.of(np.diag(frame.moments)), np.array([[1.0, 0, 0, 0]])
    times = np.linspace(0, free_body.periods(body, omega).period or 1.0, COUNT)
    return polhode_picture(frame.moments, free_body.motions(body, omega[None], upright, times)[0][0])


def _top(
    document: Document, values: Mapping[str, Mapping[str, Value]]
) -> tuple[Mapping[str, Value], tuple[float, ...]]:
    """The results for a top, and the numbers with which it starts, in the order of `core.nutation`."""
    if "top" not in values or document.top is None:
        raise UsageError("it is drawn for a `top`")
    require_values(document, "a picture")
    top, section = values["top"], document.top
    if top.get("theta_min") is None:
        raise UsageError("it needs `top.tilt`, `top.lambda1` and a precession to begin with")
    start = top["slow_rate"] if section.precession is None else section.precession
    fall = top["mass"] * section.gravity * top["distance"]
    given = (top["lambda1"], top["lambda3"], section.spin, section.tilt, start, section.nutation, fall)
    return top, tuple(map(float, given))


def _retrograde(tilt: float) -> Floats:
    """Unit vectors (n, 3) along an axis at this tilt (rad) that goes round z once, clockwise from above."""
    turn = -np.linspace(0, 2 * math.pi, COUNT)
    return np.column_stack(
        [math.sin(tilt) * np.cos(turn), math.sin(tilt) * np.sin(turn), np.full(COUNT, math.cos(tilt))]
    )
