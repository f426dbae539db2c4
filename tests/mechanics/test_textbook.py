"""H as textbooks print it: the same function, and not much longer.

Lengths are those of the texts in the expression language, without blanks.
"""

from __future__ import annotations

import json
import random
from functools import cache
from typing import Any

import pytest
import yaml

import rigidcli
from rigidcli.language.expression import parse, real
from rigidcli.language.parser import read
from rigidcli.report import Report
from tests.conftest import ROOT
from tests.tables import rows_of

LONGEST = 1.5
"""The length of an H that is printed, in units of that in the book."""

SYSTEMS: dict[str, Any] = yaml.safe_load((ROOT / "tests" / "golden" / "textbook.yaml").read_text())

RANGES = {"xi": (1.5, 3.0), "eta": (-0.9, 0.9)}
"""Where elliptic coordinates lie; other values are between 0.5 and 1.5."""


@cache
def derived(name: str) -> Report:
    """What the program derives where no parameter has a value."""
    system = SYSTEMS[name]
    coordinates, change = system["coordinates"].split(), system.get("transform")
    document: dict[str, Any] = {"system": {"coordinates": coordinates, "lagrangian": system["lagrangian"]}}
    names = set(parse(system["lagrangian"]).names)
    if change is not None:
        new = system.get("variables", "Q P").split()
        document["transform"] = {"old": change, "new_variables": new}
        names.update(*(parse(text).names for text in change.values()))
        names.difference_update(new)
    own = {"t", *coordinates, *(f"{q}dot" for q in coordinates)}
    document["parameters"] = dict.fromkeys(sorted(names - own))
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document)))


def hamiltonian(name: str) -> str:
    found = derived(name)
    return str((found["transform"] if "transform" in SYSTEMS[name] else found)["hamiltonian"])


def length(text: str) -> int:
    return len("".join(text.split()))


def test_there_are_forty() -> None:
    assert len(SYSTEMS) >= 40
    assert all(system["book"] for system in SYSTEMS.values())


@pytest.mark.parametrize("name", SYSTEMS)
def test_it_is_the_function_of_the_book_in_a_form_of_its_length(name: str) -> None:
    ours, book = hamiltonian(name), SYSTEMS[name]["hamiltonian"]
    chance = random.Random(name)
    names = sorted(parse(ours).names | parse(book).names)
    for _ in range(5):
        point = {symbol: chance.uniform(*RANGES.get(symbol, (0.5, 1.5))) for symbol in names}
        assert real(read(ours)[0], point) == pytest.approx(real(read(book)[0], point), rel=1e-10, abs=1e-12)
    assert length(ours) <= LONGEST * length(book), ours
    verified = derived(name)["verified"]
    assert verified is None or verified < 1e-9


@pytest.mark.parametrize(
    ("name", "parts"),
    rows_of(__file__, "these parts stay together"),
)
def test_these_parts_stay_together(name: str, parts: list[str]) -> None:
    assert all(part in hamiltonian(name) for part in parts), hamiltonian(name)


@pytest.mark.parametrize(
    ("name", "key", "expected"),
    [
        ("Calogero and Moser", "p_x1", "2*g**2*(1/(x1 - x2)**3 + 1/(x1 - x3)**3)"),
        ("charge in a magnetic field, Landau's gauge", "x", "(p_x + B*e*y/c)/m"),
        ("rotating frame", "p_x", "W*p_y - k*x/(x**2 + y**2)**(3/2)"),
        ("symmetric top", "psi", "p_psi/I3 + (p_psi*cos(theta) - p_phi)*cos(theta)/(I1*sin(theta)**2)"),
        ("Kepler in polar coordinates", "p_r", "p_phi**2/(m*r**3) - k/r**2"),
    ],
)
def test_equations_are_short_too(name: str, key: str, expected: str) -> None:
    assert str(derived(name)["equations"][key]) == expected


def test_what_must_be_positive_is_told() -> None:
    (note,) = [
        note for note in derived("Kepler, from Cartesian to polar coordinates").notes if "r > 0" in note
    ]
    assert note == "H in the new variables is written for r > 0"
