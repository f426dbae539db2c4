"""Robot descriptions: URDF, SDF and MJCF, read into links, whatever simulator they were written for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from rigidcli.errors import DocumentError, Problem, ValueProblem, shortened, shown
from rigidcli.fields.texts import ending, read_text

ENDINGS = (".urdf", ".sdf", ".world", ".xml", ".xacro")
"""How the names of robot descriptions end."""

READERS = {"robot": "urdf.read_urdf", "sdf": "urdf.read_sdf", "mujoco": "mjcf.read_mjcf"}
"""The function of a module of this package that reads a file, by the tag of its root."""

Body: TypeAlias = dict[str, Any]
"""A form of body, as the section `body` of a document has it."""

Weight: TypeAlias = tuple[Body, Mapping[str, int]] | str
"""The mass and the tensor of a link, as a body, and their lines; or the reason why a link has none."""

ENTRIES = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The entries of a tensor, in the order in which URDF and SDF write them."""

LISTED = 20
"""The most links that a message lists."""

NO_MASS = "no mass"
"""Why a link has no mass properties, in most cases."""


class LinkPart(NamedTuple):
    """What a link looks like, or collides with, as its `role` says: of density 1 along the axes of the link.

    `body` is None where the volume is not known, as that of most meshes.
    """

    role: str
    body: Body | None


class Link(NamedTuple):
    """A link: its name, where it is, and its mass properties as a document's body.

    `body` has a mass and a tensor about the centre of mass, at a `position` and turned by a `rotation` in the
    axes of the link. A link that has none is `without` it for a reason, or has a `problem`. `lines` are those
    of the mass, the tensor and so on. `geometry` is along the axes of the link.
    """

    name: str
    source: str
    line: int
    body: Body | None = None
    lines: Mapping[str, int] = {}
    geometry: Sequence[LinkPart] = ()
    without: str = ""
    problem: Problem | None = None

    def line_of(self, key: str) -> int:
        """The line of the mass, the tensor or the position; of the tensor where that is not given."""
        return self.lines.get(key, self.lines.get("inertia", self.line))

    def weighed(self, read: Callable[[], Weight]) -> Link:
        """The link with what `read` gives, or with the problem that reading has."""
        try:
            weight = read()
        except DocumentError as error:
            (problem,) = error.problems
            return self._replace(problem=replace(problem, key=f"link {self.name}"))
        if isinstance(weight, str):
            return self._replace(without=weight)
        body, lines = weight
        return self._replace(body=body, lines=lines)


class Robot(NamedTuple):
    """The links of a file, what is to be said of it as a whole, and a `cure` where no link has a mass."""

    links: Sequence[Link]
    notes: Sequence[str] = ()
    cure: str | None = None

    def named_once(self) -> Robot:
        """The robot, in which a link without a name, or with that of another one, has a problem."""
        links, first = [], dict[str, int]()
        for link in self.links:
            name = shortened(link.name)
            message = "" if name else "missing, expected a `name` of the link"
            if name in first:
                message = f"this name stands twice, first in line {first[name]}"
            first.setdefault(name, link.line)
            problem = link.problem
            if message and problem is None:
                problem = Problem(link.source, message, link.line, f"link {name}".rstrip())
            links.append(link._replace(name=name, problem=problem))
        return self._replace(links=links)


def listed(names: Sequence[str]) -> str:
    """The names of links, as many as a message has room for."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def placed(position: Sequence[Any], **turn: Any) -> Body:
    """A frame at a position, with the `rotation` or `axis` that turns it; nothing where it does not move."""
    return {"position": list(position), **turn} if any(position) else turn


def turned(angles: Sequence[Any], unit: str = "") -> Body:
    """The rotation of roll, pitch and yaw (rad, or with a `unit`): about the fixed x, then y, then z."""
    euler = [f"{angle}{unit}" if unit else angle for angle in reversed(angles)]
    return {"rotation": {"euler": euler, "sequence": "zyx"}} if any(angles) else {}


def is_robot(path: str) -> bool:
    """Whether a file has the name of a robot description."""
    return ending(path) in ENDINGS


@lru_cache(maxsize=4)  # for documents that have one of its links each
def read_robot(text: str, source: str, folder: Path) -> Robot:
    """The links of the robot in `text`; the root of the file tells its format, as some end in `.xml` alike.

    Numbers are decimals, digit by digit; files that are named are looked for below `folder`. Raises
    DocumentError for what is no robot. What is wrong with one link is the problem of that link.
    """
    from rigidcli.bodies.robots.elements import read_elements  # with expat

    root = read_elements(text, source)
    if root.tag not in READERS:
        expected = "a robot: `<robot>` of URDF, `<sdf>`, or `<mujoco>` of MJCF"
        raise root.refusal(f"read `<{root.tag[:40]}>`, expected {expected}")
    module, _, reader = READERS[root.tag].partition(".")
    robot: Robot = getattr(import_module(f"{__name__}.{module}"), reader)(root, folder)
    if not robot.links:
        raise root.refusal("there are no links in this robot", hint="; ".join(robot.notes) or None)
    return robot.named_once()


def one_link(path: Path, name: str | None) -> Link:
    """The link of this name that has a mass, or without a name the only one.

    Raises ValueProblem. Its message begins with the file and the line.
    """

    try:
        robot = read_robot(read_text(str(path), str(path)), str(path), path.parent)
    except DocumentError as error:
        raise _as_value(error.problems[0]) from None
    links = robot.links
    named = [link for link in links if (not link.without if name is None else link.name == name)]
    if len(named) == 1 and named[0].problem is not None and not named[0].without:
        raise _as_value(named[0].problem)
    if len(named) == 1 and not named[0].without:
        return named[0]
    if named and name is not None:
        raise ValueProblem(f"{path}:{named[0].line}: link {name}: {named[0].without}", hint=robot.cure)
    weighed = listed([link.name for link in links if not link.without])
    read = f"there is no link {shown(name)}" if name else f"there are {len(named)} links with a mass"
    raise ValueProblem(f"{path}: {read}, expected the name of one", hint=f"with a mass: {weighed}")


def _as_value(problem: Problem) -> ValueProblem:
    return ValueProblem(str(replace(problem, hint=None)), hint=problem.hint)
