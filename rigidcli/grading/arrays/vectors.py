"""Vectors: the angle between two, and what depends on what a vector is of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.arrays.entries import worked
from rigidcli.grading.arrays.keys import computed
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.asked import Asked
from rigidcli.grading.numbers import NOISE, margin

DEGREE = math.radians(1)

RATE_FACTORS = {
    "degrees_radians": (DEGREE, 1 / DEGREE),
    "frequency_vs_angular_frequency": (2 * math.pi, 1 / (2 * math.pi)),
}
"""By what a rate is wrong when the angles in it are counted in another unit."""


def length(vector: Floats) -> float:
    """The length of a vector of any size."""
    return math.hypot(*vector.tolist())


def angle_between(one: Floats, other: Floats) -> float:
    """The angle (0 to pi, rad) between two vectors of any size and dimension; NaN where one is zero.

    2 atan2(|u - v|, |u + v|) of the unit vectors is accurate at all angles (W. Kahan, How Futile are Mindless
    Assessments of Roundoff, section 12).
    """
    with np.errstate(all="ignore"):
        u, v = one / np.abs(one).max(), other / np.abs(other).max()
        u, v = u / length(u), v / length(v)
    return 2 * math.atan2(length(u - v), length(u + v))


def without_noise(key: Reference, asked: Asked) -> Reference:
    """The key of a centre of mass at the origin as zeros: rounding leaves something of them."""
    size = _size(asked) if asked.path[-1:] == ("center_of_mass",) and not key.names else 0.0
    if not size or np.abs(key.values).max() > NOISE * size:
        return key
    tolerance = key.tolerance.model_copy(update={"absolute": margin(size, key.tolerance)})
    zeros = np.zeros_like(key.values)
    return replace(key, entries=zeros[0].astype(object), values=zeros, tolerance=tolerance)


def _size(asked: Asked) -> float:
    """The radius of gyration (m) of the body of a report; 0 where it is not known as a number."""
    report = asked.report
    if report is None or report.get("mass") is None:
        return 0.0
    numbers = worked(computed([*np.ravel(report["tensor"]), report["mass"]]), [{}])[0]
    *tensor, mass = np.abs(numbers).tolist()
    return math.sqrt(max(tensor) / mass) if np.isfinite(numbers).all() and mass else 0.0


def rate_codes(key: Reference, asked: Asked) -> tuple[str, ...]:
    """The factors of rates that a vector may be wrong by: none where no angle and no time is in its unit."""
    if key.unit is None:
        return () if asked.report is not None else tuple(RATE_FACTORS)
    dimension = key.unit.dimension
    if dimension.angle and dimension.time:
        return tuple(RATE_FACTORS)
    return ("degrees_radians",) if dimension.angle or dimension.time else ()


def in_other_frames(key: Reference, asked: Asked) -> Iterator[Floats]:
    """The same vector along the axes of the document, and along the principal axes."""
    if asked.document is None or key.shape != (3,):
        return
    frames = [asked.document.physical.axes] if asked.document.frame is not None else []
    principal = asked.report.get("axes") if asked.report is not None else None
    if isinstance(principal, np.ndarray):
        frames.append(principal)
    for frame in frames:
        yield np.einsum("kij,kj->ki", worked(computed(frame), key.points), key.values)
