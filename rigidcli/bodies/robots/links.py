"""The links of a robot as every format describes them: what a document says of a link, and its geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from rigidcli.errors import DocumentError, Problem, shortened

Body: TypeAlias = dict[str, Any]
"""A form of body, as the section `body` of a document has it."""

Weight: TypeAlias = tuple[Body, Mapping[str, int]] | str
"""The mass and the tensor of a link, as a body, and their lines; or the reason why a link has none."""

ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The entries of a tensor, in the order in which URDF and SDF write them."""

LISTED = 20
"""The most links that a message lists."""

NO_MASS = "no mass"
"""Why a link has no mass properties, in most cases."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """What a link looks like, or collides with, as its `role` says: of density 1 along the axes of the link.

    `body` is None for what has no form of which the volume is known, such as most meshes.
    """

    role: str
    body: Body | None


@dataclass(frozen=True, slots=True)
class Link:
    """A link: its name, where it is, and its mass properties as a document's body.

    `body` has a mass and a tensor about the centre of mass, at a `position` and turned by a `rotation` in the
    axes of the link. A link that has none is `without` it for a reason, or has a `problem`. `lines` are those
    of the mass, the tensor and so on. `geometry` is along the axes of the link.
    """

    name: str
    source: str
    line: int
    body: Body | None = None
    lines: Mapping[str, int] = field(default_factory=dict)
    geometry: Sequence[Geometry] = ()
    without: str = ""
    problem: Problem | None = None

    def line_of(self, key: str) -> int:
        """The line of the mass, the tensor or the position; of the tensor where that is not given."""
        return self.lines.get(key, self.lines.get("inertia", self.line))

    def weighed(self, read: Callable[[], Weight]) -> Link:
        """The link with what `read` gives, or with the problem that reading has."""
        try:
            weight = read()
        except DocumentError as error:
            (problem,) = error.problems
            return replace(self, problem=replace(problem, key=f"link {self.name}"))
        if isinstance(weight, str):
            return replace(self, without=weight)
        body, lines = weight
        return replace(self, body=body, lines=lines)


@dataclass(frozen=True, slots=True)
class Robot:
    """The links of a file, what is to be said of it as a whole, and a `cure` where no link has a mass."""

    links: Sequence[Link]
    notes: Sequence[str] = ()
    cure: str | None = None

    def named_once(self) -> Robot:
        """The robot, in which a link without a name, or with that of another one, has a problem."""
        links, first = [], dict[str, int]()
        for link in self.links:
            name = shortened(link.name)
            message = "" if name else "missing, expected a `name` of the link"
            if name in first:
                message = f"this name stands twice, first in line {first[name]}"
            first.setdefault(name, link.line)
            problem = link.problem
            if message and problem is None:
                problem = Problem(link.source, message, link.line, f"link {name}".rstrip())
            links.append(replace(link, name=name, problem=problem))
        return replace(self, links=links)


def listed(names: Sequence[str]) -> str:
    """The names of links, as many as a message has room for."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def placed(position: Sequence[Any], **turn: Any) -> Body:
    """A frame at a position, with the `rotation` or `axis` that turns it; nothing where it does not move."""
    return {"position": list(position), **turn} if any(position) else turn


def turned(angles: Sequence[Any], unit: str = "") -> Body:
    """The rotation of roll, pitch and yaw (rad, or with a `unit`): about the fixed x, then y, then z."""
    euler = [f"{angle}{unit}" if unit else angle for angle in reversed(angles)]
    return {"rotation": {"euler": euler, "sequence": "zyx"}} if any(angles) else {}
