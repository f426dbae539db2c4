"""Features together: sweeps of robots, lists of files of many kinds, settings where nothing stands yet."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import Program

ARM = "configs/arm.urdf"
CUBE = "configs/cube_corner.yaml"
HOMEWORK = "configs/homework/assignment.yaml"


# --- what is read is not written over


def test_a_list_of_files_is_not_written_over(program: Program, tmp_path: Path) -> None:
    names = tmp_path / "files.txt"
    names.write_text(f"{CUBE}\n{ARM}\n")
    for command in (["axes", f"@{names}"], ["check", HOMEWORK, f"@{names}"]):
        ran = program(*command, "-f", "csv", "-o", str(names))
        assert (ran.code, ran.out) == (2, "")
        assert "which is read" in ran.err
        assert names.read_text() == f"{CUBE}\n{ARM}\n"


def test_a_table_of_swept_values_is_not_written_over(program: Program, tmp_path: Path) -> None:
    values = tmp_path / "values.csv"
    values.write_text("side\n1\n2\n")
    ran = program("axes", CUBE, "-f", "csv", "--sweep", f"body.side=@{values}:side", "-o", str(values))
    assert (ran.code, ran.out) == (2, "")
    assert values.read_text() == "side\n1\n2\n"


# --- messages


def test_a_problem_that_all_links_have_is_told_once(program: Program) -> None:
    assert program("precess", "-q", ARM).err.count("nothing here precesses") == 1
    assert program("axes", "-q", ARM, "--plot", "-").err.count("draws one picture") == 1


@pytest.mark.parametrize("place", ["s", "r", "x^2"])
def test_a_blank_multiplies_in_a_density(program: Program, place: str) -> None:
    body = "body: {shape: box, size: [1, 2, 3], density: 3"
    blank, star = (program("inertia", "-f", "json", "-", stdin=f"{body}{sign}{place}}}") for sign in " *")
    assert blank.code == 0
    assert blank == star


def test_a_link_that_is_turned_by_a_rounded_quarter_keeps_its_other_results(program: Program) -> None:
    ran = program("axes", ARM, "--exact", "-f", "json")
    forearm = json.loads(ran.out.splitlines()[-1])
    assert (ran.code, forearm["mass"], forearm["axes"]) == (0, "1", None)
    assert "the exact principal axes have components too close to zero" in ran.err


# --- tables of sweeps


def test_links_do_not_count_as_values(program: Program) -> None:
    out = program("axes", "-q", ARM, "--sweep", "body.mass=1,2").out
    assert "at 2 values of body.mass" in out
    assert len([line for line in out.splitlines() if line.split()[:1] in (["1"], ["2"])]) == 6
