"""The units of results: those that people choose, and those that json and csv tell."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from tests.conftest import Program

SPINNING = """
body: {shape: cylinder, radius: 0.1, height: 0.2, mass: 2}
motion: {omega: [0, 3, 4], duration: 60, samples: 3}
"""


@pytest.mark.parametrize(
    ("units", "title", "expected"),
    [
        ("g", "mass", "g 2000"),
        ("lb", "mass", f"lb {2 / 0.45359237:.6g}"),
        ("g,cm", "inertia tensor about O", "g cm^2"),
        ("g,cm", "kinetic energy", "g cm^2/s^2"),
        ("erg", "kinetic energy", "erg"),
        ("deg", "angular velocity", f"deg/s (0, {math.degrees(3):.6g}, {math.degrees(4):.6g})"),
        ("rpm,deg", "angular velocity", f"rpm (0, {3 * 30 / math.pi:.6g}, {4 * 30 / math.pi:.6g})"),
        ("min", "angular velocity", "rad/min (0, 180, 240)"),
        ("rpm", "mass", "kg 2"),
        ("deg", "kinetic energy", "J"),
        ("g cm^2", "principal moments", "g cm^2"),
    ],
)
def test_people_choose_units(units: str, title: str, expected: str, program: Program) -> None:
    outcome = program("axes", "-", "--units", units, stdin=SPINNING)
    (line,) = (line for line in outcome.out.splitlines() if line.startswith(title))
    assert " ".join(line.removeprefix(title).split()).startswith(expected)
    assert (outcome.code, outcome.err) == (0, "")


def test_tables_and_exact_numbers_are_in_these_units_too(program: Program) -> None:
    out = program("euler", "-", "--units", "min,deg", "--columns", "t,w2", stdin=SPINNING).out
    assert "t (min)  w2 (deg/min)" in out
    assert "\n      1  " in out
    exact = program(
        "inertia", "--exact", "-", "--units", "g,cm", stdin="body: {shape: cube, side: 0.5, mass: 3}"
    )
    assert "3000" in exact.out
    assert "1250000" in exact.out
    latex = program("inertia", "-", "-f", "latex", "--units", "g", stdin=SPINNING).out
    assert r"M &= 2000\,\mathrm{g}" in latex
    symbols = program(
        "inertia", "-", "--units", "g", stdin="parameters: {M: null}\nbody: {shape: cube, side: 1, mass: M}"
    )
    assert " M/6" in symbols.out


@pytest.mark.parametrize("form", ["json", "csv"])
def test_programs_get_si_units(form: str, program: Program) -> None:
    plain = program("axes", "-", "-f", form, stdin=SPINNING)
    asked = program("axes", "-", "-f", form, "--units", "g,cm", stdin=SPINNING)
    assert (asked.code, asked.out) == (0, plain.out)
    assert "note: " in asked.err
    assert plain.err == ""


def test_json_tells_its_units_last(program: Program) -> None:
    result = json.loads(program("euler", "-f", "json", "-", stdin=SPINNING).out)
    assert list(result)[-1] == "units"
    assert result["units"]["trajectory.angular_momentum"] == "kg m^2/s"
    assert result["units"]["stability.rate"] == "1/s"
    assert "trajectory.orientation" not in result["units"]
    top = "top: {mass: 1, distance: 0.1, lambda3: 0.02, spin: 100}"
    result = json.loads(program("precess", "-f", "json", "-", stdin=top).out)
    assert (result["units"]["top.spin"], result["units"]["top.torque"]) == ("rad/s", "N m")


def test_csv_tells_units_in_its_heads_when_asked(program: Program) -> None:
    head = program("euler", "-f", "csv", "--unit-header", "-", stdin=SPINNING).out.splitlines()[0]
    assert head.startswith("t (s),w1 (rad/s),")
    assert ",q0,q1,q2,q3,Lx (kg m^2/s)," in head
    assert program("euler", "-f", "csv", "-", stdin=SPINNING).out.startswith("t,w1,w2,w3,L1,")
    bare = program("inertia", "-f", "csv", "--unit-header", "--no-header", "-", stdin=SPINNING).out
    assert "kg" not in bare


def test_diagnostics_are_told_when_asked_for(program: Program) -> None:
    quiet = program("euler", "-", stdin=SPINNING).out
    told = program("euler", "-", "-v", stdin=SPINNING).out
    for words in ("method", "digits of the orientation", "drift of the energy"):
        assert words not in quiet
        assert words in told
    spring = """
system: {coordinates: [x], lagrangian: xdot**2/2 - x**2/2}
orbit: {initial: {x: 1, p_x: 0}, duration: 6}
"""
    quiet = program("hamilton", "-", stdin=spring).out
    told = program("hamilton", "-", "--verbose", stdin=spring).out
    for words in ("method", "digits of the orbit", "residual", "drift of H"):
        assert words not in quiet
        assert words in told


def test_few_digits_to_trust_are_always_told(program: Program) -> None:
    chaos = """
system: {coordinates: [x, y], lagrangian: (xdot**2 + ydot**2)/2 - (x**2 + y**2)/2 - x**2*y + y**3/3}
orbit: {initial: {x: 0, y: -0.15, p_x: 0.55, p_y: 0}, duration: 300, samples: 3}
"""
    result = json.loads(program("hamilton", "-", "-f", "json", stdin=chaos).out)
    assert result["orbit"]["trusted_digits"] < 6
    assert "reliable digits of the orbit" in program("hamilton", "-", stdin=chaos).out


def test_samples_are_chosen_on_the_command_line(program: Program) -> None:
    free = "system: {coordinates: [x], lagrangian: xdot**2/2}\norbit: {initial: {x: 0, p_x: 2}, duration: 1}"
    options = ("--duration", "1 min", "--samples", "3", "--columns", "t,x")
    table = program("hamilton", "-", "-f", "csv", *options, stdin=free)
    assert table.out.splitlines()[0] == "t,x"
    rows = [[*map(float, line.split(","))] for line in table.out.splitlines()[1:]]
    assert np.allclose(rows, [[0, 0], [30, 60], [60, 120]], rtol=1e-12)
    orbit = json.loads(program("hamilton", "-", "-f", "json", *options, stdin=free).out)["orbit"]
    assert (orbit["t"], list(orbit["q"])) == ([0, 30, 60], ["x"])
    assert not {"p", "H"} & orbit.keys()
    wrong = program("hamilton", "-", "--columns", "t,y", stdin=free)
    assert (wrong.code, wrong.out) == (2, "")
    assert "`y` is no column here\n  hint: the columns are t, x, p_x, H" in wrong.err


def test_noise_is_no_number_for_people(program: Program) -> None:
    wheel = """
body: {shape: cylinder, radius: 0.3, height: 0.1, mass: 7}
motion: {omega: [0, 0, 157.07963267948966], duration: 0.4, step: 0.08}
"""
    lines = program("euler", "-", stdin=wheel).out.splitlines()
    assert all("e-1" not in line for line in lines)
