"""Constraints and their forces, by the table constraints.yaml: closed forms, and other coordinates."""

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

CASES = truths(Path(__file__).with_name("constraints.yaml"))


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
    if "orbit" in found:
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
