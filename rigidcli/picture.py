"""Pictures of a result as data: panels with rulers, and marks in them. Renderers choose the looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class PictureAxis:
    """What a direction of a panel measures: `name` in plain text, `symbol` in LaTeX, and the unit."""

    name: str
    symbol: str = ""
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Mark:
    """Something drawn in a panel with d rulers (d = 2 or 3).

    `points`: of a line or of dots (n, d), the ends of an arrow (2, d), plane faces (each k by 3), or for
    contours the coordinates x (n), y (m) and the heights (m, n), drawn at the heights `levels`.
    `label`: for the legend.
    `style`: a place in the lists of colours and line styles. `quiet` marks are thin and grey.
    `normals`: (n, 3) of a line on a closed surface; they tell its far side.
    `is_rough`: the faces only come near the surface, so that their edges are not its edges.
    """

    form: Literal["line", "dots", "arrow", "faces", "contours"]
    points: Any
    label: str = ""
    style: int = 0
    quiet: bool = False
    levels: tuple[float, ...] = ()
    normals: Any = None
    is_rough: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """Marks along two or three rulers; where it `is_even`, a length is the same in each direction."""

    rulers: tuple[PictureAxis, ...]
    marks: tuple[Mark, ...]
    title: str = ""
    is_even: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of a result: its kind, a title, and panels that stand in so many columns."""

    kind: str
    title: str
    panels: tuple[Panel, ...]
    columns: int = 1
