"""Isotopes and their masses, by the symbols and numbers with which files name atoms.

`isotopes.csv` has the isotopes that occur in nature, those that the periodic table lists for elements
without stable ones, and a few tracers. Relative atomic masses are those of the Atomic Mass Evaluation 2020
(M. Wang and others, Chinese Physics C 45 (2021) 030003); abundances are the representative isotopic
compositions of NIST (J. S. Coursey and others, Atomic Weights and Isotopic Compositions, version 4.1), and
empty where there is none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

from rigidcli.errors import ValueProblem, shown

_NAMED = re.compile(r"([0-9]{0,3})([A-Za-z]{1,2})|([0-9]{1,3})")
"""An element by its symbol, with a mass number before it for one isotope; or by its atomic number."""

_HYDROGEN = {"D": "2H", "T": "3H"}
"""The isotopes that have symbols of their own."""


class Isotope(NamedTuple):
    """A kind of atom: its name, such as `13C`, and its mass in atomic mass units."""

    name: str
    mass: float


@dataclass(frozen=True, slots=True)
class Element:
    """The isotopes of an element by their mass numbers; none is `common` where none occurs in nature."""

    symbol: str
    isotopes: Mapping[int, Isotope]
    common: Isotope | None


def isotope(text: str) -> tuple[Isotope, bool]:
    """The isotope that a file means by `text`, and whether it is named there.

    `C`, `c` and `6` mean the most abundant isotope of carbon, `13C` is one by its mass number, `D` and `T`
    are those of hydrogen. Raises ValueProblem for other texts, for isotopes that are not listed, and for
    elements that have no stable isotope to be meant.
    """
    found = _NAMED.fullmatch(_HYDROGEN.get(text.upper(), text))
    by_symbol, by_number = _elements()
    element = found and (by_number.get(int(found[3])) if found[3] else by_symbol.get(found[2].capitalize()))
    if found is None or element is None:
        raise ValueProblem(
            f"read {shown(text)}, expected the symbol of an element, its atomic number, or an isotope",
            hint="atoms are written as `C`, `6`, `13C` or `D`; a dummy atom has no mass, and is left out",
        )
    names = ", ".join(each.name for each in element.isotopes.values())
    listed = f"the isotopes of {element.symbol} are {names}"
    if found[1]:
        named = element.isotopes.get(int(found[1]))
        if named is None:
            raise ValueProblem(f"read {shown(text)}, an isotope of unknown mass", hint=listed)
        return named, True
    if element.common is None:
        raise ValueProblem(
            f"read {shown(text)}, which has no stable isotope; expected one by its mass number", hint=listed
        )
    return element.common, False


class Row(NamedTuple):
    """A row of the table: what `isotopes.csv` has; the abundance is 0 where there is none."""

    number: int
    symbol: str
    nucleons: int
    mass: float
    abundance: float


def table() -> list[Row]:
    """The table of isotopes, by atomic and mass number."""
    lines = resources.files("rigidcli.bodies").joinpath("isotopes.csv").read_text("ascii").splitlines()
    cells = (line.split(",") for line in lines[1:])
    return [
        Row(int(number), symbol, int(nucleons), float(mass), float(abundance or 0))
        for number, symbol, nucleons, mass, abundance in cells
    ]


@cache
def _elements() -> tuple[Mapping[str, Element], Mapping[int, Element]]:
    """The elements by their symbols, and by their atomic numbers."""
    by_number = {}
    for number, group in groupby(table(), key=attrgetter("number")):
        rows = list(group)
        listed = {row.nucleons: Isotope(f"{row.nucleons}{row.symbol}", row.mass) for row in rows}
        most = max(rows, key=attrgetter("abundance"))
        by_number[number] = Element(most.symbol, listed, listed[most.nucleons] if most.abundance else None)
    return {element.symbol: element for element in by_number.values()}, by_number
