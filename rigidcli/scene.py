"""Motions to be replayed: marks that move, in views that a reader can choose from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rigidcli.picture import Mark
from rigidcli.report import Table, Value


@dataclass(frozen=True, slots=True)
class Part:
    """A mark along the three directions of a stage, and how it moves at the n times of a scene.

    `carried`: it turns with the body.
    `motion`: "still" has points (k, 3), and "sampled" points at each time (n, k, 3); "traced" is the path of
    one point (n, 3), drawn up to the present time, or as a whole if it is quiet.
    `group`: parts with the same group, or else the same label, are shown and hidden together.
    """

    mark: Mark
    motion: Literal["still", "sampled", "traced"] = "still"
    carried: bool = False
    group: str = ""


@dataclass(frozen=True, slots=True)
class Stage:
    """One view of a motion: parts in space with z upwards, or in the plane of x and y where it `is_flat`."""

    title: str
    parts: tuple[Part, ...]
    is_flat: bool = False


@dataclass(frozen=True, slots=True)
class Scene:
    """A motion to be replayed: the views that a reader can choose from, the first at the beginning.

    `readings` has a row for each of the `times` (n, s), the time itself in its first column, in units that a
    reader may have chosen. The body turns by `orientation`, quaternions (n, 4; scalar first) from body to
    space, and has angular velocities `omega` (n, 3; rad/s) along its own axes, which tell of whole turns
    between two times; both are None where nothing is carried.
    """

    title: str
    times: Value
    readings: Table
    stages: tuple[Stage, ...]
    orientation: Value = None
    omega: Value = None
