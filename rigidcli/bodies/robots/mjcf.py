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

from rigidcli.bodies.robots.elements import Element
from rigidcli.bodies.robots.links import Body, Link, Robot, described, numbers, tensor
from rigidcli.bodies.robots.orientation import Angles, frame_of, is_turned

ROOT = "mujoco"
"""The tag of the root."""

INFERRED = "no `<inertial>`: MuJoCo infers mass and tensor from the geoms, if there are any"
"""Why a body has no mass properties here."""

LEAST = ("boundmass", "boundinertia", "settotalmass")
"""Settings of `<compiler>` that change masses or tensors where they are positive."""

REPEATING = ("attach", "composite", "flexcomp", "replicate")
"""Elements from which MuJoCo makes bodies that are not written in the file."""


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
    angles = Angles(compiler.get("angle", "degree") != "radian", compiler.get("eulerseq", "xyz"))
    names: Counter[str] = Counter()
    links = []
    for body in _below(*root.all("worldbody")):
        if body.tag != "body":
            continue
        link = _link(body, angles)
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


def _link(body: Element, angles: Angles) -> Link:
    def inertial() -> tuple[Body, Mapping[str, int]] | str:
        element = body.find("inertial")
        for frame in body.all("frame") if element is None else ():
            if any(each.tag == "inertial" for each in frame.children):
                raise frame.refusal(
                    "an `<inertial>` in a `<frame>` is not read, expected it in the body itself"
                )
        if element is None:
            return INFERRED
        return _inertial(element, angles), dict.fromkeys(("mass", "inertia", "position"), element.line)

    name = body.attributes.get("name") or f"body in line {body.line}"
    return described(Link(name, body.source, body.line), inertial)


def _inertial(element: Element, angles: Angles) -> Body:
    """The body of an `<inertial>`. Raises DocumentError."""
    numbers(element, "pos", 3)
    (mass,) = numbers(element, "mass", 1)
    frame = frame_of(element, angles)
    given = [key for key in ("diaginertia", "fullinertia") if key in element.attributes]
    if len(given) != 1:
        message = "expected one of `diaginertia` and `fullinertia`"
        raise element.refusal(f"{message}, read {'both' if given else 'none of them'}")
    if given == ["diaginertia"]:
        x, y, z = numbers(element, "diaginertia", 3)
        return {"mass": mass, "inertia": {"Ixx": x, "Iyy": y, "Izz": z}, **frame}
    if is_turned(element):
        raise element.refusal(
            "`fullinertia` is along the axes of the body, expected no orientation beside it"
        )
    xx, yy, zz, xy, xz, yz = numbers(element, "fullinertia", 6)
    return {"mass": mass, "inertia": tensor([xx, xy, xz, yy, yz, zz]), **frame}
