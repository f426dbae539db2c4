"""Robot descriptions: URDF, SDF and MJCF, read into links, whatever simulator they were written for."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigidcli.model.robots.links import Decimals, Robot

READERS = {".urdf": "urdf", ".sdf": "sdf", ".xml": "mjcf"}
"""The reader of each ending of a file: a module of this package with the tag `ROOT` of a file and `read`."""


def is_robot(path: str) -> bool:
    """Whether a file has the name of a robot description."""
    return PurePath(path).suffix.lower() in READERS


def read_robot(text: str, source: str, folder: Path, decimal: Decimals = float) -> Robot:
    """The links of the robot in `text`; the root of the file tells its format, as some end in `.xml` alike.

    `decimal` makes numbers of texts; files that are named are looked for below `folder`. Raises
    DocumentError for what is no robot. What is wrong with one link is the problem of that link.
    """
    from rigidcli.model.robots.elements import read_elements
    from rigidcli.model.robots.links import bounded, named_once

    root = read_elements(text, source)
    for name in READERS.values():
        reader = import_module(f"{__name__}.{name}")
        if root.tag == reader.ROOT:
            robot: Robot = reader.read(root, folder, decimal)
            if not robot.links:
                raise root.refusal("there are no links in this robot")
            return bounded(named_once(robot))
    raise root.refusal(
        f"read `<{root.tag[:40]}>`, expected a robot: `<robot>` of URDF, `<sdf>`, or `<mujoco>` of MJCF"
    )
