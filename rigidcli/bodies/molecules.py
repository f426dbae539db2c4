"""Molecules from .xyz files: atoms by their elements, with coordinates in angstrom.

The format has no standard. What is read is what programs agree on: the number of atoms, a line of comment,
and a line for each atom that begins with its element and x, y, z. Only the first of several frames is read.

`isotopes.csv` has the isotopes that occur in nature, those that the periodic table lists for elements
without stable ones, and a few tracers. Relative atomic masses are those of the Atomic Mass Evaluation 2020
(M. Wang and others, Chinese Physics C 45 (2021) 030003); abundances are the representative isotopic
compositions of NIST (J. S. Coursey and others, Atomic Weights and Isotopic Compositions, version 4.1), and
empty where there is none.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, partial
from itertools import islice
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.texts import opened
from rigidcli.fields.units import parse_unit
from rigidcli.language.numerals import NUMERAL

MOST_ATOMS = 500_000  # the most atoms that are read, which takes two seconds
# The most bytes of a line: an atom with velocity, force and charge has two hundred, comments are longer.
LINE_BYTES = 10_000
FIRST_ATOM = 3  # the line of the first atom
# The atoms whose coordinates tell how many decimals a file has: all would take as long as reading does.
JUDGED_ATOMS = 1000
# Coordinates in angstrom with fewer decimals are taken to be written to so many: `0 0 1` is not rounded.
FEWEST_DECIMALS = 3
ANGSTROM = float(parse_unit("angstrom").factor)  # the unit of the coordinates (m)
ATOMIC_MASS = float(parse_unit("u").factor)  # the atomic mass constant (kg)

_COUNT = re.compile(r"[0-9]+")
_NUMBER = re.compile(NUMERAL)
# An element by its symbol, with a mass number before it for one isotope; or by its atomic number.
_NAMED = re.compile(r"([0-9]{0,3})([A-Za-z]{1,2})|([0-9]{1,3})")
# The list of columns in the comment of the extended format.
_PROPERTIES = re.compile(r"\bProperties=\"?([^\s\"]+)", re.IGNORECASE)

EXAMPLE, HEAD = "a line such as `O 0.0 0.0 0.1`", "the first line has the number of atoms"

_HYDROGEN = {"D": "2H", "T": "3H"}  # the isotopes that have symbols of their own


class Isotope(NamedTuple):
    """A kind of atom, with its mass in atomic mass units, and the abundance 0 where it has none."""

    number: int
    symbol: str
    nucleons: int
    mass: float
    abundance: float

    @property
    def name(self) -> str:
        """Its name, such as `13C`."""
        return f"{self.nucleons}{self.symbol}"


@cache
def table() -> tuple[Isotope, ...]:
    """All isotopes, by atomic and mass number."""
    lines = Path(__file__).with_name("isotopes.csv").read_text("ascii").splitlines()
    cells = (line.split(",") for line in lines[1:])
    return tuple(
        Isotope(int(number), symbol, int(nucleons), float(mass), float(abundance or 0))
        for number, symbol, nucleons, mass, abundance in cells
    )


def isotope(text: str) -> tuple[Isotope, bool]:
    """The isotope that a file means by `text`, and whether it is named there.

    `C`, `c` and `6` mean the most abundant isotope of carbon, `13C` is one by its mass number, `D` and `T`
    are those of hydrogen. Raises ValueProblem for other texts, for isotopes that are not listed, and for
    elements that have no stable isotope to be meant.
    """
    named = _NAMED.fullmatch(_HYDROGEN.get(text.upper(), text))
    nucleons, symbol, number = named.groups("") if named else ("", "", "")
    element = [
        kind
        for kind in table()
        if (kind.number == int(number) if number else kind.symbol == symbol.capitalize())
    ]
    if not element:
        raise ValueProblem(
            f"read {shown(text)}, expected the symbol of an element, its atomic number, or an isotope",
            hint="atoms are written as `C`, `6`, `13C` or `D`; a dummy atom has no mass, and is left out",
        )
    hint = f"the isotopes of {element[0].symbol} are {', '.join(kind.name for kind in element)}"
    if nucleons:
        listed = [kind for kind in element if kind.nucleons == int(nucleons)]
        if not listed:
            raise ValueProblem(f"read {shown(text)}, an isotope of unknown mass", hint=hint)
        return listed[0], True
    common = max(element, key=attrgetter("abundance"))
    if not common.abundance:
        what = "which has no stable isotope; expected one by its mass number"
        raise ValueProblem(f"read {shown(text)}, {what}", hint=hint)
    return common, False


@dataclass(frozen=True, slots=True, eq=False)
class Molecule:
    """Atoms as point masses (n by 4: m, x, y, z in kg and m), the rounding of their coordinates, and notes.

    A coordinate may be off by `rounding` (m), half a unit of the last decimal.
    """

    atoms: Floats
    rounding: float
    notes: tuple[str, ...]


def read_molecule(path: Path) -> Molecule:
    """The molecule in an .xyz file. Raises ValueProblem, which names the path and the line."""
    kinds: dict[str, tuple[Isotope, bool]] = {}
    rows, typed, rest, line = list[list[float]](), list[list[str]](), "", 1
    with opened(path) as file:
        try:
            lines = iter(partial(file.readline, LINE_BYTES), b"")
            count = _count(_text(next(lines, b"")))
            for comment in islice(lines, 1):
                line += 1
                columns = _PROPERTIES.search(_text(comment))
                if columns is not None and not columns[1].lower().startswith("species:s:1:pos:r:3"):
                    expected = "columns that begin with the element and x, y, z"
                    raise ValueProblem(f"read {shown(columns[0])}, expected {expected}")
            for data in islice(lines, count):  # a count that lies costs nothing
                line += 1
                text = _text(data)
                kind, *numbers = text.split() or [""]
                if len(numbers) < 3:
                    message = f"read {shown(text)} after {len(rows)} of {count} atoms, expected {EXAMPLE}"
                    raise ValueProblem(message, hint=HEAD)
                if kind not in kinds:
                    kinds[kind] = isotope(kind)
                rows.append([kinds[kind][0].mass, *map(_coordinate, "xyz", numbers)])
                typed.append(numbers)
            if len(rows) < count:
                message = f"the file ends after {len(rows)} of {count} atoms, expected {EXAMPLE}"
                raise ValueProblem(message, hint=HEAD)
            for data in lines:
                line += 1
                if rest := _text(data):
                    break
            if rest and not _COUNT.fullmatch(rest):
                message = f"read {shown(rest)} after the {count} atoms of the first line, expected the end"
                raise ValueProblem(message, hint=HEAD)
        except ValueProblem as problem:
            raise ValueProblem(f"{path}:{line}: {problem.message}", hint=problem.hint) from None
    atoms = np.array(rows) * [ATOMIC_MASS, ANGSTROM, ANGSTROM, ANGSTROM]
    order = np.lexsort(atoms[:, 1:].T)
    same = np.flatnonzero((np.diff(atoms[order, 1:], axis=0) == 0).all(axis=1))
    if len(same):  # as after a line was copied
        first, second = sorted(order[same[0] : same[0] + 2] + FIRST_ATOM)
        raise ValueProblem(f"{path}:{second}: an atom at the place of that in line {first}")
    notes = []
    if meant := dict.fromkeys(kind.name for kind, is_named in kinds.values() if not is_named):
        which = f"masses are those of the most abundant isotopes, {', '.join(meant)}"
        notes.append(f"{which}; others are named in the file, as `13C` or `D`")
    if max(map(len, typed)) > 3:
        notes.append("what follows x, y, z in a line is not read")
    if rest:
        notes.append(f"the first of several frames is read, up to line {FIRST_ATOM + count - 1}")
    judged = (Decimal(number) for numbers in typed[:JUDGED_ATOMS] for number in numbers[:3])
    decimals = max(FEWEST_DECIMALS, *(-int(number.as_tuple().exponent) for number in judged))
    return Molecule(atoms, ANGSTROM * 10.0**-decimals / 2, tuple(notes))


def _text(line: bytes) -> str:
    if len(line) == LINE_BYTES:
        raise ValueProblem(f"a line of more than {LINE_BYTES} bytes")
    return line.decode("utf-8-sig", "replace").strip()


def _count(text: str) -> int:
    if not _COUNT.fullmatch(text):
        hint = "an .xyz file has the number of atoms, a line of comment, and then a line for each atom"
        raise ValueProblem(f"read {shown(text)}, expected the number of atoms", hint=hint)
    if len(text) > len(str(MOST_ATOMS)) or not 0 < int(text) <= MOST_ATOMS:
        raise ValueProblem(f"read {shown(text)}, expected 1 to {MOST_ATOMS:,} atoms")
    return int(text)


def _coordinate(axis: str, typed: str) -> float:
    value = float(typed) if _NUMBER.fullmatch(typed) else math.nan
    if not math.isfinite(value):
        raise ValueProblem(f"{axis}: read {shown(typed)}, expected a number")
    return value
