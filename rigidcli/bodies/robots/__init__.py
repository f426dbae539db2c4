"""Robot descriptions: URDF, SDF and MJCF, read into links, whatever simulator they were written for."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from rigidcli.errors import DocumentError, Problem, ValueProblem, shown
from rigidcli.fields.texts import ending

if TYPE_CHECKING:
    from rigidcli.bodies.robots.links import Link, Robot

ENDINGS = (".urdf", ".sdf", ".world", ".xml", ".xacro")
"""How the names of robot descriptions end."""

READERS = {"robot": "urdf", "sdf": "sdf", "mujoco": "mjcf"}
"""The module of this package that reads a file, by the tag of its root."""


def is_robot(path: str) -> bool:
    """Whether a file has the name of a robot description."""
    return ending(path) in ENDINGS


def read_robot(text: str, source: str, folder: Path) -> Robot:
    """The links of the robot in `text`; the root of the file tells its format, as some end in `.xml` alike.

    Numbers are decimals, digit by digit; files that are named are looked for below `folder`. Raises
    DocumentError for what is no robot. What is wrong with one link is the problem of that link.
    """
    from rigidcli.bodies.robots.elements import read_elements

    root = read_elements(text, source)
    if root.tag not in READERS:
        expected = "a robot: `<robot>` of URDF, `<sdf>`, or `<mujoco>` of MJCF"
        raise root.refusal(f"read `<{root.tag[:40]}>`, expected {expected}")
    robot: Robot = import_module(f"{__name__}.{READERS[root.tag]}").read(root, folder)
    if not robot.links:
        raise root.refusal("there are no links in this robot", hint="; ".join(robot.notes) or None)
    return robot.named_once()


@lru_cache(maxsize=4)
def robot_of(text: str, source: str, folder: Path) -> Robot:
    """The robot of `read_robot`, kept for other documents that have one of its links."""
    return read_robot(text, source, folder)


def one_link(path: Path, name: str | None) -> Link:
    """The link of this name that has a mass, or without a name the only one.

    Raises ValueProblem, of which the message begins with the file and the line.
    """
    from rigidcli.bodies.robots.links import listed
    from rigidcli.fields.texts import read_text

    try:
        robot = robot_of(read_text(str(path), str(path)), str(path), path.parent)
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
