"""Constraints, their forces, and bodies in space, by tables: closed forms, and other coordinates."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

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
