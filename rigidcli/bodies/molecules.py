"""Molecules from .xyz files: atoms by their elements, with coordinates in angstrom.

The format has no standard. What is read is what programs agree on: the number of atoms, a line of comment,
and a line for each atom that begins with its element and x, y, z. Only the first of several frames is read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from io import BufferedReader
from itertools import islice
from pathlib import Path

import numpy as np

from rigidcli.bodies.isotopes import Isotope, isotope
from rigidcli.bodies.points import opened
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.units import parse_unit

MOST_ATOMS = 500_000
"""The most atoms that are read, which takes two seconds."""

LINE_BYTES = 10_000
"""The most bytes of a line: an atom with velocity, force and charge has two hundred, comments are longer."""

FIRST_ATOM = 3
"""The line of the first atom."""

BLANK_LINES = 1000
"""The most blank lines after the last atom behind which another frame is looked for."""

JUDGED_ATOMS = 1000
"""The atoms whose coordinates tell how many decimals a file has: all would take as long as reading does."""

FEWEST_DECIMALS = 3
"""Coordinates in angstrom with fewer decimals are taken to be written to so many: `0 0 1` is not rounded."""

ANGSTROM = float(parse_unit("angstrom").factor)
"""The unit of the coordinates (m)."""

ATOMIC_MASS = float(parse_unit("u").factor)
"""The atomic mass constant (kg)."""

_COUNT = re.compile(r"[0-9]+")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_PROPERTIES = re.compile(r"\bProperties=\"?([^\s\"]+)", re.IGNORECASE)
_USUAL = "species:s:1:pos:r:3"
"""How the list of columns in a comment of the extended format begins where they are as in the plain one."""


@dataclass(frozen=True, slots=True, eq=False)
class Molecule:
    """Atoms as point masses (n by 4: m, x, y, z in kg and m), the rounding of their coordinates, and notes.

    A coordinate may be off by `rounding` (m), half a unit of the last decimal.
    """

    atoms: Floats
    rounding: float
    notes: tuple[str, ...]


def read_molecule(path: Path) -> Molecule:
    """The molecule in the .xyz file at `path`.

    Raises ValueProblem where the file cannot be read, or is no such file; the message begins with `path` as
    given and the line.
    """
    with opened(path) as file:
        return _Reader(file, str(path)).molecule()


class _Reader:
    """Reads a file line by line, and knows where it is."""

    def __init__(self, file: BufferedReader, name: str) -> None:
        self._lines = self._numbered(file)
        self._name = name
        self._line = 0
        self._kinds: dict[str, tuple[Isotope, bool]] = {}
        self._decimals = FEWEST_DECIMALS
        self._is_wide = False

    def molecule(self) -> Molecule:
        count = self._count()
        self._comment()
        # A count that lies costs nothing: rows are kept as they come.
        rows = [self._atom(index, count) for index in range(count)]
        atoms = np.array(rows) * [ATOMIC_MASS, ANGSTROM, ANGSTROM, ANGSTROM]
        if not np.isfinite(atoms).all():
            raise ValueProblem(f"{self._name}: coordinates beyond the range of floating-point numbers")
        self._require_apart(atoms[:, 1:])
        return Molecule(atoms, ANGSTROM * 10.0**-self._decimals / 2, tuple(self._notes(count)))

    def _numbered(self, file: BufferedReader) -> Iterator[str]:
        """The lines as text, while `_line` counts them."""
        while data := file.readline(LINE_BYTES):
            self._line += 1
            if len(data) == LINE_BYTES:
                raise self._problem(f"a line of more than {LINE_BYTES} bytes")
            yield data.decode("utf-8-sig" if self._line == 1 else "utf-8", "replace")

    def _problem(self, message: str, hint: str | None = None) -> ValueProblem:
        return ValueProblem(f"{self._name}:{max(self._line, 1)}: {message}", hint=hint)

    def _count(self) -> int:
        text = next(self._lines, "").strip()
        if not _COUNT.fullmatch(text):
            hint = "an .xyz file has the number of atoms, a line of comment, and then a line for each atom"
            raise self._problem(f"read {shown(text)}, expected the number of atoms", hint)
        if not 0 < len(text) <= len(str(MOST_ATOMS)) or not 0 < int(text) <= MOST_ATOMS:
            raise self._problem(f"read {shown(text)}, expected 1 to {MOST_ATOMS:,} atoms")
        return int(text)

    def _comment(self) -> None:
        """Pass over the comment; raise where it says that the columns are not the usual ones."""
        found = _PROPERTIES.search(next(self._lines, ""))
        if found is not None and not found[1].lower().startswith(_USUAL):
            raise self._problem(
                f"read {shown(found[0])}, expected columns that begin with the element and x, y, z"
            )

    def _atom(self, index: int, count: int) -> tuple[float, float, float, float]:
        """Mass (u) and coordinates (angstrom) of the next atom."""
        text = next(self._lines, None)
        fields = [] if text is None else text.split()
        if len(fields) < 4:
            ended = "the file ends" if text is None else f"read {shown(text.strip())}"
            told = f"{ended} after {index} of {count} atoms, expected a line such as `O 0.0 0.0 0.1`"
            raise self._problem(told, "the first line has the number of atoms")
        self._is_wide = self._is_wide or len(fields) > 4
        kind = fields[0]
        if kind not in self._kinds:
            try:
                self._kinds[kind] = isotope(kind)
            except ValueProblem as problem:
                raise self._problem(problem.message, problem.hint) from None
        x, y, z = (float(typed) if _NUMBER.fullmatch(typed) else math.nan for typed in fields[1:4])
        if index < JUDGED_ATOMS or not math.isfinite(x + y + z):
            for axis, typed, value in zip("xyz", fields[1:4], (x, y, z), strict=True):
                self._judge(axis, typed, value)
        return self._kinds[kind][0].mass, x, y, z

    def _require_apart(self, places: Floats) -> None:
        """Raise ValueProblem where two atoms are at the same place, as after a line was copied."""
        order = np.lexsort(places.T)
        same = np.flatnonzero((np.diff(places[order], axis=0) == 0).all(axis=1))
        if len(same):
            first, second = sorted(order[same[0] : same[0] + 2] + FIRST_ATOM)
            raise ValueProblem(f"{self._name}:{second}: an atom at the place of that in line {first}")

    def _judge(self, axis: str, typed: str, value: float) -> None:
        """Take note of the decimals of a coordinate. Raises ValueProblem where it is no finite number."""
        if not math.isfinite(value):
            raise self._problem(f"{axis}: read {shown(typed)}, expected a number")
        exponent = Decimal(typed).as_tuple().exponent
        assert isinstance(exponent, int)
        self._decimals = max(self._decimals, -exponent)

    def _notes(self, count: int) -> Iterator[str]:
        """What a reader should know; raises where lines follow that are not of another frame."""
        left = dict.fromkeys(kind.name for kind, is_named in self._kinds.values() if not is_named)
        if left:
            yield (
                f"masses are those of the most abundant isotopes, {', '.join(left)}; "
                "others are named in the file, as `13C` or `D`"
            )
        if self._is_wide:
            yield "what follows x, y, z in a line is not read"
        rest = next((text for line in islice(self._lines, BLANK_LINES) if (text := line.strip())), None)
        if rest is not None and not _COUNT.fullmatch(rest):
            raise self._problem(
                f"read {shown(rest)} after the {count} atoms of the first line, expected the end",
                "the first line has the number of atoms",
            )
        if rest is not None:
            yield f"the first of several frames is read, up to line {self._line - 1}"
