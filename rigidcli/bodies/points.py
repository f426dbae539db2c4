"""Point masses as a form of body: in the document, in a table, or as the atoms of a molecule.

A table is read in blocks, any number of points in a bounded amount of memory. A block is an array of rows
m, x, y, z in SI units.
"""

from __future__ import annotations

import csv
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import suppress
from fractions import Fraction
from functools import cached_property
from io import BufferedReader
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self, TypeAlias

import numpy as np
import orjson
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationInfo, model_validator

from rigidcli.bodies.form import Form
from rigidcli.core import mass_properties
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.errors import ComputationError, ValueProblem, at, shown
from rigidcli.fields.dimensions import LENGTH, MASS, check_dimension
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import AsList, Coordinate, Mass, Vector3
from rigidcli.fields.section import Alternative, Section, environment, reference
from rigidcli.fields.texts import opened
from rigidcli.fields.units import parse_unit
from rigidcli.language.numerals import NUMERAL

if TYPE_CHECKING:
    from rigidcli.bodies.molecules import Molecule

Block = NDArray[np.float64]

COLUMNS = ("m", "x", "y", "z")  # what the columns of a block hold, in this order
# The ending of files whose points are atoms: they say more, and are read by a module of their own.
MOLECULE = ".xyz"
# The most rows of a block, 0.8 MB; not a power of two, which would put columns on the same cache lines.
BLOCK_ROWS = 25_000
# How much CSV text is read at once. A line has 8 bytes at least, `1,2,3,4` and its end, so that a chunk with
# the rest of its last line holds no more rows than a block.
CHUNK_BYTES = 8 * (BLOCK_ROWS - 1)
LINE_BYTES = 10_000  # the most bytes by which a line may exceed a chunk: four numbers take a hundred


