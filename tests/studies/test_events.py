"""Sections of orbits, against periods and scipy, and passes that lie close together."""

from __future__ import annotations

import json
import math
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rigidcli
from tests.conftest import ROOT


def _orbit(hamiltonian: str, **orbit: Any) -> Any:
    document = {"system": {"coordinates": ["x"], "hamiltonian": hamiltonian}, "orbit": orbit}
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document)))["orbit"]


def test_a_pendulum_passes_its_lowest_point_once_in_a_period() -> None:
    start = {"x": 2 * math.pi / 3, "p_x": 0}
    found = _orbit("p_x**2/2 - 9.81*cos(x)", initial=start, duration=30, section={"at": "x"})
    period = float(4 * mpmath.ellipk(mpmath.sin(mpmath.pi / 3) ** 2) / mpmath.sqrt(9.81))
    passes = (np.arange(int(30 / period + 0.25)) + 0.75) * period
    assert found["t"] == pytest.approx(passes, rel=1e-11)


@pytest.mark.parametrize("method", ["auto", "stiff"])
@pytest.mark.parametrize("apart", [1e-2, 1e-3, 1e-4])
def test_passes_that_lie_close_together_are_found(apart: float, method: str) -> None:
    section = {"at": f"x - cos({apart / 2!r})", "direction": "both"}
    found = _orbit(
        "(p_x**2 + x**2)/2", initial={"x": 1, "p_x": 0}, duration=20, section=section, method=method
    )
    turns = [2 * math.pi * turn + side * apart / 2 for turn in range(4) for side in (-1, 1)][1:]
    # The slope is as small as they are near: what the orbit is off counts 1/slope times.
    assert found["t"] == pytest.approx(turns, abs=1e-10 / apart)


def test_crossings_of_henon_and_heiles_are_those_of_another_integration() -> None:
    document = rigidcli.load(ROOT / "configs" / "henon_heiles_section.yaml", settings=["orbit.duration=130"])
    found = rigidcli.hamilton(document)["orbit"]

    def rates(t: float, z: Any) -> list[float]:
        x, y, px, py = z
        return [px, py, -x - 2 * x * y, -y - x * x + y * y]

    def passes(t: float, z: Any) -> float:
        return float(z[0])

    passes.direction = 1  # type: ignore[attr-defined]
    y, py = 0.1, 0.1
    start = [0, y, math.sqrt(1 / 6 - py**2 - y**2 + 2 * y**3 / 3), py]
    known = solve_ivp(rates, (0, 130), start, method="DOP853", rtol=3e-14, atol=1e-15, events=passes)
    assert known.t_events is not None
    assert known.y_events is not None
    times, states = known.t_events[0], known.y_events[0]
    late = times > 1e-6  # scipy counts the start
    assert found["t"] == pytest.approx(times[late], rel=1e-9)
    assert found["q"]["y"] == pytest.approx(states[late, 1], abs=1e-9)
    assert np.abs(found["q"]["x"]).max() < 1e-12
