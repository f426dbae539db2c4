"""Surfaces of triangles from files, in blocks. Files are untrusted: only their size says how much they hold.

A block has the shape (3, 3, n): vertex, coordinate, triangle, in the unit of the file. STL is read through
one buffer: a memory map would count as memory, and would end the program where a file shrinks meanwhile.
Files of other formats are read whole, and so may not be as large.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BufferedReader
from itertools import cycle
from pathlib import Path

import numpy as np

from rigidcli.bodies import mesh_formats, mesh_ply
from rigidcli.bodies.edges import Read
from rigidcli.bodies.mesh_text import NUMERAL, parsed, words_of
from rigidcli.core import memory
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown

BLOCK_TRIANGLES = 8_000
"""The most triangles of a block, 0.6 MB; not a power of two, which would put rows on the same cache lines."""

HEADER_BYTES = 84
"""Length of the header of a binary STL file: 80 bytes of anything, and the number of triangles."""

FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle of a binary STL file. The normal is not used: it follows from the sense of the vertices."""

MOST_BYTES = 4_000_000_000
"""The largest STL file that is read, which has 80 million triangles: about half a minute's work."""

MOST_BYTES_AT_ONCE = 32_000_000
"""The largest file that is read whole: some 500,000 triangles."""

TIMES_THE_FILE = 80
"""So many times its size is the memory that a file may take which is read whole: one of very short words."""

CHUNK_BYTES = 1_000_000
"""How much text of an STL file is read at once; a facet takes some 250 bytes."""

PATTERN = b"facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 0 0 vertex 0 0 0 endloop endfacet".split()
"""The words of a facet in an STL file of text, where 0 stands for any number."""

NUMBERS = [place for place, word in enumerate(PATTERN) if word == b"0"][3:]
"""The places of the coordinates. The normal before them may be anything: it follows from the vertices."""

KEYWORDS = {place: word for place, word in enumerate(PATTERN) if word != b"0"}
"""The words of a facet that are no numbers, by their places."""

_SOLID = re.compile(rb"^[ \t]*(?:end)?solid\b.*$", re.MULTILINE)
"""The lines that begin and end a body in an STL file of text: they hold any name."""


def reader(path: Path) -> Read:
    """What starts the triangles of the file, in blocks, each of which may overwrite the one before.

    Raises:
        ValueProblem: here or while iterating; the message starts with `path`, then the line of a text.
    """
    made = READERS.get(path.suffix.lower())
    if made is None:
        endings = ", ".join(f"`{ending}`" for ending in READERS)
        raise ValueProblem(
            f"{path}: expected the name of a mesh, which ends in one of {endings}", hint="save it as STL"
        )
    return made(path)


@contextmanager
def _opened(path: Path, most: int) -> Iterator[tuple[BufferedReader, int]]:
    """A regular file of no more than so many bytes, and its size. Raises ValueProblem."""
    try:
        if not path.is_file():  # asked before opening: to open a pipe is to wait for its writer
            raise ValueProblem(f"{path}: {'not a regular file' if path.exists() else 'no such file'}")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size == 0:
                raise ValueProblem(f"{path}: the file is empty")
            if size > most:
                raise ValueProblem(
                    f"{path}: {size / 1e6:,.0f} MB, expected at most {most / 1e6:,.0f} MB",
                    hint="simplify the mesh" if most == MOST_BYTES else "save it as binary STL",
                )
            yield file, size
    except OSError as error:
        raise ValueProblem(f"{path}: cannot be read: {error.strerror or error}") from error


# --- STL


def _stl(path: Path) -> Read:
    return lambda: _facets(path)


def _facets(path: Path) -> Iterator[Floats]:
    with _opened(path, MOST_BYTES) as (file, size):
        header = file.read(HEADER_BYTES)
        count = int.from_bytes(header[80:84], "little")
        expected = HEADER_BYTES + count * FACET.itemsize
        # A binary file, too, may begin with `solid`.
        if len(header) == HEADER_BYTES and size == expected:
            yield from _binary(file, count, path)
            return
        start = header + file.read(1000)
        if start.lstrip()[:5].lower() == b"solid" and b"\0" not in start:
            file.seek(0)
            yield from _text(file, path)
            return
    if len(header) < HEADER_BYTES:
        raise ValueProblem(f"{path}: {size} bytes, which is shorter than the header of an STL file")
    raise ValueProblem(
        f"{path}: {size:,} bytes, expected {expected:,} for the {count:,} triangles that the header tells of",
        hint="the file is truncated, or no STL file: export or copy it once more",
    )


def _binary(file: BufferedReader, count: int, path: Path) -> Iterator[Floats]:
    most = min(count, BLOCK_TRIANGLES)
    facets, block = np.empty(most, FACET), np.empty((3, 3, most))
    for start in range(0, count, BLOCK_TRIANGLES):
        part = facets[: count - start]
        buffer = part.view(np.uint8).data
        if file.readinto(buffer) != buffer.nbytes:
            raise ValueProblem(f"{path}: the data end early")
        now = block[:, :, : len(part)]
        now[...] = part["vertices"].transpose(1, 2, 0)
        yield now


