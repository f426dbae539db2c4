"""Steps: no coordinate is cyclic across one, no quantity is conserved, and no orbit passes."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import rigidcli
from rigidcli.errors import ComputationError

STEPS = yaml.safe_load(Path(__file__).with_name("steps.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("potential", "cyclic", "places"), STEPS)
def test_a_step_is_no_constant(potential: str, cyclic: list[str], places: list[str]) -> None:
    found = rigidcli.hamilton(
        rigidcli.loads(
            "system: {coordinates: [x, y], kinetic: (xdot**2 + ydot**2)/2, potential: " + potential + "}\n"
            "parameters: {c: null}\n"
        )
    )
    assert found["cyclic"] == cyclic
    assert found["conserved"] == [*(f"p_{q}" for q in cyclic), "H"]
    steps = [note for note in found.notes if "has a step where" in note]
    assert all(f"where {place} = 0" in note for place, note in zip(places, steps, strict=True))
    if "x" not in cyclic:
        assert not any(str(e) in ("p_x", "x*p_y - y*p_x") for e in found["invariants"])


def test_a_step_in_time_is_no_constant() -> None:
    found = rigidcli.hamilton(
        rigidcli.loads("system: {coordinates: [x], hamiltonian: p_x**2/2 + sign(t - 1)}\n")
    )
    assert found["conserved"] == ["p_x"]
    assert found["explicit_time"] is True


@pytest.mark.parametrize("potential", ["c*sign(x)", "c*abs(p_x)/p_x"])
def test_orbits_do_not_pass_steps(potential: str) -> None:
    document = rigidcli.loads(
        f"system: {{coordinates: [x], hamiltonian: p_x**2/2 + {potential}}}\nparameters: {{c: 1}}\n"
        "orbit: {initial: {x: -1, p_x: 3}, duration: 1}\n"
    )
    with pytest.raises(ComputationError, match="H has a step where") as caught:
        rigidcli.hamilton(document)
    assert "tanh" in (caught.value.hint or "")


def test_a_kink_is_passed() -> None:
    found = rigidcli.hamilton(
        rigidcli.loads(
            "system: {coordinates: [x], kinetic: xdot**2/2, potential: abs(x)}\n"
            "orbit: {initial: {x: -1, p_x: 0}, times: [0, 1]}\n"
        )
    )
    # x = -1 + t^2/2 until x = 0 at t = sqrt(2).
    assert found["orbit"]["q"]["x"][1] == pytest.approx(-0.5, rel=1e-10)
