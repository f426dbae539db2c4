"""Robots in SDF, of Gazebo: values stand in elements, and a `<pose>` is x y z with roll, pitch and yaw.

The tensor of an `<inertial>` is about its pose, which is the centre of mass in the frame of the link, along
the axes of that pose. What is not given has the values of the format: 1 kg, and a tensor of 1 kg m^2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from functools import partial
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
    lines,
    mesh,
    placed,
    shape,
    tensor,
    turned,
)

ROOT = "sdf"
"""The tag of the root."""

NOT_GIVEN = dict(zip(ENTRIES, "100101", strict=True))
"""The entries of a tensor (kg m^2) that the format takes where they are not given."""

NOTHING = "no `<inertial>`, for which simulators take 1 kg and 1 kg m^2"
"""Why a link without any mass properties has none here."""

INFERRED = "no mass that is written: its simulator infers it from the collisions"
"""Why a link with `auto` has no mass properties here."""


def read(root: Element, folder: Path) -> Robot:
    """The links of all models; where there are several models, with the names of these before them."""
    found = list(_elements(root, (), "link"))
    several = len({scope for scope, _ in found}) > 1
    links = [_link(link, scope if several else (), folder) for scope, link in found]
    notes = [f"`<include>` in line {each.line} is not followed" for _, each in _elements(root, (), "include")]
    notes += [
        f"link {link.name} (line {link.line}) is without `<mass>` or `<inertia>`: 1 kg and 1 kg m^2 are taken"
        for link in links
        if link.body is not None and not {"mass", "inertia"} <= link.lines.keys()
    ]
    return Robot(links, notes)


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
    full = "::".join([*scope, name]) if name else ""
    parts = geometries(link, lambda part: _form(part, folder))
    bare = Link(full, link.source, link.line, geometry=parts)
    return described(bare, lambda: _inertial(link))


def _inertial(link: Element) -> tuple[Body, Mapping[str, int]] | str:
    inertial = link.find("inertial")
    if inertial is None:
        return NOTHING
    if _is_true(inertial, "auto"):
        return INFERRED
    mass, entries, pose = map(inertial.find, ("mass", "inertia", "pose"))
    if pose is not None:
        frame = _relative_to(pose)
        if frame not in ("", link.attributes.get("name")):
            raise pose.refusal(f"`relative_to` is `{frame[:40]}`, expected the frame of the link")
    values = [_values(entries, key.lower(), 1, default)[0] for key, default in NOT_GIVEN.items()]
    (value,) = _values(inertial, "mass", 1, "1")
    return {"mass": value, "inertia": tensor(values), **_frame(pose)}, lines(mass, entries, pose)


def _is_true(element: Element, attribute: str) -> bool:
    return element.attributes.get(attribute, "").strip() in ("true", "1")


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
        return placed(position, rotation={"quaternion": [w, x, y, z]})
    values = in_text(pose.text, "`<pose>`", pose, 6)
    return placed(values[:3], **turned(values[3:], " deg" if _is_true(pose, "degrees") else ""))


def _form(part: Element, folder: Path) -> Body | None:
    """The geometry of a `<visual>` or `<collision>` that stands in the frame of the link."""
    geometry, pose = part.find("geometry"), part.find("pose")
    if geometry is None or (pose is not None and _relative_to(pose)):
        return None
    frame = _frame(pose)
    for element in geometry.children:
        uri = element.find("uri")
        if element.tag == "mesh" and uri is not None:
            return mesh(uri.text.strip(), folder, _values(element, "scale", 3, "1 1 1"), frame)
        return shape(element.tag, partial(_values, element), frame)
    return None
