"""Files of molecules: what is read as an atom, and what is refused with its line."""

from __future__ import annotations

import random
import re
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rigidcli
from rigidcli.bodies.molecules import LINE_BYTES, MOST_ATOMS, isotope, read_molecule, table
from rigidcli.errors import ValueProblem
from tests.conftest import Program
from tests.tables import rows_of

U = 1.66053906892e-27
WATER = "3\nwater\nO 0 0 0\nH 0.757 0.586 0\nH -0.757 0.586 0\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "molecule.xyz"


def read(path: Path, text: str | bytes) -> Any:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_molecule(path)


def test_reads_kilograms_and_metres(path: Path) -> None:
    expected = np.array(
        [[15.99491461926, 0, 0, 0], *([1.007825031898, x, 0.586, 0] for x in (0.757, -0.757))]
    )
    atoms = read(path, WATER).atoms
    np.testing.assert_allclose(atoms, expected * [U, 1e-10, 1e-10, 1e-10], rtol=1e-15)


@pytest.mark.parametrize(
    "text",
    rows_of(__file__, "reads the ways in which programs write"),
)
def test_reads_the_ways_in_which_programs_write(path: Path, text: str) -> None:
    np.testing.assert_array_equal(read(path, text).atoms, read(path, WATER).atoms)


@pytest.mark.parametrize(
    ("text", "mass"),
    rows_of(__file__, "kinds of atoms"),
)
def test_kinds_of_atoms(text: str, mass: float) -> None:
    kind, is_named = isotope(text)
    assert kind.mass == pytest.approx(mass, rel=1e-9)
    assert is_named is (text in ("D", "t") or (text[0].isdigit() and text != "6"))


@pytest.mark.parametrize(
    "text", ["X", "Xx", "C1", "H2", "0", "119", "999C", "8C", "Tc", "86", "Ąg", "²H", "", "½"]
)
def test_other_words_are_no_atoms(text: str) -> None:
    with pytest.raises(ValueProblem):
        isotope(text)


def test_the_most_abundant_isotopes_make_up_the_atomic_weights() -> None:
    """Sums over the isotopes of nature are the standard atomic weights of IUPAC (2021), abridged."""
    weights = {"H": 1.008, "C": 12.011, "N": 14.007, "O": 15.999, "S": 32.06, "Cl": 35.45, "Br": 79.904}
    weights |= {"Fe": 55.845, "Cu": 63.546, "Sn": 118.71, "Pb": 207.2, "U": 238.03, "B": 10.81, "Li": 6.94}
    for symbol, weight in weights.items():
        rows = [row for row in table() if row.symbol == symbol]
        assert sum(row.abundance for row in rows) == pytest.approx(1, abs=1e-9)
        assert sum(row.abundance * row.mass for row in rows) == pytest.approx(weight, rel=5e-4)
    for row in table():
        assert abs(row.mass - row.nucleons) < 0.2
        assert 0 <= row.abundance <= 1


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "read ``, expected the number of atoms"),
        ("O 0 0 0\nH 0 0 1\n", 1, "read `O 0 0 0`, expected the number of atoms"),
        ("3 water\n", 1, "expected the number of atoms"),
        ("-3\n", 1, "expected the number of atoms"),
        ("0\n\n", 1, "expected 1 to 500,000 atoms"),
        (f"{MOST_ATOMS + 1}\n\n", 1, "expected 1 to 500,000 atoms"),
        ("9" * 5000 + "\n\n", 1, "expected 1 to 500,000 atoms"),
        ("500000\n\nO 0 0 0\n", 3, "the file ends after 1 of 500000 atoms"),
        ("1\n", 1, "the file ends after 0 of 1 atoms"),
        (WATER.replace("3\n", "4\n", 1), 5, "the file ends after 3 of 4 atoms"),
        (WATER.replace("3\n", "2\n", 1), 5, "read `H -0.757 0.586 0` after the 2 atoms of the first line"),
        (WATER.replace("H 0.757 0.586 0", "H 0.757 0.586"), 4, "read `H 0.757 0.586` after 1 of 3 atoms"),
        (WATER.replace("O 0 0 0", "\n"), 3, "read `` after 0 of 3 atoms"),
        (WATER.replace("-0.757", "+0.757"), 5, "an atom at the place of that in line 4"),
        (WATER.replace("O 0", "Q 0"), 3, "read `Q`, expected the symbol of an element"),
        (WATER.replace("O 0", "20O 0"), 3, "read `20O`, an isotope of unknown mass"),
        (WATER.replace("O 0", "Tc 0"), 3, "read `Tc`, which has no stable isotope"),
        (WATER.replace("0.757", "nan", 1), 4, "x: read `nan`, expected a number"),
        (WATER.replace("0.586", "inf", 1), 4, "y: read `inf`, expected a number"),
        (WATER.replace("0.586", "1e999", 1), 4, "y: read `1e999`, expected a number"),
        (WATER.replace("0.586", "1_0", 1), 4, "y: read `1_0`, expected a number"),
        (WATER.replace("0.586", "٣", 1), 4, "y: read `٣`, expected a number"),
        (WATER.replace("0.586", "0.5D+0", 1), 4, "y: read `0.5D+0`, expected a number"),
        (WATER.replace("water", "Properties=pos:R:3:species:S:1"), 2, "expected columns that begin with"),
        (
            WATER.replace("water", "Properties=species:S:1:forces:R:3:pos:R:3"),
            2,
            "expected columns that begin",
        ),
        (WATER.replace("water", "x" * LINE_BYTES), 2, f"a line of more than {LINE_BYTES} bytes"),
        (WATER.replace("0.586", "0" * LINE_BYTES, 1), 4, f"a line of more than {LINE_BYTES} bytes"),
    ],
)
def test_what_is_wrong_has_its_line(path: Path, text: str, line: int, words: str, program: Program) -> None:
    path.write_text(text)
    outcome = program("axes", "-f", "json", str(path))
    assert (outcome.code, outcome.out) == (3, "")
    assert outcome.err.startswith(f"{path}:{line}: ")
    assert words in outcome.err
    document = path.with_name("document.yaml")
    document.write_text("name: a\nbody:\n  points: molecule.xyz\n")
    told = program("axes", str(document)).err
    assert told.startswith(f"{document}:3: body.points: {path}:{line}: ")


