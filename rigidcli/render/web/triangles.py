"""Plane faces as triangles, as graphics cards draw triangles only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidcli.bodies.surfaces import simplified
from rigidcli.core.arithmetic import Floats

FINEST = 64
"""Cells along the longest side of a surface when it begins to be made coarser: 6 MB of memory."""


def triangles(faces: Sequence[Floats], most: int) -> Floats:
    """The triangles (n, 3, 3) of plane faces (each k by 3), convex or not; coarser where they are more."""
    by_corners: dict[int, list[Floats]] = {}
    for face in faces:
        by_corners.setdefault(len(face), []).append(face)
    cut = np.concatenate([_cut(np.array(alike, dtype=float)) for alike in by_corners.values()])
    corners, box = cut.transpose(1, 2, 0), np.array([cut.min(axis=(0, 1)), cut.max(axis=(0, 1))])
    cells = FINEST
    while len(cut) > most and cells > 4:
        cut, cells = simplified(lambda: [corners], box, cells), cells // 2
    return cut[:most]


def _cut(faces: Floats) -> Floats:
    """The triangles (m (k - 2), 3, 3) of faces (m, k, 3): fans, where these do not overlap."""
    first = np.broadcast_to(faces[:, :1], faces[:, 1:-1].shape)
    fans = np.stack([first, faces[:, 1:-1], faces[:, 2:]], axis=2)
    normals = np.cross(fans[:, :, 1] - fans[:, :, 0], fans[:, :, 2] - fans[:, :, 0])
    whole = normals.sum(axis=1)
    for place in np.flatnonzero((np.einsum("mki,mi->mk", normals, whole) < 0).any(axis=1)):
        fans[place] = faces[place][_ears(faces[place], whole[place])]
    return fans.reshape(-1, 3, 3)


def _ears(face: Floats, normal: Floats) -> list[list[int]]:
    """The corners of the triangles of a simple polygon (k, 3): ears are cut off, one after the other.

    Source: G. H. Meisters, Amer. Math. Monthly 82 (1975) 648: each polygon has two ears.
    """
    drop = int(np.argmax(np.abs(normal)))
    x, y = np.delete(face, drop, axis=1).T * np.array([[1.0], [(-1.0) ** drop * np.sign(normal[drop])]])

    def area(i: Sequence[int] | int, j: int, k: Sequence[int] | int) -> Floats:
        twice: Floats = (x[j] - x[i]) * (y[k] - y[i]) - (y[j] - y[i]) * (x[k] - x[i])
        return twice

    left, ears = list(range(len(face))), []
    while len(left) > 3:
        for place, b in enumerate(left):
            a, c = left[place - 1], left[(place + 1) % len(left)]
            others = [other for other in left if other not in (a, b, c)]
            inside = (area(others, a, b) >= 0) & (area(others, b, c) >= 0) & (area(others, c, a) >= 0)
            if area(a, b, c) >= 0 and not inside.any():
                break
        ears.append([a, b, c])
        left.remove(b)
    return [*ears, left]
