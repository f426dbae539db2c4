"""The edges of a surface of triangles: whether it is closed and wound in one sense, and where it is not.

Vertices are one where their coordinates are equal, and are told apart by keys of 64 bits. A block of
triangles is an array of shape (3, 3, n): vertex, coordinate, triangle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats

Keys: TypeAlias = NDArray[np.uint64]

Read: TypeAlias = Callable[[], Iterable[Floats]]
"""Starts the blocks of a surface, each of shape (3, 3, n); the next one may overwrite it."""

_Point: TypeAlias = tuple[float, ...]

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

SIDES = ((0, 1), (1, 2), (2, 0))
"""The edges of a triangle, by its vertices, in the sense in which it is wound."""

CLASSES = 20
"""Edges are sorted into 2^20 classes by their keys, to find the few that lack a partner among millions."""

MOST_GATHERED = 100_000
"""About how many edges are looked at one by one."""


def _mixed(keys: Keys, factor: np.uint64) -> Keys:
    keys = keys * factor
    keys ^= keys >> _HALF
    return keys


def vertex_keys(block: Floats) -> Keys:
    """A key for each vertex (3, n) of a block, which depends on nothing but its coordinates; -0 is 0.

    Those of a million different vertices are different, but for a chance of one in 10^7.
    """
    bits = (block + 0.0).view(np.uint64)
    # Single precision leaves the lower half of the bits zero, and a product would never fill it.
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


@dataclass(frozen=True, slots=True, eq=False)
class Unpaired:
    """Edges that run in one sense more often than in the other.

    `edges` (k, 2, 3) has their ends, in that sense; `uses` (k, 2) how often they are run in it, and against
    it. It `is_all` of them, or only some, where there are very many.
    """

    edges: Floats
    uses: NDArray[np.intp]
    is_all: bool

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """Which of them (k) belong to one triangle alone."""
        alone: NDArray[np.bool_] = self.uses.sum(axis=1) == 1
        return alone


def unpaired(read: Read) -> Unpaired:
    """The edges of a surface that lack a partner, in two passes over its blocks and in bounded memory.

    In each class of edges the weights are summed, with the sign of the sense in which an edge is run. They
    cancel where each edge has its partner; what is in the other classes is then looked at.
    """
    sums, sizes = np.zeros((2, 2**CLASSES), dtype=np.int64)
    for block in read():
        for _, kind, weight in _classified(block):
            np.add.at(sums, kind, weight)
            np.add.at(sizes, kind, 1)
    odd = np.flatnonzero(sums)
    odd = odd[np.argsort(sizes[odd], kind="stable")]
    chosen = np.zeros(2**CLASSES, dtype=bool)
    few = odd[: max(1, np.count_nonzero(np.cumsum(sizes[odd]) <= MOST_GATHERED))]
    chosen[few] = True
    gathered, senses, left = [np.empty((0, 2, 3))], [np.empty(0, dtype=bool)], MOST_GATHERED
    for block in read():
        for (start, end), kind, weight in _classified(block):
            found = np.flatnonzero(chosen[kind] & (weight != 0))[:left]
            left -= len(found)
            edges = np.stack([block[start][:, found].T, block[end][:, found].T], axis=1) + 0.0
            forward = weight[found] > 0
            gathered.append(np.where(forward[:, None, None], edges, edges[:, ::-1]))
            senses.append(forward)
    rows = np.concatenate(gathered).reshape(-1, 6)
    different, places = np.unique(rows, axis=0, return_inverse=True)
    forward = np.concatenate(senses)
    with_it = np.bincount(places.reshape(-1)[forward], minlength=len(different))
    against = np.bincount(places.reshape(-1)[~forward], minlength=len(different))
    wrong = with_it != against
    turned = (against > with_it)[wrong]
    edges = different[wrong].reshape(-1, 2, 3)
    uses = np.stack([with_it, against], axis=1)[wrong]
    return Unpaired(
        np.where(turned[:, None, None], edges[:, ::-1], edges),
        np.where(turned[:, None], uses[:, ::-1], uses),
        len(few) == len(odd) and left > 0,
    )


def _classified(block: Floats) -> Iterator[tuple[tuple[int, int], NDArray[np.intp], NDArray[np.int64]]]:
    """The edges of a block: their side of the triangle, class, and weight, negative in one of the senses."""
    keys = vertex_keys(block)
    for side in SIDES:
        one, two = keys[side[0]], keys[side[1]]
        both = _mixed(np.minimum(one, two) * _MIX[0] + np.maximum(one, two), _MIX[1])
        weight = (both & np.uint64(2**CLASSES - 1)).astype(np.int64) + 1
        sense = (one < two).astype(np.int64) - (one > two)
        yield side, (both >> np.uint64(64 - CLASSES)).astype(np.intp), weight * sense


def fans(edges: Floats) -> tuple[Floats, int, float]:
    """Triangles (3, 3, n) that close the holes whose rims are `edges` (k, 2, 3), a fan for each hole.

    Also how many holes there are, and the largest distance of a rim from its mean plane. Each way along
    the rims leads back to its start, as at each vertex of a boundary as many edges arrive as leave.
    """
    leaving: dict[_Point, list[_Point]] = {}
    for start, end in edges.tolist():
        leaving.setdefault(tuple(start), []).append(tuple(end))
    rims = list(_rims(leaving))
    found = [(rim[0], two, one) for rim in rims for one, two in pairwise(rim[1:])]
    patch = np.array(found).reshape(-1, 3, 3).transpose(1, 2, 0)
    return patch, len(rims), max(_unevenness(np.array(rim)) for rim in rims)


def _rims(leaving: dict[_Point, list[_Point]]) -> Iterator[list[_Point]]:
    """Ways round that meet no point twice, along the edges that leave each point, which are used up."""
    while leaving:
        way = [next(iter(leaving))]
        places = {way[0]: 0}
        while way:
            ends = leaving[way[-1]]
            here = ends.pop()
            if not ends:
                del leaving[way[-1]]
            if here not in places:
                places[here] = len(way)
                way.append(here)
                continue
            yield way[places[here] :]
            for point in way[places[here] + 1 :]:
                del places[point]
            del way[places[here] + 1 :]
            if len(way) == 1 and here not in leaving:
                break


def _unevenness(rim: Floats) -> float:
    """How far the points (k, 3) are from the plane through their mean that is nearest to them."""
    offsets = rim - rim.mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    return float(np.abs(offsets @ axes[:, 0]).max())
