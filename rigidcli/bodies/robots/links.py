"""The links of a robot as every format describes them: what a document says of each, and its geometry."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from rigidcli.bodies.robots.elements import Element
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import DocumentError, Problem, shortened, shown

Body = dict[str, Any]
"""A form of body, as the section `body` of a document has it."""

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
"""A number as XML files write it."""

MOST_DIGITS = 400
"""The most characters of a number: more than any float needs, fewer than are slow to read."""

LARGEST = 1e100
"""The largest number: no robot has it, and its square is still a float."""

ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The entries of a tensor, in the order in which URDF and SDF write them."""

ROWS, COLUMNS = np.triu_indices(3)
"""The places of `ENTRIES` in the matrix of a tensor."""

LARGEST_MESH = 20_000_000
"""The largest file (bytes) of a mesh that is compared with its link: one of 400,000 triangles."""

ROUND = {"radius": ("radius", 1), "height": ("length", 1)}

SHAPES = {
    "box": {"size": ("size", 3)},
    "ellipsoid": {"semi_axes": ("radii", 3)},
    "sphere": {"radius": ("radius", 1)},
    "cylinder": ROUND,
    "capsule": ROUND,
}
"""The dimensions of shapes, with their names in the files and the count of their numbers."""

LISTED = 20
"""The most links that a message lists."""

TEMPLATE = "this is a template: `xacro FILE > robot.urdf` fills it in"
"""What to do with a file that has macros of ROS in it."""

NO_MASS = "no mass"
"""Why a link has no mass properties, in most cases."""


@dataclass(frozen=True, slots=True)
class Geometry:
    """What a link looks like, or collides with, as its `role` says: of density 1 along the axes of the link.

    `body` is None for what has no form of which the volume is known, such as most meshes.
    """

    role: str
    body: Body | None


@dataclass(frozen=True, slots=True)
class Link:
    """A link: its name, where it is, and its mass properties as a document's body.

    `body` has a mass and a tensor about the centre of mass, at a `position` and turned by a `rotation` in the
    axes of the link. A link that has none is `without` it for a reason, or has a `problem`. `lines` are those
    of the mass, the tensor and so on. `geometry` is along the axes of the link.
    """

    name: str
    source: str
    line: int
    body: Body | None = None
    lines: Mapping[str, int] = field(default_factory=dict)
    geometry: Sequence[Geometry] = ()
    without: str = ""
    problem: Problem | None = None

    def line_of(self, key: str) -> int:
        """The line of the mass, the tensor or the position; of the tensor where that is not given."""
        return self.lines.get(key, self.lines.get("inertia", self.line))


@dataclass(frozen=True, slots=True)
class Robot:
    """The links of a file, and what is to be said of the file as a whole."""

    links: Sequence[Link]
    notes: Sequence[str] = ()


def described(bare: Link, inertial: Callable[[], tuple[Body, Mapping[str, int]] | str]) -> Link:
    """A link with its mass properties and their lines, the reason why there are none, or their problem."""
    try:
        found = inertial()
    except DocumentError as error:
        (problem,) = error.problems
        return replace(bare, problem=replace(problem, key=f"link {bare.name}"))
    if isinstance(found, str):
        return replace(bare, without=found)
    body, lines = found
    if body.get("mass") == 0:
        return replace(bare, without=NO_MASS)
    return replace(bare, body=body, lines=lines)


def named_once(robot: Robot) -> Robot:
    """The robot, in which a link has a problem where its name is missing or stands before; none is long."""
    links, first = [], dict[str, int]()
    for link in robot.links:
        link = replace(link, name=shortened(link.name))
        message = "" if link.name else "missing, expected a `name` of the link"
        if link.name in first:
            message = f"this name stands twice, first in line {first[link.name]}"
        first.setdefault(link.name, link.line)
        if message and link.problem is None:
            problem = Problem(link.source, message, link.line, f"link {link.name}".rstrip())
            link = replace(link, problem=problem)
        links.append(link)
    return replace(robot, links=links)


