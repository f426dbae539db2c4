"""What is suspicious in a robot's links, and the slip behind a tensor that no body has.

A link's geometry is what simulators draw (visual) and let touch (collision). Here it is only a box: real
robots draw thin shells and parts of links, in which a mass is not spread evenly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from itertools import product
from typing import Any

import numpy as np

from rigidcli.bodies import mesh_files
from rigidcli.bodies.composites import weighed
from rigidcli.bodies.points import PointMasses
from rigidcli.bodies.robots import ENTRIES, GeometryPart, Link
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import Problem, RigidError
from rigidcli.fields.environment import Environment

# A centre of mass is suspicious farther outside the box of the geometry, in units of its diagonal.
FAR_OUTSIDE = 0.25
FAR_OUTSIDE_IN_MM = 10.0  # it may be in mm where it is farther outside than this
ALIKE = 1.01  # the extents of a ball differ by less than this factor
PLACES = (-3, -2, -1, 1, 2, 3)  # by how many places a decimal point slips


@np.errstate(all="ignore")  # coordinates of meshes may be as large as floats are
def remarks(link: Link, notes: Sequence[str]) -> list[Problem]:
    """The notes on the body of a link, and what is suspicious in it, with file and line."""
    said = [("inertia", note, None) for note in notes]
    return [
        Problem(link.source, f"note: {text}", link.line_of(key), f"link {link.name}", hint)
        for key, text, hint in (*said, *_suspicions(link))
    ]


def _suspicions(link: Link) -> Iterator[tuple[str, str, str | None]]:
    """A key, a reason and a hint for what is odd in the tensor and the centre of mass."""
    whole, box = weighed(link.body or {}), _box(link)
    if link.body is None or whole is None:
        return
    if reason := _placeholder(link.body["inertia"], box is not None and _is_ball(whole, box)):
        yield "inertia", reason, None
    if box is None:
        return
    distance, diagonal = _distance(whole.com, box), float(np.linalg.norm(box[1] - box[0]))
    if distance > FAR_OUTSIDE * diagonal:
        where = ", ".join(f"{part:.6g}" for part in whole.com)
        text = f"the centre of mass ({where}) m is {distance:.3g} m outside the box of its geometry"
        is_in_mm = distance > FAR_OUTSIDE_IN_MM * diagonal and _distance(whole.com / 1e3, box) == 0
        hint = "the position may be in mm, expected m" if is_in_mm else None
        yield "position", f"{text}, whose diagonal is {diagonal:.3g} m", hint


def _placeholder(inertia: Mapping[str, Any], is_ball: bool) -> str | None:
    """Why a tensor (kg m^2) looks as if nobody had worked it out; a ball has equal moments, too."""
    xx, xy, xz, yy, yz, zz = (float(inertia[key]) for key in ENTRIES)
    if any((xy, xz, yz)) or not xx == yy == zz:
        return None
    if xx == 0:
        return "the tensor is zero: this is a point, which most simulators refuse or change"
    if f"{xx:e}".startswith("1.000000e") and not is_ball:
        return f"{xx:g} kg m^2 for each moment looks like a placeholder"
    return None


@np.errstate(all="ignore")
def repair(link: Link) -> str | None:
    """The slip in one entry that explains a tensor that no body has; None unless a single one does.

    A sign is wrong, or a decimal point is some places off. Without the slip, the tensor must be one that a
    body in the box of the geometry can have.
    """
    body = link.body
    if body is None or weighed(body) is not None:
        return None
    box, found = _box(link), list[str]()
    for key, entry in body["inertia"].items():
        for slip, mended in _mended(entry):
            whole = weighed({**body, "inertia": {**body["inertia"], key: mended}})
            if whole is not None and (box is None or _fits(whole, box)):
                found.append(f"{key} = {mended:g} instead of {entry:g} (a slip of {slip})")
    if len(found) != 1:
        return None
    return f"a body would have it with {found[0]}; no other single slip explains it"


def _mended(entry: Decimal) -> Iterator[tuple[str, Decimal]]:
    """The slips that an entry may come from, and the entries that were meant."""
    if entry:
        yield "the sign", -entry
        for places in PLACES:
            yield "the decimal point", entry.scaleb(places)


# --- the box of the geometry


def _box(link: Link) -> Floats | None:
    """The least and the greatest coordinates (2 by 3, m) of the geometry; None where it is not known."""
    with suppress(RigidError, KeyError, ValueError):  # there is none, or a mesh cannot be read
        corners = np.vstack([_corners(part) for part in link.geometry])
        return np.array([corners.min(axis=0), corners.max(axis=0)])
    return None


def _corners(part: GeometryPart) -> Floats:
    """The corners (8 by 3, m) of the box of a part, along the axes of the link."""
    box = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    if part.mesh is not None:
        triangles = mesh_files.OWN[part.mesh.suffix.lower()](part.mesh)  # other readers take a second each
        box = np.array([triangles.min(axis=(0, 2)), triangles.max(axis=(0, 2))], dtype=np.float64)
    corners = np.array(list(product(*(box * np.array(part.scale, dtype=np.float64)).T)))
    origin = PointMasses.model_validate({"points": [[1, 0, 0, 0]], **part.frame}, context=Environment())
    turn, shift = origin.motion(FLOAT)
    return np.asarray(corners @ turn.T + shift)


def _distance(point: Floats, box: Floats) -> float:
    """How far (m) a point (3, m) is outside a box (2 by 3, m)."""
    return float(np.linalg.norm(np.maximum(np.maximum(box[0] - point, point - box[1]), 0.0)))


def _fits(whole: MassProperties, box: Floats) -> bool:
    """Whether a body with all of its mass in the box (2 by 3, m) can have this tensor.

    In a range of length a, the mean square distance from the centre of mass is at most (a/2)^2: with half of
    the mass at either end.
    """
    squares = np.trace(whole.tensor) / 2 - whole.tensor.diagonal()  # sum m x^2 along x, y and z
    return bool((squares <= whole.mass * (np.ptp(box, axis=0) / 2) ** 2).all())


def _is_ball(whole: MassProperties, box: Floats) -> bool:
    """Whether the body may be a ball, or a cube, in the box (2 by 3, m)."""
    extents = np.ptp(box, axis=0)
    return bool(extents.max() < ALIKE * extents.min()) and _fits(whole, box)
