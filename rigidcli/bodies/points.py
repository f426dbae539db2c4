"""Point masses from a file, in blocks: any number of them in a bounded amount of memory.

A block is an array of rows m, x, y, z in the file's units. Reading into one buffer beats a memory
map of the same file, and a file that shrinks meanwhile is an error and not a crash.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, BytesIO
from pathlib import Path

import numpy as np
import orjson
from numpy.typing import NDArray

from rigidcli.errors import ValueProblem, shown

Block = NDArray[np.float64]

COLUMNS = ("m", "x", "y", "z")
"""What the columns of a block hold, in this order."""

MOLECULE = ".xyz"
"""The ending of files whose points are atoms: they say more, and are read by a module of their own."""

BLOCK_ROWS = 25_000
"""The most rows of a block, 0.8 MB; not a power of two, which would put columns on the same cache lines."""

CHUNK_BYTES = 8 * (BLOCK_ROWS - 1)
"""How much CSV text is read at once.

A line has 8 bytes at least, `1,2,3,4` and its end, so that a chunk with the rest of its last line holds no
more rows than a block.
"""

LINE_BYTES = 10_000
"""The most bytes by which a line may exceed a chunk: four numbers take a hundred."""

HEADER_BYTES = 16_384
"""The most bytes of the header of a .npy file: one of four columns takes a hundred."""


def blocks(path: Path, *, checked: bool = True) -> Iterator[Block]:
    """Blocks of point masses, each of shape (n, 4) with 0 < n <= BLOCK_ROWS, columns m, x, y, z.

    `.npy` files hold an array of shape (n, 4) of any real type; `.csv` files a header that names
    the columns, in any order, and plain decimal numbers. A block is C-contiguous, every value is
    finite and every mass positive. It may be changed in place, but the next one may reuse its
    memory. Unless `checked`, an array may hold anything: to look takes a sixth of the time, and a
    caller sees in its sums whether it must ask again.

    Raises:
        ValueProblem: while iterating; the file cannot be read or holds something else. The message
            starts with `path` as given, then the line of a CSV file or the row of an array.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(f"`{ending}`" for ending in READERS)
        raise ValueProblem(f"{path}: expected a file name that ends in {known} or `{MOLECULE}`")
    empty = True
    with opened(path) as file:
        for block in reader(file, str(path), checked):
            empty = False
            yield block
    if empty:
        raise ValueProblem(f"{path}: no points")


@contextmanager
def opened(path: Path) -> Iterator[BufferedReader]:
    """The regular file at `path`, open for reading. Raises ValueProblem where it cannot be read."""
    try:
        if not path.is_file():  # asked before opening: to open a pipe is to wait for its writer
            raise ValueProblem(f"{path}: {'not a regular file' if path.exists() else 'no such file'}")
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise ValueProblem(f"{path}: cannot be read: {error.strerror or error}") from error


# --- .npy


def _npy_blocks(file: BufferedReader, name: str, checked: bool) -> Iterator[Block]:
    rows, fortran_order, dtype = _npy_header(file, name)
    start_of_data = file.tell()
    size = rows * len(COLUMNS) * dtype.itemsize
    found = file.seek(0, os.SEEK_END) - start_of_data
    if found != size:
        raise ValueProblem(f"{name}: {found} bytes of data, expected {size} for {rows} rows of `{dtype}`")
    file.seek(start_of_data)

    most = min(rows, BLOCK_ROWS)
    raw = np.empty((len(COLUMNS), most) if fortran_order else (most, len(COLUMNS)), dtype)
    converted = np.empty((most, len(COLUMNS)))
    for start in range(0, rows, BLOCK_ROWS):
        count = min(BLOCK_ROWS, rows - start)
        if fortran_order:
            for index in range(len(COLUMNS)):
                file.seek(start_of_data + (index * rows + start) * dtype.itemsize)
                _fill(raw[index, :count], file, name)
            part = raw[:, :count].T
        else:
            part = raw[:count]
            _fill(part, file, name)
        block = converted[:count]
        if part.dtype == block.dtype and part.flags.c_contiguous:
            block = part
        else:
            with np.errstate(over="ignore"):  # an extended number that becomes infinite is refused
                np.copyto(block, part)
        if checked:
            _require_points(block, start, name)
        yield block


def _npy_header(file: BufferedReader, name: str) -> tuple[int, bool, np.dtype[np.generic]]:
    """Rows, whether in Fortran order, and type; leaves the file where the data start."""
    head = BytesIO(file.read(HEADER_BYTES))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about headers that Python 2 has written
            version = np.lib.format.read_magic(head)
            if version == (1, 0):
                shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(head)
            else:  # (3, 0) differs in its encoding, for names that no plain array has
                shape, fortran_order, dtype = np.lib.format.read_array_header_2_0(head)
    except Exception as error:  # numpy reads hostile text as a literal: anything may come
        raise ValueProblem(f"{name}: not a .npy file of numpy, or a broken one") from error
    if dtype.kind not in "fiu":
        raise ValueProblem(f"{name}: an array of {shown(str(dtype))}, expected real numbers")
    if len(shape) != 2 or shape[1] != len(COLUMNS) or shape[0] < 0:
        hint = "save the transposed array" if len(shape) == 2 and shape[0] == len(COLUMNS) else None
        raise ValueProblem(f"{name}: shape {shown(str(shape))}, expected (n, 4) for m, x, y, z", hint=hint)
    file.seek(head.tell())
    return shape[0], fortran_order, dtype