def listed(names: Sequence[str]) -> str:
    """The names of links, as many as a message has room for."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def numbers(element: Element, attribute: str, count: int, default: str | None = None) -> list[Any]:
    """The numbers in an attribute, `count` of them. Raises DocumentError for anything else.

    Without the attribute those of the `default`, where there is one.
    """
    text = element.attributes.get(attribute, default)
    if text is None:
        raise element.refusal(f"`<{element.tag}>` has no `{attribute}`, expected {_counted(count)}")
    return in_text(text, f"`{attribute}` of `<{element.tag}>`", element, count)


def in_text(text: str, what: str, element: Element, count: int) -> list[Any]:
    """The numbers in a text of an element, `count` of them, separated by blanks. Raises DocumentError."""
    words = text.split()
    bad = [word for word in words if len(word) > MOST_DIGITS or NUMBER.fullmatch(word) is None]
    large = [word for word in words if not bad and abs(float(word)) > LARGEST]
    if not bad and not large and len(words) == count:
        return [Decimal(word) for word in words]
    hint = None
    if "${" in text or "$(" in text:
        hint = TEMPLATE
    elif bad and "," in text:
        hint = "numbers are separated by blanks, and the sign in a decimal is a point"
    elif large:
        hint = f"no number of a robot is larger than {LARGEST:g}"
    raise element.refusal(f"{what}: read {shown(text)}, expected {_counted(count)}", hint=hint)


def _counted(count: int) -> str:
    return "a number" if count == 1 else f"{count} numbers"


def tensor(entries: Sequence[Any]) -> dict[str, Any]:
    """The entries Ixx, Ixy, Ixz, Iyy, Iyz, Izz of a tensor by their names."""
    return dict(zip(ENTRIES, entries, strict=True))


def matrix(entries: Sequence[float] | Floats) -> Floats:
    """The symmetric tensor (3 by 3) of its entries Ixx, Ixy, Ixz, Iyy, Iyz, Izz."""
    found = np.empty((3, 3))
    found[ROWS, COLUMNS] = found[COLUMNS, ROWS] = entries
    return found


def lines(mass: Element | None, entries: Element | None, place: Element | None) -> dict[str, int]:
    """The lines of the mass, the tensor and the frame, of those that are there."""
    found = {"mass": mass, "inertia": entries, "position": place, "rotation": place}
    return {key: element.line for key, element in found.items() if element is not None}


def placed(position: Sequence[Any], **turn: Any) -> Body:
    """A frame at a position, with the `rotation` or `axis` that turns it; nothing where it does not move."""
    return {"position": list(position), **turn} if any(position) else turn


def turned(angles: Sequence[Any], unit: str = "") -> Body:
    """The rotation of roll, pitch and yaw (rad, or with a `unit`): about the fixed x, then y, then z."""
    euler = [f"{angle}{unit}" if unit else angle for angle in reversed(angles)]
    return {"rotation": {"euler": euler, "sequence": "zyx"}} if any(angles) else {}


def geometries(link: Element, body: Callable[[Element], Body | None]) -> list[Geometry]:
    """The geometry of a link; one that cannot be read is like one of unknown volume."""
    found = []
    for element in link.all("visual", "collision"):
        form = None
        with suppress(DocumentError):
            form = body(element)
        found.append(Geometry(element.tag, form))
    return found


def shape(tag: str, read: Callable[[str, int], list[Any]], frame: Body) -> Body | None:
    """A shape of density 1 in a frame, of which `read` gives the dimensions; None for other geometry."""
    if tag not in SHAPES:
        return None
    sizes = {ours: read(theirs, count) for ours, (theirs, count) in SHAPES[tag].items()}
    plain = {key: values[0] if len(values) == 1 else values for key, values in sizes.items()}
    return {"shape": tag, "density": 1, **plain, **frame}


def mesh(name: str, folder: Path, scale: Sequence[Any], frame: Body) -> Body | None:
    """A mesh of density 1 in a frame, from a file below the folder of the robot.

    `package://` and the like stand for that folder, or for what is above the next name. None where there is
    no such file, or a very large one, where another library would have to read it, once for each link,
    and where the scales along x, y and z differ.
    """
    from rigidcli.bodies.mesh_files import OWN

    rest = re.sub(r"^\w+://", "", name)
    for guess in (rest, rest.partition("/")[2]) if Path(name).suffix.lower() in OWN else ():
        path = folder / guess
        with suppress(OSError, ValueError):  # no file has such a name
            inside = path.resolve().is_relative_to(folder.resolve())
            if inside and path.is_file() and path.stat().st_size <= LARGEST_MESH and len(set(scale)) == 1:
                return {"mesh": str(path.resolve()), "density": 1, "scale": scale[0], **frame}
    return None
