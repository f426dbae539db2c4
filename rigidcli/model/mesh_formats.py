"""Surfaces from OBJ, PLY and OFF files: vertices and faces, read whole. Only what makes the surface is read.

Colours, normals, textures and names of other files are passed over. A face with more than three vertices
becomes a fan of triangles, which has the same edge and, where it is plane, the same area with its sign.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal, NamedTuple, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown

NUMERAL = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
"""A number as meshes of text have it."""

_NUMERALS = b"0123456789+-.eE \t\r\n"
"""What numbers and the blanks between them consist of."""

PLY_TYPES = {
    name: code
    for names, code in (
        ("char int8", "i1"),
        ("uchar uint8", "u1"),
        ("short int16", "i2"),
        ("ushort uint16", "u2"),
        ("int int32", "i4"),
        ("uint uint32", "u4"),
        ("float float32", "f4"),
        ("double float64", "f8"),
    )
    for name in names.split()
}
"""The types of numbers in a PLY file, as numpy calls them."""

CHUNK = 500_000
"""So many entries of lists are taken from a binary file at once, which bounds the memory."""

PLY_HEADER = 100
"""The most lines of the header of a PLY file."""

Numbers: TypeAlias = NDArray[np.intp]


class Rows(NamedTuple):
    """The numbers of lines of text: all `values`, and where those of each line begin, and how many it has."""

    values: Floats
    starts: Numbers
    lengths: Numbers


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
    start = np.repeat(np.cumsum(counts) - counts, each)
    step = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    return np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], axis=1)


def _rows(lines: Sequence[bytes], numbers: Sequence[int], path: Path) -> Rows:
    """The numbers that lines of text, of these numbers in the file, consist of. Raises ValueProblem."""
    text = b"\n".join(lines)
    is_blank = np.frombuffer(b" " + text, dtype=np.uint8) <= ord(" ")
    begins = np.flatnonzero(is_blank[:-1] & ~is_blank[1:])
    values = np.empty(0)
    with warnings.catch_warnings(), suppress(ValueError):
        warnings.simplefilter("ignore")  # older versions of numpy warn, and end there
        values = np.fromstring(text, sep=" ") if begins.size else values
    if text.translate(None, _NUMERALS) or len(values) != len(begins):
        _refuse_word(lines, numbers, path)
    newlines = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
    lengths = np.bincount(np.searchsorted(newlines, begins), minlength=len(lines))
    return Rows(values, np.cumsum(lengths) - lengths, lengths)


def _refuse_word(lines: Sequence[bytes], numbers: Sequence[int], path: Path) -> NoReturn:
    for line, number in zip(lines, numbers, strict=True):
        for word in line.split():
            if NUMERAL.fullmatch(word) is None:
                read = shown(word.decode("utf-8", "replace"))
                raise ValueProblem(f"{path}:{number}: read {read}, expected a number")
    raise ValueProblem(f"{path}: a number that cannot be read")


def _columns(rows: Rows, places: Sequence[int], numbers: Sequence[int], what: str, path: Path) -> Floats:
    """The numbers at some places of each line (n, k). Raises ValueProblem where a line is too short."""
    needed = max(places) + 1
    short = np.flatnonzero(rows.lengths < needed)
    if short.size:
        read = rows.lengths[short[0]]
        raise ValueProblem(
            f"{path}:{numbers[short[0]]}: read {read} numbers, expected the {needed} of {what}"
        )
    columns: Floats = rows.values[rows.starts[:, None] + np.array(places)]
    return columns


def _lists(rows: Rows, place: int, numbers: Sequence[int], path: Path) -> tuple[Numbers, Numbers]:
    """Lists that begin at a place of each line with their length: the lengths, and all entries."""
    lengths = _whole(_columns(rows, [place], numbers, "a face", path)[:, 0], path)
    wrong = np.flatnonzero((lengths < 0) | (lengths >= rows.lengths - place))
    if wrong.size:
        read, told = rows.lengths[wrong[0]] - place - 1, lengths[wrong[0]]
        raise ValueProblem(f"{path}:{numbers[wrong[0]]}: read {read} vertices of a face, expected {told}")
    first = rows.starts + place + 1 - np.cumsum(lengths) + lengths
    return lengths, _whole(rows.values[np.repeat(first, lengths) + np.arange(lengths.sum())], path)


def _whole(values: Floats, path: Path) -> Numbers:
    """Numbers of vertices, which are whole and not beyond all bounds. Raises ValueProblem."""
    wrong = ~((values == np.rint(values)) & (np.abs(values) < 2**53))
    if wrong.any():
        raise ValueProblem(f"{path}: read {values[wrong][0]:.17g}, expected the number of a vertex")
    return values.astype(np.intp)


def obj(data: bytes, path: Path) -> Polygons:
    """An OBJ file: its lines `v` and `f`; an index below zero counts back from the last vertex so far."""
    lines = data.replace(b"\\\n", b"  ").split(b"\n")
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
    rows = _rows([lines[number][2:].partition(b"#")[0] for number in vertices], places, path)
    points = _columns(rows, [0, 1, 2], places, "a vertex", path)
    rows = _rows(
        [re.sub(rb"/[^\s]*", b"", lines[number][2:].partition(b"#")[0]) for number in faces],
        [number + 1 for number in faces],
        path,
    )
    corners = _whole(rows.values, path)
    so_far = np.repeat(np.array(before, dtype=np.intp), rows.lengths)
    return Polygons(points, rows.lengths, np.where(corners < 0, corners + so_far, corners - 1))


def off(data: bytes, path: Path) -> Polygons:
    """An OFF file: how many vertices and faces, then the vertices, then the faces with their lengths."""
    lines = [line.partition(b"#")[0].strip() for line in data.split(b"\n")]
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
    head = _columns(_rows(lines[:1], numbers[:1], path), [0, 1], numbers, "a head", path)
    vertices, faces = _whole(head[0], path)
    if vertices < 0 or faces < 0 or len(lines) < 1 + vertices + faces:
        raise ValueProblem(
            f"{path}: {len(lines) - 1:,} lines, expected {vertices:,} of vertices and {faces:,} of faces",
            hint="the file is truncated, or its second line is wrong",
        )
    own = slice(1, 1 + vertices), slice(1 + vertices, 1 + vertices + faces)
    points, rows = (_rows(lines[part], numbers[part], path) for part in own)
    return Polygons(
        _columns(points, [0, 1, 2], numbers[own[0]], "a vertex", path),
        *_lists(rows, 0, numbers[own[1]], path),
    )


class Element(NamedTuple):
    """A kind of thing in a PLY file, how many there are, and its properties: name, type, type of a length."""

    name: str
    size: int
    properties: list[tuple[str, str, str | None]]


def ply(data: bytes, path: Path) -> Polygons:
    """A PLY file of text or binary: the elements `vertex` with x, y, z and `face` with a list of vertices."""
    start, order, elements = _ply_header(data, path)
    read = _ply_text if order is None else _ply_binary
    found = read(data, start, order or "", elements, path)
    if "vertex" not in found or "face" not in found:
        raise ValueProblem(f"{path}: expected elements `vertex` and `face` in the header")
    (points, _), (corners, counts) = found["vertex"], found["face"]
    return Polygons(points.reshape(-1, 3), counts, _whole(corners, path))


def _ply_header(data: bytes, path: Path) -> tuple[int, str | None, list[Element]]:
    """Where the data start, their order of bytes (None: text), and the elements. Raises ValueProblem."""
    end = re.search(rb"^end_header[ \t\r]*\n", data[: 1000 * PLY_HEADER], re.MULTILINE)
    if not data.startswith(b"ply") or end is None:
        raise ValueProblem(
            f"{path}: not a PLY file: it begins with `ply`, and its header ends with `end_header`"
        )
    order: str | None = None
    elements: list[Element] = []
    for number, line in enumerate(data[: end.start()].decode("latin-1").split("\n"), 1):
        match line.split():
            case ["format", "ascii", _]:
                order = None
            case ["format", ("binary_little_endian" | "binary_big_endian") as written, _]:
                order = "<" if "little" in written else ">"
            case ["element", name, count] if count.isascii() and count.isdecimal() and len(count) < 16:
                elements.append(Element(name, int(count), []))
            case ["property", kind, name] if kind in PLY_TYPES and elements:
                elements[-1].properties.append((name, PLY_TYPES[kind], None))
            case ["property", "list", length, kind, name] if (
                length in PLY_TYPES and PLY_TYPES[length][0] != "f" and kind in PLY_TYPES and elements
            ):
                elements[-1].properties.append((name, PLY_TYPES[kind], PLY_TYPES[length]))
            case [] | ["ply"] | ["comment" | "obj_info", *_]:
                pass
            case _:
                read = shown(line.strip())
                raise ValueProblem(f"{path}:{number}: read {read}, expected a line of a PLY header")
    return end.end(), order, elements


def _ply_places(element: Element, path: Path) -> list[int] | None:
    """Where x, y, z are among the properties of `vertex`, or the list of `face`; None for other elements."""
    names = [name for name, _, _ in element.properties]
    lists = [place for place, (_, _, length) in enumerate(element.properties) if length is not None]
    if element.name == "vertex" and {"x", "y", "z"} <= set(names) and not lists:
        return [names.index(name) for name in "xyz"]
    if element.name == "face" and lists and names[lists[0]] in ("vertex_index", "vertex_indices"):
        return lists[:1]
    if element.name in ("vertex", "face"):
        raise ValueProblem(
            f"{path}: expected x, y, z of `vertex` and the list `vertex_indices` of `face` first"
        )
    return None


def _ply_text(
    data: bytes, start: int, order: str, elements: Sequence[Element], path: Path
) -> dict[str, tuple[Floats, Numbers]]:
    first = data.count(b"\n", 0, start) + 1
    lines = data[start:].split(b"\n")
    found, at = {}, 0
    for element in elements:
        own, numbers = lines[at : at + element.size], range(first + at, first + at + element.size)
        if len(own) < element.size:
            raise ValueProblem(f"{path}: {len(own):,} lines of `{element.name}`, expected {element.size:,}")
        at += element.size
        places = _ply_places(element, path)
        if places is None:
            continue
        rows = _rows(own, numbers, path)
        if element.name == "vertex":
            found[element.name] = _columns(rows, places, numbers, "a vertex", path), rows.lengths
        else:
            counts, corners = _lists(rows, places[0], numbers, path)
            found[element.name] = corners.astype(np.float64), counts
    return found


def _ply_binary(
    data: bytes, start: int, order: str, elements: Sequence[Element], path: Path
) -> dict[str, tuple[Floats, Numbers]]:
    found: dict[str, tuple[Floats, Numbers]] = {}
    at = start
    for element in elements:
        places = _ply_places(element, path)
        lists = [place for place, (_, _, length) in enumerate(element.properties) if length is not None]
        if len(lists) > 1:
            raise ValueProblem(f"{path}: `{element.name}` has several lists, expected one of vertices")
        if lists:
            at, corners, counts = _ply_lists(data, at, order, element, lists[0], path)
            found[element.name] = corners, counts
            continue
        row = np.dtype(
            [(f"{place} {name}", order + kind) for place, (name, kind, _) in enumerate(element.properties)]
        )
        if len(data) - at < element.size * row.itemsize:
            raise _ends_early(element, path)
        if places is not None:
            rows = np.frombuffer(data, row, element.size, at)
            columns = [rows[f"{place} {name}"] for place, name in zip(places, "xyz", strict=True)]
            found[element.name] = np.stack(columns, axis=1).astype(np.float64), np.empty(0, dtype=np.intp)
        at += element.size * row.itemsize
    return found


def _ply_lists(
    data: bytes, at: int, order: str, element: Element, place: int, path: Path
) -> tuple[int, Floats, Numbers]:
    """Where an element ends that begins at a byte, and the entries and lengths of the lists in its rows."""
    sizes = [np.dtype(kind).itemsize for _, kind, _ in element.properties]
    _, kind, length = element.properties[place]
    assert length is not None
    before, after, each = sum(sizes[:place]), sum(sizes[place + 1 :]), sizes[place]
    head, is_signed = np.dtype(length).itemsize, length[0] == "i"
    byteorder: Literal["little", "big"] = "little" if order == "<" else "big"
    starts, counts = [], []
    for _ in range(element.size):
        begin = at + before + head
        count = int.from_bytes(data[begin - head : begin], byteorder, signed=is_signed)
        at = begin + count * each + after
        if count < 0 or at > len(data):
            raise _ends_early(element, path)
        starts.append(begin)
        counts.append(count)
    lengths = np.array(counts, dtype=np.intp)
    ends = np.cumsum(lengths)
    first = np.repeat(np.array(starts, dtype=np.intp) - (ends - lengths) * each, lengths)
    content, entries = np.frombuffer(data, dtype=np.uint8), np.empty(len(first))
    for begin in range(0, len(first), CHUNK):
        places = first[begin : begin + CHUNK] + np.arange(begin, min(begin + CHUNK, len(first))) * each
        taken = content[places[:, None] + np.arange(each)]
        entries[begin : begin + CHUNK] = taken.view(order + kind)[:, 0]
    return at, entries, lengths


def _ends_early(element: Element, path: Path) -> ValueProblem:
    return ValueProblem(f"{path}: the data of `{element.name}` end early, or are broken")
