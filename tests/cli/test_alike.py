"""Many FILES in a call: what is told of them is what is told of each alone, in their order."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from rigidcli.cli.alike import at_once
from rigidcli.model.load import draft
from rigidcli.studies.inertia import run
from tests.conftest import Program

KINDS = {
    "cube": "name: cube {k}\nbody: {{shape: cube, side: {x}, mass: {n}, anchor: corner}}\n",
    "units": "body: {{shape: cone, radius: {x} cm, height: {y} mm, density: 2.7 g/cm^3}}\n"
    "motion: {{omega: [0, {x} rpm, {y} deg/s]}}\n",
    "parts": "parameters: {{a: {x}, b: a/2}}\nbody: {{parts: [{{shape: box, size: [a, 2, {y}], mass: {n}}},\n"
    "  {{name: pin, shape: rod, length: b, mass: 1, position: [{y}, 0, a], axis: [1, {x}, 0]}}]}}\n"
    "about: com\naxis: [1, 1, {y}]\n",
    "tensor": "body: {{moments: [{x}, {x}, {y}], mass: {n}}}\nabout: com\n"
    "frame: {{axis: [1, 2, 3], angle: {x}}}\n",
    "points": "body: {{points: [[{n}, 1, {x}, 0], [1, 0, {y}, {x}], [2, 0, 0, 1]]}}\n",
    "symbol": "parameters: {{a: null}}\nbody: {{shape: cube, side: a, mass: {n}}}\n",
    "refused": "body: {{shape: cylinder, radius: -{x}, height: {y}, mass: {n}}}\n",
    "no number": "name: {k}\nbody: {{shape: cube, side: .inf, mass: 1}}\n",
    "no yaml": "body: {{shape: cube, side: {x}\n",
}
"""Texts of documents, in which numbers are put."""

TOP = "top: {{mass: {n}, distance: {y} cm, lambda1: {x}, lambda3: 0.5, spin: {n}00, tilt: {y}}}\n"


def documents(folder: Path, kinds: dict[str, str], number: int) -> list[str]:
    """So many documents of each kind in any order, and the names of their files."""
    draw = random.Random(number)
    texts = [
        text.format(k=k, x=draw.choice([draw.randint(1000, 3000) / 1000, 2]), y=1 + k % 3 / 4, n=k % 5 + 1)
        for text in kinds.values()
        for k in range(number)
    ]
    draw.shuffle(texts)
    names = [str(folder / f"{k}.yaml") for k in range(len(texts))]
    for name, text in zip(names, texts, strict=True):
        Path(name).write_text(text)
    return names


@pytest.mark.parametrize("study", ["inertia", "axes", "precess"])
@pytest.mark.parametrize("options", ["-f json", "-f csv --no-header --columns name", "-f json -s about=com"])
def test_many_files_are_told_as_each_alone(
    study: str, options: str, tmp_path: Path, program: Program
) -> None:
    kinds = {"top": TOP} if study == "precess" else KINDS
    files = documents(tmp_path, kinds, 40 if study == "precess" else 10)
    together = program(study, *options.split(), *files)
    alone = [program(study, *options.split(), file) for file in files]
    assert together.out == "".join(one.out for one in alone)
    assert together.err == "".join(one.err for one in alone)
    assert together.code == max(one.code for one in alone)
    assert len(set(together.out.splitlines())) > len(files) / 4


def test_documents_that_differ_in_numbers_alone_are_worked_at_once(tmp_path: Path) -> None:
    kinds = {name: KINDS[name] for name in ("cube", "units", "refused", "symbol")}
    files = documents(tmp_path, kinds, 20)
    found = at_once([draft(file) for file in files], run)
    alike = [place for place, file in enumerate(files) if "cube, side: a" not in Path(file).read_text()]
    assert sorted(found) == [place for place in alike if "cylinder" not in Path(files[place]).read_text()]


def test_any_number_of_processes_writes_the_same(tmp_path: Path, program: Program) -> None:
    files = documents(tmp_path, KINDS, 20)
    for options in (["-f", "json"], ["-f", "csv"], ["-f", "csv", "--columns", "name,Ixx"]):
        one, two = (program("axes", "-j", jobs, *options, *files) for jobs in ("1", "2"))
        assert one == two
        assert one.code == 3


def test_files_beside_documents_in_different_folders_are_different(tmp_path: Path, program: Program) -> None:
    files = []
    for k in range(20):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / "cloud.csv").write_text(f"m,x,y,z\n{k + 1},0,0,0\n")
        (folder / "body.yaml").write_text(f"body: {{points: cloud.csv, position: [{k}, 0, 0]}}\n")
        files.append(str(folder / "body.yaml"))
    rows = program("inertia", "-f", "csv", "--columns", "mass,com_x", *files).out.splitlines()
    assert rows == ["mass,com_x", *(f"{k + 1}.0,{k}.0" for k in range(20))]


def test_what_is_written_is_not_what_is_read(tmp_path: Path, program: Program) -> None:
    cloud = tmp_path / "cloud.csv"
    cloud.write_text("m,x,y,z\n1,0,0,0\n2,1,1,0\n")
    files = []
    for k in range(10):
        files.append(str(tmp_path / f"{k}.yaml"))
        Path(files[-1]).write_text(f"body: {{points: cloud.csv, position: [{k}, 0, 0]}}\n")
    done = program("inertia", "-f", "json", "-o", str(cloud), *files)
    assert (done.code, cloud.read_text()[:4]) == (2, "m,x,")
