"""FILES that are bodies by themselves: their settings, and what is said of those that are wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rigidcli.bodies.bodies import FORMS
from rigidcli.bodies.points import MOLECULE, READERS
from rigidcli.document.draft import BODY_FILES
from tests.conftest import ROOT, Program

CLOUD = "m,x,y,z\n1,1,0,0\n2,0,1,0\n3,0,0,1\n"


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    path = tmp_path / "cloud.csv"
    path.write_text(CLOUD)
    return path


def test_every_ending_leads_to_a_form_and_every_file_of_points_has_one() -> None:
    assert {ending for ending, form in BODY_FILES.items() if form == "points"} == {*READERS, MOLECULE}
    assert set(BODY_FILES.values()) <= {*FORMS, "mesh"}
    assert all(ending == ending.lower() for ending in BODY_FILES)


@pytest.mark.parametrize("settings", [(), ("about=com", "axis=[0, 0, 1]"), ("body.position=[1, 2, 3]",)])
def test_is_the_document_with_the_file_as_its_body(
    program: Program, cloud: Path, settings: tuple[str, ...]
) -> None:
    document = cloud.with_name("document.yaml")
    document.write_text("name: cloud\nbody: {points: cloud.csv}\n")
    options = [word for setting in settings for word in ("--set", setting)]
    of_file, of_document = (
        json.loads(program("axes", "-f", "json", str(path), *options).out) for path in (cloud, document)
    )
    assert of_file.pop("source") == str(cloud)
    assert of_document.pop("source") == str(document)
    assert of_file == of_document


def test_endings_may_be_capitals_and_arrays_are_bodies_too(program: Program, cloud: Path) -> None:
    loud, array = cloud.with_name("LOUD.CSV"), cloud.with_name("array.npy")
    loud.write_text(CLOUD)
    np.save(array, np.loadtxt(cloud, delimiter=",", skiprows=1))
    outcome = program("inertia", "-f", "json", str(loud), str(array))
    first, second = map(json.loads, outcome.out.splitlines())
    assert (first["name"], second["name"]) == ("LOUD", "array")
    assert first["tensor"] == second["tensor"]
    np.testing.assert_allclose(second["tensor"], np.diag([5, 4, 3]), rtol=1e-15)


def test_starters_of_files_and_of_what_is_in_them(program: Program, tmp_path: Path) -> None:
    (tmp_path / "bracket.stl").write_bytes((ROOT / "configs" / "bracket.stl").read_bytes())
    masses = {"mesh.yaml": 14.25e-6 * 7850, "molecule.xyz": 18.0106 * 1.66053907e-27, "robot.urdf": 2.7}
    for name, mass in masses.items():
        path = tmp_path / name
        assert program("new", path.stem, "-o", str(path)).code == 0
        assert program("validate", str(path)).out == f"{path}: valid\n" + "  links: 1 with a mass\n" * (
            name == "robot.urdf"
        )
        found = json.loads(program("axes", str(path), "-f", "json").out)
        assert found["mass"] == pytest.approx(mass, rel=1e-5)
