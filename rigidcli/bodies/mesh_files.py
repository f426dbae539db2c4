"""Surfaces of triangles from files, and whether they enclose a body.

STL, OBJ and OFF have readers of our own, PLY and GLB are read by trimesh in a process of its own, for which
this module is the program.

The corners are an array of shape (3, 3, n): vertex, coordinate, triangle, in the unit of the file. Of other
formats than STL only vertices and faces are read. A face with more than three vertices becomes a fan of
triangles, which has the same edge and, where it is plane, the same area with its sign.
"""

from __future__ import annotations

import json
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib.util import find_spec
from io import BufferedReader
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.bodies import mesh_geometry as geometry
from rigidcli.bodies.mesh_geometry import Surface
from rigidcli.core import memory
from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import ROUNDING_OF_SUM
from rigidcli.errors import ValueProblem, printable, shortened, shown
from rigidcli.fields.texts import opened
from rigidcli.language.numerals import NUMERAL

# Length of the header of a binary STL file: 80 bytes of anything, and the number of triangles.
HEADER_BYTES = 84
# A triangle of a binary STL file. The normal is not used: it follows from the sense of the vertices.
FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
# The memory that an STL file and one of words may need, in units of the size: words are short.
FACETS, WORDS = 6, 80

_NUMBER = re.compile(NUMERAL.encode())

BOM = b"\xef\xbb\xbf"  # the mark with which some editors begin a text
LIKELY = 100_000_000  # a header that counts more triangles is that of another kind of file
# What stands between the numbers of an STL file of text; a word comes after those of which it is a part.
WORDS_OF_FACETS = (b"endfacet", b"facet", b"normal", b"outer", b"endloop", b"loop", b"vertex")

# A line of a facet, with single blanks.
_LINE = re.compile(
    rb"(?:(?:facet normal|vertex)(?: N){3}|outer loop|endloop|endfacet)?".replace(b"N", _NUMBER.pattern)
)

_NUMERALS = b"0123456789+-.eE \t\r\n\v\f"  # the characters of numbers and of the blanks between them
# A normal that the program could not work out, as that of a triangle without area.
_NORMAL = re.compile(rb"facet\s+normal(?:\s+[-+]?(?:nan|inf)(?:\([a-z]*\))?){3}")
# The lines that begin and end a body in an STL file of text: they hold any name.
_SOLID = re.compile(rb"^[ \t]*(?:end)?solid\b.*$", re.MULTILINE)

Numbers: TypeAlias = NDArray[np.intp]

Line: TypeAlias = tuple[int, bytes]  # a line of a text with its number
# Vertices (n, 3), and faces: how many vertices they have (k), and the numbers of these, from 0.
Polygons: TypeAlias = tuple[Floats, Numbers, Numbers]


def corners(path: Path) -> Floats:
    """The corners of the triangles of a file. Raises ValueProblem, which names the path and the line."""
    read = READERS.get(path.suffix.lower())
    if read is None:
        endings = ", ".join(f"`{ending}`" for ending in READERS)
        message = f"{path}: expected the name of a mesh, which ends in one of {endings}"
        raise ValueProblem(message, hint="save it as STL")
    return read(path)