def test_files_that_cannot_be_read(path: Path) -> None:
    for name, words in (("none.xyz", "no such file"), (".", "not a regular file")):
        with pytest.raises(ValueProblem, match=re.escape(words)):
            read_molecule(path.with_name(name) if name != "." else path.parent)


def test_further_frames_and_columns_are_noted(path: Path) -> None:
    more = read(path, WATER.replace("O 0 0 0", "O 0 0 0 -0.8 1 2 3") + WATER)
    assert more.notes[1:] == (
        "what follows x, y, z in a line is not read",
        "the first of several frames is read, up to line 5",
    )
    np.testing.assert_array_equal(more.atoms, read(path, WATER).atoms)


@pytest.mark.parametrize(
    ("number", "decimals"), [("0.5", 3), ("0.5000", 4), ("5.00e-1", 3), ("500000e-6", 6), ("1", 3)]
)
def test_the_rounding_is_half_a_unit_of_the_last_decimal(path: Path, number: str, decimals: int) -> None:
    told = read(path, f"1\n\nC {number} 0 0\n").rounding
    assert told == pytest.approx(0.5e-10 * 10.0**-decimals)


def test_the_last_atoms_are_judged_like_the_first(path: Path) -> None:
    many = "".join(f"C 0.1 0.2 {k}\n" for k in range(2000))
    for last, words in (
        ("C 0 1e999 0", "y: read `1e999`"),
        ("C 0 0 nan", "z: read `nan`"),
        ("C 1e308 1e308 1e308", ""),
    ):
        text = f"2001\n\n{many}{last}\n"
        if not words:
            assert read(path, text).atoms[-1, 1] == pytest.approx(1e298)
            continue
        with pytest.raises(ValueProblem, match=f":2003: {words}"):
            read(path, text)


def test_results_are_exact_for_no_molecule(path: Path, program: Program) -> None:
    path.write_text(WATER)
    outcome = program("axes", "--exact", str(path))
    assert (outcome.code, outcome.out) == (4, "")


def test_units_formats_and_pictures(path: Path, program: Program) -> None:
    path.write_text(WATER)
    told = program("axes", "--units", "u,angstrom", "--set", "about=com", str(path), "-q").out
    assert "GHz" in told
    assert "u angstrom^2" in told
    assert r"\tilde{B}" in program("axes", "-f", "latex", str(path)).out
    header, row = program("axes", "-f", "csv", str(path)).out.splitlines()
    cells = dict(zip(header.split(","), row.split(","), strict=True))
    result = rigidcli.axes(path)
    assert float(cells["B_GHz"]) == result["rotational_constants_ghz"]["B"]
    assert cells["rotor"] == "asymmetric"
    pytest.importorskip("matplotlib")
    assert rigidcli.axes(path, picture="best").pictures


def test_a_large_file_is_read_in_time(path: Path) -> None:
    count = 100_000
    places = np.random.default_rng(1).normal(size=(count, 3))
    path.write_text(f"{count}\n\n" + "".join(f"C {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in places))
    start = time.process_time()
    assert len(read_molecule(path).atoms) == count
    assert time.process_time() - start < 5


@settings(max_examples=300)
@given(st.data())
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Bytes of a good file changed, cut out, repeated: an answer or a ValueProblem, and nothing else."""
    chance = random.Random(data.draw(st.integers()))
    text = bytearray((WATER + WATER).encode())
    for _ in range(chance.randrange(1, 6)):
        place, span = chance.randrange(len(text)), chance.randrange(8)
        text[place : place + span] = chance.randbytes(chance.randrange(8)) * chance.choice([1, 1, 1, 4000])
    file = tmp_path_factory.getbasetemp() / "damaged.xyz"
    with suppress(ValueProblem):
        molecule = read(file, bytes(text))
        assert np.isfinite(molecule.atoms).all()
        assert (molecule.atoms[:, 0] > 0).all()
