"""The geoms of MJCF with the defaults of their classes, as shapes of density 1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import Body, Decimals, numbers, placed, solid
from rigidcli.bodies.robots.orientation import WAYS, Angles, frame_of

Defaults: TypeAlias = dict[str, str]
"""Attributes of geoms that hold where they are not given."""

OUTERMOST = "main"
"""The class of defaults that holds where no other is named."""

SPANNED = ("capsule", "cylinder", "box", "ellipsoid")
"""The types of geoms that may be given from one point to another, `fromto`."""


def defaults(root: Element) -> dict[str, Defaults]:
    """The attributes of geoms by the names of classes; inner ones inherit."""
    classes: dict[str, Defaults] = {}

    def collect(element: Element, outer: Defaults, name: str) -> None:
        own = dict(outer)
        for geom in element.all("geom"):
            own = completed(geom.attributes, own)
        classes[name] = classes.get(name, {}) | own
        for inner in element.all("default"):
            collect(inner, classes[name], inner.attributes.get("class", ""))

    for element in root.all("default"):
        collect(element, {}, OUTERMOST)
    return classes


def completed(own: Mapping[str, str], outer: Mapping[str, str]) -> Defaults:
    """Attributes of a geom with those that hold outside, as MuJoCo takes them.

    The last numbers of `size` may stand outside, and any orientation takes the place of one outside.
    """
    turned = not own.keys().isdisjoint(WAYS)
    found = {key: text for key, text in outer.items() if not (turned and key in WAYS)}
    found |= own
    if "size" in own and "size" in outer:
        sizes = own["size"].split()
        found["size"] = " ".join([*sizes, *outer["size"].split()[len(sizes) :]])
    return found


def form(geom: Element, angles: Angles, decimal: Decimals) -> Body | None:
    """The shape of a geom, None for a plane, a mesh and others. Raises DocumentError where it is none."""
    kind = geom.attributes.get("type", "sphere")
    if kind not in ("sphere", *SPANNED) or "mesh" in geom.attributes:
        return None
    size = numbers(geom, "size", None, decimal)
    if "fromto" in geom.attributes and kind in SPANNED:
        ends = np.array(numbers(geom, "fromto", 6, decimal), dtype=float).reshape(2, 3)
        along = ends[1] - ends[0]
        frame: dict[str, Any] = placed(ends.mean(axis=0).tolist()) | {"axis": along.tolist()}
        half = float(np.linalg.norm(along)) / 2
        size = [*size[:1], half] if kind in ("capsule", "cylinder") else [*size[:1], *size[:1], half]
    else:
        frame = frame_of(geom, angles, decimal)
    needed = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}[kind]
    if len(size) < needed:
        raise geom.refusal(f"`size` has {len(size)} numbers, expected {needed}")
    match kind:
        case "sphere":
            return solid("sphere", frame, radius=size[0])
        case "box":
            return solid("box", frame, size=[2 * half for half in size[:3]])
        case "ellipsoid":
            return solid("ellipsoid", frame, semi_axes=size[:3])
    return solid(kind, frame, radius=size[0], height=2 * size[1])
