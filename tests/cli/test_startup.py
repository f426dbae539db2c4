"""What a fresh interpreter loads: a program that is called in loops must start quickly."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

HEAVY = {
    *("numpy", "scipy", "sympy", "mpmath", "pint", "yaml", "rich", "orjson", "matplotlib", "plotext"),
    *("latex2mathml", "xml"),
}

RUNNER = """
import atexit, sys
sys.argv = ["rigidcli", *sys.argv[1:]]
atexit.register(lambda: print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr))
from rigidcli.__main__ import main
main()
"""


def loaded(*arguments: str, stdin: str = "") -> set[str]:
    """The heavy packages that a run of the program has loaded at its end."""
    done = subprocess.run(
        [sys.executable, "-c", RUNNER, *arguments],
        cwd=ROOT,
        input=stdin,
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert done.stdout
    return set(done.stderr.split()) & HEAVY


UNITS = """
parameters: {a: 5 cm, b: a/2}
body: {shape: box, size: [a, b, 30 mm], density: 2.7 g/cm^3}
frame: {axis: [0, 0, 1], angle: 30 deg}
motion: {omega: [0, 0, 1800 rpm]}
"""


@pytest.mark.parametrize(
    "arguments",
    [
        *("--version", "--help", "euler --help", "check --help", "new points"),
        *("explain axes.groups", "explain units"),
    ],
)
def test_what_computes_nothing_loads_nothing(arguments: str) -> None:
    assert loaded(*arguments.split()) == set()


@pytest.mark.parametrize(
    "arguments",
    [
        "axes -",
        *(f"euler --duration 0.1 configs/{name}.yaml" for name in ("tennis_racket", "driven_gyro")),
        *(f"precess configs/{name}.yaml" for name in ("cone_top", "earth")),
        *(f"hamilton -s orbit.duration=0.1 configs/{name}.yaml" for name in ("double_pendulum",)),
    ],
)
def test_numbers_need_no_algebra_and_everyday_units_no_pint(arguments: str) -> None:
    assert loaded(*arguments.split(), "-f", "json", stdin=UNITS) == {"numpy", "yaml", "orjson"}


@pytest.mark.parametrize(
    "arguments", ["axes configs/known_tensor.yaml", "hamilton configs/taylor_13_06.yaml"]
)
def test_a_table_in_a_pipe_needs_no_rich(arguments: str) -> None:
    assert loaded(*arguments.split()) <= {"numpy", "yaml", "orjson"}


def test_numbers_load_nothing_of_pictures_and_replays() -> None:
    script = "import sys, rigidcli as r; r.euler(sys.argv[1]); r.hamilton(sys.argv[2]); print(*sys.modules)"
    files = ("configs/feynman_plate.yaml", "configs/notes_spring.yaml")
    done = subprocess.run(
        [sys.executable, "-c", script, *files], cwd=ROOT, capture_output=True, text=True, check=True
    )
    ours = {name for name in done.stdout.split() if name.startswith("rigidcli.")}
    assert not {name for name in ours if name.startswith("rigidcli.render") or name.endswith(".scene")}


def test_what_reads_meshes_molecules_and_robots_is_loaded_for_them_alone() -> None:
    script = """
import sys, rigidcli
for path in sys.argv[1:]:
    rigidcli.axes(path)
    print(*(name for name in sys.modules if name.startswith("rigidcli.") or name == "pyexpat"))
"""
    files = ["cube_corner", "water", "earth_shells", "benzene", "bracket"]
    done = subprocess.run(
        [sys.executable, "-c", script, *(f"configs/{name}.yaml" for name in files)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    parts = {
        *(f"rigidcli.bodies.{name}" for name in ("edges", "inside", "mesh_density", "surfaces")),
        *(
            f"rigidcli.bodies.{name}"
            for name in ("mesh_checks", "mesh_files", "molecules", "robots.elements")
        ),
        "pyexpat",
    }
    shapes, *_, earth, benzene, bracket = (parts & set(line.split()) for line in done.stdout.splitlines())
    assert shapes == earth == set()
    assert benzene == {"rigidcli.bodies.molecules"}
    assert {"rigidcli.bodies.inside", "rigidcli.bodies.mesh_files"} <= bracket
    assert not {"pyexpat", "rigidcli.bodies.mesh_density"} & bracket


def test_a_plate_needs_no_other_shapes() -> None:
    script = """
import os, sys
sys.argv = ["rigidcli", "axes", "-", "-f", "json"]
os._exit = lambda code: print(*sys.modules, file=sys.stderr)
from rigidcli.__main__ import run
run()
"""
    document = "body: {shape: plate, size: [1, 2], mass: 3}"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, input=document, capture_output=True, text=True, check=True
    )
    found = set(done.stderr.split())
    assert "rigidcli.bodies.flat_shapes" in found
    others = (
        "bodies.solid_shapes",
        "bodies.thin_shapes",
        "document.complaints",
        "document.precession",
        "picture",
        "program",
        "scene",
    )
    assert not {f"rigidcli.{name}" for name in others} & found


def test_homework_is_judged_without_scipy(tmp_path: Path) -> None:
    """It takes half a second to load, and makes each process that judges a file larger."""
    (tmp_path / "assignment.yaml").write_text(
        "questions:\n"
        f"  a: {{document: {ROOT}/configs/three_masses.yaml, ask: axes}}\n"
        f"  h: {{document: {ROOT}/configs/taylor_13_02.yaml, ask: hamilton.hamiltonian}}\n"
        "  v: {kind: vector, answer: [1, 2, 3]}\n"
    )
    (tmp_path / "s.yaml").write_text("answers: {h: 0.500*p_x**2/m - 1.1*m*g*x, v: [3, 2, 1]}")
    script = """
import sys
from rigidcli.cli.app import main
try:
    main()
finally:
    print("scipy" in sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-c", script, "check", "assignment.yaml", "s.yaml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines()[-1] == "False"
    assert done.returncode == 1


def test_the_package_itself_loads_nothing() -> None:
    script = "import sys, rigidcli; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) & HEAVY == set()
