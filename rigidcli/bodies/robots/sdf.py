"""Robots in SDF, of Gazebo: values stand in elements, and a `<pose>` is x y z with roll, pitch and yaw.

The tensor of an `<inertial>` is about its pose, which is the centre of mass in the frame of the link, along
the axes of that pose. What is not given has the values of the format: 1 kg, and a tensor of 1 kg m^2.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import ENTRIES, Body, Robot, Weight, placed, turned
from rigidcli.bodies.robots.urdf import Urdf
from rigidcli.errors import shown

NOT_GIVEN = dict(zip(ENTRIES, "100101", strict=True))
"""The entries of a tensor (kg m^2) that the format takes where they are not given."""

INFERRED = "no mass that is written: its simulator infers it from the collisions"
"""Why a link with `auto` has no mass properties here."""


def read(root: Element, folder: Path) -> Robot:
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


class _Sdf(Urdf):
    """A link has the same parts, in frames that are written in one line of numbers."""

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
