"""Observables, their rates and means, and brackets, by the table observables.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Program
from tests.truths import require, truths


@pytest.mark.parametrize("case", truths(Path(__file__).with_name("observables.yaml")))
def test_observables_come_to_this(case: dict[str, Any], program: Program) -> None:
    require(case, program)


def test_each_observable_has_a_column_and_a_panel(program: Program) -> None:
    document = """
        system: {coordinates: [x], kinetic: xdot^2/2, potential: x^2/2}
        observables: {a2: x^2 + p_x^2, v: xdot}
        orbit: {initial: START, times: [0, 1]}
    """
    several = document.replace("START", "[{x: 1, p_x: 0}, {x: 2, p_x: 0}]")
    rows = program("hamilton", "-f", "csv", "-", stdin=several).out.split()
    assert rows[0] == "start,t,x,p_x,H,a2,v"
    assert [round(float(row.split(",")[5]), 9) for row in rows[1:]] == [1, 1, 4, 4]
    alone = document.replace("START", "{x: 1, p_x: 0}")
    outcome = program("hamilton", "-", "--plot", "-", "--plot-kind", "observables", stdin=alone)
    assert outcome.code == 0
    assert "a2" in outcome.out
