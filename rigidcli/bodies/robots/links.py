"""The links of a robot as every format describes them: what a document says of a link, and its geometry."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

from rigidcli.bodies.robots.elements import Element
from rigidcli.errors import DocumentError, Problem, shortened

Body: TypeAlias = dict[str, Any]
"""A form of body, as the section `body` of a document has it."""

Weight: TypeAlias = tuple[Body, Mapping[str, int]] | str
"""The mass and the tensor of a link, as a body, and their lines; or the reason why a link has none."""

ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The entries of a tensor, in the order in which URDF and SDF write them."""

ROUND = {"radius": ("radius", 1), "height": ("length", 1)}

SHAPES = {
    "box": {"size": ("size", 3)},
    "ellipsoid": {"semi_axes": ("radii", 3)},
    "sphere": {"radius": ("radius", 1)},
    "cylinder": ROUND,
    "capsule": ROUND,
}
"""The dimensions of shapes, with their names in the files and the count of their numbers."""

LARGEST_MESH = 20_000_000
"""The largest file (bytes) of a mesh that is compared with its link: one of 400,000 triangles."""

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
    """The links of a file, and what is to be said of the file as a whole."""

    links: Sequence[Link]
    notes: Sequence[str] = ()

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


def tensor(entries: Sequence[Any]) -> Body:
    """The entries Ixx, Ixy, Ixz, Iyy, Iyz, Izz of a tensor by their names."""
    return dict(zip(ENTRIES, entries, strict=True))


def placed(position: Sequence[Any], **turn: Any) -> Body:
    """A frame at a position, with the `rotation` or `axis` that turns it; nothing where it does not move."""
    return {"position": list(position), **turn} if any(position) else turn


def turned(angles: Sequence[Any], unit: str = "") -> Body:
    """The rotation of roll, pitch and yaw (rad, or with a `unit`): about the fixed x, then y, then z."""
    euler = [f"{angle}{unit}" if unit else angle for angle in reversed(angles)]
    return {"rotation": {"euler": euler, "sequence": "zyx"}} if any(angles) else {}


@dataclass(frozen=True, slots=True)
class Format(ABC):
    """How URDF and SDF, which have the same elements in a link, write numbers, frames and names of files.

    Files are looked for below the `folder` of the robot. `PLACE` is the tag of a frame, and `NOTHING` is the
    reason why a link without `<inertial>` has no mass.
    """

    PLACE: ClassVar[str]
    NOTHING: ClassVar[str] = NO_MASS

    folder: Path

    @abstractmethod
    def values(self, element: Element, key: str, count: int, default: str | None = None) -> list[Any]:
        """The numbers of an element under a key, `count` of them. Raises DocumentError."""

    @abstractmethod
    def frame(self, part: Element, link: Element) -> Body:
        """The frame of a part of a link, as seen from the link. Raises DocumentError."""

    @abstractmethod
    def file(self, mesh: Element) -> str:
        """The name of the file of a mesh."""

    @abstractmethod
    def mass(self, inertial: Element) -> Any:
        """The mass (kg). Raises DocumentError."""

    @abstractmethod
    def moments(self, inertial: Element) -> list[Any]:
        """The `ENTRIES` of the tensor (kg m^2). Raises DocumentError."""

    def weight(self, link: Element) -> Weight:
        """The mass and the tensor of a link. Raises DocumentError."""
        inertial = link.find("inertial")
        if inertial is None:
            return self.NOTHING
        mass, frame = self.mass(inertial), self.frame(inertial, link)
        if not mass:
            return NO_MASS
        places = {"mass": "mass", "inertia": "inertia", "position": self.PLACE, "rotation": self.PLACE}
        elements = {key: inertial.find(tag) for key, tag in places.items()}
        lines = {key: element.line for key, element in elements.items() if element is not None}
        return {"mass": mass, "inertia": tensor(self.moments(inertial)), **frame}, lines

    def link(self, element: Element, name: str) -> Link:
        """A link. Geometry that cannot be read is like that of unknown volume."""
        parts = []
        for part in element.all("visual", "collision"):
            body = None
            with suppress(DocumentError):
                body = self._form(part, element)
            parts.append(Geometry(part.tag, body))
        bare = Link(name, element.source, element.line, geometry=parts)
        return bare.weighed(lambda: self.weight(element))

    def _form(self, part: Element, link: Element) -> Body | None:
        """The geometry of a part: a shape or a mesh of density 1, or None. Raises DocumentError."""
        frame, geometry = self.frame(part, link), part.find("geometry")
        if geometry is None or not geometry.children:
            return None
        form = geometry.children[0]
        if form.tag == "mesh":
            return self._mesh(form, frame)
        if form.tag not in SHAPES:
            return None
        sizes = {ours: self.values(form, *theirs) for ours, theirs in SHAPES[form.tag].items()}
        plain = {key: values[0] if len(values) == 1 else values for key, values in sizes.items()}
        return {"shape": form.tag, "density": 1, **plain, **frame}

    def _mesh(self, form: Element, frame: Body) -> Body | None:
        """A mesh of density 1 in a frame.

        `package://` and the like stand for the folder of the robot, or for what is above the next name. None
        where there is no such file, or a very large one, where another library would have to read it, once
        for each link, and where the scales along x, y and z differ.
        """
        from rigidcli.bodies.mesh_files import OWN

        name, scale = self.file(form), self.values(form, "scale", 3, "1 1 1")
        rest = re.sub(r"^\w+://", "", name)
        for guess in (rest, rest.partition("/")[2]) if Path(name).suffix.lower() in OWN else ():
            path = self.folder / guess
            with suppress(OSError, ValueError):  # no file has such a name
                inside = path.resolve().is_relative_to(self.folder.resolve())
                if inside and path.is_file() and path.stat().st_size <= LARGEST_MESH and len(set(scale)) == 1:
                    return {"mesh": str(path.resolve()), "density": 1, "scale": scale[0], **frame}
        return None
