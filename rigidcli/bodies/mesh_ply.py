"""Surfaces from PLY files, of text or binary: the elements `vertex` and `face`; others are passed over."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from rigidcli.bodies.mesh_formats import MOST_TRIANGLES, Polygons
from rigidcli.bodies.mesh_text import (
    MOST_NUMBERS,
    Numbers,
    columns_at,
    lists_at,
    read_rows,
    require_few,
    split,
    whole,
)
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown

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
    return Polygons(points.reshape(-1, 3), counts, whole(corners, path))


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
    lines = split(data[start:], path)
    found, at = {}, 0
    for element in elements:
        own, numbers = lines[at : at + element.size], range(first + at, first + at + element.size)
        if len(own) < element.size:
            raise ValueProblem(f"{path}: {len(own):,} lines of `{element.name}`, expected {element.size:,}")
        at += element.size
        places = _ply_places(element, path)
        if places is None:
            continue
        rows = read_rows(own, numbers, path)
        if element.name == "vertex":
            found[element.name] = columns_at(rows, places, numbers, "a vertex", path), rows.lengths
        else:
            counts, corners = lists_at(rows, places[0], numbers, path)
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
    if len(data) - at < element.size * (before + head + after):
        raise _ends_early(element, path)
    require_few(element.size, MOST_TRIANGLES, f"rows of `{element.name}`", path)
    starts, counts = [], []
    for _ in range(element.size):
        begin = at + before + head
        count = int.from_bytes(data[begin - head : begin], byteorder, signed=is_signed)
        at = begin + count * each + after
        if count < 0 or at > len(data):
            raise _ends_early(element, path)
        starts.append(begin)
        counts.append(count)
    require_few(sum(counts), MOST_NUMBERS, f"entries of `{element.name}`", path)
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
