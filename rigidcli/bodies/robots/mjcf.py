"""Robots in MJCF, of MuJoCo: the bodies whose `<inertial>` says what they weigh.

The tensor of an `<inertial>` is about its `pos`, the centre of mass in the frame of the body: `diaginertia`
along axes that are turned, `fullinertia` along those of the body, entries M11 M22 M33 M12 M13 M23, off the
diagonal -sum m x y. What MuJoCo infers or changes is not worked out here: a body without an `<inertial>` has
no result, and a file that lets MuJoCo change what is written is refused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import Body, Link, Robot, described, numbers, placed, tensor
from rigidcli.errors import shown

ROOT = "mujoco"
"""The tag of the root."""

INFERRED = "no `<inertial>`: MuJoCo infers mass and tensor from the geoms, if there are any"
"""Why a body has no mass properties here."""

LEAST = ("boundmass", "boundinertia", "settotalmass")
"""Settings of `<compiler>` that change masses or tensors where they are positive."""

REPEATING = ("attach", "composite", "flexcomp", "replicate")
"""Elements from which MuJoCo makes bodies that are not written in the file."""

WAYS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
"""The attributes that turn a frame, at most one of which may stand, and how many numbers they have."""


def read(root: Element, folder: Path) -> Robot:
    """The bodies, without the world. Raises DocumentError where MuJoCo changes what is written."""
    compiler: dict[str, str] = {}
    makers = []
    for element in _below(root):
        if element.tag == "include":
            raise element.refusal(
                "`<include>` is not read", hint="give each file by itself, or put them into one"
            )
        if element.tag in REPEATING:
            makers.append(f"bodies that `<{element.tag}>` in line {element.line} makes are left out")
    for element in root.all("compiler"):
        _require_as_written(element)
        compiler |= element.attributes
    names: Counter[str] = Counter()
    links = []
    for body in _below(*root.all("worldbody")):
        if body.tag == "body":
            link = _link(body, compiler)
            names[link.name] += 1
            if "name" not in body.attributes and names[link.name] > 1:
                link = replace(link, name=f"{link.name}, number {names[link.name]}")
            links.append(link)
    return Robot(links, makers)


def _require_as_written(compiler: Element) -> None:
    """Raise DocumentError for a setting by which masses and tensors are not as they are written."""
    given = compiler.attributes
    changing = [key for key in ("inertiafromgeom", "balanceinertia") if given.get(key) == "true"]
    changing += [key for key in LEAST if numbers(compiler, key, 1, "0")[0] > 0]
    for key in changing:
        raise compiler.refusal(
            f"`{key}` lets MuJoCo change masses and tensors, expected them as they are written",
            hint="MuJoCo itself writes what it made of them: `mujoco.mj_saveLastXML`",
        )


def _below(*elements: Element) -> Iterator[Element]:
    for element in elements:
        yield element
        yield from _below(*element.children)


def _link(body: Element, compiler: Mapping[str, str]) -> Link:
    def inertial() -> tuple[Body, Mapping[str, int]] | str:
        element = body.find("inertial")
        for frame in body.all("frame") if element is None else ():
            if any(each.tag == "inertial" for each in frame.children):
                raise frame.refusal(
                    "an `<inertial>` in a `<frame>` is not read, expected it in the body itself"
                )
        if element is None:
            return INFERRED
        return _inertial(element, compiler), dict.fromkeys(("mass", "inertia", "position"), element.line)

    name = body.attributes.get("name") or f"body in line {body.line}"
    return described(Link(name, body.source, body.line), inertial)


def _inertial(element: Element, compiler: Mapping[str, str]) -> Body:
    """The body of an `<inertial>`. Raises DocumentError."""
    (mass,) = numbers(element, "mass", 1)
    frame = placed(numbers(element, "pos", 3), **_turn(element, compiler))
    given = [key for key in ("diaginertia", "fullinertia") if key in element.attributes]
    if len(given) != 1:
        message = "expected one of `diaginertia` and `fullinertia`"
        raise element.refusal(f"{message}, read {'both' if given else 'none of them'}")
    if given == ["diaginertia"]:
        x, y, z = numbers(element, "diaginertia", 3)
        return {"mass": mass, "inertia": {"Ixx": x, "Iyy": y, "Izz": z}, **frame}
    if element.attributes.keys() & WAYS:
        raise element.refusal(
            "`fullinertia` is along the axes of the body, expected no orientation beside it"
        )
    xx, yy, zz, xy, xz, yz = numbers(element, "fullinertia", 6)
    return {"mass": mass, "inertia": tensor([xx, xy, xz, yy, yz, zz]), **frame}


def _turn(element: Element, compiler: Mapping[str, str]) -> Body:
    """The orientation of an element, as a `rotation` or an `axis` of a document. Raises DocumentError."""
    ways = [way for way in WAYS if way in element.attributes]
    if len(ways) > 1:
        raise element.refusal(
            f"`{ways[0]}` and `{ways[1]}` both turn `<{element.tag}>`, expected one of them"
        )
    if not ways:
        return {}
    values = numbers(element, ways[0], WAYS[ways[0]])

    def angle(value: Any) -> Any:
        return value if compiler.get("angle") == "radian" else f"{value} deg"

    match ways[0]:
        case "zaxis":
            return {"axis": values}
        case "quat":
            return {"rotation": {"quaternion": values}}
        case "axisangle":
            return {"rotation": {"axis": values[:3], "angle": angle(values[3])}}
        case "euler":
            letters = compiler.get("eulerseq", "xyz")
            if len(letters) != 3 or not set(letters.lower()) <= set("xyz"):
                raise element.refusal(f"`eulerseq` is {shown(letters)}, expected three of x, y, z, X, Y, Z")
            # A capital is an axis that stays: its turn comes before all turns so far.
            order = [k for k in (2, 1, 0) if letters[k].isupper()]
            order += [k for k in range(3) if letters[k].islower()]
            sequence = "".join(letters[k].lower() for k in order)
            return {"rotation": {"euler": [angle(values[k]) for k in order], "sequence": sequence}}
        case _:
            x, y = np.array(values, dtype=np.float64).reshape(2, 3)
            axes, lengths = np.linalg.qr(np.array([x, y]).T)
            if not abs(lengths[0, 0] * lengths[1, 1]) > 1e-12 * (x @ x + y @ y):
                raise element.refusal(f"`xyaxes`: read {values}, expected two directions")
            x, y = (axes * np.sign(lengths.diagonal())).T
            return {"rotation": {"matrix": np.array([x, y, np.cross(x, y)]).T.tolist()}}
