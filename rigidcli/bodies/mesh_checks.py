"""Whether a mesh in a file encloses a body: what is wrong with it, and where."""

from __future__ import annotations

import pathlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies import mesh_files, surfaces
from rigidcli.bodies.surfaces import Surface
from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import ROUNDING_OF_SUM
from rigidcli.errors import ValueProblem

SAME_VERTEX = 1e-6
"""Vertices nearer than this, in units of the size, are one: single precision moves them by a tenth of it."""

MOST_TRIANGLES_COUNTED = 300_000
"""The most triangles of a mesh whose connected parts are counted, which takes a tenth of a second."""

LEAST_VOLUME_OF_PART = 1e-9
"""A part that encloses this share of the cube of the size is not flat."""

PROBES = 1024
"""About how many triangles, evenly chosen, are places where parts may overlap."""

STEP_FROM_TRIANGLE = 1e-6
"""How far from a triangle a point beside it is, in units of the size: single precision moves both."""

FARTHEST = 1e50
"""The largest coordinate, in the unit of the file: no sum goes beyond the range of floats."""


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """The surface in a file, with vertices merged where that was needed, and notes.

    `components` is the number of connected parts, None where the mesh is too large to count them. It
    `is_inward` where it is wound inside out.
    """

    surface: Surface
    notes: tuple[str, ...]
    components: int | None
    is_inward: bool


