"""Period, action and turning points of one degree of freedom, against closed forms and the orbit itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mpmath
import pytest
import yaml

import rigidcli
from rigidcli.report import Report
from tests.conftest import Program
from tests.tables import rows_of

CASES = yaml.safe_load(Path(__file__).with_name("periods.yaml").read_text(encoding="utf-8"))
NAMES = {name: getattr(mpmath, name) for name in ("pi", "sqrt", "sin", "cos", "ellipk", "ellipe", "gamma")}


def known(text: Any) -> float:
    """The value of an entry of the table, which is ours: no text of a user."""
    quarter = {"quad": lambda f: mpmath.quad(f, [0, mpmath.pi / 2])}
    return float(eval(str(text), {"__builtins__": {}} | NAMES | quarter))


def followed(
    hamiltonian: str, start: list[Any], duration: float, *later: float, **parameters: float
) -> Report:
    q, p = map(known, start)
    document = {
        "parameters": parameters,
        "system": {"coordinates": ["x"], "hamiltonian": hamiltonian},
        "orbit": {"initial": {"x": q, "p_x": p}, "times": [0, duration, *later]},
    }
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document)))


@pytest.mark.parametrize("name", CASES)
def test_period_and_action_are_known_and_the_orbit_comes_back(name: str) -> None:
    case = CASES[name]
    period = known(case["period"])
    later = [case["followed"] * period] if "followed" in case else []
    found = followed(case["hamiltonian"], case["start"], period, *later, **case.get("parameters", {}))
    orbit = found["orbit"]
    assert found.notes == ()
    assert orbit["period"] == pytest.approx(period, rel=1e-10)
    if case["action"] is not None:
        assert orbit["action"] == pytest.approx(known(case["action"]), rel=1e-10)
    first, last = orbit["turning_points"]
    assert orbit["q"]["x"][1] == pytest.approx(orbit["q"]["x"][0], abs=1e-7 * (last - first))
    assert first <= orbit["q"]["x"][0] <= last


@pytest.mark.parametrize(
    ("hamiltonian", "start"),
    rows_of(__file__, "what does not move to and fro has no period"),
)
def test_what_does_not_move_to_and_fro_has_no_period(hamiltonian: str, start: list[float]) -> None:
    assert "period" not in followed(hamiltonian, start, 0.1)["orbit"]


def test_turning_points_may_be_asked_for_in_an_assignment(program: Program, tmp_path: Path) -> None:
    system = {"coordinates": ["x"], "hamiltonian": "p_x**2/2 + x**2/2"}
    swing = {"system": system, "orbit": {"initial": {"x": 2, "p_x": 0}, "duration": 1}}
    question = {"document": "swing.yaml", "ask": "hamilton.orbit.turning_points"}
    for name, content in (("swing", swing), ("work", {"assignment": "A", "questions": {"1": question}})):
        (tmp_path / f"{name}.yaml").write_text(json.dumps(content), encoding="utf-8")
    outcome = program("check", "--selftest", str(tmp_path / "work.yaml"))
    assert outcome.code == 0, outcome.err
    assert "[-2, 2]" in outcome.out


def test_near_a_separatrix_the_digits_are_told() -> None:
    k = mpmath.sqrt(1 - mpmath.mpf(10) ** -9)
    found = followed("p_x**2/2 - cos(x)", [0, str(2 * k)], 1)
    (note,) = found.notes
    assert "near the separatrix" in note
    assert found["orbit"]["period"] == pytest.approx(float(4 * mpmath.ellipk(k**2)), rel=1e-6)


def test_a_period_that_an_orbit_is_too_short_to_show_is_noted() -> None:
    found = followed("p_x**2/2 + p_x**4/4 + x**2/2", [1, 0], 2)
    assert "period" not in found["orbit"]
    (note,) = found.notes
    assert "does not come back in its duration" in note
