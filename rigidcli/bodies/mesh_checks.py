"""Whether a mesh in a file encloses a body: what is wrong with it, and where."""

from __future__ import annotations

import pathlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies import edges, inside, mesh_files, surfaces
from rigidcli.bodies.edges import Read
from rigidcli.bodies.surfaces import Surface
from rigidcli.core import memory
from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import ROUNDING
from rigidcli.errors import ValueProblem

MERGED = 1e-6
"""Vertices nearer than this, in units of the size, are one: single precision moves them by a tenth of it."""

MERGING = 1_000
"""Bytes a triangle that merging may take; without so much memory a mesh stays as it is."""

FARTHEST = 1e50
"""The largest coordinate, in the unit of the file: no sum goes beyond the range of floats."""


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """The surface in a file, merged where that was needed, how to read it, and notes.

    `components` is the number of parts that hang together, None where the mesh is too large to count them.
    It `is_inward` where it is wound inside out.
    """

    surface: Surface
    read: Read
    notes: tuple[str, ...]
    components: int | None
    is_inward: bool

    def windings(self, points: Floats) -> NDArray[np.intp]:
        """`inside.windings` of the surface round points (n, 3) in the unit of the file."""
        return inside.windings(self.read, self.surface.box, points)

    def triangles(self, numbers: NDArray[np.intp]) -> Floats:
        """The triangles (k, 3, 3) of these numbers, ascending, in the unit of the file."""
        return surfaces.chosen(self.read, numbers)

    def faces(self, most: int, cells: int) -> Floats:
        """The triangles (k, 3, 3), in the unit of the file; simplified where there are more than `most`."""
        if self.surface.triangles > most:
            return surfaces.simplified(self.read, self.surface.box, cells)
        return self.triangles(np.arange(self.surface.triangles))


def checked(path: pathlib.Path, *, thin: bool) -> Checked:
    """The surface in a file, which is read once for any number of documents.

    A `thin` shell may be open. Raises ValueProblem for what encloses no body.
    """
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _checked(path, (0, 0, 0), thin)  # the reader says what is wrong
    return _checked(path, (status.st_ino, status.st_size, status.st_mtime_ns), thin)


@lru_cache(maxsize=4)
def _checked(path: pathlib.Path, state: tuple[int, int, int], thin: bool) -> Checked:
    """`checked` for a file in this state."""
    read, notes = mesh_files.reader(path), list[str]()
    surface = _summed(read, path, thin)
    if not surface.is_closed and not thin:
        read, surface = _merged(read, surface, path, notes)
    if not thin:
        if not surface.is_closed:
            raise _gap(edges.unpaired(read), path)
        if surface.is_flat:
            raise ValueProblem(
                f"{path}: flat: it encloses {abs(surface.volume):.3g} cubic units, and has an area of "
                f"{surface.area:.6g} square units",
                hint="`shell: true` takes it as a thin shell",
            )
    is_inward = surface.is_closed and surface.volume < 0
    labels = None if surface.keys is None else edges.components(surface.keys)
    first = None if labels is None else np.unique(labels, return_index=True)[1]
    if not thin:
        notes += _overlaps(read, path, surface, first, -1 if is_inward else 1)
        if is_inward:
            notes.append("it is wound inside out, and was turned")
    count, surface.keys = None if first is None else len(first), None
    return Checked(surface, read, tuple(notes), count, is_inward)


def _summed(read: Read, path: pathlib.Path, thin: bool) -> Surface:
    """The sums over a surface. Raises ValueProblem where there are none that are finite."""
    try:
        surface = surfaces.measured(read, thin=thin)
    except surfaces.NotFiniteError as error:
        raise ValueProblem(
            f"{path}: triangle {error.triangle:,} (counted from 0) has a coordinate that is no finite number"
        ) from error
    if surface.triangles == 0:
        raise ValueProblem(f"{path}: no triangles")
    if np.abs(surface.box).max() > FARTHEST:
        raise ValueProblem(
            f"{path}: a coordinate of {np.abs(surface.box).max():.3g}, expected at most {FARTHEST:g}"
        )
    if not np.isfinite(surface.area) or surface.area <= 0:
        raise ValueProblem(f"{path}: the triangles have no area")
    return surface


def _merged(read: Read, surface: Surface, path: pathlib.Path, notes: list[str]) -> tuple[Read, Surface]:
    """An open surface with near vertices made one.

    A closed surface needs none of this: its sums would change by no more than such distances.
    """
    distance = MERGED * surface.size
    if surface.triangles * MERGING > memory.available():
        return read, surface
    merged, count = edges.merged(read, surface.box, distance)
    if count == 0:
        return read, surface
    were = "1 vertex was" if count == 1 else f"{count:,} vertices were"
    notes.append(f"{were} nearer than {distance:.3g} units, {MERGED:g} of its size, to others, and merged")
    return merged, _summed(merged, path, thin=False)


# --- what is wrong


def _gap(gap: edges.Unpaired | None, path: pathlib.Path) -> ValueProblem:
    """Why a surface is not closed and wound in one sense, and where."""
    if gap is None:
        return ValueProblem(f"{path}: the surface is not closed")
    belong = "1 edge belongs" if gap.number == 1 else f"{gap.number:,} edges belong"
    start, end = map(_point, gap.edge)
    what, hint = {
        1: (
            f"open: {belong} to one triangle only",
            "close it in the program that made the file; `shell: true` takes the surface as a thin shell",
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
    read: Read, path: pathlib.Path, surface: Surface, first: NDArray[np.intp] | None, orientation: int
) -> list[str]:
    """A note on a place that a closed surface encloses more than once.

    Raises ValueProblem where it goes round a place the wrong way, and so encloses no body.
    """
    places = surface.places
    if first is not None and len(first) > 1:
        step = -(-len(first) // surfaces.PROBES)
        places = np.vstack([places, surfaces.chosen(read, np.sort(first)[::step]).mean(axis=1)])
    spot = inside.overlap(read, surface.box, places, orientation)
    if spot is not None and spot.windings < 0:
        raise ValueProblem(
            f"{path}: a part is wound the other way, and is no cavity, as it is outside the others: "
            f"{_point(spot.place)}",
            hint="let the program that made the file orient its faces",
        )
    # What no line has met may still be seen in the sums: no body has a negative mean of squares.
    spread = np.linalg.eigvalsh(surface.second)
    if spread[0] < -ROUNDING * surface.cancelled * spread[2]:
        raise ValueProblem(f"{path}: overlaps itself: no body has the moments that come out")
    if spot is None:
        return []
    text = f"parts overlap: {_point(spot.place)} is inside {spot.windings} times, and counts as often"
    return [f"{text}; to count it once, unite the parts in the program that made the file"]