def checked(path: pathlib.Path) -> Checked:
    """The surface in a file, which is read once for any number of documents.

    Raises ValueProblem for what encloses no body.
    """
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _checked(path, (0, 0, 0))  # the reader says what is wrong
    return _checked(path, (status.st_ino, status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=4)
def _checked(path: pathlib.Path, state: tuple[int, int, int]) -> Checked:
    surface, notes = _summed(mesh_files.corners(path), path), list[str]()
    if not surface.is_closed:
        surface = _merged(surface, path, notes)
    if not surface.is_closed:
        raise _gap(surfaces.unpaired(surface.corners), path)
    if surface.is_flat:
        labels = surfaces.components(surfaces.vertex_keys(surface.corners))
        volumes = [Surface(surface.corners[:, :, labels == label]).volume for label in np.unique(labels)[:9]]
        if max(volumes) > LEAST_VOLUME_OF_PART * surface.size**3 and min(volumes) < 0:
            raise ValueProblem(
                f"{path}: its parts enclose {max(volumes):.6g} and {min(volumes):.6g} cubic units, "
                "so that one is inside out",
                hint="let the program that made the file orient its faces",
            )
        raise ValueProblem(
            f"{path}: flat: it encloses {abs(surface.volume):.3g} cubic units, and has an area of "
            f"{surface.area:.6g} square units"
        )
    is_inward = surface.volume < 0
    probes, count = np.arange(0, surface.triangles, max(1, surface.triangles // PROBES)), None
    labels = np.zeros(surface.triangles, dtype=np.intp)
    if surface.triangles <= MOST_TRIANGLES_COUNTED:
        labels = surfaces.components(surfaces.vertex_keys(surface.corners))
        first = np.sort(np.unique(labels, return_index=True)[1])
        probes, count = np.append(probes, first[:: -(-len(first) // PROBES)]), len(first)
    notes += _overlaps(path, surface, probes, labels, -1 if is_inward else 1)
    if is_inward:
        notes.append("it is wound inside out, and was turned")
    return Checked(surface, tuple(notes), count, is_inward)


def _summed(corners: Floats, path: pathlib.Path) -> Surface:
    """The surface with these corners. Raises ValueProblem where there are none that are finite."""
    surface = Surface(corners)
    if surface.triangles == 0:
        raise ValueProblem(f"{path}: no triangles")
    if not np.isfinite(surface.box).all():
        wrong = int(np.argmin(np.isfinite(corners).all(axis=(0, 1))))
        raise ValueProblem(
            f"{path}: triangle {wrong:,} (counted from 0) has a coordinate that is no finite number"
        )
    if np.abs(surface.box).max() > FARTHEST:
        raise ValueProblem(
            f"{path}: a coordinate of {np.abs(surface.box).max():.3g}, expected at most {FARTHEST:g}"
        )
    if not np.isfinite(surface.area) or surface.area <= 0:
        raise ValueProblem(f"{path}: the triangles have no area")
    return surface


def _merged(surface: Surface, path: pathlib.Path, notes: list[str]) -> Surface:
    """An open surface with near vertices made one.

    A closed surface needs none of this: its sums would change by no more than such distances.
    """
    distance = SAME_VERTEX * surface.size
    corners, count = surfaces.merged(surface.corners, surface.box, distance)
    if count == 0:
        return surface
    were = "1 vertex was" if count == 1 else f"{count:,} vertices were"
    notes.append(
        f"{were} nearer than {distance:.3g} units, {SAME_VERTEX:g} of its size, to others, and merged"
    )
    return _summed(corners, path)


# --- what is wrong


def _gap(gap: surfaces.Unpaired | None, path: pathlib.Path) -> ValueProblem:
    """Why a surface is not closed and wound in one sense, and where."""
    if gap is None:
        return ValueProblem(f"{path}: the surface is not closed")
    belong = "1 edge belongs" if gap.number == 1 else f"{gap.number:,} edges belong"
    start, end = map(_point, gap.edge)
    holes = "1 hole" if gap.holes == 1 else f"{gap.holes:,} holes"
    what, hint = {
        1: (
            f"open: {belong} to one triangle only",
            f"{holes}: close it in the program that made the file, or by Close Holes of MeshLab",
        ),
        2: (
            f"wound inconsistently: {belong} to triangles that do not agree where outside is",
            "let the program that made the file orient its faces (or recalculate its normals)",
        ),
    }.get(
        gap.uses,
        (
            f"not the surface of a body: {gap.uses} triangles meet in an edge",
            "inside and outside alternate round an edge, so that an even number of triangles meet there",
        ),
    )
    return ValueProblem(f"{path}: {what}, such as that from {start} to {end}", hint=hint)


def _point(point: Floats) -> str:
    return f"({', '.join(f'{coordinate:.9g}' for coordinate in point)})"


def _overlaps(
    path: pathlib.Path, surface: Surface, probes: NDArray[np.intp], labels: NDArray[np.intp], orientation: int
) -> list[str]:
    """Notes on places beside triangles, the `probes` (k), that a closed surface encloses not just once.

    Triangles (n) with the same of the `labels` hang together. Raises ValueProblem for a part that is wound
    the other way and lies outside the others, so that it encloses no space.
    """
    triangles = surface.some(probes)
    middles, normals = triangles.mean(axis=1), surfaces.normals(triangles)
    points = np.concatenate(
        [middles + side * STEP_FROM_TRIANGLE * surface.size * normals for side in (-1, 1)]
    )
    counts = orientation * surfaces.windings(surface.corners, surface.box, points)
    below, notes = np.flatnonzero(counts < 0), list[str]()
    for part, place in zip(*np.unique(np.tile(labels[probes], 2)[below], return_index=True), strict=True):
        if orientation * Surface(surface.corners[:, :, labels == part]).volume <= 0:
            raise ValueProblem(
                f"{path}: a part is wound the other way, and is no cavity, as it is outside the others: "
                f"{_point(points[below[place]])}",
                hint="let the program that made the file orient its faces",
            )
    if len(below):
        where = f"the surface crosses itself: {_point(points[below[0]])} is enclosed the wrong way round"
        notes.append(f"{where}, and counts as less than nothing; mend it in the program that made the file")
    # What no point has met may still be seen in the sums: no body has a negative mean of squares.
    spread = np.linalg.eigvalsh(surface.second)
    if spread[0] < -ROUNDING_OF_SUM * surface.cancelled * spread[2]:
        raise ValueProblem(f"{path}: overlaps itself: no body has the moments that come out")
    most = int(np.argmax(counts))
    if counts[most] > 1:
        text = f"parts overlap: {_point(points[most])} is inside {counts[most]} times, and counts as often"
        notes.append(f"{text}; to count it once, unite the parts in the program that made the file")
    return notes
