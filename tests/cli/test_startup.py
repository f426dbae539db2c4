"""What a fresh interpreter loads: a program that is called in loops must start quickly."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.conftest import ROOT

HEAVY = {"numpy", "scipy", "sympy", "mpmath", "pint", "yaml", "rich", "orjson", "matplotlib"}

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


@pytest.mark.parametrize(
    "arguments", [["--version"], ["--help"], ["axes", "--help"], ["new", "points"]], ids=" ".join
)
def test_what_computes_nothing_loads_nothing(arguments: list[str]) -> None:
    assert loaded(*arguments) == set()


def test_a_document_of_numbers_loads_what_it_needs() -> None:
    assert loaded("axes", "-f", "json", "configs/cube_corner.yaml") == {"numpy", "yaml", "orjson"}


@pytest.mark.parametrize("config", ["tennis_racket", "cone_top", "damped_satellite", "driven_gyro"])
def test_motion_needs_numbers_alone(config: str) -> None:
    arguments = ("--duration", "0.1", "-f", "csv", f"configs/{config}.yaml")
    assert loaded("euler", *arguments) == {"numpy", "yaml", "orjson"}


@pytest.mark.parametrize("config", ["cone_top", "earth", "feynman_plate"])
def test_precession_needs_numbers_alone(config: str) -> None:
    assert loaded("precess", "-f", "json", f"configs/{config}.yaml") == {"numpy", "yaml", "orjson"}


def test_everyday_units_do_not_load_pint() -> None:
    document = (
        "parameters: {a: 5 cm, b: a/2}\n"
        "body: {shape: box, size: [a, b, 30 mm], density: 2.7 g/cm^3}\n"
        "frame: {axis: [0, 0, 1], angle: 30 deg}\n"
        "motion: {omega: [0, 0, 1800 rpm]}\n"
    )
    assert loaded("axes", "-f", "json", "-", stdin=document) == {"numpy", "yaml", "orjson"}


def test_a_table_needs_rich_and_no_algebra() -> None:
    assert loaded("axes", "configs/known_tensor.yaml") <= {"numpy", "yaml", "orjson", "rich"}


def test_the_package_itself_loads_nothing() -> None:
    script = "import sys, rigidcli; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) & HEAVY == set()


@pytest.mark.parametrize("config", ["notes_spring", "double_pendulum", "relativistic_oscillator"])
def test_a_hamiltonian_needs_no_sympy(config: str) -> None:
    arguments = ("-f", "json", "-s", "orbit.duration=0.1", f"configs/{config}.yaml")
    assert loaded("hamilton", *arguments) == {"numpy", "yaml", "orjson"}


def test_a_hamiltonian_with_symbols_needs_no_sympy() -> None:
    assert loaded("hamilton", "configs/taylor_13_06.yaml") <= {"numpy", "yaml", "orjson", "rich"}
