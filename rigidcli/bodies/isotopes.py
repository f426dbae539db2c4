"""Isotopes and their masses, by the symbols and numbers with which files name atoms.

`isotopes.csv` has the isotopes that occur in nature, those that the periodic table lists for elements
without stable ones, and a few tracers. Relative atomic masses are those of the Atomic Mass Evaluation 2020
(M. Wang and others, Chinese Physics C 45 (2021) 030003); abundances are the representative isotopic
compositions of NIST (J. S. Coursey and others, Atomic Weights and Isotopic Compositions, version 4.1), and
empty where there is none.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import resources
from operator import attrgetter
from typing import NamedTuple

from rigidcli.errors import ValueProblem, shown

_NAMED = re.compile(r"([0-9]{0,3})([A-Za-z]{1,2})|([0-9]{1,3})")
"""An element by its symbol, with a mass number before it for one isotope; or by its atomic number."""

_HYDROGEN = {"D": "2H", "T": "3H"}
"""The isotopes that have symbols of their own."""


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
    lines = resources.files("rigidcli.bodies").joinpath("isotopes.csv").read_text("ascii").splitlines()
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
    found = _NAMED.fullmatch(_HYDROGEN.get(text.upper(), text))
    element = []
    if found is not None:
        nucleons, symbol, number = found.groups()
        element = [
            e for e in table() if (e.number == int(number) if number else e.symbol == symbol.capitalize())
        ]
    if found is None or not element:
        raise ValueProblem(
            f"read {shown(text)}, expected the symbol of an element, its atomic number, or an isotope",
            hint="atoms are written as `C`, `6`, `13C` or `D`; a dummy atom has no mass, and is left out",
        )
    hint = f"the isotopes of {element[0].symbol} are {', '.join(each.name for each in element)}"
    if nucleons:
        named = next((each for each in element if each.nucleons == int(nucleons)), None)
        if named is None:
            raise ValueProblem(f"read {shown(text)}, an isotope of unknown mass", hint=hint)
        return named, True
    common = max(element, key=attrgetter("abundance"))
    if not common.abundance:
        wanted = "expected one by its mass number"
        raise ValueProblem(f"read {shown(text)}, which has no stable isotope; {wanted}", hint=hint)
    return common, False
