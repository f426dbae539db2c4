"""What a fresh interpreter loads: a program that is called in loops must start quickly."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

HEAVY = {
    *("numpy", "scipy", "sympy", "mpmath", "pint", "yaml", "rich", "orjson", "matplotlib", "plotext"),
    *("latex2mathml", "xml", "pydantic"),
}
FEW = {"numpy", "yaml", "orjson", "pydantic"}

RUNNER = """
import contextlib, io, json, sys
from rigidcli.__main__ import main
_, commands, document = sys.argv
after = []
for words in json.loads(commands):
    sys.argv, sys.stdin = ["rigidcli", *words.split()], io.TextIOWrapper(io.BytesIO(document.encode()))
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as out:
        main()
    assert out.getvalue(), words
    after.append([*sys.modules])
print(json.dumps(after))
"""


def loaded(script: str, *arguments: str) -> list[set[str]]:
    """The modules of a fresh interpreter, as a script prints them."""
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return [set(names) for names in json.loads(done.stdout)]


def imported(*words: str, code: int = 0) -> set[str]:
    """The modules that the program loads in a process of its own, which ends with this exit code."""
    command = [sys.executable, "-X", "importtime", "-m", "rigidcli", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == code
    return {*done.stderr.split()}


def heavy(names: set[str]) -> set[str]:
    return {name.partition(".")[0] for name in names} & HEAVY


UNITS = """
parameters: {a: 5 cm, b: a/2}
body: {shape: box, size: [a, b, 30 mm], density: 2.7 g/cm^3}
frame: {axis: [0, 0, 1], angle: 30 deg}
motion: {omega: [0, 0, 1800 rpm]}
"""

NOTHING = ("--version", "--help", "euler --help", "check --help", "new points", "explain axes.groups")
NUMBERS = (
    "axes -f json -",
    "euler -f json --duration 0.1 configs/tennis_racket.yaml",
    "euler -f json --duration 0.1 configs/driven_gyro.yaml",
    "precess -f json configs/cone_top.yaml configs/earth.yaml",
    "hamilton -f json -s orbit.duration=0.1 configs/double_pendulum.yaml",
)
TABLES = ("axes configs/known_tensor.yaml", "hamilton configs/taylor_13_06.yaml")


@pytest.mark.parametrize(
    ("commands", "allowed"),
    [(NOTHING, set()), (NUMBERS, FEW), (TABLES, FEW)],
    ids=["nothing", "numbers", "tables"],
)
def test_commands_load_what_they_need(commands: tuple[str, ...], allowed: set[str]) -> None:
    """Help needs no models, numbers no algebra, everyday units no pint, and a table in a pipe no rich."""
    after = loaded(RUNNER, json.dumps(commands), UNITS)
    assert len(after) == len(commands)
    for command, names in zip(commands, after, strict=True):
        assert heavy(names) <= allowed, command
        assert "numpy.ma" not in names, command


@pytest.mark.parametrize("option", ["--compare", "--plot=body.txt", "--plot-kind=none"])
def test_a_wrong_option_is_told_before_documents_can_be_read(option: str) -> None:
    assert not {"numpy", "pydantic", "yaml"} & imported("axes", option, "configs/cube_corner.yaml", code=2)


def test_functions_load_what_their_documents_need() -> None:
    script = """
import json, sys, rigidcli
after = [[*sys.modules]]
for study, path in zip(sys.argv[1::2], sys.argv[2::2]):
    getattr(rigidcli, study)(f"configs/{path}.yaml")
    after.append([*sys.modules])
print(json.dumps(after))
"""
    words = "axes cube_corner axes water axes earth_shells axes benzene axes bracket euler feynman_plate"
    start, *shapes, benzene, bracket, _, motion = loaded(script, *words.split(), "hamilton", "notes_spring")
    assert heavy(start) == set()
    files = {
        "mesh_files",
        "molecules",
        "robot_formats",
        "surfaces",
    }
    files = {f"rigidcli.bodies.{name}" for name in files} | {"pyexpat"}
    assert all(not files & names for names in shapes)
    assert files & benzene == {"rigidcli.bodies.molecules"}
    assert {"rigidcli.bodies.mesh_geometry", "rigidcli.bodies.mesh_files"} <= bracket
    assert "pyexpat" not in bracket
    assert not {name for name in motion if name.startswith("rigidcli.render") or name.endswith(".scene")}


def test_a_plate_needs_no_other_shapes() -> None:
    document = "body: {shape: plate, size: [1, 2], mass: 3}"
    (found,) = loaded(RUNNER, json.dumps(["axes -f json -"]), document)
    others = ("document.slips", "picture", "program", "scene")
    assert not {f"rigidcli.{name}" for name in others} & found
    script = """
import json, sys, rigidcli
rigidcli.loads(sys.argv[1])
from rigidcli.bodies.shapes import Lamina, Shell, Solid, Wire
made = [section.__name__ for kind in (Lamina, Shell, Solid, Wire) for section in kind.__subclasses__()]
print(json.dumps([made]))
"""
    assert loaded(script, document) == [{"Plate"}]


def test_plain_numbers_need_no_expressions_units_or_systems() -> None:
    (found,) = loaded(RUNNER, json.dumps(["axes -f json -"]), "body: {shape: cube, side: 1, mass: 12}")
    sections = ("parameters", "phase_space", "system", "motion", "sampling", "sweeps")
    unused = {f"rigidcli.document.{name}" for name in sections}
    assert (
        not (unused | {"rigidcli.fields.units", "rigidcli.language.expression", "rigidcli.language.tokens"})
        & found
    )


def test_homework_is_judged_without_scipy(tmp_path: Path) -> None:
    """It takes half a second to load, and makes each process that judges a file larger."""
    (tmp_path / "assignment.yaml").write_text(
        "questions:\n"
        f"  a: {{document: {ROOT}/configs/three_masses.yaml, ask: axes}}\n"
        f"  h: {{document: {ROOT}/configs/taylor_13_02.yaml, ask: hamilton.hamiltonian}}\n"
        "  v: {kind: vector, answer: [1, 2, 3]}\n"
    )
    (tmp_path / "s.yaml").write_text("answers: {h: 0.500*p_x**2/m - 1.1*m*g*x, v: [3, 2, 1]}")
    (found,) = loaded(RUNNER, json.dumps([f"check {tmp_path}/assignment.yaml {tmp_path}/s.yaml"]), "")
    assert "scipy" not in found