def _text(file: BufferedReader, path: Path) -> Iterator[Floats]:
    line, rest, last = 1, b"", b"endfacet"
    while True:
        chunk = file.read(CHUNK_BYTES).lower()
        text = rest + chunk
        end = text.rfind(last) + len(last) if chunk else len(text)
        if end < len(last) and chunk:
            if len(text) > 2 * CHUNK_BYTES:
                raise ValueProblem(f"{path}:{line}: no `endfacet` in {CHUNK_BYTES:,} bytes")
            rest = text
            continue
        yield from _whole_facets(text[:end], line, path)
        line += text.count(b"\n", 0, end)
        rest = text[end:]
        if not chunk:
            return


def _whole_facets(text: bytes, line: int, path: Path) -> Iterator[Floats]:
    """The triangles of a text of whole facets, in small letters, which begins in this line."""
    facets = _SOLID.sub(b"", text) if b"solid" in text else text  # to search for lines takes long
    characters = np.frombuffer(facets, dtype=np.uint8)
    begins, ends = words_of(characters)
    if len(begins) % len(PATTERN):
        raise _misread(text, line, path)
    begins, ends = (places.reshape(-1, len(PATTERN)) for places in (begins, ends))
    for place, word in KEYWORDS.items():
        at = begins[:, place, None] + np.arange(len(word))
        # A place beyond the end of the text is in a word that is too short.
        is_same = (characters.take(at, mode="clip") == np.frombuffer(word, dtype=np.uint8)).all(axis=1)
        if not (is_same & (ends[:, place] - begins[:, place] == len(word))).all():
            raise _misread(text, line, path)
    changes = np.zeros(len(characters) + 1, dtype=np.bool_)
    changes[begins[:, NUMBERS]] = changes[ends[:, NUMBERS]] = True
    is_number = np.logical_xor.accumulate(changes[:-1])
    numbers = np.where(is_number, characters, np.uint8(ord(" "))).tobytes()
    values = parsed(numbers, begins[:, NUMBERS].size)
    if values is None:
        raise _misread(text, line, path)
    triangles = values.reshape(-1, 3, 3).transpose(1, 2, 0)
    for start in range(0, len(begins), BLOCK_TRIANGLES):
        yield triangles[:, :, start : start + BLOCK_TRIANGLES]


def _misread(text: bytes, line: int, path: Path) -> ValueProblem:
    """The first word that does not belong where it stands."""
    expected = cycle(enumerate(PATTERN))
    for number, content in enumerate(_SOLID.sub(b"", text).split(b"\n"), line):
        for word, (place, keyword) in zip(content.split(), expected, strict=False):
            is_number = place in NUMBERS
            if (NUMERAL.fullmatch(word) is None) if is_number else keyword not in (word, b"0"):
                what = "a number" if is_number else f"`{keyword.decode()}`"
                read = shown(word.decode("utf-8", "replace"))
                return ValueProblem(f"{path}:{number}: read {read}, expected {what}")
    return ValueProblem(f"{path}:{number}: the file ends inside a facet", hint="it is truncated")


# --- formats that are read whole


def _whole(path: Path) -> Read:
    most = int(min(MOST_BYTES_AT_ONCE, memory.available() / TIMES_THE_FILE))
    with _opened(path, most) as (file, _):
        data = file.read(most + 1)
    polygons = WHOLE[path.suffix.lower()](data, path)
    vertices, faces = polygons.vertices, mesh_formats.triangles(polygons, path)
    starts = range(0, len(faces), BLOCK_TRIANGLES)
    return lambda: (vertices[faces[at : at + BLOCK_TRIANGLES]].transpose(1, 2, 0) for at in starts)


def _scene(path: Path) -> Read:
    from rigidcli.bodies.mesh_gltf import gltf

    with _opened(path, MOST_BYTES_AT_ONCE):
        blocks = gltf(path).transpose(1, 2, 0)
    starts = range(0, blocks.shape[2], BLOCK_TRIANGLES)
    return lambda: (blocks[:, :, at : at + BLOCK_TRIANGLES] for at in starts)


WHOLE = {".obj": mesh_formats.obj, ".ply": mesh_ply.ply, ".off": mesh_formats.off}
"""The readers of formats in which vertices and faces stand apart, by the ending of the file's name."""

OWN: dict[str, Callable[[Path], Read]] = {".stl": _stl, **dict.fromkeys(WHOLE, _whole)}
"""What reads a mesh without another library, by the ending of the file's name."""

READERS = OWN | dict.fromkeys((".glb", ".gltf"), _scene)
"""What reads a mesh, by the ending of the file's name."""
