"""The vertices and edges of a surface of triangles: where it is not closed, and which are nearly one.

Vertices are one where their coordinates are equal. Keys of 64 bits tell them apart. The corners of triangles
are an array of shape (3, 3, n): vertex, coordinate, triangle.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem

Keys: TypeAlias = NDArray[np.uint64]

BLOCK_TRIANGLES = 4_000
"""The most triangles of a block, 0.3 MB, which stays in the cache; small ones cost time to begin with."""

SIDES = ((0, 1), (1, 2), (2, 0))
"""The edges of a triangle, by its vertices, in the sense in which it is wound."""

_MIX = tuple(
    np.uint64(odd)
    for odd in (
        0x9E3779B97F4A7C15,
        0xC2B2AE3D27D4EB4F,
        0x165667B19E3779F9,
        0xD6E8FEB86659FD93,
        0xA0761D6478BD642F,
    )
)
"""Odd numbers whose bits look random: multiplication by them modulo 2^64 spreads every bit upwards."""

_HALF = np.uint64(32)


def require_indices(corners: NDArray[np.intp], count: int, path: Path) -> None:
    """Raise ValueProblem where a face has a vertex that is none of so many."""
    wrong = corners[(corners < 0) | (corners >= count)]
    if wrong.size:
        raise ValueProblem(
            f"{path}: a face has the vertex {wrong[0]:,} (counted from 0), and there are {count:,}"
        )


def blocks(corners: Floats) -> Iterator[Floats]:
    """The triangles in blocks (3, 3, k) of doubles, each in the place of the last one, in the cache."""
    block = np.empty((3, 3, min(BLOCK_TRIANGLES, corners.shape[2])))
    for start in range(0, corners.shape[2], BLOCK_TRIANGLES):
        part = corners[:, :, start : start + BLOCK_TRIANGLES]
        now = block[:, :, : part.shape[2]]
        now[...] = part
        yield now


def _mixed(keys: Keys, factor: np.uint64) -> Keys:
    keys = keys * factor
    keys ^= keys >> _HALF
    return keys


def vertex_keys(block: Floats) -> Keys:
    """A key for each vertex (3, n) of a block, which depends on nothing but its coordinates; -0 is 0.

    Those of a million different vertices are different, but for a chance of one in 10^7.
    """
    bits = np.add(block, 0.0, dtype=np.float64, order="C").view(np.uint64)
    # Single precision leaves the lower bits zero, and a product alone would never fill them. Without the one
    # here, a sign would cancel a change of the last digit.
    bits *= _MIX[4]
    bits ^= bits >> _HALF
    keys = bits[:, 0] * _MIX[0] + bits[:, 1] * _MIX[1] + bits[:, 2] * _MIX[2]
    keys ^= keys >> np.uint64(29)
    return _mixed(keys, _MIX[3])


def fingerprint(keys: Keys) -> int:
    """A number of triangles (keys: 3 by n) whose sum over a closed surface is zero modulo 2^64.

    Each vertex is sent to a point (p, q) of a plane that follows from its key. A closed surface, wound in one
    sense, has no signed area there, wherever its vertices are sent. An edge without a partner leaves an
    area that is zero for a few points in 2^64 only.
    """
    p, q = keys, _mixed(keys, _MIX[4])
    area = (p[1] - p[0]) * (q[2] - q[0]) - (p[2] - p[0]) * (q[1] - q[0])
    return int(area.sum())


class Unpaired(NamedTuple):
    """How many edges run in one sense more often than in the other, and the first of them.

    `uses` is the number of its triangles: if an edge belongs to one triangle alone, only such are counted.
    `edge` (2, 3) has its ends, in the sense in which it runs more often.
    """

    number: int
    uses: int
    edge: Floats


def unpaired(corners: Floats) -> Unpaired | None:
    """The edges of a surface that lack a partner; None where each has one."""
    keys = vertex_keys(corners)
    one, two = (np.concatenate([keys[side[end]] for side in SIDES]) for end in (0, 1))
    both = _mixed(np.minimum(one, two) * _MIX[0] + np.maximum(one, two), _MIX[1])
    senses = (one < two).astype(np.int8) - (one > two).astype(np.int8)  # 0 for an edge without length
    different, places = np.unique(both, return_inverse=True)
    balance = np.bincount(places, senses, len(different))
    uses = np.bincount(places, senses != 0, len(different))
    wrong = balance != 0
    if not wrong.any():
        return None
    if (wrong & (uses == 1)).any():
        wrong &= uses == 1
    first = int(np.argmax(wrong[places] & (senses * balance[places] > 0)))
    side, triangle = divmod(first, corners.shape[2])
    edge = corners[list(SIDES[side]), :, triangle].astype(np.float64) + 0.0
    return Unpaired(int(wrong.sum()), int(uses[places[first]]), edge)


def merged(corners: Floats, box: Floats, distance: float) -> tuple[Floats, int]:
    """The triangles in a `box` (2 by 3) with vertices nearer than `distance` made one, and how many moved.

    Two such vertices are in one cell of at least one of eight grids, of which the cells have twice that side
    and the corners differ by half a cell.
    """
    _, first, places = np.unique(vertex_keys(corners), return_index=True, return_inverse=True)
    vertices = corners.transpose(0, 2, 1).reshape(-1, 3)[first].astype(np.float64)
    cells = ((vertices - box[0]) / (2 * distance)).T
    shifts = np.array(list(product((0.0, 0.5), repeat=3)))
    grids = [vertex_keys(np.floor(cells + shift[:, None])[None])[0] for shift in shifts]
    labels = components(np.stack([_mixed(own + np.uint64(k), _MIX[4]) for k, own in enumerate(grids)]))
    _, chosen, group = np.unique(labels, return_index=True, return_inverse=True)
    meant = vertices[chosen][group]
    moved = int((meant != vertices).any(axis=1).sum())
    return np.ascontiguousarray(meant[places.reshape(3, -1)].transpose(0, 2, 1)), moved


def components(keys: Keys) -> NDArray[np.intp]:
    """For each triangle, by the keys (3, n) of its vertices, the least number of a vertex that hangs with it.

    Labels of vertices are lowered to the least one of a triangle until none changes. Each label is a vertex,
    too, so that whole parts are lowered at once (Y. Shiloach, U. Vishkin, J. Algorithms 3 (1982) 57).
    """
    vertices, places = np.unique(keys, return_inverse=True)
    corners = places.reshape(keys.shape)
    label = np.arange(len(vertices))
    while True:
        own = label[corners]
        least: NDArray[np.intp] = own.min(axis=0)
        if (own == least).all():
            return least
        np.minimum.at(label, own, least[None])
        while (label[label] != label).any():
            label = label[label]
