"""The pictures of `precess`: the effective potential of a top, the trace of an axis, and polhodes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rigidcli.core.nutation import effective_potential
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.picture import Mark, Panel, Picture, PictureAxis
from rigidcli.report import Value
from rigidcli.studies.common import require_values
from rigidcli.studies.euler import follow, pictures

COUNT = 1001  # points of a curve: more than a screen resolves


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
        Mark("line", np.column_stack([theta, heights]), "effective potential", style=0),
        Mark("line", level, "energy E", style=1),
        Mark("dots", np.array([[low, energy], [high, energy]]), "turning points", style=1),
    )
    rulers = PictureAxis("θ", unit="rad"), PictureAxis("V_eff", r"V_\mathrm{eff}", unit="J")
    return Picture("potential", "effective potential of the tilt", (Panel(rulers, marks),))


def trace(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of the axis of a top on the sphere, for as long as `euler` follows it."""
    if not _top(document, values)[1][-1]:
        raise UsageError("the trace is that of a top with weight, and this one has none")
    motion = follow(document)
    return pictures.trace(motion, motion.samples())


def polhode(document: Document, values: Mapping[str, Mapping[str, Value]]) -> Picture:
    """The path of omega in a free body, for as long as `euler` follows it."""
    if "free" not in values:
        raise UsageError("it is drawn for a `body` with `motion.omega`")
    motion = follow(document)
    return pictures.polhode(motion, motion.samples())


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
