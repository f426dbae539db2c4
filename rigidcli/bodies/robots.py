"""Robots as links, whatever simulator their file was written for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from rigidcli.errors import DocumentError, Problem
from rigidcli.fields.texts import ending

ENDINGS = (".urdf", ".sdf", ".world", ".xml", ".xacro")  # how the names of robot descriptions end
Body: TypeAlias = dict[str, Any]  # a form of body, as the section `body` of a document has it
# What the mass and the tensor of a link make of it: its `body` and `lines`, or why it is `without` them.
Weight: TypeAlias = dict[str, Any]
# The entries of a tensor, in the order in which URDF and SDF write them.
ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
NO_MASS = "no mass"  # why a link has no mass properties, in most cases


class GeometryPart(NamedTuple):
    """A part of what a link looks like (visual) or collides with (collision), as a box along its `frame`.

    The box is that of a `mesh` in a file, or goes from -1 to 1 m. A `scale` (3) multiplies its lengths.
    """

    frame: Body
    scale: Sequence[Any]
    mesh: Path | None = None


class Link(NamedTuple):
    """A link: its name, where it is, and its mass properties as a document's body.

    `body` has a mass and a tensor about the centre of mass, at a `position` and turned by a `rotation` in the
    axes of the link. A link that has none is `without` it for a reason, or has a `problem`. `lines` are those
    of the mass, the tensor and so on. `geometry` has all of its parts, or none where some are not known.
    """

    name: str
    source: str
    line: int
    body: Body | None = None
    lines: Mapping[str, int] = {}
    geometry: Sequence[GeometryPart] = ()
    without: str = ""
    problem: Problem | None = None

    def line_of(self, key: str) -> int:
        """The line of the mass, the tensor or the position; of the tensor where that is not given."""
        return self.lines.get(key, self.lines.get("inertia", self.line))

    def weighed(self, read: Callable[[], Weight]) -> Link:
        """The link with what `read` gives, or with the problem that reading has."""
        try:
            return self._replace(**read())
        except DocumentError as error:
            (problem,) = error.problems
            return self._replace(problem=replace(problem, key=f"link {self.name}"))


class Robot(NamedTuple):
    """The links of a file, what is to be said of it as a whole, and a `cure` where no link has a mass."""

    links: Sequence[Link]
    notes: Sequence[str] = ()
    cure: str | None = None


def is_robot(path: str) -> bool:
    """Whether a file has the name of a robot description."""
    return ending(path) in ENDINGS
