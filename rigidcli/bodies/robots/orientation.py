"""The ways in which MJCF turns a frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import Body, numbers, placed
from rigidcli.core import rotation
from rigidcli.core.arithmetic import FLOAT, Array
from rigidcli.errors import ValueProblem, shown

WAYS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
"""The attributes that turn a frame, at most one of which may stand, and how many numbers they have."""


@dataclass(frozen=True, slots=True)
class Angles:
    """How angles are written: in degrees or radians, and about which axes `euler` turns.

    Small letters are axes that turn along, capitals those that stay.
    """

    degrees: bool
    sequence: str

    def radians(self, angle: float) -> float:
        """An angle as it is written, in radians."""
        return radians(angle) if self.degrees else float(angle)


def is_turned(element: Element) -> bool:
    """Whether an element has an orientation."""
    return any(way in element.attributes for way in WAYS)


def frame_of(element: Element, angles: Angles) -> Body:
    """The frame that `pos` and an orientation make. Raises DocumentError where they make none."""
    position = numbers(element, "pos", 3, "0 0 0")
    ways = [way for way in WAYS if way in element.attributes]
    if len(ways) > 1:
        raise element.refusal(
            f"`{ways[0]}` and `{ways[1]}` both turn `<{element.tag}>`, expected one of them"
        )
    if not ways:
        return placed(position)
    (way,) = ways
    values = numbers(element, way, WAYS[way])
    if way == "zaxis":
        return placed(position) | {"axis": values}
    if way == "quat":
        return placed(position, {"quaternion": values})
    try:
        matrix = _matrix(way, list(map(float, values)), angles)
    except ValueProblem as problem:
        raise element.refusal(f"`{way}`: {problem.message}") from None
    return placed(position, {"quaternion": rotation.as_quaternion(matrix).tolist()})


def _matrix(way: str, values: list[float], angles: Angles) -> Array:
    """The rotation matrix (3 by 3) of the other orientations. Raises ValueProblem."""
    if way == "axisangle":
        return rotation.from_axis_angle(values[:3], angles.radians(values[3]), FLOAT)
    if way == "euler":
        return _euler(values, angles)
    x = rotation.direction(values[:3], FLOAT)
    y = rotation.direction((values[3:] - (values[3:] @ x) * x).tolist(), FLOAT)
    return np.column_stack([x, y, np.cross(x, y)])


def _euler(values: list[float], angles: Angles) -> Array:
    if len(angles.sequence) != 3 or not set(angles.sequence.lower()) <= set("xyz"):
        raise ValueProblem(f"`eulerseq` is {shown(angles.sequence)}, expected three of x, y, z, X, Y, Z")
    turned = np.eye(3)
    for letter, value in zip(angles.sequence, values, strict=True):
        axis = np.eye(3)["xyz".index(letter.lower())]
        turn = rotation.from_axis_angle(axis, angles.radians(value), FLOAT)
        turned = turned @ turn if letter.islower() else turn @ turned
    return turned
