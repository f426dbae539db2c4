"""Robots in URDF, of ROS: an `<origin>` has a position, and roll, pitch and yaw about fixed axes.

The tensor of an `<inertial>` is about its origin, which is the centre of mass, along the axes of that origin.
Its products of inertia are entries of the tensor, -sum m x y.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import (
    ENTRIES,
    NO_MASS,
    TEMPLATE,
    Body,
    Link,
    Robot,
    described,
    geometries,
    lines,
    mesh,
    numbers,
    placed,
    shape,
    tensor,
    turned,
)

ROOT = "robot"
"""The tag of the root."""


def read(root: Element, folder: Path) -> Robot:
    """The links of the robot. Macros are not filled in, which is noted."""
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    notes = [] if macro is None else [f"`<{macro.tag[:40]}>` in line {macro.line}: {TEMPLATE}"]
    return Robot([_link(link, folder) for link in root.all("link")], notes)


def _link(link: Element, folder: Path) -> Link:
    parts = geometries(link, lambda part: _form(part, folder))
    bare = Link(link.attributes.get("name", ""), link.source, link.line, geometry=parts)
    return described(bare, lambda: _inertial(link))


def _inertial(link: Element) -> tuple[Body, Mapping[str, int]] | str:
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None or mass is None:
        return NO_MASS
    (value,) = numbers(mass, "value", 1)
    entries, origin = inertial.find("inertia"), inertial.find("origin")
    if entries is None and value:
        raise inertial.refusal("there is a mass and no `<inertia>`, expected its tensor")
    body = {"mass": value, **_frame(origin)}
    if entries is not None:
        body["inertia"] = tensor([numbers(entries, key.lower(), 1)[0] for key in ENTRIES])
    return body, lines(mass, entries, origin)


def _frame(origin: Element | None) -> Body:
    """The frame of an `<origin>`, which may be missing."""
    if origin is None:
        return {}
    position = numbers(origin, "xyz", 3, "0 0 0")
    return placed(position, **turned(numbers(origin, "rpy", 3, "0 0 0")))


def _form(part: Element, folder: Path) -> Body | None:
    """The geometry of a `<visual>` or `<collision>`."""
    frame = _frame(part.find("origin"))
    geometry = part.find("geometry")
    for element in () if geometry is None else geometry.children:
        if element.tag == "mesh":
            scale = numbers(element, "scale", 3, "1 1 1")
            return mesh(element.attributes.get("filename", ""), folder, scale, frame)
        return shape(element.tag, partial(numbers, element), frame)
    return None
