"""Constraints, their forces, and bodies in space, by tables: closed forms, and other coordinates."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rigidcli.language.expression import array, real
from rigidcli.language.parser import read
from tests.conftest import Program
from tests.truths import at, expected, truths

TABLES = [Path(__file__).with_name(name) for name in ("constraints.yaml", "bodies_in_space.yaml")]
CASES = [case for table in TABLES for case in truths(table)]


def _run(program: Program, document: str) -> Any:
    source = document if document.endswith(".yaml") else "-"
    outcome = program("hamilton", "-f", "json", source, stdin=document)
    assert outcome.code == 0, outcome.err
    return json.loads(outcome.out)


@pytest.mark.parametrize("case", CASES)
def test_constraint_forces_and_motions_are_known(case: dict[str, Any], program: Program) -> None:
    found = _run(program, case["document"])
    chance = random.Random(case["source"])
    on = {name: read(text)[0] for name, text in case.get("state", {}).items()}
    for path, text in case.get("forms", {}).items():
        (one, inside), (two, further) = read(at(found, path)), read(text)
        inner = frozenset[str]().union(*(read(text)[1] for text in case.get("state", {}).values()))
        for _ in range(3):
            values = {name: chance.uniform(0.3, 1.4) for name in sorted(inside | further | inner)}
            for name, root in on.items():
                values[name] = real(root, values)
            assert real(one, values) == pytest.approx(real(two, values), rel=1e-9, abs=1e-12), path
    names = dict[str, float]()
    for name, text in case.get("where", {}).items():
        names[name] = real(read(str(text))[0], names)
    for path, value in case.get("gives", {}).items():
        assert at(found, path) == expected(value, names, 1e-8), path
    for path, value in case.get("near", {}).items():  # to first order in 1e-6
        assert at(found, path) == pytest.approx(expected(value, names, 1e-8).expected, abs=1e-10), path
    if "orbit" in found and "constraints" in found:
        assert max(found["orbit"]["drift"][one["name"]] for one in found["constraints"]) < 1e-9
    assert "orbit" not in found or found["orbit"]["trusted_digits"] > 7
    if "motion" in case:
        other = _run(program, case["motion"]["document"])
        columns, reached = (_columns(result["orbit"]) for result in (found, other))
        for name, text in case["motion"]["columns"].items():
            there = array(read(text)[0], reached)
            assert np.abs(columns[name] - there).max() < 1e-7 * np.abs(there).max(), name


def _columns(orbit: dict[str, Any]) -> dict[str, Any]:
    columns = {"t": orbit["t"], **orbit["q"], **orbit["p"], **orbit.get("multipliers", {})}
    return {name: np.array(values) for name, values in columns.items()}


def test_a_body_in_space_nods_as_the_top_does(program: Program) -> None:
    top = (
        "top: {mass: 0.1, distance: 0.04, lambda1: 2e-4, lambda3: 5e-5, spin: 200, tilt: 0.6, gravity: 9.81}"
    )
    told = json.loads(program("precess", "-f", "json", "-", stdin=top).out)["top"]
    period, spin = told["nutation_period"], 200
    document = f"""
        system:
          coordinates: [phi, theta, psi]
          particles:
          - {{moments: [2e-4, 2e-4, 5e-5], euler: [phi, theta, psi], potential: 0.1*9.81*0.04*cos(theta)}}
        orbit:
          initial: {{phi: 0, theta: 0.6, psi: 0, phidot: 0, thetadot: 0, psidot: {spin}}}
          times: [{period / 2!r}, {period!r}]
    """
    q = _run(program, document)["orbit"]["q"]
    assert q["theta"] == pytest.approx([told["theta_max"], told["theta_min"]], rel=1e-9)
    assert q["phi"][1] == pytest.approx(told["precession_per_nutation"], rel=1e-9)


def test_starts_of_an_ensemble_keep_their_constraints(program: Program) -> None:
    document = """
        system:
          coordinates: [x, y]
          kinetic: (xdot^2 + ydot^2)/2
          potential: 9.81*y
          constraints: {N: x^2 + y^2 = 1}
        orbit: {initial: STARTS, times: [0, 1, 2]}
    """
    starts = ["{x: 1, y: 0, xdot: 0, ydot: 0}", "{x: 0, y: -1, xdot: 2, ydot: 0}"]

    def rows(initial: str) -> list[list[float]]:
        outcome = program("hamilton", "-f", "csv", "-", stdin=document.replace("STARTS", initial))
        return [list(map(float, row.split(","))) for row in outcome.out.split()[1:]]

    together = [row[1:] for row in rows(f"[{', '.join(starts)}]")]
    single = [row for one in starts for row in rows(one)]
    assert np.array(together) == pytest.approx(np.array(single), rel=1e-9, abs=1e-9)


def test_a_snakeboard_gathers_speed_by_its_rotor(program: Program) -> None:
    """J. Ostrowski, A. Lewis, R. Murray, J. Burdick, Nonholonomic mechanics and locomotion, ICRA 1994.

    Along the board, with the wheels turned by f and -f and the rotor by s, (mu u)' = K s'' tan(f)/(r mu),
    where mu^2 = m + I tan(f)^2/r^2 and I is the moment of inertia of all.
    """
    m, r, J, K, W = 6.0, 0.5, 0.2, 0.1, 0.05
    document = f"""
        system:
          coordinates: [x, y, th, s, f]
          kinetic: {m}*(xdot^2 + ydot^2)/2 + {J}*thdot^2/2 + {K}*(sdot + thdot)^2/2 + {W}*(thdot^2 + fdot^2)
          potential: 0
          constraints:
          - -sin(th + f)*xdot + cos(th + f)*ydot - {r}*cos(f)*thdot
          - -sin(th - f)*xdot + cos(th - f)*ydot + {r}*cos(f)*thdot
          - s = 0.7*sin(1.5*t)
          - f = 0.5 + 0.3*sin(1.5*t)
        orbit:
          initial: {{x: 0, y: 0, th: 0, s: 0, f: 0.5, xdot: 0, ydot: 0, thdot: 0, sdot: 1.05, fdot: 0.45}}
          times: [0, 3, 10]
    """
    found = _run(program, document)["orbit"]

    def mu(t: float) -> float:
        return math.sqrt(m + (J + K + 2 * W) * (math.tan(0.5 + 0.3 * math.sin(1.5 * t)) / r) ** 2)

    def gain(t: float) -> float:
        return -K * 0.7 * 2.25 * math.sin(1.5 * t) * math.tan(0.5 + 0.3 * math.sin(1.5 * t)) / (r * mu(t))

    for k in (1, 2):
        at_k = {name: values[k] for name, values in {**found["q"], **found["p"]}.items()}
        u = (at_k["p_x"] * math.cos(at_k["th"]) + at_k["p_y"] * math.sin(at_k["th"])) / m
        assert u == pytest.approx(quad(gain, 0, found["t"][k], epsabs=1e-13)[0] / mu(found["t"][k]), rel=1e-8)


def test_a_force_of_constraint_may_be_asked_for(program: Program, tmp_path: Path) -> None:
    (tmp_path / "hoop.yaml").write_text(
        "parameters: {M: null, R: null, g: null, al: null}\n"
        "system:\n  coordinates: [x, phi]\n  lagrangian: M*xdot**2/2 + M*R**2*phidot**2/2 + M*g*x*sin(al)\n"
        "  constraints: {friction: xdot = R*phidot}\n"
    )
    asked = "assignment: A\nquestions:\n  1: {document: hoop.yaml, ask: hamilton.constraint_forces.x}\n"
    (tmp_path / "a.yaml").write_text(
        asked + "  2: {document: hoop.yaml, ask: hamilton.multipliers.friction}\n"
    )
    (tmp_path / "ada.yaml").write_text("answers: {1: -M g sin(al)/2, 2: M g sin(al)/2}\n")
    outcome = program("check", str(tmp_path / "a.yaml"), str(tmp_path / "ada.yaml"), "-f", "csv")
    verdicts = [row.split(",")[2] for row in outcome.out.splitlines()[1:]]
    assert verdicts == ["correct", "incorrect"]


def test_a_program_says_that_its_orbit_drifts_away_from_constraints(program: Program) -> None:
    outcome = program("hamilton", "-f", "python", "configs/skate_on_slope.yaml")
    assert outcome.code == 0
    assert "drifts away" in outcome.out
    assert "in the program the constraints are differentiated" in outcome.err
