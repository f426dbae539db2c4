"""`--compare`: several FILEs side by side, and names that tell FILEs apart."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.conftest import Program

CUBES = ("configs/cube_corner.yaml", "-")
"""A cube of 12 kg with an edge of 1 m about its corner, and another document."""

HEAVIER = "name: heavier\nbody: {shape: cube, side: 1, mass: 15, anchor: corner}"


def rows_of(text: str) -> dict[str, list[str]]:
    """The rows of the table by their labels."""
    lines = [re.split(r" {2,}", line.strip()) for line in text.splitlines()]
    return {line[0]: line[1:] for line in lines if len(line) > 1}


def test_differences_to_the_first_in_percent(program: Program) -> None:
    outcome = program("axes", "--compare", *CUBES, stdin=HEAVIER)
    assert (outcome.code, outcome.err) == (0, "")
    rows = rows_of(outcome.out)
    assert rows["result"] == ["cube about its corner", "heavier", "%"]
    assert rows["mass (kg)"] == ["12", "15", "25"]
    assert rows["centre of mass, com_x (m)"] == ["0.5", "0.5", "0"]
    assert rows["inertia tensor about O, Ixy (kg m^2)"] == ["-3", "-3.75", "-25"]
    assert rows["principal moments, lambda1 (kg m^2)"] == ["2", "2.5", "25"]
    assert rows["about the centre of mass, xy (kg m^2)"] == ["0", "0", "0"]
    assert rows["class"] == ["prolate", "prolate", "-"]


def test_what_only_some_have_is_blank(program: Program) -> None:
    outcome = program("precess", "--compare", "configs/cone_top.yaml", "configs/earth.yaml")
    rows = rows_of(outcome.out)
    assert outcome.code == 0
    assert any(row[0] == "-" and row[1] != "-" for row in rows.values())
    assert any(row[0] != "-" and row[1] == "-" for row in rows.values())
    assert all(row[-1] == "-" for row in rows.values() if "-" in row[:2])


def test_exact_numbers_and_units(program: Program) -> None:
    outcome = program("inertia", "--compare", "--exact", *CUBES, "configs/cube_symbolic.yaml", stdin=HEAVIER)
    assert rows_of(outcome.out)["mass (kg)"] == ["12", "15", "25", "M", "-"]
    grams = program("inertia", "--compare", "--units", "g", *CUBES, stdin=HEAVIER)
    assert rows_of(grams.out)["mass (g)"] == ["12000", "15000", "25"]


@pytest.mark.parametrize("form", ["latex", "html"])
def test_other_formats_for_people(form: str, program: Program) -> None:
    if form == "html":
        pytest.importorskip("latex2mathml", reason="pages need the extra `show`")
    outcome = program("axes", "--compare", "-f", form, *CUBES, stdin=HEAVIER)
    assert outcome.code == 0
    assert ("<td>prolate</td>" if form == "html" else "& prolate &") in outcome.out


def test_a_file_that_is_refused_leaves_the_others(program: Program) -> None:
    outcome = program("axes", "--compare", *CUBES, "nowhere.yaml", stdin=HEAVIER)
    assert outcome.code == 3
    assert rows_of(outcome.out)["mass (kg)"] == ["12", "15", "25"]


@pytest.mark.parametrize("option", [(), ("--compare",), ("--sweep", "body.mass=1,2")])
def test_equal_names_get_their_file(option: tuple[str, ...], program: Program, tmp_path: Path) -> None:
    files = []
    for place, side in enumerate((1, 2)):
        (tmp_path / str(place)).mkdir()
        files.append(str(tmp_path / str(place) / "cube.yaml"))
        Path(files[-1]).write_text(f"body: {{shape: cube, side: {side}, mass: 3}}")
    text = program("inertia", *option, *files).out
    assert all(f"cube ({file})" in text for file in files)
    assert "cube (" not in program("inertia", "-f", "csv", *option[:0], *files).out
