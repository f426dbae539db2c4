"""Molecules as rotors, against measured rotational constants and against formulas for simple ones.

Structures are equilibrium ones (r_e), which belong to constants without vibration (B_e), or effective ones
(r_0, r_s) beside constants of the lowest state (B_0), in which atoms move: these agree to some thousandths,
and in hydrides, or where r_e meets B_0, to some hundredths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy import constants
from scipy.spatial.transform import Rotation

import rigidcli

Atoms: TypeAlias = Sequence[tuple[str, Sequence[float]]]
"""Kinds of atoms with their places (angstrom)."""

Told: TypeAlias = Callable[..., Any]


def written(atoms: Atoms, decimals: int = 9) -> str:
    lines = (f"{kind} " + " ".join(f"{x:.{decimals}f}" for x in place) for kind, place in atoms)
    return "\n".join([str(len(atoms)), "", *lines, ""])


@pytest.fixture
def told(tmp_path: Path) -> Told:
    """The results of `axes` for a molecule, which is written to a file."""

    def tell(atoms: Atoms, decimals: int = 9) -> Any:
        path = tmp_path / "molecule.xyz"
        path.write_text(written(atoms, decimals))
        return rigidcli.axes(path)

    return tell


def line(*atoms_and_bonds: str | float) -> Atoms:
    """A linear molecule: kinds of atoms and, between them, the lengths of bonds."""
    places = [0.0, *np.cumsum([float(bond) for bond in atoms_and_bonds[1::2]])]
    return [(str(kind), (0, 0, z)) for kind, z in zip(atoms_and_bonds[::2], places, strict=True)]


def bent(middle: str, ends: Sequence[str], bond: float, degrees: float) -> Atoms:
    half = math.radians(degrees) / 2
    across, along = bond * math.sin(half), bond * math.cos(half)
    return [(middle, (0, 0, 0)), (ends[0], (across, along, 0)), (ends[1], (-across, along, 0))]


def with_three(top: Atoms, hydrogen: str, bond: float, degrees: float) -> Atoms:
    """Three atoms below one at the origin, with these angles between their bonds; `top` is on the axis."""
    sine = 2 / math.sqrt(3) * math.sin(math.radians(degrees) / 2)
    turns = [2 * math.pi * k / 3 for k in range(3)]
    across, down = bond * sine, bond * math.sqrt(1 - sine**2)
    return [*top, *((hydrogen, (across * math.cos(t), across * math.sin(t), -down)) for t in turns)]


def halide(halogen: str, bond: float, degrees: float) -> Atoms:
    return with_three([("C", (0, 0, 0)), (halogen, (0, 0, bond))], "H", 1.11, degrees)


def planar(carbons: Sequence[float], bond: float, degrees: float, oxygen: float | None = None) -> Atoms:
    """CH2 groups at these heights, pointing outwards, and perhaps an oxygen above."""
    half = math.radians(degrees) / 2
    atoms: list[tuple[str, Sequence[float]]] = [] if oxygen is None else [("O", (0, 0, oxygen))]
    for height in carbons:
        out = -1 if height <= 0 else 1
        atoms.append(("C", (0, 0, height)))
        atoms += [
            ("H", (side * bond * math.sin(half), 0, height + out * bond * math.cos(half))) for side in (1, -1)
        ]
    return atoms


def ring(*kinds: tuple[str, float]) -> Atoms:
    return [
        (kind, (radius * math.cos(k * math.pi / 3), radius * math.sin(k * math.pi / 3), 0))
        for kind, radius in kinds
        for k in range(6)
    ]


def methane(bond: float) -> Atoms:
    corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    return [("C", (0, 0, 0)), *(("H", [bond / 3**0.5 * x for x in corner]) for corner in corners)]


def ammonia(bond: float, degrees: float) -> Atoms:
    return with_three([("N", (0, 0, 0))], "H", bond, degrees)


CM, GHZ = "rotational_constants_per_cm", "rotational_constants_ghz"

FORMS: dict[str, Callable[..., Atoms]] = {
    form.__name__: form for form in (line, bent, halide, planar, ring, methane, ammonia)
}
MEASURED = yaml.safe_load(Path(__file__).with_name("molecules.yaml").read_text(encoding="utf-8"))


def structure(name: str) -> Atoms:
    (form,) = MEASURED[name].keys() & FORMS
    return FORMS[form](*MEASURED[name][form])


KINDS = {"CH4": "spherical", "C6H6": "oblate", "NH3": "oblate"}


@pytest.mark.parametrize("name", MEASURED)
def test_constants_are_as_measured(name: str, told: Told) -> None:
    atoms, case = structure(name), MEASURED[name]
    result, unit = told(atoms), CM if "per_cm" in case else GHZ
    for letter, value in zip("ABC", case.get("per_cm") or case["ghz"], strict=False):
        if value is not None:
            assert result[unit][letter] == pytest.approx(value, rel=case["within"])
    linear = all(x == y == 0 for _, (x, y, _) in atoms)
    kind = "linear" if linear else "prolate" if name[:3] == "CH3" else KINDS.get(name, "asymmetric")
    assert result["rotor"] == kind
    assert (result[unit]["A"] is None) is linear


def test_isotopes_of_a_bond(told: Told) -> None:
    """B = h/(8 pi^2 mu r^2), with the masses of AME2020 in u as typed here."""
    h, c, u = constants.h, constants.c, 1.66053906892e-27
    for kinds, masses in {
        ("1H", "35Cl"): (1.007825031898, 34.968852694),
        ("D", "37Cl"): (2.014101777844, 36.965902573),
        ("13C", "18O"): (13.00335483534, 17.99915961214),
    }.items():
        mu = masses[0] * masses[1] / sum(masses) * u
        result = told(line(kinds[0], 1.25, kinds[1]))
        hertz = h / (8 * math.pi**2 * mu * 1.25e-10**2)
        assert result[GHZ]["B"] == pytest.approx(hertz / 1e9, rel=1e-12)
        assert result[CM]["C"] == pytest.approx(hertz / (100 * c), rel=1e-12)


def kappa(constants: Any) -> float:
    a, b, c = constants.values()
    return float((2 * b - a - c) / (a - c))


def test_asymmetry(told: Told) -> None:
    water = told(bent("O", "HH", 0.9572, 104.52))
    assert water["asymmetry_parameter"] == pytest.approx(kappa(water[GHZ]), rel=1e-12)
    # Measured constants have kappa -0.438: C. H. Townes, A. L. Schawlow, Microwave Spectroscopy, chapter 4.
    assert water["asymmetry_parameter"] == pytest.approx(-0.438, abs=5e-3)
    assert told(halide("Cl", 1.781, 110.5))["asymmetry_parameter"] == pytest.approx(-1, abs=1e-7)
    assert told(ring(("C", 1.397)))["asymmetry_parameter"] == pytest.approx(1, abs=1e-7)
    for atoms in (methane(1.094), line("C", 1.1, "O"), [("Ar", (0, 0, 1))]):
        assert told(atoms)["asymmetry_parameter"] is None


def moved(atoms: Atoms, seed: int) -> Atoms:
    """The molecule turned and moved somewhere else."""
    turn, shift = Rotation.random(rng=seed), np.random.default_rng(seed).normal(size=3) * 5
    places: NDArray[np.float64] = turn.apply([place for _, place in atoms]) + shift
    return [(kind, tuple(place)) for (kind, _), place in zip(atoms, places, strict=True)]


@pytest.mark.parametrize("name", ["CO2", "SO2", "C6H6", "CH4", "CH3Cl"])
@pytest.mark.parametrize("decimals", [3, 6])
def test_neither_place_nor_rounding_changes_the_kind(name: str, decimals: int, told: Told) -> None:
    atoms = structure(name)
    plain = told(atoms)
    for seed in range(2):
        result = told(moved(atoms, seed), decimals)
        assert result["rotor"] == plain["rotor"]
        for letter in "BC":
            assert result[GHZ][letter] == pytest.approx(plain[GHZ][letter], rel=20 * 10.0**-decimals)


def test_a_small_asymmetry_is_told_when_the_digits_tell_it(told: Told) -> None:
    """Benzene with one 13C is no symmetric top: its B differ by some per cent of the mass."""
    atoms = [("13C", (1.397, 0, 0)), *ring(("C", 1.397), ("H", 2.481))[1:]]
    assert told(atoms, 4)["rotor"] == "asymmetric"


def test_notes_say_what_was_taken(told: Told) -> None:
    notes = told(moved(ring(("C", 1.397), ("D", 2.481)), 1), 4).notes
    assert notes[0].startswith("masses are those of the most abundant isotopes, 12C; ")
    assert any(note.startswith("A and B count as equal: they differ by ") for note in notes)
    assert not any("`--set about=com`" in note for note in notes)  # it is about it
    assert told(line("12C", 1.1, "16O")).notes[:-1] == ()


def test_a_document_takes_molecules_as_parts(tmp_path: Path) -> None:
    """Two molecules of CO at right angles, against all four atoms in one file; with a ball it is none."""
    bond, apart = 1.128323, 3.0
    (tmp_path / "co.xyz").write_text(written(line("C", bond, "O")))
    together = [("C", (0, 0, 0)), ("O", (0, 0, bond)), ("C", (0, apart, 0)), ("O", (bond, apart, 0))]
    (tmp_path / "both.xyz").write_text(written(together))
    parts = "{points: co.xyz}, {points: co.xyz, position: [0, 3 angstrom, 0], axis: [1, 0, 0]}"
    (tmp_path / "pair.yaml").write_text(f"body: {{parts: [{parts}]}}")
    pair, both = rigidcli.axes(tmp_path / "pair.yaml"), rigidcli.axes(tmp_path / "both.xyz")
    assert pair["rotor"] == both["rotor"] == "asymmetric"
    for letter in "ABC":
        assert pair[GHZ][letter] == pytest.approx(both[GHZ][letter], rel=1e-12)
    ball = "{shape: sphere, radius: 1 angstrom, mass: 4 u}"
    (tmp_path / "caged.yaml").write_text(f"body: {{parts: [{parts}, {ball}]}}")
    caged = rigidcli.axes(tmp_path / "caged.yaml")
    assert "rotor" not in caged
    assert caged["mass"] == pytest.approx(both["mass"] + 4 * 1.66053906892e-27, rel=1e-12)