def _fill(part: NDArray[np.generic], file: BufferedReader, name: str) -> None:
    buffer = part.view(np.uint8).data
    if file.readinto(buffer) != buffer.nbytes:
        raise ValueProblem(f"{name}: the data end early")


def _require_points(block: Block, start: int, name: str) -> None:
    """Refuse what is no point mass; `start` is the number of the block's first row."""
    if _all_point_masses(block):
        return
    wrong = ~np.isfinite(block)
    wrong[:, 0] |= block[:, 0] <= 0
    row, column = np.argwhere(wrong)[0]
    value = float(block[row, column])
    raise ValueProblem(
        f"{name}: row {start + row} (counted from 0): {_fault(column, f'{value:.17g}', value)}"
    )


# --- .csv

_NUMERALS = b"0123456789+-.eE \t\r"
"""What an ordinary line consists of, commas and newline apart."""

_NUMBER = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def _csv_blocks(file: BufferedReader, name: str, checked: bool) -> Iterator[Block]:
    places = _csv_header(file.readline(LINE_BYTES), name)
    line = 2
    while chunk := file.read(CHUNK_BYTES):
        last_line = line + chunk.count(b"\n")
        rest = file.readline(LINE_BYTES)  # of the last line
        if len(rest) == LINE_BYTES:
            raise ValueProblem(f"{name}:{last_line}: a line of more than {LINE_BYTES} bytes")
        text = chunk + rest
        block = _quick_block(text, places)
        if block is None:
            block = _careful_block(text, places, line, name)
        if len(block):
            yield block
        line = last_line + rest.count(b"\n")


def _csv_header(header: bytes, name: str) -> list[int]:
    """The place of each of m, x, y, z in a line."""
    text = header.decode("utf-8-sig", "replace").strip()
    titles = [title.strip() for title in text.split(",")]
    if sorted(titles) != sorted(COLUMNS):
        raise ValueProblem(f"{name}:1: header {shown(text)}, expected `m,x,y,z` in any order")
    return [titles.index(column) for column in COLUMNS]


def _quick_block(text: bytes, places: list[int]) -> Block | None:
    """The rows of ordinary text, all values at once; None when anything is out of the ordinary.

    Three commas a line and nothing but numerals between them: that leaves no room for a line that
    borrows a value from the next, nor for `nan`, `0x10` and `1_000`.
    """
    text = text.rstrip() + b"\n"
    if text.translate(None, _NUMERALS) != b",,,\n" * text.count(b"\n"):
        return None
    try:
        values = _floats(text[:-1].replace(b"\n", b","))
    except ValueError:
        return None
    block = np.array(values, dtype=np.float64).reshape(-1, len(COLUMNS)).take(places, axis=1)
    return block if _all_point_masses(block) else None


def _floats(text: bytes) -> list[float]:
    """The numbers between commas."""
    try:
        numbers: list[float] = orjson.loads(b"[" + text + b"]")  # much the fastest
    except orjson.JSONDecodeError:  # JSON has no `+1`, `.5`, `1.` and `01`
        numbers = [float(number) for number in text.split(b",")]
    return numbers


def _careful_block(text: bytes, places: list[int], first_line: int, name: str) -> Block:
    """The rows of any text, value by value; refuses by line and column. Blank lines are skipped."""
    rows = []
    for line, content in enumerate(text.split(b"\n"), first_line):
        if not content.strip():
            continue
        values = content.split(b",")
        if len(values) != len(COLUMNS):
            raise ValueProblem(f"{name}:{line}: read {len(values)} values, expected {len(COLUMNS)}")
        rows.append(
            [_number(values[place].strip(), column, f"{name}:{line}") for column, place in enumerate(places)]
        )
    return np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS))


def _number(text: bytes, column: int, place: str) -> float:
    value = float(text) if _NUMBER.fullmatch(text) else None
    if value is None or not math.isfinite(value) or (column == 0 and value <= 0):
        raise ValueProblem(f"{place}: {_fault(column, text.decode('utf-8', 'replace'), value)}")
    return value


# --- both


def _all_point_masses(block: Block) -> bool:
    """Whether all masses are positive and all values finite."""
    return bool(block[:, 0].min() > 0 and np.isfinite(block).all())


def _fault(column: int, text: str, value: float | None) -> str:
    """What is wrong with a text in a column: no number, not finite, or not a mass."""
    kind = "a number" if value is None else "a positive mass" if math.isfinite(value) else "a finite number"
    return f"column {COLUMNS[column]}: read {shown(text)}, expected {kind}"


READERS = {".csv": _csv_blocks, ".npy": _npy_blocks}
"""The readers of tables of points, by the endings of their names."""
