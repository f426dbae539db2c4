"""Robots in SDF, of Gazebo: values stand in elements, and a `<pose>` is x y z with roll, pitch and yaw.

The tensor of an `<inertial>` is about its pose, which is the centre of mass in the frame of the link, along
the axes of that pose. What is not given has the values of the format: 1 kg, and a tensor of 1 kg m^2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import (
    ENTRIES,
    Body,
    Link,
    Robot,
    described,
    geometries,
    in_text,
    mesh,
    placed,
    roll_pitch_yaw,
    solid,
    tensor,
)

ROOT = "sdf"
"""The tag of the root."""

NOT_GIVEN = dict(zip(ENTRIES, "100101", strict=True))
"""What the format takes for entries of a tensor (kg m^2) that are not given."""

NOTHING = "no `<inertial>`, for which simulators take 1 kg and 1 kg m^2"
"""Why a link without any mass properties has none here."""

INFERRED = "no mass that is written: its simulator infers it from the collisions"
"""Why a link with `auto` has no mass properties here."""


def read(root: Element, folder: Path) -> Robot:
    """The links of all models; where there are several models, with the names of these before them."""
    found = list(_links(root, ()))
    several = len({scope for scope, _ in found}) > 1
    links = [_link(link, scope if several else (), folder) for scope, link in found]
    included = [element for _, element in _elements(root, (), "include")]
    notes = [f"`<include>` in line {element.line} is not followed" for element in included]
    notes += [
        f"link {link.name} (line {link.line}) is without `<mass>` or `<inertia>`: 1 kg and 1 kg m^2 are taken"
        for link in links
        if link.body is not None and not {"mass", "inertia"} <= link.lines.keys()
    ]
    return Robot(links, notes)


def _links(root: Element, scope: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Element]]:
    return _elements(root, scope, "link")


def _elements(parent: Element, scope: tuple[str, ...], tag: str) -> Iterator[tuple[tuple[str, ...], Element]]:
    """The elements of this tag in all models, each with the names of the models about it."""
    for child in parent.children:
        if child.tag == tag:
            yield scope, child
        elif child.tag == "world":
            yield from _elements(child, scope, tag)
        elif child.tag == "model":
            yield from _elements(child, (*scope, child.attributes.get("name", "")), tag)


def _link(link: Element, scope: tuple[str, ...], folder: Path) -> Link:
    name = link.attributes.get("name", "")
    parts = geometries(link.all("visual", "collision"), lambda part: _form(part, folder))
    full = "::".join([*scope, name]) if name else ""
    bare = Link(full, link.source, link.line, geometry=parts)
    return described(bare, lambda: _inertial(link))


def _inertial(link: Element) -> tuple[Body, Mapping[str, int]] | str:
    inertial = link.find("inertial")
    if inertial is None:
        return NOTHING
    if inertial.attributes.get("auto", "").strip() in ("true", "1"):
        return INFERRED
    mass, entries, pose = map(inertial.find, ("mass", "inertia", "pose"))
    if pose is not None:
        frame = _relative_to(pose)
        if frame not in ("", link.attributes.get("name")):
            raise pose.refusal(f"`relative_to` is `{frame[:40]}`, expected the frame of the link")
    values = [_values(entries, key.lower(), 1, default)[0] for key, default in NOT_GIVEN.items()]
    (value,) = _values(inertial, "mass", 1, "1")
    body = {"mass": value, "inertia": tensor(values), **_frame(pose)}
    elements = {"mass": mass, "inertia": entries, "position": pose, "rotation": pose}
    return body, {key: element.line for key, element in elements.items() if element is not None}


def _values(parent: Element | None, tag: str, count: int, default: str = "") -> list[Any]:
    """The numbers in the child with this tag, or the default ones. Raises DocumentError."""
    child = None if parent is None else parent.find(tag)
    if child is None:
        if not default:
            assert parent is not None
            raise parent.refusal(f"`<{parent.tag}>` has no `<{tag}>`")
        return [Decimal(word) for word in default.split()]
    return in_text(child.text, f"`<{tag}>`", child, count)


def _relative_to(pose: Element) -> str:
    """The frame in which a pose is, `frame` in older files; "" for that of the element about it."""
    return pose.attributes.get("relative_to", pose.attributes.get("frame", ""))


def _frame(pose: Element | None) -> Body:
    """The frame of a `<pose>`, which may be missing or empty. Raises DocumentError."""
    if pose is None or not pose.text.strip():
        return {}
    if pose.attributes.get("rotation_format", "euler_rpy") == "quat_xyzw":
        *position, x, y, z, w = in_text(pose.text, "`<pose>`", pose, 7)
        return placed(position, {"quaternion": [w, x, y, z]})
    *position, roll, pitch, yaw = in_text(pose.text, "`<pose>`", pose, 6)
    angles = [roll, pitch, yaw]
    if pose.attributes.get("degrees", "").strip() in ("true", "1") and any(angles):
        angles = [f"{angle} deg" for angle in angles]
    return placed(position, roll_pitch_yaw(angles))


def _form(part: Element, folder: Path) -> Body | None:
    """The geometry of a `<visual>` or `<collision>` that stands in the frame of the link."""
    shapes, pose = part.find("geometry"), part.find("pose")
    if shapes is None or (pose is not None and _relative_to(pose)):
        return None
    frame = _frame(pose)
    for shape in shapes.children:

        def size(key: str, count: int = 1, shape: Element = shape) -> list[Any]:
            return _values(shape, key, count)

        match shape.tag:
            case "box":
                return solid("box", frame, size=size("size", 3))
            case "ellipsoid":
                return solid("ellipsoid", frame, semi_axes=size("radii", 3))
            case "sphere":
                return solid("sphere", frame, radius=size("radius")[0])
            case "cylinder" | "capsule":
                return solid(shape.tag, frame, radius=size("radius")[0], height=size("length")[0])
            case "mesh":
                uri = shape.find("uri")
                scale = _values(shape, "scale", 3, "1 1 1")
                return None if uri is None else mesh(uri.text.strip(), folder, scale, frame)
    return None
