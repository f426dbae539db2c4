"""Surfaces from OBJ and OFF files: vertices and faces, read whole. Only what makes the surface is read.

Colours, normals, textures and names of other files are passed over. A face with more than three vertices
becomes a fan of triangles, which has the same edge and, where it is plane, the same area with its sign.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rigidcli.bodies.mesh_text import Numbers, columns_at, lists_at, read_rows, require_few, split, whole
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown

MOST_TRIANGLES = 500_000
"""The most triangles of a file that is read whole: to say what is wrong with so many takes three seconds."""


class Polygons(NamedTuple):
    """Vertices (n, 3), and faces: how many vertices each has (k), and the numbers of all these, from 0."""

    vertices: Floats
    counts: Numbers
    corners: Numbers


def triangles(polygons: Polygons, path: Path) -> Numbers:
    """The faces cut into fans of triangles (m, 3), by the numbers of their vertices. Raises ValueProblem."""
    vertices, counts, corners = polygons
    if counts.size and counts.min() < 3:
        raise ValueProblem(
            f"{path}: face {int(np.argmin(counts)):,} (counted from 0) has {counts.min()} vertices"
        )
    wrong = (corners < 0) | (corners >= len(vertices))
    if wrong.any():
        first = corners[wrong][0]
        raise ValueProblem(
            f"{path}: a face has the vertex {first:,} (counted from 0), and there are {len(vertices):,}"
        )
    each = counts - 2
    require_few(int(each.sum()), MOST_TRIANGLES, "triangles", path)
    start = np.repeat(np.cumsum(counts) - counts, each)
    step = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    return np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], axis=1)


def obj(data: bytes, path: Path) -> Polygons:
    """An OBJ file: its lines `v` and `f`; an index below zero counts back from the last vertex so far."""
    lines = split(data.replace(b"\\\n", b"  "), path)
    vertices: list[int] = []
    faces: list[int] = []
    before: list[int] = []
    for number, line in enumerate(lines):
        if line[:2] in (b"v ", b"v\t"):
            vertices.append(number)
        elif line[:2] in (b"f ", b"f\t"):
            faces.append(number)
            before.append(len(vertices))
    places = [number + 1 for number in vertices]
    rows = read_rows([lines[number][2:].partition(b"#")[0] for number in vertices], places, path)
    points = columns_at(rows, [0, 1, 2], places, "a vertex", path)
    rows = read_rows(
        [re.sub(rb"/[^\s]*", b"", lines[number][2:].partition(b"#")[0]) for number in faces],
        [number + 1 for number in faces],
        path,
    )
    corners = whole(rows.values, path)
    so_far = np.repeat(np.array(before, dtype=np.intp), rows.lengths)
    return Polygons(points, rows.lengths, np.where(corners < 0, corners + so_far, corners - 1))


def off(data: bytes, path: Path) -> Polygons:
    """An OFF file: how many vertices and faces, then the vertices, then the faces with their lengths."""
    lines = [line.partition(b"#")[0].strip() for line in split(data, path)]
    numbers = [number for number, line in enumerate(lines, 1) if line]
    lines = [line for line in lines if line]
    if not lines or not lines[0].startswith(b"OFF"):
        read = shown(lines[0][:20].decode("utf-8", "replace") if lines else None)
        raise ValueProblem(f"{path}: read {read}, expected `OFF`")
    lines[0] = lines[0][3:]
    if not lines[0].strip():
        lines, numbers = lines[1:], numbers[1:]
    if not lines:
        raise ValueProblem(f"{path}: the numbers of vertices and faces are missing")
    head = columns_at(read_rows(lines[:1], numbers[:1], path), [0, 1], numbers, "a head", path)
    vertices, faces = whole(head[0], path)
    if vertices < 0 or faces < 0 or len(lines) < 1 + vertices + faces:
        raise ValueProblem(
            f"{path}: {len(lines) - 1:,} lines, expected {vertices:,} of vertices and {faces:,} of faces",
            hint="the file is truncated, or its second line is wrong",
        )
    own = slice(1, 1 + vertices), slice(1 + vertices, 1 + vertices + faces)
    points, rows = (read_rows(lines[part], numbers[part], path) for part in own)
    return Polygons(
        columns_at(points, [0, 1, 2], numbers[own[0]], "a vertex", path),
        *lists_at(rows, 0, numbers[own[1]], path),
    )
