"""Robots in MJCF, of MuJoCo: the bodies whose `<inertial>` says what they weigh.

The tensor of an `<inertial>` is about its `pos`, the centre of mass in the frame of the body: `diaginertia`
along axes that are turned, `fullinertia` along those of the body, entries M11 M22 M33 M12 M13 M23, off the
diagonal -sum m x y. What MuJoCo infers or changes is not worked out here: a body without an `<inertial>` has
no result, and a file that lets MuJoCo change what is written is refused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rigidcli.bodies.robots import ENTRIES, NO_MASS, Body, Link, Robot, Weight, placed
from rigidcli.bodies.robots.elements import Element
from rigidcli.errors import shown

INFERRED = "no `<inertial>`: MuJoCo infers mass and tensor from the geoms, if there are any"
"""Why a body has no mass properties here."""

SAVED = (
    'MuJoCo writes what it made of a file: put `<compiler saveinertial="true"/>` into it, '
    'and run `mujoco.mj_saveLastXML("saved.xml", mujoco.MjModel.from_xml_path(FILE))`'
)
"""How to come to a file that is read here. Without that setting MuJoCo 4 saves no `<inertial>` at all."""

ROUNDED = 1e-12
"""The relative error of a principal moment that is worked out from `fullinertia`."""

REPEATING = ("attach", "composite", "flexcomp", "replicate")
"""Elements from which MuJoCo makes bodies that are not written in the file."""

WAYS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
"""The attributes that turn a frame, at most one of which may stand, and how many numbers they have."""


def read_mjcf(root: Element, folder: Path) -> Robot:
    """The bodies, without the world. Raises DocumentError where MuJoCo changes what is written."""
    compiler, notes = dict[str, str](), list[str]()
    for element in root.below():
        if element.tag == "include":
            raise element.refusal("`<include>` is not read", SAVED)
        if element.tag in REPEATING:
            notes.append(f"bodies that `<{element.tag}>` in line {element.line} makes are left out")
    for element in root.all("compiler"):
        _require_as_written(element, root)
        compiler |= element.attributes
    names, links = Counter[str](), []
    for body in (element for world in root.all("worldbody") for element in world.below()):
        if body.tag == "body":
            name = body.attributes.get("name") or f"body in line {body.line}"
            names[name] += 1
            if "name" not in body.attributes and names[name] > 1:
                name = f"{name}, number {names[name]}"
            links.append(Link(name, body.source, body.line).weighed(partial(_weight, body, compiler)))
    return Robot(links, notes, SAVED)


def _require_as_written(compiler: Element, root: Element) -> None:
    """Raise DocumentError for a setting by which masses and tensors are not as they are written.

    A bound that no `<inertial>` is below changes nothing; MuJoCo keeps it in the files that it saves.
    """
    given = compiler.attributes
    changing = [key for key in ("inertiafromgeom", "balanceinertia") if given.get(key) == "true"]
    if compiler.numbers("settotalmass", 1, "0")[0] > 0:
        changing.append("settotalmass")
    bounds = {key: float(compiler.numbers(key, 1, "0")[0]) for key in ("boundmass", "boundinertia")}
    for element in root.below() if any(bound > 0 for bound in bounds.values()) else ():
        if element.tag == "inertial":
            xx, yy, zz, xy, xz, yz = map(float, _moments(element))
            least = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0] * (1 + ROUNDED)
            written = {"boundmass": float(element.numbers("mass", 1)[0]), "boundinertia": least}
            changing += [key for key, bound in bounds.items() if written[key] < bound]
    for key in changing:
        raise compiler.refusal(
            f"`{key}` lets MuJoCo change masses and tensors, expected them as they are written", SAVED
        )


def _moments(element: Element) -> list[Any]:
    """M11 M22 M33 M12 M13 M23 of an `<inertial>` (kg m^2). Raises DocumentError."""
    given = [key for key in ("diaginertia", "fullinertia") if key in element.attributes]
    if len(given) != 1:
        message = "expected one of `diaginertia` and `fullinertia`"
        raise element.refusal(f"{message}, read {'both' if given else 'none of them'}")
    if given == ["diaginertia"]:
        return [*element.numbers("diaginertia", 3), 0, 0, 0]
    if element.attributes.keys() & WAYS:
        message = "`fullinertia` is along the axes of the body, expected no orientation beside it"
        raise element.refusal(message)
    return element.numbers("fullinertia", 6)


def _weight(body: Element, compiler: Mapping[str, str]) -> Weight:
    element = body.find("inertial")
    for other in body.all("frame") if element is None else ():
        if other.find("inertial") is not None:
            message = "an `<inertial>` in a `<frame>` is not read, expected it in the body itself"
            raise other.refusal(message, SAVED)
    if element is None:
        return INFERRED
    (mass,) = element.numbers("mass", 1)
    if not mass:
        return NO_MASS
    frame = placed(element.numbers("pos", 3), **_turn(element, compiler))
    xx, yy, zz, xy, xz, yz = _moments(element)
    lines = dict.fromkeys(("mass", "inertia", "position"), element.line)
    inertia = dict(zip(ENTRIES, (xx, xy, xz, yy, yz, zz), strict=True))
    return {"mass": mass, "inertia": inertia, **frame}, lines


def _turn(element: Element, compiler: Mapping[str, str]) -> Body:
    ways = [way for way in WAYS if way in element.attributes]
    if len(ways) > 1:
        message = f"`{ways[0]}` and `{ways[1]}` both turn `<{element.tag}>`, expected one of them"
        raise element.refusal(message)
    if not ways:
        return {}
    values = element.numbers(ways[0], WAYS[ways[0]])

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
                read = shown(element.attributes["xyaxes"])
                raise element.refusal(f"`xyaxes`: read {read}, expected two directions")
            x, y = (axes * np.sign(lengths.diagonal())).T
            return {"rotation": {"matrix": np.array([x, y, np.cross(x, y)]).T.tolist()}}
