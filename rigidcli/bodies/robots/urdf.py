"""Robots in URDF, of ROS: an `<origin>` has a position, and roll, pitch and yaw about fixed axes.

The tensor of an `<inertial>` is about its origin, which is the centre of mass, along the axes of that origin.
Its products of inertia are entries of the tensor, -sum m x y.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from rigidcli.bodies.robots.elements import TEMPLATE, Element
from rigidcli.bodies.robots.links import (
    ENTRIES,
    NO_MASS,
    Body,
    Geometry,
    Link,
    Robot,
    Weight,
    placed,
    turned,
)
from rigidcli.errors import DocumentError

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


def read(root: Element, folder: Path) -> Robot:
    """The links of the robot. Macros are not filled in, which is noted."""
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    notes = [] if macro is None else [f"`<{macro.tag[:40]}>` in line {macro.line}: {TEMPLATE}"]
    urdf = Urdf(folder)
    return Robot([urdf.link(link, link.attributes.get("name", "")) for link in root.all("link")], notes)


@dataclass(frozen=True)
class Urdf:
    """How the parts of a link are written; files of meshes are below a `folder`.

    `PLACE` is the tag of a frame, and `NOTHING` the reason why a link without `<inertial>` has no mass.
    """

    PLACE: ClassVar = "origin"
    NOTHING: ClassVar = NO_MASS

    folder: Path

    def frame(self, part: Element, link: Element) -> Body:
        """The frame of a part of a link, as seen from the link. Raises DocumentError."""
        origin = part.find("origin")
        if origin is None:
            return {}
        return placed(origin.numbers("xyz", 3, "0 0 0"), **turned(origin.numbers("rpy", 3, "0 0 0")))

    def mass(self, inertial: Element) -> Any:
        """The mass (kg). Raises DocumentError."""
        mass = inertial.find("mass")
        return 0 if mass is None else mass.numbers("value", 1)[0]

    def moments(self, inertial: Element) -> list[Any]:
        """The `ENTRIES` of the tensor (kg m^2). Raises DocumentError."""
        entries = inertial.find("inertia")
        if entries is None:
            raise inertial.refusal("there is a mass and no `<inertia>`, expected its tensor")
        moments = [entries.numbers(key.lower(), 1)[0] for key in ENTRIES]
        for key, number in zip(ENTRIES, moments, strict=True):
            other = f"i{key[2]}{key[1]}"
            if (
                key[1] != key[2]
                and entries.value(other) is not None
                and entries.numbers(other, 1)[0] != number
            ):
                read = f"`{key.lower()}` is {number} and `{other}` is {entries.value(other)}"
                raise entries.refusal(f"{read}, expected one number, as a tensor is symmetric")
        return moments

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
        inertia = dict(zip(ENTRIES, self.moments(inertial), strict=True))
        return {"mass": mass, "inertia": inertia, **frame}, lines

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
        sizes = {ours: form.numbers(*theirs) for ours, theirs in SHAPES[form.tag].items()}
        plain = {key: values[0] if len(values) == 1 else values for key, values in sizes.items()}
        return {"shape": form.tag, "density": 1, **plain, **frame}

    def _mesh(self, form: Element, frame: Body) -> Body | None:
        """A mesh of density 1 in a frame.

        `package://` and the like stand for the folder of the robot, or for what is above the next name. None
        where there is no such file, or a very large one, where another library would have to read it, once
        for each link, and where the scales along x, y and z differ.
        """
        from rigidcli.bodies.mesh_files import OWN

        name, scale = form.value("filename") or form.value("uri") or "", form.numbers("scale", 3, "1 1 1")
        rest = re.sub(r"^\w+://", "", name)
        for guess in (rest, rest.partition("/")[2]) if Path(name).suffix.lower() in OWN else ():
            path = self.folder / guess
            with suppress(OSError, ValueError):  # no file has such a name
                inside = path.resolve().is_relative_to(self.folder.resolve())
                if inside and path.is_file() and path.stat().st_size <= LARGEST_MESH and len(set(scale)) == 1:
                    return {"mesh": str(path.resolve()), "density": 1, "scale": scale[0], **frame}
        return None