def blocks(path: Path) -> Iterator[Block]:
    """Blocks of point masses, of shape (n, 4) with 0 < n <= BLOCK_ROWS, columns m, x, y, z.

    `.npy` files hold an array of shape (n, 4) of any real type, in SI units; `.csv` files a header that
    names the columns, in any order and perhaps with units, and decimal numbers. A block is C-contiguous,
    every value is finite and every mass positive. Raises ValueProblem, while iterating, which names the path
    and the line of a CSV file or the row of an array.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        endings = ", ".join(f"`{ending}`" for ending in READERS)
        hint = "each point is a list: `points: [[m, x, y, z]]`" if ", " in path.name else None
        hint = "a dash has a blank behind it: write `- [m, x, y, z]`" if "-[" in path.name else hint
        raise ValueProblem(f"{path}: expected a file name that ends in {endings} or `{MOLECULE}`", hint=hint)
    block = None
    with opened(path) as file:
        for block in reader(file, str(path)):
            yield block
    if block is None:
        raise ValueProblem(f"{path}: no points")


# --- .npy


def _npy_blocks(file: BufferedReader, name: str) -> Iterator[Block]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about headers that Python 2 has written
            array: NDArray[Any] = np.lib.format.open_memmap(name, mode="r")
    except Exception as error:  # numpy reads hostile text as a literal: anything may come
        raise ValueProblem(f"{name}: no .npy file of numbers as numpy writes it, or a cut one") from error
    if array.dtype.kind not in "fiu":
        raise ValueProblem(f"{name}: an array of {shown(str(array.dtype))}, expected real numbers")
    if array.ndim != 2 or array.shape[1] != len(COLUMNS):
        hint = "save the transposed array" if array.ndim == 2 and len(array) == len(COLUMNS) else None
        message = f"{name}: shape {shown(str(array.shape))}, expected (n, 4) for m, x, y, z"
        raise ValueProblem(message, hint=hint)
    for start in range(0, len(array), BLOCK_ROWS):
        with np.errstate(over="ignore"):  # an extended number that becomes infinite is refused
            block = np.ascontiguousarray(array[start : start + BLOCK_ROWS], dtype=np.float64)
        if not _all_point_masses(block):
            wrong = ~np.isfinite(block)
            wrong[:, 0] |= block[:, 0] <= 0
            row, column = np.argwhere(wrong)[0]
            value = float(block[row, column])
            fault = _fault(column, f"{value:.17g}", value)
            raise ValueProblem(f"{name}: row {start + row} (counted from 0): {fault}")
        yield block


# --- .csv

_NUMERALS = b"0123456789+-.eE \t\r"  # what an ordinary line consists of, separators and newline apart

_NUMBER = re.compile(NUMERAL)

# The head of a column: its name, and perhaps its unit, as in `x (cm)`, also in quotes as R writes them.
_HEAD = re.compile(r'(")?(m|mass|x|y|z)\s*(?:[(\[]\s*(.+?)\s*[)\]])?(?(1)")', re.IGNORECASE)

# The heads of columns that say which point it is, and are not read.
_LABEL_WORDS = "body comment description id index item label material name no part"
LABELS = {"", "#", *_LABEL_WORDS.split()}

# What makes commas of the separators of a table, and points of the decimal commas beside `;`.
_PLAIN = {b",": None, b"\t": bytes.maketrans(b"\t", b","), b";": bytes.maketrans(b";,", b",.")}


class _Layout(NamedTuple):
    """What the header of a table says: the separator; for m, x, y and z the place in a line, and the unit.

    `columns` is their number, with those of `labels`, which are not read.
    """

    separator: bytes
    places: list[int]
    units: Block
    columns: int
    labels: list[str]


def _csv_blocks(file: BufferedReader, name: str) -> Iterator[Block]:
    layout = _layout(file.readline(LINE_BYTES), name)
    plain = _PLAIN[layout.separator]
    line = 2
    while chunk := file.read(CHUNK_BYTES):
        last_line = line + chunk.count(b"\n")
        rest = file.readline(LINE_BYTES)  # of the last line
        if len(rest) == LINE_BYTES:
            raise ValueProblem(f"{name}:{last_line}: a line of more than {LINE_BYTES} bytes")
        text, block = chunk + rest, None
        if layout.columns == len(COLUMNS):
            block = _quick_block(text if plain is None else text.translate(plain), layout.places)
        if block is None:
            block = _careful_block(text, layout, line, name)
        if len(block):
            yield block if (layout.units == 1).all() else block * layout.units
        line = last_line + rest.count(b"\n")


def _layout(header: bytes, name: str) -> _Layout:
    text = header.decode("utf-8-sig", "replace").strip()
    separator = next((sign for sign in ";,\t" if sign in text), ",")
    heads = [_HEAD.fullmatch(head.strip()) for head in text.split(separator)]
    found = {k: head for k, head in enumerate(heads) if head is not None}
    names = [head[2].lower()[0] for head in found.values()]
    others = {head.strip('" ').lower() for k, head in enumerate(text.split(separator)) if k not in found}
    if sorted(names) != sorted(COLUMNS) or others - LABELS:
        message = f"{name}:1: header {shown(text)}, expected `m,x,y,z` in any order"
        cure = "columns are separated by `,`, `;` or tabs, and may have units"
        raise ValueProblem(message, hint=f"{cure}: `m (g), x (cm), y (cm), z (cm)`")
    units = np.ones(len(COLUMNS))
    for column, head in zip(map(COLUMNS.index, names), found.values(), strict=True):
        if head[3]:
            try:
                unit = parse_unit(head[3])
                check_dimension(unit.text, unit.dimension, LENGTH if column else MASS)
            except ValueProblem as problem:
                message = f"{name}:1: column {head[2]}: {problem.message}"
                raise ValueProblem(message, hint=problem.hint) from None
            units[column] = unit.si(Fraction(1))
    places = dict(zip(names, found, strict=True))
    labels = sorted(others - {"", "#"})
    return _Layout(separator.encode(), [places[column] for column in COLUMNS], units, len(heads), labels)


def _quick_block(text: bytes, places: list[int]) -> Block | None:
    """The rows of ordinary text, all values at once; None when anything is out of the ordinary.

    Three commas a line and nothing but numerals between them: that leaves no room for a line that
    borrows a value from the next, nor for `nan`, `0x10` and `1_000`.
    """
    text = text.rstrip() + b"\n"
    if text.translate(None, _NUMERALS) != b",,,\n" * text.count(b"\n"):
        return None
    flat = text[:-1].replace(b"\n", b",")
    try:
        values = orjson.loads(b"[" + flat + b"]")  # much the fastest
    except orjson.JSONDecodeError:  # JSON has no `+1`, `.5`, `1.` and `01`, which are out of the ordinary
        return None
    block = np.array(values, dtype=np.float64).reshape(-1, len(COLUMNS)).take(places, axis=1)
    return block if _all_point_masses(block) else None


def _careful_block(text: bytes, layout: _Layout, first_line: int, name: str) -> Block:
    """The rows of any text, value by value; refuses by line and column. Blank lines are skipped."""
    rows, separator = [], layout.separator.decode()
    for line, content in enumerate(text.decode("utf-8", "replace").split("\n"), first_line):
        if not content.strip():
            continue
        values = content.split(separator)
        if '"' in content:
            with suppress(csv.Error):
                (values,) = csv.reader([content], delimiter=separator)
        if len(values) != layout.columns:
            raise ValueProblem(f"{name}:{line}: read {len(values)} values, expected {layout.columns}")
        for column, place in enumerate(layout.places):
            typed = values[place].strip()
            number = typed.replace(",", ".") if separator == ";" else typed
            value = float(number) if _NUMBER.fullmatch(number) else None
            if value is None or not math.isfinite(value) or (column == 0 and value <= 0):
                hint = (
                    "write decimals with a point, or `;` between the columns"
                    if "," in typed and separator == ","
                    else None
                )
                raise ValueProblem(f"{name}:{line}: {_fault(column, typed, value)}", hint=hint)
            rows.append(value)
    return np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS))


# --- both


def _all_point_masses(block: Block) -> bool:
    return bool(block[:, 0].min() > 0 and np.isfinite(block).all())


def _fault(column: int, text: str, value: float | None) -> str:
    """What is wrong with a text in a column: no number, not finite, or not a mass."""
    kind = "a number" if value is None else "a positive mass" if math.isfinite(value) else "a finite number"
    return f"column {COLUMNS[column]}: read {shown(text)}, expected {kind}"


# The readers of tables of points, by the endings of their names.
READERS = {".csv": _csv_blocks, ".npy": _npy_blocks}


# --- the form of body


class PointMass(Section):
    """A point with a mass."""

    mass: Mass
    position: Vector3


def _row(raw: Mapping[str, Any], env: Environment) -> tuple[Scalar, ...]:
    point = PointMass.model_validate(raw, context=env)
    return (point.mass, *point.position)


_NUMBERS = Annotated[tuple[Mass, Coordinate, Coordinate, Coordinate], AsList]
Row: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar, Scalar], Alternative(dict, _row, _NUMBERS, reference(PointMass))
]


def _with_masses(raw: object) -> object:
    """What is written under `points`. Raises ValueProblem, once, for a list of places without masses."""
    if isinstance(raw, list) and raw and all(isinstance(row, list) and len(row) == 3 for row in raw):
        hint = "the mass comes first: [1, x, y, z] is a point of 1 kg"
        raise ValueProblem("read points of 3 numbers, expected [m, x, y, z]", hint=hint)
    return raw


class PointMasses(Form):
    """Point masses in the document or in a file.

    A .csv has the header m,x,y,z, a .npy the shape (n, 4), and an .xyz the atoms of a molecule.
    """

    points: Annotated[
        tuple[Row, ...] | Path,
        Alternative(
            str,
            lambda raw, env: env.file(raw),
            otherwise=Annotated[tuple[Row, ...], AsList, Field(min_length=1)],
            schema={"type": "string", "description": "A .csv, .npy or .xyz file, beside the document"},
        ),
        BeforeValidator(_with_masses),
    ]

    _molecule: Molecule | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _read_file(self, info: ValidationInfo) -> Self:
        if isinstance(self.points, Path) and self.points.suffix.lower() == MOLECULE:
            from rigidcli.bodies.molecules import read_molecule

            with at("points"):
                self._molecule = read_molecule(self.points)
            environment(info).log.note(*self._molecule.notes)
        elif isinstance(self.points, Path) and self.points.suffix.lower() == ".csv":
            with at("points"), opened(self.points) as file:
                labels = _layout(file.readline(LINE_BYTES), str(self.points)).labels
            if labels:
                names = ", ".join(f"`{name}`" for name in labels)
                environment(info).log.note(f"{self.points.name} has columns that are not read: {names}")
        return self

    @property
    def rounding(self) -> float | None:
        """That of the coordinates in the file of a molecule (m)."""
        return None if self._molecule is None else self._molecule.rounding

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Sums over the points, which are read in blocks from a file."""
        if not isinstance(self.points, Path):
            return mass_properties.of_points(arithmetic.array(self.points), arithmetic)
        if arithmetic.exact:
            raise ComputationError(
                f"the points in {self.points} are floats, and have no exact results",
                hint="leave out `--exact` and give every parameter a value, or write the points out",
            )
        return self._in_file

    def blocks(self) -> Iterator[Block]:
        """Blocks of rows m, x, y, z, as the function `blocks` gives them; of points with float values."""
        if self._molecule is not None:
            yield self._molecule.atoms
        elif isinstance(self.points, Path):
            yield from blocks(self.points)
        else:
            yield np.array(self.points, dtype=np.float64)

    @cached_property
    def _in_file(self) -> mass_properties.MassProperties:
        with at("points"):
            return mass_properties.of_blocks(self.blocks)