@contextmanager
def _sized(path: Path, times: int) -> Iterator[BufferedReader]:
    """A regular file that is not empty; reading takes so many `times` its size of memory."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size == 0:
            raise ValueProblem(f"{path}: the file is empty")
        needed, left = size * times / 1e9, memory.available() / 1e9
        if needed > left:
            raise ValueProblem(
                f"{path}: {size / 1e6:,.0f} MB may take {needed:.1f} GB of memory; {left:.1f} GB are free",
                hint="simplify the mesh, or save it as binary STL, which takes less",
            )
        yield file


# --- STL


def _stl(path: Path) -> Floats:
    with _sized(path, FACETS) as file:
        data = np.fromfile(file, np.uint8)  # by large pages, where the system has them
    data = data[len(BOM) :] if data[: len(BOM)].tobytes() == BOM else data
    count = int.from_bytes(data[80:HEADER_BYTES].tobytes(), "little")
    expected = HEADER_BYTES + count * FACET.itemsize
    # A binary file, too, may begin with `solid`.
    if len(data) == expected:
        triangles: Floats = np.frombuffer(data, FACET, offset=HEADER_BYTES)["vertices"].transpose(1, 2, 0)
        return triangles  # in single precision, where they stand in the file
    head = data[: HEADER_BYTES + 1000].tobytes()
    if head.lstrip()[:5].lower() == b"solid" and b"\0" not in head:
        return _text(data.tobytes().lower(), path)
    if len(data) < HEADER_BYTES:
        raise ValueProblem(f"{path}: {len(data)} bytes, which is shorter than the header of an STL file")
    raise ValueProblem(
        f"{path}: {len(data):,} bytes, expected {expected:,} for {count:,} triangles, as the header counts",
        hint="the file is truncated: export or copy it once more"
        if len(data) < expected and count < LIKELY
        else "this is no STL file, or one that is damaged: export or copy it once more",
    )


def _text(text: bytes, path: Path) -> Floats:
    """The triangles of an STL file of text, in small letters. Normals are not used."""
    numbers = text = _NORMAL.sub(b"facet normal 0 0 0", _SOLID.sub(b"", text))
    for word in WORDS_OF_FACETS:
        numbers = numbers.replace(word, b" ")
    count = text.count(b"endfacet")
    values = parsed(numbers, 12 * count) if text.count(b"vertex") == 3 * count else None
    if values is not None:
        return _in_rows(values.reshape(count, 4, 3)[:, 1:])
    for number, line in enumerate(text.split(b"\n"), 1):
        if not _LINE.fullmatch(b" ".join(line.split())):
            raise _wrong_word(line.strip(), number, "a line of a facet, such as `vertex 0 0 1`", path)
    raise ValueProblem(f"{path}: a facet has not three vertices", hint="the file is truncated")


def _wrong_word(word: bytes, line: int, expected: str, path: Path) -> ValueProblem:
    return ValueProblem(f"{path}:{line}: read {shown(word.decode('utf-8', 'replace'))}, expected {expected}")


# --- OBJ and OFF


def _of_text(path: Path) -> Floats:
    with _sized(path, WORDS) as file:
        text = file.read()
    vertices, counts, corners = (_obj if path.suffix.lower() == ".obj" else _off)(text, path)
    if counts.size and counts.min() < 3:
        face = f"face {np.argmin(counts):,} (counted from 0)"
        raise ValueProblem(f"{path}: {face} has {counts.min()} vertices")
    # Each face becomes a fan of triangles.
    cuts = counts - 2
    start = np.repeat(np.cumsum(counts) - counts, cuts)
    step = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    fans = np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], axis=1)
    return _in_rows(vertices[fans])


def _in_rows(triangles: Floats) -> Floats:
    """The corners (3, 3, n) of triangles (n, 3, 3): triangle, vertex, coordinate."""
    return np.ascontiguousarray(triangles.transpose(1, 2, 0))


def _obj(data: bytes, path: Path) -> Polygons:
    """An OBJ file: its lines `v` and `f`; an index below zero counts back from the last vertex so far."""
    vertices: list[Line] = []
    faces: list[Line] = []
    before: list[int] = []
    for number, line in enumerate(data.replace(b"\\\n", b"  ").split(b"\n"), 1):
        if line[:2] in (b"v ", b"v\t"):
            vertices.append((number, line[2:].partition(b"#")[0]))
        elif line[:2] in (b"f ", b"f\t"):
            faces.append((number, re.sub(rb"/[^\s]*", b"", line[2:].partition(b"#")[0])))
            before.append(len(vertices))
    values, counts = _numbers(faces, path)
    corners = _indices(values, path)
    so_far = np.repeat(np.array(before, dtype=np.intp), counts)
    numbers = np.where(corners < 0, corners + so_far, corners - 1)
    _require_vertices(numbers, corners, counts, faces, range(1, 1 + len(vertices)), path)
    return _points(vertices, path), counts, numbers


def _off(data: bytes, path: Path) -> Polygons:
    """An OFF file: how many vertices and faces, then the vertices, then the faces with their lengths."""
    parts = ((number, line.partition(b"#")[0].strip()) for number, line in enumerate(data.split(b"\n"), 1))
    (start, first), *lines = [(number, line) for number, line in parts if line] or [(1, b"")]
    if not first.startswith(b"OFF"):
        raise _wrong_word(first[:20], start, "`OFF`", path)
    if first[3:]:
        lines.insert(0, (start, first[3:]))
    head, counts = _numbers(lines[:1], path)
    if head.size < 2:
        raise ValueProblem(f"{path}: the numbers of vertices and faces are missing")
    vertices, faces = _indices(head[:2], path)
    if vertices < 0 or faces < 0 or len(lines) < 1 + vertices + faces:
        raise ValueProblem(
            f"{path}: {len(lines) - 1:,} lines, expected {vertices:,} of vertices and {faces:,} of faces",
            hint="the file is truncated, or its second line is wrong",
        )
    rows = lines[1 + vertices : 1 + vertices + faces]
    values, lengths = _numbers(rows, path)
    starts = np.cumsum(lengths) - lengths
    counts = _indices(values[starts], path)
    for wrong in np.flatnonzero((counts < 0) | (counts >= lengths))[:1]:
        read = f"read {lengths[wrong] - 1} vertices of a face"
        raise ValueProblem(f"{path}:{rows[wrong][0]}: {read}, expected {counts[wrong]}")
    places = np.repeat(starts + 1 - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
    numbers = _indices(values[places], path)
    _require_vertices(numbers, numbers, counts, rows, range(int(vertices)), path)
    return _points(lines[1 : 1 + vertices], path), counts, numbers


def _numbers(lines: Sequence[Line], path: Path) -> tuple[Floats, Numbers]:
    """All numbers of lines of text, and how many stand in each line."""
    counts = np.array([len(line.split()) for _, line in lines], dtype=np.intp)
    values = parsed(b" ".join(line for _, line in lines), int(counts.sum()))
    if values is None:
        words = ((word, number) for number, line in lines for word in line.split())
        wrong = next((word, number) for word, number in words if _NUMBER.fullmatch(word) is None)
        raise _wrong_word(*wrong, "a number", path)
    return values, counts


def parsed(text: bytes, count: int) -> Floats | None:
    """The numbers of a text of `count` words; None where a word is no number."""
    if text.translate(None, _NUMERALS):
        return None
    with warnings.catch_warnings(), suppress(ValueError, DeprecationWarning):
        warnings.simplefilter("error", DeprecationWarning)  # of older versions of numpy, which end there
        values = np.fromstring(text, sep=" ") if count else np.empty(0)
        return values if len(values) == count else None
    return None


def _points(lines: Sequence[Line], path: Path) -> Floats:
    values, counts = _numbers(lines, path)
    for short in np.flatnonzero(counts < 3)[:1]:
        read = f"read {counts[short]} numbers, expected the 3 of a vertex"
        raise ValueProblem(f"{path}:{lines[short][0]}: {read}")
    return np.asarray(values[(np.cumsum(counts) - counts)[:, None] + np.arange(3)])


def _require_vertices(
    numbers: Numbers, typed: Numbers, counts: Numbers, faces: Sequence[Line], vertices: range, path: Path
) -> None:
    """Raise ValueProblem for a vertex of the `faces`, each with `counts` of them, that is not in the file."""
    for wrong in np.flatnonzero((numbers < 0) | (numbers >= len(vertices)))[:1]:
        line, _ = faces[int(np.searchsorted(np.cumsum(counts), wrong, side="right"))]
        expected = f"{vertices[0]} to {vertices[-1]:,}" if vertices else "one that is in the file"
        raise ValueProblem(f"{path}:{line}: a face has the vertex {typed[wrong]:,}, expected {expected}")


def _indices(values: Floats, path: Path) -> Numbers:
    for wrong in values[(values != np.rint(values)) | (np.abs(values) >= 2**53)][:1]:
        raise ValueProblem(f"{path}: read {wrong:.17g}, expected the number of a vertex")
    return values.astype(np.intp)


# --- PLY and GLB
#
# trimesh reads them in a confined process, as the files are untrusted: it may read files and do nothing else,
# and its time and memory are bounded. trimesh takes some things for others without a word, such as a skin,
# which are refused here. 3MF and COLLADA are not read, though trimesh has readers for them: of an object that
# is repeated within others (3MF), that reader leaves copies out without a word, and text that is no number
# becomes zero (COLLADA).

# The time that reading may take (s), and so much more a megabyte: trimesh loads in one or two seconds.
SECONDS, PER_MEGABYTE = 30.0, 1.0
TIMES_THE_FILE = 40  # the memory that trimesh may take beyond a gigabyte, in units of the size of the file
# Beginnings of the names of extensions that leave a surface where it is.
APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")
# Keys of a scene, at any depth, that move a surface or repeat it, and that trimesh passes over.
PASSED_OVER = ("skin", "weights", "sparse", "EXT_mesh_gpu_instancing")
READ = b"triangles\n"  # the first bytes of the answer of the process, where the file could be read


def _by_trimesh(path: Path) -> Floats:
    """The corners of a PLY file, or of all that a GLB file shows."""
    import subprocess  # which few documents need

    with _sized(path, WORDS):
        if find_spec("trimesh") is None:
            hint = "python -m pip install 'rigidcli[mesh]', or save it as STL"
            message = f"{path}: trimesh, which reads {path.suffix.lower()}, is not installed"
            raise ValueProblem(message, hint=hint)
        most = SECONDS + PER_MEGABYTE * path.stat().st_size / 1e6
        try:
            done = subprocess.run(  # noqa: S603 - this very program, by its absolute name
                [sys.executable, "-P", "-m", __name__, str(path.absolute())],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=most,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            reason = error.strerror if isinstance(error, OSError) else f"not done within {most:.0f} s"
            raise ValueProblem(f"{path}: cannot be read: {reason}", hint="save it as STL") from None
    if done.returncode == 0 and done.stdout.startswith(READ):
        return _in_rows(np.frombuffer(done.stdout, offset=len(READ)).reshape(-1, 3, 3))
    message = printable(shortened(done.stdout.decode("utf-8", "replace")))
    raise ValueProblem(f"{path}: {message or 'it takes too much memory to read'}", hint="save it as STL")


def _work(path: Path) -> bytes:
    """What the process answers: the triangles, or why there are none."""
    from rigidcli.sandbox import Limits, confine  # which only this process needs

    room = min(2**30 + TIMES_THE_FILE * path.stat().st_size, memory.available())
    confine(Limits(memory=int(room)), 1)  # standard output stays open, and nothing else
    try:
        kind = path.suffix[1:].lower()
        for what in _passed_over(path.read_bytes()) if kind == "glb" else ():
            return f"there is {shown(what)}, which trimesh does not read".encode()
        import trimesh  # which takes a second or two

        with path.open("rb") as file:
            scene = trimesh.load_scene(file, file_type=kind, process=False, validate=False)
        shown_as = [scene.graph.get(node)[1] for node in scene.graph.nodes_geometry]
        surfaces = [scene.geometry[name] for name in shown_as if hasattr(scene.geometry[name], "faces")]
        for surface in surfaces:
            faces, count = surface.faces, len(surface.vertices)
            for wrong in faces[(faces < 0) | (faces >= count)][:1]:
                return f"a face has the vertex {wrong:,} (counted from 0), and there are {count:,}".encode()
        triangles = scene.to_mesh().triangles if surfaces else np.empty((0, 3, 3))
        return READ + np.asarray(triangles, dtype=np.float64).tobytes()
    except MemoryError:
        return b""
    except Exception as error:  # noqa: BLE001 - whatever it is, nothing can be made of the file
        return f"trimesh cannot read it: {type(error).__name__}: {error}; is it cut or damaged?".encode()


def _passed_over(data: bytes) -> Iterator[str]:
    """The words in a .glb file for what trimesh passes over, or takes for something else."""
    # Behind a head of 12 bytes stand the length of the scene in JSON, four bytes for its kind, and the scene.
    pairs = list[tuple[str, Any]]()

    def keep(entries: list[tuple[str, Any]]) -> dict[str, Any]:
        pairs.extend(entries)
        return dict(entries)

    scene = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")], object_pairs_hook=keep)
    yield from (name for name in scene.get("extensionsRequired", []) if not name.startswith(APPEARANCE))
    if any("camera" in node and node.keys() & {"mesh", "children"} for node in scene.get("nodes", [])):
        yield "camera"
    for key, value in pairs:  # at any depth
        if key in PASSED_OVER:
            yield key
        elif (key, value) == ("mode", 6):
            yield "TRIANGLE_FAN"


# The readers that need no other library, by the ending of the file's name.
OWN: dict[str, Callable[[Path], Floats]] = {".stl": _stl, ".obj": _of_text, ".off": _of_text}
# The readers of meshes, by the ending of the file's name.
READERS = OWN | dict.fromkeys((".ply", ".glb"), _by_trimesh)


# --- what a surface encloses

# Vertices nearer than this, in units of the size, are one: single precision moves them by a tenth of it.
SAME_VERTEX = 1e-6
# The most triangles of a mesh that is taken apart into connected parts, which takes a tenth of a second.
MOST_TRIANGLES_IN_PARTS = 300_000
LEAST_VOLUME_OF_PART = 1e-9  # a part that encloses this share of the cube of the size is not flat
# About how many triangles, evenly chosen, and as many points, evenly spread, are where parts may overlap.
PROBES = 1024
MOST_TRIANGLES_WEIGHED = 30_000  # the most triangles over which points are spread, which takes 10 ms
# How far from a triangle a point beside it is, in units of the size: single precision moves both.
STEP_FROM_TRIANGLE = 1e-6
FARTHEST = 1e50  # the largest coordinate, in the unit of the file: no sum goes beyond the range of floats


class Checked(NamedTuple):
    """The surface in a file, with vertices merged where that was needed, and notes."""

    surface: Surface
    notes: tuple[str, ...]


def checked(path: Path) -> Checked:
    """The surface in a file, read once for all documents. Raises ValueProblem for what encloses no body."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _checked(path, (0, 0, 0))  # the reader says what is wrong
    return _checked(path, (status.st_ino, status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=4)
def _checked(path: Path, state: tuple[int, int, int]) -> Checked:
    surface, notes = _summed(corners(path), path), list[str]()
    if not surface.is_closed:
        surface = _merged(surface, path, notes)
    if not surface.is_closed and (gap := geometry.unpaired(surface.corners)) is not None:
        raise _gap(gap, path)
    if surface.is_flat:
        labels = geometry.components(geometry.vertex_keys(surface.corners))
        volumes = [Surface(surface.corners[:, :, labels == label]).volume for label in np.unique(labels)[:9]]
        if max(volumes) > LEAST_VOLUME_OF_PART * surface.size**3 and min(volumes) < 0:
            raise ValueProblem(
                f"{path}: its parts enclose {max(volumes):.6g} and {min(volumes):.6g} cubic units, "
                "so that one is inside out",
                hint="let the program that made the file orient its faces",
            )
        encloses = f"flat: it encloses {abs(surface.volume):.3g} cubic units"
        raise ValueProblem(f"{path}: {encloses}, and has an area of {surface.area:.6g} square units")
    is_inward = surface.volume < 0
    probes = np.arange(0, surface.triangles, max(1, surface.triangles // PROBES))
    labels = np.zeros(surface.triangles, dtype=np.intp)
    if surface.triangles <= MOST_TRIANGLES_IN_PARTS:
        labels = geometry.components(geometry.vertex_keys(surface.corners))
        first = np.sort(np.unique(labels, return_index=True)[1])
        probes = np.append(probes, first[:: -(-len(first) // PROBES)])
    some = np.arange(0, surface.triangles, 1 + surface.triangles // MOST_TRIANGLES_WEIGHED)
    weighed, spread = geometry.spread(surface.some(some), labels[some], PROBES)
    places = np.concatenate([surface.some(probes).mean(axis=1), spread])
    probes = np.concatenate([probes, some[weighed]])
    notes += _overlaps(path, surface, probes, places, labels, -1 if is_inward else 1)
    if is_inward:
        notes.append("it is wound inside out, and was turned")
    return Checked(surface, tuple(notes))


def _summed(corners: Floats, path: Path) -> Surface:
    surface = Surface(corners)
    if surface.triangles == 0:
        raise ValueProblem(f"{path}: no triangles")
    if not np.isfinite(surface.box).all():
        wrong = f"triangle {np.argmin(np.isfinite(corners).all(axis=(0, 1))):,} (counted from 0)"
        raise ValueProblem(f"{path}: {wrong} has a coordinate that is no finite number")
    if (farthest := np.abs(surface.box).max()) > FARTHEST:
        raise ValueProblem(f"{path}: a coordinate of {farthest:.3g}, expected at most {FARTHEST:g}")
    if not np.isfinite(surface.area) or surface.area <= 0:
        raise ValueProblem(f"{path}: the triangles have no area")
    return surface


def _merged(surface: Surface, path: Path, notes: list[str]) -> Surface:
    """An open surface with near vertices made one; `notes` gets how many."""
    distance = SAME_VERTEX * surface.size
    corners, count = geometry.merged(surface.corners, surface.box, distance)
    if count == 0:
        return surface
    were = "1 vertex was" if count == 1 else f"{count:,} vertices were"
    limit = f"{distance:.3g} units, {SAME_VERTEX:g} of its size"
    notes.append(f"{were} nearer than {limit}, to others, and merged")
    return _summed(corners, path)


# --- what is wrong


def _gap(gap: geometry.Unpaired, path: Path) -> ValueProblem:
    """Why a surface is not closed and wound in one sense, and where."""
    belong = "1 edge belongs" if gap.number == 1 else f"{gap.number:,} edges belong"
    start, end = map(_place_text, gap.edge)
    holes = "1 hole" if gap.holes == 1 else f"{gap.holes:,} holes"
    if gap.uses == 1:
        what = f"open: {belong} to one triangle only"
        hint = f"{holes}: close it in the program that made the file, or by Close Holes of MeshLab"
    elif gap.uses == 2:
        what = f"wound inconsistently: {belong} to triangles that do not agree where outside is"
        hint = "let the program that made the file orient its faces (or recalculate its normals)"
    else:
        what = f"not the surface of a body: {gap.uses} triangles meet in an edge"
        hint = "inside and outside alternate round an edge, so that an even number of triangles meet there"
    return ValueProblem(f"{path}: {what}, such as that from {start} to {end}", hint=hint)


def _place_text(point: Floats) -> str:
    return f"({', '.join(f'{coordinate:.9g}' for coordinate in point)})"


def _overlaps(
    path: Path, surface: Surface, probes: Numbers, places: Floats, labels: Numbers, orientation: int
) -> list[str]:
    """Notes on points beside the `places` (k, 3) that a closed surface encloses not just once.

    They lie on the triangles of the numbers `probes` (k). Triangles (n) with the same of the `labels` hang
    together. Raises ValueProblem for a part that is wound the other way and lies outside the others, so that
    it encloses no space.
    """
    step = STEP_FROM_TRIANGLE * surface.size * geometry.normals(surface.some(probes))
    points = np.concatenate([places - step, places + step])
    counts = orientation * surface.windings(points)
    below, notes = np.flatnonzero(counts < 0), list[str]()
    for part, place in zip(*np.unique(np.tile(labels[probes], 2)[below], return_index=True), strict=True):
        if orientation * Surface(surface.corners[:, :, labels == part]).volume <= 0:
            raise ValueProblem(
                f"{path}: a part is wound the other way, and is no cavity, as it is outside the others: "
                f"{_place_text(points[below[place]])}",
                hint="let the program that made the file orient its faces",
            )
    if len(below):
        where = f"the surface crosses itself: {_place_text(points[below[0]])} is enclosed the wrong way round"
        notes.append(f"{where}, and counts as less than nothing; mend it in the program that made the file")
    # What no point has met may still be seen in the sums: no body has a negative mean of squares.
    spread = np.linalg.eigvalsh(surface.second)
    if spread[0] < -ROUNDING_OF_SUM * surface.cancelled * spread[2]:
        raise ValueProblem(f"{path}: overlaps itself: no body has the moments that come out")
    most = int(np.argmax(counts))
    if counts[most] > 1:
        where = f"{_place_text(points[most])} is inside {counts[most]} times, and counts as often"
        cure = "to count it once, unite the parts in the program that made the file"
        notes.append(f"parts overlap: {where}; {cure}")
    return notes


if __name__ == "__main__":
    sys.stdout.buffer.write(_work(Path(sys.argv[1])))
    sys.stdout.flush()
