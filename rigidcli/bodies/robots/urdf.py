"""Robots in URDF, of ROS: an `<origin>` has a position, and roll, pitch and yaw about fixed axes.

The tensor of an `<inertial>` is about its origin, which is the centre of mass, along the axes of that origin.
Its products of inertia are entries of the tensor, -sum m x y.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rigidcli.bodies.robots.elements import TEMPLATE, Element
from rigidcli.bodies.robots.links import ENTRIES, Body, Format, Robot, placed, turned


def read(root: Element, folder: Path) -> Robot:
    """The links of the robot. Macros are not filled in, which is noted."""
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    notes = [] if macro is None else [f"`<{macro.tag[:40]}>` in line {macro.line}: {TEMPLATE}"]
    form = _Urdf(folder)
    return Robot([form.link(link, link.attributes.get("name", "")) for link in root.all("link")], notes)


class _Urdf(Format):
    """Numbers and names of files stand in attributes."""

    PLACE = "origin"

    def values(self, element: Element, key: str, count: int, default: str | None = None) -> list[Any]:
        return element.numbers(key, count, default)

    def frame(self, part: Element, link: Element) -> Body:
        origin = part.find("origin")
        if origin is None:
            return {}
        return placed(origin.numbers("xyz", 3, "0 0 0"), **turned(origin.numbers("rpy", 3, "0 0 0")))

    def file(self, mesh: Element) -> str:
        return mesh.attributes.get("filename", "")

    def mass(self, inertial: Element) -> Any:
        mass = inertial.find("mass")
        return 0 if mass is None else mass.numbers("value", 1)[0]

    def moments(self, inertial: Element) -> list[Any]:
        entries = inertial.find("inertia")
        if entries is None:
            raise inertial.refusal("there is a mass and no `<inertia>`, expected its tensor")
        return [entries.numbers(key.lower(), 1)[0] for key in ENTRIES]
