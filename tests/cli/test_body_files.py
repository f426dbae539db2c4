"""FILES that are bodies by themselves: their settings, and what is said of those that are wrong."""

from __future__ import annotations

import itertools
import json
import math
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigidcli.bodies.bodies import FORMS
from rigidcli.bodies.points import MOLECULE, READERS
from rigidcli.document.draft import BODY_FILES
from tests.conftest import ROOT, Program

STARTERS = ROOT / "rigidcli" / "starters"
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


COMMENTED = re.compile(r"( *)# (- \{|['\"]?[a-z0-9_.]+['\"]?: )")
"""A key that a starter offers in a comment."""


def blocks(lines: list[str]) -> Iterator[set[int]]:
    """The numbers of the lines of each key, with the deeper ones below it."""
    depths = [len(line) - len(line.lstrip(" -")) if line.split("#")[0].strip() else 99 for line in lines]
    for start, depth in enumerate(depths):
        end = next((k for k in range(start + 1, len(lines)) if depths[k] <= depth), len(lines))
        yield {*range(start, end)}


@pytest.mark.parametrize("path", sorted(STARTERS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_key_that_a_starter_offers_is_accepted(path: Path, program: Program, tmp_path: Path) -> None:
    """A key that stands in a comment goes beside others, with its neighbours, with all, or instead of two."""
    for name in ("bracket.stl", "three_masses.yaml"):
        shutil.copy(ROOT / "configs" / name, tmp_path)
    (tmp_path / "cloud.csv").write_text(CLOUD)
    (tmp_path / "orbit.csv").write_text("t,x\n0,1\n1,2\n")
    block = "parameters: {m: 2 kg, a: 10 cm}\nbody: {shape: box, size: [a, a, 2*a], mass: m}\n"
    (tmp_path / "block.yaml").write_text(block)
    lines = path.read_text().splitlines()
    offered = [COMMENTED.match(line) is not None for line in lines]
    for number in (k for k, is_offered in enumerate(offered) if is_offered):
        run = {k for k in range(len(lines)) if all(offered[min(k, number) : max(k, number) + 1])}
        texts = list[tuple[int, list[str]]]()
        for switched in ({number}, run, {k for k, is_offered in enumerate(offered) if is_offered}):
            text = [
                COMMENTED.sub(r"\1\2", line, count=1) if k in switched else line
                for k, line in enumerate(lines)
            ]
            others = [block - switched for block in blocks(text) if min(block) not in switched]
            for count in range(3):
                for few in itertools.combinations(others, count):
                    texts.append(
                        (count, [line for k, line in enumerate(text) if not any(k in cut for cut in few)])
                    )
        texts.sort(key=lambda pair: pair[0])  # few need that keys are cut out, and each try takes long
        assert any(validated(program, tmp_path / path.name, text) for _, text in texts), lines[number]


def validated(program: Program, path: Path, lines: list[str]) -> bool:
    path.write_text("\n".join(lines))
    return program("validate", "-q", str(path)).code == 0


def test_a_pendulum_of_mjcf_swings_as_its_form_says(program: Program) -> None:
    result = json.loads(
        program("axes", "-f", "json", "configs/clock_pendulum.xml", "-s", "axis=[0, 1, 0]").out
    )
    rod, bob = 7850 * math.pi * 0.005**2, 8500 * math.pi * 0.08**2 * 0.02
    moment = rod * (0.005**2 / 4 + 1 / 12 + 1 / 4) + bob * (0.08**2 / 2 + 0.9**2)
    assert result["axis_moment"] == pytest.approx(moment, rel=1e-5)


def facets(*corners: str, normal: str = "0 0 0") -> str:
    vertices = ("\n".join(f"vertex {' '.join(corner)}" for corner in one.split()) for one in corners)
    inside = "".join(f"facet normal {normal}\nouter loop\n{one}\nendloop\nendfacet\n" for one in vertices)
    return f"solid t\n{inside}endsolid t\n"


TETRAHEDRON = ("000 010 100", "000 100 001", "000 001 010", "100 010 001")


INSIDE_OUT = ("500 600 510", "500 501 600", "500 510 501", "600 501 510")
XACRO = '<robot name="r"><link name="l"><inertial><mass value="${m}"/></inertial></link></robot>'


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("open.stl", facets(*TETRAHEDRON[:3]), "open.stl: open: 3 edges belong to one triangle only"),
        ("open.stl", facets(*TETRAHEDRON[:3]), "hint: 1 hole: close it"),
        ("open.stl", facets(*TETRAHEDRON[1:3]), "hint: 1 hole: close it"),
        ("nosuch.stl", None, "nosuch.stl: no such file"),
        ("two.stl", facets(*TETRAHEDRON, *INSIDE_OUT), "inside out"),
        ("two.obj", "version https://git-lfs.github.com/spec/v1\noid", "two.obj: a pointer of Git LFS"),
        ("a.urdf", "version https://git-lfs.github.com/spec/v1\noid", "a.urdf: a pointer of Git LFS"),
        ("a.csv", "version https://git-lfs.github.com/spec/v1\noid", "a.csv: a pointer of Git LFS"),
        ("a.gltf", '{"asset": {}}', "a.gltf: .gltf is not read"),
        ("a.urdf.xacro", XACRO, "this is a template"),
    ],
)
def test_the_fault_of_a_file_is_told_first(
    name: str, text: str | None, said: str, program: Program, tmp_path: Path
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    outcome = program("inertia", str(tmp_path / name))
    assert outcome.code == 3
    assert said in "\n".join(outcome.err.splitlines()[:2])


@pytest.mark.parametrize(
    "text", [facets(*TETRAHEDRON, normal="nan -nan(ind) nan"), "\ufeff" + facets(*TETRAHEDRON)]
)
def test_meshes_as_others_write_them(text: str, program: Program, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_text(text)
    done = program("inertia", "-f", "json", str(tmp_path / "a.stl"), "-s", "body.density=6")
    assert json.loads(done.out)["mass"] == pytest.approx(1)
