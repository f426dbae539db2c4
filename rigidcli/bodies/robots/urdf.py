"""Robots in URDF, of ROS, and in SDF, of Gazebo.

The tensor of an `<inertial>` is about its frame, whose origin is the centre of mass, along the axes of that
frame; products of inertia are entries of the tensor, -sum m x y. A frame, `<origin>` or `<pose>` (in SDF),
has a position, and roll, pitch and yaw about fixed axes. In SDF values stand in elements.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from rigidcli.bodies.robots import ENTRIES, NO_MASS, Body, Link, LinkPart, Robot, Weight, placed, turned
from rigidcli.bodies.robots.elements import TEMPLATE, Element
from rigidcli.errors import DocumentError, shown

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

NOT_GIVEN = dict(zip(ENTRIES, "100101", strict=True))
"""The entries of a tensor (kg m^2) that SDF takes where they are not given."""

INFERRED = "no mass that is written: its simulator infers it from the collisions"
"""Why a link with `auto` has no mass properties here."""


def read_urdf(root: Element, folder: Path) -> Robot:
    """The links of the robot. Macros are not filled in, which is noted."""
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    notes = [] if macro is None else [f"`<{macro.tag[:40]}>` in line {macro.line}: {TEMPLATE}"]
    urdf = _Urdf(folder)
    return Robot([urdf.link(link, link.attributes.get("name", "")) for link in root.all("link")], notes)


@dataclass(frozen=True)
class _Urdf:
    """How the parts of a link are written; files of meshes are below a `folder`.

    `PLACE` is the tag of a frame, and `NOTHING` the reason why a link without `<inertial>` has no mass.
    """

    PLACE: ClassVar = "origin"
    NOTHING: ClassVar = NO_MASS

    folder: Path

    def frame(self, part: Element, link: Element) -> Body:
        origin = part.find("origin")
        if origin is None:
            return {}
        return placed(origin.numbers("xyz", 3, "0 0 0"), **turned(origin.numbers("rpy", 3, "0 0 0")))

    def mass(self, inertial: Element) -> Any:
        mass = inertial.find("mass")
        return 0 if mass is None else mass.numbers("value", 1)[0]

    def moments(self, inertial: Element) -> list[Any]:
        entries = inertial.find("inertia")
        if entries is None:
            raise inertial.refusal("there is a mass and no `<inertia>`, expected its tensor")
        moments = [entries.numbers(key.lower(), 1)[0] for key in ENTRIES]
        for key, number in zip(ENTRIES, moments, strict=True):
            other = f"i{key[2]}{key[1]}"
            if entries.numbers(other, 1, str(number))[0] != number:
                read = f"`{key.lower()}` is {number} and `{other}` is {entries.value(other)}"
                raise entries.refusal(f"{read}, expected one number, as a tensor is symmetric")
        return moments

    def weight(self, link: Element) -> Weight:
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
            parts.append(LinkPart(part.tag, body))
        return Link(name, element.source, element.line, geometry=parts).weighed(lambda: self.weight(element))

    def _form(self, part: Element, link: Element) -> Body | None:
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


def read_sdf(root: Element, folder: Path) -> Robot:
    """The links of all models; where there are several models, with the names of these before them."""
    elements = list(_in_models(root, (), "link"))
    several, form = len({scope for scope, _ in elements}) > 1, _Sdf(folder)
    links = [form.link(link, _full_name(link, scope if several else ())) for scope, link in elements]
    notes = [f"`<include>` in line {one.line} is not followed" for _, one in _in_models(root, (), "include")]
    notes += [
        f"link {link.name} (line {link.line}) is without `<mass>` or `<inertia>`: 1 kg and 1 kg m^2 are taken"
        for link in links
        if link.body is not None and not {"mass", "inertia"} <= link.lines.keys()
    ]
    return Robot(links, notes)


def _in_models(
    parent: Element, scope: tuple[str, ...], tag: str
) -> Iterator[tuple[tuple[str, ...], Element]]:
    """The elements of this tag in all models, with the names of the models about them."""
    for child in parent.children:
        if child.tag == tag:
            yield scope, child
        elif child.tag == "world":
            yield from _in_models(child, scope, tag)
        elif child.tag == "model":
            yield from _in_models(child, (*scope, child.attributes.get("name", "")), tag)


def _full_name(link: Element, scope: tuple[str, ...]) -> str:
    name = link.attributes.get("name", "")
    return "::".join([*scope, name]) if name else ""


class _Sdf(_Urdf):
    """The parts of a link in SDF: the same, with the numbers of a frame in one line."""

    PLACE = "pose"
    NOTHING = "no `<inertial>`, for which simulators take 1 kg and 1 kg m^2"

    def frame(self, part: Element, link: Element) -> Body:
        pose = part.find("pose")
        if pose is None:
            return {}
        seen_from = pose.attributes.get("relative_to", pose.attributes.get("frame", ""))  # in older files
        if seen_from not in ("", link.attributes.get("name")):
            raise pose.refusal(f"`relative_to` is {shown(seen_from)}, expected the frame of the link")
        if pose.attributes.get("rotation_format", "euler_rpy") == "quat_xyzw":
            *position, x, y, z, w = part.numbers("pose", 7, "0 0 0 0 0 0 1")
            return placed(position, rotation={"quaternion": [w, x, y, z]})
        values = part.numbers("pose", 6, "0 0 0 0 0 0")
        return placed(values[:3], **turned(values[3:], " deg" if pose.is_true("degrees") else ""))

    def mass(self, inertial: Element) -> Any:
        return inertial.numbers("mass", 1, "1")[0]

    def moments(self, inertial: Element) -> list[Any]:
        entries = inertial.find("inertia") or inertial
        return [entries.numbers(key.lower(), 1, default)[0] for key, default in NOT_GIVEN.items()]

    def weight(self, link: Element) -> Weight:
        inertial = link.find("inertial")
        return INFERRED if inertial is not None and inertial.is_true("auto") else super().weight(link)
